"""Which effects the data holds: search over a linearised model and fits of the real one, in turn.

What is held out for judging is not looked at here. Validation is within the fitted recordings: each is left out in turn
(or blocks of its cycles, where there is one), and an effect that makes any of them worse is taken out again.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from smartshoe.arrays import Array, Mask
from smartshoe.diagnosis._baseline import USUAL
from smartshoe.diagnosis._evidence import Evidence, Members, Posterior
from smartshoe.diagnosis._held_out import residual_of
from smartshoe.diagnosis._likelihood import Fit, Likelihood, fit
from smartshoe.diagnosis._noise import correlated_sd
from smartshoe.diagnosis._search import BREADTH, additions, allowed, search, step
from smartshoe.diagnosis._sensitivity import Candidate, Linearised, available, linearised
from smartshoe.diagnosis._session import Session
from smartshoe.integrity.thresholds import Thresholds
from smartshoe.models.effects import Effect, blocks, catalogue
from smartshoe.models.effects.effect import CoreEffect
from smartshoe.models.elements import Arm
from smartshoe.models.extended import ExtendedModel
from smartshoe.signals.loading import turning_points

Progress = Callable[[str], None]

ROUNDS = 6
ROUND_STEPS = 6  # of a fit that is linearised anew anyway
FEW_STEPS = 4  # of a fit that only has to be compared with others
RIVALS = 2
LENGTHS = (1.0, 0.5, 0.2, 0.05)  # of a first step
SIZES = (0.5, 5.0)  # typical ones of an effect, from which a fit begins


@dataclass(frozen=True, eq=False)
class Alternative:
    """Another explanation of what one member explains: ``effect``, None for nothing at all.

    ``margin`` is by how much -2 log of its evidence is worse.
    """

    effect: str | None
    margin: float


@dataclass(frozen=True, eq=False)
class Member:
    """An effect that was found.

    ``size``: rms by which the reading moves without it, all else fitted anew (``without``).
    ``departed``: how far the data asks its equation to depart, in usual departures.
    ``alternatives``: by evidence about the fit, nearest first. ``laws``: the family's other laws, each fitted in its
    place; margins, and the ``fall`` that the effect itself brings, of -2 log likelihood.
    """

    effect: Effect
    size: float
    departed: float
    alternatives: tuple[Alternative, ...]
    without: Fit
    laws: tuple[Alternative, ...]
    fall: float

    @property
    def name(self) -> str:
        """The effect's identifier."""
        return self.effect.name


@dataclass(frozen=True, eq=False)
class Inference:
    """``baseline`` and ``fit``: the plain and the extended model; ``likelihood`` they were fitted by.

    ``members``, largest first; ``screening``: what each effect alone would take off the baseline's score.
    """

    baseline: Fit
    fit: Fit
    likelihood: Likelihood
    members: tuple[Member, ...]
    screening: tuple[tuple[str, float], ...]
    refused: tuple[str, ...] = ()
    can_validate: bool = True


def infer(
    start: ExtendedModel, sessions: Sequence[Session], thresholds: Thresholds, progress: Progress, is_unit: bool = True
) -> Inference:
    """The effects in the fitted part of ``sessions``, beside the baseline ``start``; none where it is no unit's."""
    progress("fitting the baseline")
    plain = least_squares(start, sessions, thresholds)
    given, evidence, best = _searched(plain.model, sessions, thresholds)
    screening = _screening(evidence)
    can_validate = independent(sessions, thresholds) > 1  # within one, nothing validates anything
    if not (is_unit and can_validate):
        likelihood = Likelihood(sessions, evidence.noise_sd, plain.model, thresholds)
        return Inference(plain, plain, likelihood, (), screening, (), can_validate)
    state = _settled(_State(given, evidence, best, plain), sessions, thresholds, progress)
    if any(isinstance(one.effect, CoreEffect) for one in state.chosen):
        progress("trying other relaxation rates of the baseline")
        again = _settled(_with_another_pole(state, sessions, thresholds), sessions, thresholds, progress)
        state = again if _is_simpler(again.fit, state, sessions) else state
    if state.fit.model.relaxing_share < 0.0:
        again = _settled(_with_an_arm_that_creeps(state, sessions, thresholds), sessions, thresholds, progress)
        state = again if _is_simpler(again.fit, state, sessions) else state
    state = _with_laws(state, sessions, thresholds, progress)
    progress("weighing alternatives")
    found = _judged(state, plain, sessions, screening)
    while (law := _likelier_law(found, state.banned)) is not None:
        state = _with_law(state, *law, sessions)
        found = _judged(state, plain, sessions, screening)
    return found


