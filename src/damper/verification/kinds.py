"""Kinds of figures and tables of the studies that check the engine, of all of them."""

from damper.study.kinds import STUDIES, Kinds
from damper.verification.base import Made

FIGURES = Kinds(Made, *(f"damper.verification.{study}.figures" for study in STUDIES))
TABLES = Kinds(Made, *(f"damper.verification.{study}.tables" for study in STUDIES))
