"""A calibration session: a unit under a machine, recorded so that nothing is lost, then identified and judged."""

from smartshoe.runs.session.analysis import SessionResult, analyse
from smartshoe.runs.session.folder import SessionFolder
from smartshoe.runs.session.operator import Operator, Unattended
from smartshoe.runs.session.plan import SessionPlan, protocols_named
from smartshoe.runs.session.procedure import conduct
from smartshoe.runs.session.publish import publish

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
]
