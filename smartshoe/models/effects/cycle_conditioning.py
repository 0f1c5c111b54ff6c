"""A gain that settles over load cycles, or with the path that the load goes, and not over time."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from smartshoe.arrays import Array
from smartshoe.models.effects._sensor_inverse import c_number
from smartshoe.models.effects._wall_memory import LEAST_DEAD_ZONE, NO_LOAD, SETTLED, Remembering, Undone, cleaned_load
from smartshoe.models.effects.effect import Conditions, EffectParameter, Inverse
from smartshoe.models.effects.exposure import by

LEAST_HEIGHT = 0.08  # of full scale: lower cycles do not count
MOST_ROUNDS = 60  # of a contraction that halves the error each time
MEMBERS = ("count", "trough", "peak", "place", "gone")


class CycleConditioning(Remembering):
    """f (1 + m (1 - exp(-n))), n = (1 - w) (N/n0)^stretch + w L/(2 n0).

    N is the number of finished cycles of at least 8 % of full scale (shakedown by counting). L is the path that the
    load has gone up and down, in full scales (endochronic, Valanis 1971): one cycle to full scale counts as one of
    either. A stretch below 1 is a mixture of settling numbers (Kohlrausch's, over cycles): fast at first, with a long
    tail.
    """

    name, family, stage, place = "cycle_conditioning", "softening", "wall", "wall"
    says = "the gain settles from cycle to cycle and keeps still in pauses"
    parameters = (
        EffectParameter("gained", "1", "gain after many cycles over that of the first, less 1", 0.0, -0.5, 1.0, 0.01),
        EffectParameter(
            "cycles", "1", "n0: cycles after which 63 % of it are there", None, 0.5, 50.0, 2.0, kind_ends="both"
        ),
        EffectParameter("by_way", "1", "w: share that goes by the load's way, not by cycles", None, 0.0, 1.0, 0.5,
                        absent=0.0, natural="both"),
        EffectParameter("stretch", "1", "exponent of the settling by cycles, 1 for a single number of them", None, 0.3,
                        1.0, 0.2, absent=1.0, natural="upper"),
    )  # fmt: skip
    shapes = tuple(
        {"cycles": cycles, "by_way": by_way, "stretch": 1.0} for cycles in (1.0, 4.0, 16.0) for by_way in (0.0, 1.0)
    )
    exposed_by = by("repeats", "pauses")
    separated_by = {
        "gain_drift": by("pauses", "rates", "temperature"),
        "mullins_softening": by("shuffled_loads"),
        "warm_up": by("pauses"),
    }

    def apply(self, signal: Array, conditions: Conditions, values: Array) -> Array:
        """The load with the gain so far; ``before["cycles"]`` and ``before["way"]`` of earlier recordings count."""
        if values[0] == 0.0:
            return signal.copy()
        gained, cycles, by_way, stretch = (float(value) for value in values)
        done, gone = (of / cycles for of in _done(conditions))
        count = (1.0 - by_way) * done**stretch + by_way * gone
        return signal * (1.0 - gained * np.expm1(-count))

    def inverse(self, values: Array, step_s: float, dead_zone: float = LEAST_DEAD_ZONE) -> Inverse:
        """Divide by the gain so far, counting cycles and path of its own output; exact but for the dead zone."""
        from smartshoe.kernels.memory import CYCLE_ENDS, conditioned_undone

        gained, per_cycle, by_way, stretch = float(values[0]), 1.0 / float(values[1]), *map(float, values[2:])

        def body(of: Mapping[str, str]) -> str:
            count, trough, peak, place, gone = (of[name] for name in MEMBERS)
            share = f"{count} * {c_number(per_cycle)}"
            # A settling with one number of cycles costs firmware no power, another one power a sample.
            share = share if stretch == 1.0 else f"pow({share}, {c_number(stretch)})"
            seek = f"""counted = {c_number(1.0 - by_way)} * {share};
    for (k = 0; k < {MOST_ROUNDS}; k++) {{
        const double guess = x;
        if ({place} >= {NO_LOAD}) {{
            z = x;
        }} else {{
            z = {place} < x - {c_number(dead_zone)} ? x - {c_number(dead_zone)} : {place};
            z = z > x + {c_number(dead_zone)} ? x + {c_number(dead_zone)} : z;
            moved = {gone} + 0.5 * fabs(z - {place});
        }}
        x = given / (1.0 - {c_number(gained)} * expm1(-(counted + {c_number(by_way * per_cycle)} * moved)));
        if (fabs(x - guess) <= {c_number(SETTLED)}) {{
            break;
        }}
    }}"""
            return f"""{{
    const double given = x;
    double moved = {gone}, z = x, counted;
    int k;
    {seek}
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
            {seek}
        }}
    }}
    {place} = z;
    {gone} = moved;
}}"""

        start = np.array([0.0, NO_LOAD, NO_LOAD, NO_LOAD, 0.0])
        constants = (gained, per_cycle, by_way, stretch, LEAST_HEIGHT, dead_zone, MOST_ROUNDS, SETTLED)
        return Undone(conditioned_undone, constants, start, MEMBERS, body)


def half_way(conditions: Conditions) -> Array:
    """Half the path (n,) that the load has gone up and down since the recording began, without its noise."""
    load = cleaned_load(conditions)
    return np.asarray(0.5 * np.cumsum(np.abs(np.diff(load, prepend=load[0]))))


def _done(conditions: Conditions) -> tuple[Array, Array]:
    """Finished cycles (n,) and half the path of the load (n,), both without its noise; computed once."""
    done, gone = conditions.cache.get("cycles_done"), conditions.cache.get("way_gone")
    if done is None or gone is None:
        from smartshoe.kernels.memory import cycles_done

        load, before = cleaned_load(conditions), conditions.before
        done, counted = np.empty(load.size), float(before.get("cycles", 0.0))
        cycles_done(load, LEAST_HEIGHT, np.array([NO_LOAD, NO_LOAD, counted]), done)
        gone = float(before.get("way", counted)) + half_way(conditions)
        conditions.cache["cycles_done"], conditions.cache["way_gone"] = done, gone
    return done, gone
