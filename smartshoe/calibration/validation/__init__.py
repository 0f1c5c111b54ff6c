"""Validation: how good a calibration is, per loading rate, against the best that a static gain could do."""

from smartshoe.calibration.validation._validation import ForceTrace, RateResult, Validation, validate

__all__ = ["RateResult", "ForceTrace", "Validation", "validate"]
