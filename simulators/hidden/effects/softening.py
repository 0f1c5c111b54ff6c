"""Hidden effects: softening by the largest load so far, and settling over cycles."""

from __future__ import annotations

import numpy as np

from simulators.hidden.effects._law import Law, Surroundings
from simulators.hidden.effects._registry import Draws, Hideable, bladder, log_uniform, signed, uniform
from simulators.hidden.effects.operators import cycles_done
from smartshoe.arrays import Array

CYCLE_BEGINS, CYCLE_ENDS = 0.1, 0.03  # of full scale
ROUNDED = 1e-3  # of the distance to the largest strain: rounds the root's infinite slope


def _largest(x: Array) -> Array:
    return np.asarray(np.maximum.accumulate(np.maximum(x, 0.0)))


def damage(amount: float, draws: Draws, x: Array, at: Surroundings) -> Array:
    """The wall's force times 1 - D, D = a (1 - exp(-W/eta)), W the largest energy so far, including the present."""
    most = _largest(x)
    return np.asarray(-at.stiff / (1.0 + at.stiff) * x * amount * -np.expm1(-(most**2) / draws["eta"]))


def root_of_distance(amount: float, draws: Draws, x: Array, at: Surroundings) -> Array:
    """exp(-b sqrt(M - m)) times the wall's force; m is the strain's magnitude, M its largest value so far."""
    most = _largest(x)
    now = np.maximum(x, 0.0) ** draws["power"]
    distance = np.maximum(most ** draws["power"] - now, 0.0)
    lost = -np.expm1(-amount * (np.sqrt(distance + ROUNDED) - np.sqrt(ROUNDED)))
    return np.asarray(-at.stiff / (1.0 + at.stiff) * x * lost)


def by_way(amount: float, draws: Draws, f: Array, at: Surroundings) -> Array:
    """Settles with the distance travelled by the load, up and down, rather than with the number of cycles."""
    gone = np.cumsum(np.abs(np.diff(f, prepend=0.0))) / 2.0
    return np.asarray(f * (1.0 - draws["sign"] * amount * np.expm1(-gone / draws["cycles"])))


def by_power(amount: float, draws: Draws, f: Array, at: Surroundings) -> Array:
    """1 - (1 + n)^-b of the completed cycles n: it never ends."""
    done = np.empty(f.size)
    cycles_done(np.ascontiguousarray(f), CYCLE_BEGINS, CYCLE_ENDS, done)
    # The gain changes smoothly as the load returns; a jump at rest would not show there anyway.
    return np.asarray(f * (1.0 + draws["sign"] * amount * (1.0 - (1.0 + done) ** -draws["power"])))


EFFECTS = [
    Hideable("mullins_softening", "softening", "wall", "strength", "1", 0.05, 0.95,
        lambda a, d, s: bladder(softening={"strength": a, "width": d["width"]}), uniform(width=(0.2, 0.5)),
        law="ogden_roxburgh", says="below the largest deformation so far the wall is softer, tanh",
        source="Ogden and Roxburgh 1999", bends="load",
        laws=(
            Law("simo", "stress", "damage by the largest energy so far, saturating", "Simo 1987", damage, 0.1, 0.9,
                log_uniform(eta=(0.15, 1.0))),
            Law("beatty_krishnaswamy", "stress", "exponential in the root of the distance to the largest strain",
                "Beatty and Krishnaswamy 2000", root_of_distance, 0.1, 3.0, uniform(power=(1.4, 2.4))),
        )),
    Hideable("cycle_conditioning", "softening", "wall", "gain", "1", 0.01, 0.49,
        lambda a, d, s: bladder(conditioning={"gain": d["sign"] * a, "cycles": d["cycles"]}),
        signed(uniform(cycles=(2.0, 6.0))), law="exponential", says="settles with the number of cycles done",
        source="shakedown", bends="load",
        catalogue=lambda a, d, s, hz: {"gained": d["sign"] * a, "cycles": d["cycles"]},
        laws=(
            Law("way", "load", "settles with the way that the load has gone", "endochronic shakedown (Valanis 1971)",
                by_way, 0.02, 0.45, signed(uniform(cycles=(1.5, 5.0)))),
            Law("power", "load", "a negative power of the cycles done", "Coffin 1954, cyclic settling by a power",
                by_power, 0.02, 0.45, signed(uniform(power=(0.3, 1.2)))),
        )),
]  # fmt: skip
