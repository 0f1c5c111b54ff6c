"""Hidden effects: gain that grows with the rate of loading, in both directions."""

from __future__ import annotations

import numpy as np

from simulators.hidden.effects._law import Law, Surroundings
from simulators.hidden.effects._registry import Draws, Hideable, bladder, signed, uniform
from simulators.hidden.effects.operators import lagged
from smartshoe.arrays import Array


def _speed(f: Array, draws: Draws, at: Surroundings) -> Array:
    return np.asarray(np.abs(np.gradient(lagged(f, draws["seen_s"], at.step_s), at.step_s)))


def ree_eyring(amount: float, draws: Draws, f: Array, at: Surroundings) -> Array:
    """asinh(v/v0): thermally activated flow."""
    v0 = draws["v0"]
    gain = np.arcsinh(_speed(f, draws, at) / v0) / np.arcsinh(1.0 / v0)
    return np.asarray(f * np.maximum(1.0 + draws["sign"] * amount * gain, 0.0))


def carreau(amount: float, draws: Draws, f: Array, at: Surroundings) -> Array:
    """(1 + (v/v0)^2)^(n/2) - 1: zero at first, then a power."""
    v0, power = draws["v0"], draws["power"]
    gain = ((1.0 + (_speed(f, draws, at) / v0) ** 2) ** (0.5 * power) - 1.0) / ((1.0 + v0**-2) ** (0.5 * power) - 1.0)
    return np.asarray(f * np.maximum(1.0 + draws["sign"] * amount * gain, 0.0))


EFFECTS = [
    Hideable("rate_gain", "rate", "wall", "rate_gain", "1", 0.02, 1.9,
        lambda a, d, s: bladder(contact={"rate_gain": a}), law="power",
        says="power 0.9 of the rate, seen through 20 ms",
        source="thickening of a visco-elastic cover", bends="load",
        catalogue=lambda a, d, s, hz: {"gain_per_rate": a},  # at a rate of one full scale per second
        laws=(
            Law("ree_eyring", "load", "thermally activated flow: asinh of the rate", "Ree and Eyring 1955", ree_eyring,
                0.03, 0.8, signed(uniform(v0=(0.15, 0.6), seen_s=(0.01, 0.03)))),
            Law("carreau", "load", "nothing at slow rates, then a power", "Carreau 1972", carreau, 0.03, 0.8,
                signed(uniform(v0=(0.15, 0.6), power=(0.8, 1.3), seen_s=(0.01, 0.03)))),
        )),
]  # fmt: skip
