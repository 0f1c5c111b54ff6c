"""Identification of a unit's model from experiments, with uncertainty and residual tests."""

from smartshoe.identification.identification import Identification
from smartshoe.identification.identifier import identify
from smartshoe.identification.residual_tests import ResidualTest
from smartshoe.models import Parameter

__all__ = ["Identification", "Parameter", "ResidualTest", "identify"]
