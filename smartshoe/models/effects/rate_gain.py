"""A gain that grows with the rate of loading, up and down alike."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from smartshoe.arrays import Array
from smartshoe.models.effects._sensor_inverse import c_number
from smartshoe.models.effects._wall_memory import LEAST_DEAD_ZONE, NO_LOAD, Remembering, Undone, cleaned_load
from smartshoe.models.effects.effect import Conditions, EffectParameter, Inverse
from smartshoe.models.effects.exposure import by

HALF_WINDOW_S = 0.04
SLOW_PER_S = 0.01  # below this rate the power is rounded off
LEAST_GAIN = 0.5  # of the gain at rest: fast loads lose no more, so that no rate turns a reading over


class RateGain(Remembering):
    """f max(1 + g r^m, 1/2), r = |f'| over 1 FS/s: the path within 0.08 s over that time, without small reversals."""

    name, family, stage, place = "rate_gain", "rate", "wall", "wall"
    is_steep_undone = True
    says = "faster loading reads higher (or lower), up and down alike, and the reading jumps where a hold begins"
    parameters = (
        EffectParameter(
            "gain_per_rate", "1", "relative change of gain at one full scale a second", 0.0, -0.5, 1.0, 0.02
        ),
        EffectParameter("exponent", "1", "power of the rate", None, 0.4, 2.0, 0.5),
    )
    shapes = ({"exponent": 1.0},)
    exposed_by = by("rates", "holds")
    separated_by = {
        "gas_heat": by("holds"),
        "load_unload_asymmetry": by("rates"),
        "sensor_lag": by("rates"),
    }

    def apply(self, signal: Array, conditions: Conditions, values: Array) -> Array:
        """The load that reaches the tube."""
        if values[0] == 0.0:
            return signal.copy()
        gain, exponent = (float(value) for value in values)
        square = conditions.cache.get("rate_gain")
        if square is None:
            square = conditions.cache["rate_gain"] = np.log(_rate(conditions) ** 2 + SLOW_PER_S**2)
        factor: Array = 1.0 - gain * SLOW_PER_S**exponent + gain * np.exp((0.5 * exponent) * square)
        return signal * np.maximum(factor, LEAST_GAIN)

    def inverse(self, values: Array, step_s: float, dead_zone: float = LEAST_DEAD_ZONE) -> Inverse:
        """Divide by the gain at the output's own smoothed rate: exact on ramps, late by the window after corners."""
        from smartshoe.kernels.memory import rate_undone

        gain, exponent = (float(value) for value in values)
        keep = math.exp(-step_s / HALF_WINDOW_S)

        def body(of: Mapping[str, str]) -> str:
            zone = c_number(dead_zone)
            return f"""{{
    double cleaned = {of["last"]}, moved = 0.0, ratio = 1.0;
    int k;
    if (cleaned >= {NO_LOAD}) {{
        cleaned = x;
    }} else {{
        cleaned = cleaned < x - {zone} ? x - {zone} : cleaned;
        cleaned = cleaned > x + {zone} ? x + {zone} : cleaned;
        moved = fabs(cleaned - {of["last"]});
    }}
    {of["rate"]} = {c_number(keep)} * {of["rate"]} + {c_number(1.0 - keep)} * moved / {c_number(step_s)};
    {of["last"]} = cleaned;
    for (k = 0; k < 8; k++) {{
        const double rate = {of["rate"]} / ratio;
        ratio = 1.0 + {c_number(gain)} * (pow(rate * rate + {c_number(SLOW_PER_S**2)}, {c_number(0.5 * exponent)})
            - {c_number(SLOW_PER_S**exponent)});
        ratio = ratio < {c_number(LEAST_GAIN)} ? {c_number(LEAST_GAIN)} : ratio;
    }}
    x /= ratio;
}}"""

        constants = (gain, exponent, LEAST_GAIN, SLOW_PER_S, dead_zone, step_s, keep)
        return Undone(rate_undone, constants, np.array([NO_LOAD, 0.0]), ("last", "rate"), body)


def _rate(conditions: Conditions) -> Array:
    """(n,) path of the cleaned load within a window about each sample, over its length: noise does not raise it."""
    way = np.zeros(conditions.load.size)
    np.cumsum(np.abs(np.diff(cleaned_load(conditions))), out=way[1:])
    half_s = max(HALF_WINDOW_S, conditions.step_s)
    early, late = (_later(way, side * half_s / conditions.step_s) for side in (-1.0, 1.0))
    gone: Array = late - early
    return gone / (2.0 * half_s)


def _later(way: Array, samples: float) -> Array:
    """``way`` (n,) at places ``samples`` later, linear between samples; beyond its ends its end values."""
    whole = math.floor(samples)
    places = np.clip(np.arange(whole, whole + way.size + 1), 0, way.size - 1)
    at: Array = way[places]
    return at[:-1] + (samples - whole) * np.diff(at)
