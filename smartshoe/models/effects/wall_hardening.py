"""A wall that stiffens with strain."""

from __future__ import annotations

import numpy as np

from smartshoe.models.effects._sensor_inverse import Memoryless, c_number
from smartshoe.models.effects.effect import Array, Conditions, Effect, EffectParameter, Inverse

NEWTON_STEPS = 12


class WallHardening(Effect):
    """f (1 + h)/(1 + h |f|^(m - 1)): k1 grows with |u|^(m - 1), so that the gas takes less and less of the load.

    An odd curve (m = 3 for k1 (1 + beta u^2)); zero and full scale stay where they are.
    """

    name, family, stage, place = "wall_hardening", "static_curve", "wall", "wall"
    says = (
        "the wall stiffens with deformation: the reading against load is straight at first and flattens at high loads"
    )
    parameters = (
        EffectParameter("bow", "FS_load", "above the straight line at half of full scale", 0.0, 0.0, 0.15, 0.01),
        EffectParameter("exponent", "1", "m: 3 for a stiffness that grows with strain squared", None, 2.4, 4.0, 1.0),
    )
    shapes = ({"exponent": 3.0},)
    exposed_by = frozenset({"peaks", "low_loads"})
    separated_by = {
        "gas_compression": "sign; displacement",
        "contact_area": "displacement",
        "sensor_nonlinearity": "displacement, or pressure applied to the sensor",
    }

    def apply(self, signal: Array, conditions: Conditions, values: Array) -> Array:
        """The load that a wall without hardening would need."""
        if values[0] == 0.0:
            return signal.copy()
        h, m = self._stiffening(values)
        size = np.maximum(np.abs(signal), 1e-300)
        return signal * (1.0 + h) / (1.0 + h * np.exp((m - 1.0) * np.log(size)))

    @staticmethod
    def _stiffening(values: Array) -> tuple[float, float]:
        bow, m = (float(value) for value in values)
        return 2.0 * bow / (1.0 - 0.5 ** (m - 1.0) * (1.0 + 2.0 * bow)), m

    def inverse(self, values: Array, step_s: float) -> Inverse:
        """Newton on y (1 + h |f|^(m - 1)) = f (1 + h)."""
        h, m = self._stiffening(values)

        def undo(signal: Array, time_s: Array) -> Array:
            y = np.abs(signal)
            f = y / (1.0 + h)
            for _ in range(NEWTON_STEPS):
                bent = h * y * f ** (m - 2.0)
                f = (y - (m - 2.0) * bent * f) / (1.0 + h - (m - 1.0) * bent)
            return np.copysign(f, signal)

        body = f"""{{
    const double y = fabs(x);
    double v = y / {c_number(1.0 + h)};
    int k;
    for (k = 0; k < {NEWTON_STEPS}; k++) {{
        const double bent = {c_number(h)} * y * pow(v, {c_number(m - 2.0)});
        v = (y - {c_number(m - 2.0)} * bent * v) / ({c_number(1.0 + h)} - {c_number(m - 1.0)} * bent);
    }}
    x = x < 0.0 ? -v : v;
}}"""
        return Memoryless(undo, body)
