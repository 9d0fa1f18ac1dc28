"""Bursts and their summary by a plain loop over the rows of `damper.events`, for the tests.

The rows start with the run, so the loop knows for certain which burst an impact belongs to and
when it began. It shares no code with the observers.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from damper import Parameters, State, events

MANY = 10_000  # impacts of a closed tail that are looked at one by one


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

    def tail(self, restitution: float) -> list[float]:
        """Approach speeds of the impacts between the last row and sticking."""
        if not self.complete:
            return []
        speeds, speed = [], restitution * self.speeds[-1]
        while speed > 1e-300 and len(speeds) < MANY:
            speeds.append(speed)
            speed *= restitution
        return speeds

    def limit(self, fraction: float, speed: float) -> float:
        """Smallest approach speed that can be seen."""
        return speed or fraction * self.speeds[0]

    def visible(self, restitution: float, fraction: float = 0.0, speed: float = 0.0) -> int:
        """Impacts of the burst that can be seen, the tail's included."""
        limit = self.limit(fraction, speed)
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
    def period(self) -> float:
        return 2.0 * math.pi / self.parameters["frequency_ratio"]

    @property
    def start(self) -> float:
        return (self.state.time if self.state else 0.0) + self.transient * self.period

    @property
    def end(self) -> float:
        return self.start + self.periods * self.period

    @property
    def restitution(self) -> float:
        return self.parameters["restitution"]

    def rows(self, until: float | None = None) -> np.ndarray:
        """All events since the start of the run."""
        until = self.end if until is None else until
        p = Parameters(**self.parameters)
        return events(p, self.state, until=until, accuracy=self.accuracy)

    def run(self) -> dict[str, Any]:
        """Arguments of `run_points` besides parameters and observers."""
        return {
            "transient": self.transient,
            "periods": self.periods,
            "state": self.state,
            "accuracy": self.accuracy,
        }


def all_bursts(rows: np.ndarray) -> list[Burst]:
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


def sticking_time(scene: Scene) -> float:
    """Time in the record between a stick row and the release after it."""
    if scene.parameters["clearance"] == 0.0:
        return scene.end - scene.start
    total, since = 0.0, None
    for row in scene.rows():
        if row["kind"] == 1:
            since = row["time"]
        elif row["kind"] == 2:
            total += max(0.0, row["time"] - max(since, scene.start))
            since = None
    if since is not None:
        total += scene.end - max(since, scene.start)
    return total


def burst_summary(scene: Scene, fraction: float = 0.0, speed: float = 0.0) -> dict[str, float]:
    """Every scalar of the bursts observer."""
    begun = [b for b in all_bursts(scene.rows()) if b.onset >= scene.start]
    ended = [b for b in begun if b.ended]
    counts = {id(b): b.visible(scene.restitution, fraction, speed) for b in begun}
    chattering = [b for b in begun if counts[id(b)] >= 5]
    return {
        "visible_impacts": max(counts.values(), default=0),
        "chatter": 2 if any(b.complete for b in chattering) else int(bool(chattering)),
        "bursts_per_period": len(begun) / scene.periods,
        "complete_fraction": (sum(b.complete for b in ended) / len(ended) if ended else math.nan),
        "sticking_fraction": sticking_time(scene) / (scene.end - scene.start),
    }


def impact_summary(scene: Scene, fraction: float = 0.0, speed: float = 0.0) -> dict[str, float]:
    """Every variable of the impacts observer."""
    count, resolved, largest = 0, [], math.nan
    for burst in all_bursts(scene.rows()):
        limit = burst.limit(fraction, speed)
        inside = [s for s, t in zip(burst.speeds, burst.times, strict=True) if t >= scene.start]
        seen = [s for s in inside if s >= limit]
        resolved += seen
        count += len(seen)
        if burst.times[-1] >= scene.start:
            count += sum(s >= limit for s in burst.tail(scene.restitution))
        largest = np.nanmax([largest, *inside]) if inside else largest
    return {
        "impacts_per_period": count / scene.periods,
        "mean_approach_speed": float(np.mean(resolved)) if resolved else math.nan,
        "max_approach_speed": largest,
    }
