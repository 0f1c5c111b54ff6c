"""Finds where a foot is in the air: an approximate division of its load into swings and contacts.

A foot's load has a floor while it swings. The floor is found from the load itself, so an offset does not matter, and
the thresholds are shares of the load's height above it, so body weight does not matter. Sway and shifts of weight have
minima too, but round ones, whereas the walls of a swing are steep. A minimum counts as a swing if its width a tenth of
the way up is at least `LEAST_SQUARENESS` of its width three tenths up (0.58 for a parabola, 0.9 for a swing).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from smartshoe.arrays import Array, Index, Mask
from smartshoe.signals.noise import white_noise_sd

OFF, ON, UP = 0.10, 0.15, 0.30  # of the load's height above its floor: swing below OFF, contact above ON, wall at UP
LEAST_SQUARENESS = 0.67
LEAST_SWING_S = 0.18  # the dip below OFF in slow walking is shorter
LEAST_CONTACT_S = 0.08
SCUFF_S, SCUFF_SHARE = 0.16, 0.35  # a contact that is shorter and lighter (of the median peak) is not a stance
LEAST_OF_LEVEL = 0.15  # of the load's own level: least variation of a load with a swing in it
LEAST_OF_SCALE = 0.3  # of the scale of the loads so far: the same
NOISES = 12.0
LIKE_FLOOR = 0.25  # of the scale: how far a floor may differ from the last
MOST_TRENDS = 4
RHYTHM = 3  # number of swings from which a new floor is accepted
SMOOTH_S, WIDE_S = 0.025, 0.1


@dataclass(frozen=True, eq=False)
class Cut:
    """Swings [``start``, ``stop``) (k,) in samples, in order; all else is contact.

    ``noise`` is the sd of one sample.
    """

    start: Index
    stop: Index
    noise: float


def boxcar(signal: Array, count: int) -> Array:
    """Centred moving average (n,) over ``count`` samples (made odd), over fewer at the ends."""
    half = count // 2
    if half == 0 or signal.size == 0:
        return signal
    total = np.concatenate([[0.0], np.cumsum(signal - signal[0])])
    at = np.arange(signal.size)
    low, high = np.maximum(at - half, 0), np.minimum(at + half + 1, signal.size)
    return np.asarray((total[high] - total[low]) / (high - low) + signal[0])


def cut(load: Array, rate_hz: float, least_load: float, scale: float | None, floor: float | None) -> Cut | None:
    """The swings in a window of a foot's whole load (n,); None if the load varies too little to contain one.

    ``scale`` and ``floor`` are those of the window before, None if unknown.
    """
    found = _cut_level(load, rate_hz, least_load, scale, floor)
    for _ in range(MOST_TRENDS):
        # If the floor drifts, swings far from the lowest one are missed; those found show the slope.
        if found is None or found.start.size < 2:
            return found
        trend = _trend(load, found)
        level = None if floor is None else floor - trend[0]
        again = _cut_level(load - trend, rate_hz, least_load, scale, level)
        if again is None or again.start.size <= found.start.size:
            return found
        found = again
    return found


def _trend(load: Array, found: Cut) -> Array:
    """The drift of the floor as a straight line (n,), zero in the middle, by the median slope over pairs of swings."""
    total = np.concatenate([[0.0], np.cumsum(load)])
    level = (total[found.stop] - total[found.start]) / (found.stop - found.start)
    place = 0.5 * (found.stop + found.start)
    first, second = np.triu_indices(place.size, 1)
    slope = float(np.median((level[second] - level[first]) / (place[second] - place[first])))
    return np.asarray(slope * (np.arange(load.size) - 0.5 * (load.size - 1)))


def _cut_level(load: Array, rate_hz: float, least_load: float, scale: float | None, floor: float | None) -> Cut | None:
    """The swings with the floor taken as level; None if the load varies too little or no swing is found."""
    noise = white_noise_sd(load)
    wide = boxcar(load, round(WIDE_S * rate_hz))
    low, high = float(wide.min()), float(wide.max())
    top = float(np.quantile(wide[wide >= low + 0.15 * (high - low)], 0.9))
    height = top - low
    least = max(least_load, NOISES * noise, LEAST_OF_LEVEL * abs(top), LEAST_OF_SCALE * (scale or 0.0))
    if not height > least:
        return None
    smooth = boxcar(load, round(SMOOTH_S * rate_hz))
    start, stop = _low_runs(smooth, low + OFF * height, low + ON * height)
    start, stop = _without_short(start, stop, smooth.size, rate_hz)
    start, stop = _with_steep_walls(smooth, start, stop, low, height, rate_hz)
    if start.size and floor is not None and scale is not None and start.size < RHYTHM:
        total = np.concatenate([[0.0], np.cumsum(smooth)])
        level = (total[stop] - total[start]) / (stop - start)
        like = np.abs(level - floor) < LIKE_FLOOR * scale
        start, stop = start[like], stop[like]
    if start.size == 0:
        return None
    start, stop = _without_scuffs(smooth, start, stop, low, rate_hz)
    return Cut(start, stop, noise)


def _low_runs(smooth: Array, off: float, on: float) -> tuple[Index, Index]:
    """Runs of samples [start, stop) below ``off`` that end where the load exceeds ``on``."""
    code = np.where(smooth >= on, 1, np.where(smooth < off, 0, -1))
    known = np.flatnonzero(code >= 0)
    if known.size == 0:
        return np.zeros(0, np.intp), np.zeros(0, np.intp)
    last = np.maximum.accumulate(np.where(code >= 0, np.arange(code.size), known[0]))
    up = code[last]
    edge = np.flatnonzero(np.diff(np.concatenate([[1], up, [1]])))
    return edge[0::2], edge[1::2]


def _without_short(start: Index, stop: Index, size: int, rate_hz: float) -> tuple[Index, Index]:
    """Fill short swings, then remove short contacts; those at the window's ends may be longer outside and are kept."""
    keep = ((stop - start) >= LEAST_SWING_S * rate_hz) | (start == 0) | (stop == size)
    start, stop = start[keep], stop[keep]
    return _joined(start, stop, (start[1:] - stop[:-1]) >= LEAST_CONTACT_S * rate_hz)


