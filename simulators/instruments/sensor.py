"""The First Sensor HDI gauge pressure sensor: unidirectional, amplified, 0.5 to 4.5 V on a 5 V supply.

*Left out:* the supply's ripple (the output is ratiometric and so is the converter's reference), non-linearity and
thermal gain within the data sheet's 0.1 % typical, the sensor's own update clock.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from simulators.effects.outside import SensorOddities
from simulators.effects.sensing import Curve, Limit, Noise, OutputDrift
from smartshoe.arrays import Array
from smartshoe.devices import ChannelDescription, Sensor
from smartshoe.units import VOLT

LOW_V, SPAN_V = 0.5, 4.0


@dataclass(frozen=True, slots=True)
class HdiParameters:
    """A sensor: noise, margins and errors are fractions of ``range_pa`` (noise: standard deviation per sample).

    ``bidirectional`` is the kind whose range extends as far below zero gauge pressure as above, with zero at 2.5 V.
    ``second_lag_s`` is a slow port: two further poles, at this time constant and at a quarter of it.
    """

    range_pa: float = 20_000.0
    noise_fraction: float = 0.0005
    lag_s: float = 0.001
    zero_offset_pa: float = 0.0
    zero_drift_pa_per_s: float = 0.0
    gain_error_fraction: float = 0.0
    over_range_fraction: float = 0.01
    proof_pressure_pa: float = 1e5
    bidirectional: bool = False
    second_lag_s: float = 0.0
    curve: Curve = field(default_factory=Curve)
    drift: OutputDrift = field(default_factory=OutputDrift)
    limit: Limit = field(default_factory=Limit)
    noise: Noise = field(default_factory=Noise)
    wander: SensorOddities = field(default_factory=SensorOddities)

    @property
    def unloaded_v(self) -> float:
        """The output in volt at zero gauge pressure."""
        return LOW_V + 0.5 * SPAN_V if self.bidirectional else LOW_V

    @property
    def span_v(self) -> float:
        """Volts from the output at zero gauge pressure to that at the end of the range."""
        return 0.5 * SPAN_V if self.bidirectional else SPAN_V

    @property
    def is_plain(self) -> bool:
        """Whether there are no effects besides lag, membrane, gain, zero and white noise."""
        effects = (self.curve, self.drift, self.limit, self.noise, self.wander)
        return self.second_lag_s == 0 and not any(effect.is_on for effect in effects)


class SimulatedHdiSensor(Sensor):
    """A sensor with lag, zero, gain and noise, whose membrane and output stage are both limited.

    The membrane does not go below zero gauge pressure; the output stage clips at ``over_range_fraction`` beyond either
    end of the range, noise included, so that a saturated reading repeats exactly.
    """

    def __init__(self, parameters: HdiParameters, rng: np.random.Generator) -> None:
        self.parameters = parameters
        self._rng = rng
        # Separate random streams, so that switching one effect on does not change the others' numbers.
        self._noise_rng, self._wander_rng = rng.spawn(2)
        self.reset()

    def reset(self) -> None:
        """Reset the lag's state and the time since the start; the noise continues."""
        self._lagged_pa = 0.0
        self._last_pa = 0.0
        self._time_s = 0.0
        self._slow = np.zeros((2, 2))
        self.white_v = np.zeros(0)

    @property
    def range_pa(self) -> tuple[float, float]:
        """From zero gauge pressure, or for a bidirectional sensor from minus the range, to the range."""
        p = self.parameters
        return -p.range_pa if p.bidirectional else 0.0, p.range_pa

    @property
    def proof_pressure_pa(self) -> float:
        """The highest pressure in Pa that does not damage the sensor."""
        return self.parameters.proof_pressure_pa

    def describe(self) -> ChannelDescription:
        """The reading's channel, in volt."""
        return ChannelDescription("reading", "voltage", VOLT, (LOW_V, LOW_V + SPAN_V))

    def read(self, pressure_pa: Array, sample_rate_hz: float, warmer_k: Array | float = 0.0) -> Array:
        """The reading (n,) in volt for the pressure (n,) in Pa; the lag's memory continues from the last call.

        ``warmer_k`` (n,) is the room's temperature above that at the session's start. Afterwards ``white_v`` (n,) holds
        the part of the reading that is white noise, which must not be averaged where the reading is interpolated.
        """
        p = self.parameters
        pressure = np.asarray(pressure_pa, dtype=float)
        if pressure.size == 0:
            return np.zeros(0)
        lagged = self._lag(pressure, sample_rate_hz)
        time_s = self._time_s + np.arange(1, pressure.size + 1) / sample_rate_hz
        self._time_s = float(time_s[-1])
        felt = lagged if p.bidirectional else np.maximum(lagged, 0.0)
        if p.is_plain:
            share = felt * ((1.0 + p.gain_error_fraction) / p.range_pa)
        else:
            share = self._disturbed(felt / p.range_pa, time_s, sample_rate_hz, warmer_k)
        share += (p.zero_offset_pa + p.zero_drift_pa_per_s * time_s) / p.range_pa
        white = p.noise_fraction * self._rng.standard_normal(pressure.size) if p.noise_fraction > 0 else 0.0
        if p.noise.growing_percent > 0:
            white = white + p.noise.growing(share, self._noise_rng)
        share += white
        noisy = share.copy()
        if not p.is_plain:
            share = p.limit(share)
        lowest = -1.0 - p.over_range_fraction if p.bidirectional else -p.over_range_fraction
        np.clip(share, lowest, 1.0 + p.over_range_fraction, out=share)
        self.white_v = np.where(share == noisy, p.span_v * white, 0.0)
        return np.asarray(p.unloaded_v + p.span_v * share)

    def _lag(self, pressure: Array, sample_rate_hz: float) -> Array:
        """The pressure through the sensor's lag and its slow port: exact where it is linear within a step."""
        p = self.parameters
        lagged = pressure
        if p.lag_s > 0:
            lagged, self._lagged_pa = _first_order(pressure, sample_rate_hz * p.lag_s, self._lagged_pa, self._last_pa)
        else:
            self._lagged_pa = float(pressure[-1])
        self._last_pa = float(pressure[-1])
        if p.second_lag_s > 0:
            for number, time_s in enumerate((p.second_lag_s, 0.25 * p.second_lag_s)):
                before, last = self._slow[number]
                self._slow[number, 1] = lagged[-1]
                lagged, self._slow[number, 0] = _first_order(lagged, sample_rate_hz * time_s, before, last)
        return lagged

    def _disturbed(self, share: Array, time_s: Array, rate_hz: float, warmer_k: Array | float) -> Array:
        """The reading (n,) as a share of the range, with all effects except offset, drift and white noise."""
        p = self.parameters
        share = p.curve(share) * (1.0 + p.gain_error_fraction)
        share = share * p.drift.gain(time_s, warmer_k) * p.wander.gain(time_s)
        share += p.drift.zero(time_s, warmer_k)
        share += p.noise.coloured(share.size, rate_hz, self._noise_rng)
        if p.wander.is_on:
            share += p.wander.zero(time_s, self._wander_rng)
        return share

    def to_pressure_pa(self, reading_v: Array) -> Array:
        """Pressure (n,) in Pa from the reading (n,) in volt, by the nominal characteristic."""
        p = self.parameters
        return (np.asarray(reading_v, dtype=float) - p.unloaded_v) * (p.range_pa / p.span_v)


def _first_order(signal: Array, steps: float, output: float, last: float) -> tuple[Array, float]:
    """The signal through a lag of ``steps`` samples, linear within a step, and the final output.

    It starts from the lag's ``output`` and the ``last`` input.
    """
    from smartshoe.kernels.linear_filter import linear_filter

    z = 1.0 / steps
    keep, mean = np.exp(-z), -np.expm1(-z) / z
    start = [keep * output + (mean - keep) * last]
    lagged, _ = linear_filter([1.0 - mean, mean - keep], [1.0, -keep], signal, start)
    return lagged, float(lagged[-1])
