"""Field checks: zero before use, zero drift in swing, body weight, units that do not answer, temperature."""

from smartshoe.gait.field._at_rest import ZeroReading, check_zero, zero
from smartshoe.gait.field._body_weight import check_body_weight
from smartshoe.gait.field._finding import CheckResult
from smartshoe.gait.field._silence import check_units
from smartshoe.gait.field._swing_zero import SwingZero
from smartshoe.gait.field._temperature import sealed_air_pa_per_k, temperature_of_zeros, temperature_sensitivity

__all__ = [
    "CheckResult",
    "SwingZero",
    "ZeroReading",
    "check_body_weight",
    "check_units",
    "check_zero",
    "sealed_air_pa_per_k",
    "temperature_of_zeros",
    "temperature_sensitivity",
    "zero",
]
