"""A gain that motion moves and rest brings back: thixotropy, without a law."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from smartshoe.arrays import Array
from smartshoe.models.effects._sensor_inverse import c_number
from smartshoe.models.effects._wall_memory import (
    LEAST_DEAD_ZONE,
    NO_LOAD,
    SETTLED,
    Remembering,
    Undone,
    cleaned,
    dead_zone,
)
from smartshoe.models.effects.effect import Conditions, EffectParameter, Inverse
from smartshoe.models.effects.exposure import by

MOST_ROUNDS = 120  # of a contraction to 0.75 at most, within the bounds: to this power that is 1e-15


class FlexibleThixotropy(Remembering):
    """f (1 + g b), b' = (1 - b) w |f'|/2 - b/T: motion breaks a structure down, and time builds it up again.

    The kinetics of one structure parameter (Mewis and Wagner 2009, eq. 4). A gel, a filled rubber or a foam thins as it
    is worked; an amplifier that adjusts its own gain does so too. A law of softening does not come back at rest.
    """

    name, family, stage, place = "flexible_thixotropy", "softening", "wall", "wall"
    says = "the gain changes as the load moves, and comes back while it rests"
    parameters = (
        EffectParameter("gained", "1", "gain of what is broken down over that of what is whole, less 1", 0.0, -0.3, 0.3,
                        0.01),
        EffectParameter("per_loading", "1", "w: how much of it a loading to full scale and back breaks", None, 0.1,
                        5.0, 1.0),
        EffectParameter("recovery_time", "s", "T: time in which rest builds 63 % of it up again", None, 5.0, 100.0,
                        10.0, kind_ends="lower"),
    )  # fmt: skip
    shapes = tuple({"per_loading": 1.0, "recovery_time": tau} for tau in (5.0, 20.0))
    exposed_by = by("repeats", "pauses")
    separated_by = {"cycle_conditioning": by("pauses"), "gain_drift": by("pauses", "rates")}
    is_flexible = is_catch_all = True
    why_unnamed = "changes its gain as the load moves, and gets it back at rest, as what is thixotropic does"

    def apply(self, signal: Array, conditions: Conditions, values: Array) -> Array:
        """The load with the gain so far; whole as the session begins."""
        if values[0] == 0.0:
            return signal.copy()
        gained, per_loading, recovery_s = (float(value) for value in values)
        return signal * (1.0 + gained * _broken(conditions, per_loading, recovery_s))

    def departs_by(self, values: Array) -> float:
        """The share of it that a rest of a minute brings back, which no law of softening does."""
        return float(-np.expm1(-60.0 / values[2]))

    def inverse(self, values: Array, step_s: float, dead_zone: float = LEAST_DEAD_ZONE) -> Inverse:
        """Divide by the gain so far, by the way of its own output; exact but for the dead zone."""
        from smartshoe.kernels.structure import thinned_undone

        gained, per_loading, recovery_s = (float(value) for value in values)
        rebuilt = step_s / recovery_s

        def body(of: Mapping[str, str]) -> str:
            broken, place = of["broken"], of["place"]
            width = c_number(dead_zone)
            return f"""{{
    const double given = x;
    double b = {broken}, z;
    int k;
    x = given / (1.0 + {c_number(gained)} * b);
    z = x;
    if ({place} < {NO_LOAD}) {{
        for (k = 0; k < {MOST_ROUNDS}; k++) {{
            const double guess = x;
            double worn, kept;
            z = {place} < x - {width} ? x - {width} : {place};
            z = z > x + {width} ? x + {width} : z;
            worn = {c_number(0.5 * per_loading)} * fabs(z - {place});
            kept = exp(-(worn + {c_number(rebuilt)}));
            b = kept * {broken} + (1.0 - kept) * worn / (worn + {c_number(rebuilt)});
            x = given / (1.0 + {c_number(gained)} * b);
            if (fabs(x - guess) <= {c_number(SETTLED)}) {{
                break;
            }}
        }}
    }}
    {broken} = b;
    {place} = z;
}}"""

        constants = (gained, per_loading, rebuilt, dead_zone, MOST_ROUNDS, SETTLED)
        return Undone(thinned_undone, constants, np.array([0.0, NO_LOAD]), ("broken", "place"), body)


def _broken(conditions: Conditions, per_loading: float, recovery_s: float) -> Array:
    """(n,) the share that is broken down, by the load without its noise, that before the recording included."""

    def cleaned_course() -> Array:
        return cleaned(np.concatenate([conditions.earlier, conditions.load]), dead_zone(conditions))

    def made() -> Array:
        from smartshoe.kernels.structure import broken_down

        place = conditions.kept("cleaned_course", (), cleaned_course)
        out = np.empty(place.size)
        broken_down(place, per_loading, conditions.step_s / recovery_s, out)
        return out[conditions.earlier.size :]

    return conditions.kept("broken_down", (per_loading, recovery_s), made)
