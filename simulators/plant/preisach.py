"""A Preisach operator in closed form: relays over two thresholds, summed through an Everett function.

A relay switches up where the load passes ``centre + r`` and down where it falls below ``centre - r``. The density of
relays is uniform in r over [r_low, r_high] and parabolic in the centre over [low, high] with low = r_high, so that
every relay is down at zero load. Because the density depends on the centre, the operator is not a superposition of
plays or stops (which have a density uniform in the centre), and it has no differential equation as Bouc-Wen has:
smartshoe cannot fit it with the equation that made the data.

Its memory is the stack of dominant turning points (wiping-out). Source: Mayergoyz 2003, Mathematical Models of
Hysteresis, ch. 1: f(t) = sum over k of E(M_k, m_(k-1)) - E(M_k, m_k).
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from smartshoe.arrays import Array

MEMORY = 256  # turning points stored; beyond that the two innermost, the smallest loop, are dropped


@njit(cache=True)
def _cumulated(load: float, low: float, high: float) -> float:
    """Integral from -inf to ``load`` of the share of relay centres below a load (a quartic, then a line)."""
    width = high - low
    s = (load - low) / width
    if s <= 0.0:
        return 0.0
    if s >= 1.0:
        return width * (s - 0.5)
    return width * s * s * s * (1.0 - 0.5 * s)


@njit(cache=True)
def everett(upper: float, lower: float, shape: Array) -> float:
    """Share of relays with down threshold above ``lower`` and up threshold below ``upper`` (N): E(upper, lower).

    ``shape`` = (r_low, r_high, low, high) in N. The inner integral over the centre is a difference of the centre's
    distribution, the outer one over r of its primitive, hence exact.
    """
    r_low, r_high, low, high = shape[0], shape[1], shape[2], shape[3]
    top = min(r_high, 0.5 * (upper - lower))
    if top <= r_low:
        return 0.0
    switched = _cumulated(upper - r_low, low, high) - _cumulated(upper - top, low, high)
    passed = _cumulated(lower + top, low, high) - _cumulated(lower + r_low, low, high)
    return float((switched - passed) / (r_high - r_low))


@njit(cache=True)
def mean_curve(load: float, shape: Array) -> float:
    """Mean of the major loop's two branches at ``load``, which is subtracted so that only the loop remains."""
    r_low, r_high, low, high = shape[0], shape[1], shape[2], shape[3]
    up = _cumulated(load - r_low, low, high) - _cumulated(load - r_high, low, high)
    down = _cumulated(load + r_high, low, high) - _cumulated(load + r_low, low, high)
    return float(0.5 * (up + down) / (r_high - r_low))


@njit(cache=True)
def relays_up(load: float, turning: Array, partial: Array, count: int, shape: Array) -> tuple[float, int]:
    """Share of relays that are up once the load has moved to ``load``, and the new number of turning points.

    ``turning`` (MEMORY,) alternates minima (even positions) and maxima (odd), the last one being the present load;
    ``partial`` (MEMORY,) holds the share at each of them. Both are changed in place. ``turning[0]`` is zero load.
    """
    last = turning[count - 1]
    if load == last:
        return partial[count - 1], count
    rising = load > last
    is_maximum = (count - 1) % 2 == 1
    if count == 1 or rising != is_maximum:  # a reversal: the last point is kept and a new one added
        if count >= MEMORY - 1:
            count -= 2
        count += 1
    if rising:
        while count >= 4 and load >= turning[count - 3]:
            count -= 2
    else:
        while count >= 3 and load <= turning[count - 3]:
            count -= 2
        if load <= 0.0:
            turning[0] = 0.0
            return 0.0, 1
    before = turning[count - 2]
    turning[count - 1] = load
    if rising:
        partial[count - 1] = partial[count - 2] + everett(load, before, shape)
    else:
        partial[count - 1] = partial[count - 2] - everett(before, load, shape)
    return partial[count - 1], count


def loop_shape(half_width_n: float, spread: float, full_scale_n: float) -> tuple[Array, float]:
    """The density's (r_low, r_high, low, high) in N, and the largest half width of its major loop (a share).

    Relays of half width ``half_width_n`` (1 +- ``spread``); centres up to 1.25 times full scale.
    """
    r_low, r_high = half_width_n * (1.0 - spread), half_width_n * (1.0 + spread)
    shape = np.array([r_low, r_high, r_high, r_high + 1.25 * full_scale_n])
    # The loop is widest where the centres are densest: half the difference of the branches, averaged over the
    # relays, is largest there.
    middle = 0.5 * (shape[2] + shape[3])
    branches = [mean_curve(middle, shape), everett(middle, -10.0 * math.fabs(shape[3]), shape)]
    return shape, float(branches[0] - branches[1])
