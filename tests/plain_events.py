"""What observers of impacts and bursts must write, by plain loops over the rows of `damper.events`.

The rows start with the run, so the loops know for certain which burst an impact belongs to and
when it began. They share no code with the observers.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
import pytest
from hypothesis import strategies as st

from damper import Parameters, State, events
from damper.sweep.runs import run_points

MANY = 10_000  # impacts of a closed tail that are looked at one by one
Threshold = float | Mapping[str, float]


@dataclass
class Burst:
    """A run of impacts on one wall; times are absolute."""

    wall: int
    onset: float
    speeds: list[float] = field(default_factory=list)
    times: list[float] = field(default_factory=list)
    ended: bool = False
    complete: bool = False
    stick: float = math.nan
    x: float = math.nan
    release: float = math.nan

    @property
    def end(self) -> float:
        return self.stick if self.complete else self.times[-1]

    def tail(self, restitution: float) -> list[float]:
        """Approach speeds of the impacts between the last row and sticking."""
        if not self.complete:
            return []
        speeds, speed = [], restitution * self.speeds[-1]
        while speed > 1e-300 and len(speeds) < MANY:
            speeds.append(speed)
            speed *= restitution
        return speeds

    def limit(self, threshold: Threshold) -> float:
        """Smallest approach speed that can be seen."""
        if isinstance(threshold, Mapping):
            return threshold["speed"]
        return threshold * self.speeds[0]

    def visible(self, restitution: float, threshold: Threshold = 0.03) -> int:
        """Impacts of the burst that can be seen, the tail's included."""
        limit = self.limit(threshold)
        return sum(s >= limit for s in [*self.speeds, *self.tail(restitution)])


@dataclass(frozen=True)
class Scene:
    """A run and the part of it that is recorded."""

    parameters: Mapping[str, float]
    transient: int
    periods: int
    state: State | None = None
    accuracy: float = 1e-12

    @property
    def cycle(self) -> float:
        return 2.0 * math.pi / self.parameters["frequency_ratio"]

    @property
    def start(self) -> float:
        return (self.state.time if self.state else 0.0) + self.transient * self.cycle

    @property
    def end(self) -> float:
        return self.start + self.periods * self.cycle

    def restitution(self, wall: int) -> float:
        left = self.parameters.get("restitution_left", math.inf)
        return left if wall < 0 and left < math.inf else self.parameters["restitution"]

    @cached_property
    def rows(self) -> np.ndarray:
        """All events since the start of the run."""
        p = Parameters(**self.parameters)
        return events(p, self.state, until=self.end, accuracy=self.accuracy)

    @cached_property
    def all_bursts(self) -> list[Burst]:
        """Every burst since the start of the run."""
        return list_bursts(self.rows)

    @property
    def begun(self) -> list[Burst]:
        """Bursts that begin in the window."""
        return [burst for burst in self.all_bursts if burst.onset >= self.start]

    @property
    def ended(self) -> list[Burst]:
        """Bursts that begin and end in the window."""
        return [burst for burst in self.begun if burst.ended]

    def run(self) -> dict[str, Any]:
        """Arguments of `run_points` besides parameters and observers."""
        return {
            "transient": self.transient,
            "periods": self.periods,
            "state": self.state,
            "accuracy": self.accuracy,
        }

    def observed(self, observer: str, **settings: Any) -> dict[str, np.ndarray]:
        """Results of one observer."""
        return self.observed_by({observer: settings})

    def observed_by(self, asked: Mapping[str, Any]) -> dict[str, np.ndarray]:
        """Results of several observers in one run."""
        arrays, _ = run_points([self.parameters], asked, **self.run())
        return {name: array[0] for name, array in arrays.items()}


def list_bursts(rows: np.ndarray) -> list[Burst]:
    """Every burst of a run from its start."""
    found: list[Burst] = []
    for row in rows:
        now = found[-1] if found and not found[-1].ended else None
        time, side = float(row["time"]), int(row["side"])
        if row["kind"] == 0:
            if now is None or now.wall != side:
                if now is not None:
                    now.ended = True
                now = Burst(side, time)
                found.append(now)
            now.speeds.append(float(row["approach_speed"]))
            now.times.append(time)
        elif row["kind"] == 1 and now is not None:
            now.ended = now.complete = True
            now.stick, now.x = time, float(row["x"])
        elif row["kind"] == 2 and found and found[-1].complete and math.isnan(found[-1].release):
            found[-1].release = time
    return found


