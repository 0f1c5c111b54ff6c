"""Which effects the data holds: search over a linearised model and fits of the real one, in turn.

What is held out for judging is not looked at here. Validation is within the fitted recordings: each is left out in turn
(or blocks of its cycles, where there is one), and an effect that makes any of them worse is taken out again.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from smartshoe.arrays import Array
from smartshoe.diagnosis._arms import (
    late_beside_usual_arm,
    with_a_usual_arm,
    with_an_arm_that_creeps,
    with_another_pole,
)
from smartshoe.diagnosis._baseline import is_beyond_memory, is_stretched
from smartshoe.diagnosis._evidence import Evidence, Posterior
from smartshoe.diagnosis._gains_and_zeros import (
    OwnGain,
    ZeroChange,
    foretells,
    gains_of,
    with_likelier_gains,
    zero_changes_of,
)
from smartshoe.diagnosis._held_out import residual_of
from smartshoe.diagnosis._laws import likelier, with_laws
from smartshoe.diagnosis._likelihood import FEW_STEPS, Fit, Likelihood, fit, weighed
from smartshoe.diagnosis._members import Member, members_of
from smartshoe.diagnosis._naming import probability_of_kind
from smartshoe.diagnosis._noise import correlated_sd
from smartshoe.diagnosis._search import BREADTH, additions
from smartshoe.diagnosis._sensitivity import NO_PRESSURES, is_remembered_by_gas
from smartshoe.diagnosis._session import Session, fitted_of, load_cycles
from smartshoe.diagnosis._settling import Progress, better_from, better_from_one, law_or_block, settled, simpler
from smartshoe.diagnosis._state import State, evidence_about, fit_of, searched, state_at
from smartshoe.diagnosis._validation import LeftOut, cancelling, error_of, extrapolating, folds_of
from smartshoe.integrity.thresholds import Thresholds
from smartshoe.models.effects import listed
from smartshoe.models.effects.effect import CoreEffect, Effect
from smartshoe.models.extended import ExtendedModel


@dataclass(frozen=True, eq=False)
class Inference:
    """``baseline`` and ``fit``: the plain and the extended model, each with the likelihood it was fitted by.

    ``members``, largest first; ``screening``: what each effect alone would take off the baseline's score, and
    ``likeness`` (k, k) of the same k, `Evidence.likeness`; ``undone``: members that fit by their difference, of which
    one is idle, and others undo one another without it. ``alone``: the effect that does most by itself, where no
    member is sure. ``nearest``: where there is no member, an effect that alone follows most of what the baseline
    leaves, with rms of that and of what it leaves itself, shares of full scale. ``own_gains``: those of the recordings,
    where they differ by them; ``zero_changes``: when their zeros change.
    """

    baseline: Fit
    fit: Fit
    members: tuple[Member, ...]
    screening: tuple[tuple[str, float], ...]
    likeness: Array
    refused: tuple[str, ...] = ()
    can_validate: bool = True
    undone: tuple[str, ...] = ()
    alone: Effect | None = None
    nearest: tuple[Effect, float, float] | None = None
    own_gains: tuple[OwnGain, ...] = ()
    zero_changes: tuple[ZeroChange, ...] = ()


def inferred(
    start: ExtendedModel, sessions: Sequence[Session], thresholds: Thresholds, progress: Progress, is_unit: bool = True
) -> Inference:
    """`infer`; once more without what a gas remembers where that is most of what relaxes in no gas's pressure.

    There it is a free form of what gives way in holds, and no cause: what else leaves no more than a good unit's
    imperfections do beside it is.
    """
    found = infer(start, sessions, thresholds, progress, is_unit)
    units = {one.recording.sensor.unit.quantity for one in sessions}
    relaxing = [one for one in found.members if isinstance(one.effect, CoreEffect) or is_remembered_by_gas(one.effect)]
    if not (units <= NO_PRESSURES and any(is_remembered_by_gas(one.effect) for one in relaxing[:1])):
        return found
    progress("going through it again without what a gas remembers")
    other = infer(start, [replace(one, is_no_gas=True) for one in sessions], thresholds, progress, is_unit)
    missed = error_of(sessions, other.fit.model) ** 2 - error_of(sessions, found.fit.model) ** 2
    return other if missed <= thresholds.tolerable**2 else found


def infer(
    start: ExtendedModel, sessions: Sequence[Session], thresholds: Thresholds, progress: Progress, is_unit: bool = True
) -> Inference:
    """The effects in the fitted part of ``sessions``, beside the baseline ``start``; none where it is no unit's.

    Where gains of the recordings' own are told, what there is beside these.
    """
    progress("fitting the baseline")
    plain = least_squares(start, sessions, thresholds)
    evidence, best = searched(plain.model, sessions, thresholds)
    screening, likeness = _screening(evidence)
    is_valid = can_validate(sessions, thresholds)
    if not (is_unit and is_valid):
        likelihood = Likelihood(sessions, evidence.noise_sd, plain.model, thresholds)
        return Inference(plain, weighed(likelihood, plain.model), (), screening, likeness, (), is_valid)
    begun = State(evidence, best, plain)
    if is_stretched(plain.model):
        begun = simpler(state_at(late_beside_usual_arm(begun)), begun)
    state = _sought(begun, progress)
    if flexible := [one.name for one in state.chosen if one.effect.is_flexible]:
        progress(f"trying laws in the place of {listed(flexible)}")
    with_blocks, lawful = state, with_laws(state, plain.model)
    if lawful is not state:
        state = law_or_block(settled(lawful, progress), state)
    if (gained := with_likelier_gains(state, sessions)) is not None:
        progress("going through it again beside what recordings have of their own")
        beside = infer(start, gained, thresholds, progress)
        is_foretold = foretells(beside.fit.model, plain.model, state, sessions, gained)
        return _beside_own(beside, plain, gained, is_foretold, thresholds)
    progress("weighing alternatives")
    found = _validated(state, plain, sessions)
    replaced = {*lawful.fit.model.names} - {*with_blocks.fit.model.names}
    if state is not with_blocks and (found.is_stepped_down or replaced & {*found.refused}):
        # A law that is not the same in each recording is not that law: the block stays.
        other = _validated(with_blocks, plain, sessions)
        if not other.is_stepped_down and error_of(sessions, other.fit.model) < error_of(sessions, found.fit.model):
            state, found = with_blocks, other
    found, members = _likeliest(found, plain, sessions, progress)
    if found.is_stepped_down:
        found = found.with_nothing_but(plain)
        members = found.members()
    alone, refused = None, found.refused
    nameable = [one for one in members if one.name not in found.undone]
    if all(probability_of_kind(one, 0.0, thresholds) < thresholds.least_confidence for one in nameable):
        progress("trying each of a few effects alone")
        best_alone = _best_alone(begun, plain, sessions)
        alone = None if best_alone is None else best_alone[0]
        if best_alone is not None and len(found.fit.model.parts) == len(plain.model.parts):
            found = best_alone[1]
            members, refused = found.members(), tuple(name for name in refused if name not in found.fit.model.names)
    nearest = None if members else _nearest(begun, plain, sessions)
    return Inference(
        plain, found.fit, members, screening, likeness, refused, undone=found.undone, alone=alone, nearest=nearest
    )


def _beside_own(
    beside: Inference, plain: Fit, gained: Sequence[Session], is_foretold: bool, thresholds: Thresholds
) -> Inference:
    """What was found ``beside`` gains or zeros of the recordings' own, with these; no effect where none foretells."""
    if not (beside.own_gains or beside.zero_changes):
        about = gained, beside.fit.model
        beside = replace(beside, own_gains=gains_of(*about, thresholds), zero_changes=zero_changes_of(*about))
    if is_foretold:
        return replace(beside, baseline=plain)
    return replace(beside, baseline=plain, fit=weighed(beside.fit.likelihood, plain.model), members=(), alone=None)


