"""Finds a foot's swings in the sum of its units, whatever its zero: flat valleys between stances.

Approximate on purpose: a time is needed in which the foot is surely off the ground, not the moment of toe off.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from smartshoe.arrays import Array, Mask

SHORTEST_S, LONGEST_S = 0.15, 1.0  # even a sprinter swings longer than the first; beyond the second a foot rests
ENTER, LEAVE = 0.10, 0.25  # of the rise above the valley: thresholds below which a swing begins, above which it ends
FLAT = 0.03  # of the rise: how far a swing's middle may spread or slope; a loaded foot does not stay so constant
FROM, TO = 0.4, 0.8  # of a swing: by then the shoe is unloaded, and the heel is not yet down


@dataclass(frozen=True, slots=True)
class Swing:
    """A swing: samples ``start`` up to ``stop`` are below the threshold; in ``middle`` the foot is in the air."""

    start: int
    stop: int
    middle: slice


def is_low(total: Array, low: float, rise: float) -> Mask:
    """(n,) True below the valley's threshold, with hysteresis between ``ENTER`` and ``LEAVE`` of ``rise``."""
    below, above = total < low + ENTER * rise, total > low + LEAVE * rise
    index = np.arange(total.size)
    last_below = np.maximum.accumulate(np.where(below, index, -1))
    last_above = np.maximum.accumulate(np.where(above, index, -1))
    return last_below > last_above


def swings(total: Array, sample_rate_hz: float, least_rise: float) -> list[Swing]:
    """Swings that begin and end within ``total`` (n,): some seconds of a foot's summed load, in any unit.

    The valley is the lowest level in ``total``, so an offset changes nothing. A rise above it of less than
    ``least_rise``, in the same unit, is not a step.
    """
    low, high = (float(x) for x in np.quantile(total, (0.02, 0.98)))
    rise = high - low
    if not rise >= least_rise > 0.0:
        return []
    state = is_low(total, low, rise)
    edges = np.flatnonzero(np.diff(state.astype(np.int8)))
    found = []
    for start, stop in zip(edges[:-1] + 1, edges[1:] + 1, strict=True):
        count = int(stop - start)
        if not state[start] or not SHORTEST_S <= count / sample_rate_hz <= LONGEST_S:
            continue
        middle = slice(int(start) + round(FROM * count), int(start) + max(round(TO * count), round(FROM * count) + 2))
        if _is_flat(total[middle], rise):
            found.append(Swing(int(start), int(stop), middle))
    return found


def _is_flat(part: Array, rise: float) -> bool:
    """Whether the middle of a swing neither spreads nor slopes by more than `FLAT` of the rise."""
    third = max(part.size // 3, 1)
    slope = float(part[-third:].mean() - part[:third].mean())
    return bool(part.std() <= FLAT * rise and abs(slope) <= FLAT * rise)
