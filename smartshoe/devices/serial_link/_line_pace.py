"""The sampling period of a stream without a sample counter, and how many samples lie between two of its times."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Self

import numpy as np

from smartshoe.arrays import Array, Integers

# A step this many times the usual one is a gap, and says nothing about the period.
HOLE_STEPS = 2.5
TWO_PERIODS = 1.5  # periods: a longer step spans two samples, unless the device's clock is coarse
TICK_S = 1e-3  # of millis(), and of times with three decimals
ROUNDING_S = 1e-6
EVEN = 0.005  # of a tick: a period this close above whole ticks is whole ticks, measured with a few samples lost


@dataclass(frozen=True, slots=True)
class LinePace:
    """Samples ``period_s`` apart; their times may differ by up to ``longest_s`` although none in between is lost.

    The clock of a sketch is often as coarse as its period: at 800 Hz ``millis()`` advances by 1 or 2 ms.
    """

    period_s: float
    longest_s: float

    @classmethod
    def of(cls, steps_s: Array) -> Self:
        """The pace of a stream with steps ``steps_s`` (n,) between samples, n at least 1.

        Some samples may have been lost.
        """
        usual_s = steps_s[steps_s <= HOLE_STEPS * float(np.median(steps_s))]
        is_coarse = bool(np.all(np.abs(usual_s - TICK_S * np.rint(usual_s / TICK_S)) < ROUNDING_S))
        pace = cls._at(float(usual_s.mean()), is_coarse)
        return cls._at(float(usual_s.sum() / pace.samples(usual_s).sum()), is_coarse)

    @classmethod
    def _at(cls, period_s: float, is_coarse: bool) -> Self:
        ticks = math.ceil(period_s / TICK_S - EVEN) if is_coarse else 0
        return cls(period_s, max(TWO_PERIODS * period_s, TICK_S * ticks + ROUNDING_S))

    def samples(self, steps_s: Array) -> Integers:
        """How many samples (n,) the device took in each step ``steps_s`` (n,), at least one."""
        taken = np.maximum(np.rint(steps_s / self.period_s), 2.0)
        return np.where(steps_s <= self.longest_s, 1.0, taken).astype(np.int64)
