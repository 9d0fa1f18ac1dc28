"""Tables: a cube -> CSV and Markdown, one file for each kind.

A kind's file has the kind's name and holds its settings class and its `make`. This module writes
the two files of every table.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from damper.analysis.labels import label_of
from damper.analysis.places import fixed_values
from damper.parameters.lazy import pd, xr
from damper.parameters.quantities import ALL
from damper.parameters.units import units_of
from damper.study.kinds import TABLES
from damper.sweep.record import force_words, table_words, unused_quantities

if TYPE_CHECKING:
    Body = Sequence[str | pd.DataFrame]


@dataclass(frozen=True)
class Table:
    """A table as two files: CSV for programs, Markdown for people.

    Attributes
    ----------
    title : str
        First line of the Markdown.
    data : pandas.DataFrame
        The CSV: a column for each of its own, numbers in full precision, empty where NaN.
    body : sequence of str or pandas.DataFrame
        The Markdown below the title: paragraphs, and tables of cells that are shown as they are.

    Examples
    --------
    >>> import pandas as pd
    >>> data = pd.DataFrame({"gap": [0.1, 0.2], "worst_amplitude": [1 / 3, float("nan")]})
    >>> cells = pd.DataFrame({"gap": ["0.1", "0.2"], "worst": ["0.333", "none"]})
    >>> table = Table("Gaps", data, ["The worst case counts.", cells])
    >>> print(table.csv(), table.markdown(), sep="\\n", end="")
    gap,worst_amplitude
    0.1,0.3333333333333333
    0.2,
    <BLANKLINE>
    # Gaps
    <BLANKLINE>
    The worst case counts.
    <BLANKLINE>
    | gap | worst |
    |---|---|
    | 0.1 | 0.333 |
    | 0.2 | none |
    """

    title: str
    data: pd.DataFrame
    body: Body

    @classmethod
    def of(cls, cube: xr.Dataset, title: str, data: pd.DataFrame, body: Body) -> Table:
        """Return a table with the study's title, and with its fixed and its assumed values."""
        study = [cube.attrs["title"]] if "title" in cube.attrs else []
        whole = [*_fixed(cube), *body, *_assumed(cube)]
        return cls(": ".join([*study, title]), data, whole)

    def csv(self) -> str:
        """Text of the CSV file."""
        return self.data.to_csv(index=False, lineterminator="\n")

    def markdown(self) -> str:
        """Text of the Markdown file."""
        parts = (part if isinstance(part, str) else _lines(part) for part in self.body)
        text = "\n\n".join([f"# {self.title}", *parts]) + "\n"
        return re.sub(r"<(?=[A-Za-z/!?])", r"\<", text)  # what would begin HTML

    def save(self, csv: Path | str, markdown: Path | str) -> None:
        """Write both files."""
        for path, text in ((csv, self.csv()), (markdown, self.markdown())):
            Path(path).write_text(text, encoding="utf-8", newline="\n")


def _lines(cells: pd.DataFrame) -> str:
    rows = [cells.columns, *cells.itertuples(index=False, name=None)]
    # A bar in a cell, as between the words of several masses, ends none.
    texts = ([str(cell).replace("|", "\\|") for cell in row] for row in rows)
    lines = [f"| {' | '.join(row)} |" for row in texts]
    return "\n".join([lines[0], "|" + "---|" * len(cells.columns), *lines[1:]])


def with_units(text: str, array: xr.DataArray) -> str:
    """Return a heading with the units of what stands below it."""
    units = units_of(array.attrs)
    return text if units in ("", "1") else f"{text}, {units}"


def number(value: float, form: str, missing: str = "none") -> str:
    """Return a number for readers, in a format such as ``.3g``."""
    return missing if math.isnan(value) else f"{value:{form}}"


def place_cells(place: Mapping[str, Any], cube: xr.Dataset) -> dict[str, str]:
    """Return the first cells of a row, those that say where of a cube it is."""
    return {
        with_units(label_of(name), cube[name]): ALL[name].text_of(x) if name in ALL else f"{x}"
        for name, x in place.items()
    }


def make(kind: str, results: Mapping[str, Any], **settings: Any) -> Table:
    """Make one table.

    Parameters
    ----------
    kind : str
        A key of `damper.study.kinds.TABLES`.
    results : mapping of str to xarray.Dataset
        What it is made of, by name: ``cube``, or the study's ``orbits``.
    **settings
        Those of the kind; they are not checked against the cube.

    Returns
    -------
    Table

    Raises
    ------
    ValueError
        For an unknown kind, with the known ones; for settings that the kind has not or that are
        wrong, with what is allowed.
    """
    module, checked = TABLES.asked(kind, settings)
    return module.make(results, checked)


def _fixed(cube: xr.Dataset) -> Iterator[str]:
    unused = unused_quantities(cube)
    values = [
        f"{label_of(name)} {ALL[name].text_of(float(cube[name]))} "
        f"{units_of(cube[name].attrs)}".removesuffix(" 1").rstrip()
        for name in fixed_values(cube)
        if name not in unused
    ]
    values += table_words(cube)
    if force := force_words(cube):
        values.append(f"forcing {force}")
    if values:
        yield f"Fixed: {', '.join(values)}."


def _assumed(cube: xr.Dataset) -> Iterator[str]:
    found = {
        str(name).removeprefix("assumed_"): reason
        for name, reason in cube.attrs.items()
        if str(name).startswith("assumed_")
    }
    noted = {str(name): array.attrs for name, array in cube.coords.items()}
    found = {name: attrs["assumed"] for name, attrs in noted.items() if "assumed" in attrs} | found
    if found:
        yield "## Assumed"
        yield "These values are not stated in the source's text:"
        yield "\n".join(f"- {label_of(name)}: {why}" for name, why in found.items())
