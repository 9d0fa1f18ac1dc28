"""Warnings that name the line of the user."""

import sys
import warnings


def warn(text: str, category: type[Warning] = UserWarning) -> None:
    """Warn, and name the line outside of this package that led here."""
    frame, level = sys._getframe(), 1
    while frame.f_back and frame.f_globals.get("__name__", "").partition(".")[0] == "damper":
        frame, level = frame.f_back, level + 1
    warnings.warn(text, category, stacklevel=level)
