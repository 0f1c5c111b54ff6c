"""What a simulation gets wrong, why, and what mending it gains: `diagnose`."""

from smartshoe.diagnosis.procedure import diagnose
from smartshoe.diagnosis.result import Cause, Diagnosis
from smartshoe.diagnosis.thresholds import Thresholds

__all__ = ["Cause", "Diagnosis", "Thresholds", "diagnose"]
