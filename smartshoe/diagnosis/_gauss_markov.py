"""Whether what is left over is nothing but noise that remembers: stationary, Gaussian, first-order, deaf to the load.

Slow noise does not average out within a block of seconds, so that it looks like structure. It differs from structure by
what it must be. White and first-order noise together are an autoregressive moving average of order one (Granger and
Morris 1976), and what it leaves when it predicts the next sample, the innovations, is

*white*, which a slow sine, a drift and a step are not (Bartlett 1955, the cumulative periodogram);
*Gaussian*, which a level that switches, a draught and a jump are not: they surprise rarely, and then a lot;
*as large under any load and at any rate*, which friction, seating and a pinched hose are not.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter
from scipy.special import ndtri

from smartshoe.arrays import Array, Mask
from smartshoe.diagnosis._session import Session

BLOCK_S = 0.2  # means over it: what forgets within it counts as white
SLOWEST_S = 5.0  # memory; what seems to remember longer may as well be a drift
MEMORIES_S = np.geomspace(0.5 * BLOCK_S, SLOWEST_S, 18)
# Means of first-order noise over blocks have 0.27 at most, white noise beside it lowers it, windows raise it.
MOVING_AVERAGES = np.linspace(-0.98, 0.5, 38)
SETTLED = 5  # blocks
FEWEST = 300  # blocks: below, the tests tell little
JUMPS = 10.0  # the same: far more than a model's small errors at corners bring about
TWO_LEVELS = -1.0  # excess kurtosis: of two levels that lie three standard deviations of the noise apart
CUT = 9.0  # squares of innovations, in variances: so that one jump is no trend with load


@dataclass(frozen=True, slots=True)
class GaussMarkov:
    """``rms`` of the part with a memory of ``tau_s``, shares of full scale, and what speaks against its being noise.

    ``coloured`` (Kolmogorov's statistic of the innovations' spectrum), ``surprises`` (their kurtosis beyond a normal
    deviate's) and ``follows`` (correlation of their squares with load or its rate, the larger), both in deviations.
    ``flatness`` is the excess kurtosis of the blocks themselves: 0 of noise, -1.5 of a sine, -2 of two levels.
    ``false_alarm``: chance at which noise fails one of the tests.
    """

    rms: float
    tau_s: float
    coloured: float
    surprises: float
    follows: float
    flatness: float
    false_alarm: float

    @property
    def is_noise(self) -> bool:
        """Whether nothing speaks against noise."""
        return self._is_white and self.tau_s < SLOWEST_S and max(abs(self.surprises), self.follows) < self._deviations

    @property
    def switches(self) -> bool:
        """Whether it stays at one of two levels, leaves it at once, and does so under any load."""
        # A level that switches at random has the spectrum of first-order noise.
        random = self._is_white and self.follows < self._deviations
        return random and self.surprises > JUMPS and self.flatness < TWO_LEVELS

    @property
    def _is_white(self) -> bool:
        """By the tail of Kolmogorov's distribution."""
        return self.coloured < math.sqrt(-0.5 * math.log(0.5 * self.false_alarm))

    @property
    def _deviations(self) -> float:
        return -float(ndtri(0.5 * self.false_alarm))


@dataclass(frozen=True, eq=False)
class _Blocks:
    """Means over blocks (b,) of one session: residual, 0 where it lacks; load; its rate's size.

    ``good`` ones are there, and so are those just before: what comes after a gap is a surprise to any filter.
    """

    residual: Array
    good: Mask
    load: Array
    rate: Array
    step_s: float


def gauss_markov_of(sessions: Sequence[Session], residuals: Sequence[Array], false_alarm: float) -> GaussMarkov | None:
    """What the slow part of ``residuals``, (n,) a session, is made of; None where there is too little to tell."""
    blocks = [_blocks(session, residual) for session, residual in zip(sessions, residuals, strict=True)]
    blocks = [one for one in blocks if one.good.any()]
    count = sum(int(one.good.sum()) for one in blocks)
    if count < FEWEST or not any(one.residual.any() for one in blocks):
        return None
    powers = np.stack([_powers(blocks, float(theta)) for theta in MOVING_AVERAGES], axis=1)
    t, m = np.unravel_index(int(np.argmin(powers)), powers.shape)
    tau_s, theta, power = float(MEMORIES_S[t]), float(MOVING_AVERAGES[m]), float(powers[t, m])
    variance = power / count
    step_s = float(np.median([one.step_s for one in blocks]))
    phi = float(np.exp(-step_s / tau_s))
    whole = variance * (1.0 + 2.0 * phi * theta + theta**2) / (1.0 - phi**2)
    remembered = max(whole + theta * variance / phi, 0.0)  # the covariance of neighbours, one step back
    surprises, squares, drives, coloured = [], [], [], 0.0
    for one in blocks:
        innovations = _innovations(one, tau_s, theta)
        coloured = max(coloured, _kolmogorov(innovations))
        square = innovations[one.good] ** 2 / variance
        surprises.append(square**2)
        squares.append(np.minimum(square, CUT))
        drives.append(np.stack([one.load[one.good], one.rate[one.good]]))
    kurtosis = (float(np.mean(np.concatenate(surprises))) - 3.0) / np.sqrt(24.0 / count)
    drive, size = np.concatenate(drives, axis=1), np.concatenate(squares)
    follows = max(abs(_correlation(one, size)) for one in drive) * np.sqrt(count)
    level = np.concatenate([one.residual[one.good] for one in blocks])
    flatness = float(np.mean(level**4) / np.mean(level**2) ** 2) - 3.0
    tests = coloured, float(kurtosis), float(follows)
    return GaussMarkov(float(np.sqrt(remembered)), tau_s, *tests, flatness, false_alarm)


def _blocks(session: Session, residual: Array) -> _Blocks:
    step_s = session.conditions.step_s
    width = max(1, round(BLOCK_S / step_s))
    count = residual.size // width

    def means(signal: Array) -> Array:
        return np.asarray(signal[: count * width].reshape(count, width).mean(axis=1))

    good = np.asarray(session.usable[: count * width].reshape(count, width).all(axis=1))
    level = means(residual)
    level = np.where(good, level - (level[good].mean() if good.any() else 0.0), 0.0)
    # As many before as there were blocks in one second; a moving average forgets the start by then.
    lacking = np.concatenate([np.ones(SETTLED), ~good])
    good = np.convolve(lacking, np.ones(SETTLED + 1), "valid") == 0.0
    rate = np.abs(means(session.conditions.rate_per_s))
    return _Blocks(level, good, means(session.conditions.load), rate, width * step_s)


def _innovations(blocks: _Blocks, tau_s: float, theta: float) -> Array:
    """(b,) what is new in each block, 0 where its past is not known."""
    phi = float(np.exp(-blocks.step_s / tau_s))
    return np.where(blocks.good, lfilter([1.0, -phi], [1.0, theta], blocks.residual), 0.0)


def _powers(blocks: Sequence[_Blocks], theta: float) -> Array:
    """(memories,) power of the `_innovations`, a parabola in phi: e = v - phi w, w being v a block later."""
    power = np.zeros(MEMORIES_S.size)
    for one in blocks:
        v = lfilter([1.0], [1.0, theta], one.residual)
        now, before = v[one.good], np.concatenate([[0.0], v[:-1]])[one.good]
        phi = np.exp(-one.step_s / MEMORIES_S)
        power += now @ now - 2.0 * phi * (now @ before) + phi**2 * (before @ before)
    return power


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
