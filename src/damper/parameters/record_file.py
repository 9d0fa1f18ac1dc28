"""Files of records: layout, units and mistakes are found here; numpy and SciPy read the numbers."""

from __future__ import annotations

import csv
import io
import os
import re
import unicodedata
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import cached_property, partial
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from damper.parameters.files import contents, matlab_variables, scipy_io
from damper.parameters.names import unknown_name

if TYPE_CHECKING:
    import numpy as np

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
#: Unit of a column -> its multiples, which are converted.
_MULTIPLES: dict[str, dict[str, float]] = {
    "N": {"kN": 1e3, "kgf": 9.80665, "lbf": 4.4482216152605},
    "s": {"ms": 1e-3, "msec": 1e-3, "us": 1e-6, "μs": 1e-6, "min": 60.0},
    "m": {"mm": 1e-3, "cm": 1e-2, "um": 1e-6, "μm": 1e-6},
    "m/s": {"mm/s": 1e-3, "cm/s": 1e-2},
    "m/s2": {
        "g": 9.80665,
        "mg": 9.80665e-3,
        "mm/s2": 1e-3,
        "cm/s2": 1e-2,
        "cm/sec2": 1e-2,
        "Gal": 1e-2,
        "in/s2": 0.0254,
        "ft/s2": 0.3048,
    },
}
#: Units that may end the head of a column without brackets, such as `time_ms`: of times, of values.
_TIMES = f"{_SPELLINGS['s']} ms msec us μs usec ns min minutes h hr hours samples"
_VALUES = f"{_SPELLINGS['N']} {_SPELLINGS['m/s2']} " + (
    "kn mn lb lbs lbf kip kgf kg dyn g mg g0 %g % gal mgal mm/s2 cm/s2 ft/s2 in/s2 mms-2 cms-2 "
    "m/s mm/s cm/s m mm cm μm um ft v mv volt volts pa kpa mpa bar counts"
)


#: Samples and their step in the head of a PEER file, of both its forms.
_AT2 = (
    re.compile(r"NPTS\s*=\s*(\d+)\s*,\s*DT\s*=\s*([\d.]+(?:E[-+]?\d+)?)", re.I),
    re.compile(r"^\s*(\d+)\s+([\d.]+(?:E[-+]?\d+)?)\s+NPTS\s*,\s*DT", re.I | re.M),
)
_AT2_LINES = 4


class Reading(NamedTuple):
    """How a file of a record is read, where the file does not say it.

    Parameters
    ----------
    columns : tuple of str or int, optional
        Columns, or variables, of time and value; with `step` that of the value; channel of a WAV
        file, number of a time response in a universal file.
    delimiter : str, optional
        Separator of the columns of text.
    step : float, optional
        Time between samples, of a file with values alone.
    factor : float, optional
        By what values are multiplied, in place of the unit that the file gives.
    """

    columns: Sequence[str | int] | None = None
    delimiter: str | None = None
    step: float | None = None
    factor: float | None = None


def columns_of(text: Any) -> Any:
    """Columns of a text with commas between names and numbers; anything else as it is.

    Examples
    --------
    >>> columns_of("t, 2"), columns_of(2), columns_of(["t", "x"])
    (['t', 2], [2], ['t', 'x'])
    """
    if isinstance(text, str):
        cells = (cell.strip() for cell in text.split(","))
        return [int(cell) if cell.isdecimal() else cell for cell in cells]
    return [text] if isinstance(text, int) else text


def two_columns(given: Any) -> tuple[str | int, ...]:
    """Return one column or two, names or numbers; ValueError for anything else."""
    found: Any = (given,) if isinstance(given, str | int) else ()
    if not found and isinstance(given, Iterable):
        found = tuple(given)
    is_name = [isinstance(one, str | int) and not isinstance(one, bool) for one in found]
    if is_name not in ([True], [True, True]):
        raise ValueError(
            f"columns = {given!r}: must be those of time and value, names or numbers from 0"
        )
    return found


class Samples(NamedTuple):
    """What a file holds: `found` describes it, `unit` is empty where the file gives none."""

    times: np.ndarray
    values: np.ndarray
    unit: str
    found: str
    line_of: Callable[[int], int] | None = None


