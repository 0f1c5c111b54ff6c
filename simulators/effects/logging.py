"""Logger: what happens to the reading's channel between the sensor's pin and the file.

*Clocks*: the reading's own transport delay, skew and jitter against the load's channel. *Analogue*: mains hum, with a
third of it in the third harmonic, and a coarse quantisation grid. *Digital*: spikes, held samples and dropouts in runs.
Percentages are of the sensor's range.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from pydantic import Field

from simulators.effects.bounds import STRICT_KEYS, Finite, NotNegative, Positive, Share
from smartshoe.arrays import Array, Mask


@dataclass(frozen=True, slots=True)
class ReadingChannel:
    """The reading's channel of a logger; every fault is off by default.

    The reading logged at t is the sensor's at t (1 + ``skew``) - ``delay_s`` + jitter. ``lattice_percent`` is the step
    to which the reading is rounded. ``spike_share`` of the samples are off by about ``spike_percent`` in either
    direction. In a ``held_share`` of the samples the last one is repeated, in runs of about ``held_run``. In a
    ``dropout_share`` the reading falls to the unloaded one, or is missing with ``dropout_missing``.
    """

    __pydantic_config__ = STRICT_KEYS
    delay_s: Annotated[float, Field(ge=-1, le=5)] = 0.0
    skew: Annotated[float, Field(gt=-0.1, lt=0.1)] = 0.0
    jitter_s: NotNegative = 0.0
    hum_percent: NotNegative = 0.0
    hum_hz: Positive = 50.0
    hum_third_harmonic: Finite = 0.15
    lattice_percent: NotNegative = 0.0
    spike_share: Share = 0.0
    spike_percent: NotNegative = 20.0
    held_share: Share = 0.0
    held_run: Annotated[float, Field(ge=1)] = 3.0
    dropout_share: Share = 0.0
    dropout_run: Annotated[float, Field(ge=1)] = 4.0
    dropout_missing: bool = False

    def times(self, true_s: Array, rng: np.random.Generator) -> Array:
        """The true times (n,) at which the sensor was read, from the times at which the load was."""
        if self.delay_s == 0 and self.skew == 0 and self.jitter_s == 0:
            return true_s
        read_s = true_s * (1.0 + self.skew) - self.delay_s
        return read_s + self.jitter_s * rng.standard_normal(true_s.size) if self.jitter_s > 0 else read_s

    def hum(self, true_s: Array, span_v: float, rng: np.random.Generator) -> Array:
        """Mains hum (n,) in volt; its phase is drawn."""
        phase = 2.0 * np.pi * (self.hum_hz * true_s + rng.uniform())
        wave = np.sin(phase) + self.hum_third_harmonic * np.sin(3.0 * phase + 1.0)
        return 0.01 * self.hum_percent * span_v * wave

    def logged(self, voltage_v: Array, unloaded_v: float, span_v: float, rng: np.random.Generator) -> Array:
        """The channel (n,) as written to the file, NaN where missing, from the converter's voltage."""
        v = voltage_v
        if self.lattice_percent > 0:
            step_v = 0.01 * self.lattice_percent * span_v
            v = unloaded_v + step_v * np.rint((v - unloaded_v) / step_v)
        if self.spike_share > 0:
            struck = rng.random(v.size) < self.spike_share
            size = rng.choice([-1.0, 1.0], v.size) * rng.uniform(0.7, 1.3, v.size)
            v = v + np.where(struck, 0.01 * self.spike_percent * span_v * size, 0.0)
        if self.held_share > 0:
            held = runs(v.size, self.held_share, self.held_run, rng)
            held[:1] = False
            v = v[np.maximum.accumulate(np.where(held, 0, np.arange(v.size)))]
        if self.dropout_share > 0:
            gone = runs(v.size, self.dropout_share, self.dropout_run, rng)
            v = np.where(gone, np.nan if self.dropout_missing else unloaded_v, v)
        return v


def runs(size: int, share: float, mean_run: float, rng: np.random.Generator) -> Mask:
    """Mask (n,) of runs of geometric length, covering ``share`` of the samples on average.

    The random numbers that place a run do not depend on ``share``: a larger one adds runs and moves none.
    """
    starts = rng.random(size) < min(share / mean_run, 1.0)
    lengths = rng.geometric(1.0 / mean_run, size)
    reach = np.maximum.accumulate(np.where(starts, np.arange(size) + lengths, 0))
    return np.arange(size) < reach