def _sought(begun: State, progress: Progress) -> State:
    """What settles from ``begun``, also with other arms of the baseline where it came to one that effects had bent."""
    state = settled(begun, progress)
    if is_beyond_memory(state.fit.model, begun.thresholds):
        progress("beginning anew from arms as units have")
        state = better_from(with_a_usual_arm(begun), state, progress)
    if any(isinstance(one.effect, CoreEffect) for one in state.chosen):
        progress("trying other relaxation rates of the baseline")
        state = better_from(with_another_pole(state), state, progress)
    if state.fit.model.relaxing_share < 0.0:
        state = better_from(with_an_arm_that_creeps(state), state, progress)
    return better_from_one(begun, state, progress)


@dataclass(frozen=True, eq=False)
class _Validated:
    """The effects of a state that survive cross-validation: their set and ``fit``; those ``refused`` do not.

    ``is_stepped_down``: the whole extension failed, and effects were dropped one by one until the rest stood. Such a
    set was selected on what is left out, so that this validates it no longer: it shows where to look for likelier
    laws, and is no answer.
    """

    evidence: Evidence
    best: Posterior
    fit: Fit
    refused: tuple[str, ...]
    undone: tuple[str, ...]
    is_stepped_down: bool

    def with_nothing_but(self, plain: Fit) -> _Validated:
        """What the plain model itself has, two clocks, which were told before any model."""
        candidates, own = self.evidence.given.candidates, plain.model.names
        best = self.evidence.posterior(tuple(m for m in self.best.members if candidates[m].name in own))
        refused = (*self.refused, *(name for name in self.fit.model.names if name not in own))
        return replace(self, fit=weighed(self.fit.likelihood, plain.model), best=best, refused=refused, undone=())

    def members(self) -> tuple[Member, ...]:
        """Each effect weighed against its alternatives."""
        return members_of(self.evidence, self.best, self.fit)


