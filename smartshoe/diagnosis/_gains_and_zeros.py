"""Whether each recording has a gain of its own, as where a unit is taken out and put back between recordings.

Or whether gain or zero change at moments within a recording, as where a unit slips. Effects that go with time or cycles
can imitate both: two drifts make two recordings differ throughout, one drift follows half of a step. So gains and zeros
of the recordings' own are one more hypothesis, weighed against the effects that were found.
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
from smartshoe.diagnosis._held_out import changes_in, own_of, residual_of
from smartshoe.diagnosis._jumps import any_jumps, may_jump, moments_of, rounded_to
from smartshoe.diagnosis._likelihood import FEW_STEPS, Likelihood
from smartshoe.diagnosis._noise import correlated_sd
from smartshoe.diagnosis._residual_structure import beyond_noise
from smartshoe.diagnosis._search import needed, search
from smartshoe.diagnosis._session import Session, fitted_of
from smartshoe.diagnosis._state import State, fit_of
from smartshoe.diagnosis._step_columns import StepColumns
from smartshoe.diagnosis._validation import MOST_FOLDS, LeftOut, error_of, fitted_rms
from smartshoe.display import moment
from smartshoe.integrity.thresholds import Thresholds
from smartshoe.models.extended import ExtendedModel

MOST_CHANGES = 6  # a resolution: how often a recording's gain, or its zero, may change, in the mean


@dataclass(frozen=True)
class OwnGain:
    """A gain of a ``recording`` from ``begins_s`` on; ``share`` by which it lies beside that of all.

    ``is_change``: the recording had another before. ``unseen_s``: for how long before ``begins_s`` there was no load
    that would have shown it.
    """

    recording: str
    begins_s: float
    share: float
    is_change: bool = False
    unseen_s: float = 0.0


@dataclass(frozen=True)
class ZeroChange:
    """A moment of a ``recording`` from which on it reads more, by a ``share`` of full scale."""

    recording: str
    begins_s: float
    share: float
    unseen_s: ClassVar[float] = 0.0


@dataclass(frozen=True, eq=False)
class _Gained:
    """``sessions`` with gains of their own, or zeros that change.

    ``evidence`` is that beside these, ``kept`` what of a state is still needed in it.
    """

    sessions: Sequence[Session]
    evidence: Evidence
    kept: Members

    @classmethod
    def of(cls, state: State, sessions: Sequence[Session], noise_sd: float) -> _Gained:
        evidence = Evidence(replace(state.given, sessions=fitted_of(sessions)), noise_sd)
        return cls(sessions, evidence, needed(evidence, state.start))

    @property
    def odds_of_a_change(self) -> float:
        """-2 log prior odds against one: of one effect among all, at one of the moments of the recordings."""
        each = (moments_of(one, self.evidence.thresholds).size for one in self.evidence.given.sessions)
        return self.evidence.odds + 2.0 * math.log(max(sum(each), 1))

    @property
    def is_conditioned(self) -> bool:
        """Whether a recording's gain changes again beside a law by which the wall's gain goes with load cycles.

        When within its cycles a unit conditions no law knows: as a load turns, its gain may change at once as well, and
        does so again. So what changes again is no slip there; what changes once in a recording is. A free form follows
        what goes with the time as well.
        """
        effects = (self.evidence.given.candidates[one].effect for one in self.kept)
        by_cycles = any(one.needs_cycles and one.place == "wall" and not one.is_flexible for one in effects)
        return by_cycles and any(len(one.gain_changes) > 1 for one in self.sessions)

    def searched(self) -> _Gained:
        """The same with the best set beside them."""
        return replace(self, kept=search(self.evidence, self.kept).members)

    def model(self, state: State) -> ExtendedModel:
        """A fit of what is kept."""
        if self.evidence is state.evidence:
            return state.fit.model
        likelihood = Likelihood(self.sessions, self.evidence.noise_sd, state.fit.model, state.thresholds)
        return fit_of(state, self.evidence.posterior(self.kept), likelihood, FEW_STEPS).model

    def score_beside(self, sessions: Sequence[Session]) -> float:
        """-2 log of its evidence, with the odds against what it has and ``sessions`` have not."""
        changes = sum(len(one.gain_changes) + len(one.zero_changes) for one in self.sessions)
        own = self.evidence.odds if self.sessions[0].own_gain_sd and not sessions[0].own_gain_sd else 0.0
        return self.evidence.score_beside(self.kept) + changes * self.odds_of_a_change + own


def with_likelier_gains(state: State, sessions: Sequence[Session]) -> Sequence[Session] | None:
    """The same sessions with gains of their own where these are told, else with what changes at moments; else None.

    Beside gains of their own, changes are looked for in what is found then: a drift would be steps otherwise. Where the
    wall still conditions beside what changes again, that is how it does. A single recording has no gain of its own.
    """
    if any(one.gain_changes or one.zero_changes for one in sessions) or not may_differ(state, sessions):
        return None
    rivals: list[_Gained] = []
    by_gain = None
    if len(fitted_of(sessions)) > 1:
        found = _Gained(sessions, state.evidence, state.start)
        own_gain_sd = state.thresholds.strength_sd
        gained = _Gained.of(state, [replace(one, own_gain_sd=own_gain_sd) for one in sessions], found.evidence.noise_sd)
        if not sessions[0].own_gain_sd and are_told(state, found, gained):
            return gained.sessions
        changing = with_changes(state, gained)
        is_slip = changing is not gained and not changing.is_conditioned and are_told(state, found, changing)
        by_gain = changing.sessions if is_slip else None
        rivals = [gained, changing]
    jumping = _with_jumping_zeros(state, sessions, rivals)
    return by_gain if jumping is None else jumping.sessions


def _with_jumping_zeros(state: State, sessions: Sequence[Session], rivals: Sequence[_Gained]) -> _Gained | None:
    """``sessions`` with zeros that change at moments where that is told, and likelier than each of ``rivals``.

    What a zero leaves that jumps is no noise, and hides what else is there: noise is what is left between moments. At
    so little much else is followed by steps, so that one of them must be a jump for certain.
    """
    if _left_by(state.fit.model, sessions, state.thresholds) <= state.thresholds.tolerable:
        return None  # no effect does what such a zero does
    noise_sd = _between_moments_sd(state, sessions)
    found = _Gained(sessions, Evidence(state.evidence.given, noise_sd), state.start)
    jumping = with_changes(state, found, of_zero=True)
    if jumping is found or not are_told(state, found.searched(), jumping := jumping.searched()):
        return None
    score = jumping.score_beside(sessions)
    quiet = (_Gained.of(state, one.sessions, noise_sd).searched() for one in rivals)
    if any(score >= one.score_beside(sessions) for one in quiet):
        return None
    return jumping if any_jumps(jumping.sessions, jumping.model(state), state.thresholds) else None


def _between_moments_sd(state: State, sessions: Sequence[Session]) -> float:
    """Standard deviation of the noise, as `correlated_sd` has it, whatever the zero is between two moments."""
    left, kept, free = [], [], 0  # degrees of freedom
    for one in fitted_of(sessions):
        residual = residual_of(one, state.fit.model)
        moments = moments_of(one, state.thresholds)
        part = np.searchsorted(moments, np.arange(residual.size), side="right")
        sums, counts = (np.bincount(part[one.fitted], of, moments.size + 1) for of in (residual[one.fitted], None))
        left.append(residual - (sums / np.maximum(counts, 1))[part])
        kept.append(one.fitted)
        free += int(one.fitted.sum()) - int(np.count_nonzero(counts))
    count = sum(int(one.sum()) for one in kept)
    return min(correlated_sd(left, kept) * math.sqrt(count / max(free, 1)), state.evidence.noise_sd)


def may_differ(state: State, sessions: Sequence[Session]) -> bool:
    """Whether gains or zeros of their own may be what is wrong: of recordings of which none carries on from another.

    More is left than small imperfections of a good unit add up to, or something was found that goes with cycles.
    """
    fitted = fitted_of(sessions)
    if any("continues" in one.recording.metadata for one in fitted):
        return False
    goes_with_cycles = any(part.effect.needs_cycles for part in state.fit.model.parts)
    return goes_with_cycles or _left_by(state.fit.model, fitted, state.thresholds) > state.thresholds.tolerable


def with_changes(state: State, gained: _Gained, *, of_zero: bool = False) -> _Gained:
    """``gained``, each with another gain, or zero, from each moment on where that is likelier, one after the other.

    Of many recordings each is short, and gains of their own are all that is asked.
    """
    fitted = fitted_of(gained.sessions)
    if len(fitted) > MOST_FOLDS:
        return gained
    model, zero_sd = state.given.model, state.thresholds.strength_sd if of_zero else 0.0
    moments = [moments_of(one, state.thresholds) for one in fitted]
    ends = np.cumsum([one.size for one in moments])
    if not ends[-1]:
        return gained
    moved = [
        np.full(one.reading.size, zero_sd) if of_zero else one.own_gain_sd * model.simulate(one.conditions)
        for one in fitted
    ]
    rounded = [rounded_to(one, model, state.thresholds) for one in fitted] if of_zero else []
    steps = [StepColumns.of(*each) for each in zip(fitted, moved, moments, strict=True)]
    none = [replace(one, starts=one.starts[:0]) for one in steps]
    for _ in range(MOST_CHANGES * len(fitted)):
        falls = gained.evidence.falls_beside(gained.kept, steps)
        each = zip(fitted_of(gained.sessions), moments, strict=True)
        falls[~np.concatenate([_may_change(*one) for one in each])] = -math.inf
        while falls.max() >= gained.odds_of_a_change:
            best = int(np.argmax(falls))
            k = int(np.searchsorted(ends, best, side="right"))
            one, j = fitted_of(gained.sessions)[k], best - int(ends[k]) + moments[k].size
            # Between the moments beside it, so that what changes once is not told as two changes around it.
            around = np.arange(*(one.reading.size * beside // (moments[k].size + 1) for beside in (j, j + 2)))[1:]
            around = around[_may_change(one, around)]
            alone = [*none[:k], StepColumns.of(one, moved[k], around), *none[k + 1 :]]
            at = int(around[np.argmax(gained.evidence.falls_beside(gained.kept, alone))])
            changed = _changed(one, at, zero_sd)
            if not of_zero or may_jump(changed, at, state.fit.model, rounded[k], state.thresholds):
                break
            falls[best] = -math.inf  # beside others it may be seen to be no stair
        else:
            break
        sessions = [changed if other is one else other for other in gained.sessions]
        gained = _Gained.of(state, sessions, gained.evidence.noise_sd)
    return gained


def _may_change(session: Session, at: Index) -> Mask:
    """(k,) at which samples something may change: what is undone within a load cycle is what that cycle did."""
    known = session.cycle[[*session.gain_changes, *session.zero_changes]]
    return np.isin(session.cycle[at], known, invert=True)


def _changed(session: Session, at: int, zero_sd: float) -> Session:
    """A session with another gain, or a zero that lies beside by so much, from a sample on."""
    if zero_sd:
        return replace(session, zero_changes=tuple(sorted({*session.zero_changes, at})), zero_sd=zero_sd)
    return replace(session, gain_changes=tuple(sorted({*session.gain_changes, at})))


def are_told(state: State, found: _Gained, gained: _Gained) -> bool:
    """Whether gains of their own, which ``gained`` has, are likelier than what was ``found`` without, or some of it.

    Against them are the odds against an effect, and they must move the reading by more than small imperfections of a
    good unit together. With them, either fewer effects leave no more, or they account for the larger part of what is
    left; and what is left out in turn is foreseen with half the squared error: else they take up what equations miss
    where recordings are of other loads or rates.
    """
    sessions, thresholds = found.sessions, state.thresholds
    if gained.score_beside(sessions) >= found.score_beside(sessions):
        return False
    model = gained.model(state)
    tried = {one: _left_by(one, sessions, thresholds) for one in (state.fit.model, found.model(state))}
    without = min(tried, key=lambda one: tried[one])
    left = [residual_of(one, model) for one in gained.sessions]
    moved = [rest - residual_of(one, model) for one, rest in zip(sessions, left, strict=True)]
    if fitted_rms(sessions, moved) <= thresholds.tolerable:
        return False
    before, after = tried[without], beyond_noise(sessions, left, thresholds)
    is_simpler = len(gained.kept) < len(found.kept) and after <= before
    if not is_simpler and thresholds.clear * after**2 > before**2:
        return False
    before, after = (
        float(LeftOut(some, gained.evidence.noise_sd, one, thresholds, is_apart=True).errors(one).sum())
        for some, one in ((sessions, without), (gained.sessions, model))
    )
    return thresholds.clear * after <= before


def foretells(
    model: ExtendedModel, plain: ExtendedModel, state: State, sessions: Sequence[Session], gained: Sequence[Session]
) -> bool:
    """Whether ``model``, found beside the gains or zeros of ``gained``, predicts ``sessions`` better than ``plain``.

    By the gain that all share, and zeros that do not change: what is a recording's own says nothing of another one.
    What changes within recordings is tested by leaving these out in turn. Gains of whole recordings are not, since they
    bend what is fitted to fewer of them: there the model must but follow what was fitted.
    """
    if not any(one.gain_changes or one.zero_changes for one in gained):
        return error_of(sessions, model) < error_of(sessions, plain)
    return LeftOut(sessions, state.evidence.noise_sd, model, state.thresholds, is_apart=True).stands(model, plain)


def gains_of(sessions: Sequence[Session], model: ExtendedModel, thresholds: Thresholds) -> tuple[OwnGain, ...]:
    """The gains of the fitted recordings, in order; each begins where a load first shows it."""
    found = []
    for one, gains, _ in _own_of_each(sessions, model):
        for at, gain in zip((0, *one.gain_changes), gains, strict=False):  # none where all share one
            last, first = _loaded_about(one, at, thresholds) if at else (0, 0)
            begins_s = _time_s(one, first)
            unseen_s = begins_s - _time_s(one, last) if first > last + 1 else 0.0
            found.append(OwnGain(one.recording.name, begins_s, one.own_gain_sd * float(gain), at > 0, unseen_s))
    return tuple(found)


def _loaded_about(session: Session, at: int, thresholds: Thresholds) -> tuple[int, int]:
    """The last sample under load before ``at``, and the first one from there on; ``at`` itself where there is none."""
    loaded = np.abs(session.conditions.load) > thresholds.standing
    before, after = np.flatnonzero(loaded[:at]), np.flatnonzero(loaded[at:])
    return int(before[-1]) if before.size else at, at + int(after[0]) if after.size else at


def zero_changes_of(sessions: Sequence[Session], model: ExtendedModel) -> tuple[ZeroChange, ...]:
    """Where the zero of a fitted recording changes: when, and by what, the largest first."""
    found = (
        ZeroChange(one.recording.name, _time_s(one, at), one.zero_sd * float(share))
        for one, _, steps in _own_of_each(sessions, model)
        for at, share in zip(one.zero_changes, steps, strict=True)
    )
    return tuple(sorted(found, key=lambda one: -abs(one.share)))


def _own_of_each(sessions: Sequence[Session], model: ExtendedModel) -> Iterator[tuple[Session, Array, Array]]:
    """Each fitted recording with its own gains (k,) and the changes of its zero (l,)."""
    for one in fitted_of(sessions):
        own, _ = own_of(one, model, one.reading - model.simulate(one.conditions))
        yield one, *changes_in(one, own)


def _time_s(session: Session, at: int) -> float:
    """The file's time at a sample of a session."""
    return float(session.recording.time_s[0] + session.conditions.time_s[at])


def time_of(change: OwnGain | ZeroChange) -> str:
    """When it changes: a moment, or the stretch without a load in which it may have been any."""
    ends = moment(change.begins_s, 4)
    if not change.unseen_s:
        return f"at {ends} s"
    return f"between {moment(change.begins_s - change.unseen_s, 4)} and {ends} s, without load"


def changes_of(gains: Sequence[OwnGain]) -> tuple[OwnGain, ...]:
    """Where gains change within a recording: when, and by what share, the largest first."""
    changes = [replace(one, share=one.share - last.share) for last, one in pairwise(gains) if one.is_change]
    return tuple(sorted(changes, key=lambda one: -abs(one.share)))


def _left_by(model: ExtendedModel, sessions: Sequence[Session], thresholds: Thresholds) -> float:
    """Rms of what a model leaves of what is fitted, beyond white noise."""
    return beyond_noise(sessions, [residual_of(one, model) for one in sessions], thresholds)
