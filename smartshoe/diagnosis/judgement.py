"""What a model is worth on data that it was not fitted to: errors at the full rate, and their intervals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from smartshoe.diagnosis.session import Scale, Session
from smartshoe.models.extended import ExtendedModel

Array = NDArray[np.float64]

RESAMPLED = 400


@dataclass(frozen=True, eq=False)
class Errors:
    """Squared errors of the simulated reading by held-out load cycle: ``squares`` and ``counts`` (cycles,)."""

    squares: Array
    counts: Array
    spread: float

    @property
    def rmse(self) -> float:
        """Root mean square error, share of full scale."""
        return float(np.sqrt(self.squares.sum() / max(float(self.counts.sum()), 1.0)))

    @property
    def fit_percent(self) -> float:
        """100 (1 - error's norm over the reading's about its mean)."""
        return 100.0 * (1.0 - self.rmse / self.spread) if self.spread > 0 else 0.0


def errors(sessions: Sequence[Session], model: ExtendedModel) -> Errors:
    """The errors over what is held out."""
    squares: list[Array] = []
    counts: list[Array] = []
    readings: list[Array] = []
    for session in sessions:
        judged = session.judged
        residual = session.reading - model.simulate(session.conditions)
        cycle = session.cycle[judged]
        if not cycle.size:
            continue
        number = int(session.cycle[-1]) + 1
        squares.append(np.bincount(cycle, residual[judged] ** 2, number).astype(np.float64))
        counts.append(np.bincount(cycle, minlength=number).astype(np.float64))
        readings.append(session.reading[judged])
    if not squares:
        return Errors(np.zeros(1), np.zeros(1), 0.0)
    joined, samples = np.concatenate(squares), np.concatenate(counts)
    return Errors(joined[samples > 0], samples[samples > 0], float(np.std(np.concatenate(readings))))


@dataclass(frozen=True, slots=True)
class Gain:
    """Errors before and after in ``unit``, and by how many percent the error falls, with its 95 % interval."""

    rmse_before: float
    rmse_after: float
    unit: str
    gain_percent: float
    ci95: tuple[float, float]

    def to_dict(self) -> dict[str, object]:
        """The contract's ``held_out``."""
        return {
            "rmse_before": self.rmse_before,
            "rmse_after": self.rmse_after,
            "unit": self.unit,
            "gain_percent": self.gain_percent,
            "ci95": list(self.ci95),
        }


def gain(before: Errors, after: Errors, scale: Scale) -> Gain:
    """What ``after`` gains over ``before``: the interval from resampled load cycles (Efron and Tibshirani 1993)."""
    percent = _percent(before.squares.sum(), after.squares.sum())
    n = before.squares.size
    drawn = np.random.default_rng(0).integers(0, n, size=(RESAMPLED, n))
    again = _percent(before.squares[drawn].sum(axis=1), after.squares[drawn].sum(axis=1))
    low, high = np.percentile(again, [2.5, 97.5]) if n > 1 else (percent, percent)
    unit = scale.unit.symbol
    return Gain(
        before.rmse * scale.reading, after.rmse * scale.reading, unit, float(percent), (float(low), float(high))
    )


def _percent(before: Array | float, after: Array | float) -> Array:
    return np.asarray(100.0 * (1.0 - np.sqrt(np.asarray(after) / np.maximum(before, 1e-300))))
