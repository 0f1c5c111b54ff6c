"""Air that leaves through a hole: turbulent, as the root of the pressure."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from smartshoe.arrays import Array
from smartshoe.models.effects._sensor_inverse import c_number
from smartshoe.models.effects._wall_memory import Undone
from smartshoe.models.effects.effect import Conditions, Effect, EffectParameter, Inverse
from smartshoe.models.effects.exposure import by


class OrificeLeak(Effect):
    """w' = lambda p/sqrt(|p|), laminar below a small pressure; p = P - w is the pressure that is left.

    The rate is of the *reading*: wall and gas are in series, so that of the air lost only the part 1 - 1/N (N about
    1.6) is seen. Integrated by the implicit trapezoid, of second order in the step.
    """

    name, family, stage, place = "orifice_leak", "leak", "gas", "gas"
    says = "air leaves through a hole: in holds the reading falls, in a straight line rather than exponentially"
    parameters = (
        EffectParameter("leak_rate", "FS_reading/s", "fall of the reading a second at full scale", 0.0, 0.0, 2.0, 1e-3),
        EffectParameter("laminar_below", "FS_reading", "where the flow turns laminar", None, 3e-4, 0.1, 0.01),
    )
    shapes = ({"laminar_below": 0.005},)
    exposed_by = by("holds", "rests", "peaks")
    separated_by = {
        "linear_leak": by("holds", "peaks"),
        "permanent_set": by("rests"),
        "zero_drift": by("idle", "long_hold", "temperature"),
    }
    is_leak = True

    def apply(self, signal: Array, conditions: Conditions, values: Array) -> Array:
        """The pressure (n,) that is left."""
        if values[0] == 0.0:
            return signal.copy()
        from smartshoe.kernels.memory import orifice

        out = np.empty(signal.size)
        rate = float(values[0]) * conditions.step_s
        orifice(np.ascontiguousarray(signal), rate, float(values[1]), np.zeros(2), out)
        return out

    def inverse(self, values: Array, step_s: float) -> Inverse:
        """Add what has left, integrated from the pressure that is left: exact."""
        from smartshoe.kernels.memory import orifice_undone

        rate, laminar = float(values[0]) * step_s, float(values[1])

        def body(of: Mapping[str, str]) -> str:
            return f"""{{
    const double flow = x / sqrt(sqrt(x * x + {c_number(laminar * laminar)}));
    {of["lost"]} += {c_number(0.5 * rate)} * (flow + {of["flow"]});
    {of["flow"]} = flow;
    x += {of["lost"]};
}}"""

        return Undone(orifice_undone, (rate, laminar), np.zeros(2), ("lost", "flow"), body)
