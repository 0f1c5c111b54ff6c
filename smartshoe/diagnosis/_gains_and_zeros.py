"""Whether recordings have gains of their own, or gains or zeros that change within a recording.

A gain of its own arises where a unit is taken out and put back between recordings, a change within one where it slips.
Effects that go with time or cycles imitate both: two drifts make two recordings differ throughout, one drift follows
half of a step. So own gains and zeros are a further hypothesis, compared with the effects that were found.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import ClassVar

import numpy as np

from smartshoe.arrays import Array, Index, Mask
from smartshoe.diagnosis._evidence import Evidence, Members
from smartshoe.diagnosis._jumps import any_jumps, may_jump, moments_of, rounded_to
from smartshoe.diagnosis._likelihood import FEW_STEPS, Likelihood
from smartshoe.diagnosis._noise import effective_noise_sd
from smartshoe.diagnosis._own_terms import gains_and_zero_changes, own_terms_of, residual_of
from smartshoe.diagnosis._residual_structure import beyond_noise
from smartshoe.diagnosis._search import backward_eliminated, search
from smartshoe.diagnosis._session import Session, fitted_of
from smartshoe.diagnosis._state import State, fit_of_set
from smartshoe.diagnosis._step_columns import StepColumns
from smartshoe.diagnosis._validation import MOST_FOLDS, LeftOut, error_of, fitted_rms
from smartshoe.display import moment
from smartshoe.integrity.thresholds import Thresholds
from smartshoe.models.extended import ExtendedModel

MOST_CHANGES = 6  # a resolution: the mean number of changes allowed in a recording


@dataclass(frozen=True)
class OwnGain:
    """The gain of a ``recording`` from ``begins_s`` on; ``share`` is its relative difference from the common gain.

    ``is_change``: the recording had another gain before. ``unseen_s``: for how long before ``begins_s`` no load could
    have shown it.
    """

    recording: str
    begins_s: float
    share: float
    is_change: bool = False
    unseen_s: float = 0.0


@dataclass(frozen=True)
class ZeroChange:
    """A moment from which a ``recording`` reads more, by a ``share`` of full scale."""

    recording: str
    begins_s: float
    share: float
    unseen_s: ClassVar[float] = 0.0


@dataclass(frozen=True, eq=False)
class _OwnTerms:
    """``sessions`` with gains of their own, or zeros that change, and what they leave of a set of effects.

    ``evidence`` has these as nuisances; ``members`` are the effects of a state that remain in it.
    """

    sessions: Sequence[Session]
    evidence: Evidence
    members: Members

    @classmethod
    def of(cls, state: State, sessions: Sequence[Session], noise_sd: float) -> _OwnTerms:
        """The effects of ``state`` that remain when the sessions have their own terms."""
        evidence = Evidence(replace(state.linearisation, sessions=fitted_of(sessions)), noise_sd)
        return cls(sessions, evidence, backward_eliminated(evidence, state.fitted_members))

    @property
    def odds_of_a_change(self) -> float:
        """-2 log prior odds against a change: one effect among all, at one of the moments of the recordings."""
        each = (moments_of(one, self.evidence.thresholds).size for one in self.evidence.linearisation.sessions)
        return self.evidence.odds + 2.0 * math.log(max(sum(each), 1))

    @property
    def is_conditioned(self) -> bool:
        """Whether a recording's gain changes repeatedly beside a law of the wall that goes with load cycles.

        No law says when within a cycle a unit conditions: its gain may change at once as the load turns, and again in
        the next cycle. So repeated changes are no slips there; a single change in a recording is. A flexible block does
        not count, since it also follows what goes with time.
        """
        effects = (self.evidence.linearisation.candidates[one].effect for one in self.members)
        by_cycles = any(one.needs_cycles and one.place == "wall" and not one.is_flexible for one in effects)
        return by_cycles and any(len(one.gain_changes) > 1 for one in self.sessions)

    def searched(self) -> _OwnTerms:
        """The same with the best set of effects."""
        return replace(self, members=search(self.evidence, self.members).members)

    def model(self, state: State) -> ExtendedModel:
        """The model fitted with the remaining effects."""
        if self.evidence is state.evidence:
            return state.fit.model
        likelihood = Likelihood(self.sessions, self.evidence.noise_sd, state.fit.model, state.thresholds)
        return fit_of_set(state, self.evidence.posterior(self.members), likelihood, FEW_STEPS).model

    def comparable_score(self, sessions: Sequence[Session]) -> float:
        """Its score, with the odds against the own terms that ``sessions`` lack."""
        changes = sum(len(one.gain_changes) + len(one.zero_changes) for one in self.sessions)
        own = self.evidence.odds if self.sessions[0].own_gain_sd and not sessions[0].own_gain_sd else 0.0
        return self.evidence.comparable_score(self.members) + changes * self.odds_of_a_change + own


def with_own_terms(state: State, sessions: Sequence[Session]) -> Sequence[Session] | None:
    """The sessions with gains of their own if these are supported, else with changes at moments, else None.

    Beside own gains, changes are sought for the effects that remain, since a drift would appear as steps otherwise. A
    single recording has no gain of its own.
    """
    if any(one.gain_changes or one.zero_changes for one in sessions) or not may_differ(state, sessions):
        return None
    rivals: list[_OwnTerms] = []
    by_gain = None
    if len(fitted_of(sessions)) > 1:
        found = _OwnTerms(sessions, state.evidence, state.fitted_members)
        own_gain_sd = state.thresholds.strength_sd
        with_own = _OwnTerms.of(
            state, [replace(one, own_gain_sd=own_gain_sd) for one in sessions], found.evidence.noise_sd
        )
        if not sessions[0].own_gain_sd and are_supported(state, found, with_own):
            return with_own.sessions
        changing = with_changes(state, with_own)
        is_slip = changing is not with_own and not changing.is_conditioned and are_supported(state, found, changing)
        by_gain = changing.sessions if is_slip else None
        rivals = [with_own, changing]
    jumping = _with_jumping_zeros(state, sessions, rivals)
    return by_gain if jumping is None else jumping.sessions


def _with_jumping_zeros(state: State, sessions: Sequence[Session], rivals: Sequence[_OwnTerms]) -> _OwnTerms | None:
    """``sessions`` with zeros that jump, if that is supported and more probable than each of ``rivals``.

    The residual of a jumping zero is no noise and hides other effects, so that noise is estimated between moments. At
    so low a noise steps follow many other things, so that at least one of them must be a jump for certain.
    """
    if _excess_rms(state.fit.model, sessions, state.thresholds) <= state.thresholds.tolerable:
        return None  # nothing is left for a jumping zero to explain
    noise_sd = _between_moments_sd(state, sessions)
    found = _OwnTerms(sessions, Evidence(state.evidence.linearisation, noise_sd), state.fitted_members)
    jumping = with_changes(state, found, of_zero=True)
    if jumping is found or not are_supported(state, found.searched(), jumping := jumping.searched()):
        return None
    score = jumping.comparable_score(sessions)
    scored = (_OwnTerms.of(state, one.sessions, noise_sd).searched() for one in rivals)
    if any(score >= one.comparable_score(sessions) for one in scored):
        return None
    return jumping if any_jumps(jumping.sessions, jumping.model(state), state.thresholds) else None


def _between_moments_sd(state: State, sessions: Sequence[Session]) -> float:
    """Standard deviation of the noise, as in `effective_noise_sd`, about a free mean between each two moments."""
    left, kept, free = [], [], 0  # degrees of freedom of all samples
    for one in fitted_of(sessions):
        residual = residual_of(one, state.fit.model)
        moments = moments_of(one, state.thresholds)
        part = np.searchsorted(moments, np.arange(residual.size), side="right")
        sums, counts = (np.bincount(part[one.fitted], of, moments.size + 1) for of in (residual[one.fitted], None))
        left.append(residual - (sums / np.maximum(counts, 1))[part])
        kept.append(one.fitted)
        free += int(one.fitted.sum()) - int(np.count_nonzero(counts))
    count = sum(int(one.sum()) for one in kept)
    return min(effective_noise_sd(left, kept) * math.sqrt(count / max(free, 1)), state.evidence.noise_sd)


def may_differ(state: State, sessions: Sequence[Session]) -> bool:
    """Whether recordings may have gains or zeros of their own; never where one carries on from another.

    Either more is left than the small imperfections of a good unit (``tolerable``), or an effect goes with load cycles.
    """
    fitted = fitted_of(sessions)
    if any("continues" in one.recording.metadata for one in fitted):
        return False
    goes_with_cycles = any(part.effect.needs_cycles for part in state.fit.model.parts)
    return goes_with_cycles or _excess_rms(state.fit.model, fitted, state.thresholds) > state.thresholds.tolerable


def with_changes(state: State, with_own: _OwnTerms, *, of_zero: bool = False) -> _OwnTerms:
    """``with_own`` with further gains, or zeros, from moments on, added one by one while that is more probable.

    None for many recordings: each is short then, and own gains suffice.
    """
    fitted = fitted_of(with_own.sessions)
    if len(fitted) > MOST_FOLDS:
        return with_own
    model, zero_sd = state.linearisation.model, state.thresholds.strength_sd if of_zero else 0.0
    moments = [moments_of(one, state.thresholds) for one in fitted]
    ends = np.cumsum([one.size for one in moments])
    if not ends[-1]:
        return with_own
    moved = [
        np.full(one.reading.size, zero_sd) if of_zero else one.own_gain_sd * model.simulate(one.conditions)
        for one in fitted
    ]
    rounded = [rounded_to(one, model, state.thresholds) for one in fitted] if of_zero else []
    steps = [StepColumns.of(*each) for each in zip(fitted, moved, moments, strict=True)]
    none = [replace(one, starts=one.starts[:0]) for one in steps]
    for _ in range(MOST_CHANGES * len(fitted)):
        factors = with_own.evidence.bayes_factors_of_steps(with_own.members, steps)
        each = zip(fitted_of(with_own.sessions), moments, strict=True)
        factors[~np.concatenate([_may_change(*one) for one in each])] = -math.inf
        while factors.max() >= with_own.odds_of_a_change:
            best = int(np.argmax(factors))
            k = int(np.searchsorted(ends, best, side="right"))
            one, j = fitted_of(with_own.sessions)[k], best - int(ends[k]) + moments[k].size
            # Refined between the neighbouring moments, so that one change is not found as two around it.
            around = np.arange(*(one.reading.size * beside // (moments[k].size + 1) for beside in (j, j + 2)))[1:]
            around = around[_may_change(one, around)]
            alone = [*none[:k], StepColumns.of(one, moved[k], around), *none[k + 1 :]]
            at = int(around[np.argmax(with_own.evidence.bayes_factors_of_steps(with_own.members, alone))])
            changed = _changed(one, at, zero_sd)
            if not of_zero or may_jump(changed, at, state.fit.model, rounded[k], state.thresholds):
                break
            factors[best] = -math.inf  # it may become a candidate again beside other changes
        else:
            break
        sessions = [changed if other is one else other for other in with_own.sessions]
        with_own = _OwnTerms.of(state, sessions, with_own.evidence.noise_sd)
    return with_own


def _may_change(session: Session, at: Index) -> Mask:
    """(k,) whether something may change at samples ``at``: no second change in a cycle, which would undo the first."""
    known = session.cycle[[*session.gain_changes, *session.zero_changes]]
    return np.isin(session.cycle[at], known, invert=True)


def _changed(session: Session, at: int, zero_sd: float) -> Session:
    """``session`` with another gain, or with ``zero_sd`` another zero, from a sample on."""
    if zero_sd:
        return replace(session, zero_changes=tuple(sorted({*session.zero_changes, at})), zero_sd=zero_sd)
    return replace(session, gain_changes=tuple(sorted({*session.gain_changes, at})))


def are_supported(state: State, found: _OwnTerms, with_own: _OwnTerms) -> bool:
    """Whether the own terms of ``with_own`` are more probable than the effects ``found`` without them.

    They carry the odds against an effect, and must move the reading by more than the small imperfections of a good
    unit. With them either fewer effects leave no more, or the larger part of the residual is explained. Also the
    squared error of recordings left out in turn must fall by half: else own terms absorb what equations miss at other
    loads or rates.
    """
    sessions, thresholds = found.sessions, state.thresholds
    if with_own.comparable_score(sessions) >= found.comparable_score(sessions):
        return False
    model = with_own.model(state)
    tried = {one: _excess_rms(one, sessions, thresholds) for one in (state.fit.model, found.model(state))}
    without = min(tried, key=lambda one: tried[one])
    left = [residual_of(one, model) for one in with_own.sessions]
    moved = [rest - residual_of(one, model) for one, rest in zip(sessions, left, strict=True)]
    if fitted_rms(sessions, moved) <= thresholds.tolerable:
        return False
    before, after = tried[without], beyond_noise(sessions, left, thresholds)
    is_simpler = len(with_own.members) < len(found.members) and after <= before
    if not is_simpler and thresholds.clear * after**2 > before**2:
        return False
    before, after = (
        float(LeftOut(some, with_own.evidence.noise_sd, one, thresholds, by_recording=True).errors(one).sum())
        for some, one in ((sessions, without), (with_own.sessions, model))
    )
    return thresholds.clear * after <= before


def predicts_better(
    model: ExtendedModel, plain: ExtendedModel, state: State, sessions: Sequence[Session], with_own: Sequence[Session]
) -> bool:
    """Whether ``model``, found with own terms, predicts ``sessions`` better than ``plain`` does without these terms.

    An own gain says nothing of another recording, so that the common gain and constant zeros are used. With changes
    within recordings these are left out in turn. Gains of whole recordings bend fits to fewer of them, so that there
    the model only has to fit better.
    """
    if not any(one.gain_changes or one.zero_changes for one in with_own):
        return error_of(sessions, model) < error_of(sessions, plain)
    return LeftOut(sessions, state.evidence.noise_sd, model, state.thresholds, by_recording=True).is_validated(
        model, plain
    )


def gains_of(sessions: Sequence[Session], model: ExtendedModel, thresholds: Thresholds) -> tuple[OwnGain, ...]:
    """The gains of the fitted recordings, in order; each begins where a load first shows it."""
    found = []
    for one, gains, _ in _own_of_each(sessions, model):
        for at, gain in zip((0, *one.gain_changes), gains, strict=False):  # empty where all share one gain
            last, first = _loaded_about(one, at, thresholds) if at else (0, 0)
            begins_s = _time_s(one, first)
            unseen_s = begins_s - _time_s(one, last) if first > last + 1 else 0.0
            found.append(OwnGain(one.recording.name, begins_s, one.own_gain_sd * float(gain), at > 0, unseen_s))
    return tuple(found)


def _loaded_about(session: Session, at: int, thresholds: Thresholds) -> tuple[int, int]:
    """The last loaded sample before ``at``, and the first from there on; ``at`` where there is none."""
    loaded = np.abs(session.conditions.load) > thresholds.standing
    before, after = np.flatnonzero(loaded[:at]), np.flatnonzero(loaded[at:])
    return int(before[-1]) if before.size else at, at + int(after[0]) if after.size else at


def zero_changes_of(sessions: Sequence[Session], model: ExtendedModel) -> tuple[ZeroChange, ...]:
    """The changes of the fitted recordings' zeros, largest first."""
    found = (
        ZeroChange(one.recording.name, _time_s(one, at), one.zero_sd * float(share))
        for one, _, steps in _own_of_each(sessions, model)
        for at, share in zip(one.zero_changes, steps, strict=True)
    )
    return tuple(sorted(found, key=lambda one: -abs(one.share)))


