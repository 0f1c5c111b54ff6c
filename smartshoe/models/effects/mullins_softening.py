"""Rubber that is stiffer the first time than ever after."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from smartshoe.arrays import Array
from smartshoe.models.effects._beside_arm import BesideArm
from smartshoe.models.effects._sensor_inverse import c_number
from smartshoe.models.effects._wall_loop import arm_beside
from smartshoe.models.effects._wall_memory import LEAST_DEAD_ZONE, Undone, dead_zone
from smartshoe.models.effects.effect import Conditions, Effect, EffectParameter, Inverse
from smartshoe.models.effects.exposure import by
from smartshoe.models.elements import Arm


class MullinsSoftening(Effect):
    """f = u (1 - c tanh((M^2 - u^2)/width)), M the largest load so far (after Ogden and Roxburgh 1999).

    Loading to a new maximum follows the stiff curve; below it the wall is softer and the gas takes more of the load.
    ``gained`` = 1/(1 - c tanh(3/(4 width))) - 1 is what the gain rises at half of full scale after full scale.
    """

    name, family, stage, place = "mullins_softening", "softening", "wall", "wall"
    says = "the first loading to a level reads lower than every later one to that level or below"
    parameters = (
        EffectParameter(
            "gained", "1", "gain at half load after a full load, over the virgin one, less 1", 0.0, 0.0, 1.0, 0.01
        ),
        EffectParameter(
            "width", "1", "how far below M^2 softening is complete, squares of full scale", None, 0.02, 3.0, 0.3
        ),
    )
    shapes = ({"width": 0.1}, {"width": 0.5})
    exposed_by = by("peaks", "repeats")
    separated_by = {
        "cycle_conditioning": by("shuffled_loads"),
        "gain_drift": by("pauses", "shuffled_loads"),
        "play_hysteresis": by("repeats"),
    }
    departs_with = frozenset({"memory", "load"})

    def apply(self, signal: Array, conditions: Conditions, values: Array) -> Array:
        """The load that a wall without softening would need; ``before["largest_load"]`` counts."""
        from smartshoe.kernels.wall_loop import softened

        if values[0] == 0.0:
            return signal.copy()
        before, out = float(conditions.before.get("largest_load", 0.0)), np.empty(signal.size)
        given = *_amount(values), before, dead_zone(conditions), *arm_beside(conditions)
        softened(np.ascontiguousarray(signal), *given, out)
        return out

    def inverse_beside(self, arm: Arm, values: Array, step_s: float) -> Inverse:
        """What the arm bears set apart first."""
        return BesideArm(self.inverse(values, step_s), arm, step_s)

    def inverse(self, values: Array, step_s: float) -> Inverse:
        """f (static) from u, in closed form; exact for a load without noise."""
        from smartshoe.kernels.memory import softened_undone

        amount, width = _amount(values)

        def body(of: Mapping[str, str]) -> str:
            most = of["largest"]
            return f"""{{
    const double below = {most} * {most} - x * x;
    x *= 1.0 - {c_number(amount)} * tanh((below > 0.0 ? below : 0.0) / {c_number(width)});
    if (x - {c_number(LEAST_DEAD_ZONE)} > {most}) {{
        {most} = x - {c_number(LEAST_DEAD_ZONE)};
    }}
}}"""

        return Undone(softened_undone, (amount, width, LEAST_DEAD_ZONE), np.zeros(1), ("largest",), body)


def _amount(values: Array) -> tuple[float, float]:
    gained, width = (float(value) for value in values)
    return gained / (1.0 + gained) / math.tanh(0.75 / width), width
