"""Fits and searches in turn, until a set of effects settles; and which of several ends is simpler."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from smartshoe.diagnosis._arms import arms_of, effect_count, late_beside_usual_arm, with_arm, with_odds
from smartshoe.diagnosis._evidence import Evidence, Posterior
from smartshoe.diagnosis._likelihood import Fit, Likelihood, fit
from smartshoe.diagnosis._search import MOST_MEMBERS, RIVALS, additions
from smartshoe.diagnosis._sensitivity import Linearised
from smartshoe.diagnosis._state import State, evidence_about, fit_of, state_at
from smartshoe.diagnosis._validation import apart, error_of
from smartshoe.models.effects import listed
from smartshoe.models.effects.effect import CoreEffect
from smartshoe.models.extended import ExtendedModel

Progress = Callable[[str], None]

# Resolutions: half and twice of each changed no name in two cases. With four steps one measured sensor, of which no
# equation fits, is left unnamed.
ROUNDS = 6
ROUND_STEPS = 6  # of a fit that is linearised anew anyway


def settled(state: State, progress: Progress, known: State | None = None) -> State:
    """Fit, linearise and search in turn until nothing is worth another fit, or a set comes back.

    Where it goes round without an end, a linearisation promises more than its fit keeps: of all that were fitted the
    set with most evidence is taken. Then an effect's arm is tried in the place of the baseline's: it may be the unit's
    only one. Where a fit comes upon the path of a state that is ``known``, it would go the same way, and that state is
    the answer.
    """
    seen: set[tuple[tuple[str, ...], tuple[str, ...]]] = set()
    path, best = [state.fit.model], state
    # A set about another fit is another one: of a large effect a rival may have been fitted in its place.
    while state.is_worth_a_fit and (here := _names(state)) not in seen and len(path) <= ROUNDS:
        seen.add(here)
        progress(f"fitting {listed(here[1]) or 'the baseline'}")
        likelihood = state.likelihood()
        fits = [fit_of(state, one, likelihood, ROUND_STEPS) for one in _promising(state)]
        found, given = _best_of(fits, state)
        if known is not None and any(_are_alike(found.model, one, likelihood) for one in known.path):
            return known
        path.append(found.model)
        state = state_at(found, state.banned, given)
        best = state if _has_as_much_evidence(state, best) else best
    if best is not state and state.is_worth_a_fit:  # what was asked for about it has been tried
        state = replace(best, best=best.evidence.posterior(best.start))
    for name, arm in arms_of(state.fit.model):
        likelihood = state.likelihood()
        found = fit(likelihood, with_arm(state.fit.model.without(name), arm))
        if _is_simpler(found, state):
            state = state_at(found, state.banned)
    return replace(state, path=tuple(path))


def _has_as_much_evidence(state: State, other: State) -> bool:
    """Whether there is as much evidence for the fit of ``state``, each about its own, under the lower of their noises.

    What no column of a linearisation reaches counts as noise in it.
    """
    noise_sd = min(state.evidence.noise_sd, other.evidence.noise_sd)
    new, old = (Evidence(one.given, noise_sd).posterior(one.start).score for one in (state, other))
    return new <= old


def better_from(begun: State, state: State, progress: Progress) -> State:
    """What settles from ``begun``, where that is simpler than ``state``."""
    other = settled(begun, progress, state)
    return state if other is state else replace(simpler(other, state), path=(*state.path, *other.path))


def better_from_one(begun: State, state: State, progress: Progress) -> State:
    """What settles from one of the likeliest effects alone, where that follows better than the several of ``state``.

    Several that are each fitted a little may promise more in one linearisation than one that is large. So may what
    relaxes or is late beside an arm that imitates a lag: a lag alone is tried beside an arm as units have.
    """
    likelihood, fits = state.likelihood(), []
    if effect_count(state.fit.model) - effect_count(begun.fit.model) > 1:
        few = [begun.evidence.posterior((*begun.start, k)) for k in additions(begun.evidence, begun.start, RIVALS)]
        fits = [fit_of(begun, one, likelihood) for one in few]
    if any(part.effect.is_latency or isinstance(part.effect, CoreEffect) for part in state.fit.model.parts):
        fits.append(late_beside_usual_arm(begun))
    one = min(fits, key=lambda one: one.cost, default=begun.fit)
    if one is begun.fit or not _is_simpler(one, state):
        return state
    progress(f"beginning anew from {listed(one.model.names)}")
    return better_from(state_at(one), state, progress)


def simpler(other: State, state: State) -> State:
    return other if _is_simpler(other.fit, state) else state


def law_or_block(lawful: State, state: State) -> State:
    """A law in the place of a flexible block, unless there is more evidence for the block and what goes with it.

    What a law misses beyond what laws depart by would be taken for other effects. Where it leaves no more than a good
    unit's imperfections do beside what the block leaves, and needs no more effects, it is the law all the same.
    """
    sessions = state.given.sessions
    missed = error_of(sessions, lawful.fit.model) ** 2 - error_of(sessions, state.fit.model) ** 2
    if missed <= state.thresholds.tolerable**2 and effect_count(lawful.fit.model) <= effect_count(state.fit.model):
        return lawful
    return lawful if _has_as_much_evidence(lawful, state) else state


def _is_simpler(other: Fit, state: State) -> bool:
    """Whether ``other`` is likelier than the fit of ``state``, odds against effects counted; or has fewer of them.

    The number decides where the two hardly read differently: what is immaterial counts for nothing, however sure it is.
    An arm that imitates a lag of a millisecond needs another one in its own place.
    """
    likelihood, odds = state.likelihood(), state.evidence.odds
    new, old = (
        (with_odds(likelihood.cost(one.model), one.model, odds), effect_count(one.model)) for one in (other, state.fit)
    )
    if _read_alike(other.model, state.fit.model, likelihood):
        return (new[1], new[0]) < (old[1], old[0])
    return new[0] < old[0]


def _read_alike(one: ExtendedModel, other: ExtendedModel, likelihood: Likelihood) -> bool:
    """Whether two models' readings differ by less than counts for anything."""
    thresholds = likelihood.thresholds
    return apart(likelihood.sessions, one, other) < thresholds.alike * thresholds.imperfection


def _are_alike(one: ExtendedModel, other: ExtendedModel, likelihood: Likelihood) -> bool:
    """Whether two models have the same effects, and hardly read differently."""
    return {*one.names} == {*other.names} and _read_alike(one, other, likelihood)


def _names(state: State) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Effects that are fitted, and those that the search about the fit came to."""
    return tuple(sorted(state.fit.model.names)), tuple(sorted(one.name for one in state.chosen))


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


def _best_of(fits: Sequence[Fit], state: State) -> tuple[Fit, Linearised | None]:
    """Of fits with equally many strengths the likeliest; of these, for each number one, that with most evidence.

    One strength more always fits better. Whether it is worth it where no equation is exact is for the evidence to say.
    The linearisation that it was taken of comes along.
    """
    likeliest: dict[int, Fit] = {}
    for one in sorted(fits, key=lambda one: one.cost):
        likeliest.setdefault(_strengths(one.model), one)
    few = list(likeliest.values())
    if len(few) == 1:
        return few[0], None
    weighed = [(one, *evidence_about(one.model, state.evidence)) for one in few]
    found, evidence, _ = min(weighed, key=lambda one: one[2].score)
    return found, evidence.given


def _strengths(model: ExtendedModel) -> int:
    """How many strengths a model's effects have: parameters that are null where the effect is not there."""
    return sum(parameter.null is not None for part in model.parts for parameter in part.effect.parameters)
