"""A calibration session: a unit under a machine, recorded so that nothing is lost, then identified and judged."""

from smartshoe.session.analysis import SessionResult, analyse
from smartshoe.session.folder import SessionFolder
from smartshoe.session.operator import Operator, Unattended
from smartshoe.session.plan import SessionPlan, protocols_named
from smartshoe.session.procedure import conduct
from smartshoe.session.publish import publish

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
