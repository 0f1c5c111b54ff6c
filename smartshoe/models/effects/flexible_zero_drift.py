"""A zero that moves with the clock at a pace of its own: drift without a law."""

from __future__ import annotations

from smartshoe.models.effects.effect import EffectParameter
from smartshoe.models.effects.warm_up import WarmUp


class FlexibleZeroDrift(WarmUp):
    """+ w (1 - exp(-(t/s)^stretch)), as a warm-up: by the root of time, ever faster or on and on as well.

    Moisture goes in by the root of time (Crank 1975, chapter 4); what has not settled by the end is a drift.
    """

    name = "flexible_zero_drift"
    says = "the reading's zero moves with time, loaded or not"
    parameters = (
        EffectParameter("change", "FS_reading", "change of the zero once settled", 0.0, -0.5, 0.5, 0.01),
        EffectParameter("time_constant", "s", "mean time of settling", None, 5.0, 2000.0, 60.0),
        EffectParameter("stretch", "1", "exponent of the settling, 1 for a single time constant", None, 0.4, 2.0, 0.3),
    )
    shapes = (
        {"time_constant": 1000.0, "stretch": 0.5}, {"time_constant": 300.0, "stretch": 1.0},
        {"time_constant": 1000.0, "stretch": 1.5},
    )  # fmt: skip
    is_flexible = True
