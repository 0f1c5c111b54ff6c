"""Which effects the data holds: search over a linearised model and fits of the real one, in turn.

What is held out for judging is not looked at here. Validation is within the fitted recordings: each is left out in turn
(or blocks of its cycles, where there is one), and an effect that makes any of them worse is taken out again.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from smartshoe.diagnosis._arms import (
    arms_of,
    effect_count,
    is_beyond_memory,
    is_stretched,
    with_a_latency,
    with_a_usual_arm,
    with_an_arm_that_creeps,
    with_another_pole,
    with_arm,
    with_odds,
)
from smartshoe.diagnosis._evidence import Evidence, Posterior
from smartshoe.diagnosis._held_out import residual_of
from smartshoe.diagnosis._laws import likelier_laws, with_laws, with_likelier_laws
from smartshoe.diagnosis._likelihood import FEW_STEPS, Fit, Likelihood, fit
from smartshoe.diagnosis._members import Member, begun_with, members_of
from smartshoe.diagnosis._noise import correlated_sd
from smartshoe.diagnosis._search import BREADTH, MOST_MEMBERS, additions
from smartshoe.diagnosis._session import Session
from smartshoe.diagnosis._state import State, evidence_about, searched, state_at, with_members
from smartshoe.diagnosis._validation import LeftOut, apart, cancelling, error_of, extrapolating
from smartshoe.integrity.thresholds import Thresholds
from smartshoe.models.effects.effect import CoreEffect
from smartshoe.models.extended import ExtendedModel
from smartshoe.signals.loading import turning_points

Progress = Callable[[str], None]

# Resolutions: half and twice of each changed no name in two cases. With four steps one measured sensor, of which no
# equation fits, is left unnamed.
ROUNDS = 6
ROUND_STEPS = 6  # of a fit that is linearised anew anyway
RIVALS = 2  # that are fitted beside a set that bends


@dataclass(frozen=True, eq=False)
class Inference:
    """``baseline`` and ``fit``: the plain and the extended model; ``likelihood`` they were fitted by.

    ``members``, largest first; ``screening``: what each effect alone would take off the baseline's score; ``undone``:
    members that fit by their difference, of which one is idle, and others undo one another without it.
    """

    baseline: Fit
    fit: Fit
    likelihood: Likelihood
    members: tuple[Member, ...]
    screening: tuple[tuple[str, float], ...]
    refused: tuple[str, ...] = ()
    can_validate: bool = True
    undone: tuple[str, ...] = ()


def infer(
    start: ExtendedModel, sessions: Sequence[Session], thresholds: Thresholds, progress: Progress, is_unit: bool = True
) -> Inference:
    """The effects in the fitted part of ``sessions``, beside the baseline ``start``; none where it is no unit's."""
    progress("fitting the baseline")
    plain = least_squares(start, sessions, thresholds)
    given, evidence, best = searched(plain.model, sessions, thresholds)
    screening = _screening(evidence)
    can_validate = independent(sessions, thresholds) > 1  # within one, nothing validates anything
    if not (is_unit and can_validate):
        likelihood = Likelihood(sessions, evidence.noise_sd, plain.model, thresholds)
        return Inference(plain, plain, likelihood, (), screening, (), can_validate)
    state = State(given, evidence, best, plain)
    if is_stretched(plain.model):
        state = _simpler(with_a_latency(state, sessions), state, sessions)
    begun = state
    state = _settled(state, sessions, progress)
    if is_beyond_memory(state.fit.model, thresholds):
        progress("beginning anew from arms as units have")
        state = _better_from(with_a_usual_arm(begun, sessions), state, sessions, progress)
    if any(isinstance(one.effect, CoreEffect) for one in state.chosen):
        progress("trying other relaxation rates of the baseline")
        state = _better_from(with_another_pole(state, sessions), state, sessions, progress)
    if state.fit.model.relaxing_share < 0.0:
        state = _better_from(with_an_arm_that_creeps(state, sessions), state, sessions, progress)
    if flexible := [one.name.replace("_", " ") for one in state.chosen if one.effect.is_flexible]:
        progress(f"trying laws in the place of {', '.join(flexible)}")
    lawful = with_laws(state, plain.model, sessions)
    state = state if lawful is state else _settled(lawful, sessions, progress)
    progress("weighing alternatives")
    found = _judged(state, plain, sessions)
    members = found.members()
    while laws := likelier_laws(members, state.banned):
        state = with_likelier_laws(state, found.fit.model, laws, sessions)
        other = _judged(state, plain, sessions)
        odds = state.evidence.odds
        if _score(other.fit.model, other.likelihood, odds) >= _score(found.fit.model, other.likelihood, odds):
            break  # a law that follows better in its place led to a set that does not
        found, members = other, other.members()
    if found.is_stepped_down:
        found = found.with_nothing_but(plain)
        members = found.members()
    return Inference(plain, found.fit, found.likelihood, members, screening, found.refused, undone=found.undone)


