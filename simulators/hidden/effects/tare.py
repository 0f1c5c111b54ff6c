"""Hidden effects: what the load cell shows without load."""

from __future__ import annotations

import numpy as np

from simulators.hidden.effects._law import Law, Surroundings
from simulators.hidden.effects._registry import Draws, Hideable, signed, uniform
from smartshoe.arrays import Array


def warming_bridge(amount: float, draws: Draws, f: Array, at: Surroundings) -> Array:
    """A tare that partly disappears as the bridge warms up."""
    part = draws["part"] * np.expm1(-at.time_s / draws["time_constant_s"])
    return np.asarray(draws["sign"] * amount * (1.0 + part))


def zero_return(amount: float, draws: Draws, f: Array, at: Surroundings) -> Array:
    """A tare that grows with the largest load so far: the cell's zero-return error."""
    return np.asarray(draws["sign"] * amount * (1.0 + draws["part"] * np.maximum.accumulate(np.maximum(f, 0.0))))


EFFECTS = [
    Hideable("load_cell_tare", "tare", "machine", "load_cell_tare", "N", 5.0, 150.0,
        lambda a, d, s: {"load_cell_tare_n": d["sign"] * a}, signed(), needs_zero=True, law="constant",
        says="one constant", source="weight of the fixture",
        catalogue=lambda a, d, s, hz: {"tare_n": -d["sign"] * a},  # acting load minus measured load
        laws=(
            Law("warming_bridge", "tare", "a part of it goes as the bridge warms", "OIML R 60", warming_bridge, 0.01,
                0.15, signed(lambda r, s: {"part": float(r.uniform(0.1, 0.4)),
                                           "time_constant_s": float(r.uniform(30.0, 120.0))}), bends=None),
            Law("zero_return", "tare", "a part comes with the largest load so far", "OIML R 60, zero return",
                zero_return, 0.01, 0.15, signed(uniform(part=(-0.3, 0.3))), bends=None),
        )),
]  # fmt: skip
