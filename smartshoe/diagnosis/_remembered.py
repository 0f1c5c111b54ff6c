"""Drifts of the zero that may be a memory of loads before the recording, where recordings begin loaded."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from smartshoe.arrays import Array
from smartshoe.diagnosis._held_out import residual_of
from smartshoe.diagnosis._likelihood import rows_of
from smartshoe.diagnosis._naming import Name
from smartshoe.diagnosis._noise import FLOOR
from smartshoe.diagnosis._sensitivity import nuisances
from smartshoe.diagnosis._session import Session, fitted_of
from smartshoe.integrity.thresholds import Thresholds
from smartshoe.models.effects.effect import CoreEffect
from smartshoe.models.elements import Arm
from smartshoe.models.extended import ExtendedModel


def may_be_remembered(drift: Name, model: ExtendedModel, sessions: Sequence[Session], thresholds: Thresholds) -> bool:
    """Whether the arms of the model's effects, started in any state, can replace a ``drift`` of the zero.

    A model's arms start in equilibrium with the first load, but nothing tells how long a unit that begins loaded has
    been loaded. Only the baseline's arm has a free initial state, so that the memory of another arm can only appear as
    a drift. The arms can replace it if they, with all else refitted, miss no more of it than laws usually depart.
    """
    if not (drift.effect.is_drift and drift.effect.is_seen_at_rest):
        return False
    bare = model.without(drift.member.name)
    core = [part.effect.elements(part.values) for part in bare.parts if isinstance(part.effect, CoreEffect)]
    arms = [one for elements in core for one in elements if isinstance(one, Arm)]
    if not arms:
        return False
    fitted = fitted_of(sessions)
    cost, cost_without = (
        sum(float(np.sum(residual_of(one, each)[one.fitted] ** 2)) for one in fitted)
        for each in (model, drift.member.without.model)
    )
    gram = np.sum([_gram_without_own_terms(arms, one, bare, cost_without) for one in fitted], axis=0)
    cost_with_arms = float(
        gram[0, 0] - gram[0, 1:] @ np.linalg.pinv(gram[1:, 1:], rcond=1e-10, hermitian=True) @ gram[1:, 0]
    )
    return cost_with_arms - cost <= thresholds.departure**2 * (cost_without - cost)


def _gram_without_own_terms(arms: Sequence[Arm], session: Session, model: ExtendedModel, squares: float) -> Array:
    """(1 + p, 1 + p) inner products of the residual and slopes of ``model``, own terms and arm states projected out.

    Where the session begins loaded the state of each arm may be off by as much as its first load causes. ``squares`` is
    the residual's sum of squares, for the noise variance.
    """
    load, seen = abs(float(session.conditions.load[0])), session.fitted
    time_s = session.conditions.time_s - session.conditions.time_s[0]
    own = nuisances(session, model.pole_per_s, session.reading)
    begins_loaded = load > session.unknown_past and not session.conditions.earlier.size
    free = [(np.exp(-one.rate_per_s / (1.0 + one.share) * time_s), one.share) for one in arms if begins_loaded]
    columns = np.column_stack([own, *(fading for fading, _ in free)])[seen]
    sds = np.array([np.inf] * own.shape[1] + [max(abs(share * model.gain) * load, FLOOR) for _, share in free])
    rows = rows_of(model, session)[seen]
    variance = squares / max(int(seen.sum()), 1)
    inner = columns.T @ columns + np.diag(variance / sds**2 + 1e-9)
    cross = columns.T @ rows
    return np.asarray(rows.T @ rows - cross.T @ np.linalg.solve(inner, cross))
