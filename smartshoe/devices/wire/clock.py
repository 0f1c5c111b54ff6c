"""Relates the device's clock to the host's: a line through the times of arrival, whatever the delays on the way.

A sample taken at device time d arrives at

    host = offset + (1 + skew) d + latency + jitter,    jitter >= 0, and some samples delayed by seconds

Arrivals alone cannot separate the offset from the latency: a constant delay looks like a clock set late. Times are
therefore right *up to one constant*, the delay that the first line ran through (only a round trip, or a press seen by
both the machine and the shoe, can determine it). The skew, and every difference between times of one stream, do not
depend on it.

Delays are collected in bins of `BIN_S`. Each bin gives its smallest delay, its tenth percentile and its median, and a
robust line runs through each of these levels. A further line, the likely one, maximises the likelihood of all arrivals
under the distribution of delays that they show (`delay_law`). The line with the smallest standard error is used: the
likely one where delays are independent, a level where they have a pattern, such as a timer's. When the choice changes,
the new line continues the old one, so that the constant stays the same. Lines cover the last `KEPT_BINS` bins, since a
crystal follows its temperature. Live and final times use the same estimator: the line so far, and the last one.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from queue import SimpleQueue
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from smartshoe.arrays import Array, Mask
from smartshoe.devices.wire.delay_law import DelayLaw
from smartshoe.devices.wire.delay_line import CRYSTALS_SD, DelayLine, robust_line
from smartshoe.errors import UsageError

Level = Literal["least", "tenth", "median", "likely"]

LEVELS: tuple[Level, ...] = ("least", "tenth", "median")
BIN_S = 0.25
KEPT_BINS = 2400  # ten minutes of bins
MOST_SAMPLES = 150_000  # used for the likely line
FEW_BINS = 8
LAW_FROM_BINS = 20
FEWEST_KNOWN = 20  # exactly known delays needed to fit their distribution
ALIKE_BINS = 2  # bins over which errors may be correlated
SWITCH_GAIN = 0.7
NEW_LINE = 20  # a new line is fitted when the bins have grown by a twentieth


@dataclass(frozen=True, slots=True)
class ClockFit:
    """host = ``offset_s`` + (1 + ``skew_ppm`` 1e-6) (device - ``about_s``) + ``about_s``; sd one standard error.

    ``about_s`` is the device time in the middle of the fitted samples, where offset and skew are independent.
    ``skew_ppm`` is positive where the device's clock is slow (its second is longer than the host's). ``level`` is the
    delay that the line runs through; ``samples`` and ``bins`` are the numbers that it is based on.
    """

    about_s: float
    offset_s: float
    offset_sd_s: float
    skew_ppm: float
    skew_sd_ppm: float
    level: Level
    bins: int
    samples: int

    def host_time(self, device_time_s: ArrayLike) -> Array:
        """Device times in s converted to the host's clock, in s."""
        device = np.asarray(device_time_s, dtype=np.float64)
        return device + self.offset_s + self.skew_ppm * 1e-6 * (device - self.about_s)

    def sd_s(self, device_time_s: ArrayLike) -> Array:
        """Standard error in s of `host_time`, up to the constant delay."""
        lever = np.asarray(device_time_s, dtype=np.float64) - self.about_s
        return np.hypot(self.offset_sd_s, self.skew_sd_ppm * 1e-6 * lever)


def at_once(work: Callable[[], None]) -> None:
    """Run ``work`` in the calling thread."""
    work()


