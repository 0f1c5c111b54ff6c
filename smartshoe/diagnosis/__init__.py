"""What a simulation gets wrong, why, and what mending it gains."""

from smartshoe.diagnosis.procedure import diagnose
from smartshoe.diagnosis.result import Cause, Diagnosis

__all__ = ["Cause", "Diagnosis", "diagnose"]
