"""The page of a design: one HTML file, the same as Markdown, figures, CSV, and the studies."""

from __future__ import annotations

from collections.abc import Iterator
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import pandas as pd

from damper.figures import schematic
from damper.figures.common.layout import few_decades
from damper.figures.common.style import BLACK, COLUMN, PAGE, VERMILION, save, style
from damper.sizing.answer import Design, text_of
from damper.sizing.machine import Machine
from damper.study.yaml_file import dump_yaml

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_CSS = """body { font: 15px/1.45 sans-serif; max-width: 52em; margin: 2em auto; padding: 0 1em }
table { border-collapse: collapse; margin: 0.5em 0 } td, th { padding: 0.15em 0.9em 0.15em 0;
text-align: left; border-bottom: 1px solid #ddd } .warning { background: #fdeee6; padding: 0.5em
0.8em; border-left: 4px solid #D55E00; margin: 0.4em 0 } img { max-width: 100% }"""
_WITHOUT: dict[str, Any] = {"color": "#BBBBBB", "lw": 2.5, "label": "without damper"}
_BUILT: dict[str, Any] = {"color": BLACK, "lw": 1.2, "label": "with damper as built, worst start"}
_WORST: dict[str, Any] = {"color": VERMILION, "lw": 1.0, "ls": "--", "label": "all tolerances, too"}
#: Highest ratio to the motion without damper, and displacement over the worst case, that is shown.
_HIGHEST = 3.0


class _Block(NamedTuple):
    """A part of the page: its sort, and a text, a table or the stem of a figure."""

    sort: str
    content: Any
    words: str = ""


def write(design: Design, folder: Path) -> None:
    """Write page, figures, CSV files, the machine and the studies of a design into a folder."""
    (folder / "studies").mkdir(parents=True, exist_ok=True)
    machine = design.machine.model_dump(mode="json", exclude_unset=True)
    (folder / "machine.yaml").write_text(dump_yaml(machine), "utf-8")
    for name in design.studies:
        (folder / "studies" / f"{name}.yaml").write_text(design.to_yaml(name), "utf-8")
    numbers = [(n, getattr(design, n), design.units[n], words) for n, words, _ in design.lines]
    frame = pd.DataFrame(numbers, columns=["name", "value", "unit", "meaning"])
    frame.to_csv(folder / "numbers.csv", index=False)
    figures = {"sketch": sketch(design)}
    if design.response is not None:
        design.response.to_csv(folder / "response.csv", index=False)
        figures["response"] = response(design)
    with style():
        for name, figure in figures.items():
            save(figure, folder / f"{name}.svg")
            save(figure, folder / f"{name}.png")
    blocks = list(_blocks(design))
    (folder / "design.md").write_text("\n\n".join(map(_markdown, blocks)) + "\n", "utf-8")
    body = "\n".join(_html(block, folder) for block in blocks)
    title = escape(design.machine.title)
    page = f'<!doctype html>\n<html lang="en"><head><meta charset="utf-8"><title>{title}</title>'
    (folder / "design.html").write_text(f"{page}<style>{_CSS}</style></head>\n{body}</html>\n")


def _blocks(design: Design) -> Iterator[_Block]:
    m = design.machine
    yield _Block("title", f"{m.title}: its impact damper")
    for text in design.warnings:
        yield _Block("warning", text)
    yield _Block("figure", "sketch", f"The machine, {_drives(m)}, and its damper")
    rows = [(words, value) for _, words, value in design.lines]
    yield _Block("head", f"What it does to the {m.measured[2]}")
    yield _Block("table", pd.DataFrame(rows, columns=["", "value"]))
    if design.response is not None:
        words = (
            "Decay of the free motion"
            if m.is_free
            else "With and without the damper, in the band and beyond"
        )
        yield _Block("figure", "response", words)
    if design.tolerances is not None:
        yield _Block("head", "How wrong things may be")
        words = "One quantity off its value at a time, the others as built; from the starts alone."
        yield _Block("text", words)
        yield _Block("table", design.tolerances)
    if design.motions is not None:
        yield _Block("head", "Where other starts lead")
        yield _Block(
            "text",
            f"From random starts at {design.worst_frequency:.4g} Hz, where the worst case is; in "
            "brackets the 95 % limits of their part.",
        )
        yield _Block("table", design.motions)
    yield _Block("head", "What was assumed")
    yield _Block("list", design.assumed)
    if design.studies:
        files = ", ".join(f"studies/{name}.yaml" for name in design.studies)
        yield _Block(
            "text",
            f"Every number is made by {files}; the limits of the gap by following "
            "the periodic motion. The machine is in machine.yaml, numbers.csv has all digits.",
        )


