"""The page of what was identified, its figure, its CSV files and its studies."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pandas as pd

from damper.figures.common.panels import panel_grid
from damper.figures.common.style import BLACK, BLUE, ORANGE, save, style
from damper.identification.recordings import KINDS
from damper.parameters.lazy import Figure
from damper.sizing.page import html_of, prepare
from damper.sizing.words import text_of
from damper.study.yaml_file import dump_yaml
from damper.tables import Table

if TYPE_CHECKING:
    from damper.identification.answer import Identification

_TABLES = ("values", "correlation", "profile", "motion", "impacts")
#: Files of a page; its studies are in a folder of their own.
FILES = (
    *("identification.html", "identification.md", "compared.svg", "compared.png"),
    *(f"{name}.csv" for name in _TABLES),
)


def write(found: Identification, folder: Path) -> None:
    """Write page, figure, CSV files and studies into a folder."""
    for path in prepare(folder, [], FILES):
        path.unlink()
    for name in _TABLES[1:]:
        frame = getattr(found, name)
        frame.to_csv(folder / f"{name}.csv", index=name == "correlation")
    for name, study in found.studies.items():
        (folder / "studies" / f"{name}.yaml").write_text(dump_yaml(study), encoding="utf-8")
    with style():
        figure = compared(found)
        save(figure, folder / "compared.svg")
        save(figure, folder / "compared.png")
    table = Table(found.title, found.values, list(_body(found)))
    table.save(folder / "values.csv", folder / "identification.md")
    html = html_of(table, folder)
    (folder / "identification.html").write_text(html, encoding="utf-8", newline="\n")


def _body(found: Identification) -> Iterator[str | pd.DataFrame]:
    """The page below its title, as Markdown and tables."""
    yield from (f"> **{text}**" for text in found.warnings)
    yield pd.DataFrame(found.lines, columns=["quantity", "value", "95 % interval"])
    yield "![Measured and computed, with the computed impacts, and the residual](compared.png)"
    yield "## Correlation"
    frame = found.correlation.map(lambda value: f"{value:.3f}")
    yield frame.rename_axis("quantity").reset_index()
    yield "## Profile"
    yield "Least sum of squares where one quantity is off its value, over that of the fit."
    shown = found.profile.assign(
        value=[
            text_of(value, unit, 6)
            for value, unit in found.profile[["value", "unit"]].itertuples(index=False)
        ],
        sum_of_squares=[f"{value:.6g}" for value in found.profile.sum_of_squares],
    )
    yield shown.drop(columns="unit")
    yield "## What was assumed"
    noise = [f"The residual of {label} has the rms {rms}." for label, rms in found.rms_text.items()]
    yield "\n".join(f"- {text}" for text in (*noise, *found.assumed))
    names = ", ".join(f"studies/{name}.yaml" for name in found.studies)
    yield f"The result runs as {names}. All numbers are in the CSV files."


def compared(found: Identification) -> Figure:
    """Draw each record, what is computed, its impacts, and the residual."""
    figure, axes = panel_grid(
        2 * len(found.records),
        height=3.4 * len(found.records),
        height_ratios=[2, 1] * len(found.records),
        sharex=False,
    )
    for record, upper, lower in zip(found.records, axes[::2, 0], axes[1::2, 0], strict=True):
        motion = found.motion[found.motion.record == record.label]
        dots = "" if record.is_sampled else "o"
        upper.plot(motion.time, motion.measured, color=BLUE, lw=1.6, marker=dots, label="measured")
        upper.plot(motion.time, motion.computed, color=ORANGE, lw=0.8, label="computed")
        lower.plot(motion.time, motion.residual, color=BLACK, lw=0.7, marker=dots, ms=3)
        impacts = found.impacts[found.impacts.record == record.label]
        inside = impacts.time[impacts.time <= motion.time.max()]
        upper.plot(inside, [0.03] * len(inside), "|", color=BLACK, ms=6, label="impacts",
                   transform=upper.get_xaxis_transform())  # fmt: skip
        si = (
            isinstance(found.parameters.units.length, float)
            and "stiffness" in found.parameters.given
        )
        unit = f" / {KINDS[record.kind][0]}" if si else ""
        upper.set_ylabel(f"{record.kind}{unit}")
        lower.set(xlabel="time / s" if si else "time", ylabel="residual")
        upper.legend(frameon=False, ncols=3, title=record.label)
    return figure
