"""Recordings that continue each other: their order, and what an earlier one leaves to a later one."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from smartshoe.arrays import Array
from smartshoe.integrity.thresholds import Thresholds
from smartshoe.models.effects import Conditions
from smartshoe.models.effects.cycle_conditioning import half_way
from smartshoe.recording import Recording
from smartshoe.signals.loading import rises_of


def by_continuation(recordings: Sequence[Recording]) -> list[int]:
    """The recordings' places ordered by content, but each after the one that it continues.

    Names only tell which continues which: a renamed file is the same data.
    """
    order: list[int] = []
    waiting = sorted(range(len(recordings)), key=lambda k: content_of(recordings[k]))
    while waiting:
        names: Counter[str | None] = Counter(recordings[k].name for k in waiting)
        ready = [k for k in waiting if names[predecessor(recordings[k])] <= continues(recordings[k], recordings[k])]
        placed = {*(ready or waiting)}  # in a ring of recordings that continue each other none is the first
        order += [k for k in waiting if k in placed]
        waiting = [k for k in waiting if k not in placed]
    return order


def content_of(recording: Recording) -> tuple[float, ...]:
    """Length, duration and mean load and reading: numbers that order recordings alike in any unit."""
    means = (float(np.mean(one.si)) for one in recording.loads_and_sensors)
    return recording.time_s.size, recording.duration_s, *means


def without_predecessor(recordings: Sequence[Recording]) -> list[Recording]:
    """Recordings that continue one that is not among them."""
    given = [one for one in recordings if "continues" in one.metadata]
    return [one for one in given if not any(continues(one, other) for other in recordings if other is not one)]


def continues(later: Recording, earlier: Recording) -> bool:
    """Whether a recording continues another one."""
    return predecessor(later) == earlier.name


def predecessor(recording: Recording) -> str | None:
    """The name of the recording that this one continues."""
    return recording.metadata.get("continues")


@dataclass(frozen=True, eq=False)
class History:
    """What earlier recordings left to one that continues them: ``sums``, and their ``load`` (n,) every ``step_s``."""

    sums: Mapping[str, float] = field(default_factory=dict)
    load: Array = field(default_factory=lambda: np.zeros(0))
    step_s: float = 1.0

    @classmethod
    def of(cls, conditions: Conditions) -> History:
        """The history that a session's conditions hold."""
        return cls(conditions.before, conditions.earlier, conditions.step_s)

    def load_every(self, step_s: float) -> Array:
        """The load on another step; its last sample is one step before the recording that follows."""
        if self.step_s == step_s or not self.load.size:
            return self.load
        count = max(round(self.load.size * self.step_s / step_s), 1)
        ago_s = step_s * np.arange(count, 0, -1)
        return np.asarray(np.interp(-ago_s, self.step_s * np.arange(-self.load.size, 0), self.load))


def history_after(conditions: Conditions, thresholds: Thresholds) -> History:
    """The history that a session leaves to the one that continues it."""
    load = conditions.load
    before = conditions.before
    sums = {
        "largest_load": max(before.get("largest_load", 0.0), float(load.max())),
        "cycles": before.get("cycles", 0.0) + len(rises_of(load, thresholds.cycle)),
        "way": before.get("way", 0.0) + float(half_way(conditions)[-1]),
        "time_s": before.get("time_s", 0.0) + float(conditions.time_s[-1]),
        "dose": before.get("dose", 0.0) + float(np.trapezoid(np.maximum(load, 0.0), conditions.time_s)),
    }
    return History(sums, np.concatenate([conditions.earlier, load]), conditions.step_s)
