"""One page with everything that was made: verdicts, figures, tables, and the values behind them.

The page links to the files beside it, so it is small and has the same bytes every time. Run times
are not in it but in a file of their own, which it shows.
"""

from __future__ import annotations

import platform
import re
import struct
from base64 import b64encode
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from fnmatch import fnmatchcase
from gzip import compress
from importlib.metadata import PackageNotFoundError, version
from importlib.resources import files
from pathlib import Path
from typing import Any

import damper
from damper.report.documents import table_in
from damper.report.stopped import idle_runs, stopped_early

#: Rows of a table that the page shows; the rest is in the file.
SHOWN_ROWS = 40
#: Largest page with its interactive figures, which can still be sent by mail and opens at once.
MOST_BYTES = 10e6
#: Headings of the list of studies -> names of these, in this order.
SUBJECTS = {
    "Design": "design machine_frame damper_mass performance free_decay one_mass four_masses",
    "Chatter": "chatter_map restitution restitution_below_resonance burst burst_duration "
    "accumulation border atlas small_mass_limit paper_?_histories",
    "Bifurcations": "paper_?_clearance paper_?_frequency paper_?_portraits two_impacts hysteresis "
    "basins basin_fractions idle_damper",
    "Forces": "earthquake shock noise",
    "Other models": "ball_on_table compliant friction grounded modulated vertical_damper modes "
    "pounding building",
    "Your studies": "",
    "Checks": "stress* solvers* calibration_*",
}
#: Where the front leads: title, text, study whose chapter it is or "claims".
CARDS = (
    ("Size a damper", "Which gap a machine needs, and what it gains: try any.", "machine_frame"),
    ("See chatter", "Bursts of impacts that end in sticking: watch any.", "restitution"),
    ("Check the papers", "Each statement, whether it holds, and the figure behind it.", "claims"),
)
_YES_NO = {"True": "yes", "False": "no"}
#: Scripts of the page, in this order.
SCRIPTS = ("engine.js", "page.js")
#: Attributes of cubes and packages that the foot of the page lists.
PROVENANCE = ("code_digest", "accuracy", "transient_periods", "recorded_periods", "runs")
PACKAGES = ("numpy", "numba", "pandas", "xarray", "netCDF4", "matplotlib", "plotly", "snakemake")


@dataclass(frozen=True)
class Figure:
    """A figure: its path below the folder of results without suffix.

    `caption` is what it shows, in words, `see` what to see in it, `settings` decide on what there
    is to say of how to read it, `size` is its printed width and
    height in the pixels of a page, 96 per inch.
    """

    path: str
    kind: str
    caption: str
    see: str = ""
    settings: Mapping[str, Any] = field(default_factory=dict)
    size: tuple[int, int] | None = None


@dataclass(frozen=True)
class ShownTable:
    """A table: its path below the folder of results without suffix, and its cells."""

    path: str
    kind: str
    head: Sequence[str] = ()
    rows: Sequence[Sequence[str]] = ()
    left_out: int = 0

    @property
    def shown(self) -> bool:
        """Whether the page holds its cells."""
        return bool(self.head)


@dataclass(frozen=True)
class Value:
    """A quantity of a study: name, value or range, where it comes from."""

    name: str
    value: str
    origin: str


@dataclass(frozen=True)
class Chapter:
    """One study."""

    name: str
    title: str
    source: str
    description: str
    values: Sequence[Value] = ()
    figures: Sequence[Figure] = ()
    tables: Sequence[ShownTable] = field(default_factory=tuple)
    stopped: str = ""
    idle: str = ""
    interactive: Sequence[tuple[str, str, str]] = ()
    """Path of each interactive figure, without suffix, its caption, and what to see in it."""
    provenance: Mapping[str, str] = field(default_factory=dict)
    """Provenance of the study, from its cube."""
    of_dampers: bool = True
    """Whether it is about dampers; others check the engine."""

    @property
    def subject(self) -> str:
        """What it is listed under."""
        return [*SUBJECTS][self.place[0]]

    @property
    def place(self) -> tuple[int, int]:
        """Place of its subject, and its own among the studies of that."""
        for at, names in enumerate(SUBJECTS.values()):
            for k, pattern in enumerate(names.split()):
                if fnmatchcase(self.name, pattern):
                    return at, k
        return [*SUBJECTS].index("Your studies" if self.of_dampers else "Checks"), 99

    @property
    def picture(self) -> str:
        """Path of the figure that stands for it, without suffix; nothing where it has none."""
        shown = (figure.path for figure in self.figures if figure.kind != "schematic")
        return next(shown, "")

    @property
    def all_values(self) -> str:
        """Every value of the study, in words, for the captions of its figures."""
        return "; ".join(f"{one.name.replace('_', ' ')} {one.value}" for one in self.values)