@dataclass(frozen=True, eq=False)
class _Judged:
    """What of a state's effects predicts what is left out: the set and its ``fit``, and what was taken out of it.

    ``is_stepped_down``: effects were taken out for no other reason than that what is left out is foreseen better. That
    shows which laws may be likelier in the place of those that are left. As an answer it is none: what was chosen for
    what is left out says nothing of whether it is there, nor of any other recording.
    """

    evidence: Evidence
    best: Posterior
    fit: Fit
    likelihood: Likelihood
    refused: tuple[str, ...]
    undone: tuple[str, ...]
    is_stepped_down: bool

    def with_nothing_but(self, plain: Fit) -> _Judged:
        """What the plain model itself has, two clocks, which were told before any model."""
        candidates, own = self.evidence.given.candidates, plain.model.names
        best = self.evidence.posterior(tuple(m for m in self.best.members if candidates[m].name in own))
        refused = (*self.refused, *(name for name in self.fit.model.names if name not in own))
        return replace(self, fit=plain, best=best, refused=refused, undone=())

    def members(self) -> tuple[Member, ...]:
        """Each effect weighed against its alternatives."""
        return members_of(self.evidence, self.best, self.refused, self.likelihood, self.fit)


def _judged(state: State, plain: Fit, sessions: Sequence[Session]) -> _Judged:
    """What of a state's effects predicts what is left out, fitted at last."""
    given, evidence, best, extended = state.given, state.evidence, state.best, state.fit
    likelihood, most = state.likelihood(sessions), error_of(sessions, plain.model)
    left_out = LeftOut(sessions, evidence.noise_sd, extended.model, state.thresholds)
    whole = fit(likelihood, with_members(given, best, extended.model, likelihood))
    extended = left_out.following(whole)
    refused = [name for name in whole.model.names if name not in extended.model.names]
    best = evidence.posterior(tuple(m for m in best.members if given.candidates[m].name not in refused))
    if extended.model.parts and error_of(sessions, extended.model) >= most:
        # A model that others had bent: from the plain one, each effect at its likeliest shape.
        model = plain.model
        for one in (given.candidates[m].effect for m in best.members):
            model = fit(likelihood, begun_with(one, model, likelihood), FEW_STEPS).model
        extended = fit(likelihood, model)
    undone = cancelling(sessions, extended.model, state.thresholds)
    if undone:
        less = {name: fit(likelihood, extended.model.without(name)) for name in undone}
        idle = min(undone, key=lambda name: less[name].cost)
        if error_of(sessions, less[idle].model) ** 2 > state.thresholds.clear * error_of(sessions, extended.model) ** 2:
            undone = []  # each is needed, though they pull in opposite ways
        elif not cancelling(sessions, less[idle].model, state.thresholds):
            undone = []
            refused.append(idle)
            extended = less[idle]
    while (beyond := extrapolating(sessions, extended.model, state.thresholds)) is not None:
        refused.append(beyond)
        extended = fit(likelihood, extended.model.without(beyond))
    extra = [name for name in extended.model.names if name not in plain.model.names]
    followed = extended
    while extra and (error_of(sessions, extended.model) >= most or not left_out.stands(extended.model, plain.model)):
        less = {name: fit(likelihood, extended.model.without(name), FEW_STEPS) for name in extra}
        worst = min(extra, key=lambda name: float(left_out.errors(less[name].model).sum()))
        refused.append(worst)
        extra.remove(worst)
        extended = less[worst]
    extended = extended if extra else plain
    kept = extended.model.names
    if refused and kept:
        evidence, best = evidence_about(extended.model, sessions, evidence)
    else:
        best = evidence.posterior(tuple(m for m in best.members if given.candidates[m].name in kept))
    left = tuple(name for name in undone if name in kept)
    is_stepped_down = bool(extra) and extended is not followed
    return _Judged(evidence, best, extended, likelihood, tuple(refused), left, is_stepped_down)


