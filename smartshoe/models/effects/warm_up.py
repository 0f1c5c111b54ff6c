"""A zero that settles after power is switched on."""

from __future__ import annotations

from smartshoe.arrays import Array
from smartshoe.models.effects._sensor_clock import settled, settled_so_far, unsettled_in_c
from smartshoe.models.effects._sensor_inverse import Memoryless, c_number
from smartshoe.models.effects.effect import Conditions, Effect, EffectParameter, Inverse
from smartshoe.models.effects.exposure import by


class WarmUp(Effect):
    """+ w (1 - exp(-(t/T)^stretch)), t from the session's start: w is the whole change, of either sign.

    Die, package and board settle at different speeds, and together look like one stretched settling (below 1). The
    parameter is the mean time of settling, T Gamma(1 + 1/stretch), which is T at stretch 1.
    """

    name, family, stage, place = "warm_up", "zero", "sensor", "sensor"
    says = "the reading's zero moves once after the start and settles, loaded or not"
    parameters = (
        EffectParameter("change", "FS_reading", "change of the zero once settled", 0.0, -0.5, 0.5, 0.01),
        EffectParameter("time_constant", "s", "mean time of settling", None, 5.0, 300.0, 60.0),
        EffectParameter("stretch", "1", "exponent of the settling, 1 for a single time constant", None, 0.6, 1.4, 0.2),
    )
    shapes = tuple({"time_constant": tau, "stretch": 1.0} for tau in (10.0, 30.0, 100.0, 250.0))
    exposed_by = by("rests", "idle")
    separated_by = {
        "cycle_conditioning": by("pauses"),
        "linear_leak": by("idle"),
        "permanent_set": by("pauses", "shuffled_loads"),
        "zero_drift": by("idle"),
        "zero_offset": by("idle"),
    }
    is_seen_at_rest = is_drift = True

    def apply(self, signal: Array, conditions: Conditions, values: Array) -> Array:
        """The signal (n,) and the change of the zero so far."""
        change, tau, stretch = (float(value) for value in values)
        return signal + change * settled_so_far(conditions, tau, stretch)

    def inverse(self, values: Array, step_s: float) -> Inverse:
        """Subtract it; exact."""
        change, tau, stretch = (float(value) for value in values)
        return Memoryless(
            lambda signal, time_s: signal - change * settled(time_s, tau, stretch),
            f"x += {c_number(change)} * {unsettled_in_c(tau, stretch)};",
        )
