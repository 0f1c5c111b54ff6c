"""Rubber that is stiffer the first time than ever after."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from smartshoe.models.effects._sensor_inverse import c_number
from smartshoe.models.effects._wall_memory import LEAST_DEAD_ZONE, Undone, dead_zone
from smartshoe.models.effects.effect import Array, Conditions, Effect, EffectParameter, Inverse

POWER = 2.0  # as the strain energy, after Ogden and Roxburgh 1999


class MullinsSoftening(Effect):
    """f (1 + m tanh((M^2 - f^2)/width)/tanh(3/(4 width))), M the largest load so far.

    Loading to a new maximum follows the stiff curve; below it the wall is softer and the gas takes more of the load.
    m is the gain at half of full scale after a load of full scale.
    """

    name, family, stage, place = "mullins_softening", "softening", "wall", "wall"
    says = "the first loading to a level reads lower than every later one to that level or below"
    parameters = (
        EffectParameter(
            "gained", "1", "gain at half load after a full load, over the virgin one, less 1", 0.0, 0.0, 0.3, 0.01
        ),
        EffectParameter(
            "width", "FS_load^2", "how far below the largest load softening is complete", None, 0.02, 3.0, 0.3
        ),
    )
    shapes = ({"width": 0.1}, {"width": 0.5})
    exposed_by = frozenset({"peaks", "repeats"})
    separated_by = {
        "cycle_conditioning": "loads in shuffled order",
        "play_hysteresis": "repeats",
        "gain_drift": "pauses",
    }

    def apply(self, signal: Array, conditions: Conditions, values: Array) -> Array:
        """The load that a wall without softening would need; ``before["largest_load"]`` counts."""
        if values[0] == 0.0:
            return signal.copy()
        largest = np.maximum.accumulate(signal) - dead_zone(conditions)
        np.maximum(largest, float(conditions.before.get("largest_load", 0.0)), out=largest)
        below = np.maximum(largest, 0.0) ** 2 - np.maximum(signal, 0.0) ** 2
        amount, width = _amount(values)
        gain: Array = 1.0 + amount * np.tanh(np.maximum(below, 0.0) / width)
        return signal * gain

    def inverse(self, values: Array, step_s: float) -> Inverse:
        """Bisection below the largest load, the identity above; exact for a load without noise."""
        from smartshoe.kernels.memory import softened_undone

        amount, width = _amount(values)

        def body(of: Mapping[str, str]) -> str:
            most = of["largest"]
            return f"""{{
    double v = x;
    if (x > 0.0 && x < {most} * {c_number(1.0 + amount)}) {{
        double low = x / {c_number(1.0 + amount)}, high = x;
        int k;
        for (k = 0; k < 50; k++) {{
            double below;
            v = 0.5 * (low + high);
            below = {most} * {most} - v * v;
            if (v * (1.0 + {c_number(amount)} * tanh((below > 0.0 ? below : 0.0) / {c_number(width)})) < x) {{
                low = v;
            }} else {{
                high = v;
            }}
        }}
        v = 0.5 * (low + high);
    }}
    if (v - {c_number(LEAST_DEAD_ZONE)} > {most}) {{
        {most} = v - {c_number(LEAST_DEAD_ZONE)};
    }}
    x = v;
}}"""

        return Undone(softened_undone, (amount, width, LEAST_DEAD_ZONE), np.zeros(1), ("largest",), body)


def _amount(values: Array) -> tuple[float, float]:
    gained, width = (float(value) for value in values)
    return gained / math.tanh(0.75 / width), width
