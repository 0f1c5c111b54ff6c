"""A contact that grows with the load."""

from __future__ import annotations

import math

import numpy as np

from smartshoe.arrays import Array
from smartshoe.models.effects._sensor_inverse import Memoryless, c_number
from smartshoe.models.effects.effect import Conditions, Effect, EffectParameter, Inverse
from smartshoe.models.effects.exposure import by

NEWTON_STEPS = 12


class ContactArea(Effect):
    """f exp(b (1 - f^q)/q): f^(1 - b) for q near 0, f (1 + b)/(1 + b f) in the first order for q = 1.

    Zero and full scale stay where they are; loads below zero pass unchanged. Beyond full scale the curve goes on along
    its tangent: the formula turns down where f^q = 1/b, for strong bends a fifth above full scale.
    """

    name, family, stage, place = "contact_area", "static_curve", "contact", "contact"
    is_memoryless = True
    says = "the contact grows with the load: the reading against load is bent, steepest at low loads"
    parameters = (
        EffectParameter("bow", "FS_load", "above the straight line at half of full scale", 0.0, 0.0, 0.26, 0.01),
        EffectParameter("curvature", "1", "q: 0 bends most near zero load, 1 evenly", None, 0.1, 1.2, 0.5),
    )
    shapes = ({"curvature": 1.0}, {"curvature": 0.4})
    exposed_by = by("peaks", "low_loads")
    separated_by = {
        "cross_talk": by("neighbour"),
        "dead_band": by("low_loads"),
        "gas_compression": by("peaks", "displacement"),
        "saturation": by("peaks"),
        "sensor_nonlinearity": by("displacement", "pressure_reference"),
        "wall_hardening": by("rates", "displacement"),
    }

    def apply(self, signal: Array, conditions: Conditions, values: Array) -> Array:
        """The load that reaches the tube."""
        if values[0] == 0.0:
            return signal.copy()
        b, q = self._bend(values)
        size = np.clip(signal, 1e-300, 1.0)
        bent = size * np.exp((b / q) * (1.0 - np.exp(q * np.log(size)))) + (1.0 - b) * np.maximum(signal - 1.0, 0.0)
        return np.where(signal > 0.0, bent, signal)

    @staticmethod
    def _bend(values: Array) -> tuple[float, float]:
        """b and q of the formula, from the bow at half of full scale and the curvature."""
        bow, q = (float(value) for value in values)
        return math.log1p(2.0 * bow) * q / (1.0 - 0.5**q), q

    def inverse(self, values: Array, step_s: float) -> Inverse:
        """By Newton's iteration in ln f, and along the tangent beyond full scale."""
        b, q = self._bend(values)

        def undo(signal: Array, time_s: Array) -> Array:
            target = np.log(np.clip(signal, 1e-300, 1.0))
            v = target.copy()
            for _ in range(NEWTON_STEPS):
                bent = b * np.exp(q * v)
                v -= (v + (b - bent) / q - target) / (1.0 - bent)
            return np.where(signal > 0.0, np.exp(v) + np.maximum(signal - 1.0, 0.0) / (1.0 - b), signal)

        body = f"""if (x > 1.0) {{
    x = 1.0 + (x - 1.0) / {c_number(1.0 - b)};
}} else if (x > 0.0) {{
    const double target = log(x);
    double v = target;
    int k;
    for (k = 0; k < {NEWTON_STEPS}; k++) {{
        const double bent = {c_number(b)} * exp({c_number(q)} * v);
        v -= (v + ({c_number(b)} - bent) / {c_number(q)} - target) / (1.0 - bent);
    }}
    x = exp(v);
}}"""
        return Memoryless(undo, body)
