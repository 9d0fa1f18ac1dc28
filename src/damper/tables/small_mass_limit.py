"""The small-mass limit beside the computed border between complete and incomplete bursts."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar

from pydantic import Field

from damper.analysis.labels import label_of
from damper.analysis.places import places, rows_at
from damper.analysis.small_mass_limit import gap_axis, small_mass_border
from damper.parameters.lazy import pd
from damper.study import products
from damper.study.messages import Mistakes
from damper.study.yaml_file import join_names
from damper.tables import Table, number, place_cells


class SmallMassLimit(products.Product):
    """The border between complete and incomplete bursts beside its small-mass limit."""

    needs = ("bursts",)
    of_theory: ClassVar[bool] = True

    resolution: Annotated[
        float, Field(gt=0, description="Restitution to which borders are bisected.")
    ] = 1e-4

    def check_against(self, study: products.StudyContents, mistakes: Mistakes) -> None:
        super().check_against(study, mistakes)
        products.need_one_run(study, mistakes, bisected="borders")
        for names in (("restitution",), products.FREE_TRAVEL):
            found = next((name for name in names if name in study.axes), None)
            if found is None:
                mistakes.add((), f"needs an axis of the {' or '.join(names)}", join_names(names))
            else:
                products.count_values(
                    (), found, study.axes[found], products.Role(least=2), mistakes
                )


def make(results: Mapping[str, Any], settings: SmallMassLimit) -> Table:
    """Show how far border and limit lie apart."""
    cube = results["cube"]
    data = small_mass_border(cube, settings.resolution)
    over = gap_axis(cube)
    what = label_of(over)
    largest = number(data["difference"].abs().max(), ".1e")
    rows = [
        place_cells(where) | _distances(rows_at(data, where), what)
        for where in places(cube.complete_fraction, over, "restitution")
    ]
    body = [
        "Border: the largest restitution up to which all bursts of the record end in sticking, "
        f"bisected to {settings.resolution:g} at each {what}. Limit: r_crit(G), G = 2 d / A "
        "with the steady amplitude A of the primary alone. Where G is beyond pi or the border lies "
        "beyond the axis of the restitution, there is nothing to compare. Several borders: bursts "
        "are all complete again at some larger restitution.",
        f"Largest distance between border and limit: {largest}.",
        pd.DataFrame(rows),
    ]
    return Table.of(cube, "the small-mass limit", data, body)


def _distances(here: pd.DataFrame, what: str) -> dict[str, str]:
    known = here.dropna(subset="difference")
    row = dict.fromkeys(("G", "mean distance", _LARGEST, "with several borders"), "none")
    if len(known):
        worst = known.loc[known["difference"].abs().idxmax()]
        row = {
            "G": f"{known['reduced_gap'].min():.3g} to {known['reduced_gap'].max():.3g}",
            "mean distance": f"{known['difference'].abs().mean():.1e}",
            _LARGEST: f"{worst['difference']:+.1e} at G = {worst['reduced_gap']:.3g}",
            "with several borders": f"{(~known['single']).sum()}",
        }
    return {f"{what}s compared": f"{len(known)} of {len(here)}", **row}


_LARGEST = "largest (border less limit)"
