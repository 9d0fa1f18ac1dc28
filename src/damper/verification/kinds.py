"""Kinds of studies beside the cubes of parameters: those that check the engine itself.

A study file with ``kind: <name>`` is one of these; without it, it is a `damper.study.model.Study`.
"""

from damper.verification.base import Made, Verification
from damper.verification.comparison.settings import Comparison
from damper.verification.cost.settings import Cost
from damper.verification.stress.settings import Stress

__all__ = ["KINDS", "Made", "Verification"]

#: What ``kind`` of a study file may be -> its class.
KINDS: dict[str, type[Verification]] = {"comparison": Comparison, "stress": Stress, "cost": Cost}
