"""The arrival time of each byte of a stream, however many bytes are decoded together."""

from __future__ import annotations

import numpy as np

from smartshoe.arrays import Array, Integers

KEPT = 4096  # chunks: a sample that awaits confirmation by later ones waits for a few


class Arrivals:
    """The chunks of one stream with their times; a sample arrives when the chunk with its last byte is read."""

    def __init__(self) -> None:
        self._bytes = 0
        self._ends: list[int] = []
        self._at_s: list[float] = []

    def note(self, size: int, at_s: float) -> None:
        """Record that the next ``size`` bytes were read at ``at_s``."""
        self._bytes += size
        self._ends.append(self._bytes)
        self._at_s.append(at_s)
        if len(self._ends) > 2 * KEPT:
            del self._ends[:-KEPT], self._at_s[:-KEPT]

    def of(self, end: Integers) -> Array:
        """Times (n,) in s at which the stream's first ``end`` (n,) bytes had arrived; each ``end`` is at least 1."""
        return np.array(self._at_s)[np.searchsorted(self._ends, end)]
