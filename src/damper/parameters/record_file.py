"""CSV files of records: numpy reads the numbers; layout, units and mistakes are found here."""

from __future__ import annotations

import csv
import io
import os
import re
import unicodedata
from collections.abc import Iterator, Sequence
from functools import cached_property, partial
from itertools import islice
from typing import Any

from damper.parameters.files import contents
from damper.parameters.names import unknown_name

#: Separators of columns, in the order in which they are tried; one blank stands for several.
SEPARATORS = {"\t": "tabs", ";": "semicolons", " ": "blanks", ",": "commas"}
_NUMBER = re.compile(r"[-+]?((\d+\.?\d*|\d+,\d+|\.\d+)(e[-+]?\d+)?|nan|inf(inity)?)", re.I | re.A)
#: First bytes of files that are no text -> words for them.
_PACKED = {
    b"\x1f\x8b": "packed by gzip: must be unpacked",
    b"PK\3\4": "a workbook or another zip archive: must be saved as CSV",
}
#: Unit of a column -> its spellings, as `_plain` has them.
_SPELLINGS = {
    "s": "s sec secs second seconds",
    "N": "n newton newtons",
    "m/s2": "m/s2 m/s/s ms-2 ms2 mps2 m/sec2 m/sec/sec msec-2",
    "m": "m metre metres meter meters",
    "m/s": "m/s ms-1 mps m/sec",
    "1": "1",
}
#: Unit of a column -> its multiples that may be converted, as `_plain` has them.
_MULTIPLES = {
    "s": {"ms": 1e-3, "msec": 1e-3, "us": 1e-6, "μs": 1e-6, "min": 60.0},
    "m": {"mm": 1e-3, "cm": 1e-2, "um": 1e-6, "μm": 1e-6},
    "m/s": {"mm/s": 1e-3, "cm/s": 1e-2},
    "m/s2": {"g": 9.80665, "mm/s2": 1e-3, "cm/s2": 1e-2},
}
#: Units that may end the head of a column without brackets, such as `time_ms`: of times, of values.
_TIMES = f"{_SPELLINGS['s']} ms msec us μs usec ns min minutes h hr hours samples"
_VALUES = f"{_SPELLINGS['N']} {_SPELLINGS['m/s2']} " + (
    "kn mn lb lbs lbf kip kgf kg dyn g mg g0 %g % gal mgal mm/s2 cm/s2 ft/s2 in/s2 mms-2 cms-2 "
    "m/s mm/s cm/s m mm cm μm um ft v mv volt volts pa kpa mpa bar counts"
)


