"""The closed-form motion with two impacts per period: its ranges, and simulation beside it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar

from pydantic import Field

from damper.analysis.labels import label_of
from damper.analysis.places import rows_at
from damper.analysis.two_impacts import RANGES, SETTLED, two_impact_errors, two_impact_ranges
from damper.parameters.lazy import pd
from damper.parameters.quantities import INITIAL_NAMES
from damper.study.fields import Text
from damper.study.messages import Mistakes
from damper.study.products import Product, Role, StudyContents
from damper.study.settings import SECTIONS
from damper.tables import Table, number, place_cells, with_units


class TwoImpacts(Product):
    """Where the closed-form motion with two impacts per period exists and is stable."""

    of_theory: ClassVar[bool] = True
    needs = (SECTIONS, "impacts")
    roles: ClassVar[Mapping[str, Role]] = {"along": Role(least=2)}

    along: Annotated[Text, Field(description="Axis on which the ranges lie.")]
    resolution: Annotated[
        float,
        Field(
            gt=0, description="How closely the ends of the ranges are found, in units of the axis."
        ),
    ] = 1e-3

    def check_against(self, study: StudyContents, mistakes: Mistakes) -> None:
        super().check_against(study, mistakes)
        if self.along in INITIAL_NAMES:
            message = f"'{self.along}' sets where a run starts: the closed form does not know it"
            mistakes.add(("along",), message, "an axis of a parameter")


def make(results: Mapping[str, Any], settings: TwoImpacts) -> Table:
    """Show the ranges and the differences."""
    cube = results["cube"]
    along, resolution = settings.along, settings.resolution
    ranges = two_impact_ranges(cube, along, resolution)
    errors = two_impact_errors(cube, along)
    others = list(errors.columns[: errors.columns.get_loc("simulated")])
    counts = dict.fromkeys(("simulated", "compared", "settled"), "Int64")  # whole, may be missing
    both = [ranges.rename(columns={"range": "row"}), errors.assign(row="comparison").astype(counts)]
    columns = [*others, "row", *ranges.columns[len(others) + 1 :], *errors.columns[len(others) :]]
    rows = []
    for item in errors.to_dict("records"):
        where = {name: item[name] for name in others}
        here = rows_at(ranges, where)
        settled = number(item["largest_settled"], ".1e")
        rows.append(
            {
                **place_cells(where, cube),
                **{kind: _spans(rows_at(here, {"range": kind})) for kind in RANGES},
                "compared": f"{item['compared']} of {item['simulated']}",
                "median difference": number(item["median"], ".1e"),
                "largest": number(item["largest"], ".1e"),
                "largest, settled (runs)": f"{settled} ({item['settled']})",
            }
        )
    body = [
        "The closed-form motion with one impact on each wall per forcing period: where its free "
        "mass stays between the walls (exists) and where it is stable, in "
        f"{with_units(label_of(along), cube[along])}, ends bisected to {resolution:g}. `+`: the "
        "range reaches the end of the axis.",
        "Compared: of the runs where a stable motion exists, those with two visible impacts per "
        "period (others are on another attractor, or still on their way). Difference: the last "
        "sample's displacement or velocity less the closed form's, dimensionless. Near the ends "
        "of the stable range deviations die out slowly, and what is left of them is seen; settled "
        f"runs, whose samples agree to {SETTLED:g}, show how well both agree.",
        pd.DataFrame(rows),
    ]
    return Table.of(cube, "two impacts per period", pd.concat(both)[columns], body)


def _spans(found: pd.DataFrame) -> str:
    *_, lower, upper, cut = found.columns
    spans = zip(found[lower], found[upper], found[cut], strict=True)
    return ", ".join(f"{a:.4g}–{b:.4g}{'+' if ends else ''}" for a, b, ends in spans) or "none"