def _validated(state: State, plain: Fit, sessions: Sequence[Session]) -> _Validated:
    """What of a state's effects predicts what is left out, fitted at last."""
    given, evidence, best, extended = state.given, state.evidence, state.best, state.fit
    likelihood, most = state.likelihood(), error_of(sessions, plain.model)
    left_out = LeftOut(sessions, evidence.noise_sd, extended.model, state.thresholds)
    whole = fit_of(state, best, likelihood)
    extended = left_out.following(whole)
    refused = [name for name in whole.model.names if name not in extended.model.names]
    best = evidence.posterior(tuple(m for m in best.members if given.candidates[m].name not in refused))
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
    following = len(extra)
    while extra and (error_of(sessions, extended.model) >= most or not left_out.stands(extended.model, plain.model)):
        less = {name: fit(likelihood, extended.model.without(name), FEW_STEPS) for name in extra}
        worst = min(extra, key=lambda name: float(left_out.errors(less[name].model).sum()))
        refused.append(worst)
        extra.remove(worst)
        extended = less[worst]
    extended = extended if extra else weighed(likelihood, plain.model)  # the plain fit knows another noise
    kept = extended.model.names
    if refused and kept:
        evidence, best = evidence_about(extended.model, evidence)
    else:
        best = evidence.posterior(tuple(m for m in best.members if given.candidates[m].name in kept))
    left = tuple(name for name in undone if name in kept)
    is_stepped_down = len(extra) < following
    return _Validated(evidence, best, extended, tuple(refused), left, is_stepped_down)


def _likeliest(
    found: _Validated, plain: Fit, sessions: Sequence[Session], progress: Progress
) -> tuple[_Validated, tuple[Member, ...]]:
    """The likeliest set that changes of one member or law lead to from ``found``, and its members, weighed."""
    while True:
        found, members = _without_redundant(found, plain)
        told = [one for one in members if one.name not in plain.model.names]  # two clocks were told before any model
        for better in likelier(found.fit, found.evidence, told):
            progress(f"trying {listed(better.fit.model.names) or 'the baseline'}")
            other = _validated(better, plain, sessions)
            if _is_likelier(other, found):
                found = other
                break
        else:  # no change is likelier, or leads to a set that is
            return found, members


def _is_likelier(other: _Validated, found: _Validated) -> bool:
    """Whether there is more evidence for ``other``, each about its own fit, under the noise of ``found``.

    Not for one that needs an arm as no wall has, where ``found`` does without: it follows what an effect does.
    """
    if is_stretched(other.fit.model) and not is_stretched(found.fit.model):
        return False
    new, old = (evidence_about(one.fit.model, found.evidence)[1].score for one in (other, found))
    return new < old


def _without_redundant(found: _Validated, plain: Fit) -> tuple[_Validated, tuple[Member, ...]]:
    """``found`` without effects that another of their family makes immaterial, and its members, weighed.

    A lag and a delay beside it, of which neither is needed where the other is, are each too small for a name.
    """
    members = found.members()
    while (less := _redundant(members, plain, found.evidence.thresholds)) is not None:
        refitted = fit(found.fit.likelihood, less.without.model)
        evidence, best = evidence_about(refitted.model, found.evidence)
        found = replace(found, fit=refitted, evidence=evidence, best=best)
        members = found.members()
    return found, members


