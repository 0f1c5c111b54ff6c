"""Estimators that are a filter: the static gain, the paper's phase lead, the inverse of an extended model."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from smartshoe.calibration.compensator import Compensator
from smartshoe.calibration.estimators.estimate import Array, Estimator, Mask
from smartshoe.calibration.estimators.reading_noise import reading_noise_sd
from smartshoe.calibration.filter import ForceFilter
from smartshoe.errors import UsageError

if TYPE_CHECKING:
    from smartshoe.calibration.calibration import Calibration

MEMORY = 4096  # samples of an impulse response; what the filter still passes on of older noise is its slow tail


class Filtered(Estimator):
    """A `ForceFilter`; its error bar is the reading's white noise through the calibration's linear part."""

    def __init__(
        self, name: str, calibration: Calibration, filter_: ForceFilter, noise_gain_n: float, noise_sd: float | None
    ) -> None:
        super().__init__(calibration)
        self.name, self._filter, self._noise_gain_n, self._noise_sd = name, filter_, noise_gain_n, noise_sd

    def _estimate(self, readings: Array, missing: Mask) -> tuple[Array, Array]:
        noise_sd = reading_noise_sd(readings, missing) if self._noise_sd is None else self._noise_sd
        force_n = self._filter.apply(np.where(missing, np.nan, readings))
        return force_n, np.full(readings.size, self._noise_gain_n * noise_sd)


def linear_part(calibration: Calibration, sample_rate_hz: float) -> Compensator:
    """The paper's filter of the calibration's coefficients, whatever effects it has beside."""
    c = calibration
    return Compensator(c.a1, c.b0, c.b1, offset=c.offset, sample_rate_hz=sample_rate_hz, reading_unit=c.reading_unit)


def lead(calibration: Calibration, sample_rate_hz: float, noise_sd: float | None) -> Estimator:
    """Chinimilli 2016, (13)."""
    filter_ = linear_part(calibration, sample_rate_hz)
    return Filtered("lead", calibration, filter_, _noise_gain_n(filter_), noise_sd)


def inverse(calibration: Calibration, sample_rate_hz: float, noise_sd: float | None) -> Estimator:
    """The inverse of the extended model; raises `UsageError` where the calibration has none."""
    if calibration.extended is None:
        raise UsageError(
            f"the calibration of {calibration.unit or 'this unit'} has no extended model to invert: make one with"
            " smartshoe diagnose --calibration, or use the estimator 'lead'"
        )
    gain = _noise_gain_n(linear_part(calibration, sample_rate_hz))
    return Filtered("inverse", calibration, calibration.compensator(sample_rate_hz), gain, noise_sd)


class StaticGain(Estimator):
    """Force = b1/a1 (reading - offset): what the paper compares with."""

    name = "static"

    def __init__(self, calibration: Calibration, noise_sd: float | None) -> None:
        super().__init__(calibration)
        self._noise_sd = noise_sd

    def _estimate(self, readings: Array, missing: Mask) -> tuple[Array, Array]:
        noise_sd = reading_noise_sd(readings, missing) if self._noise_sd is None else self._noise_sd
        gain = self.calibration.b1 / self.calibration.a1
        at = np.arange(readings.size)
        held = np.maximum.accumulate(np.where(missing, -1, at))
        force_n = gain * (readings[np.where(held < 0, int(np.argmin(missing)), held)] - self.calibration.offset)
        return force_n, np.full(readings.size, abs(gain) * noise_sd)


def _noise_gain_n(filter_: ForceFilter) -> float:
    """Standard deviation of the force in N for white noise of sd 1 on the reading: the impulse response's norm."""
    impulse = np.zeros(MEMORY)
    at_rest = filter_.apply(impulse)
    impulse[1] = 1.0
    return float(np.linalg.norm(filter_.apply(impulse) - at_rest))
