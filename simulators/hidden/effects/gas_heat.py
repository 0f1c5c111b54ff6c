"""Hidden effects: heat of compression that has not yet left the air."""

from __future__ import annotations

import numpy as np

from simulators.hidden.effects._law import Law, Surroundings
from simulators.hidden.effects._registry import Draws, Hideable, bladder, log_uniform
from simulators.hidden.effects.operators import against_modes
from simulators.plant.bladder_parameters import HEAT_RATIO
from smartshoe.arrays import Array

COOLING = log_uniform(time_constant_s=(0.4, 3.0))


def slab(amount: float, draws: Draws, x: Array, at: Surroundings) -> Array:
    """Conduction out of a flattened tube: shares 8/(odd^2 pi^2), rates odd^2."""
    odd = np.array([1.0, 3.0, 5.0, 7.0])
    share = 1.0 / odd**2
    rate = odd**2 / draws["time_constant_s"]
    return amount * (HEAT_RATIO - 1.0) * against_modes(x, at.step_s, rate, share / share.sum())


def thick_wall(amount: float, draws: Draws, x: Array, at: Surroundings) -> Array:
    """Conduction into an infinitely thick wall: the air keeps exp(r) erfc(sqrt(r)), r = t/tau, of a step's heat."""
    rate = np.geomspace(2e-3, 2e2, 22)
    weight = np.sqrt(rate) / (1.0 + rate)  # density over ln(rate)
    return (
        amount
        * (HEAT_RATIO - 1.0)
        * against_modes(x, at.step_s, rate / draws["time_constant_s"], weight / weight.sum())
    )


EFFECTS = [
    Hideable("gas_heat", "gas_heat", "gas", "fraction", "1", 0.1, 1.0,
        lambda a, d, s: bladder(gas_heat={"fraction": a, "time_constant_s": d["time_constant_s"], "modes": 3}),
        COOLING, law="cylinder", says="conduction out of a cylinder of air, three modes",
        source="Carslaw and Jaeger 1959, 7.6", bends="load",
        catalogue=lambda a, d, s, hz: {"share": (HEAT_RATIO - 1.0) * a, "time_constant_s": d["time_constant_s"]},
        laws=(
            Law("slab", "gas", "conduction out of a flattened tube", "Carslaw and Jaeger 1959, 3.3", slab, 0.1, 1.0,
                COOLING),
            Law("thick_wall", "gas", "heat soaks into a wall without end", "Carslaw and Jaeger 1959, 2.7",
                thick_wall, 0.1, 1.0, log_uniform(time_constant_s=(0.15, 0.8))),
        )),
]  # fmt: skip
