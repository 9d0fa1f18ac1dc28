"""Scores of the papers' statements for each set of parameters: how far these meet them.

The texts lost their parameters; a calibration asks which values the statements allow. A deviation
by its tolerance halves a score, and deviations add up as a quadrature sum: the score falls as
2^-(sum of squares). A run that stopped early counts as one without chatter.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Annotated, Any

import numpy as np
from pydantic import Field

from damper.analysis.labels import label_of
from damper.papers.base import Tolerances
from damper.papers.statements import SCORES
from damper.parameters.lazy import pd, xr
from damper.study.fields import DistinctList, one_of
from damper.study.messages import Mistakes
from damper.study.products import Place, Product, StudyContents, check_listed, require_one_run
from damper.tables import Table

#: A statement holds from this score on: a deviation by its tolerance.
HOLDS = 0.5
#: Sets in the Markdown; the CSV has as many as the settings say.
_SHOWN = 15


class ScoresTable(Product):
    """Calibration: how far each set of parameters meets the papers' statements."""

    statements: Annotated[
        DistinctList[Annotated[str, one_of(SCORES)]],
        Field(description="Statements of the papers that this study tests; they are joined."),
    ]
    preset: Annotated[
        Place | None,
        Field(
            description="Values of some axes whose place among the sets is listed, exactly as the "
            "axes list them."
        ),
    ] = None
    rows: Annotated[
        int, Field(ge=1, le=100_000, description="How many of the best sets the CSV lists.")
    ] = 200

    def check_against(self, study: StudyContents, mistakes: Mistakes) -> None:
        require_one_run(study, mistakes)
        for name in self.statements:
            for observer in SCORES[name].observers:
                if observer not in study.observers:
                    mistakes.add((), f"{name} needs {observer} among the observers", observer)
            for axis, needed in SCORES[name].needs.items():
                if not needed.met(study.axes.get(axis, ())):
                    mistakes.add((), f"{name} needs an axis {axis} with {needed.words}")
        about = {axis for name in self.statements for axis in SCORES[name].axes}
        if not mistakes and not set(study.axes) - about:
            message = "no axis is left whose values could be ranked"
            mistakes.add((), message, "an axis that no statement is about")
        for axis, value in (self.preset or {}).items():
            check_listed(("preset", axis), axis, value, study.axes, mistakes)


def scores_of(
    cube: xr.Dataset, statements: Sequence[str], tolerances: Tolerances | None = None
) -> xr.Dataset:
    """Return the score of each statement, and ``joined``, their geometric mean, over all sets.

    The mean is 0 where one statement fails altogether and 1/2 where all scores are 1/2, so neither
    the number of statements nor their order matters.
    """
    tolerances = tolerances or Tolerances()
    found = {name: SCORES[name].measure(cube, tolerances).score for name in statements}
    arrays = xr.broadcast(*(array.reset_coords(drop=True) for array in found.values()))
    joined = math.prod(arrays[1:], start=arrays[0]) ** (1.0 / len(arrays))
    return xr.Dataset(dict(zip(found, arrays, strict=True)) | {"joined": joined})


def holding(scores: xr.Dataset) -> int:
    """Return in how many sets every statement holds."""
    return int((scores.drop_vars("joined").to_array() >= HOLDS).all("variable").sum())


def make(results: Mapping[str, Any], settings: ScoresTable) -> Table:
    """Make the table of the statements' scores and of the best sets."""
    cube, names, preset = results["cube"], settings.statements, settings.preset
    scores = scores_of(cube, names)
    joined = scores.joined
    together = f"Together: all hold in {_of(holding(scores), joined.size)}"
    if any(SCORES[name].tolerant for name in names):
        doubled = holding(scores_of(cube, names, Tolerances().doubled))
        together += f"; with all tolerances doubled in {_of(doubled, joined.size)}"
    rows = [_statement_row(name, scores[name], preset) for name in names]
    order = np.argsort(-joined.values.ravel(), kind="stable")[: settings.rows]
    data = scores.to_dataframe(dim_order=list(joined.dims)).reset_index().iloc[order]
    data = data[[*joined.dims, "joined", *names]]
    data.insert(0, "rank", range(1, len(data) + 1))
    body: list[str | pd.DataFrame] = [
        "Score 1: as stated; from 1/2 on a statement holds; joined: the geometric mean. The "
        "statements are those of the papers in our words; how each is scored, with which "
        "tolerances, is ours (docs/calibration.md).",
        pd.DataFrame(rows),
        f"{together}.",
    ]
    if preset:
        best = float(joined.sel(preset).max())
        text = ", ".join(f"{axis} = {value:g}" for axis, value in preset.items())
        number = _of(int((joined > best).sum()) + 1, joined.size)
        body.append(f"The preset ({text}) has the joined score {best:.4g}, number {number}.")
    best_sets = data.head(_SHOWN).map(_short).rename(columns=label_of)
    return Table.of(cube, "scores", data, [*body, "## The best sets", best_sets])


def _statement_row(name: str, array: xr.DataArray, preset: Any) -> dict[str, str]:
    row = {
        "statement": name,
        "in our words": SCORES[name].text,
        "holds in (sets)": f"{int((array >= HOLDS).sum())} of {array.size}",
        "best score": _short(float(array.max())),
    }
    return row | ({"preset": _short(float(array.sel(preset).max()))} if preset else {})


def _short(value: Any) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def _of(some: int, of_all: int) -> str:
    part = some / of_all
    return f"{some} of {of_all} sets ({part:{'.2g' if part < 0.01 else '.1%'}})"
