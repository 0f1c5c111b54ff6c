"""The reference load without its noise, with its corners unchanged.

Noise on the load imitates physics: a simulation that smooths it (a lag), or that removes it from rests (a dead band),
fits better for no reason of the unit's. The load of a testing machine consists of straight lines with corners. So each
sample is taken from the best of several lines through its neighbourhood, centred, ending or beginning there, long or
short, as long as the residual of the line is noise (after the crossing-lines idea of Katkovnik 1999).
"""

from __future__ import annotations

import numpy as np
from scipy.signal import oaconvolve

from smartshoe.arrays import Array, Mask
from smartshoe.integrity.thresholds import Thresholds, largest_of_noise
from smartshoe.signals.noise import is_switched, robust_sd

LATER = 9  # the largest delay in samples at which a reading is seen to follow, a resolution
PLACES_PER_TAP = 3  # with as many samples for each tap, unrelated noise hardly ever seems followed
FEW_TAPS = 300  # window length from which convolution by FFT is faster


def noise_sd(signal: Array, thresholds: Thresholds) -> float:
    """Standard deviation of white noise from third differences, in which ramps and bends vanish.

    The median gives the scale, and the mean square of differences within noise the value, since on a quantisation grid
    the median is a whole number of steps. 0 for a load that is switched between a few levels.
    """
    if signal.size < 10 or is_switched(signal, thresholds.few, thresholds.false_alarm):
        return 0.0
    third = np.diff(signal, 3)
    return float(np.sqrt(np.mean(third[_are_of_noise(third, thresholds)] ** 2) / 20.0))


def _are_of_noise(third: Array, thresholds: Thresholds) -> Mask:
    """(n,) True for ``third`` differences that white noise may reach; those at corners are larger."""
    return np.asarray(np.abs(third) <= largest_of_noise(third.size, thresholds) * robust_sd(third))


def followed_share(load: Array, reading: Array, thresholds: Thresholds) -> float:
    """Share of a load's supposed noise that the ``reading`` (n,) follows, at once or some samples later.

    Such noise is real: a shaker, a vehicle or a swaying person moves a load as fast. The share is of the variance of
    third differences without the largest; 0 where it is not nearly all (``same``), or where too few are left.
    """
    moved, read = np.diff(load, 3), np.diff(reading, 3)
    if moved.size <= LATER:
        return 0.0
    at = np.arange(LATER, moved.size)
    inside = _are_of_noise(moved, thresholds)
    at = at[np.lib.stride_tricks.sliding_window_view(inside, LATER + 1).all(axis=1)]
    if at.size < PLACES_PER_TAP * (LATER + 1):
        return 0.0
    taps = np.stack([moved[at - late] for late in range(LATER + 1)])
    gram, cross, whole = taps @ taps.T, taps @ read[at], float(read[at] @ read[at])
    if whole == 0.0:
        return 0.0
    share = float(cross @ np.linalg.lstsq(gram, cross, rcond=1e-9)[0]) / whole
    share = 1.0 - (1.0 - share) * at.size / max(at.size - LATER - 1, 1)
    return share if share > 1.0 - thresholds.same else 0.0


def without_noise(load: Array, step_s: float, sd: float, thresholds: Thresholds) -> tuple[Array, float, Array]:
    """The load (n,) without noise of standard deviation ``sd``, and the standard deviation of what remains of it.

    With it (n,) the share of the noise's variance that remains at each sample.
    """
    least = thresholds.few + 2  # samples of a line: a few more than it has parameters
    if sd == 0.0 or load.size < thresholds.least_samples:
        return load, sd, np.ones(load.size)
    best = load.copy()
    variance = np.ones(load.size)
    squares = load - load.mean()
    unlikely = largest_of_noise(1, thresholds)
    # The time within which an echo lies; near corners a half and a quarter of it.
    for share in (1.0, 0.5, 0.25):
        half = max(round(share * thresholds.echo_s / step_s), least // 2)
        n = 2 * half + 1
        if n > load.size:
            continue
        mean, slope, left, spread = _lines(squares, half)
        fits = left <= sd**2 * (1.0 + unlikely * np.sqrt(2.0 / (n - 2)))
        for place in (half, 2 * half, 0):  # the sample's place in its neighbourhood
            away = place - half
            leverage = 1.0 / n + away**2 / spread
            here = slice(place, place + fits.size)
            better = fits & (leverage < variance[here])
            best[here][better] = (mean + slope * away)[better] + load.mean()
            variance[here][better] = leverage
    return best, sd * float(np.sqrt(variance.mean())), variance


def _lines(signal: Array, half: int) -> tuple[Array, Array, Array, float]:
    """Least-squares lines through every 2 ``half`` + 1 neighbours of a signal (n,).

    Mean, slope and residual variance, (n - 2 half,) each, and the sum of squares of the places about their middle.
    """
    k = np.arange(-half, half + 1, dtype=float)
    spread = float(np.sum(k**2))
    windows = np.ones(k.size)
    convolve = np.convolve if k.size < FEW_TAPS else oaconvolve
    mean = convolve(signal, windows, "valid") / k.size
    slope = convolve(signal, k[::-1], "valid") / spread
    power = convolve(signal**2, windows, "valid")
    left = np.maximum(power - k.size * mean**2 - spread * slope**2, 0.0) / (k.size - 2)
    return mean, slope, left, spread
