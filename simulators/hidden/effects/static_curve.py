"""Hidden effects: curves of reading against load, from gas, wall, contact and sensor."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from simulators.hidden.effects._law import Law, Surroundings
from simulators.hidden.effects._registry import (
    SHARE_OF_RANGE,
    Draws,
    Hideable,
    Options,
    Subject,
    bladder,
    sensor,
    signed,
    uniform,
)
from simulators.plant.bladder_parameters import AMBIENT_PA
from smartshoe.arrays import Array

AMBIENT_MBAR = AMBIENT_PA / 100.0
LOCKING = 0.95  # of a chain's length: the formula is meaningless beyond


# -- gas ---------------------------------------------------------------------------------------------------------------
def _boyle(amount: float, draws: Draws, subject: Subject) -> Options:
    area = replace(subject, range_mbar=amount).effective_area_m2
    return {"bladder": {"gas": "boyle", "effective_area_m2": area}, "sensor": {"range_mbar": amount}}


def stadium(amount: float, draws: Draws, x: Array, at: Surroundings) -> Array:
    """A round tube between plates loses volume as the square of the travel; the air obeys Boyle's law."""
    squeezed = np.maximum(x, 0.0)
    lost = (1.0 - amount) * squeezed + amount * squeezed**2 + np.minimum(x, 0.0) * (1.0 - amount)
    dense = draws["dense"] * amount
    return np.asarray(lost * (1.0 - dense) / (1.0 - dense * np.minimum(lost, 1.5)) - x)


def adsorption(amount: float, draws: Draws, x: Array, at: Surroundings) -> Array:
    """A lining adsorbs air until it is saturated (Langmuir): the free part of x plus its uptake at full scale."""
    k = draws["affinity"]
    whole = x * (1.0 + amount / (1.0 + k))
    # y + amount y/(1 + k y) = whole, a quadratic in y.
    b = 1.0 + amount - k * whole
    return np.asarray((-b + np.sqrt(b * b + 4.0 * k * whole)) / (2.0 * k) - x)


# -- wall --------------------------------------------------------------------------------------------------------------
def eight_chains(amount: float, draws: Draws, x: Array, at: Surroundings) -> Array:
    """A wall of chains with limited length: the inverse Langevin function by Cohen's approximant."""
    stretch = np.minimum(amount * x * x, LOCKING)
    return at.stiff / (1.0 + at.stiff) * x * ((3.0 - stretch) / (3.0 * (1.0 - stretch)) - 1.0)


def densifying(amount: float, draws: Draws, x: Array, at: Surroundings) -> Array:
    """A cellular wall whose cells collapse: x^m/(1 - x/d)."""
    squeezed = np.minimum(np.maximum(x, 0.0), 0.9 * draws["closed"])
    return amount * squeezed ** draws["power"] / (1.0 - squeezed / draws["closed"])


# -- contact -----------------------------------------------------------------------------------------------------------
def archard(amount: float, draws: Draws, f: Array, at: Surroundings) -> Array:
    """Asperities on asperities: contact area as load^m, m from 1 down; linear below a small load."""
    low, power = draws["onset"], 1.0 - amount
    acting = ((np.maximum(f, 0.0) + low) ** power - low**power) / ((1.0 + low) ** power - low**power)
    return np.where(f > 0.0, acting, f)


def logarithmic(amount: float, draws: Draws, f: Array, at: Surroundings) -> Array:
    """ln(1 + a f)/a: a joint whose stiffness grows with the load in it."""
    return np.where(f > 0.0, np.log1p(amount * np.maximum(f, 0.0)) / amount, f)


# -- sensor ------------------------------------------------------------------------------------------------------------
def _curve(amount: float, draws: Draws, subject: Subject) -> Options:
    if draws["odd"]:
        return sensor(curve={"compression": amount})
    return sensor(curve={"bridge": amount if draws["sign"] > 0 else -amount / (1.0 + amount)})


def loaded_divider(amount: float, draws: Draws, y: Array, at: Surroundings) -> Array:
    """A potentiometer with a load on its tap: y/(1 + a y (1 - y)), with a of either sign."""
    return np.asarray(y / (1.0 + draws["sign"] * amount * y * (1.0 - np.minimum(y, 1.3))))


def interpolation(amount: float, draws: Draws, y: Array, at: Surroundings) -> Array:
    """A linearising table with too few knots: a sine between its knots."""
    turns = draws["turns"]
    return np.asarray(y + draws["sign"] * amount * np.sin(np.pi * turns * y) / (np.pi * turns))


EFFECTS = [
    Hideable("gas_compression", "static_curve", "gas", "range", "mbar", 100.0, 1300.0, _boyle,
        law="boyle", says="Boyle's law, the wall in series", source="Boyle", bends="load",
        catalogue=lambda a, d, s, hz: {"pressure_ratio": SHARE_OF_RANGE * a / AMBIENT_MBAR},
        laws=(
            Law("stadium", "gas", "a round tube between plates loses volume with the square of the travel",
                "geometry of a stadium of constant girth; Boyle", stadium, 0.1, 0.6, uniform(dense=(0.2, 0.9))),
            Law("langmuir", "gas", "a lining that takes up air until it is full", "Langmuir 1918", adsorption,
                0.15, 2.0, uniform(affinity=(1.0, 4.0))),
        )),
    Hideable("wall_hardening", "static_curve", "wall", "wall_stiffening", "1", 0.5, 6.0,
        lambda a, d, s: bladder(wall_stiffening=a), law="fung", says="a spring that hardens as a hyperbolic sine",
        source="Fung 1967", bends="load",
        laws=(
            Law("arruda_boyce", "stress", "eight chains of limited length", "Arruda and Boyce 1993; Cohen 1991",
                eight_chains, 0.2, 0.8),
            Law("gibson_ashby", "stress", "cells of a foamed wall that close", "Gibson and Ashby 1997, ch. 5",
                densifying, 0.03, 1.0, uniform(power=(1.5, 3.5), closed=(1.4, 2.2))),
        )),
    Hideable("contact_area", "static_curve", "contact", "saturation", "1", 0.05, 5.0,
        lambda a, d, s: bladder(contact={"saturation": a}), law="asperities",
        says="asperities with exponential heights", source="Greenwood and Williamson 1966", bends="load",
        laws=(
            Law("archard", "load", "asperities on asperities: a power of the load", "Archard 1957", archard, 0.1, 0.7,
                uniform(onset=(0.02, 0.15))),
            Law("logarithmic", "load", "a joint whose stiffness grows with its load", "Ostrovskii 1979", logarithmic,
                0.2, 8.0),
        )),
    Hideable("sensor_nonlinearity", "static_curve", "sensor", "bridge or compression", "1", 0.1, 6.0, _curve,
        lambda r, s: {"odd": float(r.random() < 0.4), "sign": float(r.choice([-1.0, 1.0]))},
        law="bridge_or_amplifier", says="a Wheatstone bridge's, or an amplifier's that compresses",
        source="Wheatstone bridge; tanh", bends="pressure",
        laws=(
            Law("loaded_divider", "reading", "a potentiometer with a load on its tap", "voltage divider",
                loaded_divider, 0.15, 2.0, signed()),
            Law("interpolation", "reading", "a linearising table with too few knots", "chord error of a table",
                interpolation, 0.1, 0.9, signed(uniform(turns=(1.2, 2.4)))),
        )),
]  # fmt: skip
