"""What is made of a cube: figures and tables.

To add a figure or a table, write its class of settings in a module here and enter it in its
registry.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from damper.papers.calibration.settings import Profiles, Ranking
from damper.study.fields import STEM, STEM_WORDS, Choice, Faults, as_mapping, fault
from damper.study.products.base import SECTION_VARIABLES, VARIABLES, Offer, Product
from damper.study.products.convergence import Convergence, ConvergenceTable
from damper.study.products.figures import (
    Accumulation,
    Bifurcation,
    Curves,
    FreeMass,
    Histories,
    Map,
    PhasePortrait,
    Schematic,
    SlowManifold,
    Trajectory,
)
from damper.study.products.tables import (
    Agreement,
    Intervals,
    Performance,
    SmallMassLimit,
    TwoImpacts,
)
from damper.study.yaml_file import show, words

__all__ = [
    "FIGURES",
    "SECTION_VARIABLES",
    "TABLES",
    "VARIABLES",
    "Offer",
    "Product",
    "Schematic",
    "Trajectory",
    "product",
]

FIGURES: dict[str, type[Product]] = {
    "bifurcation": Bifurcation,
    "map": Map,
    "curves": Curves,
    "trajectory": Trajectory,
    "profiles": Profiles,
    "accumulation": Accumulation,
    "histories": Histories,
    "phase_portrait": PhasePortrait,
    "free_mass": FreeMass,
    "schematic": Schematic,
    "slow_manifold": SlowManifold,
    "convergence": Convergence,
}
TABLES: dict[str, type[Product]] = {
    "intervals": Intervals,
    "performance": Performance,
    "ranking": Ranking,
    "accumulation": Agreement,
    "small_mass_limit": SmallMassLimit,
    "two_impacts": TwoImpacts,
    "convergence": ConvergenceTable,
}


def product(registry: Mapping[str, type[Product]]) -> Callable[[str, Any], Product]:
    """Return what checks the settings of a figure or a table."""

    def entry(stem: str, data: Any) -> Product:
        faults = Faults()
        if not STEM.fullmatch(stem):
            faults.add((), f"{show(stem)} cannot be the name of a file", STEM_WORDS)
        with faults.of():
            made = _kind_of(data, registry).entry(stem, data)
        faults.settle()
        return made

    return entry


def _kind_of(data: Any, registry: Mapping[str, type[Product]]) -> type[Product]:
    data, faults = as_mapping(data, "kind and its settings"), Faults()
    with faults.of("kind"):
        if "kind" not in data:
            raise fault("'kind' is missing", words(registry))
        kind = Choice(*registry).check(data["kind"], None)
    faults.settle()
    return registry[kind]
