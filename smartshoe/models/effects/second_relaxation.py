"""A second relaxing arm of the wall."""

from __future__ import annotations

from smartshoe.arrays import Array
from smartshoe.models.effects.effect import CoreEffect, EffectParameter
from smartshoe.models.effects.exposure import by
from smartshoe.models.elements import Element, relaxing


class SecondRelaxation(CoreEffect):
    """k3 (u - q), q' = (u - q)/tau beside the arm of Chinimilli 2016, eq. (2)."""

    name, family, stage = "second_relaxation", "relaxation", "wall"
    says = "the wall relaxes with a second time constant: the reading creeps up in holds and back in rests"
    parameters = (
        EffectParameter("share", "1", "stiffness of the second arm over that of gas and k1", 0.0, 0.0, 2.0, 0.02),
        EffectParameter(
            "time_constant", "s", "its relaxation time", None, 0.05, 120.0, 5.0, kind_ends="both", farthest=1000.0
        ),
    )
    shapes = tuple({"time_constant": tau} for tau in (0.3, 1.2, 5.0, 20.0, 60.0))
    exposed_by = by("holds", "rates", "rests")
    separated_by = {
        "bouc_wen_hysteresis": by("rates"),
        "gas_heat": by("holds"),
        "linear_leak": by("holds"),
        "play_hysteresis": by("rates"),
        "power_law_creep": by("steps", "long_hold"),
        "sensor_lag": by("steps"),
    }
    of_either_sign = (
        "the sensor relaxes with a second time constant: the reading goes on in holds, and back in rests",
        "what relaxes by the second time constant, over what does not; < 0: the reading falls in holds",
    )

    def elements(self, values: Array) -> tuple[Element, ...]:
        """The arm, or a heat store where the share is negative."""
        return (relaxing(float(values[0]), 1.0 / float(values[1])),)
