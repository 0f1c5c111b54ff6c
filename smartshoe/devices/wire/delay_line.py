"""A straight line of delays against time with its errors, and a robust fit of one through binned delays."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from smartshoe.arrays import Array
from smartshoe.signals.noise import NORMAL_95, robust_sd

Number = TypeVar("Number", float, Array)

CRYSTALS_SD = 100e-6  # prior standard deviation of skews
TUKEY = 4.685  # 95 % of least squares' efficiency under normal noise (Huber 1981)
ROUNDS = 10
SETTLED = 0.05  # of a standard error


@dataclass(frozen=True, slots=True)
class DelayLine:
    """delay = ``offset_s`` + ``slope`` (time - ``about_s``), with standard errors; the two are independent there."""

    about_s: float
    offset_s: float
    offset_sd_s: float
    slope: float
    slope_sd: float

    def delay_s(self, time_s: Number) -> Number:
        """The line's delay in s at ``time_s``."""
        return self.offset_s + self.slope * (time_s - self.about_s)

    def sd_s(self, time_s: float) -> float:
        """The standard error in s of the line's delay at ``time_s``."""
        return math.hypot(self.offset_sd_s, self.slope_sd * (time_s - self.about_s))


def of_few(free: float) -> float:
    """Factor for a standard error with ``free`` degrees of freedom such that 1.96 of them cover 95 %.

    Student's quantile over the normal one, to first order.
    """
    return 1.0 + (NORMAL_95**2 + 1.0) / (4.0 * max(free, 1.0))


def robust_line(time_s: Array, delay_s: Array) -> DelayLine:
    """The straight line through ``delay_s`` (n,), by reweighted least squares.

    The usual skews of crystals are its prior.
    """
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
    # Smallest delays scatter to one side, which the median distance alone underestimates.
    rest = delay_s - offset - slope * (time_s - about)
    inside = np.abs(rest) < TUKEY * scatter
    scatter = max(scatter, float(np.sqrt(np.mean(rest[inside] ** 2))) if inside.any() else 0.0)
    free = max(total - 2.0, 1.0)
    scatter *= math.sqrt(max(total, 1.0) / free) * of_few(free)
    return DelayLine(about, offset, scatter / math.sqrt(max(total, 1.0)), slope, scatter / math.sqrt(spread))
