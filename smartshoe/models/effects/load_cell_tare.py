"""A load cell that was not zeroed: what acts on the tube is not what the log says."""

from __future__ import annotations

from smartshoe.arrays import Array
from smartshoe.models.effects._sensor_inverse import Memoryless, c_number
from smartshoe.models.effects.effect import Conditions, Effect, EffectParameter, Inverse
from smartshoe.models.effects.exposure import by


class LoadCellTare(Effect):
    """Acting load = measured load + f0: f0 > 0 where the tube is loaded while the log says zero.

    To a linear tube in steady state this is `zero_offset`. They differ where the chain is not linear, and in
    the rests: an unloaded and vented unit reads zero pressure at a measured load of -f0.
    """

    name, family, stage, place = "load_cell_tare", "tare", "machine", "machine"
    says = "the load cell's zero is off: the tube bears a load more or less than the log says, the resting one too"
    parameters = (EffectParameter("tare", "FS_load", "acting load less measured load", 0.0, -0.5, 0.5, 0.01),)
    exposed_by = by("rests")
    separated_by = {
        "dead_band": by("command"),
        "zero_offset": by("idle", "pressure_reference"),
    }
    is_seen_at_rest = True
    shifts = "load"

    def apply(self, signal: Array, conditions: Conditions, values: Array) -> Array:
        """The acting load."""
        return signal + float(values[0])

    def inverse(self, values: Array, step_s: float) -> Inverse:
        """The measured load from the acting one; exact."""
        tare = float(values[0])
        return Memoryless(lambda signal, time_s: signal - tare, f"x -= {c_number(tare)};")
