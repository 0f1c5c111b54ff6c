"""Relaxing arms of the baseline and of effects: which of several exponentials is the baseline's."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

from smartshoe.diagnosis._baseline import USUAL, has_arm_beyond_memory, with_usual_arm
from smartshoe.diagnosis._likelihood import FEW_STEPS, Fit, fit
from smartshoe.diagnosis._members import start_with
from smartshoe.diagnosis._search import BREADTH, SWAPS, best_additions
from smartshoe.diagnosis._sensitivity import available_effects
from smartshoe.diagnosis._state import State, linearised_search, state_at, with_members
from smartshoe.integrity.thresholds import Thresholds
from smartshoe.models.effects.effect import CoreEffect
from smartshoe.models.elements import Arm
from smartshoe.models.extended import ExtendedModel


def with_another_pole(state: State) -> State:
    """The best of fits from several relaxation rates, without the effects that add arms.

    An effect that bent the baseline's rate at first leaves the true rate to appear as a second arm.
    """
    likelihood = state.likelihood()
    bare = _without_core_effects(state.fit.model)
    share = USUAL.relaxing_share
    starts = [replace(bare, relaxation_rate_per_s=1.0 / tau, relaxing_share=share) for tau in state.thresholds.memory_s]
    return state_at(min((fit(likelihood, one, FEW_STEPS) for one in starts), key=lambda one: one.cost))


def latency_with_usual_arm(state: State) -> Fit:
    """The best of fits with one more effect that delays the reading, each from a usual arm.

    The plain model's arm can imitate a lag, at its bounds or within them, and then no lag is found beside it.
    """
    return latency_beside(with_usual_arm(state.fit.model), state)


def latency_for_arm(state: State) -> Fit:
    """The best of fits with one more effect that delays the reading in the place of the baseline's arm.

    An arm that relaxes nearly all of the load is a lag in a free form, beside which the unit's own arm is an effect's.
    """
    model = state.fit.model
    swapped = [with_arm(model.without(name), arm) for name, arm in arms_of(model)]
    starts = [*swapped, with_usual_arm(_without_core_effects(model))]
    return min((latency_beside(one, state) for one in starts), key=lambda one: one.cost)


def latency_beside(bare: ExtendedModel, state: State) -> Fit:
    """The best of fits of ``bare`` with one more effect that delays the reading."""
    likelihood = state.likelihood()
    effects = available_effects(likelihood.sessions, state.thresholds)
    late = [one for one in effects if one.is_latency and one.name not in bare.names]
    starts = [start_with(one, bare, likelihood) for one in late] or [bare]
    return min((fit(likelihood, one) for one in starts), key=lambda one: one.cost)


def with_a_usual_arm(state: State) -> State:
    """The best of fits of a few probable effects, each from a usual arm, where the arm of ``state`` follows an effect.

    Beside such an arm the effect itself is not found, but a second arm is, which is the unit's own.
    """
    starts = [with_arm(state.fit.model, arm) for arm in _usual_arms(state.thresholds)]
    found = _fits_from(starts, state, BREADTH)  # far from a fit, one linearisation does not decide
    few = dict.fromkeys((*_most_probable(_with_memory_arms(found, state), state), *_most_probable(found, state)))
    return state_at(_most_probable(_with_memory_arms(_fitted_fully(few), state), state)[0])


def with_creeping_arm(state: State) -> State:
    """The best of fits from a baseline that creeps under load, where that of ``state`` falls.

    Which of two exponentials is the baseline's is a convention: a wall's arm creeps under load, and a falling one is an
    effect's. The creeping arm may be that of an effect that was found, or be hidden by the falling one, which may be an
    effect itself (air that leaves).
    """
    model, bare = state.fit.model, _without_core_effects(state.fit.model)
    arms = [*_usual_arms(state.thresholds), *(arm for _, arm in arms_of(model))]
    starts = creeping = [with_arm(bare, arm) for arm in arms]
    for effect in available_effects(state.linearisation.sessions, state.thresholds):
        values = effect.falling_at(model.pole_per_s, model.wall_ratio)
        if values is not None and effect.name not in bare.names:
            starts = [*starts, *(one.with_part(effect, values) for one in creeping)]
    found = _fits_from(starts, state)
    return state_at(_most_probable(_fitted_fully(_most_probable(found, state)), state)[0])


def arms_of(model: ExtendedModel) -> list[tuple[str, Arm]]:
    """The creeping arms of a model's effects, by name, for effects with exactly one arm."""
    made = [
        (part.name, part.effect.elements(part.values)) for part in model.parts if isinstance(part.effect, CoreEffect)
    ]
    return [(name, arm) for name, (arm, *more) in made if not more and isinstance(arm, Arm) and arm.share > 0.0]


def with_arm(model: ExtendedModel, arm: Arm) -> ExtendedModel:
    """``model`` with another arm and the same gain for fast loads; the static gain follows from the arm's share."""
    fast = model.gain / (1.0 + model.relaxing_share)
    return replace(model, gain=fast * (1.0 + arm.share), relaxing_share=arm.share, relaxation_rate_per_s=arm.rate_per_s)


def effect_count(model: ExtendedModel) -> int:
    """The number of effects of a model, a falling arm of the baseline included."""
    return len(model.parts) + (model.relaxing_share < 0.0)


def with_odds(cost: float, model: ExtendedModel, odds: float) -> float:
    """The cost of a model plus ``odds`` for each of its effects; lower is better."""
    return cost + odds * effect_count(model)


def _usual_arms(thresholds: Thresholds) -> list[Arm]:
    """Arms of the usual share at each of the usual time constants."""
    return [Arm(USUAL.relaxing_share, 1.0 / tau) for tau in thresholds.memory_s]


def _fits_from(starts: Sequence[ExtendedModel], state: State, breadth: int = 0) -> list[Fit]:
    """Fits of the set found about each start, and of each of the ``breadth`` most probable effects alone."""
    likelihood, found = state.likelihood(), []
    for start in starts:
        evidence, best = linearised_search(start, state.linearisation.sessions, state.thresholds)
        alone = [evidence.posterior((k,)) for k in best_additions(evidence, (), breadth)] if breadth else []
        few = dict.fromkeys((best, *alone))  # the set is often one of the single effects
        found += [
            fit(likelihood, with_members(evidence.linearisation, one, start, likelihood), FEW_STEPS) for one in few
        ]
    return found


def _with_memory_arms(found: Sequence[Fit], state: State) -> Sequence[Fit]:
    """Fits whose arm has a time constant that laws remember by; all if there is none."""
    return [one for one in found if not has_arm_beyond_memory(one.model, state.thresholds)] or found


def _most_probable(found: Sequence[Fit], state: State) -> list[Fit]:
    """The fits of lowest cost, odds against effects included, at most `SWAPS`."""
    return sorted(found, key=lambda one: with_odds(one.cost, one.model, state.evidence.odds))[:SWAPS]


def _fitted_fully(few: Iterable[Fit]) -> list[Fit]:
    """The fits continued to convergence: half way, what is missing would be taken for other effects."""
    return [fit(one.likelihood, one.model) for one in few]


def _without_core_effects(model: ExtendedModel) -> ExtendedModel:
    """``model`` without effects of wall and gas, which may add arms."""
    return model.without(*(part.name for part in model.parts if isinstance(part.effect, CoreEffect)))
