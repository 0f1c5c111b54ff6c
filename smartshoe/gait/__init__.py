"""Gait analysis: from a shoe's loads to events, phases, strides and forces.

`analyse` and `analyse_stream` analyse a trial; `GaitResult` and `DayResult` hold what they found. Names are imported
from their modules on first use.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

_HOME = {
    "GaitFindings": "smartshoe.gait._result",
    "Event": "smartshoe.gait._events",
    "Flag": "smartshoe.gait._flag",
    "FootSeries": "smartshoe.gait._series",
    "Stride": "smartshoe.gait._strides",
    "write_c3d": "smartshoe.gait._c3d",
    "write_motion_bids": "smartshoe.gait._motion_bids",
    "LEAST_LOAD_N": "smartshoe.gait._contact",
    "analyse": "smartshoe.gait._analysis",
    "analyse_stream": "smartshoe.gait._day",
    "GaitResult": "smartshoe.gait._result",
    "DayResult": "smartshoe.gait._result",
    "Contacts": "smartshoe.gait._contact",
    "ContactDetector": "smartshoe.gait._contact",
    "memberships": "smartshoe.gait.membership",
    "Coverage": "smartshoe.gait._coverage",
    "learn_coverage": "smartshoe.gait._coverage",
    "centre_of_pressure": "smartshoe.gait.insole",
}

if TYPE_CHECKING:
    from smartshoe.gait._analysis import analyse
    from smartshoe.gait._c3d import write_c3d
    from smartshoe.gait._contact import LEAST_LOAD_N, ContactDetector, Contacts
    from smartshoe.gait._coverage import Coverage, learn_coverage
    from smartshoe.gait._day import analyse_stream
    from smartshoe.gait._events import Event
    from smartshoe.gait._flag import Flag
    from smartshoe.gait._motion_bids import write_motion_bids
    from smartshoe.gait._result import DayResult, GaitFindings, GaitResult
    from smartshoe.gait._series import FootSeries
    from smartshoe.gait._strides import Stride
    from smartshoe.gait.insole import centre_of_pressure
    from smartshoe.gait.membership import memberships

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
    "GaitFindings",
    "Event",
    "Flag",
    "FootSeries",
    "Stride",
    "write_c3d",
    "write_motion_bids",
    "LEAST_LOAD_N",
]


def __getattr__(name: str) -> Any:
    home = _HOME.get(name)
    if home is None:
        raise AttributeError(f"module 'smartshoe.gait' has no attribute {name!r}")
    return getattr(importlib.import_module(home), name)
