"""From readings to force: a calibration, its filters, and banks of them."""

from smartshoe.compensate.calibration import Calibration, compensate
from smartshoe.compensate.compensator import Compensator, CompensatorBank, stack

__all__ = ["Calibration", "Compensator", "CompensatorBank", "compensate", "stack"]
