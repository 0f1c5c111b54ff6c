"""Contact: the part of the load that reaches the tube. Each effect acts on the load at the fine step.

*Contact area*: asperities that share a growing load, F0 (1 - exp(-F/F0)) (Greenwood and Williamson's exponential
heights). *Dead band*: windings of the coil that the insole reaches one after another, gaps spread evenly about a mean.
*Direction*: friction of the insole against the tube, a factor exp(-mu) or exp(mu) of the load (a capstan's), which
changes gradually after a reversal (pre-sliding); the change takes longer the larger the load. *Rate*: a visco-elastic
cover that transmits more of a fast load, in proportion to |F'|^0.9.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated

import numpy as np
from pydantic import Field

from simulators.effects.bounds import STRICT_KEYS, NotNegative, Positive
from smartshoe.arrays import Array

FAST_N_PER_S = 800.0  # the paper's fastest triangle
RATE_EXPONENT = 0.9


@dataclass(frozen=True, slots=True)
class ContactParameters:
    """The contact between the plate and the tube; every effect is off by default.

    ``saturation`` is full-scale load over F0. ``gap_n`` is the mean load at which the windings touch, spread evenly by
    the share ``gap_spread`` of it. ``direction_gain`` is the share of the gain that is lost while the load falls, once
    it has reversed by a few ``direction_turn_n`` (at half of full scale). ``rate_gain`` is added to the gain at 800
    N/s, loading or unloading, seen through ``rate_time_constant_s``.
    """

    __pydantic_config__ = STRICT_KEYS
    saturation: Annotated[float, Field(ge=0, le=5)] = 0.0
    gap_n: NotNegative = 0.0
    gap_spread: Annotated[float, Field(gt=0, le=1)] = 0.4
    direction_gain: Annotated[float, Field(gt=-0.6, lt=0.6)] = 0.0
    direction_turn_n: Positive = 5.0
    rate_gain: Annotated[float, Field(gt=-0.9, lt=2)] = 0.0
    rate_time_constant_s: Positive = 0.02


@dataclass
class ContactState:
    """The contact's memory between calls."""

    direction: float = 1.0
    last_n: float = 0.0
    rate: float = 0.0
    turned: Array = field(default_factory=lambda: np.zeros(0))


def through_contact(
    contact: ContactParameters, load_n: Array, rate_hz: float, full_scale_n: float, state: ContactState
) -> Array:
    """The load (n,) in N that reaches the tube, from the plate's (n,) at ``rate_hz``; updates ``state``."""
    acting = load_n
    if contact.gap_n > 0:
        low, high = contact.gap_n * (1.0 - contact.gap_spread), contact.gap_n * (1.0 + contact.gap_spread)
        within = np.clip(load_n, low, high) - low
        acting = within**2 / (2.0 * (high - low)) + np.maximum(load_n - high, 0.0)
    if contact.saturation > 0:
        limit_n = full_scale_n / contact.saturation
        acting = np.where(acting > 0, -limit_n * np.expm1(-acting / limit_n), acting)
    if contact.direction_gain != 0 or contact.rate_gain != 0:
        step_n = np.diff(load_n, prepend=state.last_n)
        gain = np.ones(load_n.size)
        if contact.direction_gain != 0:
            from simulators.effects.memory import follow

            sense = np.empty(load_n.size)
            slip_n = contact.direction_turn_n * (0.25 + 1.5 * np.maximum(load_n, 0.0) / full_scale_n)
            follow(step_n, slip_n, state.direction, sense)
            state.direction = float(sense[-1]) if sense.size else state.direction
            gain *= (1.0 - contact.direction_gain) ** (0.5 * (1.0 - sense))
        if contact.rate_gain != 0:
            from scipy.signal import lfilter

            share = np.abs(step_n) * (rate_hz / FAST_N_PER_S)
            keep = np.exp(-1.0 / (rate_hz * contact.rate_time_constant_s))
            seen, _ = lfilter([1.0 - keep], [1.0, -keep], share**RATE_EXPONENT, zi=[keep * state.rate])
            state.rate = float(seen[-1]) if seen.size else state.rate
            gain *= 1.0 + contact.rate_gain * seen
        acting = acting * gain
    if load_n.size:
        state.last_n = float(load_n[-1])
    return acting
