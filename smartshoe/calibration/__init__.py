"""From readings to force: a calibration, its filters, and banks of them."""

from smartshoe.calibration.bank import CompensatorBank, stack
from smartshoe.calibration.calibration import Calibration, compensate, compensated, extended_calibration
from smartshoe.calibration.compensator import Compensator
from smartshoe.calibration.extended import ExtendedCompensator
from smartshoe.calibration.filter import ForceFilter

__all__ = [
    "Calibration",
    "Compensator",
    "CompensatorBank",
    "ExtendedCompensator",
    "ForceFilter",
    "compensate",
    "compensated",
    "extended_calibration",
    "stack",
]
