"""The page of a design as HTML and Markdown, its figures, CSV and studies."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator, Sequence
from html import escape
from itertools import cycle
from pathlib import Path
from tempfile import TemporaryFile
from typing import TYPE_CHECKING, Any

import pandas as pd

from damper.figures import schematic
from damper.figures.common.layout import write_prefixes
from damper.figures.common.panels import panel_grid
from damper.figures.common.style import (
    BLACK,
    COLOURS,
    COLUMN,
    PURPLE,
    RELATIVE,
    WITHOUT,
    label,
    save,
    style,
)
from damper.parameters.lazy import Figure
from damper.sizing.contact import STEEL
from damper.sizing.machine import RECORDS
from damper.sizing.search import DIGITS
from damper.sizing.words import ROUNDING, text_of
from damper.study.yaml_file import dump_yaml
from damper.tables import Table

if TYPE_CHECKING:
    from damper.sizing.answer import Design

_CSS = """:root { color-scheme: light dark; --line: #ddd; --warn: #fdeee6 }
@media (prefers-color-scheme: dark) { :root { --line: #444; --warn: #4a2a17 }
body { background: #16181b; color: #e4e4e4 } svg { filter: invert(0.9) hue-rotate(180deg) } }
main > div { overflow-x: auto }
body { font: 15px/1.45 sans-serif; max-width: 52em; margin: 2em auto; padding: 0 1em }
table { border-collapse: collapse; margin: 0.8em 0 } svg { max-width: 100%; height: auto }
figure { margin: 1em 0 } ul { padding-left: 1.2em }
td, th { padding: 0.15em 0.9em 0.15em 0; text-align: left; border-bottom: 1px solid var(--line) }
blockquote { background: var(--warn); border-left: 4px solid #D55E00; font-weight: bold;
padding: 0.5em 0.8em; margin: 0.4em 0 }"""
_STYLE = (
    f'<meta name="viewport" content="width=device-width, initial-scale=1"><style>{_CSS}</style>'
)
_WITHOUT: dict[str, Any] = {"color": WITHOUT, "lw": 2.5, "label": "without damper"}
_BUILT: dict[str, Any] = {"color": BLACK, "lw": 1.2, "label": "with damper as built, worst start"}
_WORST: dict[str, Any] = {"color": PURPLE, "lw": 1.0, "ls": "--", "label": "all tolerances, too"}
#: Highest ratio to the motion without damper, and displacement over the worst case, that is shown.
_HIGHEST = 3.0
#: Digits of what is given.
_GIVEN = 6
#: Length inside of the box as drawn, and the least of a ball or a gap.
_INSIDE, _LEAST_SEEN = 8.0, 1.4
#: Of an upright box, which is drawn lying.
_DOWN = "down is to the left"
#: Sum of the diameters of several balls as drawn, and height of the drawing in inches at most.
_LARGEST_BALLS, _HIGHEST_BOX = 7.0, 6.5
#: Size of letters in the box of the sketch, in points.
_SMALL = 7.0

#: Tables of an answer that are drawn.
_DRAWN = ("response", "history")
#: Files of a page; its studies are in a folder of their own.
_FILES = (
    *(f"design.{kind}" for kind in ("html", "md")),
    *(f"{name}.{kind}" for name in ("sketch", "box", *_DRAWN) for kind in ("svg", "png")),
    *(f"{name}.csv" for name in ("numbers", *_DRAWN, "record")),
    "machine.yaml",
)


def prepare(
    folder: Path, read: Iterable[str | Path | None], files: Sequence[str] = _FILES
) -> list[Path]:
    """Make a folder for a page, and return the files in it of an older one.

    Parameters
    ----------
    folder : Path
    read : iterable of path or None
        Files that the answer reads.
    files : sequence of str
        Files of the page; its Markdown names its studies.

    Raises
    ------
    ValueError
        Where the folder cannot be written, holds a folder in place of a file, or a file of `read`
        that would be replaced.
    """
    studies = folder / "studies"
    try:
        studies.mkdir(parents=True, exist_ok=True)
        for place in (folder, studies):
            TemporaryFile(dir=place).close()
    except OSError as error:
        raise ValueError(
            f"output = {folder}: cannot be written ({error.strerror}): must be a folder, or free "
            "for a new one"
        ) from None
    inputs = {Path(path).resolve() for path in read if path is not None}
    for path in (*(folder / name for name in files), *studies.glob("*.yaml")):
        if path.is_dir():
            raise ValueError(f"output = {folder}: {path} is a folder: must be free for a file")
        if path.resolve() in inputs:
            raise ValueError(
                f"output = {folder}: {path} is read, and would be replaced: must be another folder"
            )
    page = next(folder / name for name in files if name.endswith(".md"))
    text = page.read_text("utf-8", errors="replace") if page.exists() else ""
    named = sorted(set(re.findall(r"studies/[\w-]+\.yaml", text)))
    return [path for name in (*files, *named) if (path := folder / name).exists()]


def write(design: Design, folder: Path) -> None:
    """Write page, figures, CSV files, the machine and the studies of a design into a folder.

    The files of an older page there are deleted first.
    """
    for path in prepare(folder, design.machine.records):
        path.unlink()
    machine, studies = design.machine.written(), design.studies
    texts = {}
    if design.machine.is_recorded:  # its samples go into a file of their own
        record = design.machine.record
        machine |= dict.fromkeys(machine.keys() & RECORDS.keys(), "record.csv")
        machine = {name: x for name, x in machine.items() if not name.startswith("record_")}
        samples = pd.DataFrame({"time (s)": record.time, "value": record.value})
        texts["record.csv"] = samples.to_csv(index=False)
        force = {"kind": "record", "file": "../record.csv", "of": record.of}
        studies = {name: study | {"forcing": force} for name, study in studies.items()}
    texts["machine.yaml"] = dump_yaml(machine)
    texts |= {f"studies/{name}.yaml": dump_yaml(study) for name, study in studies.items()}
    figures = {"box": box(design)} | ({} if design.box else {"sketch": sketch(design)})
    for name, draw in zip(_DRAWN, (response, history), strict=True):
        if (drawn := getattr(design, name)) is not None:
            texts[f"{name}.csv"] = drawn.to_csv(index=False)
            figures[name] = draw(design)
    with style():
        for name, figure in figures.items():
            save(figure, folder / f"{name}.svg")
            save(figure, folder / f"{name}.png")
    units = {"box": ""} | design.units
    numbers = [(n, getattr(design, n), units[n], words) for n, words, _ in design.lines]
    data = pd.DataFrame(numbers, columns=["name", "value", "unit", "meaning"])
    table = Table(f"{design.machine.title}: its impact damper", data, list(_body(design)))
    table.save(folder / "numbers.csv", folder / "design.md")
    texts["design.html"] = html_of(table, folder)
    for name, text in texts.items():
        (folder / name).write_text(text, encoding="utf-8", newline="\n")


def _body(design: Design) -> Iterator[str | pd.DataFrame]:
    """The page below its title, as Markdown and tables."""
    m = design.machine
    yield from (f"> **{text}**" for text in design.warnings)
    if design.box:
        yield f"The damper is in the box {design.box!r} of the structure, {_drives(m)}."
    else:
        yield f"![The machine, {_drives(m)}, and its damper](sketch.png)"
    yield f"## What it does to the {m.measured[2]}"
    yield pd.DataFrame([line[1:] for line in design.lines], columns=["quantity", "value"])
    if design.response is not None:
        words = "Response in the band and beyond" if m.band else "Motion"
        yield f"![{words}, with the damper and without](response.png)"
    if design.history is not None:
        yield "![The worst case about its largest displacement](history.png)"
    for heading, text, frame in design.tables:
        yield f"## {heading}"
        yield text
        if heading == "What to build":
            boxes = "boxes" if design.boxes_to_build > 1 else "box"
            yield f"![The {boxes} with a steel ball, and the way of the ball](box.png)"
        yield frame
    yield "## What was assumed"
    yield "\n".join(f"- {text}" for text in design.assumed)
    files = ", ".join(f"studies/{name}.yaml" for name in design.studies) or "the closed forms"
    made = (
        f"Numbers are those of the search's own runs; {files} has such runs from rest."
        if design.box
        else f"Every number is made by {files}; limits of the gap by following the periodic "
        "motion, and changes along it where it is said."
    )
    yield f"{made} The machine is in machine.yaml, numbers.csv has all digits."
    if design.slopes:
        yield f"Sizes are rounded as far as the answer changes by {100.0 * ROUNDING:g} % at most."


def html_of(table: Table, folder: Path) -> str:
    """Return the page as HTML that contains its figures."""
    parts = []
    for part in table.body:
        if not isinstance(part, str):
            parts.append(f"<div>{part.to_html(index=False, border=0)}</div>")
        elif found := re.fullmatch(r"!\[(.*)\]\((.*)\.png\)", part):
            drawn = (folder / f"{found[2]}.svg").read_text("utf-8")
            words = f"<figcaption>{escape(found[1])}</figcaption>"
            parts.append(f"<figure>{drawn[drawn.index('<svg') :]}{words}</figure>")
        else:
            before, tag = next(pair for pair in _TAGS if part.startswith(pair[0]))
            lines = part.split("\n") if before == "- " else [part.strip("*")]
            made = [f"<{tag}>{escape(line.removeprefix(before))}</{tag}>" for line in lines]
            parts += ["<ul>", *made, "</ul>"] if tag == "li" else made
    title = escape(table.title)
    head = f'<!doctype html>\n<html lang="en"><head><meta charset="utf-8"><title>{title}</title>'
    body = "\n".join([f"<h1>{title}</h1>", *parts])
    return f"{head}{_STYLE}</head>\n<body><main>\n{body}\n</main></body></html>\n"


#: First characters of a part of the body -> its element.
_TAGS = (("## ", "h2"), ("> **", "blockquote"), ("- ", "li"), ("", "p"))


def _drives(m: Any) -> str:
    """What makes the machine vibrate, in words."""
    kind, amplitude = m.force
    if kind == "none":
        return f"let go at {text_of(m.initial_displacement, 'm')}"
    if m.is_recorded:
        what = "under a force" if m.force_record is not None else "on a base that is accelerated"
        return f"{what} as recorded over {m.record.end:.4g} s"
    low, high = m.band or (0.0, 0.0)
    band = f" at {low:g} to {high:g} Hz"
    if kind == "base":
        return f"on a base that moves by {text_of(amplitude, 'm')}{band}"
    unbalance = kind == "unbalance"
    words = text_of(amplitude, "kg m" if unbalance else "N", _GIVEN)
    return f"under {'an unbalance' if unbalance else 'a force'} of {words}{band}"


def sketch(design: Design) -> Figure:
    """Draw the machine and its damper with their dimensions."""
    m, given = design.machine, design.machine.primary
    kind, amplitude = m.force
    in_hertz = m.natural_frequency is not None
    force = text_of(amplitude, "N", _GIVEN) if kind == "harmonic" else ""
    with style():
        figure, ax = schematic.sheet()
        schematic.box(
            ax,
            text_of(m.mass, "kg", _GIVEN),
            "",
            # As the machine was given.
            text_of(m.natural_frequency, "Hz", DIGITS)
            if in_hertz
            else text_of(given["stiffness"], "N/m", DIGITS),
            f"{text_of(100.0 * m.damping_ratio, '%')} of critical"
            if in_hertz
            else text_of(given["damping"], "N s/m"),
            force if m.force_record is None else "$F(t)$",
            f"$x_0$ = {text_of(m.initial_displacement, 'm')}" if m.is_free else "$x$",
            "$y$",
        )
        if kind == "unbalance":
            schematic.rotor(ax, text_of(amplitude, "kg m", _GIVEN))
        elif kind == "base":
            schematic.moving_base(ax, f"± {text_of(amplitude, 'm')}")
        elif m.acceleration_record is not None:
            schematic.moving_base(ax, "$a(t)$")
        boxes = design.boxes_to_build
        free = f"free mass {text_of(design.free_mass, 'kg', design.digits('free_mass'))}"
        free += f" in {boxes} boxes" if boxes > 1 else ""
        ax.text(3.75, 2.8, free, va="center", fontsize=_SMALL)
        if m.weight.get("gravity"):
            ax.text(5.7, 3.3, _DOWN, ha="center", va="center", fontsize=_SMALL)
        for first, last in ((3.6, 5.2), (6.2, 7.8)):
            length = text_of(0.5 * design.gap, "m", design.digits("gap") + 1)
            schematic.dimension(ax, first, last, 1.6, length, _SMALL)
        figure.set_size_inches(1.3 * COLUMN, 0.65 * COLUMN)
    return figure


def box(design: Design) -> Figure:
    """Draw the box with a steel ball: diameter, gap, length inside, direction of motion.

    Of several masses each box is drawn.
    """
    boxes = design.boxes_to_build
    diameter, across, length = design.ball_and_box(STEEL.density)
    inside = diameter + design.gap
    # To scale, unless ball or gap would not be seen.
    largest = _INSIDE - _LEAST_SEEN if boxes == 1 else max(_LEAST_SEEN, _LARGEST_BALLS / boxes)
    drawn = max(_INSIDE * design.gap / inside, _LEAST_SEEN, _INSIDE - largest)
    drawn = min(drawn, _INSIDE - _LEAST_SEEN)
    scaled = math.isclose(drawn, _INSIDE * design.gap / inside)
    with style():
        figure, ax = schematic.sheet()
        schematic.box_with_ball(
            ax,
            _INSIDE,
            drawn,
            f"{'ball, steel: ' if boxes == 1 else ''}Ø {across}",
            text_of(design.gap, "m", design.digits("gap")),
            f"inside {length}" + ("" if scaled else ", not to scale"),
            boxes,
            "direction of motion" + (f", {_DOWN}" if design.machine.weight.get("gravity") else ""),
        )
        (left, right), (low, high) = ax.get_xlim(), ax.get_ylim()
        width = min(1.3 * COLUMN, _HIGHEST_BOX * (right - left) / (high - low))
        figure.set_size_inches(width, width * (high - low) / (right - left))
    return figure


def response(design: Design) -> Figure:
    """Draw the response with and without the damper, or the decay of free motion."""
    table, m = design.response, design.machine
    assert table is not None
    with style():
        if m.band is None:
            figure, ((ax,),) = panel_grid(1, height=2.6)
            for name, look in (("without", _WITHOUT), ("as_built", _BUILT)):
                ax.plot(table.time, table[name], **look | ({} if m.is_free else {"lw": 0.9}))
            if m.is_free:
                ax.axhline(m.decay_to * table.as_built.iloc[0], color=BLACK, lw=0.5, ls=":")
                ax.set(xlabel="time / s", ylabel="peaks of the displacement / m", yscale="log")
            else:
                from_base = " from the base" if m.acceleration_record is not None else ""
                ax.set(xlabel="time / s", ylabel=f"displacement{from_base} / m")
                ax.set_xlim(table.time.min(), table.time.max())
            ax.legend(frameon=False)
            write_prefixes(figure)
            return figure
        figure, ((upper,), (lower,)) = panel_grid(2, height=4.2, height_ratios=(2, 1))
        for ax in (upper, lower):
            ax.axvspan(*m.band, color="#EAF1F6", lw=0.0)
        looks = {"without": _WITHOUT, "worst": _WORST, "as_built": _BUILT}
        if not m.has_tolerances:  # the worst case is as built
            del looks["worst"]
        for name, look in looks.items():
            upper.plot(table.frequency, table[name], **look)
            lower.plot(table.frequency, table[name] / table.without, **look)
        if m.limit is not None:
            upper.axhline(m.limit, color=BLACK, lw=0.5, ls=":")
        upper.plot(
            [design.worst_frequency],
            [design.worst],
            "o",
            color=PURPLE,
            ms=4,
            label="worst case",
        )
        upper.set_ylim(0.0, _HIGHEST * design.worst)
        lower.set_ylim(0.0, min(_HIGHEST, 1.1 * float((table.worst / table.without).max())))
        upper.set_ylabel(label(m.measured[2], "", m.measured[1]))
        lower.set(xlabel="frequency / Hz", ylabel="over that without")
        lower.set_xlim(table.frequency.min(), table.frequency.max())
        upper.legend(frameon=False, title=f"shaded: the band, {m.band[0]:g} to {m.band[1]:g} Hz")
        write_prefixes(figure)
    return figure


def history(design: Design) -> Figure:
    """Draw the motion of the worst case: the machine, and the free mass between its walls."""
    table = design.history
    assert table is not None
    with style():
        figure, ((upper,), (lower,)) = panel_grid(2, height=3.6, height_ratios=(3, 2))
        alone = table[table.without.notna()]
        upper.plot(alone.time, alone.without, **_WITHOUT)
        upper.plot(table.time, table.with_damper, **_BUILT | {"lw": 0.9, "label": "with damper"})
        upper.set_ylabel("displacement / m")
        upper.set_title(f"worst case, at {design.worst_frequency:.4g} Hz", loc="left")
        upper.legend(frameon=False, loc="lower right", bbox_to_anchor=(1.0, 0.97), ncols=2)
        each = [name for name in table if name.startswith("relative")]
        for name, color in zip(each, cycle((RELATIVE, *COLOURS)), strict=False):
            lower.plot(table.time, table[name], color=color, lw=0.9)
        worst = design.studies["worst"]
        gap = worst["masses"][0]["gap"] if design.box else worst["parameters"]["gap"]
        for wall in (-0.5 * gap, 0.5 * gap):
            lower.axhline(wall, color="#777777", lw=0.6)
        lower.set(xlabel="time / s", ylabel=f"free mass{'es' * (len(each) > 1)} / m")
        lower.set_xlim(0.0, table.time.max())
        write_prefixes(figure)
    return figure
