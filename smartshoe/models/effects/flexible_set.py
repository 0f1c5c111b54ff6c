"""A set that grows with the time under load, with every loading, or with both: permanent set without a law."""

from __future__ import annotations

from smartshoe.arrays import Array
from smartshoe.models.effects._dose_of_loading import Dose, shape_parameters
from smartshoe.models.effects.effect import Conditions, Effect, EffectParameter, Inverse
from smartshoe.models.effects.exposure import by


class FlexibleSet(Effect):
    """p + s X0 log(1 + X/X0), X the dose that the wall has borne, by loadings and by time (`_dose_of_loading`).

    A wall creeps with the time under load and ratchets with every loading, the more slowly the more it has hardened
    (Lemaitre and Chaboche 1990, ch. 5).
    """

    name, family, stage, place = "flexible_set", "zero", "wall", "gas"
    says = "the unloaded reading rises with the time under load and with every loading, and stays"
    parameters = (
        EffectParameter("set", "FS_reading", "about the rise by the first loading to full scale and 10 s there", 0.0,
                        0.0, 0.15, 0.003),
        *shape_parameters(3000.0),
    )  # fmt: skip
    shapes = (
        {"by_stroke": 1.0, "exponent": 1.0, "early": 300.0},
        {"by_stroke": 1.0, "exponent": 2.0, "early": 300.0},
        {"by_stroke": 0.1, "exponent": 1.0, "early": 5.0},
    )
    exposed_by = by("rests", "holds", "pauses")
    is_seen_at_rest = True
    is_steep_undone = True
    is_flexible = True
    branch = "set"

    def apply(self, signal: Array, conditions: Conditions, values: Array) -> Array:
        """The pressure with the set so far."""
        if values[0] == 0.0:
            return signal.copy()
        return signal + Dose(*map(float, values)).grown(signal, conditions)

    def inverse(self, values: Array, step_s: float) -> Inverse:
        """Subtract the set, by an iteration to the last digit."""
        return Dose(*map(float, values)).undone(step_s, False)
