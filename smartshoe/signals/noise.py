"""White noise of a signal: its standard deviation, and constants of the normal distribution."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from smartshoe.arrays import Array

NORMAL_95 = 1.959963984540054  # standard deviations to either side that hold 95 % of a normal law
NORMAL_QUARTILE = 0.6744897501960817  # those that hold half of it: the median of the absolute value
MAINS_HZ = (50.0, 60.0)
WILD = 4.0  # standard deviations: only one of 16,000 samples of noise lies beyond
UNIFORM_SD = 1.0 / math.sqrt(12.0)  # sd in steps of what is uniform within one, such as a rounded value


def robust_sd(deviations: Array) -> float:
    """Standard deviation of normal ``deviations`` (n,) about 0, from the median of their magnitude.

    0 if there are none. A few outliers therefore have no effect.
    """
    size = deviations.size
    if size == 0:
        return 0.0
    # A median by one partition; numpy's would also search for NaN, which does not occur.
    middle = np.partition(np.abs(deviations), size // 2)
    median = middle[size // 2] if size % 2 else 0.5 * (middle[size // 2] + middle[: size // 2].max())
    return float(median) / NORMAL_QUARTILE


def is_switched(values: Array, few: int, false_alarm: float) -> bool:
    """Whether ``values`` (n,) are at most ``few`` different ones, each held for longer than chance would allow.

    Steps between them are then part of the signal, like those of a drive that is on or off. Noise between the steps of
    a quantisation grid is as likely to be on either at each sample, whatever the one before was. ``false_alarm`` is the
    probability of a wrong answer for such noise.
    """
    from scipy.special import ndtri

    if values.size < 2 or np.unique(values[: few * few]).size > few:  # a quick test that excludes most signals
        return False
    levels, count = np.unique(values, return_counts=True)
    if levels.size > few:
        return False
    alike = float(np.sum((count / values.size) ** 2))
    usual, changes = (values.size - 1) * (1.0 - alike), int(np.count_nonzero(np.diff(values)))
    return bool(changes < usual + float(ndtri(false_alarm)) * math.sqrt(usual * alike))


def white_noise_sd(*signals: Array, order: int = 2, most: int | None = None, step: float = 0.0) -> float:
    """Standard deviation of white noise on smooth ``signals`` (n,), from the median magnitude of their differences.

    Second differences (``order``) remove a straight line, third ones also a curvature; corners are few and do not
    affect a median. At most about ``most`` differences are used. A converter's ``step`` adds its own noise,
    step/sqrt(12), and hides smaller noise: the median of whole steps is a whole step too, uncertain by half a step
    either way, so that in that case the mean square decides, without outliers and corners. 0 where signals are too
    short.
    """
    share = max(sum(signal.size for signal in signals) // most, 1) if most else 1
    found = [_differences(signal, order, share) for signal in signals if signal.size > order + 1]
    power = math.comb(2 * order, order)  # sum of squares of the difference's weights
    if not found:
        return 0.0
    differences, scale = np.concatenate(found), 1.0 / math.sqrt(power)
    sd = scale * robust_sd(differences)
    if step == 0.0:
        return sd
    own, left_open = UNIFORM_SD * step, 0.5 * scale * step / NORMAL_QUARTILE
    most_of_noise = WILD * math.hypot(own, sd + left_open) / scale
    within = differences[np.abs(differences) <= most_of_noise]
    return max(own, scale * float(np.sqrt(np.mean(within**2))))


def autocovariance(rows: Array) -> Array:
    """(n,) sums of products of a series (n,) with itself at lags 0 to n - 1; for rows (m, n) summed over the rows."""
    n = rows.shape[-1]
    power = np.abs(np.fft.rfft(np.atleast_2d(rows), 2 * n, axis=1)) ** 2
    return np.asarray(np.fft.irfft(np.sum(power, axis=0), 2 * n)[:n])


def _differences(signal: Array, order: int, share: int) -> Array:
    """Every ``share``-th difference of ``signal``."""
    count = -(-(signal.size - order) // share)
    weights: Sequence[float] = [(-1.0) ** (order - k) * math.comb(order, k) for k in range(order + 1)]
    found = weights[order] * signal[order::share][:count]
    for k in range(order - 1, -1, -1):
        found += weights[k] * signal[k::share][:count]
    return found
