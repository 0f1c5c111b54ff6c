"""Hidden effects: relaxation of the wall beyond the paper's one arm."""

from __future__ import annotations

import numpy as np

from simulators.hidden.effects._law import Law, Surroundings
from simulators.hidden.effects._registry import Draws, Hideable, Subject, bladder, both, log_uniform, uniform
from simulators.hidden.effects.operators import against_modes, norton
from simulators.plant.bladder_parameters import X_OVER_NRT
from smartshoe.arrays import Array

SPECTRUM = 20  # modes that approximate a continuous spectrum


def second_time_constant(rng: np.random.Generator, subject: Subject) -> Draws:
    """Draws a time constant well separated from the unit's own, slower in two of five cases."""
    ratio = float(np.exp(rng.uniform(np.log(4.0), np.log(10.0))))
    slower = rng.random() < 0.4
    return {"time_constant_s": subject.time_constant_s * ratio if slower else subject.time_constant_s / ratio}


def cole_davidson(amount: float, draws: Draws, x: Array, at: Surroundings) -> Array:
    """Spectrum (tau/(tau0 - tau))^gamma below tau0, zero above.

    Each mode's weight is the spectrum's integral about it.
    """
    share = (np.arange(SPECTRUM) + 0.5) / SPECTRUM
    # tau/tau0 = sin^2 of half an angle removes the singularity at the spectrum's end.
    ratio = np.sin(0.5 * np.pi * share) ** 2 * 0.98 + 0.005
    weight = (ratio / (1.0 - ratio)) ** draws["gamma"] / ratio * np.sin(np.pi * share)
    return amount * against_modes(x, at.step_s, 1.0 / (draws["time_constant_s"] * ratio), weight / weight.sum())


def power_dashpot(amount: float, draws: Draws, x: Array, at: Surroundings) -> Array:
    """An arm whose dashpot flows as a power of its stress."""
    out = np.empty(x.size)
    norton(np.ascontiguousarray(x), at.step_s, draws["time_constant_s"], 0.3, draws["power"], out)
    return amount * out


def kohlrausch(amount: float, draws: Draws, x: Array, at: Surroundings) -> Array:
    """exp(-(t/tau)^beta) as modes, by non-negative least squares on a grid of times."""
    tau_s = np.geomspace(0.02, 3e3, 26)
    time_s = np.geomspace(0.01, 1e3, 160)
    from scipy.optimize import nnls

    asked = np.exp(-((time_s / draws["time_constant_s"]) ** draws["beta"]))
    weight = nnls(np.exp(-time_s[:, None] / tau_s), asked)[0]
    used = weight > 0
    return amount * against_modes(x, at.step_s, 1.0 / tau_s[used], weight[used])


def two_slopes(amount: float, draws: Draws, x: Array, at: Surroundings) -> Array:
    """A spectrum that falls as one power of the time, and beyond a crossover as another."""
    tau_s = np.geomspace(0.02, 2e3, 24)
    ratio = tau_s / draws["crossover_s"]
    weight = np.where(ratio < 1.0, ratio ** -draws["short"], ratio ** -draws["long"])
    return amount * against_modes(x, at.step_s, 1.0 / tau_s, weight / weight.sum())


EFFECTS = [
    Hideable("second_relaxation", "relaxation", "wall", "k3", "N/m", 0.1, 20.0,
        lambda a, d, s: bladder(second_relaxation={"k3": a, "time_constant_s": d["time_constant_s"]}),
        second_time_constant, law="eyring", says="an arm whose dashpot thins under stress: sinh",
        source="Eyring 1936", bends="load",
        catalogue=lambda a, d, s, hz: {"share": a * X_OVER_NRT / (1.0 + s.k1 * X_OVER_NRT),
                                       "time_constant_s": d["time_constant_s"]},
        laws=(
            Law("cole_davidson", "stress", "a spectrum that ends at one time and fades below it",
                "Davidson and Cole 1951", cole_davidson, 0.04, 3.0,
                both(second_time_constant, uniform(gamma=(0.4, 0.8)))),
            Law("norton", "stress", "an arm whose dashpot flows with a power of its stress", "Norton 1929",
                power_dashpot, 0.04, 3.0, both(second_time_constant, uniform(power=(1.2, 1.7)))),
        )),
    Hideable("power_law_creep", "relaxation", "wall", "stiffness", "N/m", 0.2, 20.0,
        lambda a, d, s: bladder(power_law_creep={"stiffness": a, "exponent": d["exponent"]}),
        uniform(exponent=(0.12, 0.45)), law="spring_pot", says="a spring-pot over seven decades",
        source="Mainardi 2010, ch. 3", bends="load",
        catalogue=lambda a, d, s, hz: {"exponent": d["exponent"]},
        laws=(
            Law("kohlrausch", "stress", "a stretched exponential", "Kohlrausch 1854; Williams and Watts 1970",
                kohlrausch, 0.06, 6.0, both(uniform(beta=(0.25, 0.42)), log_uniform(time_constant_s=(3.0, 40.0)))),
            Law("two_slopes", "stress", "a spectrum of two powers that meet at one time",
                "Baumgaertel, Schausberger and Winter 1990", two_slopes, 0.08, 6.0,
                both(uniform(short=(-0.1, 0.2), long=(0.35, 0.6)), log_uniform(crossover_s=(0.6, 8.0)))),
        )),
]  # fmt: skip
