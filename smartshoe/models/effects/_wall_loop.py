"""Springs that bend inside the loop of wall and gas, beside the arm that relaxes."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from smartshoe.arrays import Array
from smartshoe.models.effects.effect import Conditions

ROUNDS = 2


def shared(static: Callable[[Array], Array], load: Array, conditions: Conditions) -> tuple[Array, Array]:
    """How the spring that bends and the arm that relaxes share a load (n,): (n,) each.

    Balance: f = phi(u) + kappa (u - q), q' = a (u - q), phi the inverse of ``static``. A block hands the linear core
    u + kappa (u - q), which it turns into u. kappa and a are ``conditions.relaxing``; without them the arm has
    nothing. Each round is the linear network's answer to what is off, which shrinks by kappa |1 - static'|/(1 + kappa);
    the paper's units have kappa of 0.03 to 0.06.
    """
    relaxing = conditions.relaxing
    if relaxing is None:
        return load, np.zeros(load.size)
    share, slow = relaxing[0], relaxing[1] / (1.0 + relaxing[0])
    deformation = _yielding(static(load), share, slow, conditions)
    for _ in range(ROUNDS):
        off = static(load - relaxed(deformation, conditions)) - deformation
        deformation += _yielding(off, share, slow, conditions)
    arm = relaxed(deformation, conditions)
    return load - arm, arm


def relaxed(deformation: Array, conditions: Conditions) -> Array:
    """Load (n,) of the arm that relaxes, kappa (u - q), under a deformation (n,) in straight lines."""
    from smartshoe.models.first_order import lag

    relaxing = conditions.relaxing
    if relaxing is None:
        return np.zeros(deformation.size)
    force: Array = relaxing[0] * (deformation - lag(deformation, relaxing[1], float(conditions.step_s)))
    return force


def _yielding(load: Array, share: float, slow: float, conditions: Conditions) -> Array:
    """Deformation (n,) of a straight spring beside the arm: (s + a)/((1 + kappa) s + a), ``slow`` = a/(1 + kappa)."""
    from smartshoe.models.first_order import lag

    return load - share / (1.0 + share) * (load - lag(load, slow, float(conditions.step_s)))
