"""Table of the stress study: what each law came to, over all runs and in each regime."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

from damper.observers.common.laws import ENERGY_PER_SEGMENT, LAW_NAMES, LIMIT, excess
from damper.tables import Table
from damper.verification.base import Made
from damper.verification.labels import label_of, short
from damper.verification.stress.cube import point_of
from damper.verification.stress.outcomes import RUN_OUTCOMES
from damper.verification.stress.regimes import REGIMES, Regime, with_models

if TYPE_CHECKING:
    import numpy as np
    import pandas as pd
    import xarray as xr

#: Laws whose violation is a number worth reading; the other one either holds or does not.
GRADED = tuple(name for name in LAW_NAMES if name != "not_finite")
_OUTCOME_WORDS = (
    "finished",
    "stopped by their event budget",
    "stopped because a search failed",
    "refused with an error",
)


class Row(NamedTuple):
    """Runs of one regime: how they ended, the worst value of each law, and the worst run."""

    regime: Regime
    outcomes: list[int]
    """Counts in the order of `RUN_OUTCOMES`."""
    worst: pd.Series
    """Of each law; NaN where there is nothing to violate."""
    nearest: pd.Series
    """The same over its limit."""
    broken: int
    """Runs that break a law."""
    law: str
    point: dict[str, float]
    """Law nearest to its limit, or farthest beyond, and where."""

    @property
    def runs(self) -> int:
        """All runs of the regime."""
        return sum(self.outcomes)

    @property
    def stopped(self) -> int:
        """Runs that did not finish."""
        return sum(self.outcomes[1:])


class StressTable(Made):
    """What each law came to, over all runs and in each regime."""


def make(results: Mapping[str, Any], settings: StressTable) -> Table:
    """Make the table of the regimes, with a summary of the laws before it in the body."""
    import pandas as pd

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


def excesses(cube: xr.Dataset) -> pd.DataFrame:
    """Each law's violation over its limit, run by run; NaN where there is nothing to violate."""
    import pandas as pd

    return pd.DataFrame({n: excess(n, cube[n].values, cube.segments.values) for n in LAW_NAMES})


def regimes(cube: xr.Dataset) -> list[Row]:
    """Return one row for all runs, then one for each regime that has any."""
    runs = with_models(cube.to_dataframe().reset_index())
    everywhere = runs.run.notna()
    chosen = [(Regime("all", "every run"), everywhere)]
    chosen += [(regime, regime.holds(runs)) for regime in REGIMES]
    far = excesses(cube)
    return [_row(cube, regime, runs[some], far[some]) for regime, some in chosen if some.any()]


def _row(cube: xr.Dataset, regime: Regime, runs: pd.DataFrame, far: pd.DataFrame) -> Row:
    run, law = far.fillna(-1.0).stack().idxmax()
    return Row(
        regime,
        [int((runs.status == code).sum()) for code in range(len(RUN_OUTCOMES))],
        runs[list(LAW_NAMES)].max(),
        far.max(),
        int((far > 1.0).any(axis=1).sum()),
        law,
        point_of(cube, run),
    )


def _numbers(row: Row) -> dict[str, Any]:
    point = "; ".join(f"{name}={value:.16g}" for name, value in row.point.items())
    return (
        {"regime": row.regime.name, "condition": row.regime.condition, "runs": row.runs}
        | dict(zip(RUN_OUTCOMES, row.outcomes, strict=True))
        | {"broken": row.broken, **row.worst, "worst_law": row.law, "worst_point": point}
    )


def _laws(cube: xr.Dataset) -> pd.DataFrame:
    import pandas as pd

    far, stopped = excesses(cube), cube.status.values > 0
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
    worst = [_number(float(cube[name].max())) for name in LAW_NAMES]
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
        **{label_of(law): _number(row.worst[law]) for law in GRADED},
    }


def _number(value: float | np.floating) -> str:
    return short(float(value)).replace("–", "none")
