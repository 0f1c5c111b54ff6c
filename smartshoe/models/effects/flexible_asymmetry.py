"""A gain that depends on the direction of loading, with a memory of any length: asymmetry without a law."""

from __future__ import annotations

from smartshoe.arrays import Array
from smartshoe.models.effects._sense_of_motion import by_sense, undone_by_sense
from smartshoe.models.effects._wall_memory import LEAST_DEAD_ZONE, Remembering
from smartshoe.models.effects.effect import Conditions, EffectParameter, Inverse
from smartshoe.models.effects.exposure import by


class FlexibleAsymmetry(Remembering):
    """f (1 - a (1 - s)/2) with ds = (sgn(df) - s) |df|/turn - s dt/T: a sense of motion s that fades in the time T.

    Where T is long the sense is kept through holds. Where it is short, s = r/(r + turn/T) on a ramp of rate r: a
    friction that turns over with a slow velocity (Oden and Martins 1985).
    """

    name, family, stage, place = "flexible_asymmetry", "asymmetry", "wall", "wall"
    is_steep_undone = True
    says = "unloading has another gain than loading"
    parameters = (
        EffectParameter("lost_gain", "1", "share of the gain that unloading lacks", 0.0, -0.6, 0.6, 0.01),
        EffectParameter("turn", "FS_load", "load over which the sense turns over", None, 0.001, 0.1, 0.005),
        EffectParameter("memory", "s", "time in which the sense fades", None, 0.03, 30.0, 0.3),
    )
    shapes = ({"turn": 0.005, "memory": 0.1}, {"turn": 0.005, "memory": 1.0})
    exposed_by = by("rates", "holds", "peaks", "minor_loops")
    is_flexible = True

    def apply(self, signal: Array, conditions: Conditions, values: Array) -> Array:
        """The load that reaches the tube."""
        return by_sense(signal, conditions, *_constants(values, conditions.step_s))

    def inverse(self, values: Array, step_s: float, dead_zone: float = LEAST_DEAD_ZONE) -> Inverse:
        """The load whose sense of motion gives the output, by false position; exact for a load without noise."""
        return undone_by_sense(*_constants(values, step_s), dead_zone)


def _constants(values: Array, step_s: float) -> tuple[float, float, float]:
    """Lost gain, turn in full scales, and how much the sense fades a step."""
    return float(values[0]), float(values[1]), step_s / float(values[2])
