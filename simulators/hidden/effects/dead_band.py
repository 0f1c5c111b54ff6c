"""Hidden effects: load that something else takes before the tube is touched."""

from __future__ import annotations

import numpy as np

from simulators.hidden.effects._law import Law, Surroundings
from simulators.hidden.effects._registry import Draws, Hideable, bladder, uniform
from simulators.instruments.presets import FULL_SCALE_N
from smartshoe.arrays import Array


def hinge(amount: float, draws: Draws, f: Array, at: Surroundings) -> Array:
    """A hyperbola between zero and the load minus the gap."""
    width = draws["width"] * amount
    bent = 0.5 * (f - amount + np.sqrt((f - amount) ** 2 + width**2))
    return np.asarray(bent - 0.5 * (np.sqrt(amount**2 + width**2) - amount))


def frame(amount: float, draws: Draws, f: Array, at: Surroundings) -> Array:
    """A yielding frame beside the tube: it bears up to the gap's load, as a tanh."""
    return np.asarray(f - amount * np.tanh((f / (draws["give"] * amount)) ** draws["power"]) * (f > 0.0))


EFFECTS = [
    Hideable("dead_band", "dead_band", "contact", "gap", "N", 10.0, 400.0,
        lambda a, d, s: bladder(contact={"gap_n": a, "gap_spread": d["gap_spread"]}), uniform(gap_spread=(0.2, 0.6)),
        law="windings", says="windings that are reached one after another, gaps spread evenly", source="geometry",
        bends="load", catalogue=lambda a, d, s, hz: {"lost_load_n": a},
        laws=(
            Law("hinge", "load", "a hyperbola from nothing to the load less the gap",
                "hyperbolic contact (Bickford 1998)", hinge, 10.0 / FULL_SCALE_N, 0.5, uniform(width=(0.3, 1.2))),
            Law("frame", "load", "a frame beside the tube that yields at its greatest load", "Prandtl 1928, smoothed",
                frame, 10.0 / FULL_SCALE_N, 0.5, uniform(give=(1.0, 2.5), power=(1.0, 2.0))),
        )),
]  # fmt: skip
