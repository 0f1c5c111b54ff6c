"""By how much one set of effects is better than another, and which rival comes how near."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from smartshoe.diagnosis.fitting import Evidence, Fit
from smartshoe.models.effects import catalogue, effect
from smartshoe.models.extended import ExtendedModel

LEAST_FALL = 30.0  # of -2 log likelihood for an effect with one parameter
FALL_A_PARAMETER = 8.0
MOST_COUNTED = 2  # parameters beyond the first: those of shape bend little more
# No equation is exact: a share of an effect's size that may be its error of shape.
SHAPE_ERROR = 0.05
CORNER_ERROR = 0.03  # the same of how a late reading rounds its corners
SEEN_CLEARLY = 10.0  # of -2 log likelihood
LATE = frozenset({"delay", "sensor_lag"})


@dataclass(frozen=True, eq=False)
class Rival:
    """Another effect in the place of a cause: ``margin`` is how much worse -2 log likelihood is, penalty included."""

    effect: str
    margin: float
    fit: Fit | None


def visible(evidence: Evidence, one: ExtendedModel, other: ExtendedModel) -> float:
    """Root mean square of the difference of two simulations over usable samples, share of full scale."""
    total, count = 0.0, 0
    for session in evidence.sessions:
        moved = (one.simulate(session.conditions) - other.simulate(session.conditions))[session.usable]
        total += float(moved @ moved)
        count += moved.size
    return float(np.sqrt(total / max(count, 1)))


def margin(evidence: Evidence, one: Fit, other: Fit, less: Fit) -> float:
    """By how much -2 log likelihood is worse for ``one`` than for ``other``, which differ in the last effect.

    ``less`` is the fit without either. Among static curves the pressure alone says little: no equation is exact, and
    a truth that departs from its own by `SHAPE_ERROR` of the effect's size leaves SHAPE_ERROR^2 of the fall behind,
    which another curve may follow better. There the displacement decides, where it was logged. A lag differs from a
    delay within milliseconds of a corner only: `Evidence.cost_of_corners`; nothing speaks for either beforehand.
    """
    names = one.model.names[-1], other.model.names[-1]
    worse = one.cost - other.cost
    more = penalty(names[0]) - penalty(names[1])
    if frozenset(names) == LATE:
        fall = max(less.cost - min(one.cost, other.cost), 0.0)
        worse = evidence.cost_of_corners(one.model) - evidence.cost_of_corners(other.model)
        return worse / (1.0 + CORNER_ERROR**2 * fall / SEEN_CLEARLY)
    seen = evidence.displacement_cost(other.model)
    if seen == 0.0 or any(effect(name).family != "static_curve" for name in names):
        return worse + more
    fall = max(less.cost - min(one.cost, other.cost), 0.0)
    return worse / (1.0 + SHAPE_ERROR**2 * fall / SEEN_CLEARLY) + more + evidence.displacement_cost(one.model) - seen


def penalty(name: str) -> float:
    """What -2 log likelihood must fall by for an effect to be taken in."""
    live = [p for p in catalogue()[name].parameters if not p.unit.endswith("/K")]
    return LEAST_FALL + FALL_A_PARAMETER * min(len(live) - 1, MOST_COUNTED)


def is_better(evidence: Evidence, one: Fit, other: Fit) -> bool:
    """Whether a set of effects is better than another: by corners where they differ in how a reading is late."""
    if set(one.model.names) ^ set(other.model.names) == LATE:
        return evidence.cost_of_corners(one.model) < evidence.cost_of_corners(other.model)
    return score(evidence, one) < score(evidence, other)


def score(evidence: Evidence, one: Fit) -> float:
    """What sets of effects are compared by."""
    return one.cost + sum(penalty(name) for name in one.model.names) + _of_curves(evidence, one.model)


def _of_curves(evidence: Evidence, model: ExtendedModel) -> float:
    """What the displacement says of the static curve in a model."""
    curved = any(part.effect.family == "static_curve" for part in model.parts)
    return evidence.displacement_cost(model) if curved else 0.0
