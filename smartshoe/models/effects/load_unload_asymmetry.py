"""A gain that depends on the direction of loading."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from smartshoe.arrays import Array
from smartshoe.models.effects._sensor_inverse import c_number
from smartshoe.models.effects._wall_memory import LEAST_DEAD_ZONE, NO_LOAD, Undone, cleaned_load
from smartshoe.models.effects.effect import Conditions, Effect, EffectParameter, Inverse
from smartshoe.models.effects.exposure import by


class LoadUnloadAsymmetry(Effect):
    """f (1 - a (1 - s)/2), s the sense of motion: ds = (sgn(df) - s) |df|/turn, kept through holds, +1 at first."""

    name, family, stage, place = "load_unload_asymmetry", "asymmetry", "wall", "wall"
    is_steep_undone = True
    says = "unloading has another gain than loading: the reading jumps where the load turns, in proportion to the load"
    parameters = (
        EffectParameter("lost_gain", "1", "share of the gain that unloading lacks", 0.0, -0.6, 0.6, 0.01),
        EffectParameter("turn", "FS_load", "load over which the sense turns over", None, 0.001, 0.03, 0.005),
    )
    shapes = ({"turn": 0.005},)
    exposed_by = by("rates", "peaks", "minor_loops")
    separated_by = {
        "bouc_wen_hysteresis": by("minor_loops"),
        "gain_drift": by("repeats"),
        "play_hysteresis": by("minor_loops"),
        "rate_gain": by("rates"),
    }
    departs_with = frozenset({"load", "direction", "memory"})

    def apply(self, signal: Array, conditions: Conditions, values: Array) -> Array:
        """The load that reaches the tube."""
        if values[0] == 0.0:
            return signal.copy()
        from smartshoe.kernels.memory import sense_of_motion

        out = np.empty(signal.size)
        sense_of_motion(cleaned_load(conditions), float(values[1]), np.array([NO_LOAD, 1.0]), out)
        return signal * (1.0 - 0.5 * float(values[0]) * (1.0 - out))

    def inverse(self, values: Array, step_s: float) -> Inverse:
        """The load whose own sense gives the output, by bisection; exact for a load without noise."""
        from smartshoe.kernels.memory import sense_undone

        lost, turn = float(values[0]), float(values[1])

        def body(of: Mapping[str, str]) -> str:
            zone = c_number(LEAST_DEAD_ZONE)
            return f"""{{
    const double other = x / {c_number(1.0 - lost)};
    double low = x < other ? x : other, high = x < other ? other : x;
    double v = x, sense = {of["sense"]}, cleaned = {of["last"]};
    int k;
    for (k = 0; k <= 50; k++) {{
        double move = 0.0;
        v = 0.5 * (low + high);
        cleaned = v;
        sense = {of["sense"]};
        if ({of["last"]} < {NO_LOAD}) {{
            cleaned = {of["last"]};
            cleaned = cleaned < v - {zone} ? v - {zone} : cleaned;
            cleaned = cleaned > v + {zone} ? v + {zone} : cleaned;
            move = cleaned - {of["last"]};
        }}
        if (move > 0.0) {{
            sense = 1.0 + (sense - 1.0) * exp(-move / {c_number(turn)});
        }} else if (move < 0.0) {{
            sense = -1.0 + (sense + 1.0) * exp(move / {c_number(turn)});
        }}
        if (k == 50) {{
            break;
        }}
        if (v * (1.0 - {c_number(0.5 * lost)} * (1.0 - sense)) < x) {{
            low = v;
        }} else {{
            high = v;
        }}
    }}
    x = v;
    {of["sense"]} = sense;
    {of["last"]} = cleaned;
}}"""

        start = np.array([NO_LOAD, 1.0])
        return Undone(sense_undone, (lost, turn, LEAST_DEAD_ZONE), start, ("last", "sense"), body)