def _judged(
    state: _State, plain: Fit, sessions: Sequence[Session], screening: tuple[tuple[str, float], ...]
) -> Inference:
    """What of a state's effects predicts what is left out, fitted at last, each weighed against its alternatives."""
    given, evidence, best, extended = state.given, state.evidence, state.best, state.fit
    thresholds = given.thresholds
    refused: list[str] = []
    while (worst := _worse(evidence, best)) is not None:
        refused.append(given.candidates[worst].name)
        best = search(evidence, tuple(m for m in best.members if m != worst), [*refused, *state.banned])
    likelihood = Likelihood(sessions, evidence.noise_sd, extended.model, thresholds)
    extended = fit(likelihood, _with(given, best, extended.model, likelihood))
    while (beyond := _extrapolates(sessions, extended.model, thresholds)) is not None:
        refused.append(beyond)
        best = evidence.posterior(tuple(m for m in best.members if given.candidates[m].name != beyond))
        extended = fit(likelihood, extended.model.without(beyond))
    went_astray = _error(sessions, extended.model) >= _error(sessions, plain.model)
    if not extended.model.parts or went_astray or _foreseen(evidence, best) < thresholds.foreseen:
        extended, best = plain, evidence.posterior(())
    members = _members(evidence, best, refused, likelihood, extended)
    return Inference(plain, extended, likelihood, members, screening, tuple(refused))


def _likelier_law(found: Inference, banned: Sequence[str]) -> tuple[str, str] | None:
    """A member, and the law of its family that follows better in its place, if one does: fits of the whole model tell.

    The linearised search prefers what comes nearest to all equations of the family.
    """
    for member in found.members:
        nearest = next(iter(member.laws), None)
        if nearest is None or nearest.margin >= 0.0 or nearest.effect in banned or member.effect.is_flexible:
            continue
        return member.name, str(nearest.effect)
    return None


def _with_law(state: _State, name: str, law: str, sessions: Sequence[Session]) -> _State:
    """``state`` with ``law`` in the place of its member ``name``, and not the other way round again."""
    thresholds = state.given.thresholds
    effect = catalogue()[law]
    likelihood = Likelihood(sessions, state.evidence.noise_sd, state.fit.model, thresholds)
    bare = state.fit.model.without(name)
    starts = [bare.with_part(effect, effect.begun(shape)) for shape in effect.shapes]
    found = fit(likelihood, min(starts, key=likelihood.cost))
    return _state_at(found, sessions, thresholds, (*state.banned, name))


def least_squares(start: ExtendedModel, sessions: Sequence[Session], thresholds: Thresholds) -> Fit:
    """The best predictor of the form of ``start``: output error, each correlation time of what is left counted once."""
    residuals, kept = [residual_of(one, start) for one in sessions], [one.fitted for one in sessions]
    return fit(Likelihood(sessions, correlated_sd(residuals, kept), start, thresholds), start)


@dataclass(frozen=True, eq=False)
class _State:
    """A linearisation about ``fit``, and the best set in it; ``banned`` are blocks that a law has replaced."""

    given: Linearised
    evidence: Evidence
    best: Posterior
    fit: Fit
    banned: tuple[str, ...] = ()

    @property
    def improved(self) -> float:
        """By how much the best set has more evidence than that of the fit."""
        return self.evidence.posterior(self.start).score - self.best.score

    @property
    def start(self) -> Members:
        """The set of the fit."""
        return tuple(k for k, one in enumerate(self.given.candidates) if one.name in self.fit.model.names)

    @property
    def bends(self) -> bool:
        """Whether a new effect is so large that it bends the linearisation."""
        new = [size for m, size in zip(self.best.members, self.best.sizes, strict=True) if m not in self.start]
        return max(new, default=0.0) > self.given.thresholds.linear

    @property
    def chosen(self) -> tuple[Candidate, ...]:
        """The candidates of the best set."""
        return tuple(self.given.candidates[m] for m in self.best.members)


