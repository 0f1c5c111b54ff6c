"""The estimator ``static``: the static gain, with which the paper compares."""

from __future__ import annotations

import numpy as np

from smartshoe.arrays import Array, Mask
from smartshoe.calibration.estimators._estimate import Estimator, ForceEstimate, ForceRun
from smartshoe.calibration.estimators._reading_noise import reading_noise_sd


class StaticGain(Estimator):
    """Force = b1/a1 (reading - offset)."""

    def begin(self, readings: Array, missing: Mask) -> ForceRun:
        """A run that applies the gain; the reading's noise is estimated from these readings."""
        noise_sd = reading_noise_sd(readings, missing) if self.noise_sd is None else self.noise_sd
        return _Gain(self.calibration.b1 / self.calibration.a1, self.calibration.offset, noise_sd)


class _Gain(ForceRun):
    def __init__(self, gain: float, offset: float, noise_sd: float) -> None:
        self._gain, self._offset, self._sd_n = gain, offset, abs(gain) * noise_sd
        self._last: float | None = None

    def push(self, readings: Array, missing: Mask) -> ForceEstimate:
        """Forces of the readings; a missing one repeats the last, or takes the first one present."""
        if not missing.all():
            held = np.maximum.accumulate(np.where(missing, -1, np.arange(readings.size)))
            first = float(readings[np.argmin(missing)]) if self._last is None else self._last
            known = np.where(held < 0, first, readings[held])
            self._last = float(known[-1])
        else:
            known = np.full(readings.size, self._offset if self._last is None else self._last)
        return ForceEstimate(self._gain * (known - self._offset), np.full(readings.size, self._sd_n))


ESTIMATOR = StaticGain
