"""Identifies a unit's model from experiments, with uncertainty and residual tests."""

from smartshoe.identification._bank import CoefficientFits, fit_coefficients
from smartshoe.identification._consistency import ConsistencyTest, consistency_test
from smartshoe.identification._identification import Identification
from smartshoe.identification._identifier import identify
from smartshoe.identification._residual_tests import ResidualTest
from smartshoe.models import Parameter

__all__ = [
    "CoefficientFits",
    "ConsistencyTest",
    "Identification",
    "Parameter",
    "ResidualTest",
    "consistency_test",
    "fit_coefficients",
    "identify",
]