def _state_at(found: Fit, sessions: Sequence[Session], thresholds: Thresholds, banned: tuple[str, ...] = ()) -> _State:
    """The linearisation about a fit, and the best set in it without what is ``banned``."""
    return _State(*_searched(found.model, sessions, thresholds, banned), found, banned)


def _is_simpler(other: Fit, state: _State, sessions: Sequence[Session]) -> bool:
    """Whether ``other`` is likelier than the fit of ``state``, odds against effects counted; or has fewer of them.

    The number decides where the two hardly read differently: what is immaterial counts for nothing, however sure it is.
    An arm that imitates a lag of a millisecond needs another one in its own place.
    """
    thresholds = state.given.thresholds
    likelihood = Likelihood(sessions, state.evidence.noise_sd, state.fit.model, thresholds)
    new, old = (
        (likelihood.cost(one.model) + state.evidence.odds * _effects(one.model), _effects(one.model))
        for one in (other, state.fit)
    )
    if apart(likelihood.sessions, state.fit.model, other.model) < thresholds.alike * thresholds.material:
        return (new[1], new[0]) < (old[1], old[0])
    return new[0] < old[0]


def _settled(state: _State, sessions: Sequence[Session], thresholds: Thresholds, progress: Progress) -> _State:
    """Fit, linearise and search in turn until nothing is worth another fit, or a set comes back.

    In the end an effect's arm is tried in the place of the baseline's: it may be the unit's only one.
    """
    seen: set[tuple[str, ...]] = set()
    for _ in range(ROUNDS):
        chosen = tuple(sorted(one.name for one in state.chosen))
        if chosen in seen or state.improved < state.evidence.odds:
            break
        seen.add(chosen)
        progress(f"fitting {', '.join(chosen).replace('_', ' ') or 'the baseline'}")
        likelihood = Likelihood(sessions, state.evidence.noise_sd, state.fit.model, thresholds)
        found = min(
            (
                fit(likelihood, _with(state.given, one, state.fit.model, likelihood), ROUND_STEPS)
                for one in _promising(state)
            ),
            key=lambda one: one.cost + state.evidence.odds * _strengths(one.model),
        )
        state = _state_at(found, sessions, thresholds, state.banned)
    for name, arm in _arms(state.fit.model):
        likelihood = Likelihood(sessions, state.evidence.noise_sd, state.fit.model, thresholds)
        found = fit(likelihood, _with_arm(state.fit.model.without(name), arm))
        if _is_simpler(found, state, sessions):
            state = _state_at(found, sessions, thresholds, state.banned)
    return state


def _promising(state: _State) -> list[Posterior]:
    """The best set; beside it others with one more effect, where the best one is too large for one linearisation.

    A large effect bends the model that its rivals were linearised about, so that fits of the best few decide.
    """
    if not state.bends:
        return [state.best]
    start = state.start
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


def _effects(model: ExtendedModel) -> int:
    """How many effects a model has: its parts, and an arm of the baseline's that falls where a wall's creeps."""
    return len(model.parts) + (model.relaxing_share < 0.0)


def _strengths(model: ExtendedModel) -> int:
    """How many strengths a model's effects have: parameters that are null where the effect is not there."""
    return sum(parameter.null is not None for part in model.parts for parameter in part.effect.parameters)


