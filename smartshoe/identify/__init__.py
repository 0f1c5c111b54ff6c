"""Identification of a unit's model from experiments, with uncertainty and residual tests."""

from smartshoe.identify.identification import Identification
from smartshoe.identify.identifier import identify
from smartshoe.identify.residual_tests import ResidualTest
from smartshoe.models import Parameter

__all__ = ["Identification", "Parameter", "ResidualTest", "identify"]