def _joined(start: Index, stop: Index, apart: Mask) -> tuple[Index, Index]:
    if start.size < 2:
        return start, stop
    return start[np.concatenate([[True], apart])], stop[np.concatenate([apart, [True]])]


def _with_steep_walls(
    smooth: Array, start: Index, stop: Index, low: float, height: float, rate_hz: float
) -> tuple[Index, Index]:
    """The candidates with steep walls: about as wide at `OFF` as at `UP` of the height."""
    at = np.arange(smooth.size)
    wall = smooth > low + UP * height
    before = np.maximum.accumulate(np.where(wall, at, -1))
    after = np.minimum.accumulate(np.where(wall, at, smooth.size)[::-1])[::-1]
    if start.size == 0:
        return start, stop
    below = np.concatenate([[0], np.cumsum(smooth < low + OFF * height)])
    inner = below[stop] - below[start]
    middle = (start + stop) // 2
    outer = after[middle] - before[middle] - 1
    long = inner >= 0.3 * LEAST_SWING_S * rate_hz
    keep = long & (inner >= LEAST_SQUARENESS * np.maximum(outer, 1))
    return start[keep], stop[keep]


def _without_scuffs(smooth: Array, start: Index, stop: Index, low: float, rate_hz: float) -> tuple[Index, Index]:
    """Join swings separated by a contact that is shorter and lighter than a stance."""
    if start.size < 3:
        return start, stop
    begins, ends = stop[:-1], start[1:]
    peak = np.maximum.reduceat(smooth, np.column_stack([begins, ends]).ravel())[::2] - low
    scuff = ((ends - begins) < SCUFF_S * rate_hz) & (peak < SCUFF_SHARE * np.median(peak))
    return _joined(start, stop, ~scuff)
