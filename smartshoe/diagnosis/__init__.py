"""What a simulation gets wrong, why, and what mending it gains: `diagnose`."""

from smartshoe.diagnosis._diagnose import diagnose
from smartshoe.diagnosis._held_out import Gain
from smartshoe.diagnosis._result import Cause, Diagnosis, GoodnessOfFit, Rival, Trace
from smartshoe.integrity.thresholds import Thresholds, described

__all__ = ["Cause", "Diagnosis", "Thresholds", "diagnose", "GoodnessOfFit", "Rival", "Trace", "Gain", "described"]
