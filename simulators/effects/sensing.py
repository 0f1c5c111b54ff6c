"""Sensor: curve, slow package, drift, warm-up, temperature, limits; by the session's clock, in percent of the range.

*Curve*: a Wheatstone bridge's (1 + q) y/(1 + q y), then an amplifier that compresses about mid range, 1/2 + tanh(kappa
(y - 1/2))/kappa. *Drift*: straight lines in time (the zero's is among the sensor's own options) and in the room's
temperature. *Warm-up*: die and package settle with two time constants. *Limit*: a hard stop, or a soft one, y/(1 +
(y/L)^n)^(1/n).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from pydantic import Field

from simulators.effects.bounds import STRICT_KEYS, Finite, NotNegative, Positive
from smartshoe.arrays import Array

DIE_SHARE, DIE_FASTER = 0.35, 4.0  # the die's share of the warm-up, and how many times faster it settles


@dataclass(frozen=True, slots=True)
class Curve:
    """The sensor's curve: ``bridge`` q, if positive, raises the middle; ``compression`` kappa flattens both ends."""

    __pydantic_config__ = STRICT_KEYS
    bridge: Annotated[float, Field(gt=-0.9, lt=10)] = 0.0
    compression: Annotated[float, Field(ge=0, le=6)] = 0.0

    @property
    def is_on(self) -> bool:
        """Whether the curve is not straight."""
        return self.bridge != 0 or self.compression > 0

    def __call__(self, share: Array) -> Array:
        """The reading's share of the range (n,) from the pressure's; 0 and 1 are unchanged."""
        if self.bridge != 0:
            share = (1.0 + self.bridge) * share / np.maximum(1.0 + self.bridge * share, 0.05)
        if self.compression > 0:
            end = np.tanh(0.5 * self.compression)
            share = 0.5 + 0.5 * np.tanh(self.compression * (share - 0.5)) / end
        return share


@dataclass(frozen=True, slots=True)
class OutputDrift:
    """Gain that grows by ``gain_percent_per_s``, and the effect of the room's temperature on gain and zero.

    ``warm_up_percent`` of the range is added as the sensor warms up, within about ``warm_up_time_constant_s``.
    """

    __pydantic_config__ = STRICT_KEYS
    gain_percent_per_s: Finite = 0.0
    gain_percent_per_k: Finite = 0.0
    zero_percent_per_k: Finite = 0.0
    warm_up_percent: Finite = 0.0
    warm_up_time_constant_s: Positive = 60.0

    @property
    def is_on(self) -> bool:
        """Whether anything drifts."""
        return any((self.gain_percent_per_s, self.gain_percent_per_k, self.zero_percent_per_k, self.warm_up_percent))

    def gain(self, time_s: Array, warmer_k: Array | float) -> Array:
        """Factor (n,) by which the reading is multiplied."""
        by_time = np.maximum(1.0 + 0.01 * self.gain_percent_per_s * time_s, 0.0)
        return by_time * np.maximum(1.0 + 0.01 * self.gain_percent_per_k * warmer_k, 0.0)

    def zero(self, time_s: Array, warmer_k: Array | float) -> Array:
        """Offset (n,) of the reading as a fraction of the range."""
        slow = np.expm1(-time_s / self.warm_up_time_constant_s)
        fast = np.expm1(-time_s * (DIE_FASTER / self.warm_up_time_constant_s))
        settled = -(1.0 - DIE_SHARE) * slow - DIE_SHARE * fast
        return 0.01 * (self.zero_percent_per_k * warmer_k + self.warm_up_percent * settled)


@dataclass(frozen=True, slots=True)
class Limit:
    """The reading is limited to ``highest_percent`` of the range, and with ``no_negative`` to at least zero.

    ``softness`` 0 is a hard stop, otherwise the knee's width as a share of the limit.
    """

    __pydantic_config__ = STRICT_KEYS
    highest_percent: Annotated[float, Field(gt=1, le=1e6)] = 1e6
    softness: Annotated[float, Field(ge=0, le=0.5)] = 0.0
    no_negative: bool = False

    @property
    def is_on(self) -> bool:
        """Whether there is any limit."""
        return self.highest_percent < 1e6 or self.no_negative

    def __call__(self, share: Array) -> Array:
        """The limited reading (n,) as a share of the range."""
        highest = 0.01 * self.highest_percent
        if self.highest_percent < 1e6:
            if self.softness > 0:
                power = 1.0 / self.softness
                share = share / (1.0 + (np.maximum(share, 0.0) / highest) ** power) ** (1.0 / power)
            else:
                share = np.minimum(share, highest)
        return np.maximum(share, 0.0) if self.no_negative else share


@dataclass(frozen=True, slots=True)
class Noise:
    """Noise other than white; standard deviations in percent of the range.

    ``coloured_percent`` is a first-order process of ``coloured_time_constant_s``; ``growing_percent`` is white noise
    proportional to the reading, stated at full range.
    """

    __pydantic_config__ = STRICT_KEYS
    coloured_percent: NotNegative = 0.0
    coloured_time_constant_s: Positive = 0.5
    growing_percent: NotNegative = 0.0

    @property
    def is_on(self) -> bool:
        """Whether there is any such noise."""
        return self.coloured_percent > 0 or self.growing_percent > 0

    def coloured(self, size: int, rate_hz: float, rng: np.random.Generator) -> Array | float:
        """The first-order process (n,) as a fraction of the range, stationary from the start."""
        if self.coloured_percent == 0 or size == 0:
            return 0.0
        from scipy.signal import lfilter

        keep = np.exp(-1.0 / (rate_hz * self.coloured_time_constant_s))
        driven = np.sqrt(1.0 - keep * keep) * rng.standard_normal(size)
        driven[0] = rng.standard_normal()
        return 0.01 * self.coloured_percent * np.asarray(lfilter([1.0], [1.0, -keep], driven))

    def growing(self, share: Array, rng: np.random.Generator) -> Array:
        """Noise (n,) as a fraction of the range, added to the reading's share (n,)."""
        return 0.01 * self.growing_percent * np.abs(share) * rng.standard_normal(share.size)
