"""`Ring`: the last samples of a stream, in memory of fixed size."""

from __future__ import annotations

import numpy as np

from smartshoe.arrays import Array


class Ring:
    """The last ``capacity`` rows of ``width`` numbers, each with its time; rows are numbered from the first ever added.

    One thread writes; any other thread that reads must hold the writer's lock.
    """

    def __init__(self, capacity: int, width: int) -> None:
        # Room for twice the capacity keeps the rows contiguous; they are moved once every `capacity` rows.
        self._time = np.empty(2 * capacity)
        self._rows = np.empty((2 * capacity, width))
        self._capacity = capacity
        self._start = self._stop = 0
        self.end = 0  # number of the next row

    @property
    def begin(self) -> int:
        """Number of the oldest row that is still held."""
        return self.end - (self._stop - self._start)

    def append(self, time_s: Array, rows: Array) -> None:
        """Add rows (n, width) with their times ``time_s`` (n,)."""
        self.end += time_s.size
        time_s, rows = time_s[-self._capacity :], rows[-self._capacity :]
        if self._stop + time_s.size > self._time.size:
            keep = slice(max(self._stop - self._capacity, self._start), self._stop)
            size = keep.stop - keep.start
            self._time[:size], self._rows[:size] = self._time[keep].copy(), self._rows[keep].copy()
            self._start, self._stop = 0, size
        after = self._stop + time_s.size
        self._time[self._stop : after], self._rows[self._stop : after] = time_s, rows
        self._stop = after
        self._start = max(self._start, after - self._capacity)

    def since(self, place: int) -> tuple[Array, Array]:
        """Copies of times (n,) and rows (n, width) from row number ``place`` on, as far as they are still held."""
        first = self._stop - min(max(self.end - place, 0), self._stop - self._start)
        return self._time[first : self._stop].copy(), self._rows[first : self._stop].copy()

    def after(self, time_s: float) -> tuple[Array, Array]:
        """Copies of times (n,) and rows (n, width) later than ``time_s``."""
        times = self._time[self._start : self._stop]
        return self.since(self.begin + int(np.searchsorted(times, time_s, side="right")))
