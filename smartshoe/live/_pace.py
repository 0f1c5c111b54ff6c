"""The session's clock, and the replay of simulated and recorded shoes at the rate of their own time stamps."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from threading import Event
from typing import TypeVar

import numpy as np

from smartshoe.arrays import Array
from smartshoe.devices import Block

Number = TypeVar("Number", float, Array)

SLICE_S = 0.02  # host time covered by a slice; 30 to 60 frames are drawn a second


@dataclass(frozen=True)
class Pace:
    """The session's clock: seconds since its start, ``speed`` times as fast as the host's ``clock``.

    ``begin_s`` is the host's time at the start. Only recordings and simulations can be shown at another speed than 1.
    """

    clock: Callable[[], float]
    begin_s: float
    speed: float = 1.0

    def now_s(self) -> float:
        """Seconds since the start of the session."""
        return (self.clock() - self.begin_s) * self.speed

    def of_host(self, host_time_s: Number) -> Number:
        """Convert a time, or times, of the host's clock to seconds since the start of the session."""
        return (host_time_s - self.begin_s) * self.speed


def paced(blocks: Iterator[Block], pace: Pace, first_s: float, stop: Event) -> Iterator[Block]:
    """Yield ``blocks`` of a stream without a clock of its own in slices, each when its last sample is due.

    A sample with the stream's time ``first_s`` is due at the start of the session. Each slice carries the host times at
    which its samples were due, and the host time at which it was handed on. Ends when ``stop`` is set.
    """
    for block in blocks:
        due_s = block.time_s - first_s
        edges = np.flatnonzero(np.diff(np.floor(due_s / (SLICE_S * pace.speed)))) + 1
        for start, end in zip([0, *edges.tolist()], [*edges.tolist(), len(block)], strict=True):
            wait_s = (float(due_s[end - 1]) - pace.now_s()) / pace.speed
            if stop.wait(wait_s) if wait_s > 0.0 else stop.is_set():
                return
            part = slice(start, end)
            yield replace(
                block,
                time_s=block.time_s[part],
                readings=block.readings[part],
                missing=block.missing[part],
                host_time_s=pace.begin_s + due_s[part] / pace.speed,
                arrival_s=np.full(end - start, pace.clock()),
            )
