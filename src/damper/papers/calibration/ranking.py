"""Scores of several statements joined, and the sets of parameters in their order."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from damper.papers.base import Scored, Tolerances
from damper.papers.statements import SCORES
from damper.parameters.lazy import xr

#: Name of the joined score.
JOINED = "joined"
#: A statement holds from this score on: a deviation by its tolerance.
HOLDS = 0.5


@dataclass(frozen=True)
class Ranking:
    """Scores of each statement, and the joined one, over the dimensions of the sets.

    `own` are the scores over all sets on which a statement was scored; `scores` those on the sets
    that all statements share. `freed` gives, for a statement that another study scores, the value
    of each parameter that only that study varies, at which its score is best.
    """

    own: dict[str, xr.DataArray]
    scores: xr.Dataset
    measured: dict[str, xr.DataArray]
    freed: dict[str, dict[str, xr.DataArray]]

    @property
    def sets(self) -> int:
        """How many sets there are."""
        return int(self.scores[JOINED].size)

    def order(self) -> np.ndarray:
        """Return the flat indices of the sets, best first; equals in the order of the axes."""
        return np.argsort(-self.scores[JOINED].values.ravel(), kind="stable")

    def places(self, indices: Iterable[int]) -> Iterator[dict[str, Any]]:
        """Yield the coordinates of sets."""
        joined = self.scores[JOINED]
        for index in indices:
            where = np.unravel_index(int(index), joined.shape)
            yield {
                str(name): joined[name].values[k].item()
                for name, k in zip(joined.dims, where, strict=True)
            }

    def rank(self, place: Mapping[str, Any]) -> tuple[int, float]:
        """Return how many sets score at least as well (1: none better), and the best joined score.

        `place` has values of some dimensions; of the sets with these the best counts. KeyError for
        none.
        """
        joined = self.scores[JOINED]
        best = float(joined.sel(dict(place)).max())
        return int((joined > best).sum()) + 1, best


def holding(found: Ranking) -> xr.DataArray:
    """Tell in which sets every statement holds."""
    names = [name for name in found.scores if name != JOINED]
    return (found.scores[names].to_array() >= HOLDS).all("variable")


def rank(
    cube: xr.Dataset,
    statements: Sequence[str],
    also: Mapping[str, xr.Dataset] | None = None,
    tolerances: Tolerances | None = None,
) -> Ranking:
    """Score statements on a cube, and others on those of the studies that test them; join them.

    The joined score is the geometric mean: 0 where one statement fails altogether, 1/2 where all
    score 1/2, so that neither the number of statements nor their order matters. Parameters that
    only another study varies are free: the best score counts. Of those that both vary, the values
    that both have count, and ValueError if there are none; those that only `cube` varies make no
    difference to the other's score.
    """
    tolerances = tolerances or Tolerances()
    found: dict[str, Scored] = {name: SCORES[name].measure(cube, tolerances) for name in statements}
    own = {name: each.score for name, each in found.items()}
    measured = {text: array for each in found.values() for text, array in each.measured.items()}
    sets = list(dict.fromkeys(str(dim) for array in own.values() for dim in array.dims))
    fitted = dict(own)
    freed: dict[str, dict[str, xr.DataArray]] = {}
    for name, other in (also or {}).items():
        own[name] = SCORES[name].measure(other, tolerances).score
        fitted[name], freed[name] = _at_its_best(own[name], sets)
    arrays = xr.align(*(array.reset_coords(drop=True) for array in fitted.values()), join="inner")
    for dim in sets:
        if not arrays[0].sizes.get(dim, 1):
            raise ValueError(f"{dim}: the studies that are joined have no value in common")
    aligned = dict(zip(fitted, arrays, strict=True))
    product: Any = 1.0
    for array in aligned.values():
        product = product * array
    joined = (product ** (1.0 / len(aligned))).transpose(*sets)
    scores = xr.Dataset({name: array.broadcast_like(joined) for name, array in aligned.items()})
    scores = scores.transpose(*sets)
    scores[JOINED] = joined
    return Ranking(own, scores, measured, freed)


def _at_its_best(
    array: xr.DataArray, sets: Sequence[str]
) -> tuple[xr.DataArray, dict[str, xr.DataArray]]:
    """Return the best score over the dimensions that are not the sets', and where it is."""
    free = [str(dim) for dim in array.dims if dim not in sets]
    if not free:
        return array, {}
    where = array.argmax(free)
    return array.max(free), {dim: array[dim].isel({dim: where[dim]}) for dim in free}
