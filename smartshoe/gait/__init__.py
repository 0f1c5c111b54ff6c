"""Trials: from a shoe's loads to events, phases, strides and forces. `analyse` is the verb, `GaitResult` its noun."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

_HOME = {
    "analyse": "smartshoe.gait.analysis",
    "analyse_stream": "smartshoe.gait.day",
    "GaitResult": "smartshoe.gait.result",
    "DayResult": "smartshoe.gait.result",
    "Contacts": "smartshoe.gait.contact",
    "ContactDetector": "smartshoe.gait.contact",
    "memberships": "smartshoe.gait.membership",
    "Coverage": "smartshoe.gait.coverage",
    "learn_coverage": "smartshoe.gait.coverage",
    "centre_of_pressure": "smartshoe.gait.insole",
}

if TYPE_CHECKING:
    from smartshoe.gait.analysis import analyse
    from smartshoe.gait.contact import ContactDetector, Contacts
    from smartshoe.gait.coverage import Coverage, learn_coverage
    from smartshoe.gait.day import analyse_stream
    from smartshoe.gait.insole import centre_of_pressure
    from smartshoe.gait.membership import memberships
    from smartshoe.gait.result import DayResult, GaitResult

__all__ = [
    "ContactDetector",
    "Contacts",
    "Coverage",
    "DayResult",
    "GaitResult",
    "analyse",
    "analyse_stream",
    "centre_of_pressure",
    "learn_coverage",
    "memberships",
]


def __getattr__(name: str) -> Any:
    home = _HOME.get(name)
    if home is None:
        raise AttributeError(f"module 'smartshoe.gait' has no attribute {name!r}")
    return getattr(importlib.import_module(home), name)
