"""A gain that settles over load cycles, not over time."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from smartshoe.arrays import Array
from smartshoe.models.effects._sensor_inverse import c_number
from smartshoe.models.effects._wall_memory import NO_LOAD, Undone, cleaned_load
from smartshoe.models.effects.effect import Conditions, Effect, EffectParameter, Inverse
from smartshoe.models.effects.exposure import by

LEAST_HEIGHT = 0.08  # of full scale: what counts as a cycle


class CycleConditioning(Effect):
    """f (1 + m (1 - exp(-n/n0))), n the cycles of 8 % of full scale and more that are over."""

    name, family, stage, place = "cycle_conditioning", "softening", "wall", "wall"
    says = "the gain settles from cycle to cycle and keeps still in pauses"
    parameters = (
        EffectParameter("gained", "1", "gain after many cycles over that of the first, less 1", 0.0, -0.5, 1.0, 0.01),
        EffectParameter(
            "cycles", "1", "n0: cycles after which 63 % of it are there", None, 0.5, 50.0, 2.0, kind_ends="both"
        ),
    )
    shapes = tuple({"cycles": cycles} for cycles in (1.0, 4.0, 16.0))
    exposed_by = by("repeats", "pauses")
    separated_by = {
        "gain_drift": by("pauses", "temperature"),
        "mullins_softening": by("shuffled_loads"),
        "warm_up": by("pauses"),
    }
    departs_with = frozenset({"memory", "time"})

    def apply(self, signal: Array, conditions: Conditions, values: Array) -> Array:
        """The load with the gain so far; ``before["cycles"]`` counts along."""
        if values[0] == 0.0:
            return signal.copy()
        done = conditions.cache.get("cycles_done")
        if done is None:
            from smartshoe.kernels.memory import cycles_done

            done = conditions.cache["cycles_done"] = np.empty(signal.size)
            start = np.array([NO_LOAD, NO_LOAD, float(conditions.before.get("cycles", 0.0))])
            cycles_done(cleaned_load(conditions), LEAST_HEIGHT, start, done)
        return signal * (1.0 - float(values[0]) * np.expm1(done * (-1.0 / float(values[1]))))

    def inverse(self, values: Array, step_s: float) -> Inverse:
        """Divide by the gain so far, counting the cycles of what comes out; exact but for the count's threshold."""
        from smartshoe.kernels.memory import CYCLE_ENDS, conditioned_undone

        gained, per_cycle = float(values[0]), 1.0 / float(values[1])

        def body(of: Mapping[str, str]) -> str:
            count, trough, peak = of["count"], of["trough"], of["peak"]
            gain = f"(1.0 - {c_number(gained)} * expm1(-{count} * {c_number(per_cycle)}))"
            return f"""{{
    const double given = x;
    x = given / {gain};
    if ({trough} >= {NO_LOAD}) {{
        {trough} = x;
        {peak} = x;
    }} else if ({peak} - {trough} < {c_number(LEAST_HEIGHT)} && x < {trough}) {{
        {trough} = x;
        {peak} = x;
    }} else {{
        const int risen = {peak} - {trough} >= {c_number(LEAST_HEIGHT)};
        {peak} = x > {peak} ? x : {peak};
        if (risen && x <= {trough} + {c_number(CYCLE_ENDS)} * ({peak} - {trough})) {{
            {trough} = x;
            {peak} = x;
            {count} += 1.0;
            x = given / {gain};
        }}
    }}
}}"""

        start = np.array([NO_LOAD, NO_LOAD, 0.0])
        constants = (gained, per_cycle, LEAST_HEIGHT)
        return Undone(conditioned_undone, constants, start, ("trough", "peak", "count"), body)
