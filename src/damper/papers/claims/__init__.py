"""What the two papers' texts state, and whether it holds: verdicts computed from cubes.

The statements are in our words, with the numbers that stand in the papers' texts; everything else
is measured. A verdict belongs to the values of the studies it was computed from, most of which are
assumed because the papers' own are lost.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:  # the Snakefile reads STUDIES
    import xarray as xr

HOLDS, ONLY_IF, FAILS, UNTESTED = "holds", "holds only if", "does not hold", "not tested"

#: Claim -> studies whose cubes it is judged by.
STUDIES: dict[str, tuple[str, ...]] = {
    "A1": ("paper_a_clearance",),
    "A2": ("paper_a_frequency",),
    "A3": ("paper_a_histories",),
    "A4": ("paper_a_histories",),
    "A5": ("paper_a_histories",),
    "A6": ("accumulation",),
    "A7": ("paper_a_histories",),
    "A8": ("performance",),
    "A9": ("performance",),
    "A10": ("performance",),
    "A11": ("burst_duration",),
    "B1": ("restitution", "restitution_below_resonance"),
    "B2": ("restitution", "restitution_below_resonance"),
    "B3": ("restitution", "restitution_below_resonance"),
    "B4": ("restitution", "restitution_below_resonance"),
    "B5": ("restitution", "paper_b_portraits", "paper_b_histories"),
    "B6": ("restitution", "restitution_below_resonance"),
}


@dataclass(frozen=True)
class Verdict:
    """What was found, and what that makes of the statement.

    `condition` completes the sentence where the verdict is `ONLY_IF`, and says what is missing
    where it is `UNTESTED`.
    """

    ours: str
    verdict: str
    condition: str = ""


@dataclass(frozen=True)
class Claim:
    """One statement of a paper.

    `stated` is the paper's number or words as its text has them, `figures` the files that show it
    (below the folder of results, without suffix), `judge` computes the verdict from the cubes of
    `STUDIES`, by name.
    """

    name: str
    statement: str
    stated: str
    figures: tuple[str, ...]
    judge: Callable[[Mapping[str, xr.Dataset]], Verdict]


@dataclass(frozen=True)
class Judged:
    """A claim with its verdict and the values it rests on."""

    claim: Claim
    verdict: Verdict
    assumptions: str


def claims() -> list[Claim]:
    """All claims of both papers, in order."""
    return [
        claim
        for paper in ("paper_a", "paper_b")
        for claim in import_module(f"{__name__}.{paper}").CLAIMS
    ]


def judge(cubes: Mapping[str, xr.Dataset]) -> list[Judged]:
    """Judge every claim.

    Parameters
    ----------
    cubes : mapping of str to xarray.Dataset
        Study -> cube. A claim whose studies are not all there is not tested.
    """
    found = []
    for claim in claims():
        missing = [name for name in STUDIES[claim.name] if name not in cubes]
        if missing:
            words = "the configuration has no study " + ", ".join(missing)
            found.append(Judged(claim, Verdict("", UNTESTED, words), ""))
            continue
        used = {name: cubes[name] for name in STUDIES[claim.name]}
        found.append(Judged(claim, claim.judge(used), assumptions(used.values())))
    return found


def assumptions(cubes: Sequence[xr.Dataset] | Mapping) -> str:
    """Values that the papers' texts do not state, as the cubes note them."""
    parts: dict[str, str] = {}
    for cube in cubes:
        for name, coordinate in cube.coords.items():
            if "assumed" in coordinate.attrs:
                parts.setdefault(f"{name} {_values(coordinate)}", "")
        for name in cube.attrs:
            if name.startswith("assumed_"):
                parts.setdefault(_attribute(cube, name), "")
    return ", ".join(parts)


def _values(coordinate: xr.DataArray) -> str:
    values = coordinate.values.reshape(-1)
    if values.size > 5:
        return f"{values.min():g} to {values.max():g}"
    return ", ".join(f"{value:g}" for value in values)


def _attribute(cube: xr.Dataset, name: str) -> str:
    quantity = name.removeprefix("assumed_").replace("_", " ")
    comment = cube.chatter.attrs.get("comment", "") if "chatter" in cube else ""
    visible = comment.rpartition("visible: ")[2]
    return f"{quantity}: {visible}" if visible and "threshold" in name else quantity
