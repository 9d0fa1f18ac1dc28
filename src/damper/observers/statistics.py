"""Statistics of a motion that does not repeat: means over the window with confidence limits."""

import math

import numpy as np

from damper.engine.compiled import compiled, plain
from damper.engine.model import (
    begin_samples,
    motion,
    motion_sample,
    read_segment,
    speeds_in_tail,
)
from damper.engine.quadrature import FEWEST, LONGEST_REACH, NODES, WEIGHTS, nodes_for
from damper.engine.segment import FLIGHT, IMPACT, TAIL
from damper.engine.trajectory import Trajectory
from damper.models.response import (
    drag_of,
    inertias_of,
    integrate_segment,
    is_of_box,
    longest_product,
    lost_at_start,
    own_loss,
    own_share,
    prepare_tables,
)
from damper.observers.common.base import Observer, Window, part_within, record_type, visible_in_tail
from damper.observers.common.limits import mean_within
from damper.observers.common.settings import BODIES, Setting
from damper.parameters.variables import ENERGY, SPEED, Variable

#: Sums over one batch: its time, integrals of squares (of x, v, the free mass's velocity u, and its
#: place in the box), work, losses, impacts that count, and the squares of their approach speeds.
_SUMS = record_type(
    *("time", "x2", "v2", "u2", "place2", "work", "loss", "impact_loss", "impacts", "approach2")
)
#: Variable -> long name, units, the sums that it is a quotient of, and comment.
MEANS: dict[str, tuple[str, str, str, str, str]] = {
    "mean_potential_energy": ("mean potential energy of the primary", ENERGY, "x2", "time", ""),
    "mean_kinetic_energy": ("mean kinetic energy of the primary", ENERGY, "v2", "time", ""),
    "mean_free_mass_energy": ("mean kinetic energy of the free mass", ENERGY, "u2", "time", ""),
    "mean_square_place": (
        *("mean square of the free mass's place in the box", "1", "place2", "time"),
        "(y - x) / d: 1/3 where it is anywhere between the walls alike",
    ),
    "mean_input": ("work of the force per cycle", ENERGY, "work", "time", ""),
    "mean_loss": (
        *("energy lost per cycle", ENERGY, "loss", "time"),
        "in dashpots, dry friction and impacts",
    ),
    "mean_impact_loss": ("energy lost in impacts per cycle", ENERGY, "impact_loss", "time", ""),
    "impact_rate": (
        *("impacts per cycle", "1", "impacts", "time"),
        "from the least approach speed that counts; infinite where that is 0 and a burst completes",
    ),
    "mean_approach_energy": (
        *("mean energy of approach of an impact", ENERGY, "approach2", "impacts"),
        "half the reduced mass times the approach speed squared, of the impacts that count",
    ),
}

#: Variables of the whole system, without a dimension of masses.
_OF_ALL = ("mean_potential_energy", "mean_kinetic_energy", "mean_input", "mean_loss")


