"""A gain that depends on the direction of loading."""

from __future__ import annotations

from smartshoe.arrays import Array
from smartshoe.models.effects._sense_of_motion import by_sense, undone_by_sense
from smartshoe.models.effects._wall_memory import LEAST_DEAD_ZONE, Remembering
from smartshoe.models.effects.effect import Conditions, EffectParameter, Inverse
from smartshoe.models.effects.exposure import by


class LoadUnloadAsymmetry(Remembering):
    """f (1 - a (1 - s)/2), s the sense of motion: ds = (sgn(df) - s) |df|/turn, kept through holds, +1 at first."""

    name, family, stage, place = "load_unload_asymmetry", "asymmetry", "wall", "wall"
    is_steep_undone = True
    mechanism = "friction"
    says = "unloading has another gain than loading: the reading jumps where the load turns, in proportion to the load"
    parameters = (
        EffectParameter("lost_gain", "1", "share of the gain that unloading lacks", 0.0, -0.6, 0.6, 0.01),
        EffectParameter("turn", "FS_load", "load over which the sense turns over", None, 0.001, 0.03, 0.005),
    )
    shapes = ({"turn": 0.005},)
    exposed_by = by("rates", "peaks", "minor_loops")
    separated_by = {
        "bouc_wen_hysteresis": by("minor_loops"),
        "gain_drift": by("repeats"),
        "play_hysteresis": by("minor_loops"),
        "rate_gain": by("rates"),
    }

    def apply(self, signal: Array, conditions: Conditions, values: Array) -> Array:
        """The load that reaches the tube."""
        return by_sense(signal, conditions, float(values[0]), float(values[1]), 0.0)

    def inverse(self, values: Array, step_s: float, dead_zone: float = LEAST_DEAD_ZONE) -> Inverse:
        """The load whose sense of motion gives the output, by false position; exact for a load without noise."""
        return undone_by_sense(float(values[0]), float(values[1]), 0.0, dead_zone)
