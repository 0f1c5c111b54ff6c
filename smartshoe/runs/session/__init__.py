"""A calibration session: a unit is pressed by a machine, recorded without loss, then identified and validated."""

from smartshoe.runs.session._analysis import SessionResult, analyse
from smartshoe.runs.session._checks import PressingFault
from smartshoe.runs.session._folder import SessionFolder
from smartshoe.runs.session._operator import Operator, Unattended
from smartshoe.runs.session._plan import SessionPlan, protocols_named
from smartshoe.runs.session._procedure import conduct
from smartshoe.runs.session._publish import publish

__all__ = [
    "Operator",
    "SessionPlan",
    "SessionFolder",
    "SessionResult",
    "Unattended",
    "analyse",
    "conduct",
    "protocols_named",
    "publish",
    "PressingFault",
]