def least_squares(start: ExtendedModel, sessions: Sequence[Session], thresholds: Thresholds) -> Fit:
    """The best predictor of the form of ``start``: output error, each correlation time of what is left counted once."""
    residuals, kept = [residual_of(one, start) for one in sessions], [one.fitted for one in sessions]
    return fit(Likelihood(sessions, correlated_sd(residuals, kept), start, thresholds), start)


def _better_from(begun: State, state: State, sessions: Sequence[Session], progress: Progress) -> State:
    """What settles from ``begun``, where that is simpler than ``state``."""
    other = _settled(begun, sessions, progress, state)
    return state if other is state else replace(_simpler(other, state, sessions), path=(*state.path, *other.path))


def _simpler(other: State, state: State, sessions: Sequence[Session]) -> State:
    return other if _is_simpler(other.fit, state, sessions) else state


def _is_simpler(other: Fit, state: State, sessions: Sequence[Session]) -> bool:
    """Whether ``other`` is likelier than the fit of ``state``, odds against effects counted; or has fewer of them.

    The number decides where the two hardly read differently: what is immaterial counts for nothing, however sure it is.
    An arm that imitates a lag of a millisecond needs another one in its own place.
    """
    thresholds, likelihood = state.thresholds, state.likelihood(sessions)
    odds = state.evidence.odds
    new, old = ((_score(one.model, likelihood, odds), effect_count(one.model)) for one in (other, state.fit))
    if _read_alike(other.model, state.fit.model, likelihood, thresholds):
        return (new[1], new[0]) < (old[1], old[0])
    return new[0] < old[0]


def _read_alike(one: ExtendedModel, other: ExtendedModel, likelihood: Likelihood, thresholds: Thresholds) -> bool:
    return apart(likelihood.sessions, one, other) < thresholds.alike * thresholds.material


def _are_alike(one: ExtendedModel, other: ExtendedModel, likelihood: Likelihood, thresholds: Thresholds) -> bool:
    """Whether two models have the same effects, and hardly read differently."""
    return {*one.names} == {*other.names} and _read_alike(one, other, likelihood, thresholds)


def _score(model: ExtendedModel, likelihood: Likelihood, odds: float) -> float:
    """-2 log likelihood of a model, with the ``odds`` against each of its effects; the less, the better."""
    return with_odds(likelihood.cost(model), model, odds)