def _with_laws(given: _State, sessions: Sequence[Session], thresholds: Thresholds, progress: Progress) -> _State:
    """``given`` with a law in the place of a flexible curve, where one follows nearly as well.

    No law is exact: one that leaves less than the square of the usual departure, of what the flexible curve explains,
    is the law; of the mean departure, where a shape lies at a bound, beyond which the equation means something else.
    One that leaves less than the mean departure's stays: what it misses is no other curve. A block is bent before a law
    is, so that only fits of the whole model compare them fairly.
    """
    state = given
    curves = tuple(one.name for family in blocks().values() for one in family if one.is_memoryless)
    for block in state.chosen:
        if not (block.effect.is_flexible and block.effect.is_memoryless):
            continue
        likelihood = Likelihood(sessions, state.evidence.noise_sd, state.fit.model, thresholds)
        bare = state.fit.model.without(block.name)
        for part in bare.parts:
            if part.effect.is_memoryless:
                bare = bare.without(part.name)
        nothing = fit(likelihood, bare, FEW_STEPS)
        flexible = likelihood.cost(state.fit.model)
        misses: list[tuple[float, Fit]] = []
        for law in (e for e in catalogue().values() if e.is_memoryless):
            one = _curved(law, nothing.model, likelihood)
            # A law of another family is another name, with the odds against one.
            other = state.evidence.odds if law.family != block.effect.family else 0.0
            most = thresholds.departure if _is_stretched(one.model) else thresholds.law_departure
            missed = (one.cost + other - flexible) / max(nothing.cost - flexible, other, 1e-9)
            if missed < most**2:
                misses.append((missed, one))
        if misses:
            missed, best = min(misses, key=lambda pair: pair[0])
            banned = curves if missed < thresholds.departure**2 else ()
            state = _state_at(best, sessions, thresholds, banned)
    return state if state is given else _settled(state, sessions, thresholds, progress)


def _curved(law: Effect, model: ExtendedModel, likelihood: Likelihood) -> Fit:
    """``model`` with a memoryless law: the best of fits from all its shapes, small and large.

    A corner below the least load, or a bend beyond the largest, has no slope towards where it belongs.
    """
    starts = [model.with_part(law, law.begun(shape, sizes)) for shape in law.shapes for sizes in SIZES]
    return fit(likelihood, min((fit(likelihood, one, 1) for one in starts), key=lambda f: f.cost).model, FEW_STEPS)


def _is_stretched(model: ExtendedModel) -> bool:
    """Whether a shape of the last effect lies at a bound: beyond it the equation means something else."""
    last = model.parts[-1]
    return any(
        parameter.null is None and not parameter.lower < float(value) < parameter.upper
        for parameter, value in zip(last.effect.parameters, last.values, strict=True)
    )


def _with_another_pole(state: _State, sessions: Sequence[Session], thresholds: Thresholds) -> _State:
    """The best of fits from several relaxation rates without the effects that add arms to the baseline's.

    An effect that bent the baseline's rate at first leaves the true rate to be found as a second arm.
    """
    likelihood = Likelihood(sessions, state.evidence.noise_sd, state.fit.model, thresholds)
    bare = _without_core_effects(state.fit.model)
    share = USUAL.relaxing_share
    starts = [replace(bare, relaxation_rate_per_s=1.0 / tau, relaxing_share=share) for tau in thresholds.memory_s]
    best = min((fit(likelihood, one, FEW_STEPS) for one in starts), key=lambda one: one.cost)
    return _state_at(best, sessions, thresholds)


def _with_an_arm_that_creeps(state: _State, sessions: Sequence[Session], thresholds: Thresholds) -> _State:
    """The best of fits from a baseline that creeps under load, where that of ``state`` falls.

    Which of two exponentials is the baseline's is a convention: of a wall it is the one that creeps under load, and
    what falls is an effect's. It may be the arm of an effect that was found, or hidden by the one that falls.
    """
    bare = _without_core_effects(state.fit.model)
    arms = [Arm(USUAL.relaxing_share, 1.0 / tau) for tau in thresholds.memory_s]
    likelihood = Likelihood(sessions, state.evidence.noise_sd, state.fit.model, thresholds)
    found = []
    for start in (_with_arm(bare, arm) for arm in [*arms, *(arm for _, arm in _arms(state.fit.model))]):
        given, _, best = _searched(start, sessions, thresholds)
        found.append(fit(likelihood, _with(given, best, start, likelihood), FEW_STEPS))
    nearest = min(found, key=lambda one: one.cost + state.evidence.odds * _effects(one.model))
    return _state_at(nearest, sessions, thresholds)


