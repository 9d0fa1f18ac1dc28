"""Tables of the stress study: what each law came to, and where accuracy degrades and why."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from damper.tables import markdown_table
from damper.verification.base import Made
from damper.verification.labels import label
from damper.verification.stress.laws import ENERGY_PER_SEGMENT, LAW_NAMES, LIMIT, OUTCOMES, excess
from damper.verification.stress.parts import point_of
from damper.verification.stress.regimes import REGIMES

if TYPE_CHECKING:
    import xarray as xr

#: Laws whose violation is a number worth reading; the others either hold or do not.
GRADED = tuple(name for name in LAW_NAMES if name not in ("backwards", "not_finite"))


@dataclass(frozen=True)
class Row:
    """Runs of one regime: how they ended, the worst value of each law, and the worst run.

    `outcomes` are counts in the order of `damper.verification.stress.laws.OUTCOMES`; `worst` has
    NaN where there is nothing to violate, `nearest` the largest violation over its limit; `broken`
    counts runs that break a law; `law` and `point` name the law nearest to its limit, or
    farthest beyond, and where.
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


def make(cube: xr.Dataset, *, title: str) -> tuple[str, str]:
    """Make the table of the regimes, with the summary of the laws above it in Markdown.

    Parameters
    ----------
    cube : xarray.Dataset
        Of `damper.verification.stress.cube.gather`.
    title : str

    Returns
    -------
    csv, markdown : str
    """
    rows = regimes(cube)
    return to_csv(rows), to_markdown(cube, rows, title)


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
        tuple(int((status == code).sum()) for code in range(len(OUTCOMES))),
        worst,
        {law: _largest(far[law]) for law in LAW_NAMES},
        int((table > 1.0).any(axis=0).sum()),
        LAW_NAMES[law],
        point_of({str(n): v.values for n, v in place.data_vars.items()}, int(run)),
    )


def _largest(values: np.ndarray) -> float:
    finite = values[~np.isnan(values)]
    return float(finite.max()) if finite.size else math.nan


def to_csv(rows: Sequence[Row]) -> str:
    """Write one line per regime."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    heads = ["regime", "condition", "runs", *OUTCOMES, "broken"]
    writer.writerow([*heads, *LAW_NAMES, "worst_law", "worst_point"])
    for row in rows:
        writer.writerow(
            [
                row.name,
                row.condition,
                row.runs,
                *row.outcomes,
                row.broken,
                *(f"{row.worst[law]:.3g}" for law in LAW_NAMES),
                row.law,
                "; ".join(f"{name}={value:.16g}" for name, value in row.point.items()),
            ]
        )
    return text.getvalue()


def to_markdown(cube: xr.Dataset, rows: Sequence[Row], title: str) -> str:
    """Write the tables a person reads."""
    everything = rows[0]
    ends = ", ".join(
        f"{count} {words}"
        for count, words in zip(everything.outcomes, _OUTCOME_WORDS, strict=True)
        if count
    )
    lines = [
        f"# {title}: where accuracy degrades, and why",
        "",
        f"{everything.runs} runs: {ends}. The status states that a run stops early; what "
        "it did up to there is checked as well.",
        "",
        "Each law's violation is taken over the sizes of the terms whose difference it is, so "
        f"roundoff is some 1e-16 to 1e-15. Beyond {LIMIT:g} it is broken; the energy balance may "
        f"add {ENERGY_PER_SEGMENT:.1e} for each segment, one unit roundoff.",
        "",
        "## Laws",
        "",
        *markdown_table(
            ["law", "runs", "kept", "kept by stopped runs", "broken", "worst", "limit"],
            _laws(cube),
        ),
        "",
        "## Regimes",
        "",
        "Worst value of each law, and the number of runs that break any. Regimes overlap; those of "
        "parameters are of the rigid damper, other models have rows of their own.",
        "",
        *markdown_table(
            ["regime", "runs", "stopped", "broken", *(label(law) for law in GRADED)],
            [_regime(row) for row in rows],
        ),
        "",
        *markdown_table(
            ["regime", "condition", "why", "nearest to a limit"],
            [
                [
                    row.name,
                    row.condition,
                    row.reason or "",
                    f"{label(row.law)}: "
                    + ", ".join(f"{label(n)} {v:g}" for n, v in row.point.items()),
                ]
                for row in rows
            ],
        ),
    ]
    return "\n".join(lines) + "\n"


_OUTCOME_WORDS = (
    "finished",
    "stopped by their event budget",
    "stopped because a search failed",
    "refused with an error",
)


def _laws(cube: xr.Dataset) -> list[list[str]]:
    stopped = cube.status.values > 0
    rows = []
    for name, far in excesses(cube).items():
        known = ~np.isnan(far)
        kept = known & ~(far > 1.0)
        limit = "0" if name in ("backwards", "not_finite") else f"{LIMIT:g}"
        rows.append(
            [
                label(name),
                str(int(known.sum())),
                str(int((kept & ~stopped).sum())),
                str(int((kept & stopped).sum())),
                str(int((far > 1.0).sum())),
                _number(_largest(cube[name].values)),
                limit + (" and more" if name == "energy" else ""),
            ]
        )
    return rows


def _regime(row: Row) -> list[str]:
    stops = [
        f"{count} {words}"
        for count, words in zip(
            row.outcomes[1:], ("budget", "search failed", "refused"), strict=True
        )
        if count
    ]
    return [
        row.name,
        str(row.runs),
        ", ".join(stops) or "none",
        str(row.broken),
        *(_number(row.worst[law]) for law in GRADED),
    ]


def _number(value: float) -> str:
    return "none" if math.isnan(value) else f"{value:.1e}" if value else "0"
