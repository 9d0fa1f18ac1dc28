"""Figures that notebooks show."""

from functools import partial
from io import BytesIO

from damper.parameters.lazy import Figure


def shown_in_notebooks(figure: Figure) -> Figure:
    """Let notebooks show a figure: by themselves they show those of pyplot only."""
    figure._repr_png_ = partial(_png, figure)  # type: ignore[attr-defined]
    return figure


def _png(figure: Figure) -> bytes:
    from damper.figures.common.style import style

    picture = BytesIO()
    with style():
        figure.savefig(picture, format="png", dpi=120)
    return picture.getvalue()
