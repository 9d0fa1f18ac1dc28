"""Schematics: every symbol is there, legible and in the page; no cube is needed."""

from pathlib import Path
from typing import get_args

import pytest
from figures.drawing import drawn, laid_out, svg_of
from matplotlib.figure import Figure

from damper.figures.schematic import DRAWINGS, Schematic

SYMBOLS = {
    "impact_damper": ["$M$", "$m$", "$K_1$", "$C_1$", "$F(t)$", "$X_1$", "$X_2$", "$D$", "$D$"],
    "two_degrees_of_freedom": [
        *("$M$", "$m(t)$", "$K_1$", "$C_1$", "$K_2$", "$C_2$"),
        *("$F(t)$", "$X_1$", "$X_2$", "$D$", "$D$"),
    ],
    "collision_system": ["$M_1$", "$M_2$", "$K$", "$C$", "$F$", "$X$", "$Y$"],
    "damper": ["$M$", "$m$", "$K$", "$C$", "$F(t)$", "$x$", "$y$", "$D$", "$D$"],
}


def texts(figure: Figure) -> list[str]:
    return [text.get_text() for text in figure.axes[0].texts if text.get_text()]


def test_every_drawing_of_the_settings_is_there() -> None:
    names = get_args(Schematic.model_fields["drawing"].annotation)
    assert set(names) == set(DRAWINGS) == set(SYMBOLS)


@pytest.mark.parametrize("drawing", SYMBOLS)
def test_every_symbol_has_its_place(drawing: str) -> None:
    caption = "A heading that is so long that it needs two lines"
    figure = laid_out(drawn("schematic", drawing=drawing, caption=caption))
    assert sorted(texts(figure)) == sorted(SYMBOLS[drawing])
    renderer = figure.canvas.get_renderer()
    boxes = [t.get_window_extent(renderer) for t in figure.axes[0].texts if t.get_text()]
    assert figure.get_suptitle().replace("\n", " ") == caption
    boxes.append(figure._suptitle.get_window_extent(renderer))
    for k, box in enumerate(boxes):
        assert figure.bbox.x0 <= box.x0 < box.x1 <= figure.bbox.x1
        assert figure.bbox.y0 <= box.y0 < box.y1 <= figure.bbox.y1
        assert not any(box.overlaps(other) for other in boxes[k + 1 :])
    # Nothing that is drawn is cut off by the limits of the axes.
    inside = figure.axes[0].get_window_extent(renderer)
    for line in figure.axes[0].lines:
        box = line.get_window_extent(renderer)
        assert inside.x0 <= box.x0 <= box.x1 <= inside.x1
        assert inside.y0 <= box.y0 <= box.y1 <= inside.y1


def test_files(tmp_path: Path) -> None:
    assert "<image" not in svg_of(drawn("schematic", drawing="damper"), tmp_path)
