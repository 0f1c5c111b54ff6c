"""Load that does not reach the tube: gaps to close first."""

from __future__ import annotations

import numpy as np

from smartshoe.arrays import Array
from smartshoe.models.effects._sensor_inverse import Memoryless, c_number
from smartshoe.models.effects.effect import Conditions, Effect, EffectParameter, Inverse
from smartshoe.models.effects.exposure import by

BISECTIONS = 50


class DeadBand(Effect):
    """f - f0 m(f/f0), m(x) = x at first and 1 later, rounded over ``softness``: f - f0 once all gaps are closed.

    m(x) = [s(1/k) - s((1 - x)/k)]/s(1/k) with s(y) = ln(1 + exp y); loads below zero pass unchanged.
    """

    name, family, stage, place = "dead_band", "dead_band", "contact", "contact"
    is_memoryless = True
    is_steep_undone = True
    says = "the first newtons of each loading do not reach the tube: no reading at low loads, a constant lack above"
    parameters = (
        EffectParameter("lost_load", "FS_load", "load that is lost once all gaps are closed", 0.0, 0.0, 0.3, 0.01),
        EffectParameter("softness", "1", "how far the gaps spread, over the lost load", None, 0.03, 3.0, 0.3),
    )
    shapes = ({"softness": 0.2}, {"softness": 0.6})
    exposed_by = by("low_loads", "rests")
    separated_by = {
        "contact_area": by("low_loads"),
        "dropouts": by("repeats"),
        "load_cell_tare": by("low_loads"),
        "sensor_nonlinearity": by("low_loads"),
        "zero_offset": by("low_loads"),
    }
    departs_with = frozenset({"load"})

    def apply(self, signal: Array, conditions: Conditions, values: Array) -> Array:
        """The load that reaches the tube."""
        if values[0] == 0.0:
            return signal.copy()
        return _passed(signal, float(values[0]), float(values[1]))

    def inverse(self, values: Array, step_s: float) -> Inverse:
        """Bisection between y and y + f0; loads within a sharp band cannot be told apart, nor noise about zero."""
        lost, soft = float(values[0]), float(values[1])

        def undo(signal: Array, time_s: Array) -> Array:
            if lost == 0.0:
                return signal.copy()
            low, high = signal.copy(), signal + lost
            for _ in range(BISECTIONS):
                middle = 0.5 * (low + high)
                below = _passed(middle, lost, soft) < signal
                low, high = np.where(below, middle, low), np.where(below, high, middle)
            return np.where(signal > 0.0, 0.5 * (low + high), signal)

        if lost == 0.0:
            return Memoryless(undo, "")
        whole = _soft(np.array([1.0 / soft]))[0]
        body = f"""if (x > 0.0) {{
    double low = x, high = x + {c_number(lost)};
    int k;
    for (k = 0; k < {BISECTIONS}; k++) {{
        const double v = 0.5 * (low + high);
        const double y = (1.0 - v / {c_number(lost)}) / {c_number(soft)};
        const double s = (y > 0.0 ? y : 0.0) + log1p(exp(-fabs(y)));
        if (v - {c_number(lost)} * (1.0 - s / {c_number(whole)}) < x) {{
            low = v;
        }} else {{
            high = v;
        }}
    }}
    x = 0.5 * (low + high);
}}"""
        return Memoryless(undo, body)


def _soft(y: Array) -> Array:
    return np.maximum(y, 0.0) + np.log1p(np.exp(-np.abs(y)))


def _passed(load: Array, lost: float, soft: float) -> Array:
    whole = _soft(np.array([1.0 / soft]))[0]
    out = load - lost * (1.0 - _soft((1.0 - load / lost) / soft) / whole)
    return np.where(load > 0.0, out, load)