def _markdown(block: _Block) -> str:
    sort, content, words = block
    if sort == "table":
        rows = [list(content.columns), ["---"] * len(content.columns), *content.values.tolist()]
        return "\n".join(f"| {' | '.join(map(str, row))} |" for row in rows)
    if sort == "list":
        return "\n".join(f"- {text}" for text in content)
    forms = {"title": "# {}", "head": "## {}", "warning": "> **{}**", "text": "{}"}
    return f"![{words}]({content}.png)" if sort == "figure" else forms[sort].format(content)


def _html(block: _Block, folder: Path) -> str:
    sort, content, words = block
    if sort == "table":
        return str(content.to_html(index=False, border=0))
    if sort == "list":
        return f"<ul>{''.join(f'<li>{escape(text)}</li>' for text in content)}</ul>"
    if sort == "figure":
        drawn = (folder / f"{content}.svg").read_text("utf-8")
        return f"<figure>{drawn[drawn.index('<svg') :]}<figcaption>{words}</figcaption></figure>"
    tags = {"title": "h1", "head": "h2", "text": "p"}
    if sort == "warning":
        return f'<p class="warning"><b>{escape(content)}</b></p>'
    return f"<{tags[sort]}>{escape(content)}</{tags[sort]}>"


def _drives(m: Machine) -> str:
    """What makes the machine vibrate, in words."""
    kind, amplitude = m.force
    if kind == "none":
        return f"let go at {text_of(m.initial_displacement, 'm')}"
    low, high = m.band or (0.0, 0.0)
    band = f" at {low:g} to {high:g} Hz"
    if kind == "base":
        return f"on a base that moves by {text_of(amplitude, 'm')}{band}"
    what = "an unbalance" if kind == "unbalance" else "a force"
    return f"under {what} of {amplitude:g} {'kg m' if kind == 'unbalance' else 'N'}{band}"


def sketch(design: Design) -> Figure:
    """Draw the machine and its damper with their dimensions."""
    from matplotlib.figure import Figure

    m, given = design.machine, design.machine.primary
    kind, amplitude = m.force
    drives = f"{amplitude:g} N" if kind == "harmonic" else "$F$" if kind == "unbalance" else ""
    with style():
        figure = Figure(layout="constrained")
        ax = figure.subplots()
        ax.set_aspect("equal")
        ax.set_axis_off()
        schematic.box(
            ax,
            text_of(m.mass, "kg"),
            "",
            f"{1e-3 * given['stiffness']:.4g} kN/m",
            f"{given['damping']:.4g} N s/m",
            drives,
            "$x$",
            "$y$",
        )
        ax.text(3.75, 2.8, text_of(design.free_mass, "kg"), va="center", fontsize=9.0)
        for first, last in ((3.6, 5.2), (6.2, 7.8)):
            schematic.dimension(ax, first, last, 1.6, text_of(0.5 * design.gap, "m"))
        figure.set_size_inches(1.3 * COLUMN, 0.65 * COLUMN)
    return figure


def response(design: Design) -> Figure:
    """Draw the response with and without the damper, or the decay of free motion."""
    from matplotlib.figure import Figure

    table, m = design.response, design.machine
    assert table is not None
    with style():
        if m.is_free:
            figure = Figure(figsize=(PAGE, 2.6), layout="constrained")
            ax = figure.subplots()
            for name, look in (("without", _WITHOUT), ("as_built", _BUILT)):
                ax.plot(table.time, 1e3 * table[name], **look)
            ax.axhline(1e3 * m.decay_to * table.as_built.iloc[0], color=BLACK, lw=0.5, ls=":")
            ax.set(xlabel="time / s", ylabel="peaks of the displacement / mm", yscale="log")
            few_decades(ax)
            ax.legend(frameon=False)
            return figure
        assert m.band is not None
        figure = Figure(figsize=(PAGE, 4.2), layout="constrained")
        upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(2, 1))
        for ax in (upper, lower):
            ax.axvspan(*m.band, color="#EAF1F6", lw=0.0)
        for name, look in (("without", _WITHOUT), ("worst", _WORST), ("as_built", _BUILT)):
            upper.plot(table.frequency, 1e3 * table[name], **look)
            lower.plot(table.frequency, table[name] / table.without, **look)
        if m.limit is not None:
            upper.axhline(1e3 * m.limit, color=BLACK, lw=0.5, ls=":")
        upper.plot([design.worst_frequency], [1e3 * design.worst], "o", color=VERMILION, ms=4)
        upper.set_ylim(0.0, 1e3 * _HIGHEST * design.worst)
        lower.set_ylim(0.0, min(_HIGHEST, 1.1 * float((table.worst / table.without).max())))
        upper.set_ylabel(f"{m.measured[2]} / mm")
        lower.set(xlabel="frequency / Hz", ylabel="over that without")
        lower.set_xlim(table.frequency.min(), table.frequency.max())
        upper.legend(frameon=False, title=f"shaded: the band, {m.band[0]:g} to {m.band[1]:g} Hz")
    return figure
