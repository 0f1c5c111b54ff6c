"""The reference load without its noise, corners unchanged.

Noise on the load imitates physics: a simulation that smooths it (a lag), or that keeps it out of rests (a dead band),
fits better for no reason of the unit's. A testing machine's load is straight lines with corners; so each sample is
taken from the best of several straight lines through its neighbourhood: centred, ending or beginning at it, long or
short, as far as what a line leaves is noise (after the crossing-lines idea of Katkovnik 1999).
"""

from __future__ import annotations

import numpy as np

from smartshoe.arrays import Array
from smartshoe.integrity.thresholds import Thresholds, largest_of_noise
from smartshoe.signals.noise import robust_sd


def noise_sd(signal: Array, thresholds: Thresholds) -> float:
    """White noise's standard deviation from third differences, which no ramp or bend reaches.

    The median finds the scale, the mean square of what noise reaches the value: on a converter's
    quantisation grid a median is a whole number of steps.
    """
    if signal.size < 10:
        return 0.0
    third = np.abs(np.diff(signal, 3))
    sd = robust_sd(third)
    inside = third <= largest_of_noise(third.size, thresholds) * sd
    return float(np.sqrt(np.mean(third[inside] ** 2) / 20.0))


def without_noise(load: Array, step_s: float, sd: float, thresholds: Thresholds) -> tuple[Array, float]:
    """The load (n,) from lines through its neighbourhood, and what is left of its noise's standard deviation ``sd``."""
    least = thresholds.few + 2  # samples that a line is drawn through: a few more than it has numbers
    if sd == 0.0 or load.size < thresholds.least_samples:
        return load, sd
    best = load.copy()
    variance = np.ones(load.size)
    squares = load - load.mean()
    unlikely = largest_of_noise(1, thresholds)
    # Within which an echo lies; where corners are near, a half and a quarter of it.
    for share in (1.0, 0.5, 0.25):
        half = max(round(share * thresholds.echo_s / step_s), least // 2)
        for first in (-half, -2 * half, 0):
            value, left, leverage = _line(squares, first, first + 2 * half)
            n = 2 * half + 1
            fits = left <= sd**2 * (1.0 + unlikely * np.sqrt(2.0 / (n - 2)))
            better = fits & (leverage < variance)
            best[better] = value[better] + load.mean()
            variance[better] = leverage
    return best, sd * float(np.sqrt(variance.mean()))


def _line(signal: Array, first: int, last: int) -> tuple[Array, Array, float]:
    """Least squares line through the neighbours ``first`` to ``last`` of each sample.

    Its value there (n,), residual variance (n,), infinite where neighbours lack, and the value's share of the noise's
    variance.
    """
    k = np.arange(first, last + 1, dtype=float)
    n = k.size
    centre = k.mean()
    spread = float(np.sum((k - centre) ** 2))
    size = signal.size
    value, left = np.zeros(size), np.full(size, np.inf)
    low, high = max(0, -first), min(size, size - last)
    if high <= low:
        return value, left, 1.0
    windows = np.ones(n)
    total = np.convolve(signal, windows, "valid")
    tilt = np.convolve(signal, (k - centre)[::-1], "valid")
    power = np.convolve(signal**2, windows, "valid")
    start = low + first
    inside = slice(start, start + high - low)
    mean, slope = total[inside] / n, tilt[inside] / spread
    value[low:high] = mean - slope * centre
    left[low:high] = np.maximum(power[inside] - n * mean**2 - spread * slope**2, 0.0) / (n - 2)
    return value, left, 1.0 / n + centre**2 / spread