def _without_core_effects(model: ExtendedModel) -> ExtendedModel:
    for part in model.parts:
        if isinstance(part.effect, CoreEffect):
            model = model.without(part.name)
    return model


def _arms(model: ExtendedModel) -> list[tuple[str, Arm]]:
    """The arms that creep under load, one each, of a model's effects, by name."""
    made = [
        (part.name, part.effect.elements(part.values)) for part in model.parts if isinstance(part.effect, CoreEffect)
    ]
    return [(name, arm) for name, (arm, *more) in made if not more and isinstance(arm, Arm) and arm.share > 0.0]


def _with_arm(model: ExtendedModel, arm: Arm) -> ExtendedModel:
    return replace(model, relaxing_share=arm.share, relaxation_rate_per_s=arm.rate_per_s)


def independent(sessions: Sequence[Session], thresholds: Thresholds) -> int:
    """Recordings that are fitted, or load cycles of a single one: what can be left out and predicted from the rest."""
    fitted = [session for session in sessions if session.fitted.any()]
    if len(fitted) > 1:
        return len(fitted)
    load = fitted[0].conditions.load
    points = turning_points(load, thresholds.cycle * max(float(np.ptp(load)), 1e-9))
    return sum(load[b] > load[a] for a, b in pairwise(points))


def _searched(
    model: ExtendedModel, sessions: Sequence[Session], thresholds: Thresholds, banned: Sequence[str] = ()
) -> tuple[Linearised, Evidence, Posterior]:
    """A linearisation and the best set in it; one change only where the next effect is so large that it bends it."""
    given = linearised(model, sessions, thresholds)
    evidence = Evidence(given, given.noise_sd())
    start = tuple(k for k, one in enumerate(given.candidates) if one.name in model.names)
    first = step(evidence, start, banned)
    new = [size for m, size in zip(first.members, first.sizes, strict=True) if m not in start]
    if max(new, default=0.0) > thresholds.linear:
        return given, evidence, first
    return given, evidence, search(evidence, first.members, banned)


def _screening(evidence: Evidence) -> tuple[tuple[str, float], ...]:
    nothing = evidence.posterior(()).score
    found = [
        (evidence.given.candidates[k].name, nothing - evidence.posterior((k,)).score)
        for k in additions(evidence, (), 2 * BREADTH)
    ]
    return tuple(sorted(found, key=lambda one: -one[1]))


def _with(given: Linearised, found: Posterior, model: ExtendedModel, likelihood: Likelihood) -> ExtendedModel:
    """``model`` with exactly the effects that were found; new ones on the way to their linear estimates.

    As far as is best of several lengths: a curve that is far from straight is far from its linear estimate.
    """
    names = {given.candidates[m].name for m in found.members}
    for part in model.parts:
        if part.name not in names:
            model = model.without(part.name)
    new = [
        (given.candidates[member], strengths / given.scales[list(given.candidates[member].columns)])
        for member, strengths in zip(found.members, found.strengths, strict=True)
        if given.candidates[member].name not in model.names
    ]

    def begun(length: float) -> ExtendedModel:
        out = model
        for one, strengths in new:
            out = out.with_part(one.effect, one.start(length * strengths))
        return out

    return min((begun(length) for length in LENGTHS), key=likelihood.cost) if new else model


def _worse(evidence: Evidence, best: Posterior) -> int | None:
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


def _foreseen(evidence: Evidence, best: Posterior) -> float:
    """The share of the baseline's squared error over what is left out in turn that the set does away with."""
    nothing = float(evidence.left_out_errors(()).sum())
    return 1.0 - float(evidence.left_out_errors(best.members).sum()) / nothing if nothing > 0.0 else 0.0


