"""The load at rest: what the cell shows of an unloaded unit, and whether a recording begins with it."""

from __future__ import annotations

import numpy as np

from smartshoe.arrays import Array
from smartshoe.integrity.thresholds import Thresholds
from smartshoe.signals.masks import runs_of
from smartshoe.units import Unit


def load_at_rest(load: Array, reading: Array, step_s: float, unit: Unit, thresholds: Thresholds) -> float:
    """The load that the cell shows of an unloaded unit, as its tare: the lowest one, or the first if it begins so."""
    low = float(np.quantile(load[:: max(1, load.size // 5000)], 0.02))
    if unit.quantity == "pressure" and begins_unloaded(load, reading, step_s, thresholds):
        return min(low, float(load[0]))
    return min(low, thresholds.standing)


def begins_unloaded(load: Array, reading: Array, step_s: float, thresholds: Thresholds) -> bool:
    """Whether a recording begins with a load (n,) at which its gauge (n,) reads almost nothing, so that it is a tare.

    Not where load and reading both fall clearly below that later: then it began loaded, with a gauge zeroed there.
    """
    first = slice(0, max(1, round(thresholds.settled_s / step_s)))
    begun, read = (float(one[first].mean()) for one in (load, reading))
    if not (np.ptp(load[first]) < thresholds.standing and abs(read) < thresholds.same * abs(begun)):
        return False
    fall = min(level - float(np.quantile(one, 0.01)) for level, one in ((begun, load), (read, reading)))
    return fall < thresholds.standing


def with_level_rests(load: Array, level: float, reach: float) -> Array:
    """``load`` with each rest at its mean, up to ``reach``: an unloaded unit does not feel the load cell's noise."""
    out = load.copy()
    for first, last in zip(*runs_of(load < level), strict=True):
        part = load[first:last]
        middle = float(np.median(part))
        still = np.abs(part - middle) < reach
        if still.sum() > 10:
            out[first:last][still] = part[still].mean()
    return out
