"""`PageOperator`: shows a calibration session on a live page, and takes answers from it."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from types import TracebackType
from typing import Self

from smartshoe.devices import Block, Shoe
from smartshoe.live._guidance import Guidance
from smartshoe.live._relay import RelayedShoe
from smartshoe.live.server import LiveServer
from smartshoe.live.session import LiveSession
from smartshoe.runs.session import Operator, PressingFault, SessionPlan

DONE, AGAIN, STOP = "Done", "Press again", "Stop"
LOOK_EVERY_S = 0.05
JOIN_S = 10.0


class _AnsweredError(Exception):
    """Raised to stop waiting for the keyboard, since the page has answered."""


class PageOperator:
    """An operator that shows on a page what ``other`` is asked and shown.

    With ``asks`` the page may answer, too; the answer that comes first counts. ``keyboard`` says that ``other`` waits
    for a person as well. The page exists from the first sample on; ``ready`` is then called with its address. Use it as
    a context manager.
    """

    def __init__(
        self, other: Operator, plan: SessionPlan, ready: Callable[[str], None], *,
        asks: bool, keyboard: bool, port: int = 0,
    ) -> None:  # fmt: skip
        self._other, self._ready = other, ready
        self._asks, self._keyboard, self._port = asks, keyboard, port
        self._durations_s = {protocol.name: protocol.duration_s for protocol in plan.protocols}
        self._relay: RelayedShoe | None = None
        self._session: LiveSession | None = None
        self._server: LiveServer | None = None
        self._thread: threading.Thread | None = None
        self.task = Guidance()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self.close()

    def streams(self, shoe: Shoe) -> None:
        """Start to relay ``shoe``, which is read from here on."""
        self._other.streams(shoe)
        self._relay = RelayedShoe(shoe).open()

    def tell(self, sentence: str) -> None:
        """Show ``sentence`` on the page until the next one comes."""
        self._other.tell(sentence)
        self._say(sentence)

    def confirm(self, sentence: str, meanwhile: Callable[[], None]) -> None:
        """Wait until the page's button or the keyboard confirms, whichever comes first."""
        self._say(sentence)
        if not self._asks:
            self._other.confirm(sentence, meanwhile)
            return
        self.task.ask(sentence, (DONE,))

        def until_answered() -> None:
            meanwhile()
            if self.task.answer is not None:
                raise _AnsweredError

        try:
            self._other.confirm(sentence, until_answered)
            while not self._keyboard:
                until_answered()
        except _AnsweredError:
            pass
        finally:
            self.task.settle()

    def show(self, block: Block, experiment: str, elapsed_s: float) -> None:
        """Pass a block on to the page, with the progress of the pressing; the first block opens the page."""
        self._other.show(block, experiment, elapsed_s)
        if self._relay is None:
            return
        self._relay.give(block)
        if self._server is None:
            self._begin(self._relay)
        self.task.progress(experiment, elapsed_s, self._durations_s.get(experiment, 0.0))
        if self._session is not None:
            self._session.changed()

    def wants_repeat(self, finding: PressingFault, repeats_left: int) -> bool:
        """Whether to press again: asked by the page's buttons, unless somebody is at the keyboard."""
        self._say(finding.says)
        if not self._asks or self._keyboard or repeats_left == 0:
            return self._other.wants_repeat(finding, repeats_left)
        self.task.ask(f"{finding.says}: press again? ({repeats_left} repeats are left)", (AGAIN, STOP))
        while self.task.answer is None:
            time.sleep(LOOK_EVERY_S)
        wanted = self.task.answer == AGAIN
        self.task.settle()
        return wanted

    def close(self) -> None:
        """Stop the server and close the page's session."""
        if self._server is not None and self._thread is not None:
            self._server.stop()
            self._thread.join(JOIN_S)
            self._server.desk.close()
        if self._session is not None:
            self._session.close()
        self._server = self._session = None

    def _begin(self, relay: RelayedShoe) -> None:
        """Open the page: start its session and its server."""
        self._session = LiveSession({str(relay): relay}, clock=relay.clock_s)
        self._session.task = self.task
        self._server = LiveServer(self._session, port=self._port)
        self._session.start()
        self._server.desk.start()
        self._thread = threading.Thread(target=self._server.run, name="page", daemon=True)
        self._thread.start()
        self._ready(self._server.url)

    def _say(self, sentence: str) -> None:
        self.task.tell(sentence)
        if self._session is not None:
            self._session.note("instruction", sentence)