def _settled(state: State, sessions: Sequence[Session], progress: Progress, known: State | None = None) -> State:
    """Fit, linearise and search in turn until nothing is worth another fit.

    Where fits lead to one another in a circle, the likeliest of them is the answer; where one comes upon the path of a
    state that is ``known``, it would go the same way, and that state is. In the end an effect's arm is tried in the
    place of the baseline's: it may be the unit's only one.
    """
    seen: set[tuple[tuple[str, ...], tuple[str, ...]]] = set()
    visited = [state]
    # A set about another fit is another one: of a large effect a rival may have been fitted in its place.
    while state.improved >= state.evidence.odds and _names(state) not in seen and len(visited) <= ROUNDS:
        seen.add(_names(state))
        _, chosen = _names(state)
        progress(f"fitting {', '.join(chosen).replace('_', ' ') or 'the baseline'}")
        likelihood = state.likelihood(sessions)
        found = min(
            (
                fit(likelihood, with_members(state.given, one, state.fit.model, likelihood), ROUND_STEPS)
                for one in _promising(state)
            ),
            key=lambda one: one.cost + state.evidence.odds * _strengths(one.model),
        )
        if known is not None and any(_are_alike(found.model, one, likelihood, state.thresholds) for one in known.path):
            return known
        state = state_at(found, sessions, state.thresholds, state.banned)
        visited.append(state)
    if state.improved >= state.evidence.odds:
        state = _likeliest(visited)
    for name, arm in arms_of(state.fit.model):
        likelihood = state.likelihood(sessions)
        found = fit(likelihood, with_arm(state.fit.model.without(name), arm))
        if _is_simpler(found, state, sessions):
            state = state_at(found, sessions, state.thresholds, state.banned)
    return replace(state, path=tuple(one.fit.model for one in visited))


def _names(state: State) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Effects that are fitted, and those that the search about the fit came to."""
    return tuple(sorted(state.fit.model.names)), tuple(sorted(one.name for one in state.chosen))


def _likeliest(visited: Sequence[State]) -> State:
    """The one whose own set has most evidence, and that set as its answer: what it leads to is among them.

    A linearisation promises more of a set than a fit of it keeps, so that each may promise most of another.
    """
    noise_sd = visited[-1].evidence.noise_sd
    best = min(visited, key=lambda one: Evidence(one.given, noise_sd).posterior(one.start).score)
    return replace(best, best=best.evidence.posterior(best.start))


def _promising(state: State) -> list[Posterior]:
    """The best set; beside it others with one more effect, where the best one is too large for one linearisation.

    A large effect bends the model that its rivals were linearised about, so that fits of the best few decide.
    """
    start = state.start
    if not state.bends or len(start) >= MOST_MEMBERS:
        return [state.best]
    taken = {state.given.candidates[m].slot for m in start}
    flexible = [
        k
        for k, one in enumerate(state.given.candidates)
        if one.effect.is_flexible
        and one.effect.is_memoryless
        and one.slot not in taken
        and one.name not in state.banned
    ]
    tried = {*additions(state.evidence, start, RIVALS, state.banned), *flexible}
    return [state.best, *(state.evidence.posterior((*start, k)) for k in sorted(tried))]


def _strengths(model: ExtendedModel) -> int:
    """How many strengths a model's effects have: parameters that are null where the effect is not there."""
    return sum(parameter.null is not None for part in model.parts for parameter in part.effect.parameters)


def independent(sessions: Sequence[Session], thresholds: Thresholds) -> int:
    """Recordings that are fitted, or load cycles of a single one: what can be left out and predicted from the rest."""
    fitted = [session for session in sessions if session.fitted.any()]
    if len(fitted) > 1:
        return len(fitted)
    load = fitted[0].conditions.load
    points = turning_points(load, thresholds.cycle * max(float(np.ptp(load)), 1e-9))
    return sum(load[b] > load[a] for a, b in pairwise(points))


def _screening(evidence: Evidence) -> tuple[tuple[str, float], ...]:
    nothing = evidence.posterior(()).score
    found = [
        (evidence.given.candidates[k].name, nothing - evidence.posterior((k,)).score)
        for k in additions(evidence, (), 2 * BREADTH)
    ]
    return tuple(sorted(found, key=lambda one: -one[1]))
