"""The National Instruments myRIO: 12 bit over 0-5 V, sampled by its own clock.

*Left out:* multiplexer cross talk, integral non-linearity below one step, an anti-aliasing filter (it has none).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from simulators.effects.logging import ReadingChannel
from smartshoe.arrays import Array

LARGEST_ERROR_V = 0.05  # absolute error of the 0-5 V inputs, myRIO-1900 specifications


@dataclass(frozen=True, slots=True)
class MyRioParameters:
    """Parameters of converter and clock.

    Both ``..._error_v`` are a channel's absolute error in volt, or "drawn": uniform within +-50 mV at construction. 0,
    the default, is a channel that was zeroed before the test. Load: ``load_full_scale_n`` spans the 5 V, with zero load
    at ``load_zero_v``, so that noise about zero is not clipped. The true time of sample k is clock_offset_s +
    (k/sample_rate_hz)(1 + clock_skew) + jitter; the log says k/sample_rate_hz. ``reading`` holds the faults of the
    sensor's channel alone.
    """

    sample_rate_hz: float = 100.0
    bits: int = 12
    full_scale_v: float = 5.0
    absolute_error_v: float | Literal["drawn"] = 0.0
    load_absolute_error_v: float | Literal["drawn"] = 0.0
    load_full_scale_n: float = 1000.0
    load_zero_v: float = 0.1
    clock_offset_s: float = 0.0
    clock_skew: float = 0.0
    jitter_s: float = 0.0
    reading: ReadingChannel = field(default_factory=ReadingChannel)

    @property
    def step_v(self) -> float:
        """One count: 1.221 mV."""
        return float(self.full_scale_v / 2**self.bits)

    @property
    def newton_per_volt(self) -> float:
        """Scale of the load channel in N per V."""
        return self.load_full_scale_n / self.full_scale_v


class SimulatedMyRio:
    """Samples voltages and loads at its own clock's ticks; absolute errors are drawn once, at construction."""

    def __init__(self, parameters: MyRioParameters, rng: np.random.Generator) -> None:
        self.parameters = parameters
        self._rng = rng
        self.error_v = self._drawn(parameters.absolute_error_v)
        self.load_error_v = self._drawn(parameters.load_absolute_error_v)

    def _drawn(self, error_v: float | str) -> float:
        return float(self._rng.uniform(-LARGEST_ERROR_V, LARGEST_ERROR_V)) if error_v == "drawn" else float(error_v)

    def ticks(self, duration_s: float) -> tuple[Array, Array]:
        """Logged times (n,) in s, and the true ones, of samples from 0 through ``duration_s``."""
        p = self.parameters
        logged_s = np.arange(int(np.floor(duration_s * p.sample_rate_hz + 1e-9)) + 1) / p.sample_rate_hz
        true_s = p.clock_offset_s + logged_s * (1.0 + p.clock_skew)
        if p.jitter_s > 0:
            true_s = true_s + p.jitter_s * self._rng.standard_normal(logged_s.size)
        return logged_s, true_s

    def convert(self, voltage_v: Array, error_v: float | None = None) -> Array:
        """The voltage (any shape) as logged: with the absolute error, quantised by the converter, within 0-5 V."""
        p = self.parameters
        counts = np.rint((voltage_v + (self.error_v if error_v is None else error_v)) / p.step_v)
        return np.clip(counts, 0, 2**p.bits - 1) * p.step_v

    def convert_load(self, load_n: Array) -> Array:
        """The load cell's analogue output for ``load_n`` (n,) in N, as logged, in volt."""
        return self.convert(self.parameters.load_zero_v + load_n / self.parameters.newton_per_volt, self.load_error_v)

    def to_load_n(self, voltage_v: Array) -> Array:
        """Load (n,) in N from the logged voltage (n,), by the nominal scale."""
        return (voltage_v - self.parameters.load_zero_v) * self.parameters.newton_per_volt


def sampled(time_s: Array, sample_rate_hz: float, signal: Array) -> Array:
    """``signal`` (m,), given at k/``sample_rate_hz``, at the times ``time_s`` (n,): exact on ticks, else linear."""
    place = time_s * sample_rate_hz
    nearest = np.rint(place)
    if np.all(np.abs(place - nearest) < 1e-6):
        return signal[np.clip(nearest.astype(np.intp), 0, signal.size - 1)]
    return np.interp(place, np.arange(signal.size), signal)
