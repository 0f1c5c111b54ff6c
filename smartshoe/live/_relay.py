"""`RelayedShoe`: shows on a page a shoe that a session reads; the session never waits for the page."""

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
    """Passes on the blocks of ``shoe`` that `give` receives; a stream without a clock uses its own time stamps."""

    def __init__(self, shoe: Shoe) -> None:
        super().__init__()
        self._shoe = shoe
        self._given: SimpleQueue[Block | None] = SimpleQueue()
        self._newest_s: float | None = None

    def __str__(self) -> str:
        return str(self._shoe)

    def describe(self) -> tuple[ChannelDescription, ...]:
        """The channels of the shoe."""
        return self._shoe.describe()

    @property
    def sample_rate_hz(self) -> float:
        """The sample rate of the shoe."""
        return self._shoe.sample_rate_hz

    @property
    def device_clock(self) -> DeviceClock | None:
        """The clock of the shoe."""
        return self._shoe.device_clock

    def clock_s(self) -> float:
        """The time for showing samples: the host's for a live shoe, otherwise that of the last sample given."""
        return time.perf_counter() if self._newest_s is None else self._newest_s

    def give(self, block: Block) -> None:
        """Pass a block on; never waits."""
        if block.arrival_s is None:
            self._newest_s = float(block.time_s[-1])
            block = replace(block, host_time_s=block.time_s, arrival_s=block.time_s)
        self._given.put(block)

    def _blocks_internal(self) -> Iterator[Block]:
        while (block := self._given.get()) is not None:
            yield block

    def _close_internal(self) -> None:
        self._given.put(None)
