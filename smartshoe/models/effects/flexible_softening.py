"""A gain that grows with the dose of load: softening without a law."""

from __future__ import annotations

from smartshoe.arrays import Array
from smartshoe.models.effects._dose_of_loading import Dose, shape_parameters
from smartshoe.models.effects.effect import Conditions, Effect, EffectParameter, Inverse
from smartshoe.models.effects.exposure import by


class FlexibleSoftening(Effect):
    """f (1 + g X0 log(1 + X/X0)), X the dose that the wall has borne, by loadings and by time (`_dose_of_loading`).

    Rubber softens fast at first and then ever more slowly, with the number of cycles, their height, or the work done
    (Diani, Fayolle and Gilormini 2009).
    """

    name, family, stage, place = "flexible_softening", "softening", "wall", "wall"
    says = "the gain changes from cycle to cycle, by less each time"
    parameters = (
        EffectParameter("gained", "1", "about the relative change of the gain by the first loading to full scale and"
                        " 10 s there", 0.0, -0.05, 0.1, 0.005),
        *shape_parameters(100.0),
    )  # fmt: skip
    shapes = ({"by_stroke": 1.0, "exponent": 1.0, "early": 1.0}, {"by_stroke": 1.0, "exponent": 1.0, "early": 10.0})
    exposed_by = by("repeats", "shuffled_loads")
    is_steep_undone = True
    is_flexible = True

    def apply(self, signal: Array, conditions: Conditions, values: Array) -> Array:
        """The load with the gain so far."""
        if values[0] == 0.0:
            return signal.copy()
        return signal * (1.0 + Dose(*map(float, values)).grown(signal, conditions))

    def inverse(self, values: Array, step_s: float) -> Inverse:
        """Divide by the gain so far, by an iteration to the last digit."""
        return Dose(*map(float, values)).undone(step_s, True)
