"""The unit's surroundings: the room's temperature, logged beside the reading, and a neighbour with its own load."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from pydantic import Field

from simulators.effects.bounds import STRICT_KEYS, Finite, NotNegative, Positive
from smartshoe.arrays import Array


@dataclass(frozen=True, slots=True)
class Room:
    """Temperature at the sensor above the session's start: a drift, a warming that settles, and a slow swing."""

    __pydantic_config__ = STRICT_KEYS
    logged: bool = False
    start_c: Finite = 23.0
    drift_k_per_s: Finite = 0.0
    warming_k: Finite = 0.0
    warming_time_constant_s: Positive = 120.0
    swing_k: NotNegative = 0.0
    swing_period_s: Positive = 97.0
    thermometer_noise_k: NotNegative = 0.02

    def warmer_k(self, time_s: Array) -> Array:
        """Temperature (n,) in K above that at the start."""
        if not (self.drift_k_per_s or self.warming_k or self.swing_k):
            return np.zeros(time_s.size)
        swing = self.swing_k * np.sin(2.0 * np.pi * time_s / self.swing_period_s)
        settled = -self.warming_k * np.expm1(-time_s / self.warming_time_constant_s)
        return np.asarray(self.drift_k_per_s * time_s + settled + swing)


@dataclass(frozen=True, slots=True)
class NeighbourUnit:
    """A second unit whose load is independent of the machine's, logged as ``neighbour``.

    It is pressed with random strength about every ``period_s``, at most to ``highest_mbar``. ``cross_talk`` of its
    pressure adds to the sensor's, seen through ``lag_s``, and only the part above ``from_share`` of the highest.
    """

    __pydantic_config__ = STRICT_KEYS
    logged: bool = False
    cross_talk: Finite = 0.0
    highest_mbar: Positive = 60.0
    period_s: Positive = 4.0
    noise_mbar: NotNegative = 0.05
    lag_s: NotNegative = 0.0
    from_share: Annotated[float, Field(ge=0, lt=1)] = 0.0

    def added_pa(self, neighbour_pa: Array, rate_hz: float) -> Array:
        """Pressure (n,) in Pa that the neighbour's pressure (n,) at ``rate_hz`` adds to the sensor's own."""
        felt = neighbour_pa
        if self.from_share > 0:
            felt = np.maximum(felt - 100.0 * self.highest_mbar * self.from_share, 0.0)
        if self.lag_s > 0:
            from scipy.signal import lfilter

            keep = np.exp(-1.0 / (rate_hz * self.lag_s))
            felt = np.asarray(lfilter([1.0 - keep], [1.0, -keep], felt))
        return self.cross_talk * felt

    def pressure_pa(self, time_s: Array, rng: np.random.Generator) -> Array:
        """Pressure (n,) in Pa: raised cosines between random heights at random times."""
        count = int(float(time_s[-1]) / self.period_s * 2 + 20) if time_s.size else 2
        at_s = np.concatenate([[0.0], np.cumsum(self.period_s * rng.uniform(0.5, 1.5, count))])
        height = rng.uniform(0.0, 1.0, count + 1) * (np.arange(count + 1) % 2)
        place = np.clip(np.searchsorted(at_s, time_s, side="right") - 1, 0, count - 1)
        share = (time_s - at_s[place]) / (at_s[place + 1] - at_s[place])
        blend = 0.5 - 0.5 * np.cos(np.pi * np.clip(share, 0.0, 1.0))
        share = height[place] + (height[place + 1] - height[place]) * blend
        return np.asarray(100.0 * self.highest_mbar * share / max(float(share.max(initial=0.0)), 1e-9))
