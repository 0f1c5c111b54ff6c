"""`Desk`: what all pages share, that is, the reduced traces, the checks, and the state sent twice a second."""

from __future__ import annotations

import json
import threading
from typing import TYPE_CHECKING, Any

from smartshoe.live._battery import Battery
from smartshoe.live._frames import PageView, Reduction
from smartshoe.live.session import LiveSession

if TYPE_CHECKING:
    from smartshoe.live._client import Client

STATE_EVERY_S = 0.5
CHECK_EVERY_S = 4.0


class Desk:
    """The shared part of all pages of ``session``. Only the server's thread uses it; the checks run in another."""

    def __init__(self, session: LiveSession) -> None:
        self.session = session
        self.clients: set[Client] = set()
        self.battery = Battery(session)
        self._reductions: dict[PageView, list[Reduction]] = {}
        self._state = ""
        self._state_due_s = -1.0
        self._stop = threading.Event()
        self._checking: threading.Thread | None = None

    def reductions(self, view: PageView) -> list[Reduction]:
        """Each shoe's traces reduced for ``view``; those of views that no page uses any more are dropped."""
        if view not in self._reductions:
            wanted = {client.view for client in self.clients} | {view}
            self._reductions = {each: reduction for each, reduction in self._reductions.items() if each in wanted}
            self._reductions[view] = [Reduction(live, view) for live in self.session.shoes]
        return self._reductions[view]

    def state(self) -> str:
        """The session's state as JSON, renewed every `STATE_EVERY_S`."""
        now_s = self.session.pace.clock()
        if now_s >= self._state_due_s:
            self._state_due_s = now_s + STATE_EVERY_S
            whole = {"type": "state", **self.session.health(len(self.clients)), "checks": self.battery.checks,
                     "weight": self.battery.weight}  # fmt: skip
            self._state = json.dumps(whole, allow_nan=False)
        return self._state

    def hello(self, view: PageView) -> dict[str, Any]:
        """What a page has to know before its first frame, as an object for JSON."""
        session = self.session
        return {
            "type": "hello",
            "session": session.id,
            "began": session.began.isoformat(timespec="seconds"),
            "speed": session.pace.speed,
            "view": {"seconds": view.seconds, "columns": view.columns},
            "shoes": [
                {
                    "shoe": str(live.shoe),
                    "names": live.names,
                    "symbols": live.symbols,
                    "ranges": [live.full_scale(c) if live.symbols[c] != "N" else None for c in range(len(live.names))],
                    "feet": [
                        {"side": foot.side, "columns": foot.columns, "regions": foot.regions} for foot in live.feet
                    ],
                }
                for live in session.shoes
            ],
            "notes": list(session.notes),
            "steps": list(session.steps),
        }

    def start(self) -> None:
        """Start the checks, in a thread of their own."""
        self._checking = threading.Thread(target=self._check, name="checks", daemon=True)
        self._checking.start()

    def close(self) -> None:
        """Stop the checks."""
        self._stop.set()
        if self._checking is not None:
            self._checking.join(5.0)

    def _check(self) -> None:
        """Repeat the checks until the desk is closed."""
        while not self._stop.wait(CHECK_EVERY_S):
            try:
                self.battery.look()
            except Exception as error:  # a bug must become visible, instead of leaving old results on the page
                self.battery.forget()
                self.session.note("failed", f"the checks ended ({type(error).__name__}: {error}); please report this")
                raise
