"""A gain that drifts with the clock or the temperature."""

from __future__ import annotations

import numpy as np

from smartshoe.arrays import Array
from smartshoe.models.effects._sensor_clock import EXPONENT, TEMPERATURE_LAG, TEMPERATURE_LAGS, drift, grown, grown_in_c
from smartshoe.models.effects._sensor_inverse import Memoryless, c_number
from smartshoe.models.effects.effect import Conditions, Effect, EffectParameter, Inverse
from smartshoe.models.effects.exposure import by

LEAST_GAIN = 0.01


class GainDrift(Effect):
    """P (1 + g T (t/T)^m), T = 100 s; with the temperature logged, + g_T dT in the bracket.

    Diffusion into a sensor, or growth by diffusion through what has grown, goes with the root of time (Crank 1975). dT
    is of the sensor's body, which follows the logged temperature by a first-order lag: a probe in the air is ahead of a
    die in its package. g_T does nothing without a temperature that moves, g where the temperature is a straight line in
    time. dT is counted from a recording's beginning; to it is added the share ``carried_over`` of how much warmer that
    is than the beginning of the first recording: 0 where the span is set anew each time, 1 for one sensor in rooms of
    any warmth.
    """

    name, family, stage, place = "gain_drift", "gain_drift", "sensor", "sensor"
    says = "the gain moves steadily with time (with the temperature, where it is logged): peaks grow or shrink"
    parameters = (
        EffectParameter("drift_rate", "1/s", "share of the gain gained a second", 0.0, -1e-2, 1e-2, 1e-5),
        EffectParameter(
            "temperature_coefficient",
            "1/K",
            "share of the gain gained a kelvin",
            0.0,
            -0.3,
            0.3,
            1e-3,
            channel="temperature",
        ),
        TEMPERATURE_LAG,
        EffectParameter(
            "carried_over", "1", "share of the temperature between recordings that counts", None, 0.0, 1.0, 0.5,
            channel="temperatures", absent=0.0, natural="both",
        ),
        EXPONENT,
    )  # fmt: skip
    shapes = tuple({**at, "carried_over": share, "exponent": 1.0} for share in (0.0, 1.0) for at in TEMPERATURE_LAGS)
    exposed_by = by("repeats", "peaks", "pauses")
    separated_by = {
        "coloured_noise": by("repeats"),
        "cycle_conditioning": by("pauses", "rates", "temperature"),
        "load_unload_asymmetry": by("repeats"),
        "mullins_softening": by("pauses", "shuffled_loads"),
        "zero_drift": by("rests", "peaks"),
    }
    is_drift = True

    def apply(self, signal: Array, conditions: Conditions, values: Array) -> Array:
        """The signal times the gain since the first session's start."""
        return signal + signal * drift(conditions, values, float(values[4]), carried_over=float(values[3]))

    def inverse(self, values: Array, step_s: float) -> Inverse | None:
        """Divide by the gain; exact while that stays above a hundredth of its first value.

        None with a temperature coefficient: a stream carries no temperature.
        """
        rate, coefficient, _, _, exponent = (float(value) for value in values)
        if coefficient != 0.0:
            return None
        return Memoryless(
            lambda signal, time_s: signal / np.maximum(1.0 + rate * grown(time_s, exponent), LEAST_GAIN),
            f"x /= fmax(1.0 + {c_number(rate)} * {grown_in_c(exponent)}, {c_number(LEAST_GAIN)});",
        )
