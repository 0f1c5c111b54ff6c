"""Hidden effects: faults of the file rather than of the unit."""

from __future__ import annotations

import numpy as np

from simulators.hidden.effects._law import Law, Surroundings
from simulators.hidden.effects._registry import Draws, Hideable, reading, uniform
from smartshoe.arrays import Array


def floor_of_bits(amount: float, draws: Draws, y: Array, at: Surroundings) -> Array:
    """A converter that truncates, with its first step not at zero."""
    return np.asarray((np.floor(y / amount - draws["begins"]) + draws["begins"] + 0.5) * amount)


def companding(amount: float, draws: Draws, y: Array, at: Surroundings) -> Array:
    """Steps that grow with the reading, as in telephony's logarithmic code; ``amount`` is the step at full scale."""
    mu = draws["mu"]
    step = amount / (1.0 + mu) * mu / np.log1p(mu) * np.log1p(mu)  # step of ln(1 + mu y)
    code = np.sign(y) * np.log1p(mu * np.abs(y))
    return np.asarray(np.sign(code) * np.expm1(np.abs(np.rint(code / step) * step)) / mu)


def every_nth(amount: float, draws: Draws, y: Array, at: Surroundings) -> Array:
    """A sensor slightly slower than its logger: every n-th sample repeats the one before."""
    nth = max(2, round(1.0 / amount))
    place = np.arange(y.size)
    return y[np.where(place % nth == nth - 1, place - 1, place)]


def freezes(amount: float, draws: Draws, y: Array, at: Surroundings) -> Array:
    """A bus that hangs: a few freezes, each of a third of a second to a second."""
    from simulators.effects.logging import runs

    held = runs(y.size, amount, max(draws["freeze_s"] / at.step_s, 2.0), at.rng)
    held[:1] = False
    return y[np.maximum.accumulate(np.where(held, 0, np.arange(y.size)))]


def under_load(amount: float, draws: Draws, y: Array, at: Surroundings) -> Array:
    """A plug that loses contact where the shoe bends: runs at the unloaded value, at high loads only."""
    from simulators.effects.logging import runs

    gone = runs(y.size, min(3.0 * amount, 1.0), draws["run"], at.rng) & (at.load > 0.4)
    return np.where(gone, 0.0, y)


def single_samples(amount: float, draws: Draws, y: Array, at: Surroundings) -> Array:
    """Lost packets of one sample each, which leave empty cells."""
    gone = at.rng.random(y.size) < amount
    gone[:1] = False
    return np.where(gone, np.nan, y)


EFFECTS = [
    Hideable("quantisation", "data", "logger", "lattice", "%", 1.0, 40.0, lambda a, d, s: reading(lattice_percent=a),
        law="rounding", says="an even grid beside the converter's", source="coarse converter",
        catalogue=lambda a, d, s, hz: {"step_mbar": 0.01 * a * s.range_mbar},
        laws=(
            Law("cut_off", "log", "an even grid that cuts off, not from zero", "truncation", floor_of_bits, 0.035,
                0.3, uniform(begins=(0.0, 1.0)), bends=None),
            Law("companding", "log", "steps that grow with the reading", "ITU-T G.711", companding, 0.06, 0.3,
                uniform(mu=(0.5, 4.0)), bends=None),
        )),
    Hideable("held_samples", "data", "logger", "held_share", "1", 0.1, 0.9,
        lambda a, d, s: reading(held_share=a, held_run=d["held_run"]), uniform(held_run=(2.0, 6.0)), law="geometric",
        says="runs of geometric length", source="missed samples", catalogue=lambda a, d, s, hz: {"share": a},
        laws=(
            Law("every_nth", "log", "every n-th sample is the one before", "two rates", every_nth, 0.1, 0.5,
                bends=None),
            Law("freezes", "log", "few freezes of a third of a second and more", "bus that hangs", freezes, 0.02, 0.5,
                uniform(freeze_s=(0.3, 1.0)), bends=None),
        )),
    Hideable("dropouts", "data", "logger", "dropout_share", "1", 0.002, 0.2,
        lambda a, d, s: reading(dropout_share=a, dropout_run=d["dropout_run"]), uniform(dropout_run=(2.0, 8.0)),
        law="geometric", says="runs at the unloaded value", source="loose contact",
        catalogue=lambda a, d, s, hz: {"share": a},
        laws=(
            Law("under_load", "log", "runs at the unloaded value, at high loads only", "bent cable", under_load, 0.002,
                0.2, uniform(run=(2.0, 8.0)), bends=None),
            Law("lost_packets", "log", "single empty cells", "Gilbert 1960, memoryless", single_samples, 0.01, 0.2,
                bends=None),
        )),
]  # fmt: skip
