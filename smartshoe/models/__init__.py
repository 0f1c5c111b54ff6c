"""Models that are fitted: the standard linear solid, its first-order response and its difference equations."""

from smartshoe.models.discretise import discretise
from smartshoe.models.first_order import simulate
from smartshoe.models.parameter import Parameter
from smartshoe.models.sls import X_OVER_NRT, StandardLinearSolid

__all__ = ["X_OVER_NRT", "Parameter", "StandardLinearSolid", "discretise", "simulate"]