def read_samples(path: str | os.PathLike[str], units: tuple[str, str], how: Reading) -> Samples:
    """Read times and values from a file of CSV, PEER (AT2), MATLAB, WAV or UFF.

    Times and values are in `units`, into which multiples that the file names, such as ms or g, are
    converted.

    Raises
    ------
    ValueError, OSError
        With the file, the line, and what is wrong in it.
    """
    suffix = Path(path).suffix.lower()
    kind = {".wav": "WAV", ".mat": "MATLAB", ".uff": "UFF", ".unv": "UFF"}.get(suffix, "")
    if not kind:
        text = _text(path)
        head = b"\n".join(text.split(b"\n", _AT2_LINES)[:_AT2_LINES]).decode()
        if suffix == ".at2" or any(each.search(head) for each in _AT2):
            kind = "PEER"
    for name in _NOT_OF[kind]:
        if getattr(how, name) is not None:
            raise ValueError(f"{path}: a {kind} file has no use for {name}: must be left out")
    if kind not in ("WAV", "UFF") and how.columns and len(how.columns) == 1 and how.step is None:
        raise ValueError(
            f"{path}: columns = {how.columns!r}: must be those of time and value, or `step` has to "
            "say the time between samples"
        )
    if how.columns and len(how.columns) == 2 and how.step is not None:
        raise ValueError(
            f"{path}: columns = {how.columns!r} and `step`: must be the column of the value, or "
            "`step` left out"
        )
    if kind:
        readers = {"WAV": _wave, "MATLAB": _matlab, "PEER": _peer, "UFF": _universal}
        return readers[kind](path, units, how)
    file = RecordFile(path, units, how.columns, how.delimiter, how.step, how.factor)
    times, values = file.samples
    return Samples(times, values, file.unit, file.found, file.line_of)


#: Keys of `Reading` that a kind of file does not take.
_NOT_OF = {
    "": (),
    "WAV": ("delimiter", "step"),
    "UFF": ("delimiter", "step"),
    "MATLAB": ("delimiter",),
    "PEER": ("columns", "delimiter", "step"),
}


