"""Whether each recording has a gain of its own, as where a unit is taken out and put back between recordings.

What goes with the time or the cycles of a recording would be taken for it: two drifts together make of two recordings
what either has throughout. So a gain a recording is weighed against what was found, as one more hypothesis.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from smartshoe.diagnosis._evidence import Evidence, Members
from smartshoe.diagnosis._held_out import own_of, residual_of
from smartshoe.diagnosis._likelihood import FEW_STEPS, Likelihood, fit
from smartshoe.diagnosis._residual_structure import beyond_noise
from smartshoe.diagnosis._session import Session
from smartshoe.diagnosis._state import State
from smartshoe.diagnosis._validation import LeftOut, fitted_rms
from smartshoe.integrity.thresholds import Thresholds
from smartshoe.models.extended import ExtendedModel


def may_differ(sessions: Sequence[Session]) -> bool:
    """Whether a unit may have been moved between what is fitted: nothing carries on from another recording."""
    fitted = _fitted(sessions)
    return len(fitted) > 1 and not any("continues" in one.recording.metadata for one in fitted)


def with_own_gains(sessions: Sequence[Session], thresholds: Thresholds) -> list[Session]:
    """The same sessions, each with a gain of its own."""
    return [replace(one, own_gain_sd=thresholds.strength_sd) for one in sessions]


def are_told(state: State, sessions: Sequence[Session], gained: Sequence[Session]) -> bool:
    """Whether gains of their own, which ``gained`` have, are likelier than what was found without, or than some of it.

    Against them are the odds against an effect, and they must move the reading by more than small imperfections of a
    good unit together. With them, either fewer effects leave no more, or they account for the larger part of what is
    left; and what is left out in turn is foreseen with half the squared error: else they take up what equations miss
    where recordings are of other loads or rates.
    """
    evidence, members, thresholds = state.evidence, state.start, state.thresholds
    beside = Evidence(replace(evidence.given, sessions=_fitted(gained)), evidence.noise_sd)
    kept = _needed(beside, members)
    if beside.score_beside(kept) + beside.odds >= evidence.score_beside(members):
        return False
    model = state.fit.model
    for name in {*model.names} - {beside.given.candidates[m].name for m in kept}:
        model = model.without(name)
    model = fit(Likelihood(gained, evidence.noise_sd, model, thresholds), model, FEW_STEPS).model
    each = zip(gained, sessions, strict=True)
    moved = fitted_rms(gained, [residual_of(one, model) - residual_of(other, model) for one, other in each])
    if moved <= thresholds.tolerable:
        return False
    before, after = _left_by(state.fit.model, sessions, thresholds), _left_by(model, gained, thresholds)
    is_simpler = len(kept) < len(members) and after <= before
    if not is_simpler and thresholds.clear * after**2 > before**2:
        return False
    before, after = (
        float(LeftOut(some, evidence.noise_sd, one, thresholds).errors(one).sum())
        for some, one in ((sessions, state.fit.model), (gained, model))
    )
    return thresholds.clear * after <= before


def gains_of(sessions: Sequence[Session], model: ExtendedModel) -> tuple[tuple[str, float], ...]:
    """Each fitted recording's name, and the share by which its own gain lies beside the gain of all."""
    each = [(one, own_of(one, model, one.reading - model.simulate(one.conditions))[0]) for one in _fitted(sessions)]
    return tuple((one.recording.name, one.own_gain_sd * float(own[2])) for one, own in each)


def _needed(evidence: Evidence, members: Members) -> Members:
    """``members`` without those of which one after the other has less evidence for it than against it."""
    best = evidence.posterior(members)
    while best.members:
        fewer = (evidence.posterior(tuple(m for m in best.members if m != gone)) for gone in best.members)
        less = min(fewer, key=lambda one: one.score)
        if less.score >= best.score:
            break
        best = less
    return best.members


def _left_by(model: ExtendedModel, sessions: Sequence[Session], thresholds: Thresholds) -> float:
    """Rms of what a model leaves of what is fitted, beyond white noise."""
    return beyond_noise(sessions, [residual_of(one, model) for one in sessions], thresholds)


def _fitted(sessions: Sequence[Session]) -> tuple[Session, ...]:
    return tuple(one for one in sessions if one.fitted.any())