def random_scenes(**more: st.SearchStrategy) -> st.SearchStrategy[Scene]:
    """Scenes of all kinds of motion."""
    values = {
        "mass_ratio": st.sampled_from([0.001, 0.1, 0.5, 2.0]),
        "damping_ratio": st.sampled_from([0.0, 0.02, 0.3, 1.0]),
        "frequency_ratio": st.sampled_from([0.05, 0.2, 0.7, 1.3, 3.0]),
        "clearance": st.sampled_from([0.0, 0.02, 0.1, 0.4, 1.0]),
        "restitution": st.floats(0, 1),
        "restitution_left": st.just(math.inf) | st.floats(0, 1),
        "phase": st.sampled_from([0.0, 1.0, math.pi / 2]),
    }
    return st.builds(
        Scene, st.fixed_dictionaries(values | more), st.integers(0, 6), st.integers(1, 8)
    )


# --- what each observer writes


def bursts(
    scene: Scene,
    threshold: Threshold = 0.03,
    compare_thresholds: Sequence[float] = (),
    records: int = 0,
) -> dict[str, Any]:
    begun, ended = scene.begun, scene.ended
    counts = [_counts(scene, each) for each in (threshold, *compare_thresholds)]
    found = {
        "visible_impacts": counts[0][0],
        "chatter": counts[0][1],
        "bursts_per_period": len(begun) / scene.periods,
        "complete_fraction": sum(b.complete for b in ended) / len(ended) if ended else math.nan,
        "sticking_fraction": _sticking_time(scene) / (scene.end - scene.start),
    }
    if compare_thresholds:
        found["visible_impacts_by_threshold"] = [count for count, _ in counts[1:]]
        found["chatter_by_threshold"] = [chatter for _, chatter in counts[1:]]
    if records:
        listed = {
            "onset": [b.onset - scene.start for b in ended],
            "wall": [b.wall for b in ended],
            "first_speed": [b.speeds[0] for b in ended],
            "visible_impacts": [b.visible(scene.restitution(b.wall), threshold) for b in ended],
            "complete": [b.complete for b in ended],
            "accumulation_time": [b.stick - scene.start for b in ended],
            "accumulation_displacement": [b.x for b in ended],
            "duration": [b.end - b.onset for b in ended],
            "sticking_time": [b.release - b.stick for b in ended],
        }
        found |= {f"burst_{name}": _padded(values, records) for name, values in listed.items()}
    return found


def impacts(scene: Scene, threshold: Threshold = 0.03, speeds: int = 0) -> dict[str, Any]:
    count, resolved, largest = 0, [], math.nan
    for burst in scene.all_bursts:
        limit = burst.limit(threshold)
        within = [s for s, t in zip(burst.speeds, burst.times, strict=True) if t >= scene.start]
        seen = [s for s in within if s >= limit]
        resolved += seen
        count += len(seen)
        if burst.times[-1] >= scene.start:
            count += sum(s >= limit for s in burst.tail(scene.restitution(burst.wall)))
        largest = np.nanmax([largest, *within]) if within else largest
    found = {
        "impacts_per_period": count / scene.periods,
        "mean_approach_speed": float(np.mean(resolved)) if resolved else math.nan,
        "max_approach_speed": largest,
    }
    return found | ({"approach_speed": _padded(resolved, speeds)} if speeds else {})


def burst_at(scene: Scene, time: float = 0.0, threshold: Threshold = 0.03) -> dict[str, Any]:
    chatter = [b for b in scene.ended if b.visible(scene.restitution(b.wall), threshold) >= 5]
    names = ("onset", "duration", "sticking_time", "visible_impacts", "complete")
    values: Sequence[float] = (math.nan, math.nan, math.nan, -1, -1)
    if chatter:
        b = min(chatter, key=lambda b: abs(b.onset - scene.start - time))
        visible = b.visible(scene.restitution(b.wall), threshold)
        times = b.onset - scene.start, b.end - b.onset, b.release - b.stick
        values = *times, visible, int(b.complete)
    return {f"burst_at_{name}": value for name, value in zip(names, values, strict=True)}


