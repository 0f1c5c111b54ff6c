"""A zero that drifts with the clock or the temperature."""

from __future__ import annotations

from smartshoe.arrays import Array
from smartshoe.models.effects._sensor_clock import EXPONENT, TEMPERATURE_LAG, TEMPERATURE_LAGS, drift, grown, grown_in_c
from smartshoe.models.effects._sensor_inverse import Memoryless, c_number
from smartshoe.models.effects.effect import Conditions, Effect, EffectParameter, Inverse
from smartshoe.models.effects.exposure import by


class ZeroDrift(Effect):
    """+ d T (t/T)^m, T = 100 s; with the temperature logged, + b_T dT.

    Diffusion into a sensor goes with the root of time (Crank 1975, ch. 4), creep under its own stress with a lower
    power, a drift that grows with a higher one. dT is of the sensor's body, which follows the logged temperature by a
    first-order lag: a probe in the air is ahead of a die in its package. b_T does nothing without a temperature that
    moves, d where the temperature is a straight line in time.
    """

    name, family, stage, place = "zero_drift", "zero", "sensor", "sensor"
    says = "the reading's zero moves steadily with time (with the temperature, where it is logged), loaded or not"
    parameters = (
        EffectParameter("drift_rate", "FS_reading/s", "change of the zero a second", 0.0, -1e-2, 1e-2, 1e-5),
        EffectParameter(
            "temperature_coefficient",
            "FS_reading/K",
            "change of the zero a kelvin",
            0.0,
            -0.1,
            0.1,
            1e-3,
            channel="temperature",
        ),
        TEMPERATURE_LAG,
        EXPONENT,
    )
    shapes = (*({**lag, "exponent": 1.0} for lag in TEMPERATURE_LAGS), {**TEMPERATURE_LAGS[0], "exponent": 0.5})
    exposed_by = by("rests", "idle", "pauses")
    separated_by = {
        "coloured_noise": by("repeats"),
        "cross_talk": by("neighbour"),
        "gain_drift": by("rests", "peaks"),
        "linear_leak": by("idle", "long_hold", "temperature"),
        "orifice_leak": by("idle", "long_hold", "temperature"),
        "permanent_set": by("pauses", "shuffled_loads"),
        "warm_up": by("idle"),
    }
    is_seen_at_rest = is_drift = True

    def apply(self, signal: Array, conditions: Conditions, values: Array) -> Array:
        """The signal and the drift since the session's start."""
        return signal + drift(conditions, values, float(values[3]))

    def inverse(self, values: Array, step_s: float) -> Inverse | None:
        """Subtract the drift; exact. None with a temperature coefficient: a stream carries no temperature."""
        rate, coefficient, _, exponent = (float(value) for value in values)
        if coefficient != 0.0:
            return None
        body = f"x -= {c_number(rate)} * {grown_in_c(exponent)};"
        return Memoryless(lambda signal, time_s: signal - rate * grown(time_s, exponent), body)
