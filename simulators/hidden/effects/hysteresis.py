"""Hidden effects: loops that do not depend on rate."""

from __future__ import annotations

import numpy as np

from simulators.hidden.effects._law import Law, Surroundings
from simulators.hidden.effects._registry import Draws, Hideable, bladder, log_uniform, uniform
from simulators.hidden.effects.operators import endochronic, jiles_atherton, slip
from simulators.instruments.presets import FULL_SCALE_N
from simulators.plant.preisach import MEMORY, loop_shape
from smartshoe.arrays import Array

SLIDERS = 16


def relays_and_sliders(amount: float, draws: Draws, f: Array, at: Surroundings) -> Array:
    """A contact of relays over two thresholds (`simulators.plant.preisach`) on a wall of sliders."""
    from simulators.plant.load_stepping import loop_and_cycles

    shape, height = loop_shape(draws["half_width"], draws["spread"], 1.0)
    loop, cycles = np.empty(f.size), np.empty(f.size)
    loop_and_cycles(
        np.ascontiguousarray(f), shape, 1.0, np.zeros(MEMORY), np.zeros(MEMORY), np.array([1.0, 0.0, 0.0]), loop, cycles
    )
    rubbed = np.empty(f.size)
    reach = np.full(1, draws["half_width"])
    slip(np.ascontiguousarray(f), reach, reach, 1.0 / reach, rubbed)
    return np.asarray(f + amount * (draws["relays"] / height * loop - (1.0 - draws["relays"]) * rubbed))


def unequal_sliders(amount: float, draws: Draws, f: Array, at: Surroundings) -> Array:
    """Sliders that hold more in one direction than in the other, with slip distances spread as a power law."""
    share = (np.arange(SLIDERS) + 0.5) / SLIDERS
    reach = draws["reach"] * share ** (1.0 / draws["spread"])
    up, down = reach * (1.0 + draws["uneven"]), reach * (1.0 - draws["uneven"])
    out = np.empty(f.size)
    slip(np.ascontiguousarray(f), up, down, 1.0 / (reach * SLIDERS), out)
    return np.asarray(f - amount * out)


def anhysteretic(amount: float, draws: Draws, f: Array, at: Surroundings) -> Array:
    """Pinned domains that follow their equilibrium with a lag (Jiles and Atherton)."""
    out = np.empty(f.size)
    jiles_atherton(np.ascontiguousarray(f), draws["pin"], draws["scale"], out)
    return np.asarray(f - amount * draws["scale"] / draws["pin"] * out)


def intrinsic_time(amount: float, draws: Draws, f: Array, at: Surroundings) -> Array:
    """Plasticity without a yield point, as a function of the length of the path travelled (endochronic)."""
    out = np.empty(f.size)
    endochronic(np.ascontiguousarray(f), draws["width"], draws["hardening"], out)
    return np.asarray(f - amount * out)


def _half_height(amount: float, draws: Draws, subject: object, hz: float) -> dict[str, float]:
    return {"half_height_n": FULL_SCALE_N * amount}


EFFECTS = [
    Hideable("play_hysteresis", "hysteresis", "wall", "strength", "1", 0.01, 0.4,
        lambda a, d, s: bladder(stick_slip={"strength": a, **d}),
        log_uniform(first_slip=(0.005, 0.02), last_slip=(0.1, 0.3)), law="jenkins",
        says="sliders on the deformation, solved with the balance", source="Iwan 1966", bends="load",
        catalogue=_half_height,
        laws=(
            Law("relays", "load", "a seat of relays, dense about the middle of the range, on a wall of sliders",
                "Mayergoyz 2003", relays_and_sliders, 0.01, 0.3,
                uniform(half_width=(0.03, 0.09), spread=(0.6, 0.95), relays=(0.25, 0.5))),
            Law("unequal_sliders", "load", "sliders that hold more one way than the other", "Segalman 2005",
                unequal_sliders, 0.01, 0.3, uniform(reach=(0.06, 0.25), spread=(0.6, 1.4), uneven=(-0.4, 0.4))),
        )),
    Hideable("bouc_wen_hysteresis", "hysteresis", "wall", "strength", "1", 0.01, 0.4,
        lambda a, d, s: bladder(bouc_wen={"strength": a, **d}),
        uniform(width=(0.05, 0.25), exponent=(1.0, 2.5), gamma=(0.1, 0.5)), law="wen",
        says="Wen's equation on the deformation", source="Wen 1976", bends="load", catalogue=_half_height,
        laws=(
            Law("jiles_atherton", "load", "domains that follow their equilibrium late",
                "Jiles and Atherton 1986", anhysteretic, 0.02, 0.5, uniform(pin=(0.04, 0.16), scale=(0.7, 1.6))),
            Law("valanis", "load", "plasticity by the length of the way gone, hardening with it", "Valanis 1971",
                intrinsic_time, 0.01, 0.3, uniform(width=(0.04, 0.15), hardening=(0.05, 0.3))),
        )),
]  # fmt: skip
