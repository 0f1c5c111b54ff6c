"""Air that stiffens as its volume shrinks (Boyle)."""

from __future__ import annotations

from smartshoe.models.effects._sensor_inverse import Memoryless, c_number
from smartshoe.models.effects.effect import Array, Conditions, Effect, EffectParameter, Inverse


class GasCompression(Effect):
    """p (1 - g)/(1 - g p): Boyle's law with the wall in series; zero and full scale stay where they are."""

    name, family, stage, place = "gas_compression", "static_curve", "gas", "gas"
    says = "the air stiffens as it is compressed: the reading against load is bent upwards, ever steeper"
    parameters = (
        EffectParameter("bow", "FS_reading", "below the straight line at half of full scale", 0.0, 0.0, 0.25, 0.01),
    )
    exposed_by = frozenset({"peaks"})
    separated_by = {
        "contact_area": "sign; displacement",
        "wall_hardening": "sign; displacement",
        "sensor_nonlinearity": "displacement, or pressure applied to the sensor",
    }

    def apply(self, signal: Array, conditions: Conditions, values: Array) -> Array:
        """The pressure of the stiffer gas."""
        if values[0] == 0.0:
            return signal.copy()
        g = self._stiffening(values)
        return signal * ((1.0 - g) / (1.0 - g * signal))

    @staticmethod
    def _stiffening(values: Array) -> float:
        return 4.0 * float(values[0]) / (1.0 + 2.0 * float(values[0]))

    def inverse(self, values: Array, step_s: float) -> Inverse:
        """y/(1 - g + g y)."""
        g = self._stiffening(values)
        return Memoryless(
            lambda signal, time_s: signal / (1.0 - g + g * signal), f"x /= {c_number(1.0 - g)} + {c_number(g)} * x;"
        )
