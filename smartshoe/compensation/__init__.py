"""From readings to force: a calibration, its filters, and banks of them."""

from smartshoe.compensation.bank import CompensatorBank, stack
from smartshoe.compensation.calibration import Calibration, compensate, compensated, extended_calibration
from smartshoe.compensation.compensator import Compensator
from smartshoe.compensation.extended import ExtendedCompensator
from smartshoe.compensation.filter import ForceFilter

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