def chapter(about: Mapping[str, Any], results: Path) -> Chapter:
    """Collect what the page shows of one study.

    Parameters
    ----------
    about : mapping
        `damper.study.model.Study.about`.
    results : Path
        Folder of results, where the study's tables and the attributes of its cube are read.
    """
    cube = results / about["name"] / "cube.nc"
    return Chapter(
        about["name"],
        about["title"],
        about["source"],
        about["description"],
        [Value(*value) for value in about["values"]],
        [
            replace(Figure(*figure), size=_printed_size(results / f"{figure[0]}.png"))
            for figure in about["figures"]
        ],
        [_table(path, kind, results) for path, kind in about["tables"]],
        stopped_early(cube) if cube.is_file() else "",
        idle_runs(cube) if cube.is_file() else "",
        about.get("interactive", ()),
        _provenance(cube) if cube.is_file() else {},
        "interactive" in about,
    )


def _printed_size(picture: Path) -> tuple[int, int] | None:
    """Width and height of a PNG by its own resolution; None where there is no file.

    Nor where it shows times: these are no input of the page, and may come after it.
    """
    if "timed" in picture.parts or not picture.is_file():
        return None
    with picture.open("rb") as file:
        head = file.read(4096)
    width, height = struct.unpack(">II", head[16:24])
    per_metre = struct.unpack(">I", head[(at := head.index(b"pHYs") + 4) : at + 4])[0]
    return round(width * 96 / 0.0254 / per_metre), round(height * 96 / 0.0254 / per_metre)


def _provenance(cube: Path) -> dict[str, str]:
    from netCDF4 import Dataset

    with Dataset(cube) as file:
        known = all(hasattr(file, name) for name in PROVENANCE)
        return {name: f"{getattr(file, name)}" for name in PROVENANCE} if known else {}


def versions() -> dict[str, str]:
    """Versions of Python, of this package and of those that results depend on."""
    found = {"Python": platform.python_version(), "damper": damper.__version__}
    for name in PACKAGES:
        with suppress(PackageNotFoundError):
            found[name] = version(name)
    return found


def _table(path: str, kind: str, results: Path) -> ShownTable:
    if "/timed/" in path:  # times differ from run to run, and the page does not
        return ShownTable(path, kind)
    text = (results / f"{path}.md").read_text(encoding="utf-8")
    if "\n|" not in text:  # it says in words that there is nothing to list
        return ShownTable(path, kind)
    head, _, *rows = [line[2:-2].split(" | ") for line in table_in(text).splitlines()]
    read = [[re.sub(r"\\([|<])", r"\1", cell) for cell in row] for row in rows[:SHOWN_ROWS]]
    shown = [[_YES_NO.get(cell, cell) for cell in row] for row in read]
    return ShownTable(path, kind, head, shown, max(0, len(rows) - SHOWN_ROWS))


def typeset(text: str) -> str:
    """Return text as HTML, its units as formulas.

    Examples
    --------
    >>> str(typeset("2 F0/sqrt(K M) < d^(1/4)"))
    '2 F<sub>0</sub>/√(KM) &lt; d<sup>1/4</sup>'
    """
    from markupsafe import Markup, escape

    html = str(escape(text)).replace("sqrt(K M)", "√(KM)").replace("sqrt", "√")
    html = re.sub(r"\bF0\b", "F<sub>0</sub>", html)
    html = re.sub(r"\^\((\d/\d)\)", r"<sup>\1</sup>", html)
    return Markup(re.sub(r"\^(\d)|(?<=m/s)(2)\b", r"<sup>\1\2</sup>", html))


def plotly_script() -> str:
    """Return plotly for the page, which unpacks it: two megabytes instead of five."""
    code = (files("plotly") / "package_data/plotly.min.js").read_bytes()
    return f'damper.packed = "{b64encode(compress(code, mtime=0)).decode()}";\n'


