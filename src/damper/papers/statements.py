"""The statements of both papers: the list that verdicts and calibration are made from."""

from damper.papers.base import Score, Statement
from damper.papers.paper_a import PAPER_A
from damper.papers.paper_b import PAPER_B

STATEMENTS: tuple[Statement, ...] = (*PAPER_A, *PAPER_B)
#: Name -> score, of all statements that the calibration can score.
SCORES: dict[str, Score] = {
    name: score for statement in STATEMENTS for name, score in statement.scores.items()
}