def _extrapolates(sessions: Sequence[Session], model: ExtendedModel, thresholds: Thresholds) -> str | None:
    """An effect that moves recordings that were not fitted far more than those that were; their loads alone decide."""
    whole = [model.simulate(one.conditions) for one in sessions]
    for part in model.parts:
        less = model.without(part.name)
        by = [reading - less.simulate(one.conditions) for reading, one in zip(whole, sessions, strict=True)]
        within = _spread(by, [one.fitted for one in sessions])
        if _spread(by, [one.judged for one in sessions]) > thresholds.extrapolates * max(within, thresholds.material):
            return part.name
    return None


def _error(sessions: Sequence[Session], model: ExtendedModel) -> float:
    """Rms of what is left of what is fitted."""
    return _fitted_rms(sessions, lambda session: residual_of(session, model))


def _spread(signals: Sequence[Array], seen: Sequence[Mask]) -> float:
    """Rms of ``signals``, (n,) each, where ``seen``, each about its own mean."""
    parts = [signal[mask] - signal[mask].mean() for signal, mask in zip(signals, seen, strict=True) if mask.any()]
    return math.sqrt(sum(float(one @ one) for one in parts) / max(sum(one.size for one in parts), 1))


def _in_standard_errors(gains: Array) -> float:
    """The mean of ``gains`` (n,) over its standard error."""
    error = float(np.std(gains, ddof=1)) / math.sqrt(gains.size) if gains.size > 1 else 0.0
    return float(gains.mean()) / max(error, 1e-300)


def _members(
    evidence: Evidence, best: Posterior, refused: Sequence[str], likelihood: Likelihood, extended: Fit
) -> tuple[Member, ...]:
    made = []
    for member, departed in zip(best.members, best.departed, strict=True):
        one = evidence.given.candidates[member]
        less = fit(likelihood, extended.model.without(one.name), FEW_STEPS)
        size = apart(likelihood.sessions, less.model, extended.model)
        others = _other_laws(one, less, likelihood, extended) if size > evidence.thresholds.material else ()
        near = alternatives(evidence, best, member, refused)
        made.append(Member(one.effect, size, departed, near, less, others, less.cost - extended.cost))
    return tuple(sorted(made, key=lambda one: -one.size))


def _other_laws(one: Candidate, less: Fit, likelihood: Likelihood, extended: Fit) -> tuple[Alternative, ...]:
    """The other laws of a member's family, each fitted in its place, nearest first."""
    channels = {e.name for e in available(likelihood.sessions)}
    found = []
    for law in catalogue().values():
        if law.family != one.effect.family or law.name == one.name or law.name not in channels:
            continue
        starts = [less.model.with_part(law, law.begun(shape)) for shape in law.shapes]
        best = min(starts, key=likelihood.cost)
        found.append(Alternative(law.name, fit(likelihood, best, FEW_STEPS).cost - extended.cost))
    return tuple(sorted(found, key=lambda a: a.margin))


def apart(sessions: Sequence[Session], first: ExtendedModel, second: ExtendedModel) -> float:
    """Rms of the difference of two models' readings over what is fitted, each recording's own offset aside."""
    return _fitted_rms(sessions, lambda session: residual_of(session, first) - residual_of(session, second))


def _fitted_rms(sessions: Sequence[Session], signal_of: Callable[[Session], Array]) -> float:
    square, count = 0.0, 0
    for session in sessions:
        signal = signal_of(session)[session.fitted]
        square += float(signal @ signal)
        count += signal.size
    return float(np.sqrt(square / max(count, 1)))


def alternatives(evidence: Evidence, best: Posterior, member: int, refused: Sequence[str]) -> tuple[Alternative, ...]:
    """What could stand in a member's place: every other effect at its best shape, and nothing."""
    less = tuple(m for m in best.members if m != member)
    found = [Alternative(None, evidence.posterior(less).score - best.score)]
    for k in additions(evidence, less, 2 * BREADTH, refused):
        one = evidence.given.candidates[k]
        if one.name == evidence.given.candidates[member].name or one.effect.is_flexible:
            continue
        other = evidence.posterior((*less, k))
        if allowed(evidence, other):
            found.append(Alternative(one.name, other.score - best.score))
    return tuple(sorted(found, key=lambda one: one.margin))