def too_large(paths: Iterable[Path], most: float = MOST_BYTES) -> str:
    """Say which files make the page too large to share; nothing if it is not.

    Parameters
    ----------
    paths : iterable of Path
        The page and what belongs to it; those that are there count.
    most : float
        In bytes.

    Returns
    -------
    str
    """
    sizes = {path: path.stat().st_size for path in paths if path.is_file()}
    if sum(sizes.values()) <= most:
        return ""
    largest = sorted(sizes, key=lambda path: -sizes[path])[:3]
    parts = ", ".join(f"{path} {sizes[path] / 1e6:.1f} MB" for path in largest)
    return (
        f"The page has {sum(sizes.values()) / 1e6:.1f} MB with its interactive figures, more than "
        f"{most / 1e6:g} MB. The largest parts: {parts}. Fewer figures with `interactive: true`, "
        "fewer points or fewer panels make it smaller."
    )


def words(path: str) -> str:
    """Return a file's name as people read it.

    Examples
    --------
    >>> words("two_impacts/figures/clearance_mass_ratio~0.1")
    'clearance mass ratio 0.1'
    """
    return path.rpartition("/")[2].replace("_", " ").replace("~", " ")


def captions(folder: Path, kinds: Iterable[str]) -> dict[str, Callable[[Mapping[str, Any]], str]]:
    """Return, for each kind of figure or table, what says by its settings how to read it, as HTML.

    Parameters
    ----------
    folder : Path
        With a reStructuredText file for each kind, a Jinja template of the settings, so that it can
        leave out absent settings; a kind may have no file.
    kinds : iterable of str
    """
    from docutils.core import publish_parts
    from jinja2 import Environment

    docutils = {"report_level": 2, "halt_level": 2, "syntax_highlight": "none"}

    def reader(path: Path) -> Callable[[Mapping[str, Any]], str]:
        text = path.read_text(encoding="utf-8") if path.is_file() else ""
        template = Environment(trim_blocks=True).from_string(text)

        def how_to_read(settings: Mapping[str, Any]) -> str:
            said = template.render({"variables": [], **settings})
            parts = publish_parts(said, writer="html5", settings_overrides=docutils)
            return str(parts["fragment"]).strip()

        return how_to_read

    return {kind: reader(folder / f"{kind}.rst") for kind in sorted(set(kinds))}


def _cards(
    chapters: Sequence[Chapter], verdicts: Sequence[Mapping[str, str]]
) -> Iterator[dict[str, str]]:
    """Title, text, target and picture of each card whose chapter there is."""
    made = {one.name: one for one in chapters}
    for title, text, name in CARDS:
        card = {"title": title, "text": text, "target": name}
        if name == "claims" and verdicts:
            drawn = {figure.path for one in chapters for figure in one.figures}
            named = " ".join(row["figures"] for row in verdicts).split()
            yield card | {"picture": next((path for path in named if path in drawn), "")}
        elif name in made:
            one = made[name]
            target = f"figure={one.interactive[0][0]}" if one.interactive else name
            yield card | {"target": target, "picture": one.picture}


def page(
    chapters: Sequence[Chapter],
    verdicts: Sequence[Mapping[str, str]],
    how_to_read: Mapping[str, Callable[[Mapping[str, Any]], str]],
    template: Path,
) -> str:
    """Render the page.

    Parameters
    ----------
    chapters : sequence of Chapter
    verdicts : sequence of mapping
        Rows of claims.csv.
    how_to_read : mapping
        From `captions`.
    template : Path
        A Jinja template; the page's scripts, engine.js and page.js, lie beside it.
    """
    from jinja2 import Environment, StrictUndefined

    environment = Environment(autoescape=True, undefined=StrictUndefined, trim_blocks=True)
    environment.filters |= {"words": words, "typeset": typeset}
    chapters = sorted(chapters, key=lambda one: one.place)
    subjects = {name: [one for one in chapters if one.subject == name] for name in SUBJECTS}
    studies = [{path.partition("/")[0] for path in row["figures"].split()} for row in verdicts]
    text = environment.from_string(template.read_text(encoding="utf-8")).render(
        chapters=chapters,
        subjects=subjects,
        verdicts=[
            {**row, "shown_by": [one for one in chapters if one.name in names]}
            for row, names in zip(verdicts, studies, strict=True)
        ],
        cards=list(_cards(chapters, verdicts)),
        counts=dict(sorted(Counter(row["verdict"] for row in verdicts).items())),
        how_to_read=how_to_read,
        provenance=PROVENANCE,
        versions=versions(),
        script="".join((template.parent / name).read_text(encoding="utf-8") for name in SCRIPTS),
    )
    return text if text.endswith("\n") else f"{text}\n"
