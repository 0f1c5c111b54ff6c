"""The First Sensor HDI gauge pressure sensor: unidirectional, amplified, 0.5 to 4.5 V on a 5 V supply.

*Left out:* the supply's ripple (the output is ratiometric and so is the converter's reference), non-linearity and
thermal gain within the data sheet's 0.1 % typical, the sensor's own update clock.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from smartshoe.devices.base import ChannelDescription, Sensor
from smartshoe.units import VOLT

Array = NDArray[np.float64]

LOW_V, SPAN_V = 0.5, 4.0


@dataclass(frozen=True, slots=True)
class HdiParameters:
    """A sensor: noise, margins and errors are fractions of ``range_pa`` (noise: standard deviation a sample)."""

    range_pa: float = 20_000.0
    noise_fraction: float = 0.0005
    lag_s: float = 0.001
    zero_offset_pa: float = 0.0
    zero_drift_pa_per_s: float = 0.0
    gain_error_fraction: float = 0.0
    over_range_fraction: float = 0.01
    proof_pressure_pa: float = 1e5
    burst_pressure_pa: float = 1.5e5


class SimulatedHdiSensor(Sensor):
    """A sensor with lag, zero, gain and noise, whose membrane and output stage both have ends.

    The membrane does not go below zero gauge pressure; the output stage clips at ``over_range_fraction`` beyond
    either end of the range, noise included, so that a saturated reading repeats exactly.
    """

    def __init__(self, parameters: HdiParameters, rng: np.random.Generator) -> None:
        self.parameters = parameters
        self._rng = rng
        self.reset()

    def reset(self) -> None:
        """Forget the past: the lag's state and the time since the start (noise goes on)."""
        self._lagged_pa = 0.0
        self._last_pa = 0.0
        self._time_s = 0.0

    @property
    def range_pa(self) -> tuple[float, float]:
        """From zero gauge pressure to the range."""
        return 0.0, self.parameters.range_pa

    @property
    def proof_pressure_pa(self) -> float:
        """The pressure in Pa that it stands without harm."""
        return self.parameters.proof_pressure_pa

    def describe(self) -> ChannelDescription:
        """The reading in volt."""
        return ChannelDescription("reading", "voltage", VOLT, (LOW_V, LOW_V + SPAN_V))

    def read(self, pressure_pa: Array, sample_rate_hz: float) -> Array:
        """The reading (n,) in volt for the pressure (n,) in Pa; the lag's memory carries on."""
        from scipy.signal import lfilter

        p = self.parameters
        pressure = np.asarray(pressure_pa, dtype=float)
        if pressure.size == 0:
            return np.zeros(0)
        if p.lag_s > 0:  # exact for a pressure that is linear within a step, as the bladder's is
            z = 1.0 / (sample_rate_hz * p.lag_s)
            keep, mean = np.exp(-z), -np.expm1(-z) / z
            start = [keep * self._lagged_pa + (mean - keep) * self._last_pa]
            lagged, _ = lfilter([1.0 - mean, mean - keep], [1.0, -keep], pressure, zi=start)
        else:
            lagged = pressure
        self._lagged_pa, self._last_pa = float(lagged[-1]), float(pressure[-1])
        time_s = self._time_s + np.arange(1, pressure.size + 1) / sample_rate_hz
        self._time_s = float(time_s[-1])
        share = np.maximum(lagged, 0.0) * ((1.0 + p.gain_error_fraction) / p.range_pa)
        share += (p.zero_offset_pa + p.zero_drift_pa_per_s * time_s) / p.range_pa
        if p.noise_fraction > 0:
            share += p.noise_fraction * self._rng.standard_normal(pressure.size)
        np.clip(share, -p.over_range_fraction, 1.0 + p.over_range_fraction, out=share)
        return np.asarray(LOW_V + SPAN_V * share)

    def to_pressure_pa(self, reading_v: Array) -> Array:
        """Pressure (n,) in Pa by the nominal characteristic."""
        return (np.asarray(reading_v, dtype=float) - LOW_V) * (self.parameters.range_pa / SPAN_V)
