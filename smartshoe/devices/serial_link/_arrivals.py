"""When each byte of a stream came, however many are decoded together."""

from __future__ import annotations

import numpy as np

from smartshoe.arrays import Array, Integers

KEPT = 4096  # chunks: a sample that waits to be sure waits for a few


class Arrivals:
    """The chunks of one stream with their times: a sample came when the chunk was read that has its last byte."""

    def __init__(self) -> None:
        self._bytes = 0
        self._ends: list[int] = []
        self._at_s: list[float] = []

    def note(self, size: int, at_s: float) -> None:
        """The next ``size`` bytes were read at ``at_s``."""
        self._bytes += size
        self._ends.append(self._bytes)
        self._at_s.append(at_s)
        if len(self._ends) > 2 * KEPT:
            del self._ends[:-KEPT], self._at_s[:-KEPT]

    def of(self, end: Integers) -> Array:
        """When the bytes up to ``end`` (n,), one at least and counted from the stream's first, had come, in s."""
        return np.array(self._at_s)[np.searchsorted(self._ends, end)]