def _own_of_each(sessions: Sequence[Session], model: ExtendedModel) -> Iterator[tuple[Session, Array, Array]]:
    """Each fitted recording with its own gains (k,) and the changes of its zero (l,)."""
    for one in fitted_of(sessions):
        own, _ = own_terms_of(one, model, one.reading - model.simulate(one.conditions))
        yield one, *gains_and_zero_changes(one, own)


def _time_s(session: Session, at: int) -> float:
    """The file's time at a sample of a session."""
    return float(session.recording.time_s[0] + session.conditions.time_s[at])


def time_of(change: OwnGain | ZeroChange) -> str:
    """When it changes: a moment, or the unloaded interval within which it changed."""
    ends = moment(change.begins_s, 4)
    if not change.unseen_s:
        return f"at {ends} s"
    return f"between {moment(change.begins_s - change.unseen_s, 4)} and {ends} s, without load"


def changes_of(gains: Sequence[OwnGain]) -> tuple[OwnGain, ...]:
    """The changes of gains within recordings, as relative steps, largest first."""
    changes = [replace(one, share=one.share - last.share) for last, one in pairwise(gains) if one.is_change]
    return tuple(sorted(changes, key=lambda one: -abs(one.share)))


def _excess_rms(model: ExtendedModel, sessions: Sequence[Session], thresholds: Thresholds) -> float:
    """Rms of the residual of a model over the fitted samples, beyond white noise."""
    return beyond_noise(sessions, [residual_of(one, model) for one in sessions], thresholds)