class RecordFile:
    """A CSV file of times and values.

    Parameters
    ----------
    path : path
        The file.
    units : (str, str)
        Units of time and value.
    columns : (str or int, str or int), optional
        Columns of time and value, where there are more than these two; with `step` one of them is
        enough.
    delimiter : str, optional
        Separator of the columns; found in the file where it is not given.
    step, factor : float, optional
        As of `Reading`.
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
        step: float | None = None,
        factor: float | None = None,
        words: str = "time and value",
    ) -> None:
        self.path, self._columns, self._step = path, columns, step
        self._words = words
        self._converted: list[str] = []
        self.unit, self._sizes = "", [1.0, 1.0 if factor is None else factor]
        self._has_factor = factor is not None
        self._data = _text(path)
        self._separator, self._decimal = delimiter or "", "."
        self._head: list[str] = []
        self._head_line = self._skipped = 0
        self._find_layout()
        if row := next(self._rows(), None):
            self._check_count(*row)
        if step is None:
            given: Sequence[str | int] = columns or (0, 1)
            self._places = [self._place(k, given[k], units[k]) for k in (0, 1)]
        else:
            self._places = [self._place(1, (columns or (0,))[-1], units[1])]

    @property
    def found(self) -> str:
        """Columns, decimal sign and units in words; empty for commas, points and SI units."""
        return ", ".join(filter(None, [self._layout, *self._converted]))

    @property
    def _layout(self) -> str:
        named = SEPARATORS.get(self._separator, repr(self._separator))
        alone = self._step is not None and self._columns is None
        return ", ".join(
            [f"{named} between columns"] * (self._separator != "," and not alone)
            + ["decimal commas"] * (self._decimal == ",")
            + ["one column"] * alone
        )

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
        values = self._sizes[1] * table[:, -1]
        if self._step is not None:
            return self._step * np.arange(len(values)), values
        return self._sizes[0] * table[:, 0], values

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
        alone = self._step is not None and self._columns is None
        if alone and lines and _NUMBER.fullmatch(lines[-1][1].strip()):
            self._separator = self._separator or " "  # one column, maybe with decimal commas
        for line in () if self._separator else lines:
            fit = (each for each in SEPARATORS if _fits(self._cells(*line, each)))
            self._separator = self._separator or next(fit, "")
        if not self._separator:
            self._separator = next((s for s in "\t;, " if lines and s in lines[-1][1]), ",")
        if not lines:
            return
        first = self._cells(*lines[0])
        if alone and self._separator == " ":
            first = [lines[0][1].strip()]  # a head of one column may have blanks
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
            if which and self._has_factor:
                return column
            if found and which:
                self.unit = unit
            size = _size(found, unit)
            if size not in (None, 1.0):
                self._sizes[which] = size
                self._converted.append(_taken(name, found, size, unit))
            elif size is None and found:
                raise ValueError(
                    f"{self.path}, line {self._head_line}: {name} is in {found}: must be in "
                    f"{_allowed(unit)}, or without unit"
                    + ("; `factor` may give its size" if which else "")
                )
        return column

    def _check(self, number: int, text: str) -> None:
        """Raise ValueError for a line that does not hold a sample."""
        cells, where = self._check_count(number, text)
        for place in self._places:
            if not 0 <= place < len(cells) or not cells[place]:
                raise ValueError(f"{where}: there is nothing in column {place} (from 0)")
            if not _NUMBER.fullmatch(cells[place]):
                raise ValueError(f"{where}: {cells[place]!r} is no number")

    def _check_count(self, number: int, text: str) -> tuple[list[str], str]:
        """Return cells and place of a line, in words; ValueError where it has too many or few."""
        cells, where = self._cells(number, text), f"{self.path}, line {number}"
        if self._layout:
            where += f" ({self._layout})"
        alone = self._step is not None
        if self._columns is None and len(cells) == 1 and not alone:
            raise ValueError(
                f"{where}: 1 column: must be two, {self._words}, and `delimiter` may say what "
                "stands between them; of values alone `step` says the time between samples"
            )
        if self._columns is None and alone and len(cells) != 1:
            raise ValueError(
                f"{where}: {len(cells)} columns and `step`: must be one, or `columns` has to say "
                "which is the value"
            )
        if self._columns is None and not alone and len(cells) != 2:
            raise ValueError(
                f"{where}: {len(cells)} columns: must be two, or `columns` has to say which are "
                f"{self._words}"
            )
        return cells, where

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
        alone = self._step is not None and self._columns is None
        # Numbers such as 1,05: no second column of whole numbers has 05.
        told = self._separator != " " or re.search(rb",0\d", self._data)
        if alone and self._decimal == "," and not told:
            number, text = next(row for row in self._rows() if "," in row[1])
            raise ValueError(
                f"{self.path}, line {number}: {text.strip()} may be two columns or one number: "
                "`columns` must say which is the value, or `delimiter` be ';' for decimal commas"
            )


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


def _size(found: str, unit: str) -> float | None:
    """Return the size of a unit that a file names in the one that is asked for, if it is known."""
    sizes = dict.fromkeys(_SPELLINGS[unit].split(), 1.0)
    return (sizes | {_plain(name): size for name, size in _MULTIPLES.get(unit, {}).items()}).get(
        _plain(found)
    )


def _allowed(unit: str) -> str:
    return ", ".join([unit, *_MULTIPLES.get(unit, {})])


def _taken(name: str, found: str, size: float, unit: str) -> str:
    return f"{name} in {found}, which is taken as {size:g} {unit}"


def _factor(what: str, found: str, unit: str, how: Reading) -> tuple[float, list[str]]:
    """By what values are multiplied, and words for a unit that is converted."""
    if how.factor is not None:
        return how.factor, []
    factor = _size(found, unit)
    if factor is None:
        raise ValueError(
            f"{what} in {found or 'no unit'}: must be in {_allowed(unit)}; `factor` may give its "
            "size"
        )
    return factor, [] if factor == 1.0 else [_taken("values", found, factor, unit)]


def _peer(path: Any, units: tuple[str, str], how: Reading) -> Samples:
    """Read the text of the PEER ground motion database: a head of four lines, values in rows."""
    import numpy as np

    lines = _text(path).decode("utf-8-sig").splitlines()
    head = "\n".join(lines[:_AT2_LINES])
    marks = next(filter(None, (each.search(head) for each in _AT2)), None)
    if marks is None:
        raise ValueError(f"{path}: the first {_AT2_LINES} lines of a PEER file must be NPTS=, DT=")
    named = re.search(r"UNITS OF\s+(\S+)", head, re.I)
    factor, more = _factor(f"{path}: a PEER file", named[1] if named else "", units[1], how)
    first = 1 + head[: marks.end()].count("\n")
    try:
        values = np.array(" ".join(lines[first:]).split(), dtype=float)
    except ValueError as error:
        raise ValueError(f"{path}: not a table of numbers: {error}") from None
    count, step = int(marks[1]), float(marks[2])
    if len(values) != count:
        raise ValueError(f"{path}: {len(values)} samples: must be {count}, as NPTS says")
    words = [f"a PEER file of {count} samples, {step:g} s apart"]
    return Samples(step * np.arange(count), factor * values, units[1], ", ".join(words + more))


def _wave(path: Any, units: tuple[str, str], how: Reading) -> Samples:
    """Read a channel of a WAV file, as parts of its full scale."""
    import numpy as np

    try:
        rate, samples = scipy_io(path).wavfile.read(io.BytesIO(contents(path)))
    except ValueError as error:
        raise ValueError(f"{path}: not a WAV file: {error}") from None
    if samples.ndim > 1:
        count = samples.shape[1]
        if not how.columns or how.columns[0] not in range(count):
            raise ValueError(f"{path}: {count} channels: columns must be one of 0 to {count - 1}")
        samples = samples[:, how.columns[0]]
    size = 1.0
    if samples.dtype.kind in "iu":
        size = float(np.iinfo(samples.dtype).max + 1)
        if samples.dtype.kind == "u":
            size *= 0.5
            samples = samples - size
    factor = 1.0 if how.factor is None else how.factor
    found = f"a WAV file of {rate} samples a second, whose full scale is {factor:g} {units[1]}"
    return Samples(np.arange(len(samples)) / rate, samples * (factor / size), "", found)


def _universal(path: Any, units: tuple[str, str], how: Reading) -> Samples:
    """Read a time response (dataset 58 of function type 1) of a universal file."""
    try:
        import pyuff
    except ImportError:
        raise ValueError(f"{path}: reading it needs pyuff (pip install pyuff)") from None
    contents(path)  # an error of the system where there is no such file
    try:
        file = pyuff.UFF(os.fspath(path))
        sets = [file.read_sets(k) for k, kind in enumerate(file.get_set_types()) if kind == 58]
    # Of all classes, as its readers meet what they do not expect.
    except Exception as error:
        raise ValueError(f"{path}: not a universal file: {error}") from None
    responses = [each for each in sets if each["func_type"] == 1]
    if not responses:
        raise ValueError(f"{path}: has no time response (dataset 58 of function type 1)")
    number, last = (how.columns or (0,))[0], len(responses) - 1
    if number not in range(last + 1) or (last and not how.columns):
        raise ValueError(f"{path}: {last + 1} time responses: columns must be one of 0 to {last}")
    response = responses[int(number)]
    given, unit, more = response["ordinate_axis_units_lab"].strip(), "", list[str]()
    factor = 1.0 if how.factor is None else how.factor
    if given.upper() not in ("", "NONE"):
        unit = units[1]
        factor, more = _factor(f"{path}: a time response", given, unit, how)
    found = ", ".join([f"time response {number} of a universal file", *more])
    return Samples(response["x"], factor * response["data"], unit, found)


def _matlab(path: Any, units: tuple[str, str], how: Reading) -> Samples:
    """Read two variables of a MATLAB file; with `step` one."""
    import numpy as np

    arrays = {
        name: np.ravel(array).astype(float)
        for name, array in matlab_variables(path).items()
        if getattr(array, "dtype", np.dtype(object)).kind in "iuf"
        and 1 < array.size == max(array.shape)
    }
    names = list(how.columns or arrays)[-1 if how.step is not None and how.columns else 0 :]
    for name in names:
        if name not in arrays:
            raise unknown_name(f"variable of {path}", name, arrays)
    alone = how.step is not None
    if len(names) != (1 if alone else 2):
        raise ValueError(
            f"{path}: has {', '.join(arrays) or 'no list of numbers'}: columns must name "
            + (
                "that of the values"
                if alone
                else "those of time and value; `step` may give the times"
            )
        )
    times, values = (arrays[str(name)] for name in (names[0], names[-1]))
    if how.step is not None:
        times = how.step * np.arange(len(values))
    elif how.columns is None and not (np.diff(times) > 0).all() and (np.diff(values) > 0).all():
        times, values, names = values, times, names[::-1]
    found = f"variables {', '.join(dict.fromkeys(map(str, names)))} of a MATLAB file"
    return Samples(times, (1.0 if how.factor is None else how.factor) * values, "", found)
