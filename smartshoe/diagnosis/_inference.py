"""Which effects the data contains: a search over a linearised model and fits of the full model, in alternation.

Held-out data is not used here. An effect is validated within the fitted recordings: each recording is left out in turn
(of a single recording, blocks of its load cycles), and an effect that does not predict what was left out is removed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from smartshoe.arrays import Array
from smartshoe.diagnosis._arms import (
    effect_count,
    latency_for_arm,
    latency_with_usual_arm,
    with_a_usual_arm,
    with_another_pole,
    with_creeping_arm,
)
from smartshoe.diagnosis._baseline import has_arm_beyond_memory, has_extreme_arm
from smartshoe.diagnosis._convergence import (
    Progress,
    beyond_bounds,
    converged,
    law_or_block,
    simpler,
    simpler_from,
    simpler_than,
)
from smartshoe.diagnosis._evidence import Evidence, Posterior
from smartshoe.diagnosis._gains_and_zeros import (
    OwnGain,
    ZeroChange,
    gains_of,
    predicts_better,
    with_own_terms,
    zero_changes_of,
)
from smartshoe.diagnosis._laws import likelier_changes, with_laws
from smartshoe.diagnosis._likelihood import FEW_STEPS, Fit, Likelihood, evaluated, fit
from smartshoe.diagnosis._load_cycles import load_cycles
from smartshoe.diagnosis._members import Member, members_of, taken_together
from smartshoe.diagnosis._naming import probability_of_kind
from smartshoe.diagnosis._noise import effective_noise_sd
from smartshoe.diagnosis._own_terms import residual_of
from smartshoe.diagnosis._search import BREADTH, best_additions
from smartshoe.diagnosis._sensitivity import NON_PRESSURES, Linearised, is_remembered_by_gas, linearised
from smartshoe.diagnosis._session import Session, fitted_of
from smartshoe.diagnosis._state import State, evidence_about, fit_of_set, linearised_search, set_of, state_at
from smartshoe.diagnosis._validation import (
    LeftOut,
    cancelling_effects,
    error_of,
    extrapolating_effect,
    folds_of,
    is_tolerable,
)
from smartshoe.integrity.thresholds import Thresholds
from smartshoe.models.effects import listed
from smartshoe.models.effects.effect import CoreEffect, Effect
from smartshoe.models.extended import ExtendedModel


@dataclass(frozen=True, eq=False)
class Inference:
    """The result of an inference: the plain and the extended model, and how sure each effect is.

    ``baseline`` and ``fit`` are the plain and the extended model, each with the likelihood that it was fitted by.
    ``members`` are the effects of the extended model, largest first.

    ``together``: members that are of one kind, taken as one (`taken_together`).

    ``screening`` is the fall of the baseline's score for each of the strongest effects alone, and ``likeness`` (k, k)
    how similar these k effects look (`Evidence.likeness`). ``refused`` are effects that cross-validation removed.
    ``cancelling_names`` are members that cancel one another, so that none of them is named.

    ``best_single`` is the effect that predicts left-out data best on its own; it is sought only where no member is
    sure. ``nearest_law`` is sought only where there is no member: a law that alone follows most of what the baseline
    misses, with the rms of the residual without it and with it, shares of full scale.

    ``own_gains`` are the gains of the recordings where they differ, ``zero_changes`` the moments at which their zeros
    jump.
    """

    baseline: Fit
    fit: Fit
    members: tuple[Member, ...]
    screening: tuple[tuple[str, float], ...]
    likeness: Array
    refused: tuple[str, ...] = ()
    can_validate: bool = True
    cancelling_names: tuple[str, ...] = ()
    best_single: Effect | None = None
    nearest_law: tuple[Effect, float, float] | None = None
    own_gains: tuple[OwnGain, ...] = ()
    zero_changes: tuple[ZeroChange, ...] = ()
    together: tuple[Member, ...] = ()


def infer_with_gas_check(
    start: ExtendedModel, sessions: Sequence[Session], thresholds: Thresholds, progress: Progress, is_unit: bool = True
) -> Inference:
    """`infer`, repeated without gas effects where the reading is no pressure but a gas effect relaxes most.

    Of such a reading a gas effect is only a free form of relaxation in holds, never a cause. The second result counts
    if its residual is larger by no more than the small imperfections of a good unit (``tolerable``).
    """
    found = infer(start, sessions, thresholds, progress, is_unit)
    units = {one.recording.sensor.unit.quantity for one in sessions}
    relaxing = [one for one in found.members if isinstance(one.effect, CoreEffect) or is_remembered_by_gas(one.effect)]
    if not (units <= NON_PRESSURES and any(is_remembered_by_gas(one.effect) for one in relaxing[:1])):
        return found
    progress("going through it again without what a gas remembers")
    other = infer(start, [replace(one, without_gas_memory=True) for one in sessions], thresholds, progress, is_unit)
    left, before = error_of(sessions, other.fit.model), error_of(sessions, found.fit.model)
    return other if is_tolerable(left, before, thresholds) else found


def infer(
    start: ExtendedModel, sessions: Sequence[Session], thresholds: Thresholds, progress: Progress, is_unit: bool = True
) -> Inference:
    """The effects in the fitted part of ``sessions``, in addition to the baseline that fits from ``start`` give.

    No effect is sought where ``is_unit`` is False, or where nothing can be left out to validate it. Where the
    recordings have gains or zeros of their own, the inference is repeated with these as nuisances.
    """
    progress("fitting the baseline")
    plain = least_squares(start, sessions, thresholds)
    sessions, about = _where_a_catch_all_leads(plain, sessions, thresholds)
    evidence, best = linearised_search(plain.model, sessions, thresholds, linearisation=about)
    screening, likeness = _screening(evidence)
    is_valid = can_validate(sessions, thresholds)
    if not (is_unit and is_valid):
        likelihood = Likelihood(sessions, evidence.noise_sd, plain.model, thresholds)
        return Inference(plain, evaluated(likelihood, plain.model), (), screening, likeness, (), is_valid)
    initial = State(evidence, best, plain)
    if has_extreme_arm(plain.model):
        initial = simpler(state_at(latency_with_usual_arm(initial)), initial)
    state = _converged_from(initial, progress)
    if flexible := [one.name for one in state.chosen if one.effect.is_flexible]:
        progress(f"trying laws in the place of {listed(flexible)}")
    with_blocks, lawful = state, with_laws(state, plain.model)
    if lawful is not state:
        state = law_or_block(converged(lawful, progress), state)
    if (own_sessions := with_own_terms(state, sessions)) is not None:
        progress("going through it again beside what recordings have of their own")
        conditional = infer(start, own_sessions, thresholds, progress)
        is_predicted = predicts_better(conditional.fit.model, plain.model, state, sessions, own_sessions)
        return _with_own_terms(conditional, plain, own_sessions, is_predicted, thresholds)
    progress("weighing alternatives")
    found = _validated(state, plain, sessions)
    replaced = {*lawful.fit.model.names} - {*with_blocks.fit.model.names}
    if state is not with_blocks and (found.is_reduced or replaced & {*found.refused}):
        # A law whose parameters differ between recordings is not that law: the block stays.
        other = _validated(with_blocks, plain, sessions)
        if not other.is_reduced and error_of(sessions, other.fit.model) < error_of(sessions, found.fit.model):
            state, found = with_blocks, other
    found, members = _best_by_single_changes(found, plain, sessions, progress)
    if (freed := _freed(found, state.banned, plain, sessions, progress)) is not found:
        found, members = _best_by_single_changes(freed, plain, sessions, progress)
    if found.is_reduced:
        found = found.reduced_to(plain)
        members = found.members()
    best_single, refused = None, found.refused
    nameable = [one for one in members if one.name not in found.cancelling_names]
    if all(probability_of_kind(one, 0.0, thresholds) < thresholds.least_confidence for one in nameable):
        progress("trying each of a few effects alone")
        best_single_fit = _best_single(initial, plain, sessions)
        best_single = None if best_single_fit is None else best_single_fit[0]
        if best_single_fit is not None and len(found.fit.model.parts) == len(plain.model.parts):
            found = best_single_fit[1]
            members, refused = found.members(), tuple(name for name in refused if name not in found.fit.model.names)
    nearest_law = None if members else _nearest_single_law(initial, plain, sessions)
    return Inference(
        plain,
        found.fit,
        members,
        screening,
        likeness,
        refused,
        cancelling_names=found.cancelling_names,
        best_single=best_single,
        nearest_law=nearest_law,
        together=found.together(members),
    )


def _where_a_catch_all_leads(
    plain: Fit, sessions: Sequence[Session], thresholds: Thresholds
) -> tuple[Sequence[Session], Linearised]:
    """The ``sessions``, and the linearisation about the plain fit; without catch-alls unless one does most by itself.

    Beside others such a block takes a part of what no equation follows, and changes which of them are found.
    """
    about = linearised(plain.model, sessions, thresholds)
    catch_alls = {one.name for one in about.candidates if one.effect.is_catch_all}
    if not catch_alls:
        return sessions, about
    first = best_additions(Evidence(about, about.noise_sd()), set_of(plain.model, about), 1)
    if any(about.candidates[k].name in catch_alls for k in first):
        return sessions, about
    usual = [replace(one, without_catch_alls=True) for one in sessions]
    return usual, about.without(catch_alls, fitted_of(usual))


def _with_own_terms(
    conditional: Inference, plain: Fit, own_sessions: Sequence[Session], is_predicted: bool, thresholds: Thresholds
) -> Inference:
    """The inference ``conditional`` on own gains or zeros of the recordings, with their values.

    The effects are dropped where they do not predict recordings better than the plain model (``is_predicted``).
    """
    if not (conditional.own_gains or conditional.zero_changes):
        about = own_sessions, conditional.fit.model
        conditional = replace(conditional, own_gains=gains_of(*about, thresholds), zero_changes=zero_changes_of(*about))
    if is_predicted:
        return replace(conditional, baseline=plain)
    return replace(
        conditional,
        baseline=plain,
        fit=evaluated(conditional.fit.likelihood, plain.model),
        members=(),
        best_single=None,
        together=(),
    )


def _converged_from(initial: State, progress: Progress) -> State:
    """The state that `converged` reaches from ``initial``, tried also from other relaxing arms of the baseline.

    An effect that is missing from the model bends the baseline's arm, and a bent arm hides that effect.
    """
    state = converged(initial, progress)
    if effect_count(state.fit.model) > effect_count(initial.fit.model):
        # One delay may do what several effects do beside an arm that it has bent.
        state = simpler_than(latency_with_usual_arm(initial), state, progress)
    if has_extreme_arm(state.fit.model):
        progress("trying a lag in the place of an arm that no wall has")
        late = converged(state_at(latency_for_arm(state), state.banned), progress)
        if not has_extreme_arm(late.fit.model):
            state = simpler(late, law_or_block(late, state))
    if has_arm_beyond_memory(state.fit.model, initial.thresholds):
        progress("beginning anew from arms as units have")
        state = simpler_from(with_a_usual_arm(initial), state, progress)
    if any(isinstance(one.effect, CoreEffect) for one in state.chosen):
        progress("trying other relaxation rates of the baseline")
        state = simpler_from(with_another_pole(state), state, progress)
    if state.fit.model.relaxing_share < 0.0:
        state = simpler_from(with_creeping_arm(state), state, progress)
    return state


@dataclass(frozen=True, eq=False)
class _Validated:
    """The effects of a state that survive cross-validation: the set ``best``, its ``fit``, and the ``refused`` ones.

    ``is_reduced``: the whole extension failed, and effects were removed one by one until the rest passed. The left-out
    data has then selected the set and can no longer validate it: it suggests where to look, but is no answer.
    """

    evidence: Evidence
    best: Posterior
    fit: Fit
    refused: tuple[str, ...]
    cancelling_names: tuple[str, ...]
    is_reduced: bool

    def reduced_to(self, plain: Fit) -> _Validated:
        """Only the effects that the plain model has itself: clocks, which were found before any model."""
        candidates, own = self.evidence.linearisation.candidates, plain.model.names
        best = self.evidence.posterior(tuple(m for m in self.best.members if candidates[m].name in own))
        refused = (*self.refused, *(name for name in self.fit.model.names if name not in own))
        return replace(
            self, fit=evaluated(self.fit.likelihood, plain.model), best=best, refused=refused, cancelling_names=()
        )

    def members(self) -> tuple[Member, ...]:
        """Each effect, weighed against its alternatives."""
        return members_of(self.evidence, self.best, self.fit)

    def together(self, members: Sequence[Member]) -> tuple[Member, ...]:
        """Those of the ``members`` that are of one kind, taken as one."""
        return taken_together(members, self.evidence, self.best, self.fit)


def _validated(state: State, plain: Fit, sessions: Sequence[Session]) -> _Validated:
    """The effects of ``state`` that predict what is left out, refitted to all fitted data.

    In this order it removes effects that differ between recordings, the idle one of several that cancel one another,
    effects that act mainly beyond the fitted loads, and, while the extension as a whole fails, the effect without which
    the left-out error is smallest.
    """
    linearisation, evidence, best, extended = state.linearisation, state.evidence, state.best, state.fit
    likelihood, plain_error = state.likelihood(), error_of(sessions, plain.model)
    left_out = LeftOut(sessions, evidence.noise_sd, extended.model, state.thresholds)
    fitted = fit_of_set(state, best, likelihood)
    extended = left_out.consistent(fitted)
    refused = [name for name in fitted.model.names if name not in extended.model.names]
    cancelling_names = cancelling_effects(sessions, extended.model, state.thresholds)
    if cancelling_names:
        without = {name: fit(likelihood, extended.model.without(name)) for name in cancelling_names}
        idle = min(cancelling_names, key=lambda name: without[name].cost)
        if (
            error_of(sessions, without[idle].model) ** 2
            > state.thresholds.clear * error_of(sessions, extended.model) ** 2
        ):
            cancelling_names = []  # each is needed, although they cancel in part
        elif not cancelling_effects(sessions, without[idle].model, state.thresholds):
            cancelling_names = []
            refused.append(idle)
            extended = without[idle]
    while (beyond := extrapolating_effect(sessions, extended.model, state.thresholds)) is not None:
        refused.append(beyond)
        extended = fit(likelihood, extended.model.without(beyond))
    extra = [name for name in extended.model.names if name not in plain.model.names]
    extra_count = len(extra)
    while extra and (
        error_of(sessions, extended.model) >= plain_error or not left_out.is_validated(extended.model, plain.model)
    ):
        without = {name: fit(likelihood, extended.model.without(name), FEW_STEPS) for name in extra}
        worst = min(extra, key=lambda name: float(left_out.errors(without[name].model).sum()))
        refused.append(worst)
        extra.remove(worst)
        extended = without[worst]
    extended = extended if extra else evaluated(likelihood, plain.model)  # the plain fit has its own noise level
    kept_names = extended.model.names
    if refused and kept_names:
        evidence, best = evidence_about(extended.model, evidence)
    else:
        best = evidence.posterior(tuple(m for m in best.members if linearisation.candidates[m].name in kept_names))
    cancelling_left = tuple(name for name in cancelling_names if name in kept_names)
    is_reduced = len(extra) < extra_count
    return _Validated(evidence, best, extended, tuple(refused), cancelling_left, is_reduced)


def _freed(
    found: _Validated, banned: tuple[str, ...], plain: Fit, sessions: Sequence[Session], progress: Progress
) -> _Validated:
    """``found`` with laws beyond the bounds that they ended at, if that is validated and better; else itself.

    It is better if it leaves less, or needs fewer effects and leaves no more than ``tolerable`` beside: what a law
    missed at its bound had become another effect.
    """
    if not found.fit.model.ended:
        return found
    at_bounds = state_at(found.fit, banned)
    beyond = beyond_bounds(at_bounds, progress)
    if beyond is at_bounds:
        return found
    wider = _validated(beyond, plain, sessions)
    left, before = error_of(sessions, wider.fit.model), error_of(sessions, found.fit.model)
    needs_less = effect_count(wider.fit.model) < effect_count(found.fit.model)
    is_better = left < before or (needs_less and is_tolerable(left, before, beyond.thresholds))
    return wider if is_better and not wider.is_reduced else found


def _best_by_single_changes(
    found: _Validated, plain: Fit, sessions: Sequence[Session], progress: Progress
) -> tuple[_Validated, tuple[Member, ...]]:
    """The best set that changes of one member or one law reach from ``found``, and its members."""
    while True:
        found, members = _without_redundant(found, plain)
        removable = [one for one in members if one.name not in plain.model.names]  # clocks were found before any model
        for better in likelier_changes(found.fit, found.evidence, removable):
            progress(f"trying {listed(better.fit.model.names) or 'the baseline'}")
            other = _validated(better, plain, sessions)
            if _is_likelier(other, found):
                found = other
                break
        else:  # no single change gives a more probable set
            return found, members


def _is_likelier(other: _Validated, found: _Validated) -> bool:
    """Whether ``other`` has more evidence, each about its own fit, with the noise of ``found``.

    It must not need an arm that no wall has where ``found`` does without: such an arm takes the place of an effect.
    """
    if has_extreme_arm(other.fit.model) and not has_extreme_arm(found.fit.model):
        return False
    new, old = (evidence_about(one.fit.model, found.evidence)[1].score for one in (other, found))
    return new < old


def _without_redundant(found: _Validated, plain: Fit) -> tuple[_Validated, tuple[Member, ...]]:
    """``found`` without effects that another effect of their family makes immaterial, and its members.

    For example a lag and a delay, of which either suffices: side by side each is too small to be named.
    """
    members = found.members()
    while (redundant := _redundant(members, plain, found.evidence.thresholds)) is not None:
        refitted = fit(found.fit.likelihood, redundant.without.model)
        evidence, best = evidence_about(refitted.model, found.evidence)
        found = replace(found, fit=refitted, evidence=evidence, best=best)
        members = found.members()
    return found, members


def _redundant(members: Sequence[Member], plain: Fit, thresholds: Thresholds) -> Member | None:
    """The smallest immaterial effect that shares its family with another one and is not in the plain model."""
    families = [one.effect.kind for one in members]
    twice = [
        one
        for one in members
        if one.size < thresholds.imperfection
        and families.count(one.effect.kind) > 1
        and one.name not in plain.model.names
    ]
    return min(twice, key=lambda one: one.size, default=None)


def _best_single(initial: State, plain: Fit, sessions: Sequence[Session]) -> tuple[Effect, _Validated] | None:
    """Of the most probable effects the one that alone predicts left-out data best, if any passes validation.

    Where several effects can replace one another none is sure, but which of them does most alone does not depend on the
    others. It must remove more than the small imperfections of a good unit (``tolerable``), and be more probable than
    these; where they may add up to all that the plain model leaves, it suffices that what it leaves is tolerable.
    """
    before, thresholds = error_of(sessions, plain.model), initial.thresholds
    if before <= thresholds.tolerable:
        return None
    may_add_up = before <= thresholds.clear * thresholds.tolerable
    left_out = LeftOut(sessions, initial.evidence.noise_sd, plain.model, thresholds)
    likelihood, standing = initial.likelihood(), []
    nothing = initial.evidence.posterior(initial.fitted_members)
    for k in best_additions(initial.evidence, initial.fitted_members, BREADTH):
        best = initial.evidence.posterior((*initial.fitted_members, k))
        is_likelier = best.score < nothing.score
        if not (is_likelier or may_add_up):
            continue  # before the fit, which most sets are not worth
        one = State(initial.evidence, best, fit_of_set(initial, best, likelihood))
        if not is_likelier and error_of(sessions, one.fit.model) > thresholds.tolerable:
            continue
        validated = _validated(one, plain, sessions)
        left = error_of(sessions, validated.fit.model)
        if not validated.is_reduced and not is_tolerable(before, left, thresholds):
            standing.append((initial.linearisation.candidates[k].effect, validated))
    return min(standing, key=lambda one: float(left_out.errors(one[1].fit.model).sum()), default=None)


def _nearest_single_law(initial: State, plain: Fit, sessions: Sequence[Session]) -> tuple[Effect, float, float] | None:
    """The law that alone leaves the smallest residual, with the rms without and with it, shares of full scale.

    None unless the residual exceeds ``tolerable`` and the law reduces its power clearly (``clear``). Such a law has no
    more evidence than many small imperfections together.
    """
    before, thresholds = error_of(sessions, plain.model), initial.thresholds
    if before <= thresholds.tolerable:
        return None
    likelihood, remaining = initial.likelihood(), []
    for k in best_additions(initial.evidence, initial.fitted_members, 2 * BREADTH):
        one = initial.linearisation.candidates[k]
        if not one.effect.is_flexible:
            fitted = fit_of_set(
                initial, initial.evidence.posterior((*initial.fitted_members, k)), likelihood, FEW_STEPS
            )
            remaining.append((error_of(sessions, fitted.model), one.effect))
    least, effect = min(remaining, key=lambda pair: pair[0], default=(before, None))
    return (effect, before, least) if effect is not None and thresholds.clear * least**2 <= before**2 else None


def least_squares(start: ExtendedModel, sessions: Sequence[Session], thresholds: Thresholds) -> Fit:
    """The best predictor of the form of ``start``: output error, with noise counted once per correlation time."""
    residuals, kept = [residual_of(one, start) for one in sessions], [one.fitted for one in sessions]
    return fit(Likelihood(sessions, effective_noise_sd(residuals, kept), start, thresholds), start)


def independent_count(sessions: Sequence[Session], thresholds: Thresholds) -> int:
    """The number of units that can be left out: fitted recordings, or load cycles of a single one."""
    fitted = fitted_of(sessions)
    return len(fitted) if len(fitted) > 1 else load_cycles(fitted, thresholds)


def can_validate(sessions: Sequence[Session], thresholds: Thresholds) -> bool:
    """Whether anything can be left out and predicted from the rest; within one load cycle nothing can."""
    return independent_count(sessions, thresholds) > 1 and len(folds_of(sessions)) > 1


def _screening(evidence: Evidence) -> tuple[tuple[tuple[str, float], ...], Array]:
    """By how much each of the strongest effects alone lowers the baseline's score, and their likeness (k, k)."""
    nothing = evidence.posterior(()).score
    falls = {k: nothing - evidence.posterior((k,)).score for k in best_additions(evidence, (), 2 * BREADTH)}
    order = sorted(falls, key=lambda k: -falls[k])
    return tuple((evidence.linearisation.candidates[k].name, falls[k]) for k in order), evidence.likeness(order)
