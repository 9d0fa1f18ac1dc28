"""Motion: after how many cycles it repeats, and what the free mass does in that time."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from damper.engine.compiled import compiled
from damper.engine.model import motion, read_segment
from damper.engine.segment import IMPACT, STICK, Segment
from damper.engine.trajectory import Trajectory
from damper.models.flights import has_mirror
from damper.observers.common.base import Observer, Window, record_type, since
from damper.observers.common.sections import write_sample
from damper.observers.common.settings import BODIES, Setting
from damper.parameters.models import ONE_BY_ONE
from damper.parameters.names import counted
from damper.parameters.variables import Variable

#: Counts on each wall: impacts outside complete chatter, complete chatter sequences, and runs of
#: consecutive impacts.
COUNTS = record_type("left", "right", "left_complete", "right_complete", "open", "wall")


class ObservedMotion(Observer):
    """After how many cycles the motion repeats, and what happens in that time.

    The window's end is compared with itself in steps of half a cycle: in a motion of n periods the
    last n cycles repeat the n cycles before them. Every other motion is quasi-periodic, chaotic
    or not yet settled; `lyapunov` distinguishes these. On a structure the primary is the box of
    the free mass.
    """

    models = ONE_BY_ONE
    bodies = BODIES
    longest = Setting(8, "Longest period to look for.", "cycles", ge=1, le=1000)
    tolerance = Setting(
        1e-6, "Largest difference, over the largest displacement or velocity.", gt=0, le=0.1
    )
    variables = (
        Variable(
            "motion_period",
            "cycles after which the motion repeats",
            "1",
            dtype="i4",
            comment="0: it does not within the longest period looked for, or half of the window",
        ),
        Variable(
            "motion_side",
            "which of a mirror pair the motion is",
            "1",
            comment="0 symmetric; -1 left, 1 right: the wall with more impacts or, with as many on "
            "each, that which the free mass is nearer to or, where it sticks on both alike, the "
            "primary; missing where it does not repeat or has no impacts, and under gravity, "
            "between walls that differ or under a force that is not its own opposite half a cycle "
            "later: there no motion has a mirror image",
        ),
        *(
            Variable(
                f"motion_{what}_{wall}",
                f"{text} on the {wall} wall until the motion repeats",
                "1",
                dtype="i4",
                comment="missing where it does not repeat",
            )
            for what, text in (
                ("impacts", "impacts outside complete chatter"),
                ("completions", "chatter sequences that complete"),
            )
            for wall in ("left", "right")
        ),
    )

    def begin(self, run: int, trajectory: Trajectory, window: Window) -> None:
        """Start on a run."""
        super().begin(run, trajectory, window)
        # Twice per period, a row with the state and the counts so far; of two motions in turn.
        self._samples = np.empty((4 * self.longest + 1, 8))
        self._taken = 0
        self._counts = np.zeros(1, COUNTS)

    def observe(self, log: np.ndarray) -> None:
        """Read the next piece of the log."""
        self._taken = _sample(
            self._model, log, self._window, self._samples, self._counts, self._taken
        )

    def finish(self, finished: bool) -> None:
        """Write what the motion is; it stays missing where the run stopped early."""
        if not finished:
            return
        rows = np.roll(self._samples, -(self._taken % len(self._samples)), axis=0)
        rows = rows[-min(self._taken, len(rows)) :]
        states, counts = rows[:, :4], rows[:, 4:]
        near = self.tolerance * abs(states).max()
        odd = has_mirror(self._model)
        self._put({"motion_period": 0})
        for period in range(1, (len(rows) - 1) // 4 + 1):
            later, earlier = states[-2 * period - 1 :], states[-4 * period - 1 : -2 * period]
            if abs(later - earlier).max() <= near:
                half = states[-3 * period - 1 : -period]
                symmetric = period % 2 == 1 and abs(later + half[: len(later)]).max() <= near
                happened = counts[-1] - counts[-2 * period - 1]
                self._put({"motion_period": period})
                # Where a free mass that hits no wall rests in its box says nothing of the motion.
                if odd and happened.any():
                    side = 0 if symmetric else _side(later[1:], happened, near)
                    self._put({"motion_side": side})
                names = [variable.name for variable in self.variables[2:]]
                self._put(dict(zip(names, happened.astype(int), strict=True)))
                return


def _side(states: np.ndarray, counts: np.ndarray, near: float) -> int:
    """Wall that a motion without symmetry is on; its mirror image is on the other one."""
    left, right, left_complete, right_complete = counts
    # A free mass that sticks on both walls may be as near to each: then the primary is not.
    sums = np.column_stack([states[:, 2] - states[:, 0], states]).sum(axis=0)
    differences = (right - left, right_complete - left_complete, *sums[abs(sums) > near])
    return int(np.sign(next(filter(None, differences), 0.0)))


def in_words(found: Mapping[str, int]) -> str:
    """Say what motion it is, by the observer's variables.

    Examples
    --------
    >>> in_words({"motion_period": 1, "motion_side": 0, "motion_impacts_left": 3,
    ...           "motion_impacts_right": 3, "motion_completions_left": 0,
    ...           "motion_completions_right": 0})
    'period 1, 3 impacts on each wall, symmetric'
    """
    if not found["motion_period"]:
        return "no period found"
    counts = {
        noun: (found[f"motion_{what}_left"], found[f"motion_{what}_right"])
        for what, noun in (("impacts", "impact"), ("completions", "complete chatter sequence"))
    }
    counts = {noun: sides for noun, sides in counts.items() if any(sides)}
    words = [f"period {found['motion_period']:g}"]
    if not counts:
        return ", ".join([*words, "no impacts"])
    if any(left != right for left, right in counts.values()):
        words += [f"{noun}s {a:g} left, {b:g} right" for noun, (a, b) in counts.items()]
        return ", ".join(words)
    each = (counted(int(n), noun) for noun, (n, _) in counts.items())
    words.append(f"{' and '.join(each)} on each wall")
    sides = {0: "symmetric", -1: "more to the left", 1: "more to the right"}
    if found["motion_side"] in sides:
        words.append(sides[found["motion_side"]])
    return ", ".join(words)


@compiled
def _sample(model, log, window, samples, counts, taken):
    count = counts[0]
    for index in range(len(log)):
        s = read_segment(model, log[index])
        if since(s, model.cycle, window.periods, window.time) >= 0.0:
            count_event(s, count)
        while taken <= 2.0 * window.length:
            half = 0.5 * model.cycle * (taken % 2)
            tau = -since(s, model.cycle, window.periods + taken // 2, window.time + half)
            if tau > s.duration:
                break
            row = samples[taken % len(samples)]
            write_sample(row[:4], model.clearance, s.side, motion(model, s, max(tau, 0.0)))
            row[4] = count.left
            row[5] = count.right
            row[6] = count.left_complete
            row[7] = count.right_complete
            taken += 1
    return taken


@compiled
def count_event(s: Segment, count: Any) -> None:
    """Count the event that begins a segment in one of `COUNTS`."""
    if s.cause == IMPACT:
        count.open = count.open + 1.0 if s.side == count.wall else 1.0
        count.wall = s.side
        count.left += 1.0 if s.side < 0.0 else 0.0
        count.right += 1.0 if s.side > 0.0 else 0.0
    elif s.cause == STICK:
        # The impacts before are those of a sequence that completes.
        if s.side < 0.0:
            count.left -= count.open
            count.left_complete += 1.0
        else:
            count.right -= count.open
            count.right_complete += 1.0
        count.open = count.wall = 0.0
