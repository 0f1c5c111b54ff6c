"""A shoe that a session reads, shown on a page as well: what is on disk is handed on, nothing waits for the page."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import replace
from queue import SimpleQueue
from typing import TYPE_CHECKING

from smartshoe.devices import Block, ChannelDescription, Shoe

if TYPE_CHECKING:
    from smartshoe.devices.wire.clock import DeviceClock


class RelayedShoe(Shoe):
    """``shoe`` as its blocks are given on; a stream without a clock of its own goes by its own stamps."""

    def __init__(self, shoe: Shoe) -> None:
        super().__init__()
        self._shoe = shoe
        self._given: SimpleQueue[Block | None] = SimpleQueue()
        self._newest_s: float | None = None

    def __str__(self) -> str:
        return str(self._shoe)

    def describe(self) -> tuple[ChannelDescription, ...]:
        """The shoe's channels."""
        return self._shoe.describe()

    @property
    def sample_rate_hz(self) -> float:
        """The shoe's."""
        return self._shoe.sample_rate_hz

    @property
    def device_clock(self) -> DeviceClock | None:
        """The shoe's."""
        return self._shoe.device_clock

    def clock_s(self) -> float:
        """The time that samples are shown on: the host's for a live shoe, else that of the last sample given."""
        return time.perf_counter() if self._newest_s is None else self._newest_s

    def give(self, block: Block) -> None:
        """Hand a block on; never waits."""
        if block.arrival_s is None:
            self._newest_s = float(block.time_s[-1])
            block = replace(block, host_time_s=block.time_s, arrival_s=block.time_s)
        self._given.put(block)

    def _blocks_internal(self) -> Iterator[Block]:
        while (block := self._given.get()) is not None:
            yield block

    def _close_internal(self) -> None:
        self._given.put(None)
