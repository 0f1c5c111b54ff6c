"""Whether what is left over is nothing but noise that remembers: stationary, Gaussian, Markov, deaf to the load.

Slow noise does not average out within a block of seconds, so that it looks like structure. It differs from structure by
what it must be. Any stationary noise is, as nearly as its length tells, an autoregression (Wold 1938; its order by
Schwarz's criterion, 1978), and what that leaves when it predicts the next sample, the innovations, is

*white* (Bartlett 1955, the cumulative periodogram);
*Gaussian*, which a level that switches, a draught and a jump are not: they surprise rarely, and then a lot;
*as large under any load and at any rate*, which friction, seating and a pinched hose are not.

And it forgets: a slow sine and a drift are foretold for longer than any noise is.
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
    """``rms`` of the part with a memory of ``tau_s``, shares of full scale, and what speaks against its being noise.

    ``coloured`` (Kolmogorov's statistic of the innovations' spectrum), ``surprises`` (their kurtosis beyond a normal
    deviate's) and ``follows`` (correlation of their squares with load or its rate, the larger), both in deviations.
    ``flatness`` is the excess kurtosis of the blocks themselves: 0 of noise, -1.5 of a sine, -2 of two levels.
    ``held_rms`` is what ``rms`` is while the load is held.
    """

    rms: float
    tau_s: float
    coloured: float
    surprises: float
    follows: float
    flatness: float
    thresholds: Thresholds
    held_rms: float = 0.0

    @property
    def is_noise(self) -> bool:
        """Whether nothing speaks against noise."""
        return self._would_be_noise and self.follows < self._deviations

    @property
    def beyond_noise(self) -> float:
        """Rms of what is no noise: nothing, all of it, or what it is larger by than while the load is held.

        The last where nothing else speaks against noise: then that is as large under any load.
        """
        if self.is_noise:
            return 0.0
        return math.sqrt(max(self.rms**2 - self.held_rms**2, 0.0)) if self._would_be_noise else self.rms

    @property
    def switches(self) -> bool:
        """Whether it stays at one of two levels, leaves it at once, and does so under any load."""
        # A level that switches at random has the spectrum of first-order noise.
        random = self._is_white and self.follows < self._deviations
        clear = self.thresholds.clear**2
        two_levels = -2.0 * (clear / (clear + 1.0)) ** 2  # excess kurtosis of two, each clear of their mean by noise
        return random and self.surprises > self._deviations and self.flatness < two_levels

    def of_a_mean(self, duration_s: float) -> float:
        """Standard deviation of its mean over ``duration_s``: what a memory covers counts once (Box and Jenkins)."""
        return self.rms * math.sqrt(min(2.0 * self.tau_s / duration_s, 1.0))

    @property
    def _would_be_noise(self) -> bool:
        """Whether it is white, Gaussian and forgets: what seems to remember longer may as well be a drift."""
        forgets = self.tau_s < self.thresholds.lasting_s
        return self._is_white and forgets and abs(self.surprises) < self._deviations

    @property
    def _is_white(self) -> bool:
        """By the tail of Kolmogorov's distribution."""
        return self.coloured < math.sqrt(-0.5 * math.log(0.5 * self.thresholds.false_alarm))

    @property
    def _deviations(self) -> float:
        return largest_of_noise(1, self.thresholds)


@dataclass(frozen=True, eq=False)
class _Blocks:
    """Means over blocks (b,) of one session: residual, 0 where it lacks; load; its rate's size.

    ``there``: nothing in the block is masked.
    """

    residual: Array
    there: Mask
    load: Array
    rate: Array
    step_s: float


def gauss_markov_of(
    sessions: Sequence[Session], residuals: Sequence[Array], thresholds: Thresholds
) -> GaussMarkov | None:
    """What the slow part of ``residuals``, (n,) a session, is made of; None where there is too little to tell."""
    blocks = [_blocks(session, residual, thresholds) for session, residual in zip(sessions, residuals, strict=True)]
    blocks = [one for one in blocks if one.there.any()]
    if not any(one.residual.any() for one in blocks):
        return None
    there = sum(int(one.there.sum()) for one in blocks)
    lags = round(thresholds.lasting_s / thresholds.sensor_lag_s)
    covariance = np.sum([_covariance(one.residual, lags) for one in blocks], axis=0) / there
    weights = _autoregression(covariance, there)
    good = [_past_is_known(one, weights.size) for one in blocks]
    count = sum(int(one.sum()) for one in good)
    largest = largest_of_noise(1, thresholds)
    # In fewer blocks chance makes correlations that would be ones of the same kind.
    if count < (largest / thresholds.same) ** 2:
        return None
    new = [lfilter([1.0, *-weights], [1.0], one.residual) for one in blocks]
    coloured = max(_kolmogorov(np.where(known, one, 0.0)) for one, known in zip(new, good, strict=True))
    square = np.concatenate([one[known] for one, known in zip(new, good, strict=True)]) ** 2
    surprise = float(square.mean())
    square /= surprise
    kurtosis = (float(np.mean(square**2)) - 3.0) / np.sqrt(24.0 / count)
    drives = [
        np.concatenate([one[known] for one, known in zip(drive, good, strict=True)])
        for drive in ([one.load for one in blocks], [one.rate for one in blocks])
    ]
    follows = max(abs(_correlation(one, np.minimum(square, largest**2))) for one in drives) * np.sqrt(count)
    level = np.concatenate([one.residual[one.there] for one in blocks])
    flatness = float(np.mean(level**4) / np.mean(level**2) ** 2) - 3.0
    tau_s = _memory_s(weights, lags, float(np.median([one.step_s for one in blocks])))
    tests = coloured, float(kurtosis), float(follows)
    foretold = max(float(covariance[0]) - surprise, 0.0)
    one, two = (_lagged(blocks, lag, thresholds) / there for lag in (1, 2))
    rms = math.sqrt(max(_remembered(float(covariance[0]), one, two), foretold))
    return GaussMarkov(rms, tau_s, *tests, flatness, thresholds, rms * _share_while_held(blocks, thresholds))


def _blocks(session: Session, residual: Array, thresholds: Thresholds) -> _Blocks:
    """Means over a sensor's lag: what forgets within it counts as white."""
    step_s = session.conditions.step_s
    width = max(1, round(thresholds.sensor_lag_s / step_s))
    count = residual.size // width

    def means(signal: Array) -> Array:
        return np.asarray(signal[: count * width].reshape(count, width).mean(axis=1))

    there = np.asarray(session.usable[: count * width].reshape(count, width).all(axis=1))
    level = means(residual)
    level = np.where(there, level - (level[there].mean() if there.any() else 0.0), 0.0)
    rate = np.abs(means(session.conditions.rate_per_s))
    return _Blocks(level, there, means(session.conditions.load), rate, width * step_s)


def _covariance(residual: Array, lags: int) -> Array:
    """(lags + 1,) sums of products, up to the slowest memory; of a sequence with its gaps, so that it is positive."""
    padded = np.concatenate([residual, np.zeros(lags)])
    return np.array([padded[: residual.size] @ padded[k : k + residual.size] for k in range(lags + 1)])


def _autoregression(covariance: Array, count: int) -> Array:
    """(order,) weights of the past, latest first: Levinson's recursion (1947)."""
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
    """(b,) blocks that are there, with all before them that foretell them: after a gap anything is a surprise."""
    lacking = np.concatenate([np.ones(order), ~blocks.there])
    return np.asarray(np.convolve(lacking, np.ones(order + 1), "valid") == 0.0)


def _memory_s(weights: Array, lags: int, step_s: float) -> float:
    """After how long what can be foretold of a sample has fallen to exp(-2) of its variance a step before.

    The time constant of first-order noise, white noise beside it or not; infinite beyond ``lags``.
    """
    impulse = np.zeros(100 * lags)
    impulse[0] = 1.0
    power = np.cumsum(lfilter([1.0], [1.0, *-weights], impulse)[::-1] ** 2)[::-1]  # foretold a step before, and so on
    fallen = np.flatnonzero(power[1:] <= math.exp(-2.0) * power[1])
    return float(fallen[0]) * step_s if fallen.size and fallen[0] < lags else math.inf


def _remembered(whole: float, one: float, two: float) -> float:
    """Variance of the part that remembers: neighbours' covariance ``one`` step back, as it falls to the next.

    No more than the ``whole`` variance; one step is not led back by a second that noise alone would show.
    """
    return min(one * one / two, whole) if 0.0 < two < one else one


def _lagged(blocks: Sequence[_Blocks], lag: int, thresholds: Thresholds) -> float:
    """Sum of the products of blocks that lie ``lag`` apart, 0 where noise without a memory would make it as large.

    However the noise's loudness changes (White 1980, errors that hold under any heteroscedasticity).
    """
    products = np.concatenate([one.residual[lag:] * one.residual[: one.residual.size - lag] for one in blocks])
    found = float(products.sum())
    return found if found > largest_of_noise(1, thresholds) * math.sqrt(float(products @ products)) else 0.0


def _share_while_held(blocks: Sequence[_Blocks], thresholds: Thresholds) -> float:
    """By what share (rms, at most 1) neighbours move together while the load is held, of what they do on the whole."""
    products = np.concatenate([one.residual[1:] * one.residual[:-1] for one in blocks])
    there = np.concatenate([one.there[1:] & one.there[:-1] for one in blocks])
    held = np.concatenate([np.maximum(one.rate[1:], one.rate[:-1]) < thresholds.still_per_s for one in blocks]) & there
    if held.sum() < thresholds.least_samples or products[there].mean() <= 0.0:
        return 0.0
    return math.sqrt(min(max(float(products[held].mean() / products[there].mean()), 0.0), 1.0))


def _kolmogorov(innovations: Array) -> float:
    """Bartlett's test: how far the cumulative periodogram is from white noise's straight line."""
    power = np.abs(np.fft.rfft(innovations))[1:-1] ** 2
    count = power.size
    if count < 2 or not power.any():
        return 0.0
    line = np.arange(1, count + 1) / count
    return float(np.max(np.abs(np.cumsum(power) / power.sum() - line)) * np.sqrt(count))


def _correlation(one: Array, other: Array) -> float:
    if np.ptp(one) == 0.0 or np.ptp(other) == 0.0:
        return 0.0
    return float(np.corrcoef(one, other)[0, 1])
