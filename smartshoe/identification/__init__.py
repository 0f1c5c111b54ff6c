"""Identification of a unit's model from experiments, with uncertainty and residual tests."""

from smartshoe.identification.bank import CoefficientFits, fit_coefficients
from smartshoe.identification.consistency import ConsistencyTest, consistency_test
from smartshoe.identification.identification import Identification
from smartshoe.identification.identifier import identify
from smartshoe.identification.residual_tests import ResidualTest
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
