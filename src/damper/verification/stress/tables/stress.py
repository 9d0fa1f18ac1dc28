"""Tables of the stress study: what each law came to, and where accuracy degrades and why."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from damper.tables import Table
from damper.verification.base import Made
from damper.verification.labels import label_of
from damper.verification.stress.laws import (
    ENERGY_PER_SEGMENT,
    LAW_NAMES,
    LIMIT,
    RUN_OUTCOMES,
    excess,
)
from damper.verification.stress.parts import point_of
from damper.verification.stress.regimes import REGIMES

if TYPE_CHECKING:
    import xarray as xr

#: Laws whose violation is a number worth reading; the others either hold or do not.
GRADED = tuple(name for name in LAW_NAMES if name not in ("backwards", "not_finite"))


@dataclass(frozen=True)
class Row:
    """Runs of one regime: how they ended, the worst value of each law, and the worst run.

    `outcomes` are counts in the order of `RUN_OUTCOMES`; `worst` has NaN where there is nothing to
    violate, `nearest` the largest violation over its limit; `broken` counts runs that break a law;
    `law` and `point` name the law nearest to its limit, or farthest beyond, and where.
    """

    name: str
    condition: str
    reason: str
    outcomes: tuple[int, ...]
    worst: Mapping[str, float]
    nearest: Mapping[str, float]
    broken: int
    law: str
    point: Mapping[str, float]

    @property
    def runs(self) -> int:
        """All runs of the regime."""
        return sum(self.outcomes)


class StressTable(Made):
    """Where accuracy degrades, and why: the laws over all runs, and in each regime."""

    def files(self, stem: str, study: Any) -> dict[str, dict[str, Any]]:
        return {stem: {"kind": self.kind, "title": study.title}}


def make(cube: xr.Dataset, *, title: str) -> Table:
    """Make the table of the regimes, with a summary of the laws before it in the body.

    Parameters
    ----------
    cube : xarray.Dataset
        Of `damper.verification.stress.cube.gather_checks`.
    title : str

    Returns
    -------
    Table
    """
    import pandas as pd

    rows = regimes(cube)
    everything = rows[0]
    counts = zip(everything.outcomes, _OUTCOME_WORDS, strict=True)
    ends = ", ".join(f"{count} {words}" for count, words in counts if count)
    return Table(
        f"{title}: where accuracy degrades, and why",
        pd.DataFrame([_numbers(row) for row in rows]),
        [
            f"{everything.runs} runs: {ends}. Runs that stop early are checked as far as they go.",
            "Each law's violation is taken over the sizes of the terms whose difference it is, so "
            f"roundoff is some 1e-16 to 1e-15. Beyond {LIMIT:g} it is broken; the energy balance "
            f"may add {ENERGY_PER_SEGMENT:.1e} for each segment, one unit roundoff.",
            "## Laws",
            pd.DataFrame(_laws(cube)),
            "## Regimes",
            "Worst value of each law, and the number of runs that break any. Regimes overlap; "
            "those of parameters are of the rigid damper, other models have rows of their own.",
            pd.DataFrame([_regime(row) for row in rows]),
            pd.DataFrame([_reason(row) for row in rows]),
        ],
    )


def regimes(cube: xr.Dataset) -> list[Row]:
    """Return one row for all runs, then one for each regime that has any."""
    everywhere = np.ones(cube.sizes["run"], dtype=bool)
    found = [_row(cube, "all", "every run", "", everywhere)]
    for regime in REGIMES:
        chosen = regime.holds(cube).values
        if chosen.any():
            found.append(_row(cube, regime.name, regime.condition, regime.reason, chosen))
    return found


def excesses(cube: xr.Dataset) -> dict[str, np.ndarray]:
    """Each law's violation over its limit, run by run; NaN where there is nothing to violate."""
    return {name: excess(name, cube[name].values, cube.segments.values) for name in LAW_NAMES}


def _row(cube: xr.Dataset, name: str, condition: str, reason: str, chosen: np.ndarray) -> Row:
    place = cube.isel(run=np.flatnonzero(chosen))
    status = place.status.values
    far = excesses(place)
    worst = {law: _largest(place[law].values) for law in LAW_NAMES}
    table = np.array([np.nan_to_num(far[law], nan=-1.0, posinf=np.inf) for law in LAW_NAMES])
    law, run = np.unravel_index(int(table.argmax()), table.shape)
    return Row(
        name,
        condition,
        reason,
        tuple(int((status == code).sum()) for code in range(len(RUN_OUTCOMES))),
        worst,
        {law: _largest(far[law]) for law in LAW_NAMES},
        int((table > 1.0).any(axis=0).sum()),
        LAW_NAMES[law],
        point_of({str(n): v.values for n, v in place.data_vars.items()}, int(run)),
    )


def _largest(values: np.ndarray) -> float:
    finite = values[~np.isnan(values)]
    return float(finite.max()) if finite.size else math.nan


_OUTCOME_WORDS = (
    "finished",
    "stopped by their event budget",
    "stopped because a search failed",
    "refused with an error",
)


def _numbers(row: Row) -> dict[str, Any]:
    point = "; ".join(f"{name}={value:.16g}" for name, value in row.point.items())
    return (
        {"regime": row.name, "condition": row.condition, "runs": row.runs}
        | dict(zip(RUN_OUTCOMES, row.outcomes, strict=True))
        | {"broken": row.broken, **row.worst, "worst_law": row.law, "worst_point": point}
    )


def _laws(cube: xr.Dataset) -> list[dict[str, str]]:
    stopped = cube.status.values > 0
    rows = []
    for name, far in excesses(cube).items():
        known = ~np.isnan(far)
        kept = known & ~(far > 1.0)
        counts = {
            "runs": known,
            "kept": kept & ~stopped,
            "kept by stopped runs": kept & stopped,
            "broken": far > 1.0,
        }
        limit = "0" if name in ("backwards", "not_finite") else f"{LIMIT:g}"
        rows.append(
            {"law": label_of(name)}
            | {head: str(int(chosen.sum())) for head, chosen in counts.items()}
            | {
                "worst": _number(_largest(cube[name].values)),
                "limit": limit + (" and more" if name == "energy" else ""),
            }
        )
    return rows


def _regime(row: Row) -> dict[str, str]:
    words = ("budget", "search failed", "refused")
    stops = [f"{n} {word}" for n, word in zip(row.outcomes[1:], words, strict=True) if n]
    return {
        "regime": row.name,
        "runs": str(row.runs),
        "stopped": ", ".join(stops) or "none",
        "broken": str(row.broken),
        **{label_of(law): _number(row.worst[law]) for law in GRADED},
    }


def _reason(row: Row) -> dict[str, str]:
    point = ", ".join(f"{label_of(name)} {value:g}" for name, value in row.point.items())
    return {
        "regime": row.name,
        "condition": row.condition,
        "why": row.reason,
        "nearest to a limit": f"{label_of(row.law)}: {point}",
    }


def _number(value: float) -> str:
    return "none" if math.isnan(value) else f"{value:.1e}" if value else "0"
