"""From readings to force: a calibration, its filters, and banks of them."""

from smartshoe.compensation.calibration import Calibration, compensate
from smartshoe.compensation.compensator import Compensator, CompensatorBank, stack

__all__ = ["Calibration", "Compensator", "CompensatorBank", "compensate", "stack"]