def _redundant(members: Sequence[Member], plain: Fit, thresholds: Thresholds) -> Member | None:
    """The smallest effect, where it is immaterial beside another of its family, and none that was there before."""
    families = [one.effect.kind for one in members]
    twice = [
        one
        for one in members
        if one.size < thresholds.imperfection
        and families.count(one.effect.kind) > 1
        and one.name not in plain.model.names
    ]
    return min(twice, key=lambda one: one.size, default=None)


def _best_alone(begun: State, plain: Fit, sessions: Sequence[Session]) -> tuple[Effect, _Validated] | None:
    """Of the few likeliest effects the one by which alone what is left out is foreseen best, where any stands.

    Where several stand in for one another none is sure; which of them does most by itself does not hang on the others.
    It must do away with more than small imperfections of a good unit add up to.
    """
    before, thresholds = error_of(sessions, plain.model), begun.thresholds
    if before <= thresholds.tolerable:
        return None
    left_out = LeftOut(sessions, begun.evidence.noise_sd, plain.model, thresholds)
    likelihood, standing = begun.likelihood(), []
    nothing = begun.evidence.posterior(begun.start)
    for k in additions(begun.evidence, begun.start, BREADTH):
        best = begun.evidence.posterior((*begun.start, k))
        if best.score >= nothing.score:
            continue
        one = State(begun.evidence, best, fit_of(begun, best, likelihood))
        validated = _validated(one, plain, sessions)
        removed = before**2 - error_of(sessions, validated.fit.model) ** 2
        if not validated.is_stepped_down and removed > thresholds.tolerable**2:
            standing.append((begun.given.candidates[k].effect, validated))
    return min(standing, key=lambda one: float(left_out.errors(one[1].fit.model).sum()), default=None)


def _nearest(begun: State, plain: Fit, sessions: Sequence[Session]) -> tuple[Effect, float, float] | None:
    """The law that alone leaves least of what is more than tolerable, and what is left without and with it.

    None where that is not clearly less. It has no more evidence than small imperfections of all kinds together have.
    """
    before, thresholds = error_of(sessions, plain.model), begun.thresholds
    if before <= thresholds.tolerable:
        return None
    likelihood, left = begun.likelihood(), []
    for k in additions(begun.evidence, begun.start, 2 * BREADTH):
        one = begun.given.candidates[k]
        if not one.effect.is_flexible:
            fitted = fit_of(begun, begun.evidence.posterior((*begun.start, k)), likelihood, FEW_STEPS)
            left.append((error_of(sessions, fitted.model), one.effect))
    least, effect = min(left, key=lambda pair: pair[0], default=(before, None))
    return (effect, before, least) if effect is not None and thresholds.clear * least**2 <= before**2 else None


def least_squares(start: ExtendedModel, sessions: Sequence[Session], thresholds: Thresholds) -> Fit:
    """The best predictor of the form of ``start``: output error, each correlation time of what is left counted once."""
    residuals, kept = [residual_of(one, start) for one in sessions], [one.fitted for one in sessions]
    return fit(Likelihood(sessions, correlated_sd(residuals, kept), start, thresholds), start)


def independent(sessions: Sequence[Session], thresholds: Thresholds) -> int:
    """Recordings that are fitted, or load cycles of a single one: what can be left out and predicted from the rest."""
    fitted = fitted_of(sessions)
    return len(fitted) if len(fitted) > 1 else load_cycles(fitted, thresholds)


def can_validate(sessions: Sequence[Session], thresholds: Thresholds) -> bool:
    """Whether anything can be left out and predicted from the rest: within one load cycle nothing validates."""
    return independent(sessions, thresholds) > 1 and len(folds_of(sessions)) > 1


def _screening(evidence: Evidence) -> tuple[tuple[tuple[str, float], ...], Array]:
    """What each of the strongest effects alone takes off the baseline's score, and how alike they look (k, k)."""
    nothing = evidence.posterior(()).score
    falls = {k: nothing - evidence.posterior((k,)).score for k in additions(evidence, (), 2 * BREADTH)}
    order = sorted(falls, key=lambda k: -falls[k])
    return tuple((evidence.given.candidates[k].name, falls[k]) for k in order), evidence.likeness(order)
