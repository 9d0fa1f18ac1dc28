"""Table of the laws: largest violation of each law, over all runs and in each regime."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from damper.analysis.labels import label_of, short
from damper.analysis.laws import GRADED, Row, excesses, records_of, regimes
from damper.observers.common.laws import ENERGY_PER_SEGMENT, LAW_NAMES, LIMIT
from damper.parameters.lazy import pd, xr
from damper.parameters.variables import STATUS_MEANINGS
from damper.study.messages import Mistakes
from damper.study.products import Product, StudyContents, require_laws
from damper.tables import Table

_OUTCOME_WORDS = ("finished", "stopped by their event budget", "stopped because a search failed")


class LawsTable(Product):
    """Largest violation of each law, over all runs and in each regime."""

    def check_against(self, study: StudyContents, mistakes: Mistakes) -> None:
        require_laws(study, mistakes)


def make(results: Mapping[str, Any], settings: LawsTable) -> Table:
    """Make the table of the regimes, with a summary of the laws before it in the body."""
    cube = results["cube"]
    rows = regimes(cube)
    counts = zip(rows[0].outcomes, _OUTCOME_WORDS, strict=True)
    ends = ", ".join(f"{count} {words}" for count, words in counts if count)
    return Table.of(
        cube,
        "the laws",
        pd.DataFrame([_numbers(row) for row in rows]),
        [
            f"{rows[0].runs} runs: {ends}. Runs that stop early are checked as far as they go.",
            "Each law's violation is taken over the sizes of the terms whose difference it is, so "
            f"roundoff is some 1e-16 to 1e-15. Beyond {LIMIT:g} it is broken; the energy balance "
            f"may add {ENERGY_PER_SEGMENT:.1e} for each segment, one unit roundoff.",
            "## Laws",
            _laws(cube),
            "## Regimes",
            "Worst value of each law, and the number of runs that break any. Regimes overlap; "
            "those of parameters are of the rigid damper, other models have rows of their own.",
            pd.DataFrame([_regime(row) for row in rows]),
        ],
    )


def _numbers(row: Row) -> dict[str, Any]:
    point = "; ".join(f"{name}={value:.16g}" for name, value in row.point.items())
    return (
        {"regime": row.regime.name, "condition": row.regime.condition, "runs": row.runs}
        | dict(zip(STATUS_MEANINGS, row.outcomes, strict=True))
        | {"broken": row.broken, **row.worst, "worst_law": row.law, "worst_point": point}
    )


def _laws(cube: xr.Dataset) -> pd.DataFrame:
    far, stopped = excesses(cube), records_of(cube).status > 0
    kept = far <= 1.0
    limits = {"not_finite": "0", "energy_balance": f"{LIMIT:g} and more"}
    counts = pd.DataFrame(
        {
            "runs": far.notna().sum(),
            "kept": kept[~stopped].sum(),
            "kept by stopped runs": kept[stopped].sum(),
            "broken": (far > 1.0).sum(),
        }
    ).astype(str)
    worst = [short(float(cube[name].max()), "none") for name in LAW_NAMES]
    limit = [limits.get(name, f"{LIMIT:g}") for name in LAW_NAMES]
    table = counts.assign(worst=worst, limit=limit).rename(index=label_of)
    return table.rename_axis("law").reset_index()


def _regime(row: Row) -> dict[str, str]:
    return {
        "regime": row.regime.name,
        "condition": label_of(row.regime.condition or "all of them"),
        "runs": str(row.runs),
        "stopped": str(row.stopped),
        "broken": str(row.broken),
        **{label_of(law): short(float(row.worst[law]), "none") for law in GRADED},
    }
