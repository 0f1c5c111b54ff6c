"""Hidden effects: gain that depends on the direction of loading."""

from __future__ import annotations

import numpy as np

from simulators.effects.memory import follow
from simulators.hidden.effects._law import Law, Surroundings
from simulators.hidden.effects._registry import Draws, Hideable, bladder, signed, uniform
from simulators.hidden.effects.operators import lagged
from smartshoe.arrays import Array


def two_contacts(amount: float, draws: Draws, f: Array, at: Surroundings) -> Array:
    """Two contacts in series, one of which reverses after at least ten times the travel of the other (partial slip)."""
    way = np.diff(f, prepend=0.0)
    quick, late = np.empty(f.size), np.empty(f.size)
    follow(way, np.full(f.size, draws["quick"]), 1.0, quick)
    follow(way, np.full(f.size, draws["late"]), 1.0, late)
    sense = (1.0 - draws["share"]) * quick + draws["share"] * late
    return np.asarray(f * (1.0 - 0.5 * draws["sign"] * amount * (1.0 - sense)))


def by_velocity(amount: float, draws: Draws, f: Array, at: Surroundings) -> Array:
    """Friction that follows a slow velocity: tanh(v/v0), v seen through a short lag; none in holds."""
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
            Law("two_contacts", "load", "two contacts in a row, of which one turns over late",
                "Mindlin and Deresiewicz 1953", two_contacts, 0.03, 0.6,
                signed(uniform(quick=(0.003, 0.012), late=(0.1, 0.25), share=(0.25, 0.5)))),
            Law("regularised", "load", "friction that turns over with a slow velocity, none in holds",
                "Coulomb, regularised (Oden and Martins 1985)", by_velocity, 0.03, 0.6,
                signed(uniform(slow=(0.01, 0.05)))),
        )),
]  # fmt: skip
