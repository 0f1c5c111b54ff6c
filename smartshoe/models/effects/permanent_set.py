"""A permanent set: the wall does not come back, by an amount that grows with the dose of load."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from smartshoe.arrays import Array
from smartshoe.models.effects._sensor_inverse import c_number
from smartshoe.models.effects._wall_memory import Undone
from smartshoe.models.effects.effect import Conditions, Effect, EffectParameter, Inverse
from smartshoe.models.effects.exposure import by


class PermanentSet(Effect):
    """p + s integral of max(p, 0)^m: the wall's unloaded place moves, and pressure stays when the load goes.

    The dose is of the pressure without the set (a held load's share of full scale), by the trapezoid, of second order
    in the step. m is Findley's stress exponent.
    """

    name, family, stage, place = "permanent_set", "zero", "wall", "gas"
    says = "the unloaded reading rises with every second under load, and stays"
    parameters = (
        EffectParameter("set_rate", "FS_reading/s", "rise a second under full-scale load", 0.0, 0.0, 0.05, 1e-4),
        EffectParameter("exponent", "1", "power of the load in the dose", None, 0.7, 3.0, 1.0),
    )
    shapes = ({"exponent": 1.2},)
    exposed_by = by("rests", "holds", "pauses")
    separated_by = {
        "linear_leak": by("rests"),
        "orifice_leak": by("rests"),
        "warm_up": by("pauses", "shuffled_loads"),
        "zero_drift": by("pauses", "shuffled_loads"),
    }
    is_seen_at_rest = True
    branch = "set"

    def apply(self, signal: Array, conditions: Conditions, values: Array) -> Array:
        """The pressure with the set so far; ``before["dose"]`` of earlier recordings (full scales times s) counts."""
        rate, exponent = (float(value) for value in values)
        if rate == 0.0:
            return signal.copy()
        flow = np.maximum(signal, 0.0) ** exponent
        dose = np.empty(signal.size)
        dose[:1] = conditions.before.get("dose", 0.0)
        np.cumsum(0.5 * conditions.step_s * (flow[1:] + flow[:-1]), out=dose[1:])
        dose[1:] += dose[:1]
        return signal + rate * dose

    def inverse(self, values: Array, step_s: float) -> Inverse:
        """Subtract the set; exact, since the dose is of the inverse's own output."""
        from smartshoe.kernels.dose import set_undone

        half, exponent = 0.5 * float(values[0]) * step_s, float(values[1])

        def body(of: Mapping[str, str]) -> str:
            m = c_number(exponent)
            return f"""if (!({of["flow"]} < 0.0)) {{
    const double known = x - {of["set"]} - {c_number(half)} * {of["flow"]};
    double p = known;
    int k;
    for (k = 0; k < 12; k++) {{
        p = known - {c_number(half)} * (p > 0.0 ? pow(p, {m}) : 0.0);
    }}
    p = p > 0.0 ? pow(p, {m}) : 0.0;
    {of["set"]} += {c_number(half)} * ({of["flow"]} + p);
    {of["flow"]} = p;
    x -= {of["set"]};
}} else {{
    {of["flow"]} = x > 0.0 ? pow(x, {m}) : 0.0;
}}"""

        return Undone(set_undone, (half, exponent), np.array([0.0, -1.0]), ("set", "flow"), body)
