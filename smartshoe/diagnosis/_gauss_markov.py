"""Whether a residual is only correlated noise: stationary, Gaussian, Markov, and independent of the load.

Slow noise does not average out within a block of seconds, so that it looks like structure. To tell them apart, the
residual is modelled as an autoregression, which describes any stationary noise as nearly as its length allows (Wold
1938; order by Schwarz's criterion, 1978). Its innovations, the errors of predicting the next sample, must be

*white* (Bartlett 1955, the cumulative periodogram); *Gaussian*, which a switching level, a draught or a jump is not,
since these surprise rarely and then strongly; *equally large under any load and rate*, which friction, seating or a
pinched hose is not.

And its memory must be short: a slow sine or a drift can be predicted for longer than any noise.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

from smartshoe.arrays import Array, Mask
from smartshoe.diagnosis._session import Session
from smartshoe.integrity.thresholds import Thresholds, largest_of_noise


@dataclass(frozen=True, slots=True)
class GaussMarkov:
    """The correlated part of a residual: its ``rms``, a share of full scale, memory ``tau_s``, and tests of noise.

    ``spectrum_statistic`` is Kolmogorov's statistic of the innovations' spectrum. ``kurtosis_z`` is their excess
    kurtosis and ``load_z`` the correlation of their squares with load or its rate (the larger), both in standard
    deviations. ``excess_kurtosis`` is that of the block means: 0 for noise, -1.5 for a sine, -2 for two levels.
    ``held_rms`` is the rms while the load is held.
    """

    rms: float
    tau_s: float
    spectrum_statistic: float
    kurtosis_z: float
    load_z: float
    excess_kurtosis: float
    thresholds: Thresholds
    held_rms: float = 0.0

    @property
    def is_noise(self) -> bool:
        """Whether no test speaks against noise."""
        return self._would_be_noise and self.load_z < self._deviations

    @property
    def beyond_noise(self) -> float:
        """Rms of what is not noise: nothing, all of it, or what exceeds the rms while the load is held.

        The last where only the dependence on the load speaks against noise, since noise is as large under any load.
        """
        if self.is_noise:
            return 0.0
        return math.sqrt(max(self.rms**2 - self.held_rms**2, 0.0)) if self._would_be_noise else self.rms

    @property
    def switches(self) -> bool:
        """Whether it switches between two levels at random, independently of the load."""
        # A level that switches at random has the spectrum of first-order noise.
        random = self._is_white and self.load_z < self._deviations
        clear = self.thresholds.clear**2
        two_levels = -2.0 * (clear / (clear + 1.0)) ** 2  # excess kurtosis of two levels that are clear of noise
        return random and self.kurtosis_z > self._deviations and self.excess_kurtosis < two_levels

    def sd_of_mean(self, duration_s: float) -> float:
        """Standard deviation of its mean over ``duration_s``; each correlation time counts once (Box and Jenkins)."""
        return self.rms * math.sqrt(min(2.0 * self.tau_s / duration_s, 1.0))

    @property
    def _would_be_noise(self) -> bool:
        """Whether it is white, Gaussian and of short memory; with a longer memory it may as well be a drift."""
        forgets = self.tau_s < self.thresholds.lasting_s
        return self._is_white and forgets and abs(self.kurtosis_z) < self._deviations

    @property
    def _is_white(self) -> bool:
        """Whether the innovations are white, by the tail of Kolmogorov's distribution."""
        return self.spectrum_statistic < math.sqrt(-0.5 * math.log(0.5 * self.thresholds.false_alarm))

    @property
    def _deviations(self) -> float:
        """The deviation, in standard deviations, that counts as beyond chance."""
        return largest_of_noise(1, self.thresholds)


@dataclass(frozen=True, eq=False)
class _Blocks:
    """Means over blocks (b,) of one session: residual (0 where missing), load, and absolute rate.

    ``complete``: no sample of the block is masked.
    """

    residual: Array
    complete: Mask
    load: Array
    rate: Array
    step_s: float


