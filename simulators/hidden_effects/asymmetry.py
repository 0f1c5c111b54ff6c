"""Gain that depends on the direction."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simulators.effects.memory import follow
from simulators.hidden_effects.law import Law, Surroundings
from simulators.hidden_effects.operators import lagged, last_peak
from simulators.hidden_effects.registry import Draws, Hideable, bladder, signed, uniform

Array = NDArray[np.float64]

UNREST = 0.01  # of full scale: smaller turns are none


def unloading_power(amount: float, draws: Draws, f: Array, at: Surroundings) -> Array:
    """What is unloaded follows peak (f/peak)^(1 + a) from the last turning point."""
    peak, sense = np.empty(f.size), np.empty(f.size)
    last_peak(np.ascontiguousarray(f), UNREST, peak)
    follow(np.diff(f, prepend=0.0), np.full(f.size, draws["turn"]), 1.0, sense)
    share = np.clip(f / np.maximum(peak, UNREST), 1e-6, 1.0)
    lost = f * (share ** (draws["sign"] * amount) - 1.0)
    return np.asarray(f + np.where(f > 0.0, lost, 0.0) * 0.5 * (1.0 - sense))


def by_velocity(amount: float, draws: Draws, f: Array, at: Surroundings) -> Array:
    """Friction that turns over with a slow velocity: tanh(v/v0), v seen through a short lag; none in holds."""
    velocity = np.gradient(lagged(f, 0.05, at.step_s), at.step_s)
    return np.asarray(f * (1.0 + 0.5 * draws["sign"] * amount * np.tanh(velocity / draws["slow"])))


EFFECTS = [
    Hideable("load_unload_asymmetry", "asymmetry", "wall", "direction_gain", "1", 0.01, 0.59,
        lambda a, d, s: bladder(contact={"direction_gain": d["sign"] * a, "direction_turn_n": d["direction_turn_n"]}),
        signed(uniform(direction_turn_n=(3.0, 10.0))), law="capstan",
        says="friction of the insole on the tube, the sense turning over within a slip that grows with load",
        source="capstan; Mindlin 1949", bends="load",
        catalogue=lambda a, d, s, hz: {"lost_gain": d["sign"] * a},
        laws=(
            Law("unloading_power", "load", "unloading follows another power of the share of the last peak",
                "Oliver and Pharr 1992", unloading_power, 0.03, 1.5, signed(uniform(turn=(0.003, 0.012)))),
            Law("regularised", "load", "friction that turns over with a slow velocity, none in holds",
                "Coulomb, regularised (Oden and Martins 1985)", by_velocity, 0.03, 0.6,
                signed(uniform(slow=(0.01, 0.05)))),
        )),
]  # fmt: skip
