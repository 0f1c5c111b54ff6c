"""The device's clock on the host's: a line through the times of arrival, whatever delays the way had.

A sample taken at device time d arrives at

    host = offset + (1 + skew) d + latency + jitter,    jitter >= 0, and some samples delayed by seconds

Arrivals alone cannot tell the offset from the latency: a constant delay looks like a clock set late. So times are right
*up to one constant*, the delay that the first line ran through (only a round trip, or a press seen by the machine and
the shoe alike, can find it). Skew, and every difference between times of one stream, are free of it.

Delays are gathered in bins of `BIN_S`. A bin gives its least delay, its tenth percentile and its median, groups of
bins their least; whichever gives the surest straight line is fitted (the least where delays have a
hard floor, the median where they are like noise), with Tukey's biweight against bins that a stall lifted as a whole.
The skew is the mean of all of them, each weighted by how sure it is: they err alike in part only.
Where the choice changes, the line goes on where it was, so that the constant stays one. The line is that of the last
`KEPT_BINS` bins, since a crystal follows its temperature.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from smartshoe.arrays import Array
from smartshoe.errors import UsageError
from smartshoe.signals.noise import NORMAL_95, robust_sd

Level = Literal["least", "tenth", "median", "floor", "deep floor"]

LEVELS: tuple[Level, ...] = ("least", "tenth", "median")
GROUPS: dict[Level, int] = {"floor": 8, "deep floor": 40}
BIN_S = 0.25
KEPT_BINS = 2400  # ten minutes
FEW_BINS = 8
CRYSTALS_SD = 100e-6  # what skews are before anything is known
TUKEY = 4.685  # Huber 1981: 95 % of least squares' efficiency under normal noise
SWITCH_GAIN = 0.7
ALIKE = 0.5  # how the levels' errors correlate: 0.1 to 0.8 under the laws of tests/devices/wire
ROUNDS = 10
SETTLED = 0.02  # of a standard error
MANY_BINS = 240  # beyond, a new line each second is enough


@dataclass(frozen=True, slots=True)
class ClockFit:
    """host = ``offset_s`` + (1 + ``skew_ppm`` 1e-6) (device - ``about_s``) + ``about_s``; sd one standard error.

    ``about_s`` is the device time in the middle of what was fitted, where offset and skew are independent.
    ``skew_ppm`` is positive where the device's clock is slow (its second is longer than the host's). ``level`` says
    which delay the line runs through, ``samples`` and ``bins`` what it rests on.
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
        """Device times in s on the host's clock, in s."""
        device = np.asarray(device_time_s, dtype=np.float64)
        return device + self.offset_s + self.skew_ppm * 1e-6 * (device - self.about_s)

    def sd_s(self, device_time_s: ArrayLike) -> Array:
        """Standard error in s of `host_time`, up to the constant delay."""
        lever = np.asarray(device_time_s, dtype=np.float64) - self.about_s
        return np.hypot(self.offset_sd_s, self.skew_sd_ppm * 1e-6 * lever)


