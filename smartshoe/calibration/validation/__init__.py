"""Validation: how good a calibration is, per loading rate, compared with the best static gain."""

from smartshoe.calibration.validation._validation import ForceTrace, RateResult, Validation, validate

__all__ = ["RateResult", "ForceTrace", "Validation", "validate"]
