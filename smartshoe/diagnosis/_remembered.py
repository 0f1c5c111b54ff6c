"""Zeros that move and may be a memory of loads before the recording, where recordings begin loaded."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from smartshoe.arrays import Array
from smartshoe.diagnosis._likelihood import rows_of
from smartshoe.diagnosis._naming import Name
from smartshoe.diagnosis._noise import FLOOR
from smartshoe.diagnosis._own_terms import residual_of
from smartshoe.diagnosis._sensitivity import nuisances
from smartshoe.diagnosis._session import Session, fitted_of
from smartshoe.integrity.thresholds import Thresholds
from smartshoe.models.effects.effect import CoreEffect
from smartshoe.models.elements import Arm
from smartshoe.models.extended import ExtendedModel, Part


def may_be_remembered(drift: Name, model: ExtendedModel, sessions: Sequence[Session], thresholds: Thresholds) -> bool:
    """Whether the arms of the model's effects, started in any state, can replace a ``drift`` of the zero.

    Any zero that moves is asked, with the time or with the loads borne: where recordings begin loaded it is no surer
    than what is equivalent to it.

    A model's arms start in equilibrium with the first load, but nothing tells how long a unit that begins loaded has
    been loaded. Only the baseline's arm has a free initial state, so that the memory of another arm can only appear as
    a drift. The arms can replace it if they, with all else refitted, miss no more of it than laws usually depart: as
    they were found, or with any of the times that their effect is sought by, since the drift may have changed these.
    """
    effect, fitted = drift.effect, fitted_of(sessions)
    if not effect.is_seen_at_rest or effect.shifts or effect.needs or not any(_begins_loaded(one) for one in fitted):
        return False
    cost, cost_without = (
        sum(float(np.sum(residual_of(one, each)[one.fitted] ** 2)) for one in fitted)
        for each in (model, drift.member.without.model)
    )
    variance = cost_without / max(sum(int(one.fitted.sum()) for one in fitted), 1)
    most = cost + thresholds.departure**2 * (cost_without - cost)
    return any(
        _cost_with_arms(arms, each, fitted, variance) <= most
        for each, arms in _with_arms_of_any_time(model.without(drift.member.name))
    )


def _with_arms_of_any_time(model: ExtendedModel) -> Iterator[tuple[ExtendedModel, list[Arm]]]:
    """``model`` with its effects' arms, as it is and with each shape of each such effect; nothing where it has none."""
    parts = [part for part in model.parts if _arms_of(part)]
    if not parts:
        return
    yield model, [arm for part in parts for arm in _arms_of(part)]
    for part in parts:
        of_shape = np.array([one.null is None for one in part.effect.parameters])
        for shape in part.effect.shapes:
            values = np.where(of_shape, part.effect.start(shape), part.values)
            other = replace(model, parts=tuple(replace(p, values=values) if p is part else p for p in model.parts))
            yield other, [arm for each in other.parts for arm in _arms_of(each)]


def _arms_of(part: Part) -> list[Arm]:
    """The arms that a part of the model adds to its network."""
    if not isinstance(part.effect, CoreEffect):
        return []
    return [one for one in part.effect.elements(part.values) if isinstance(one, Arm)]


def _begins_loaded(session: Session) -> bool:
    """Whether a session begins with a load of which nobody knows how long it has been borne."""
    return abs(float(session.conditions.load[0])) > session.unknown_past and not session.conditions.earlier.size


def _cost_with_arms(arms: Sequence[Arm], model: ExtendedModel, fitted: Sequence[Session], variance: float) -> float:
    """The sum of squares that ``model`` leaves, refitted in one step with the states of its ``arms``."""
    gram = np.sum([_gram_without_own_terms(arms, one, model, variance) for one in fitted], axis=0)
    return float(gram[0, 0] - gram[0, 1:] @ np.linalg.pinv(gram[1:, 1:], rcond=1e-10, hermitian=True) @ gram[1:, 0])


def _gram_without_own_terms(arms: Sequence[Arm], session: Session, model: ExtendedModel, variance: float) -> Array:
    """(1 + p, 1 + p) inner products of the residual and slopes of ``model``, own terms and arm states projected out.

    Where the session begins loaded the state of each arm may be off by as much as its first load causes. ``variance``
    is the residual's, per fitted sample of all sessions.
    """
    load, seen = abs(float(session.conditions.load[0])), session.fitted
    time_s = session.conditions.time_s - session.conditions.time_s[0]
    own = nuisances(session, model.pole_per_s, session.reading)
    unknown = arms if _begins_loaded(session) else ()
    free = [(np.exp(-one.rate_per_s / (1.0 + one.share) * time_s), one.share) for one in unknown]
    columns = np.column_stack([own, *(fading for fading, _ in free)])[seen]
    sds = np.array([np.inf] * own.shape[1] + [max(abs(share * model.gain) * load, FLOOR) for _, share in free])
    rows = rows_of(model, session)[seen]
    inner = columns.T @ columns + np.diag(variance / sds**2 + 1e-9)
    cross = columns.T @ rows
    return np.asarray(rows.T @ rows - cross.T @ np.linalg.solve(inner, cross))