class DeviceClock:
    """A `ClockFit` updated by a stream; begin a new one (or `reset`) when the device restarts.

    Fitting the distribution of delays takes a tenth of a second, seven times in the first ten minutes and once in ten
    minutes after that. ``apart`` runs that work: by default at once; a reader thread, which must not wait, runs it in
    another thread.
    """

    def __init__(self, apart: Callable[[Callable[[], None]], None] = at_once) -> None:
        self._apart = apart
        self.reset()

    def reset(self) -> None:
        """Return to the initial state, without any samples."""
        self._samples = 0
        self._origin = 0.0
        self._bin = 0
        self._last_arrival_s = -math.inf
        self._open: list[_Piece] = []
        self._kept: list[_Piece] = []
        self._kept_samples = 0
        self._closed = self._line_due = 0
        self._law_due = LAW_FROM_BINS
        self._law: DelayLaw | None = None
        self._told: SimpleQueue[DelayLaw | None] = SimpleQueue()
        self._is_asked = False
        self._likely: DelayLine | None = None
        self._centres: list[float] = []
        self._values: list[tuple[float, float, float]] = []
        self._level: Level = "least"
        self._shift_s = 0.0
        self._fit: ClockFit | None = None

    @property
    def fit(self) -> ClockFit | None:
        """The line so far, None before the first sample."""
        return self._fit

    def update(self, device_time_s: ArrayLike, arrival_s: ArrayLike) -> None:
        """Add samples of increasing ``device_time_s`` (n,) that arrived at ``arrival_s``, (n,) or one time for all."""
        device = np.atleast_1d(np.asarray(device_time_s, dtype=np.float64))
        if not device.size:
            return
        arrival = np.asarray(arrival_s, dtype=np.float64)
        if arrival.shape != device.shape:
            arrival = np.broadcast_to(arrival, device.shape)
        came_with = np.empty(device.size, dtype=bool)
        came_with[0], came_with[1:] = arrival[0] <= self._last_arrival_s, arrival[1:] <= arrival[:-1]
        self._last_arrival_s = float(arrival[-1])
        if not self._samples:
            self._origin = float(device[0])
        self._samples += device.size
        bins = np.floor((device - self._origin) / BIN_S).astype(np.int64)
        edges = [0, *(np.flatnonzero(bins[1:] > bins[:-1]) + 1).tolist(), device.size]
        for start, stop in pairwise(edges):
            if int(bins[start]) != self._bin and self._open:
                self._close_bin()
            self._bin = int(bins[start])
            part = slice(start, stop)
            self._open.append(_Piece(device[part], arrival[part] - device[part], came_with[part]))
        if self._closed < FEW_BINS:
            self._fit = self._first_fit()
        elif self._closed >= self._line_due:
            # A few more bins change a line little: fitting at logarithmic intervals is cheap.
            self._line_due = self._closed + max(1, len(self._centres) // NEW_LINE)
            self._fit = self._fitted()

    def host_time(self, device_time_s: ArrayLike) -> Array:
        """Device times in s converted to the host's clock by the present line.

        Raises `UsageError` before the first sample.
        """
        if self._fit is None:
            raise UsageError("the clock has no line yet: update it with at least one sample")
        return self._fit.host_time(device_time_s)

    def _close_bin(self) -> None:
        piece = _joined(self._open)
        self._open = []
        least, tenth, median = np.quantile(piece.delay_s, (0.0, 0.1, 0.5)).tolist()
        self._closed += 1
        self._centres.append(float(piece.time_s.mean()))
        self._values.append((least, tenth, median))
        self._kept.append(piece)
        self._kept_samples += piece.time_s.size
        while self._kept_samples > MOST_SAMPLES or len(self._kept) > KEPT_BINS:
            self._kept_samples -= self._kept.pop(0).time_s.size
        surplus = max(len(self._centres) - KEPT_BINS, 0)
        del self._centres[:surplus], self._values[:surplus]

    def _first_fit(self) -> ClockFit:
        leasts = [value[0] for value in self._values] or [min(float(piece.delay_s.min()) for piece in self._open)]
        about = self._centres[0] if self._centres else float(self._open[0].time_s[0])
        spread = max([value[2] - value[0] for value in self._values] or [0.0])
        offset = float(np.median(leasts))
        return ClockFit(about, offset, spread, 0.0, CRYSTALS_SD * 1e6, "least", len(self._centres), self._samples)

    def _fitted(self) -> ClockFit:
        centres, values = np.array(self._centres), np.array(self._values)
        lines: dict[Level, DelayLine] = {
            level: robust_line(centres, values[:, place]) for place, level in enumerate(LEVELS)
        }
        if self._closed >= LAW_FROM_BINS:
            self._follow_law(lines[self._level] if self._level in lines else lines["least"])
            if self._likely is not None:
                lines["likely"] = self._likely
        now, middle = float(centres[-1]), float(centres.mean())
        best = min(lines, key=lambda level: lines[level].sd_s(now))
        if self._level not in lines or lines[best].sd_s(now) < SWITCH_GAIN * lines[self._level].sd_s(now):
            # In the middle of their common data, where the distance of the two lines is known best.
            before = lines.get(self._level, lines["least"])
            self._shift_s += before.delay_s(middle) - lines[best].delay_s(middle)
            self._level = best
        line = lines[self._level]
        return ClockFit(
            line.about_s,
            line.offset_s + self._shift_s,
            line.offset_sd_s,
            line.slope * 1e6,
            line.slope_sd * 1e6,
            self._level,
            len(self._centres),
            self._samples,
        )

    def _follow_law(self, level: DelayLine) -> None:
        """Update the likely line of the stored samples.

        From time to time refit the distribution, continuing the line.
        """
        kept = _joined(self._kept)
        if (~kept.came_with).sum() < FEWEST_KNOWN:
            return
        group = np.repeat(np.arange(len(self._kept)) // ALIKE_BINS, [piece.time_s.size for piece in self._kept])

        def line(law: DelayLaw, start: DelayLine) -> DelayLine | None:
            return law.line(kept.time_s, kept.delay_s, kept.came_with, group, start)

        if self._law is not None:
            self._likely = line(self._law, self._likely or level)
        if self._closed >= self._law_due and not self._is_asked:
            self._is_asked = True
            self._law_due = self._closed + min(self._closed, KEPT_BINS)
            before, middle, told = self._likely or level, float(kept.time_s.mean()), self._told

            def tell() -> None:
                law = DelayLaw.of(kept.delay_s - before.delay_s(kept.time_s), kept.came_with)
                after = line(law, before)
                told.put(None if after is None else law.moved(after.delay_s(middle) - before.delay_s(middle)))

            self._apart(tell)
        if not self._told.empty():
            self._is_asked, law = False, self._told.get()
            if law is not None:
                self._law = law
                self._likely = line(law, self._likely or level)


@dataclass(frozen=True, slots=True, eq=False)
class _Piece:
    """Device times (n,), delays (n,), and a mask (n,) of samples that arrived together with the one before."""

    time_s: Array
    delay_s: Array
    came_with: Mask


def _joined(pieces: Sequence[_Piece]) -> _Piece:
    return _Piece(
        np.concatenate([piece.time_s for piece in pieces]),
        np.concatenate([piece.delay_s for piece in pieces]),
        np.concatenate([piece.came_with for piece in pieces]),
    )
