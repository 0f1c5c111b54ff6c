"""True events of a foot from its true loads, as a force plate and perfect cells under the coils would give them.

A foot is on the ground while its total vertical force exceeds 2 % of body weight (10 N for 53 kg; plates are read at
10-20 N). The heel is loaded while its coil exceeds as much, the forefoot while one of the metatarsals' does.

- heel_strike: the foot reaches the ground (whichever region is first);
- foot_flat: heel and forefoot are both loaded from now on;
- heel_off: the heel is no longer loaded, but the foot is;
- toe_off: the foot leaves the ground.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from simulators.people.shape import COLUMNS
from smartshoe.arrays import Array, Mask

THRESHOLD = 0.02  # of body weight
EVENTS = ("heel_strike", "foot_flat", "heel_off", "toe_off")
HEEL, META1, META4 = (COLUMNS.index(name) for name in ("heel", "meta1", "meta4"))


@dataclass(frozen=True, slots=True)
class TrueEvent:
    """An event of a foot ("left" or "right") at ``time_s``."""

    time_s: float
    foot: str
    event: str


def crossings(time_s: Array, signal: Array, level: float) -> tuple[Array, Mask]:
    """Times (m,) at which the signal (n,) crosses the level, linear between samples, and whether upwards (m,)."""
    above = signal > level
    at = np.flatnonzero(above[1:] != above[:-1])
    before, after = signal[at], signal[at + 1]
    return time_s[at] + (level - before) / (after - before) * (time_s[at + 1] - time_s[at]), above[at + 1]


def events_of(foot: str, time_s: Array, loads_n: Array, body_weight_n: float) -> list[TrueEvent]:
    """Events between the first and the last time, in order; ``loads_n`` (n, 5) are one foot's, as in `COLUMNS`."""
    level = THRESHOLD * body_weight_n
    found: list[TrueEvent] = []
    if time_s.size < 2:
        return found
    whole, heel = loads_n.sum(axis=1), loads_n[:, HEEL]
    fore = np.maximum(loads_n[:, META1], loads_n[:, META4])

    def add(event: str, times_s: Array) -> None:
        found.extend(TrueEvent(float(when), foot, event) for when in times_s)

    def bears(times_s: Array, signal: Array) -> Mask:
        return np.asarray(np.interp(times_s, time_s, signal) > level)

    times_s, up = crossings(time_s, whole, level)
    add("heel_strike", times_s[up])
    add("toe_off", times_s[~up])
    times_s, up = crossings(time_s, heel, level)
    add("foot_flat", times_s[up & bears(times_s, fore)])
    add("heel_off", times_s[~up & bears(times_s, whole)])
    times_s, up = crossings(time_s, fore, level)
    add("foot_flat", times_s[up & bears(times_s, heel)])
    return sorted(found, key=lambda event: event.time_s)
