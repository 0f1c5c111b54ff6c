"""Identifies continuous-time transfer functions of any order from sampled input and output."""

from smartshoe.identification.transfer_function._estimate import Root, TransferFunctionEstimate
from smartshoe.identification.transfer_function._identify import identify_transfer_function
from smartshoe.identification.transfer_function._order import OrderCandidate, OrderSelection, select_order

__all__ = [
    "OrderCandidate",
    "OrderSelection",
    "Root",
    "TransferFunctionEstimate",
    "identify_transfer_function",
    "select_order",
]
