"""Tests of lack of fit: how much of a residual is structure and how much noise, without any model of the structure.

There are two, since an unknown effect shows in either:

*repeating*: products of a load cycle's residual with those of its repeats (cycles of equal rate and height). Noise of
different cycles is independent whatever its colour, so that the mean product is the variance that repeats.

*slow*: means over blocks of a few seconds, compared with what noise of the residual's fast part would give. A step in
gain, a slow walk or a random telegraph does not repeat with a cycle, but does not average out within a block either.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.optimize import nnls

from smartshoe.arrays import Array, Index, Mask
from smartshoe.diagnosis._sensitivity import ridged
from smartshoe.diagnosis._session import Session
from smartshoe.integrity.thresholds import Thresholds, largest_of_noise
from smartshoe.signals.noise import NORMAL_QUARTILE, autocovariance

# Resolutions. Half and twice of each changed no name in two cases.
COLOURS = 5  # time constants of the noise's coloured part
PLACES = 64  # samples of a cycle at which repeats are compared
TAPS = 64  # of a filter of the load
RIDGE = 1e-6  # share of the taps' power, under which a filter's weights are not told


@dataclass(frozen=True, slots=True)
class LackOfFit:
    """The result of a test: ``rms`` of the structure, a share of full scale (0 where its variance is negative).

    ``z`` is its score against noise, from ``pairs`` of repeats or as many blocks, and ``variance_sd`` the standard
    deviation of its variance under noise. ``significant``: the score exceeds Student's t at the false-alarm level.
    """

    rms: float
    z: float
    pairs: int
    thresholds: Thresholds
    variance_sd: float = math.inf

    @property
    def significant(self) -> bool:
        """Whether noise hardly reaches this score, by Student's t."""
        return self.pairs > 1 and self.z > self._largest_of_noise

    def would_detect(self, rms: float) -> bool:
        """Whether structure of this ``rms`` would be significant; if not, finding none does not prove noise."""
        return self.pairs > 1 and rms**2 > self._largest_of_noise * self.variance_sd

    @property
    def _largest_of_noise(self) -> float:
        """The score that noise reaches with the probability of a false alarm."""
        return largest_of_noise(1, self.thresholds, self.pairs - 1)


def repeating_structure(sessions: Sequence[Session], residuals: Sequence[Array], thresholds: Thresholds) -> LackOfFit:
    """Structure that repeats from load cycle to load cycle: its power in each kind of cycle, over the record."""
    power = variance = 0.0
    pairs = 0
    for rows, share in repeats(sessions, residuals, thresholds.cycle):
        count, places = rows.shape
        pair_count = count * (count - 1) // 2
        # The sum of products over all pairs is half of the squared sum less the sum of squares.
        mean = (float(np.sum(rows.sum(axis=0) ** 2)) - float(np.sum(rows**2))) / (2 * pair_count * places)
        # Spread of a product of independent noises, from the rows' own autocovariance about their mean.
        auto = autocovariance(rows - rows.mean(axis=0)) / (places * (count - 1))
        fewer = 1 - np.arange(1, auto.size) / auto.size
        spread = (auto[0] ** 2 + 2 * np.sum(fewer * auto[1:] ** 2)) / auto.size
        power += share * mean
        variance += share**2 * spread / pair_count
        pairs += pair_count
    if not pairs:
        return LackOfFit(0.0, 0.0, 0, thresholds)
    sd = max(float(np.sqrt(variance)), 1e-300)
    return LackOfFit(float(np.sqrt(max(power, 0.0))), power / sd, pairs, thresholds, sd)


def repeats(sessions: Sequence[Session], residuals: Sequence[Array], alike: float) -> list[tuple[Array, float]]:
    """For each kind of load cycle that repeats: residuals (repeats, places), and the share of samples in such cycles.

    There are `PLACES` samples while the unit is loaded, and equally dense ones over the rest that follows each of them.
    Cycles of a kind differ by a share ``alike`` at most in height, duration and course: random loads of equal height
    repeat nothing.
    """
    found: list[_LoadCycle] = []
    total = 0
    for session, residual in zip(sessions, residuals, strict=True):
        load = session.conditions.load
        total += load.size
        low, tall = float(load.min()), 0.1 * float(np.ptp(load))
        starts = np.flatnonzero(np.diff(session.cycle, prepend=-1))
        for start, part in zip(starts, np.split(load, starts[1:]), strict=True):
            stop = int(start) + part.size
            peak = float(part.max())
            inside = np.flatnonzero(part > low + 0.1 * (peak - low)) if peak - low > tall else np.zeros(0, dtype=int)
            if inside.size < 8:
                continue
            first, last = int(start + inside[0]), int(start + inside[-1])
            usable = np.flatnonzero(session.usable[first:stop])
            loaded = int(np.searchsorted(usable, last + 1 - first))
            if loaded < 0.9 * (last + 1 - first):
                continue
            # Masked samples are left out: a reading at its rail is wrong in the same way each time.
            there, step_s = first + usable, session.conditions.step_s
            course = np.interp(np.linspace(0, last - first, PLACES), usable[:loaded], load[there[:loaded]])
            rest_s = (stop - 1 - last) * step_s if usable.size - loaded >= 0.9 * (stop - 1 - last) else 0.0
            time_s = np.asarray(usable * step_s, dtype=np.float64)
            found.append(_LoadCycle(peak, course, step_s, last + 1 - first, time_s, residual[there], rest_s))
    kinds: list[list[_LoadCycle]] = []
    for one in found:
        for kind in kinds:
            if one.is_like(kind[0], alike):
                kind.append(one)
                break
        else:
            kinds.append([one])
    return [_laid_over(kind, total) for kind in kinds if len(kind) > 1]


