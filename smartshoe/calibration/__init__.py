"""From readings to force: calibrations, the filters they define, and banks of filters for several units."""

from smartshoe.calibration._bank import CompensatorBank, stack
from smartshoe.calibration._calibration import Calibration, compensate, compensated, extended_calibration
from smartshoe.calibration._compensator import Compensator
from smartshoe.calibration._extended import ExtendedCompensator
from smartshoe.calibration._filter import ForceFilter

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
