"""Loading and unloading ramps of a load signal, with their rates."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from smartshoe.arrays import Array

# A ramp counts where it spans this share of the record's load range; less is drift within a hold or rest.
LEAST_SPAN = 0.3
SAME_RATE = 0.10


@dataclass(frozen=True, slots=True)
class Ramp:
    """Samples ``start:stop`` with load rising (``rate_n_per_s`` > 0) or falling; the rate is its mean slope."""

    start: int
    stop: int
    rate_n_per_s: float


@dataclass(frozen=True, slots=True)
class Cycle:
    """A loading ramp and the unloading after it; ``start:stop`` covers both and what lies between."""

    up: Ramp
    down: Ramp

    @property
    def start(self) -> int:
        """First sample."""
        return self.up.start

    @property
    def stop(self) -> int:
        """One past the last sample."""
        return self.down.stop

    @property
    def rate_n_per_s(self) -> float:
        """Mean of the two ramps' absolute rates."""
        return 0.5 * (self.up.rate_n_per_s - self.down.rate_n_per_s)


def turning_points(load_n: Array, threshold_n: float) -> list[int]:
    """Samples at which the load (n,) turns by more than ``threshold_n``, which noise must not exceed.

    The first sample and the last are included.
    """
    from smartshoe.kernels.turning import turning_points as run

    points = np.empty(load_n.size + 1, dtype=np.intp)
    found = run(np.ascontiguousarray(load_n, dtype=float), threshold_n, points) if load_n.size else 0
    return [*points[:found].tolist(), load_n.size - 1]


def rises_of(load_n: Array, threshold_n: float) -> list[tuple[int, int]]:
    """Pairs of samples (foot, top) of each rise of a load (n,) by more than ``threshold_n``, which noise is below."""
    points = turning_points(load_n, threshold_n)
    return [(foot, top) for foot, top in pairwise(points) if load_n[top] - load_n[foot] > threshold_n]


def ramps(time_s: Array, load_n: Array) -> list[Ramp]:
    """The ramps of a record that span at least 30 % of its load range, in order of time.

    The slope is taken between 10 % and 90 % of the ramp's span, so that corners and holds do not count.
    """
    span_n = float(np.ptp(load_n))
    if span_n == 0.0:
        return []
    found: list[Ramp] = []
    points = turning_points(load_n, LEAST_SPAN * span_n)
    for first, last in pairwise(points):
        if last <= first:
            continue
        part = load_n[first : last + 1]
        rise = float(part[-1] - part[0])
        if abs(rise) < LEAST_SPAN * span_n:
            continue
        progress = (part - part[0]) / rise
        begin = int(np.nonzero(progress <= 0.1)[0][-1])
        end = begin + int(np.argmax(progress[begin:] >= 0.9))
        if end <= begin:
            continue
        rate = float((part[end] - part[begin]) / (time_s[first + end] - time_s[first + begin]))
        # Only the ramp itself, bounded by its own slope, without the rest before and the hold after it.
        lead = int(np.ceil(0.125 * (end - begin)))
        found.append(Ramp(first + max(begin - lead, 0), min(first + end + lead, last) + 1, rate))
    return found


def cycles(time_s: Array, load_n: Array) -> list[Cycle]:
    """Each loading ramp together with the unloading after it."""
    found = ramps(time_s, load_n)
    return [Cycle(up, down) for up, down in pairwise(found) if up.rate_n_per_s > 0 > down.rate_n_per_s]


def by_rate(found: list[Cycle]) -> dict[float, list[Cycle]]:
    """Cycles grouped by loading rate (within 10 %); the key is the group's mean rate to two digits, ascending."""
    groups: list[list[Cycle]] = []
    for cycle in sorted(found, key=lambda c: c.rate_n_per_s):
        if groups and cycle.rate_n_per_s <= (1 + SAME_RATE) * groups[-1][0].rate_n_per_s:
            groups[-1].append(cycle)
        else:
            groups.append([cycle])
    return {float(f"{np.mean([c.rate_n_per_s for c in group]):.2g}"): group for group in groups}


def rate_range(courses: Iterable[tuple[Array, Array]]) -> tuple[float, float]:
    """Slowest and fastest loading in N/s: the 5 % and 95 % quantiles of rate, weighted by rise of load.

    ``courses`` are pairs of time in s and load in N, each (n,), one per recording; rates are taken over tenths of a
    second. Quantiles are by load, not by time, since a fast triangle takes less than a hundredth of a session's
    samples. (0, 0) where no load rises.
    """
    slopes, rises = [], []
    for time_s, load_n in courses:
        stride = max(round(0.1 / float(np.median(np.diff(time_s)))), 1) if time_s.size > 1 else 1
        rise = np.diff(load_n[::stride])
        slopes.append(rise / np.diff(time_s[::stride]))
        rises.append(rise)
    slope, rise = np.concatenate(slopes), np.concatenate(rises)
    rising = slope > 0.02 * max(float(np.max(slope, initial=0.0)), 1e-12)
    if not rising.any():
        return 0.0, 0.0
    order = np.argsort(slope[rising])
    done = np.cumsum(rise[rising][order])
    low, high = slope[rising][order][np.searchsorted(done, [0.05 * done[-1], 0.95 * done[-1]])]
    return float(low), float(high)
