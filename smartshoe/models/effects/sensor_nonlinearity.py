"""A sensor whose characteristic is no straight line, though it is right at rest and at full scale."""

from __future__ import annotations

from functools import partial

import numpy as np

from smartshoe.arrays import Array
from smartshoe.models.effects._sensor_inverse import Memoryless, c_number
from smartshoe.models.effects.effect import Conditions, Effect, EffectParameter, Inverse
from smartshoe.models.effects.exposure import by

SCALES = np.array([4.0, 6.0 * 3.0**0.5, 16.0])  # one over the extremes of c (1 - c) (1 - 2c)^k on 0 ... 1, k = 0, 1, 2
LEAST_SLOPE = 0.05  # of the straight line's: where it rises less, a reading does not tell its pressure
STEPS = 30  # of Newton's iteration; a step that would leave the bracket halves it instead


def _departure(c: Array, weights: Array) -> tuple[Array, Array]:
    """Distance (n,) from the straight line at ``c`` (n,) within 0 and 1, and its slope (n,)."""
    m, bend = 1.0 - 2.0 * c, c * (1.0 - c)
    even, odd, shoulder = weights
    slope = m * (even + shoulder * (1.0 - 8.0 * bend)) + odd * (1.0 - 6.0 * bend)
    return bend * (even + m * (odd + m * shoulder)), slope


def _undo(signal: Array, time_s: Array, weights: Array) -> Array:
    """The pressure (n,) from the reading ``signal`` (n,), by Newton's iteration in a bracket."""
    ends = 1.0 + _departure(np.array([0.0, 1.0]), weights)[1]
    reading = np.clip(signal, 0.0, 1.0)
    low, high, pressure = np.zeros_like(reading), np.ones_like(reading), reading
    for _ in range(STEPS):
        distance, slope = _departure(pressure, weights)
        off = pressure + distance - reading
        low, high = np.where(off < 0.0, pressure, low), np.where(off > 0.0, pressure, high)
        step = pressure - off / np.maximum(1.0 + slope, LEAST_SLOPE)
        pressure = np.where((step >= low) & (step <= high), step, 0.5 * (low + high))
    beyond: Array = np.minimum(signal, 0.0) / ends[0] + np.maximum(signal - 1.0, 0.0) / ends[1]
    return pressure + beyond


class SensorNonlinearity(Effect):
    """Terminal-based non-linearity, as data sheets give it: the distance from the line through zero and full scale.

    p + 4 bow c (1 - c) + 6 sqrt(3) wave c (1 - c)(1 - 2c) + 16 shoulders c (1 - c)(1 - 2c)^2 with c = p within 0 and 1;
    beyond, the curve goes on along its tangent. bow > 0: the reading is high at mid scale. wave > 0: high in the lower
    half, low in the upper one. shoulders: what is added near 15 % and 85 % of the scale and not at its middle.
    """

    name, family, stage, place = "sensor_nonlinearity", "static_curve", "sensor", "sensor"
    is_memoryless = True
    says = "the reading bends away from the straight line between zero and full scale, at every rate alike"
    parameters = (
        EffectParameter("bow", "FS_reading", "distance from the line at half scale", 0.0, -0.2, 0.2, 0.01),
        EffectParameter("wave", "FS_reading", "distance at 21 % of scale, minus that at 79 %", 0.0, -0.08, 0.08, 0.01),
        EffectParameter("shoulders", "FS_reading", "added distance at 15 % and 85 %", 0.0, -0.04, 0.04, 0.01),
    )
    exposed_by = by("peaks")
    separated_by = {
        "contact_area": by("displacement", "pressure_reference"),
        "dead_band": by("low_loads"),
        "gas_compression": by("displacement", "pressure_reference"),
        "saturation": by("peaks"),
        "wall_hardening": by("displacement", "pressure_reference"),
    }

    def apply(self, signal: Array, conditions: Conditions, values: Array) -> Array:
        """The reading."""
        c = np.clip(signal, 0.0, 1.0)
        distance, slope = _departure(c, SCALES * values)
        return signal + distance + slope * (signal - c)

    def inverse(self, values: Array, step_s: float) -> Inverse | None:
        """Newton's iteration in a bracket, exact to rounding; None where the curve hardly rises somewhere."""
        weights = SCALES * np.asarray(values, dtype=float)
        if np.min(_departure(np.linspace(0.0, 1.0, 201), weights)[1]) < LEAST_SLOPE - 1.0:
            return None
        even, odd, shoulder = (c_number(weight) for weight in weights)
        first, last = (c_number(1.0 + slope) for slope in _departure(np.array([0.0, 1.0]), weights)[1])
        body = f"""{{
    const double reading = x < 0.0 ? 0.0 : (x > 1.0 ? 1.0 : x);
    const double beyond = x < 0.0 ? x / {first} : (x > 1.0 ? (x - 1.0) / {last} : 0.0);
    double low = 0.0, high = 1.0;
    int i;
    x = reading;
    for (i = 0; i < {STEPS}; i++) {{
        const double m = 1.0 - 2.0 * x, bend = x * (1.0 - x);
        const double slope = 1.0 + m * ({even} + {shoulder} * (1.0 - 8.0 * bend)) + {odd} * (1.0 - 6.0 * bend);
        const double off = x + bend * ({even} + m * ({odd} + m * {shoulder})) - reading;
        if (off < 0.0) {{
            low = x;
        }} else if (off > 0.0) {{
            high = x;
        }}
        x -= off / (slope < {LEAST_SLOPE!r} ? {LEAST_SLOPE!r} : slope);
        if (!(x >= low && x <= high)) {{
            x = 0.5 * (low + high);
        }}
    }}
    x += beyond;
}}"""
        return Memoryless(partial(_undo, weights=weights), body)
