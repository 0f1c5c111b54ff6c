"""What a model is worth on data that it was not fitted to: errors at the full rate, gains and their intervals.

A recording's own offset and initial state are no part of a model. They are estimated on the recording itself, for
every model alike, from what was fitted of it, or from all of it where nothing was.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from smartshoe.arrays import Array
from smartshoe.calibration import ExtendedCompensator
from smartshoe.diagnosis._sensitivity import nuisances
from smartshoe.diagnosis._session import Scale, Session
from smartshoe.models.extended import ExtendedModel

RESAMPLED = 400  # draws, of which an interval is known to some percent of its width


def own_of(session: Session, model: ExtendedModel, residual: Array) -> tuple[Array, Array]:
    """Offset and initial state (2,) of a recording under ``model``, and what they add to its reading (n,).

    The initial state is bounded by what an arm can hold: its share of the whole load.
    """
    mask = session.fitted if session.fitted.any() else session.usable
    columns = nuisances(session, model.pole_per_s)
    seen = columns[mask]
    held = max(abs(model.relaxing_share * model.gain), 1e-6)
    variance = float(np.var(residual[mask])) if mask.any() else 0.0
    inner = seen.T @ seen + np.diag([1e-9, variance / held**2 + 1e-9])
    found = np.asarray(np.linalg.solve(inner, seen.T @ residual[mask]), dtype=np.float64)
    return found, columns @ found


def residual_of(session: Session, model: ExtendedModel) -> Array:
    """(n,) reading less simulation less what is the recording's own, in shares of full scale."""
    residual = session.reading - model.simulate(session.conditions)
    return np.asarray(residual - own_of(session, model, residual)[1])


@dataclass(frozen=True, eq=False)
class Errors:
    """Squared errors of the simulated reading by held-out load cycle: ``squares`` and ``counts`` (cycles,).

    ``spread``: standard deviation of the held-out reading about each recording's own mean.
    """

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

    @property
    def variance_explained_percent(self) -> float:
        """100 (1 - error's variance over the reading's)."""
        return 100.0 * (1.0 - (self.rmse / self.spread) ** 2) if self.spread > 0 else 0.0


def errors(sessions: Sequence[Session], model: ExtendedModel) -> Errors:
    """The errors over what is held out."""
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
        return Errors(np.zeros(1), np.zeros(1), 0.0)
    joined, number_of = np.concatenate(squares), np.concatenate(counts)
    return Errors(joined[number_of > 0], number_of[number_of > 0], float(np.sqrt(spread / samples)))


@dataclass(frozen=True, slots=True)
class Gain:
    """Errors before and after in ``unit``, and by how many percent the error falls, with its 95 % interval."""

    rmse_before: float
    rmse_after: float
    unit: str
    gain_percent: float
    ci95: tuple[float, float]

    @property
    def is_loss(self) -> bool:
        """Whether the error grows, beyond chance."""
        return self.ci95[1] < 0.0

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
    unit, span = scale.unit.symbol, abs(scale.reading)
    return Gain(before.rmse * span, after.rmse * span, unit, float(percent), (float(low), float(high)))


def _percent(before: Array | float, after: Array | float) -> Array:
    return np.asarray(100.0 * (1.0 - np.sqrt(np.asarray(after) / np.maximum(before, 1e-300))))


def force_rmse_n(fine: Sequence[Session], model: ExtendedModel) -> float:
    """Root mean square error in N of the compensated force against the held-out load; NaN where nothing is held out."""
    total, count = 0.0, 0
    for session in fine:
        judged = session.judged
        if not judged.any():
            continue
        _, own = own_of(session, model, session.reading - model.simulate(session.conditions))
        compensator = ExtendedCompensator(model, 1.0 / session.conditions.step_s)
        force_n = compensator.apply((session.reading - own) * model.full_scale_reading)
        off = (force_n - session.conditions.load * model.full_scale_load_n)[judged]
        total += float(off @ off)
        count += off.size
    return float(np.sqrt(total / count)) if count else float("nan")