def _laid_over(kind: Sequence[_LoadCycle], total: int) -> tuple[Array, float]:
    """The residuals (repeats, places) of cycles of a kind, and their share of ``total`` samples."""
    rest_s = min(one.rest_s for one in kind)
    at_rest = round(PLACES * rest_s / kind[0].duration_s)
    share = sum(one.size + rest_s / one.step_s for one in kind) / total
    return np.stack([one.row(rest_s, at_rest) for one in kind]), share


class _LoadCycle(NamedTuple):
    """A load cycle: ``peak`` load and ``course`` (PLACES,) of the ``size`` loaded samples; ``rest_s`` that follows.

    ``residual`` (n,) is given at ``time_s`` (n,) from the first loaded sample.
    """

    peak: float
    course: Array
    step_s: float
    size: int
    time_s: Array
    residual: Array
    rest_s: float

    @property
    def duration_s(self) -> float:
        """The time in s under load."""
        return (self.size - 1) * self.step_s

    def row(self, rest_s: float, at_rest: int) -> Array:
        """The residual at `PLACES` while loaded, and at ``at_rest`` more places over ``rest_s``."""
        loaded_s = np.linspace(0.0, self.duration_s, PLACES)
        at_rest_s = self.duration_s + np.linspace(0.0, rest_s, at_rest + 1)[1:]
        return np.asarray(np.interp(np.concatenate([loaded_s, at_rest_s]), self.time_s, self.residual))

    def is_like(self, other: _LoadCycle, alike: float) -> bool:
        """Whether it differs from another cycle by a share ``alike`` at most."""
        if abs(self.peak - other.peak) > alike * abs(other.peak):
            return False
        if abs(self.duration_s - other.duration_s) > alike * abs(other.duration_s):
            return False
        return float(np.std(self.course - other.course)) <= alike * float(np.std(other.course))


def slow_structure(sessions: Sequence[Session], residuals: Sequence[Array], thresholds: Thresholds) -> LackOfFit:
    """Structure in the means of blocks of ``lasting_s``, beyond what noise of the faster part would leave there."""
    excess: list[float] = []
    spread = 0.0
    for session, residual in zip(sessions, residuals, strict=True):
        step_s = session.conditions.step_s
        width = max(4, round(thresholds.lasting_s / step_s))
        count = residual.size // width
        if count < thresholds.few:
            continue
        mask = session.usable[: count * width].reshape(count, width)
        rows = residual[: count * width].reshape(count, width)[mask.all(axis=1)]
        if rows.shape[0] < thresholds.few:
            continue
        means = rows.mean(axis=1)
        expected = _mean_variance(rows - means[:, None], step_s, thresholds) * _loudness(rows, thresholds.clear)
        excess += list(means**2 - expected)
        # The scatter of the blocks, and the uncertainty of the noise estimated from them.
        spread += 2.0 * float(expected @ expected) + (thresholds.same * float(expected.sum())) ** 2
    if not excess:
        return LackOfFit(0.0, 0.0, 0, thresholds)
    mean = float(np.mean(excess))
    sd = max(float(np.sqrt(spread)) / len(excess), 1e-300)
    return LackOfFit(float(np.sqrt(max(mean, 0.0))), mean / sd, len(excess), thresholds, sd)


