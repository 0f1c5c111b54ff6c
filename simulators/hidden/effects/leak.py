"""Hidden effects: air that leaves the tube."""

from __future__ import annotations

import numpy as np

from simulators.hidden.effects._law import Law, Surroundings
from simulators.hidden.effects._registry import Draws, Hideable, bladder, log_uniform, uniform
from simulators.hidden.effects.operators import against_modes, integral
from smartshoe.arrays import Array

LAMINAR = 2e-3  # of full scale: below this pressure the flow of any opening is viscous


def forchheimer(amount: float, draws: Draws, y: Array, at: Surroundings) -> Array:
    """Flow q through a packed bed, p = A q + B q^2, for either sign of the pressure."""
    inertia = draws["inertia"]
    flow = 2.0 * y / (1.0 + np.sqrt(1.0 + 4.0 * inertia * np.abs(y)))
    return -amount * integral(flow, at.step_s)


def permeation(amount: float, draws: Draws, y: Array, at: Surroundings) -> Array:
    """Uptake of a membrane at its inner face: Fick's law, steady once it is saturated."""
    number = np.arange(1.0, 7.0)
    rate = number**2 / draws["soak_s"]
    soaking = against_modes(y, at.step_s, rate, 2.0 * draws["uptake"] * np.ones(number.size))
    return -amount * integral(y + soaking, at.step_s)


def labyrinth(amount: float, draws: Draws, y: Array, at: Surroundings) -> Array:
    """Chambers in series: the square root of the difference of squared absolute pressures."""
    size = np.abs(y)
    drop = size * (1.0 + 0.5 * draws["compressed"] * size)
    return -amount * integral(np.sign(y) * drop / np.sqrt(drop + LAMINAR), at.step_s)


def bubble_point(amount: float, draws: Draws, y: Array, at: Surroundings) -> Array:
    """A wetted hole: closed below the pressure that blows the film away, then an orifice's root; open inwards."""
    over = np.where(y >= 0.0, np.maximum(y - draws["holds"], 0.0), -y)
    return -amount * integral(np.sign(y) * over / np.sqrt(over + LAMINAR), at.step_s)


EFFECTS = [
    Hideable("linear_leak", "leak", "gas", "capillary_per_s", "1/s", 0.003, 0.5,
        lambda a, d, s: bladder(leak={"capillary_per_s": a}), law="capillary",
        says="compressible flow through a narrow channel", source="Poiseuille, compressible", bends="load",
        catalogue=lambda a, d, s, hz: {"leak_rate_per_s": a},
        laws=(
            Law("forchheimer", "leak", "a packed bed: viscous, then inertial", "Forchheimer 1901", forchheimer,
                1e-3, 0.3, uniform(inertia=(0.3, 2.0))),
            Law("permeation", "leak", "the wall takes up air until it is soaked, then lets it through",
                "Crank 1975, ch. 4", permeation, 1e-3, 0.2,
                lambda rng, s: {"soak_s": float(np.exp(rng.uniform(np.log(8.0), np.log(60.0)))),
                                "uptake": float(rng.uniform(0.1, 0.5))}),
        )),
    Hideable("orifice_leak", "leak", "gas", "nozzle_per_s", "1/s", 0.0005, 0.2,
        lambda a, d, s: bladder(leak={"nozzle_per_s": a}), law="nozzle",
        says="isentropic flow through a hole, laminar near zero", source="Saint-Venant and Wantzel 1839", bends="load",
        laws=(
            Law("labyrinth", "leak", "a row of chambers", "Egli 1935", labyrinth, 1e-3, 0.3,
                log_uniform(compressed=(0.2, 2.0))),
            Law("bubble_point", "leak", "a film closes the hole below one pressure", "Washburn 1921", bubble_point,
                1e-3, 0.3, uniform(holds=(0.02, 0.12))),
        )),
]  # fmt: skip
