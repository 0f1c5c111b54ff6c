"""What an effect is worth within what is fitted: recordings left out in turn, loads beyond those that were fitted."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from smartshoe.arrays import Array, Mask
from smartshoe.diagnosis._evidence import Evidence, Posterior
from smartshoe.diagnosis._held_out import residual_of
from smartshoe.diagnosis._session import Session
from smartshoe.integrity.thresholds import Thresholds
from smartshoe.models.extended import ExtendedModel


def worst_member(evidence: Evidence, best: Posterior) -> int | None:
    """The member without which data that is left out is followed better; None where there is none.

    Each recording in turn (each block of a single one) is predicted from the others, with and without the member; its
    gain over them must lie above zero by most of a standard error.
    """
    whole = evidence.left_out_errors(best.members)
    gains = {
        member: _in_standard_errors(evidence.left_out_errors(tuple(m for m in best.members if m != member)) - whole)
        for member in best.members
    }
    worst = min(gains, key=lambda member: gains[member], default=None)
    return worst if worst is not None and gains[worst] < evidence.thresholds.validated else None


def foreseen(evidence: Evidence, best: Posterior) -> float:
    """The share of the baseline's squared error over what is left out in turn that the set does away with."""
    nothing = float(evidence.left_out_errors(()).sum())
    return 1.0 - float(evidence.left_out_errors(best.members).sum()) / nothing if nothing > 0.0 else 0.0


def extrapolating(sessions: Sequence[Session], model: ExtendedModel, thresholds: Thresholds) -> str | None:
    """An effect that moves recordings that were not fitted far more than those that were; their loads alone decide."""
    whole = [model.simulate(one.conditions) for one in sessions]
    for part in model.parts:
        less = model.without(part.name)
        by = [reading - less.simulate(one.conditions) for reading, one in zip(whole, sessions, strict=True)]
        within = _spread(by, [one.fitted for one in sessions])
        if _spread(by, [one.judged for one in sessions]) > thresholds.extrapolates * max(within, thresholds.material):
            return part.name
    return None


def error_of(sessions: Sequence[Session], model: ExtendedModel) -> float:
    """Rms of what is left of what is fitted."""
    return _fitted_rms(sessions, lambda session: residual_of(session, model))


def apart(sessions: Sequence[Session], first: ExtendedModel, second: ExtendedModel) -> float:
    """Rms of the difference of two models' readings over what is fitted, each recording's own offset aside."""
    return _fitted_rms(sessions, lambda session: residual_of(session, first) - residual_of(session, second))


def _spread(signals: Sequence[Array], seen: Sequence[Mask]) -> float:
    """Rms of ``signals``, (n,) each, where ``seen``, each about its own mean."""
    parts = [signal[mask] - signal[mask].mean() for signal, mask in zip(signals, seen, strict=True) if mask.any()]
    return math.sqrt(sum(float(one @ one) for one in parts) / max(sum(one.size for one in parts), 1))


def _fitted_rms(sessions: Sequence[Session], signal_of: Callable[[Session], Array]) -> float:
    square, count = 0.0, 0
    for session in sessions:
        signal = signal_of(session)[session.fitted]
        square += float(signal @ signal)
        count += signal.size
    return float(np.sqrt(square / max(count, 1)))


def _in_standard_errors(gains: Array) -> float:
    """The mean of ``gains`` (n,) over its standard error."""
    error = float(np.std(gains, ddof=1)) / math.sqrt(gains.size) if gains.size > 1 else 0.0
    return float(gains.mean()) / max(error, 1e-300)