class Statistics(Observer):
    """Means over the window, and how well they are known: for noise.

    The window is cut into equal batches. A mean is that of the whole window, as exact as those of
    `response`; its limits are those of Student's t for the means of the batches, of which fewer
    count where neighbours are alike: limits become wide where a batch does not last several times
    as long as the motion remembers. Energies are in units of F0^2/K, per cycle where they are
    powers. An impact counts from an approach speed on. Each of several free masses has its own
    energy, place and impacts; an energy of approach is that of this mass and the primary alone. On
    a structure the energies of the primary are those of the whole structure.

    Noise must last as long as the window. Everything stays missing where the run stopped early.
    """

    models = ("rigid", "grounded", "sliding", "structure")
    throughout = True
    bodies = BODIES
    batches = Setting(20, "Equal parts of the window that make the limits.", ge=8, le=10_000)
    confidence = Setting(0.95, "Of the limits.", gt=0, lt=1)
    above = Setting(0.0, "Approach speed from which an impact counts.", SPEED, ge=0)

    variables = tuple(
        variable
        for name, (meaning, units, _, _, comment) in MEANS.items()
        for variable in (
            Variable(name, meaning, units, comment=comment),
            Variable(f"{name}_error", f"half width of the limits of the {meaning}", units),
        )
    )

    shared = tuple(v.name for v in variables if v.name.removesuffix("_error") in _OF_ALL)

    def begin(self, run: int, trajectory: Trajectory, window: Window) -> None:
        """Start on a run."""
        super().begin(run, trajectory, window)
        self._tables = prepare_tables(self._model)
        self._body = trajectory.body or 0
        self._above = self.above / trajectory.units.speed
        self._sums = np.zeros(self.batches, _SUMS)

    def observe(self, log: np.ndarray) -> None:
        """Read the next piece of the log."""
        _add(self._model, self._tables, log, self._window, self._above, self._sums)

    def finish(self, finished: bool) -> None:
        """Write the run's results."""
        if not finished:
            return
        cycle, (mass, reduced) = self._model.cycle, plain(inertias_of)(self._model, self._body)
        # Factor of each quotient of sums.
        factors = {"x2": 0.5, "v2": 0.5, "u2": 0.5 * mass, "place2": 1.0}
        factors["approach2"] = 0.5 * reduced
        for name, (_, _, over, under, _) in MEANS.items():
            sums = self._sums[over], self._sums[under]
            found = mean_within(*sums, self.confidence, in_turn=True)
            for key, value in zip((name, f"{name}_error"), found, strict=True):
                self._put({key: factors.get(over, cycle) * value})


@compiled
def _add(model, tables, log, window, above, sums):
    """Add a piece of the log to the sums of the batches that it lies in."""
    length = window.length * model.cycle / len(sums)
    last = len(sums) - 1
    for index in range(len(log)):
        s = read_segment(model, log[index])
        start, low, high = part_within(s, model.cycle, window)
        if high < low:
            continue
        k = min(int((start + low) / length), last)
        if start >= 0.0:
            sums[k].loss += lost_at_start(model, s)
            if s.cause == IMPACT:
                _count(model, s, above, sums[k])
        while True:
            end = high if k == last else min((k + 1) * length - start, high)
            _integrate(model, tables, s, low, max(end, low), sums[k])
            if end >= high:
                break
            low = max(end, low)
            k += 1


@compiled
def _count(model, s, above, total):
    """Count the impact that begins a segment, and those of a tail after it."""
    total.impact_loss += own_loss(model, s)
    if s.speed >= above:
        total.impacts += 1.0
        total.approach2 += s.speed * s.speed
    if s.mode == TAIL:
        speed, ratio = speeds_in_tail(model, s)
        number = visible_in_tail(model, s, above)
        total.impacts += math.inf if above == 0.0 and ratio > 0.0 else number
        if number > 0:
            rest = 1.0 - ratio ** (2 * number)
            total.approach2 += speed * speed * rest / (1.0 - ratio * ratio)


@compiled
def _integrate(model, tables, s, low, high, total):
    """Add a part of a segment that lies in one batch."""
    part = integrate_segment(model, tables, s, low, high, math.inf)
    total.time += high - low
    total.x2 += part.square
    total.v2 += part.speed_square
    total.work += part.work
    total.impact_loss += own_share(model, s) * part.loss
    lost = part.loss + part.support + part.friction
    total.loss += lost + drag_of(model) * part.speed_square
    if s.mode != FLIGHT and is_of_box(model):
        # In a tail the free mass is next to the wall, and moves as it does on average.
        _, _, gap, _ = motion(model, s, low)
        place = 1.0 - gap / model.clearance if model.clearance > 0.0 else math.nan
        total.u2 += part.speed_square
        total.place2 += place * place * (high - low)
        return
    # The free mass's own; the force is that of the primary.
    begun, tau = begin_samples(model, s), low
    while tau < high:
        whole = longest_product(model, s, tau)
        step = min(whole, high - tau)
        nodes = nodes_for(LONGEST_REACH * (step / whole))
        for k in range(nodes):
            weight = step * float(WEIGHTS[nodes - FEWEST, k])
            at = tau + step * float(NODES[nodes - FEWEST, k])
            _, v, gap, gap_rate = motion_sample(model, s, begun, at)
            u = v - s.side * gap_rate
            place = 1.0 - gap / model.clearance
            total.u2 += weight * u * u
            total.place2 += weight * place * place
        tau = high if step < whole else tau + step
