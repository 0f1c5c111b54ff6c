"""Hidden effects: the end of the sensor's range."""

from __future__ import annotations

import numpy as np

from simulators.hidden.effects._law import Law, Surroundings
from simulators.hidden.effects._registry import SHARE_OF_RANGE, Draws, Hideable, Options, Subject, sensor, uniform
from smartshoe.arrays import Array


def _level(amount: float, draws: Draws) -> float:
    """The level where saturation begins, as a share of the full-scale reading; a soft knee bends below it."""
    return (1.3 if draws["soft"] else 1.0) - amount


def _limit(amount: float, draws: Draws, subject: Subject) -> Options:
    limit = 100.0 * SHARE_OF_RANGE * _level(amount, draws)
    return sensor(limit={"highest_percent": limit, "softness": 0.06 if draws["soft"] else 0.0})


def logarithmic(amount: float, draws: Draws, y: Array, at: Surroundings) -> Array:
    """Above a level the slope falls as 1/(1 + excess/s)."""
    over = np.maximum(y - (1.0 - amount), 0.0)
    return np.asarray(y - over + draws["knee"] * np.log1p(over / draws["knee"]))


def exponential(amount: float, draws: Draws, y: Array, at: Surroundings) -> Array:
    """Above a level the reading approaches its end exponentially."""
    over = np.maximum(y - (1.0 - amount), 0.0)
    return np.asarray(y - over - draws["knee"] * np.expm1(-over / draws["knee"]))


EFFECTS = [
    Hideable("saturation", "saturation", "sensor", "share of full scale cut off", "1", 0.1, 0.9, _limit,
        lambda r, s: {"soft": float(r.random() < 0.25)}, law="stop_or_knee", says="a hard stop, or a rational knee",
        source="output stage", bends="pressure",
        catalogue=lambda a, d, s, hz: {"level_mbar": _level(a, d) * s.full_scale_mbar},
        laws=(
            Law("logarithmic", "reading", "above a level only a logarithm is left", "diode in the feedback",
                logarithmic, 0.15, 0.8, uniform(knee=(0.02, 0.08))),
            Law("exponential", "reading", "above a level it closes in on its end", "saturating stage", exponential,
                0.15, 0.8, uniform(knee=(0.02, 0.08))),
        )),
]  # fmt: skip
