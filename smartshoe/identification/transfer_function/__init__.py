"""Continuous-time transfer functions of any order from sampled input and output."""

from smartshoe.identification.transfer_function.estimate import Root, TransferFunctionEstimate
from smartshoe.identification.transfer_function.identify import identify_transfer_function
from smartshoe.identification.transfer_function.order import OrderCandidate, OrderSelection, select_order

__all__ = [
    "OrderCandidate",
    "OrderSelection",
    "Root",
    "TransferFunctionEstimate",
    "identify_transfer_function",
    "select_order",
]