class RecordFile:
    """A CSV file of times and values.

    Parameters
    ----------
    path : path
        The file.
    units : (str, str)
        Units of time and value.
    columns : (str or int, str or int), optional
        Columns of time and value, where there are more than these two.
    delimiter : str, optional
        Separator of the columns; found in the file where it is not given.
    multiples : bool, default False
        Whether multiples of the units, such as mm, are converted, and not refused.
    words : str, default "time and value"
        What the columns are, for messages.

    Attributes
    ----------
    unit : str
        Unit of the values where the file gives one, else nothing.

    Raises
    ------
    ValueError, OSError
        With the line, and what is wrong in it.
    """

    def __init__(
        self,
        path: str | os.PathLike[str],
        units: tuple[str, str],
        columns: Sequence[str | int] | None = None,
        delimiter: str | None = None,
        multiples: bool = False,
        words: str = "time and value",
    ) -> None:
        self.path, self._columns, self._multiples = path, columns, multiples
        self._words = words
        self.unit, self._sizes = "", [1.0, 1.0]
        self._data = _text(path)
        self._separator, self._decimal = delimiter or "", "."
        self._head: list[str] = []
        self._head_line = self._skipped = 0
        self._find_layout()
        self._places = [self._place(k, (columns or (0, 1))[k], units[k]) for k in (0, 1)]

    @property
    def found(self) -> str:
        """Separator and decimal sign in words; empty for commas and points."""
        named = SEPARATORS.get(self._separator, repr(self._separator))
        words = "" if self._separator == "," else f"{named} between columns"
        return words + (", decimal commas" if self._decimal == "," else "")

    @cached_property
    def samples(self) -> tuple[Any, Any]:
        """Arrays of times and values."""
        import numpy as np

        row = next(self._rows(), None)
        if row is None:
            return np.empty(0), np.empty(0)
        self._check(*row)

        read = partial(
            np.loadtxt,
            delimiter=None if self._separator == " " else self._separator,
            comments=None,
            quotechar='"',
            usecols=None if self._columns is None else self._places,
            ndmin=2,
        )

        def texts() -> Iterator[str]:
            nonlocal row
            for row in self._rows():
                yield row[1] if self._separator == "," else row[1].replace(",", ".")

        try:
            # A third of the time of line by line, which comments and decimal commas need.
            with self._open() as file:
                for _ in range(row[0] - 1):
                    file.readline()
                table = read(file)
        except (ValueError, TypeError):
            try:
                table = read(texts())
            except (ValueError, TypeError) as error:
                self._check(*row)
                raise ValueError(f"{self.path}: not a table of numbers: {error}") from None
        self._find_decimal()
        return self._sizes[0] * table[:, 0], self._sizes[1] * table[:, 1]

    def line_of(self, sample: int) -> int:
        """Return the number of the line with a sample."""
        return next(islice(self._rows(), sample, None))[0]

    def _open(self) -> io.TextIOWrapper:
        return io.TextIOWrapper(io.BytesIO(self._data), encoding="utf-8-sig")

    def _lines(self) -> Iterator[tuple[int, str]]:
        """Yield number and text of all lines that are not empty."""
        with self._open() as file:
            for number, line in enumerate(file, 1):
                if not line.isspace():
                    yield number, line.rstrip("\n")

    def _rows(self) -> Iterator[tuple[int, str]]:
        """Yield number and text of the lines with samples."""
        lines = ((number, text) for number, text in self._lines() if text.lstrip()[0] != "#")
        return islice(lines, self._skipped, None)

    def _cells(self, number: int, text: str, separator: str = "") -> list[str]:
        separator = separator or self._separator
        if separator == " ":
            return text.split()
        try:
            return [cell.strip() for cell in next(csv.reader([text], delimiter=separator))]
        except csv.Error as error:
            raise ValueError(f"{self.path}, line {number}: not a line of CSV: {error}") from None

    def _find_layout(self) -> None:
        """Find separator, names of the columns, and how many lines come before the samples."""
        lines = list(islice(self._rows(), 2))
        for line in () if self._separator else lines:
            fit = (each for each in SEPARATORS if _fits(self._cells(*line, each)))
            self._separator = self._separator or next(fit, "")
        if not self._separator:
            self._separator = next((s for s in "\t;, " if lines and s in lines[-1][1]), ",")
        if not lines:
            return
        first = self._cells(*lines[0])
        if not any(map(_NUMBER.fullmatch, first)):
            self._head, self._head_line, self._skipped = first, lines[0][0], 1
            return
        # A comment may name the columns, as numpy.savetxt writes it.
        known = {"", *_TIMES.split(), *_VALUES.split()}
        for number, text in islice(self._lines(), lines[0][0] - 1):
            cells = self._cells(number, text.lstrip("# "))
            found = {_plain(split_unit(cell, "N" if k else "s")[1]) for k, cell in enumerate(cells)}
            if number < lines[0][0] and len(cells) == len(first) > 1 and known.issuperset(found):
                self._head, self._head_line = cells, number

    def _place(self, which: int, column: str | int, unit: str) -> int:
        """Return the number of a column, of time (0) or value, whose unit is checked."""
        if isinstance(column, str):
            names = [split_unit(head, unit)[0] for head in self._head]
            if column not in {*names, *self._head}:
                raise ValueError(str(unknown_name(f"column of {self.path}", column, names)))
            column = (names if column in names else self._head).index(column)
        if 0 <= column < len(self._head):
            name, found = split_unit(self._head[column], unit)
            others = _MULTIPLES.get(unit, {}) if self._multiples else {}
            if found and which:
                self.unit = unit
            if _plain(found) in others:
                self._sizes[which] = others[_plain(found)]
            elif found and _plain(found) not in _SPELLINGS[unit].split():
                raise ValueError(
                    f"{self.path}, line {self._head_line}: {name} is in {found}: must be in "
                    f"{', '.join([unit, *others])}, or without unit"
                )
        return column

    def _check(self, number: int, text: str) -> None:
        """Raise ValueError for a line that does not hold a sample."""
        cells, where = self._cells(number, text), f"{self.path}, line {number}"
        if self.found:
            where += f" ({self.found})"
        if self._columns is None and len(cells) == 1:
            raise ValueError(
                f"{where}: 1 column: must be two, {self._words}, and `delimiter` may say what "
                "stands between them"
            )
        if self._columns is None and len(cells) != 2:
            raise ValueError(
                f"{where}: {len(cells)} columns: must be two, or `columns` has to say which are "
                f"{self._words}"
            )
        for place in self._places:
            if not 0 <= place < len(cells) or not cells[place]:
                raise ValueError(f"{where}: there is nothing in column {place} (from 0)")
            if not _NUMBER.fullmatch(cells[place]):
                raise ValueError(f"{where}: {cells[place]!r} is no number")

    def _find_decimal(self) -> None:
        """Find the decimal sign; ValueError where there are both."""
        if self._separator == "," or b"," not in self._data:
            return
        rows = ((number, self._cells(number, text)) for number, text in self._rows())
        signs: dict[str, int] = {}
        for number, cells in rows:
            for place in self._places:
                signs |= {sign: number for sign in ".," if sign in cells[place]}
        if len(signs) == 2:
            raise ValueError(
                f"{self.path}: decimal commas (line {signs[',']}) and points (line {signs['.']}): "
                "must be one of them"
            )
        self._decimal = min(signs, default=".")