class DeviceClock:
    """A streaming `ClockFit`; begin a new one (or `reset`) when the device restarts."""

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Forget everything."""
        self._samples = 0
        self._origin = 0.0
        self._bin = 0
        self._closed = 0
        self._delays: list[Array] = []
        self._times: list[Array] = []
        self._centres: list[float] = []
        self._values: list[tuple[float, float, float]] = []
        self._level: Level = "least"
        self._shift_s = 0.0
        self._dropped = 0
        self._fit: ClockFit | None = None

    @property
    def fit(self) -> ClockFit | None:
        """The line so far, None before the first sample."""
        return self._fit

    def update(self, device_time_s: ArrayLike, arrival_s: ArrayLike) -> None:
        """Take in samples of ``device_time_s`` (n,), rising, that came at ``arrival_s`` (n,) or all at one time."""
        device = np.atleast_1d(np.asarray(device_time_s, dtype=np.float64))
        if not device.size:
            return
        delay = np.broadcast_to(np.asarray(arrival_s, dtype=np.float64), device.shape) - device
        if not self._samples:
            self._origin = float(device[0])
        self._samples += device.size
        bins = np.floor((device - self._origin) / BIN_S).astype(np.int64)
        edges = [0, *(np.flatnonzero(np.diff(bins)) + 1).tolist(), device.size]
        has_new = self._fit is None
        for start, stop in pairwise(edges):
            if int(bins[start]) != self._bin and self._delays:
                self._close_bin()
                has_new |= len(self._centres) < MANY_BINS or self._closed % 4 == 0
            self._bin = int(bins[start])
            self._times.append(device[start:stop])
            self._delays.append(delay[start:stop])
        if has_new or len(self._centres) < FEW_BINS:
            self._fit = self._fitted()

    def host_time(self, device_time_s: ArrayLike) -> Array:
        """Device times in s on the host's clock by the line so far; raises `UsageError` before the first sample."""
        if self._fit is None:
            raise UsageError("the clock has no line yet: update it with at least one sample")
        return self._fit.host_time(device_time_s)

    def _close_bin(self) -> None:
        delays, times = np.concatenate(self._delays), np.concatenate(self._times)
        self._delays, self._times = [], []
        least, tenth, median = np.quantile(delays, (0.0, 0.1, 0.5)).tolist()
        self._closed += 1
        self._centres.append(float(times.mean()))
        self._values.append((least, tenth, median))
        surplus = max(len(self._centres) - KEPT_BINS, 0)
        self._dropped += surplus
        del self._centres[:surplus], self._values[:surplus]

    def _fitted(self) -> ClockFit:
        if len(self._centres) < FEW_BINS:
            leasts = [value[0] for value in self._values] or [float(np.concatenate(self._delays).min())]
            about = self._centres[0] if self._centres else float(self._times[0][0])
            spread = max([value[2] - value[0] for value in self._values] or [0.0])
            offset = float(np.median(leasts))
            return ClockFit(about, offset, spread, 0.0, CRYSTALS_SD * 1e6, "least", len(self._centres), self._samples)
        delays = self._delays_of_levels()
        lines = {level: _line(times, values) for level, (times, values, _) in delays.items()}
        now = self._centres[-1]
        best = min(lines, key=lambda level: lines[level].sd_s(now))
        if self._level not in lines or lines[best].sd_s(now) < SWITCH_GAIN * lines[self._level].sd_s(now):
            # Of the same bins, so that what both lines are wrong about does not add up from switch to switch.
            self._shift_s += float(np.median(delays[best][2])) - float(np.median(delays[self._level][2]))
            self._level = best
        line = lines[self._level]
        slope, slope_sd = _common_slope(list(lines.values()))
        return ClockFit(
            line.about_s,
            line.offset_s + self._shift_s,
            line.offset_sd_s,
            slope * 1e6,
            slope_sd * 1e6,
            self._level,
            len(self._centres),
            self._samples,
        )

    def _delays_of_levels(self) -> dict[Level, tuple[Array, Array, Array]]:
        """For each level that there are bins enough for: times, delays, and how far the least lies below them."""
        centres, values = np.array(self._centres), np.array(self._values)
        least = values[:, 0]
        levels: dict[Level, tuple[Array, Array, Array]] = {
            level: (centres, values[:, place], least - values[:, place]) for place, level in enumerate(LEVELS)
        }
        for level, size in GROUPS.items():
            # Groups begin at multiples of their length, counted from the first bin of all, whatever bins were let go.
            first = -self._dropped % size
            groups = (centres.size - first) // size
            if groups < FEW_BINS:
                continue
            here = slice(first, first + groups * size)
            of_group = least[here].reshape(groups, size)
            rows, lowest = np.arange(groups), of_group.argmin(axis=1)
            floor = of_group[rows, lowest]
            levels[level] = (
                centres[here].reshape(groups, size)[rows, lowest],
                floor,
                np.median(of_group, axis=1) - floor,
            )
        return levels


@dataclass(frozen=True, slots=True)
class _Line:
    about_s: float
    offset_s: float
    offset_sd_s: float
    slope: float
    slope_sd: float

    def delay_s(self, time_s: float) -> float:
        """The line's delay at ``time_s``."""
        return self.offset_s + self.slope * (time_s - self.about_s)

    def sd_s(self, time_s: float) -> float:
        """Its standard error."""
        return math.hypot(self.offset_sd_s, self.slope_sd * (time_s - self.about_s))


def _common_slope(lines: Sequence[_Line]) -> tuple[float, float]:
    """The skew that all levels see, each as sure as it is, and its standard error: they err alike in part only."""
    sds = np.array([line.slope_sd for line in lines])
    weights = sds**-2.0
    slope = float(weights @ np.array([line.slope for line in lines])) / float(weights.sum())
    shares = weights * sds / float(weights.sum())
    alone, together = float(shares @ shares), float(shares.sum()) ** 2
    return slope, math.sqrt((1.0 - ALIKE) * alone + ALIKE * together)


def _line(time_s: Array, delay_s: Array) -> _Line:
    """The straight line through ``delay_s`` (n,), by reweighted least squares; skews of crystals are its prior."""
    weights = np.ones_like(delay_s)
    slope = 0.0
    about, offset, scatter, spread = float(time_s.mean()), float(np.median(delay_s)), math.inf, 1.0
    for _ in range(ROUNDS):
        rest = delay_s - offset - slope * (time_s - about)
        scatter = max(robust_sd(rest - np.median(rest)), 1e-7)
        weights = np.clip(1.0 - (rest / (TUKEY * scatter)) ** 2, 0.0, None) ** 2
        total = float(weights.sum())
        if total < 2.0:
            break
        ends_before = offset + slope * (time_s[[0, -1]] - about)
        about = float(weights @ time_s) / total
        lever = time_s - about
        spread = float(weights @ lever**2) + scatter**2 / CRYSTALS_SD**2
        offset = float(weights @ delay_s) / total
        slope = float((weights * lever) @ delay_s) / spread
        moved = np.abs(offset + slope * lever[[0, -1]] - ends_before)
        if moved.max() < SETTLED * scatter / math.sqrt(total):
            break
    # Least delays scatter to one side: the median distance alone would say too little of them.
    rest = delay_s - offset - slope * (time_s - about)
    inside = np.abs(rest) < TUKEY * scatter
    scatter = max(scatter, float(np.sqrt(np.mean(rest[inside] ** 2))) if inside.any() else 0.0)
    # Few bins tell their own scatter badly: Student's quantile over the normal one, to first order (95 %).
    free = max(total - 2.0, 1.0)
    scatter *= math.sqrt(max(total, 1.0) / free) * (1.0 + (NORMAL_95**2 + 1.0) / (4.0 * free))
    return _Line(about, offset, scatter / math.sqrt(max(total, 1.0)), slope, scatter / math.sqrt(spread))