def chatter_bursts(
    scene: Scene, since: Sequence[float] = (0.0,), threshold: Threshold = 0.03
) -> dict[str, Any]:
    found: dict[str, list[float]] = {}
    for part in since:
        begun = [b for b in scene.ended if b.onset >= scene.start + part * scene.cycle]
        chatter = [b for b in begun if b.visible(scene.restitution(b.wall), threshold) >= 5]
        complete = [b for b in chatter if b.complete]
        values = {
            "chatter_bursts": len(chatter),
            "chatter_complete": len(complete),
            "sticking_bursts": sum(b.complete for b in begun),
            "chatter_duration": (
                float(np.mean([b.end - b.onset for b in complete])) if complete else math.nan
            ),
            "chatter_onset": complete[0].onset - scene.start if complete else math.nan,
        }
        for name, value in values.items():
            found.setdefault(name, []).append(value)
    return found


def impact_section(
    scene: Scene, wall: str = "right", samples: int = 100, free_mass: bool = False
) -> dict[str, Any]:
    side = {"left": -1, "right": 1}[wall]
    rows = scene.rows
    rows = rows[(rows["time"] >= scene.start) & (rows["kind"] == 0) & (rows["side"] == side)]
    found = {"displacement": rows["x"], "velocity": rows["v"]}
    if free_mass:
        # It is at the wall and leaves it with the restituted speed.
        found["free_displacement"] = rows["x"] + side * scene.parameters["clearance"]
        found["free_velocity"] = rows["v"] - side * scene.restitution(side) * rows["approach_speed"]
    return {name: _padded(values, samples) for name, values in found.items()}


#: Observer -> what it must write in a scene, by its settings.
EXPECTED: dict[str, Callable[..., dict[str, Any]]] = {
    each.__name__: each for each in (bursts, impacts, burst_at, chatter_bursts, impact_section)
}


#: What names of variables that follow from times have in them.
_OF_TIMES = ("onset", "duration", "time", "sticking_fraction")


def assert_observed(scene: Scene, asked: Mapping[str, Mapping[str, Any]]) -> dict[str, np.ndarray]:
    """Compare every variable of the observers asked for with the plain loops; return them."""
    found = scene.observed_by(asked)
    expected = {"status": 0}
    for name, settings in asked.items():
        expected |= EXPECTED[name](scene, **settings)
    if "burst_onset" in found:
        whole, rest = found["burst_onset_cycle"], found["burst_onset_time_in_cycle"]
        expected["burst_onset_cycle"] = (found["burst_onset"] - rest) / scene.cycle
        expected["burst_onset_time_in_cycle"] = found["burst_onset"] - whole * scene.cycle
        listed = np.isfinite(rest)
        assert ((rest >= 0.0) & (rest < scene.cycle))[listed].all()
        assert (whole % 1.0 == 0.0)[listed].all()
    assert set(found) == set(expected)
    for name, value in expected.items():
        # Times of the rows are sums, which blur with their size.
        blur = 1e-9 if any(word in name for word in _OF_TIMES) else 1e-14
        assert found[name] == pytest.approx(value, rel=1e-12, abs=blur, nan_ok=True), name
    return found


def _counts(scene: Scene, threshold: Threshold) -> tuple[int, int]:
    """Most visible impacts in a burst, and the run's kind of chatter."""
    seen = [(b.visible(scene.restitution(b.wall), threshold), b.complete) for b in scene.begun]
    chattering = [complete for count, complete in seen if count >= 5]
    kind = 2 if any(chattering) else int(bool(chattering))
    return max((count for count, _ in seen), default=0), kind


def _sticking_time(scene: Scene) -> float:
    """Time in the window between a stick row and the release after it."""
    if scene.parameters["clearance"] == 0.0:
        return scene.end - scene.start
    total, since = 0.0, None
    for row in scene.rows:
        if row["kind"] == 1:
            since = row["time"]
        elif row["kind"] == 2:
            total += max(0.0, row["time"] - max(since, scene.start))
            since = None
    if since is not None:
        total += scene.end - max(since, scene.start)
    return total


def _padded(values: Sequence[float], size: int) -> np.ndarray:
    """Values in an array of this size, with NaN in unused places."""
    found = np.full(size, math.nan)
    found[: len(values)] = values[:size]
    return found