def split_unit(head: str, unit: str) -> tuple[str, str]:
    """Return the name and the unit in the head of a column; the unit is empty where there is none.

    Parameters
    ----------
    head : str
        As a file has it.
    unit : str
        The unit that is expected. Of others, those of the same kind are known without brackets.

    Examples
    --------
    >>> [split_unit(head, "s") for head in ("time (ms)", "t: sec", "time_ms", "t / s", "t_start")]
    [('time', 'ms'), ('t', 'sec'), ('time', 'ms'), ('t', 's'), ('t_start', '')]
    """
    known = (_TIMES if unit == "s" else _VALUES).split()
    # A letter alone is a name, such as v or h.
    if _plain(head) in known and (len(head) > 1 or head in "sgN"):
        return head, head
    marked = re.fullmatch(r"(.*?)\s*(?:[(\[{<](.*)|[:=](.*)|\bin\b(.*))", head)
    if marked:
        found = next(filter(None, marked.groups()[1:]), "").strip(" )]}>")
        return marked[1].rstrip("/_ "), "" if found in ("1", "-") else found
    for gap in re.finditer(r"[\s_/,|-]+|(?<=[a-z])(?=[A-Z])", head):
        if _plain(head[gap.end() :]) in known:
            return head[: gap.start()], head[gap.end() :]
    return head, ""


def _plain(unit: str) -> str:
    """Return a unit in small letters, without signs between its parts."""
    plain = unicodedata.normalize("NFKC", unit).casefold().replace("\N{MINUS SIGN}", "-")
    return re.sub(r"[\s_*^.()\[\]{}·⋅]", "", plain)


def _fits(cells: list[str]) -> bool:
    """Whether all cells that are not empty are numbers, two or more."""
    filled = [cell for cell in cells if cell]
    return len(filled) > 1 and all(map(_NUMBER.fullmatch, filled))


def _text(path: str | os.PathLike[str]) -> bytes:
    """Return the bytes of a text file in UTF-8."""
    data = contents(path)
    for first, words in _PACKED.items():
        if data.startswith(first):
            raise ValueError(f"{path}: is {words}")
    encoding = "UTF-16" if data.startswith((b"\xff\xfe", b"\xfe\xff")) else "UTF-8"
    try:
        text = data.decode(encoding)
    except UnicodeDecodeError as error:
        raise ValueError(f"{path}: not a CSV file in {encoding}: {error}") from None
    if "\0" in text[:1000]:
        raise ValueError(f"{path}: is no text: must be a CSV file in UTF-8")
    return text.encode() if encoding == "UTF-16" else data
