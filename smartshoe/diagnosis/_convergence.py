"""Alternating fits and searches until the set of effects is stable, and the choice between several such ends."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from smartshoe.diagnosis._arms import arms_of, effect_count, with_arm, with_odds
from smartshoe.diagnosis._evidence import Evidence, Posterior
from smartshoe.diagnosis._likelihood import Fit, Likelihood, fit
from smartshoe.diagnosis._search import MOST_MEMBERS, RIVALS, best_additions
from smartshoe.diagnosis._sensitivity import Linearised
from smartshoe.diagnosis._state import State, evidence_about, fit_of_set, state_at
from smartshoe.diagnosis._validation import error_of, is_tolerable, rms_difference
from smartshoe.models.effects import listed
from smartshoe.models.extended import ExtendedModel

Progress = Callable[[str], None]

# Resolutions. Half and twice of each changed no name in two cases. With four steps one measured sensor, which no
# equation fits, gets no name.
ROUNDS = 6
ROUND_STEPS = 6  # of a fit that is linearised again anyway


def converged(state: State, progress: Progress, rival: State | None = None) -> State:
    """Fit, linearise and search until the best set is not worth another fit, or a set comes back.

    If the sets form a loop, a linearisation promises more than its fit keeps, and the fitted state with most evidence
    is taken. Then each effect's relaxing arm is tried in the place of the baseline's, since it may be the only arm of
    the unit. ``rival``: a state that has converged before; if this path reaches one of its models the rest would be the
    same, and ``rival`` is returned.
    """
    seen: set[tuple[tuple[str, ...], tuple[str, ...]]] = set()
    path, best = [state.fit.model], state
    # The same set about another fit counts as new: a rival may have been fitted in the place of a large effect.
    while state.is_worth_a_fit and (here := _names(state)) not in seen and len(path) <= ROUNDS:
        seen.add(here)
        progress(f"fitting {listed(here[1]) or 'the baseline'}")
        likelihood = state.likelihood()
        fits = [fit_of_set(state, one, likelihood, ROUND_STEPS) for one in _trial_sets(state)]
        found, linearisation = _best_fit(fits, state)
        if rival is not None and any(_are_alike(found.model, one, likelihood) for one in rival.path):
            return rival
        path.append(found.model)
        state = state_at(found, state.banned, linearisation)
        best = state if _has_as_much_evidence(state, best) else best
    if best is not state and state.is_worth_a_fit:  # its best set has been tried
        state = replace(best, best=best.evidence.posterior(best.fitted_members))
    for name, arm in arms_of(state.fit.model):
        likelihood = state.likelihood()
        found = fit(likelihood, with_arm(state.fit.model.without(name), arm))
        if _is_simpler(found, state):
            state = state_at(found, state.banned)
    return replace(state, path=tuple(path))


def _has_as_much_evidence(state: State, other: State) -> bool:
    """Whether the fit of ``state`` has at least the evidence of that of ``other``, under the lower noise of the two.

    Each is linearised about its own fit; what no column explains there counts as noise.
    """
    noise_sd = min(state.evidence.noise_sd, other.evidence.noise_sd)
    new, old = (Evidence(one.linearisation, noise_sd).posterior(one.fitted_members).score for one in (state, other))
    return new <= old


def simpler_from(initial: State, state: State, progress: Progress) -> State:
    """The state that `converged` reaches from ``initial``, if it is simpler than ``state``; else ``state``."""
    other = converged(initial, progress, state)
    return state if other is state else replace(simpler(other, state), path=(*state.path, *other.path))


def simpler_than(found: Fit, state: State, progress: Progress) -> State:
    """The state that `converged` reaches from the fit ``found``, if already that is simpler; else ``state``."""
    if _are_alike(found.model, state.fit.model, state.likelihood()) or not _is_simpler(found, state):
        return state
    return simpler_from(state_at(found, state.banned), state, progress)


def simpler(other: State, state: State) -> State:
    """The simpler of two states; see `_is_simpler`."""
    return other if _is_simpler(other.fit, state) else state


def beyond_bounds(state: State, progress: Progress) -> State:
    """The state with each law that ended at a bound freed of it (`Effect.widened_at`), if that is simpler.

    It is also fitted without each other effect, which may be there only for what the law missed at its bound.
    """
    for name in state.fit.model.ended:
        if name not in state.fit.model.ended:
            continue  # it went with another one
        progress(f"trying {listed([name])} beyond its usual bounds")
        likelihood = state.likelihood()
        found = fit(likelihood, state.fit.model.freed(name))
        others = [other for other in found.model.names if other != name]
        fits = [found, *(fit(likelihood, found.model.without(other)) for other in others)]
        odds = state.evidence.odds
        best = min(fits, key=lambda one: with_odds(one.cost, one.model, odds))
        if _is_simpler(best, state):
            state = converged(state_at(best, state.banned), progress)
    return state


def law_or_block(lawful: State, state: State) -> State:
    """The state with a law in the place of a flexible block, or ``state`` with the block if that has more evidence.

    What a law misses beyond the usual departure would be taken for other effects. If it misses no more than the small
    imperfections of a good unit (``tolerable``) and needs no more effects, the law is taken in any case.
    """
    sessions = state.linearisation.sessions
    left, before = error_of(sessions, lawful.fit.model), error_of(sessions, state.fit.model)
    needs_no_more = effect_count(lawful.fit.model) <= effect_count(state.fit.model)
    if needs_no_more and is_tolerable(left, before, state.thresholds):
        return lawful
    return lawful if _has_as_much_evidence(lawful, state) else state


def _is_simpler(other: Fit, state: State) -> bool:
    """Whether ``other`` has a lower penalised cost than the fit of ``state``, or fewer effects at the same reading.

    Where both models read nearly the same the number of effects decides first, however sure an immaterial effect is: an
    arm that imitates a lag of a millisecond needs a further arm for the unit's own relaxation.
    """
    likelihood, odds = state.likelihood(), state.evidence.odds
    new, old = (
        (with_odds(likelihood.cost(one.model), one.model, odds), effect_count(one.model)) for one in (other, state.fit)
    )
    if _simulate_alike(other.model, state.fit.model, likelihood):
        return (new[1], new[0]) < (old[1], old[0])
    return new[0] < old[0]


def _simulate_alike(one: ExtendedModel, other: ExtendedModel, likelihood: Likelihood) -> bool:
    """Whether the readings of two models differ by less than counts for anything."""
    thresholds = likelihood.thresholds
    return rms_difference(likelihood.sessions, one, other) < thresholds.alike * thresholds.imperfection


def _are_alike(one: ExtendedModel, other: ExtendedModel, likelihood: Likelihood) -> bool:
    """Whether two models have the same effects and nearly the same readings."""
    return {*one.names} == {*other.names} and _simulate_alike(one, other, likelihood)


def _names(state: State) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """The names of the fitted effects and those of the best set, sorted."""
    return tuple(sorted(state.fit.model.names)), tuple(sorted(one.name for one in state.chosen))


def _trial_sets(state: State) -> list[Posterior]:
    """The sets to fit: the best one, and where a new effect exceeds the linear range, others with one more effect.

    A large effect changes the model about which its rivals were linearised, so that fits of the best few decide.
    """
    start = state.fitted_members
    if not state.exceeds_linear_range or len(start) >= MOST_MEMBERS:
        return [state.best]
    taken = {state.linearisation.candidates[m].slot for m in start}
    flexible = [
        k
        for k, one in enumerate(state.linearisation.candidates)
        if one.effect.is_flexible
        and one.effect.is_memoryless
        and one.slot not in taken
        and one.name not in state.banned
    ]
    tried = {*best_additions(state.evidence, start, RIVALS, state.banned), *flexible}
    return [state.best, *(state.evidence.posterior((*start, k)) for k in sorted(tried))]


def _best_fit(fits: Sequence[Fit], state: State) -> tuple[Fit, Linearised | None]:
    """The best of ``fits``, with the linearisation about it if one was made.

    Of fits with the same number of strengths the one of lowest cost is kept. Between different numbers the evidence
    decides, since one more strength always fits better.
    """
    likeliest: dict[int, Fit] = {}
    for one in sorted(fits, key=lambda one: one.cost):
        likeliest.setdefault(_strengths(one.model), one)
    few = list(likeliest.values())
    if len(few) == 1:
        return few[0], None
    weighed = [(one, *evidence_about(one.model, state.evidence)) for one in few]
    found, evidence, _ = min(weighed, key=lambda one: one[2].score)
    return found, evidence.linearisation


def _strengths(model: ExtendedModel) -> int:
    """The number of strengths of a model's effects: parameters whose null value means that the effect is absent."""
    return sum(parameter.null is not None for part in model.parts for parameter in part.effect.parameters)
