"""Relaxing arms, the baseline's and the effects': which of several exponentials is the baseline's."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

from smartshoe.diagnosis._baseline import USUAL, is_beyond_memory, with_usual_arm
from smartshoe.diagnosis._likelihood import FEW_STEPS, Fit, fit
from smartshoe.diagnosis._members import begun_with
from smartshoe.diagnosis._search import BREADTH, SWAPS, additions
from smartshoe.diagnosis._sensitivity import available
from smartshoe.diagnosis._state import State, searched, state_at, with_members
from smartshoe.integrity.thresholds import Thresholds
from smartshoe.models.effects.effect import CoreEffect
from smartshoe.models.elements import Arm
from smartshoe.models.extended import ExtendedModel


def with_another_pole(state: State) -> State:
    """The best of fits from several relaxation rates without the effects that add arms to the baseline's.

    An effect that bent the baseline's rate at first leaves the true rate to be found as a second arm.
    """
    likelihood = state.likelihood()
    bare = _without_core_effects(state.fit.model)
    share = USUAL.relaxing_share
    starts = [replace(bare, relaxation_rate_per_s=1.0 / tau, relaxing_share=share) for tau in state.thresholds.memory_s]
    return state_at(min((fit(likelihood, one, FEW_STEPS) for one in starts), key=lambda one: one.cost))


def late_beside_usual_arm(state: State) -> Fit:
    """The best of fits of the effects that delay a reading, each beside an arm as units have.

    The plain model's arm imitates a lag: it comes to its bounds, or stays within them, and no lag is found about it.
    """
    likelihood = state.likelihood()
    bare = with_usual_arm(state.fit.model)
    effects = available(likelihood.sessions, state.thresholds)
    late = [one for one in effects if one.is_latency and one.name not in bare.names]
    return min((fit(likelihood, begun_with(one, bare, likelihood)) for one in late), key=lambda one: one.cost)


def with_a_usual_arm(state: State) -> State:
    """The best of fits of a few likely effects, each beside an arm as units have, where that of ``state`` follows one.

    About such an arm the effect that it follows is not found, but a second arm, which is the unit's own.
    """
    starts = [with_arm(state.fit.model, arm) for arm in _usual_arms(state.thresholds)]
    found = _fits_from(starts, state, BREADTH)  # far from any fit, one linearisation does not decide
    few = dict.fromkeys((*_likeliest(_usual(found, state), state), *_likeliest(found, state)))
    return state_at(_likeliest(_usual(_at_their_end(few), state), state)[0])


def with_an_arm_that_creeps(state: State) -> State:
    """The best of fits from a baseline that creeps under load, where that of ``state`` falls.

    Which of two exponentials is the baseline's is a convention: of a wall it is the one that creeps under load, and
    what falls is an effect's. It may be the arm of an effect that was found, or hidden by the one that falls, which may
    be an effect by itself: air that leaves.
    """
    model, bare = state.fit.model, _without_core_effects(state.fit.model)
    arms = [*_usual_arms(state.thresholds), *(arm for _, arm in arms_of(model))]
    starts = creeping = [with_arm(bare, arm) for arm in arms]
    for effect in available(state.given.sessions, state.thresholds):
        values = effect.falling_at(model.pole_per_s, model.wall_ratio)
        if values is not None and effect.name not in bare.names:
            starts = [*starts, *(one.with_part(effect, values) for one in creeping)]
    found = _fits_from(starts, state)
    return state_at(_likeliest(_at_their_end(_likeliest(found, state)), state)[0])


def arms_of(model: ExtendedModel) -> list[tuple[str, Arm]]:
    """The arms that creep under load, one each, of a model's effects, by name."""
    made = [
        (part.name, part.effect.elements(part.values)) for part in model.parts if isinstance(part.effect, CoreEffect)
    ]
    return [(name, arm) for name, (arm, *more) in made if not more and isinstance(arm, Arm) and arm.share > 0.0]


def with_arm(model: ExtendedModel, arm: Arm) -> ExtendedModel:
    """``model`` with another arm and the same gain for fast loads; the static gain follows from the arm's share."""
    fast = model.gain / (1.0 + model.relaxing_share)
    return replace(model, gain=fast * (1.0 + arm.share), relaxing_share=arm.share, relaxation_rate_per_s=arm.rate_per_s)


def effect_count(model: ExtendedModel) -> int:
    """How many effects a model has: its parts, and an arm of the baseline's that falls where a wall's creeps."""
    return len(model.parts) + (model.relaxing_share < 0.0)


def with_odds(cost: float, model: ExtendedModel, odds: float) -> float:
    """-2 log likelihood ``cost`` of a model with the ``odds`` against each of its effects; the less, the better."""
    return cost + odds * effect_count(model)


def _usual_arms(thresholds: Thresholds) -> list[Arm]:
    return [Arm(USUAL.relaxing_share, 1.0 / tau) for tau in thresholds.memory_s]


def _fits_from(starts: Sequence[ExtendedModel], state: State, breadth: int = 0) -> list[Fit]:
    """Fits of what a linearisation about each start asks for, and of the ``breadth`` likeliest effects alone."""
    likelihood, found = state.likelihood(), []
    for start in starts:
        evidence, best = searched(start, state.given.sessions, state.thresholds)
        alone = [evidence.posterior((k,)) for k in additions(evidence, (), breadth)] if breadth else []
        few = dict.fromkeys((best, *alone))  # what is asked for is often one of these
        found += [fit(likelihood, with_members(evidence.given, one, start, likelihood), FEW_STEPS) for one in few]
    return found


def _usual(found: Sequence[Fit], state: State) -> Sequence[Fit]:
    """Those whose arm is one that laws remember by; all where there is none."""
    return [one for one in found if not is_beyond_memory(one.model, state.thresholds)] or found


def _likeliest(found: Sequence[Fit], state: State) -> list[Fit]:
    """The few that promise most, the likeliest first, the odds against effects counted."""
    return sorted(found, key=lambda one: with_odds(one.cost, one.model, state.evidence.odds))[:SWAPS]


def _at_their_end(few: Iterable[Fit]) -> list[Fit]:
    """Fits that began far from any end, gone on with: half way the rest is taken for other effects."""
    return [fit(one.likelihood, one.model) for one in few]


def _without_core_effects(model: ExtendedModel) -> ExtendedModel:
    return model.without(*(part.name for part in model.parts if isinstance(part.effect, CoreEffect)))
