"""The common base of estimators that are a filter of the readings."""

from __future__ import annotations

import numpy as np

from smartshoe.arrays import Array, Mask
from smartshoe.calibration._compensator import Compensator
from smartshoe.calibration._filter import ForceFilter
from smartshoe.calibration.estimators._estimate import Estimator, ForceEstimate, ForceRun
from smartshoe.calibration.estimators._reading_noise import reading_noise_sd

MEMORY = 4096  # samples of an impulse response; only the filter's slow tail is longer


class FilterRun(ForceRun):
    """A running filter, beginning in its initial state; every force has the same error bar."""

    def __init__(self, filter_: ForceFilter, sd_n: float) -> None:
        self._filter, self._sd_n = filter_, sd_n

    def push(self, readings: Array, missing: Mask) -> ForceEstimate:
        """The filtered readings; a missing reading repeats the last one."""
        force_n = self._filter.push(np.where(missing, np.nan, readings))
        return ForceEstimate(force_n, np.full(force_n.size, self._sd_n))


class Filtered(Estimator):
    """An estimator made of a `ForceFilter`; its error bar is the reading's white noise through the linear part."""

    def force_filter(self) -> ForceFilter:
        """The filter in its initial state: the paper's, with the calibration's coefficients, ignoring any effects."""
        c = self.calibration
        return Compensator(
            c.a1, c.b0, c.b1, offset=c.offset, sample_rate_hz=self.sample_rate_hz, reading_unit=c.reading_unit
        )

    def begin(self, readings: Array, missing: Mask) -> ForceRun:
        """A run of the filter; the reading's noise is estimated from these readings."""
        noise_sd = reading_noise_sd(readings, missing) if self.noise_sd is None else self.noise_sd
        return FilterRun(self.force_filter(), _noise_gain_n(Filtered.force_filter(self)) * noise_sd)


def _noise_gain_n(filter_: ForceFilter) -> float:
    """Standard deviation of the force in N for white noise of sd 1 on the reading: the norm of the impulse response."""
    impulse = np.zeros(MEMORY)
    at_rest = filter_.apply(impulse)
    impulse[1] = 1.0
    return float(np.linalg.norm(filter_.apply(impulse) - at_rest))
