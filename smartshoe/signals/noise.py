"""White noise: how large it is beside a signal, and what of a normal law lies where."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from smartshoe.arrays import Array

NORMAL_95 = 1.959963984540054  # standard deviations to either side that hold 95 % of a normal law
NORMAL_QUARTILE = 0.6744897501960817  # and the half of it: the median of the absolute value
MAINS_HZ = (50.0, 60.0)
UNIFORM_SD = 1.0 / math.sqrt(12.0)  # of what is anywhere within one step: a rounded value, a time in its interval


def robust_sd(deviations: Array) -> float:
    """Standard deviation of normal ``deviations`` (n,) about 0, from the median of their size; 0 where there is none.

    So a few that are wild do not matter.
    """
    size = deviations.size
    if size == 0:
        return 0.0
    # A median by one partition: numpy's would look for NaN, of which there is none.
    middle = np.partition(np.abs(deviations), size // 2)
    median = middle[size // 2] if size % 2 else 0.5 * (middle[size // 2] + middle[: size // 2].max())
    return float(median) / NORMAL_QUARTILE


def white_noise_sd(*signals: Array, order: int = 2, most: int | None = None) -> float:
    """Standard deviation of the white noise on smooth ``signals`` (n,), by the median of their differences.

    Second differences (``order``) take off a straight line, third ones a bend; corners are few and do not move a
    median. Of more than ``most`` differences so many are looked at. A noise below a converter's step is not seen (the
    median is 0): what a step leaves is the step's own, step/sqrt(12). 0 where signals are too short.
    """
    share = max(sum(signal.size for signal in signals) // most, 1) if most else 1
    found = [_differences(signal, order, share) for signal in signals if signal.size > order + 1]
    power = math.comb(2 * order, order)  # the sum of the squares of the difference's weights
    return robust_sd(np.concatenate(found)) / math.sqrt(power) if found else 0.0


def _differences(signal: Array, order: int, share: int) -> Array:
    """Every ``share``-th difference of ``signal``."""
    count = -(-(signal.size - order) // share)
    weights: Sequence[float] = [(-1.0) ** (order - k) * math.comb(order, k) for k in range(order + 1)]
    found = weights[order] * signal[order::share][:count]
    for k in range(order - 1, -1, -1):
        found += weights[k] * signal[k::share][:count]
    return found
