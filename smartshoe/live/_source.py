"""`Source`: the thread that reads one shoe's samples into the session and reconnects the shoe if it is lost."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import chain
from typing import TYPE_CHECKING

import numpy as np

from smartshoe.devices import Block, Disconnected, Reconnected, Restarted, ShoeEvent
from smartshoe.devices.serial_link.reconnect import Backoff
from smartshoe.errors import DeviceError, SmartShoeError
from smartshoe.live._pace import paced
from smartshoe.live._shoe import LiveShoe
from smartshoe.models.effects import failure_of_others

if TYPE_CHECKING:
    from smartshoe.live._pace import Pace

LOOK_EVERY_S = 0.2  # interval at which the shoe's events are checked
JUMP_S = 5.0  # if the device's time is off the host's by more, the device was restarted
SILENT_S = 1.0
JOIN_S = 5.0


class Source:
    """Reads an open shoe to its end in a thread of its own; a live one that fails is reopened until `close`.

    ``take(block)`` gets each block in order, with times that increase throughout; ``tell(event)`` gets what happened to
    the shoe, ``fail(sentence)`` the reason for which reading ended.
    """

    def __init__(
        self,
        live: LiveShoe,
        clock: Callable[[], float],
        take: Callable[[Block], None],
        tell: Callable[[ShoeEvent], None],
        fail: Callable[[str], None],
    ) -> None:
        self.live, self._clock = live, clock
        self._take, self._tell, self._fail = take, tell, fail
        self._stop = threading.Event()
        self._reported = 0
        self._checked_s = -np.inf
        self._shift_s = 0.0
        self._last: tuple[float, float] | None = None  # device time as handed on, and arrival time
        self._blocks = live.shoe.blocks()
        self._head: Block | None = None
        self._thread = threading.Thread(target=self._run, name=f"reader of {live.shoe}", daemon=True)

    def first_s(self) -> float | None:
        """The first sample's time if the stream has no clock of its own; None for a live shoe, or without a sample."""
        if self._head is None:
            self._head = next(self._blocks, None)
        head = self._head
        return None if head is None or not len(head) or head.arrival_s is not None else float(head.time_s[0])

    def start(self, pace: Pace, first_s: float | None) -> None:
        """Start reading. ``first_s`` is the stream's time at the session's start; None for a live shoe."""
        head = () if self._head is None else (self._head,)
        blocks: Iterator[Block] = chain(head, self._blocks)
        if first_s is not None:
            blocks = paced(blocks, pace, first_s, self._stop)
        self._blocks = blocks
        self.live.state = "streaming"
        self._thread.start()

    def close(self) -> None:
        """Stop reading and close the shoe."""
        self._stop.set()
        self.live.shoe.close()
        if self._thread.ident is not None:
            self._thread.join(JOIN_S)

    def _run(self) -> None:
        try:
            while True:
                try:
                    for block in self._blocks:
                        if self._stop.is_set():
                            return
                        self._take_block(block)
                    self.live.state = "over"
                    return
                except DeviceError as error:
                    if self._stop.is_set() or not self._reopen(error):
                        return
        except SmartShoeError as error:
            self._fail(str(error))
        except Exception as error:  # a bug must become visible, instead of leaving a frozen picture
            why = f"showing failed ({type(error).__name__}: {error}); please report this"
            self._fail(f"{self.live.shoe}: {failure_of_others(error) or why}")
            raise

    def _take_block(self, block: Block) -> None:
        now_s = self._clock()
        if now_s - self._checked_s >= LOOK_EVERY_S or not len(block):
            self._checked_s = now_s
            self._report_events()
        if not len(block):
            return
        arrival_s = now_s if block.arrival_s is None else float(block.arrival_s[-1])
        if self._shift_s:
            block = replace(block, time_s=block.time_s + self._shift_s)
        self.live.follow_clock(block, self._shift_s)
        self._last = float(block.time_s[-1]), arrival_s
        self.live.state = "streaming"
        self._take(block)

    def _report_events(self) -> None:
        events = self.live.shoe.events
        for event in events[self._reported :]:
            if isinstance(event, Disconnected):
                self.live.state = "away"
            elif isinstance(event, Reconnected):
                self.live.state = "streaming"
            self._tell(event)
        self._reported = len(events)
        if self._last is not None and self.live.state == "streaming" and self._clock() - self._last[1] > SILENT_S:
            self.live.state = "silent"

    def _reopen(self, error: DeviceError) -> bool:
        """Reopen the shoe, trying until it is there; False if the session ended before that."""
        shoe, lost_s = self.live.shoe, self._clock()
        self._report_events()
        self.live.state = "away"
        self._tell(Disconnected(lost_s, str(error)))
        shoe.close()
        backoff = Backoff()
        while not self._stop.wait(backoff.next_wait_s()):
            try:
                shoe.open()
                self._reported = 0
                self._blocks = self._resumed(shoe.blocks())
            except DeviceError:
                continue
            self._tell(Reconnected(self._clock(), self._clock() - lost_s, backoff.attempts))
            return True
        return False

    def _resumed(self, blocks: Iterator[Block]) -> Iterator[Block]:
        """The blocks of a reopened shoe; its times are shifted, if need be, to continue where the host's clock says."""
        first = next((block for block in blocks if len(block)), None)
        if first is None:
            return iter(())
        if self._last is not None and first.arrival_s is not None:
            due_s = self._last[0] + float(first.arrival_s[0]) - self._last[1]
            goes_on_s = float(first.time_s[0]) + self._shift_s
            if abs(goes_on_s - due_s) > JUMP_S or goes_on_s <= self._last[0]:
                self._shift_s = max(due_s, self._last[0] + 1e-6) - float(first.time_s[0])
                self._tell(Restarted(self._clock(), float(first.time_s[0]) + self._shift_s))
        return chain((first,), blocks)