def gauss_markov_of(
    sessions: Sequence[Session], residuals: Sequence[Array], thresholds: Thresholds
) -> GaussMarkov | None:
    """The correlated part of ``residuals``, (n,) for each session; None where there is too little data."""
    blocks = [_blocks(session, residual, thresholds) for session, residual in zip(sessions, residuals, strict=True)]
    blocks = [one for one in blocks if one.complete.any()]
    if not any(one.residual.any() for one in blocks):
        return None
    complete_count = sum(int(one.complete.sum()) for one in blocks)
    step_s = float(np.median([one.step_s for one in blocks]))
    lags = max(round(thresholds.lasting_s / step_s), 1)
    covariance = np.sum([_covariance(one.residual, lags) for one in blocks], axis=0) / complete_count
    weights = _autoregression(covariance, complete_count)
    good = [_past_is_known(one, weights.size) for one in blocks]
    count = sum(int(one.sum()) for one in good)
    largest = largest_of_noise(1, thresholds)
    # With fewer blocks, chance correlations reach this size.
    if count < (largest / thresholds.same) ** 2:
        return None
    innovations = [lfilter([1.0, *-weights], [1.0], one.residual) for one in blocks]
    spectrum_statistic = max(
        _kolmogorov(np.where(known, one, 0.0)) for one, known in zip(innovations, good, strict=True)
    )
    square = np.concatenate([one[known] for one, known in zip(innovations, good, strict=True)]) ** 2
    innovation_variance = float(square.mean())
    square /= innovation_variance
    kurtosis = (float(np.mean(square**2)) - 3.0) / np.sqrt(24.0 / count)
    drives = [
        np.concatenate([one[known] for one, known in zip(drive, good, strict=True)])
        for drive in ([one.load for one in blocks], [one.rate for one in blocks])
    ]
    load_z = max(abs(_correlation(one, np.minimum(square, largest**2))) for one in drives) * np.sqrt(count)
    level = np.concatenate([one.residual[one.complete] for one in blocks])
    excess_kurtosis = float(np.mean(level**4) / np.mean(level**2) ** 2) - 3.0
    tau_s = _memory_s(weights, lags, step_s)
    tests = spectrum_statistic, float(kurtosis), float(load_z)
    predicted_variance = max(float(covariance[0]) - innovation_variance, 0.0)
    one, two = (_lagged(blocks, lag, thresholds) / complete_count for lag in (1, 2))
    rms = math.sqrt(max(_correlated_variance(float(covariance[0]), one, two), predicted_variance))
    return GaussMarkov(rms, tau_s, *tests, excess_kurtosis, thresholds, rms * _share_while_held(blocks, thresholds))


def _blocks(session: Session, residual: Array, thresholds: Thresholds) -> _Blocks:
    """Block means over a sensor's lag: what is forgotten within it counts as white."""
    step_s = session.conditions.step_s
    width = max(1, round(thresholds.sensor_lag_s / step_s))
    count = residual.size // width

    def means(signal: Array) -> Array:
        return np.asarray(signal[: count * width].reshape(count, width).mean(axis=1))

    complete = np.asarray(session.usable[: count * width].reshape(count, width).all(axis=1))
    level = means(residual)
    level = np.where(complete, level - (level[complete].mean() if complete.any() else 0.0), 0.0)
    rate = np.abs(means(session.conditions.rate_per_s))
    return _Blocks(level, complete, means(session.conditions.load), rate, width * step_s)


def _covariance(residual: Array, lags: int) -> Array:
    """(lags + 1,) sums of products up to the slowest memory; gaps count as zeros, which keeps it positive definite."""
    padded = np.concatenate([residual, np.zeros(lags)])
    return np.array([padded[: residual.size] @ padded[k : k + residual.size] for k in range(lags + 1)])


