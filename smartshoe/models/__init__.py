"""Models that are fitted: the standard linear solid, its first-order response and its difference equations."""

from smartshoe.models._sls import X_OVER_NRT, StandardLinearSolid
from smartshoe.models.discretise import discretise
from smartshoe.models.first_order import simulate
from smartshoe.models.parameter import Parameter

__all__ = ["X_OVER_NRT", "Parameter", "StandardLinearSolid", "discretise", "simulate"]
