"""Whether each recording has a gain of its own, as where a unit is taken out and put back between recordings.

Or other ones in its course, as where it slips. What goes with the time or the cycles of a recording would be taken for
it: two drifts together make of two recordings what either has throughout, and one drift makes half of what changes at a
moment. So such gains are weighed against what was found, as one more hypothesis.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from smartshoe.diagnosis._evidence import Evidence, Members
from smartshoe.diagnosis._held_out import own_of, residual_of
from smartshoe.diagnosis._likelihood import FEW_STEPS, Likelihood, fit
from smartshoe.diagnosis._residual_structure import beyond_noise
from smartshoe.diagnosis._search import needed
from smartshoe.diagnosis._session import Session
from smartshoe.diagnosis._state import State
from smartshoe.diagnosis._validation import MOST_FOLDS, LeftOut, fitted_rms
from smartshoe.integrity.thresholds import Thresholds
from smartshoe.models.extended import ExtendedModel

# Resolutions: how many moments of a recording a gain may change at, and how often.
MOMENTS = 60
MOST_CHANGES = 2


@dataclass(frozen=True)
class OwnGain:
    """A gain of a ``recording`` from ``begins_s`` on; ``share`` by which it lies beside that of all.

    ``is_change``: the recording had another before.
    """

    recording: str
    begins_s: float
    share: float
    is_change: bool = False


@dataclass(frozen=True, eq=False)
class _Gained:
    """``sessions`` with gains of their own, the ``evidence`` beside these, and what of a state is ``kept`` in it."""

    sessions: Sequence[Session]
    evidence: Evidence
    kept: Members

    @classmethod
    def of(cls, state: State, sessions: Sequence[Session]) -> _Gained:
        evidence = Evidence(replace(state.given, sessions=_fitted(sessions)), state.evidence.noise_sd)
        return cls(sessions, evidence, needed(evidence, state.start))

    @property
    def odds_of_a_change(self) -> float:
        """-2 log prior odds against one: of one effect among all, at one of the moments of the recordings."""
        return self.evidence.odds + 2.0 * math.log(MOMENTS * len(self.evidence.given.sessions))


def with_likelier_gains(state: State, sessions: Sequence[Session]) -> Sequence[Session] | None:
    """The same sessions with gains of their own where these are told, else with gains that change; else None.

    Beside gains of their own, changes are looked for in what is found then: a drift would be steps otherwise.
    """
    if any(one.gain_changes for one in sessions) or not may_differ(state, sessions):
        return None
    gained = _Gained.of(state, [replace(one, own_gain_sd=state.thresholds.strength_sd) for one in sessions])
    if not sessions[0].own_gain_sd and are_told(state, sessions, gained):
        return gained.sessions
    changing = with_changes(state, gained)
    return changing.sessions if changing is not gained and are_told(state, sessions, changing) else None


def may_differ(state: State, sessions: Sequence[Session]) -> bool:
    """Whether gains may be what is wrong: of several recordings of which none carries on from another.

    More is left than small imperfections of a good unit add up to, or something was found that goes with cycles.
    """
    fitted = _fitted(sessions)
    if len(fitted) < 2 or any("continues" in one.recording.metadata for one in fitted):
        return False
    goes_with_cycles = any(part.effect.needs_cycles for part in state.fit.model.parts)
    return goes_with_cycles or _left_by(state.fit.model, fitted, state.thresholds) > state.thresholds.tolerable


def with_changes(state: State, gained: _Gained) -> _Gained:
    """``gained``, each with another gain from each moment on where that is likelier, one after the other.

    Of many recordings each is short, and gains of their own are all that is asked.
    """
    model, count = state.given.model, len(_fitted(gained.sessions))
    for _ in range(MOST_CHANGES * count if count <= MOST_FOLDS else 0):
        fitted = _fitted(gained.sessions)
        moments = [np.arange(1, MOMENTS + 1) * one.reading.size // (MOMENTS + 1) for one in fitted]
        columns = [np.zeros((one.reading.size, MOMENTS * count), order="F") for one in fitted]
        for k, one in enumerate(fitted):
            read = one.own_gain_sd * model.simulate(one.conditions)
            is_after = np.arange(read.size)[:, None] >= moments[k]
            columns[k][:, MOMENTS * k : MOMENTS * (k + 1)] = read[:, None] * is_after
        falls = gained.evidence.falls_beside(gained.kept, columns)
        if falls.max() < gained.odds_of_a_change:
            break
        k, j = divmod(int(np.argmax(falls)), MOMENTS)
        changes = tuple(sorted({*fitted[k].gain_changes, int(moments[k][j])}))
        changed = [replace(one, gain_changes=changes) if one is fitted[k] else one for one in gained.sessions]
        gained = _Gained.of(state, changed)
    return gained


def are_told(state: State, sessions: Sequence[Session], gained: _Gained) -> bool:
    """Whether gains of their own, which ``gained`` has, are likelier than what was found without, or than some of it.

    Against them are the odds against an effect, and they must move the reading by more than small imperfections of a
    good unit together. With them, either fewer effects leave no more, or they account for the larger part of what is
    left; and what is left out in turn is foreseen with half the squared error: else they take up what equations miss
    where recordings are of other loads or rates.
    """
    evidence, members, thresholds = state.evidence, state.start, state.thresholds
    changes = sum(len(one.gain_changes) for one in gained.sessions)
    odds = changes * gained.odds_of_a_change + (0.0 if sessions[0].own_gain_sd else evidence.odds)
    if gained.evidence.score_beside(gained.kept) + odds >= evidence.score_beside(members):
        return False
    model = state.fit.model
    for name in {*model.names} - {state.given.candidates[m].name for m in gained.kept}:
        model = model.without(name)
    model = fit(Likelihood(gained.sessions, evidence.noise_sd, model, thresholds), model, FEW_STEPS).model
    left = [residual_of(one, model) for one in gained.sessions]
    moved = [rest - residual_of(one, model) for one, rest in zip(sessions, left, strict=True)]
    if fitted_rms(sessions, moved) <= thresholds.tolerable:
        return False
    before, after = _left_by(state.fit.model, sessions, thresholds), beyond_noise(sessions, left, thresholds)
    is_simpler = len(gained.kept) < len(members) and after <= before
    if not is_simpler and thresholds.clear * after**2 > before**2:
        return False
    before, after = (
        float(LeftOut(some, evidence.noise_sd, one, thresholds).errors(one).sum())
        for some, one in ((sessions, state.fit.model), (gained.sessions, model))
    )
    return thresholds.clear * after <= before


def gains_of(sessions: Sequence[Session], model: ExtendedModel) -> tuple[OwnGain, ...]:
    """The gains of the fitted recordings, in order."""
    found = []
    for one in _fitted(sessions):
        own, _ = own_of(one, model, one.reading - model.simulate(one.conditions))
        for at, gain in zip((0, *one.gain_changes), own[2:], strict=True):
            begins_s = float(one.recording.time_s[0] + one.conditions.time_s[at])
            found.append(OwnGain(one.recording.name, begins_s, one.own_gain_sd * float(gain), at > 0))
    return tuple(found)


def changes_of(gains: Sequence[OwnGain]) -> tuple[OwnGain, ...]:
    """Where gains change within a recording: when, and by what share, the largest first."""
    changes = [replace(one, share=one.share - last.share) for last, one in pairwise(gains) if one.is_change]
    return tuple(sorted(changes, key=lambda one: -abs(one.share)))


def _left_by(model: ExtendedModel, sessions: Sequence[Session], thresholds: Thresholds) -> float:
    """Rms of what a model leaves of what is fitted, beyond white noise."""
    return beyond_noise(sessions, [residual_of(one, model) for one in sessions], thresholds)


def _fitted(sessions: Sequence[Session]) -> tuple[Session, ...]:
    return tuple(one for one in sessions if one.fitted.any())
