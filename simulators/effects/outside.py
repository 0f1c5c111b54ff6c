"""Effects outside the catalogue: no block of a diagnosis has them, so that it must report them as unexplained.

Before the wall: a lightly damped mode between plate and tube (*resonance*), a tube that some cycles pinch
(*intermittent pinch*), a plate that seats differently in each cycle (*random seating*), a wall that snaps over and back
(*snap-through*). In the sensor: a *gain step*, a *slow sine* of gain, *telegraph noise*, *draughts* that cool or warm
the die at random moments and let it recover.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from pydantic import Field

from simulators.effects.bounds import STRICT_KEYS, Finite, NotNegative, Positive, Share
from smartshoe.arrays import Array, Index

CYCLE_BEGINS = 0.02  # of full scale: load at which a cycle begins


@dataclass(frozen=True, slots=True)
class Odd:
    """Effects of the unit outside the catalogue. Fractions are of full-scale load; ``seed`` draws the affected cycles.

    ``resonance`` is the share of the mode's own oscillation that reaches the tube. ``pinch`` of the load above
    ``pinch_from`` is lost in a ``pinch_share`` of the cycles. ``seating`` is the standard deviation of the gain from
    cycle to cycle. ``snap`` is the load that a snapped wall does not transmit, from ``snap_up`` until the load falls to
    ``snap_down``.
    """

    __pydantic_config__ = STRICT_KEYS
    resonance: Annotated[float, Field(ge=0, le=1)] = 0.0
    resonance_hz: Annotated[float, Field(gt=0.05, le=50)] = 2.0
    resonance_damping: Annotated[float, Field(gt=0, lt=1)] = 0.04
    pinch: Share = 0.0
    pinch_from: Share = 0.4
    pinch_share: Share = 0.4
    seating: Annotated[float, Field(ge=0, le=0.3)] = 0.0
    snap: Annotated[float, Field(ge=0, le=0.5)] = 0.0
    snap_up: Share = 0.6
    snap_down: Share = 0.3
    seed: int = 0


@dataclass
class OddState:
    """The memory of these effects between calls."""

    swing: Array
    cycle: int = 0
    in_cycle: bool = False
    snapped: bool = False


def fresh(session: int) -> OddState:
    """The state of a unit at rest in its ``session``-th use."""
    return OddState(np.zeros(2), cycle=10_000 * session)


def _cycles(load_n: Array, full_scale_n: float, state: OddState) -> Array:
    """The number (n,) of the load cycle of each sample; it increases where a load begins."""
    loaded = load_n > CYCLE_BEGINS * full_scale_n
    begins = loaded & ~np.concatenate([[state.in_cycle], loaded[:-1]])
    cycle = state.cycle + np.cumsum(begins)
    if load_n.size:
        state.cycle, state.in_cycle = int(cycle[-1]), bool(loaded[-1])
    return cycle


def _drawn(odd: Odd, cycle: Array, what: int, normal: bool) -> Array:
    """A random number (n,) per cycle: uniform on 0 to 1 or standard normal."""
    numbers, place = np.unique(cycle, return_inverse=True)
    draws = []
    for number in numbers:
        rng = np.random.default_rng([odd.seed, what, int(number)])
        draws.append(rng.standard_normal() if normal else rng.random())
    return np.array(draws)[place]


def strike(odd: Odd, load_n: Array, rate_hz: float, full_scale_n: float, state: OddState) -> Array:
    """The load (n,) in N after these effects, from the plate's (n,) at ``rate_hz``; updates ``state``."""
    acting = load_n
    if load_n.size == 0:
        return acting
    if odd.resonance > 0:
        from scipy.signal import lfilter

        # Bilinear second-order mode, prewarped at its own frequency; its oscillation is output minus input.
        w = np.tan(np.pi * odd.resonance_hz / rate_hz)
        z = odd.resonance_damping
        a = np.array([1 + 2 * z * w + w * w, 2 * (w * w - 1), 1 - 2 * z * w + w * w])
        b = np.array([w * w, 2 * w * w, w * w])
        moved, state.swing = lfilter(b / a[0], a / a[0], load_n, zi=state.swing)
        acting = acting + odd.resonance * (moved - load_n)
    if odd.pinch > 0 or odd.seating > 0:
        cycle = _cycles(load_n, full_scale_n, state)
        if odd.pinch > 0:
            struck = _drawn(odd, cycle, 1, normal=False) < odd.pinch_share
            above = np.maximum(acting - odd.pinch_from * full_scale_n, 0.0)
            acting = acting - np.where(struck, odd.pinch * above, 0.0)
        if odd.seating > 0:
            acting = acting * (1.0 + odd.seating * _drawn(odd, cycle, 2, normal=True))
    if odd.snap > 0:
        over, back = load_n > odd.snap_up * full_scale_n, load_n < odd.snap_down * full_scale_n
        switch = over.astype(int) - back
        latest = np.maximum.accumulate(np.where(switch != 0, np.arange(switch.size), -1))
        snapped = np.where(latest >= 0, switch[np.maximum(latest, 0)] > 0, state.snapped)
        state.snapped = bool(snapped[-1])
        acting = acting - odd.snap * full_scale_n * snapped
    return acting