def predicted_structure(sessions: Sequence[Session], residuals: Sequence[Array], thresholds: Thresholds) -> LackOfFit:
    """Structure that a linear filter of the load predicts: a response that rings, or lags, as the model does not.

    Noise is independent of past inputs (Ljung 1999, residual analysis). The filter, a finite impulse response within
    which any sensor's lag is over, is fitted to one half of each recording and predicts the other, so that chance gains
    nothing. The score is that of the ratio of squares with and without it, in its logarithm, over blocks of ``hold_s``.
    """
    parts = [
        (one, _increments(one, thresholds.clear * thresholds.settled_s), residual, _halves(one))
        for one, residual in zip(sessions, residuals, strict=True)
        if one.fitted.any()
    ]
    squares: list[tuple[float, float, int]] = []  # of each block: without, with, samples
    for fitted, other in ((0, 1), (1, 0)):
        gram, right = np.zeros((TAPS, TAPS)), np.zeros(TAPS)
        for _, columns, residual, half in parts:
            rows = columns[half[fitted]]
            gram += rows.T @ rows
            right += rows.T @ residual[half[fitted]]
        weights = np.linalg.solve(ridged(gram, RIDGE), right)
        for session, columns, residual, half in parts:
            width = max(round(thresholds.hold_s / session.conditions.step_s), 1)
            for at in np.split(half[other], range(width, half[other].size, width)):
                left, predicted = residual[at], columns[at] @ weights
                squares.append((float(left @ left), float((left - predicted) @ (left - predicted)), at.size))
    without, remaining, counts = np.array([one for one in squares if min(one) > 0]).reshape(-1, 3).T
    if without.size < thresholds.few:
        return LackOfFit(0.0, 0.0, 0, thresholds)
    gains = np.log(without / remaining)
    sd = max(float(gains.std(ddof=1)), 1e-300) / math.sqrt(gains.size)
    power = float(np.sum(without - remaining) / counts.sum())
    return LackOfFit(math.sqrt(max(power, 0.0)), float(gains.mean()) / sd, gains.size, thresholds)


def _increments(session: Session, reach_s: float) -> Array:
    """(n, `TAPS`) increments of the load over the last ``reach_s``, one for each tap; 0 before the recording."""
    load, step_s = session.conditions.load, session.conditions.step_s
    places = np.arange(load.size)[:, None] - np.arange(TAPS + 1) * (reach_s / TAPS / step_s)
    delayed = np.interp(places, np.arange(load.size), load)
    return np.asarray(delayed[:, :-1] - delayed[:, 1:])


def _halves(session: Session) -> tuple[Index, Index]:
    """The fitted samples of each half of a recording."""
    at = np.flatnonzero(session.fitted)
    return at[at < session.fitted.size // 2], at[at >= session.fitted.size // 2]


def _quiet_blocks(rows: Array) -> Mask:
    """(blocks,) True for the nine tenths with the least power: a block with a step in it does not show the noise."""
    power = np.sum((rows - rows.mean(axis=1, keepdims=True)) ** 2, axis=1)
    return np.asarray(power <= np.quantile(power, 0.9))


def _loudness(rows: Array, clear: float) -> Array:
    """(blocks,) noise power of each block relative to that of the quiet ones, by differences of neighbours.

    Noise that grows with load or slope is not structure, and structure hardly shows from sample to sample.
    """
    fast = np.abs(np.diff(rows, axis=1))
    # A single jump in a block is not loud noise: differences are clipped at a multiple of their standard deviation,
    # estimated by the median.
    fast = np.mean(np.minimum(fast, clear / NORMAL_QUARTILE * np.median(fast, axis=1, keepdims=True)) ** 2, axis=1)
    usual = float(fast[_quiet_blocks(rows)].mean())
    return np.asarray(fast / usual) if usual > 0.0 else np.ones(fast.size)


def _mean_variance(centred: Array, step_s: float, thresholds: Thresholds) -> float:
    """Variance of a block's mean under white and first-order noise fitted to the ``centred`` blocks (blocks, width).

    Removing a block's mean changes every covariance, so that the fit is to covariances changed in the same way.
    """
    width = centred.shape[1]
    lags = np.arange(width // 2)
    rows = centred[_quiet_blocks(centred)]
    found = autocovariance(rows)[lags] / (rows.shape[0] * (width - lags))
    white, of_mean = _centred(np.eye(1, width)[0])
    best: tuple[float, float] | None = None
    # A block holds a few of the slowest time constants; what is slower counts as structure.
    for tau_s in np.geomspace(thresholds.echo_s, thresholds.lasting_s / thresholds.few, COLOURS):
        coloured, slow_of_mean = _centred(np.exp(-np.arange(width) * (step_s / tau_s)))
        (w, c), off = nnls(np.column_stack([white, coloured]), found)
        if best is None or off < best[0]:
            best = off, w * of_mean + c * slow_of_mean
    return best[1] if best else 0.0


def _centred(covariance: Array) -> tuple[Array, float]:
    """The covariance (w // 2,) of noise less its mean over a block of w, and the variance of that mean.

    ``covariance`` (w,) is that of the noise at each lag. The result is averaged over the block: the covariance with the
    mean is subtracted twice, and the variance of the mean added.
    """
    width = covariance.size
    lags = np.arange(width // 2)
    sums = np.cumsum(covariance)
    with_mean = (sums + sums[::-1] - covariance[0]) / width
    of_mean = float(with_mean.mean())
    return covariance[lags] - 2.0 * np.cumsum(with_mean)[width - 1 - lags] / (width - lags) + of_mean, of_mean
