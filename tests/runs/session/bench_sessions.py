"""A short protocol, and plans for sessions on the simulated bench."""

from __future__ import annotations

from typing import Any

from smartshoe.protocol import Protocol, dynamic_protocol
from smartshoe.runs.session import SessionPlan

SHORT = Protocol("short", dynamic_protocol((200.0, 800.0), rest_s=2.0).segments)
SHORT_TOML = '[protocol.short]\nkind = "dynamic"\nrates_n_per_s = [200, 800]\nrest_s = 2\n'


def bench_plan(**changes: Any) -> SessionPlan:
    """A simulated shoe under a simulated machine, pressed twice."""
    settings: dict[str, Any] = {
        "shoe": "sim:stand?seed=5",
        "machine": "sim:instron?seed=6",
        "unit": "left_toe",
        "protocols": (SHORT,),
        "created": "2024-05-06",
        "diagnosed": False,
        **changes,
    }
    return SessionPlan(**settings)