@dataclass(frozen=True, slots=True)
class SensorOddities:
    """Effects of the sensor outside the catalogue, in percent of reading (gain) or of range (zero), by session time."""

    __pydantic_config__ = STRICT_KEYS
    gain_step_percent: Finite = 0.0
    gain_step_at_s: NotNegative = 30.0
    slow_sine_percent: NotNegative = 0.0
    slow_sine_period_s: Positive = 60.0
    slow_sine_phase: Share = 0.0
    telegraph_percent: NotNegative = 0.0
    telegraph_dwell_s: Positive = 3.0
    draught_percent: NotNegative = 0.0
    draught_every_s: Positive = 40.0
    draught_recovery_s: Positive = 6.0

    @property
    def is_on(self) -> bool:
        """Whether any of them is on."""
        return any((self.gain_step_percent, self.slow_sine_percent, self.telegraph_percent, self.draught_percent))

    def gain(self, time_s: Array) -> Array:
        """Factor (n,) by which the reading is multiplied."""
        gain = 1.0 + 0.01 * self.gain_step_percent * (time_s >= self.gain_step_at_s)
        phase = 2.0 * np.pi * (time_s / self.slow_sine_period_s + self.slow_sine_phase)
        return np.asarray(gain + 0.01 * self.slow_sine_percent * np.sin(phase))

    def zero(self, time_s: Array, rng: np.random.Generator) -> Array:
        """Offset (n,) of the reading as a fraction of the range."""
        zero = np.zeros(time_s.size)
        if self.telegraph_percent > 0:
            # Centred on zero: its mean would be an offset.
            zero += 0.01 * self.telegraph_percent * (moments(time_s, self.telegraph_dwell_s, rng)[0] % 2 - 0.5)
        if self.draught_percent > 0:
            number, since_s, size = moments(time_s, self.draught_every_s, rng)
            kick = np.where(number > 0, size[number] * np.exp(-since_s / self.draught_recovery_s), 0.0)
            zero += 0.01 * self.draught_percent * kick
        return zero


def moments(time_s: Array, mean_s: float, rng: np.random.Generator) -> tuple[Index, Array, Array]:
    """Random moments (Poisson, ``mean_s`` apart on average).

    Returns how many have passed at each time, the time since the last one, and for each a random size of 0.5 to 1.5
    with either sign.
    """
    start_s, span_s = float(time_s[0]), float(time_s[-1] - time_s[0])
    count = int(span_s / mean_s * 2 + 20)
    at_s = start_s + np.cumsum(rng.exponential(mean_s, count))
    size = rng.uniform(0.5, 1.5, count + 1) * rng.choice([-1.0, 1.0], count + 1)
    number = np.searchsorted(at_s, time_s, side="right")
    return number, time_s - at_s[np.maximum(number - 1, 0)], size
