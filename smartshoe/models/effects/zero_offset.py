"""A reading that is not zero without load."""

from __future__ import annotations

from smartshoe.arrays import Array
from smartshoe.models.effects._sensor_inverse import Memoryless, c_number
from smartshoe.models.effects.effect import Conditions, Effect, EffectParameter, Inverse
from smartshoe.models.effects.exposure import by


class ZeroOffset(Effect):
    """+ b, whatever the load: the last of the chain, since curves and rails are fitted to readings without offset."""

    name, family, stage, place = "zero_offset", "zero", "sensor", "logger"
    says = "the reading is shifted by a constant, with and without load"
    parameters = (EffectParameter("offset", "FS_reading", "shift of the reading", 0.0, -0.5, 0.5, 0.01),)
    exposed_by = by("rests")
    separated_by = {
        "dead_band": by("low_loads"),
        "load_cell_tare": by("idle", "pressure_reference"),
        "warm_up": by("idle"),
    }
    is_seen_at_rest = True
    shifts = "reading"

    def apply(self, signal: Array, conditions: Conditions, values: Array) -> Array:
        """The signal, shifted."""
        return signal + float(values[0])

    def inverse(self, values: Array, step_s: float) -> Inverse:
        """Subtract it; exact."""
        offset = float(values[0])
        return Memoryless(lambda signal, time_s: signal - offset, f"x -= {c_number(offset)};")
