"""What a model leaves over: how much of it is structure and how much noise, judged without any model of the structure.

Two tests, since an unknown effect shows in either:

*repeating*: the products of a cycle's residual with its repeats' (cycles of one rate and height). Noise of different
cycles is independent whatever its colour, so that their mean is the variance of what repeats.

*slow*: means over blocks of a few seconds against what noise of the residual's own fast part would give. A step in
gain, a slow walk, a random telegraph repeat with no cycle, but they do not average out within a block either.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.optimize import nnls
from scipy.special import stdtrit

from smartshoe.arrays import Array, Mask
from smartshoe.diagnosis._session import Session
from smartshoe.integrity.thresholds import Thresholds
from smartshoe.signals.noise import NORMAL_QUARTILE, autocovariance

# Resolutions: half and twice of each changed no name in two cases.
COLOURS = 5  # time constants of the noise's coloured part
PLACES = 64  # of a cycle, when repeats are laid over each other


@dataclass(frozen=True, slots=True)
class LackOfFit:
    """``rms`` of the structure over the record, shares of full scale (0 where its variance comes out negative).

    ``z`` is its score against noise alone, from ``pairs`` of repeats or as many blocks; ``variance_sd`` the standard
    deviation of its variance under noise alone. ``significant``: noise that is known by so many hardly reaches it
    (Student's t).
    """

    rms: float
    z: float
    pairs: int
    thresholds: Thresholds
    variance_sd: float = math.inf

    @property
    def significant(self) -> bool:
        return self.pairs > 1 and self.z > self._largest_of_noise

    def would_show(self, rms: float) -> bool:
        """Whether structure of this ``rms`` would be significant: where it would not, none is no proof of noise."""
        return self.pairs > 1 and rms**2 > self._largest_of_noise * self.variance_sd

    @property
    def _largest_of_noise(self) -> float:
        return -float(stdtrit(self.pairs - 1, 0.5 * self.thresholds.false_alarm))


def repeating(sessions: Sequence[Session], residuals: Sequence[Array], thresholds: Thresholds) -> LackOfFit:
    """Structure that repeats from cycle to cycle: its power in each kind of cycle, over the record."""
    power = variance = 0.0
    pairs = 0
    for rows, share in repeats(sessions, residuals, thresholds.cycle):
        count, places = rows.shape
        pair_count = count * (count - 1) // 2
        # Over all pairs, products add up to the sum's square less the squares.
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
    """The residual over each kind of load cycle that comes back, (repeats, places), and over the rest after it.

    `PLACES` while the unit is loaded, and as many a second at rest, for as long as it rests after each of the kind.
    Cycles of a kind differ by a share ``alike`` at most, in height, duration and course: random loads of one height
    repeat nothing. And the share of all samples that are within cycles of the kind: elsewhere nothing tells what
    repeats.
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
            # A reading at its rail is as wrong each time: of what is masked nothing is left over.
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
    """The rows of cycles of a kind, and their share of ``total`` samples."""
    rest_s = min(one.rest_s for one in kind)
    at_rest = round(PLACES * rest_s / kind[0].duration_s)
    share = sum(one.size + rest_s / one.step_s for one in kind) / total
    return np.stack([one.row(rest_s, at_rest) for one in kind]), share


class _LoadCycle(NamedTuple):
    """``peak`` load and ``course`` (PLACES,) of the ``size`` samples that are clear of rest; ``rest_s`` that follows.

    ``residual`` (n,) at ``time_s`` (n,) from where it is clear of rest.
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
        return (self.size - 1) * self.step_s

    def row(self, rest_s: float, at_rest: int) -> Array:
        """The residual at `PLACES` while loaded and ``at_rest`` more over ``rest_s``."""
        loaded_s = np.linspace(0.0, self.duration_s, PLACES)
        at_rest_s = self.duration_s + np.linspace(0.0, rest_s, at_rest + 1)[1:]
        return np.asarray(np.interp(np.concatenate([loaded_s, at_rest_s]), self.time_s, self.residual))

    def is_like(self, other: _LoadCycle, alike: float) -> bool:
        """Whether it differs from another by a share ``alike`` at most."""
        if abs(self.peak - other.peak) > alike * abs(other.peak):
            return False
        if abs(self.duration_s - other.duration_s) > alike * abs(other.duration_s):
            return False
        return float(np.std(self.course - other.course)) <= alike * float(np.std(other.course))


def slow(sessions: Sequence[Session], residuals: Sequence[Array], thresholds: Thresholds) -> LackOfFit:
    """Structure in the means of blocks of ``lasting_s``, beyond what the noise of the faster part would leave there."""
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
        # The blocks' own scatter, and that the noise is known from them to some percent only.
        spread += 2.0 * float(expected @ expected) + (thresholds.same * float(expected.sum())) ** 2
    if not excess:
        return LackOfFit(0.0, 0.0, 0, thresholds)
    mean = float(np.mean(excess))
    sd = max(float(np.sqrt(spread)) / len(excess), 1e-300)
    return LackOfFit(float(np.sqrt(max(mean, 0.0))), mean / sd, len(excess), thresholds, sd)


def _quiet(rows: Array) -> Mask:
    """(blocks,) the nine tenths with the least power: a block with a step in it tells nothing of noise."""
    power = np.sum((rows - rows.mean(axis=1, keepdims=True)) ** 2, axis=1)
    return np.asarray(power <= np.quantile(power, 0.9))


def _loudness(rows: Array, clear: float) -> Array:
    """(blocks,) noise power of each block over that of the quiet ones, by differences of neighbours.

    Noise that grows with load or slope is no structure; and structure hardly shows from one sample to the next.
    """
    fast = np.abs(np.diff(rows, axis=1))
    # One jump in a block is no loud noise: as much as is clear of the standard deviation, by the median.
    fast = np.mean(np.minimum(fast, clear / NORMAL_QUARTILE * np.median(fast, axis=1, keepdims=True)) ** 2, axis=1)
    usual = float(fast[_quiet(rows)].mean())
    return np.asarray(fast / usual) if usual > 0.0 else np.ones(fast.size)


def _mean_variance(centred: Array, step_s: float, thresholds: Thresholds) -> float:
    """Variance of a block's mean under noise, white and first-order, that fits the ``centred`` (blocks, width).

    Taking a block's mean out changes every covariance; so the fit is to covariances that were changed in the same way.
    """
    width = centred.shape[1]
    lags = np.arange(width // 2)
    rows = centred[_quiet(centred)]
    found = autocovariance(rows)[lags] / (rows.shape[0] * (width - lags))
    white, of_mean = _centred(np.eye(1, width)[0])
    best: tuple[float, float] | None = None
    # A few of the slowest go into a block: what is slower counts as structure.
    for tau_s in np.geomspace(thresholds.echo_s, thresholds.lasting_s / thresholds.few, COLOURS):
        coloured, slow_of_mean = _centred(np.exp(-np.arange(width) * (step_s / tau_s)))
        (w, c), off = nnls(np.column_stack([white, coloured]), found)
        if best is None or off < best[0]:
            best = off, w * of_mean + c * slow_of_mean
    return best[1] if best else 0.0


def _centred(covariance: Array) -> tuple[Array, float]:
    """Of noise with the ``covariance`` (w,) at each lag: that of a block of w less its mean, and the mean's variance.

    The former (w // 2,), averaged over the block's places: each place's with the mean is taken out twice, and the
    mean's variance put back.
    """
    width = covariance.size
    lags = np.arange(width // 2)
    sums = np.cumsum(covariance)
    with_mean = (sums + sums[::-1] - covariance[0]) / width
    of_mean = float(with_mean.mean())
    return covariance[lags] - 2.0 * np.cumsum(with_mean)[width - 1 - lags] / (width - lags) + of_mean, of_mean
