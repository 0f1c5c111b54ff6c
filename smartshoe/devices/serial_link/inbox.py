"""A bounded queue of blocks between the thread that reads a port and the consumer; no wait is unbounded."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import replace
from threading import Condition

import numpy as np

from smartshoe.arrays import Array
from smartshoe.devices._base import Block
from smartshoe.errors import DeviceError


class Inbox:
    """A queue of blocks that holds ``limit`` samples; when it is full the oldest are dropped and counted.

    ``end`` closes it: blocks already queued are still given out, then `take` returns None or raises the given error.
    """

    def __init__(self, limit: int) -> None:
        self._limit = limit
        self._blocks: deque[Block] = deque()
        self._samples = 0
        self._dropped: tuple[int, float, float] | None = None
        self._ended = False
        self._error: DeviceError | None = None
        self._changed = Condition()

    def put(self, block: Block) -> None:
        """Add ``block``, dropping the oldest blocks where there is no room."""
        with self._changed:
            if self._ended or not len(block):
                return
            self._blocks.append(block)
            self._samples += len(block)
            while self._samples > self._limit and len(self._blocks) > 1:
                self._drop(self._blocks.popleft())
            self._changed.notify_all()

    def _drop(self, block: Block) -> None:
        self._samples -= len(block)
        count, start, _ = self._dropped or (0, float(block.time_s[0]), 0.0)
        self._dropped = (count + len(block), start, float(block.time_s[-1]))

    def end(self, error: DeviceError | None = None, discard: bool = False) -> None:
        """Close the queue; ``discard`` drops the blocks still in it. Only the first call has an effect."""
        with self._changed:
            if discard:
                self._blocks.clear()
                self._samples = 0
            if not self._ended:
                self._ended, self._error = True, error
            elif discard:
                self._error = None
            self._changed.notify_all()

    def take_dropped(self) -> tuple[int, float, float] | None:
        """Number of samples dropped since the last call, with their first and last time; None where none were."""
        with self._changed:
            dropped, self._dropped = self._dropped, None
            return dropped

    def take(self, wait_s: float) -> tuple[Block, ...] | None:
        """All queued blocks, waiting at most ``wait_s`` for one.

        Empty where none arrived, None once the queue has ended.
        """
        with self._changed:
            self._changed.wait_for(lambda: bool(self._blocks) or self._ended, wait_s)
            if self._blocks:
                taken = tuple(self._blocks)
                self._blocks.clear()
                self._samples = 0
                return taken
            if self._ended:
                if self._error is not None:
                    raise self._error
                return None
            return ()


def joined(blocks: Sequence[Block]) -> Block:
    """Consecutive blocks of one stream merged into one."""
    if len(blocks) == 1:
        return blocks[0]
    return replace(
        blocks[0],
        time_s=np.concatenate([b.time_s for b in blocks]),
        readings=np.concatenate([b.readings for b in blocks]),
        missing=np.concatenate([b.missing for b in blocks]),
        host_time_s=_all([b.host_time_s for b in blocks]),
        arrival_s=_all([b.arrival_s for b in blocks]),
    )


def _all(parts: Sequence[Array | None]) -> Array | None:
    there = [part for part in parts if part is not None]
    return np.concatenate(there) if len(there) == len(parts) else None