def _autoregression(covariance: Array, count: int) -> Array:
    """(order,) weights of past values, latest first, by Levinson's recursion (1947)."""
    weights, variance = np.zeros(0), float(covariance[0])
    best = count * math.log(variance), weights
    for order in range(1, covariance.size):
        reflected = float(covariance[order] - weights @ covariance[order - 1 : 0 : -1]) / variance
        weights = np.append(weights - reflected * weights[::-1], reflected)
        variance *= max(1.0 - reflected**2, np.finfo(float).eps)
        score = count * math.log(variance) + order * math.log(count)
        if score < best[0]:
            best = score, weights
    return best[1]


def _past_is_known(blocks: _Blocks, order: int) -> Mask:
    """(b,) complete blocks preceded by as many complete ones as predict them."""
    lacking = np.concatenate([np.ones(order), ~blocks.complete])
    return np.asarray(np.convolve(lacking, np.ones(order + 1), "valid") == 0.0)


def _memory_s(weights: Array, lags: int, step_s: float) -> float:
    """The time in which the predictable variance falls to exp(-2) of that one step ahead.

    It is the time constant of first-order noise, with or without white noise; infinite beyond ``lags``.
    """
    impulse = np.zeros(100 * lags)
    impulse[0] = 1.0
    power = np.cumsum(lfilter([1.0], [1.0, *-weights], impulse)[::-1] ** 2)[::-1]  # predictable a step ahead, ...
    fallen = np.flatnonzero(power[1:] <= math.exp(-2.0) * power[1])
    return float(fallen[0]) * step_s if fallen.size and fallen[0] < lags else math.inf


def _correlated_variance(whole: float, one: float, two: float) -> float:
    """Variance of the correlated part, from covariances at lags ``one`` and ``two``, extrapolated to lag zero.

    At most the ``whole`` variance; not extrapolated where the second covariance may be chance.
    """
    return min(one * one / two, whole) if 0.0 < two < one else one


def _lagged(blocks: Sequence[_Blocks], lag: int, thresholds: Thresholds) -> float:
    """Sum of products of blocks ``lag`` apart, or 0 where white noise may make it as large.

    The test holds under any change of the noise's size (White 1980).
    """
    products = np.concatenate([one.residual[lag:] * one.residual[: one.residual.size - lag] for one in blocks])
    found = float(products.sum())
    return found if found > largest_of_noise(1, thresholds) * math.sqrt(float(products @ products)) else 0.0


def _share_while_held(blocks: Sequence[_Blocks], thresholds: Thresholds) -> float:
    """The correlated rms while the load is held, relative to that overall, at most 1."""
    products = np.concatenate([one.residual[1:] * one.residual[:-1] for one in blocks])
    complete = np.concatenate([one.complete[1:] & one.complete[:-1] for one in blocks])
    held = (
        np.concatenate([np.maximum(one.rate[1:], one.rate[:-1]) < thresholds.still_per_s for one in blocks]) & complete
    )
    if held.sum() < thresholds.least_samples or products[complete].mean() <= 0.0:
        return 0.0
    return math.sqrt(min(max(float(products[held].mean() / products[complete].mean()), 0.0), 1.0))


def _kolmogorov(innovations: Array) -> float:
    """Bartlett's test: the largest distance of the cumulative periodogram from the line of white noise, scaled."""
    power = np.abs(np.fft.rfft(innovations))[1:-1] ** 2
    count = power.size
    if count < 2 or not power.any():
        return 0.0
    line = np.arange(1, count + 1) / count
    return float(np.max(np.abs(np.cumsum(power) / power.sum() - line)) * np.sqrt(count))


def _correlation(one: Array, other: Array) -> float:
    """Correlation coefficient; 0 for a constant signal."""
    if np.ptp(one) == 0.0 or np.ptp(other) == 0.0:
        return 0.0
    return float(np.corrcoef(one, other)[0, 1])
