"""Errors of a model on data that it was not fitted to, at the full rate; gains and their intervals."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from sys import float_info

import numpy as np
from scipy.special import stdtrit

from smartshoe.arrays import Array
from smartshoe.diagnosis._own_terms import residual_of
from smartshoe.diagnosis._scale import Scale
from smartshoe.diagnosis._session import Session
from smartshoe.integrity.thresholds import Thresholds
from smartshoe.models.extended import ExtendedModel
from smartshoe.models.parameter import finite_or_none


@dataclass(frozen=True, eq=False)
class Errors:
    """Squared errors of the simulation by held-out load cycle: ``squares`` and ``counts`` (cycles,).

    ``spread`` is the standard deviation of the held-out reading about each recording's mean. Without held-out data
    there are no cycles, and every figure is NaN.
    """

    squares: Array
    counts: Array
    spread: float

    @property
    def is_empty(self) -> bool:
        """Whether nothing was held out that could be used."""
        return not self.counts.size

    @property
    def rmse(self) -> float:
        """Root mean square error, share of full scale."""
        return math.nan if self.is_empty else float(np.sqrt(self.squares.sum() / self.counts.sum()))

    @property
    def fit_percent(self) -> float:
        """100 (1 - norm of the error / norm of the reading about its mean)."""
        return 100.0 * (1.0 - self.rmse / self.spread) if self.spread != 0.0 else 0.0

    @property
    def variance_explained_percent(self) -> float:
        """100 (1 - variance of the error / variance of the reading)."""
        return 100.0 * (1.0 - (self.rmse / self.spread) ** 2) if self.spread != 0.0 else 0.0


def errors(sessions: Sequence[Session], model: ExtendedModel) -> Errors:
    """The errors of ``model`` over the held-out samples."""
    squares: list[Array] = []
    counts: list[Array] = []
    spread, samples = 0.0, 0
    for session in sessions:
        judged = session.judged
        if not judged.any():
            continue
        residual = residual_of(session, model)
        cycle = session.cycle[judged]
        number = int(session.cycle[-1]) + 1
        squares.append(np.bincount(cycle, residual[judged] ** 2, number).astype(np.float64))
        counts.append(np.bincount(cycle, minlength=number).astype(np.float64))
        values = session.reading[judged]
        spread += float(np.sum((values - values.mean()) ** 2))
        samples += values.size
    if not squares:
        return Errors(np.zeros(0), np.zeros(0), math.nan)
    joined, number_of = np.concatenate(squares), np.concatenate(counts)
    return Errors(joined[number_of > 0], number_of[number_of > 0], float(np.sqrt(spread / samples)))


@dataclass(frozen=True, slots=True)
class Gain:
    """Errors before and after in ``unit``, and by how many percent the error falls, with its 95 % interval.

    With one cycle there is no interval, and it is the gain itself. ``is_certain``: the error falls, or grows, beyond
    chance and over more than a few cycles. ``is_loss``: it grows so, by more than is material.
    """

    rmse_before: float
    rmse_after: float
    unit: str
    gain_percent: float
    ci95: tuple[float, float]
    is_loss: bool = False
    is_certain: bool = False

    def certain_gain(self, scale: Scale) -> float:
        """Rms, a share of full scale, that is removed for certain; else 0."""
        return _rms_excess(self.rmse_before, self.rmse_after, scale) if self.is_certain else 0.0

    def growth(self, scale: Scale) -> float:
        """Rms, a share of full scale, by which the error grows, certain or not; else 0."""
        return _rms_excess(self.rmse_after, self.rmse_before, scale)

    @property
    def is_rejected(self) -> bool:
        """Whether the error grows at all: a model that is worse on data it was not fitted to is not adopted."""
        return self.rmse_after > self.rmse_before

    def to_dict(self) -> dict[str, object]:
        """The contract's ``held_out``."""
        return {
            "rmse_before": finite_or_none(self.rmse_before),
            "rmse_after": finite_or_none(self.rmse_after),
            "unit": self.unit,
            "gain_percent": finite_or_none(self.gain_percent),
            "ci95": [finite_or_none(bound) for bound in self.ci95],
        }


def _rms_excess(more: float, less: float, scale: Scale) -> float:
    """Rms, a share of full scale, of the difference of the squares; 0 where ``more`` is not the larger."""
    square = more**2 - less**2
    return math.sqrt(square) / abs(scale.reading) if square > 0.0 else 0.0


def gain(before: Errors, after: Errors, scale: Scale, thresholds: Thresholds) -> Gain:
    """The gain of ``after`` over ``before``, its interval by the jackknife over load cycles and Student's t.

    The jackknife is of the logarithm of the errors' ratio (Efron and Tibshirani 1993). A bootstrap of few cycles is too
    narrow: two that agree by chance show a certain loss in one case of four.
    """
    unit, span = scale.unit.symbol, abs(scale.reading)
    if before.is_empty:
        return Gain(math.nan, math.nan, unit, math.nan, (math.nan, math.nan))
    n = before.squares.size
    total = _log_ratio(before.squares.sum(), after.squares.sum())
    low = high = total
    if n > 1:
        without = _log_ratio(before.squares.sum() - before.squares, after.squares.sum() - after.squares)
        sd = float(np.sqrt((n - 1) * np.var(without)))
        reach = -float(stdtrit(n - 1, 0.025)) * sd
        low, high = total - reach, total + reach
    ci95 = float(_percent(high)), float(_percent(low))
    grows = after.rmse - before.rmse > thresholds.material
    is_certain = n >= thresholds.few and ci95[0] * ci95[1] > 0.0
    is_loss = bool(grows and ci95[1] < 0.0 and is_certain)
    return Gain(before.rmse * span, after.rmse * span, unit, float(_percent(total)), ci95, is_loss, is_certain)


def _log_ratio(before: Array | float, after: Array | float) -> Array:
    """Logarithm of the ratio of two squared errors, ``after`` over ``before``; zero counts as the smallest float."""
    return np.asarray(np.log(np.maximum(after, float_info.min) / np.maximum(before, float_info.min)))


def _percent(log_ratio: Array | float) -> Array:
    """By how many percent an error falls, from the log ratio of its squares; bounded, to stay a finite number."""
    most = -0.5 * math.log(float_info.min)
    return np.asarray(100.0 * (1.0 - np.exp(np.minimum(0.5 * np.asarray(log_ratio), most))))
