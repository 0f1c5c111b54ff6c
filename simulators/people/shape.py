"""How a stance loads the foot: the four coils and the part beside them, as functions of the share of stance.

Walking's landmarks, in body weights at 1.3 m/s and 80 % coverage: heel 0.72 at 12 % of stance, off at 50 %; meta4 0.51
at 74 %, on from 26 %; meta1 0.21 at 75 %; toe 0.41 at 85 %; the whole foot 1.03 at 24 %, 0.69 at 43 %, 1.10 at 72 %.
Running is one hump. Each region's load is a pulse of two halves sin^(2p), p above a half, so that it starts and ends
without a step in its slope. The part outside the coils is the midfoot, which has its own timing.

*Left out:* the impact transient of a hard heel strike (its 10-20 ms are lost in a bladder), forefoot strikers, shear.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Literal

import numpy as np

from simulators.people import _speed as speed
from smartshoe.arrays import Array
from smartshoe.errors import UsageError
from smartshoe.recording import REGIONS

Outside = Literal["midfoot", "even"]

COLUMNS = (*REGIONS, "outside")
PHASES = 1000  # steps per stance in a table
COVERAGE = 0.8  # share of the impulse on the coils, in the tables below
# Begin, peak, end as shares of stance; p of the rise and of the fall; height in body weights.
WALKING = {
    "heel": (0.00, 0.124, 0.500, 0.60, 0.70, 0.720),
    "meta4": (0.260, 0.740, 0.985, 0.98, 0.60, 0.510),
    "meta1": (0.310, 0.755, 0.990, 0.93, 0.60, 0.212),
    "toe": (0.390, 0.848, 1.000, 0.65, 0.60, 0.413),
    "outside": (0.120, 0.260, 0.740, 0.865, 0.60, 0.442),
}
RUNNING = {
    "heel": (0.00, 0.24, 0.66, 0.65, 0.80, 1.00),
    "meta4": (0.08, 0.54, 0.97, 0.80, 0.70, 0.85),
    "meta1": (0.12, 0.57, 0.98, 0.80, 0.70, 0.50),
    "toe": (0.17, 0.64, 1.00, 0.90, 0.65, 0.48),
    "outside": (0.05, 0.36, 0.80, 0.80, 0.80, 0.77),
}


def pulse(stance: Array, begin: float, peak: float, end: float, rise: float, fall: float, height: float) -> Array:
    """One region's load (n,) in body weights at the shares of stance (n,): a pulse of the given times and exponents."""
    rises = stance < peak
    side = np.where(rises, (stance - begin) / (peak - begin), (end - stance) / (end - peak))
    return np.asarray(height * np.sin(0.5 * np.pi * np.clip(side, 0.0, 1.0)) ** (2.0 * np.where(rises, rise, fall)))


def covered(loads: Array, coverage: float, outside: Outside) -> Array:
    """``loads`` (n, 5), the last column beside the coils, redistributed so that coils get ``coverage`` of the impulse.

    The foot's total load is unchanged at each moment. "midfoot": the part beside the coils keeps its own time course;
    "even": it is the same share at each moment.
    """
    if not 0.0 < coverage <= 1.0:
        raise UsageError(f"coverage is {coverage:g}: give the share of the load under the coils, above 0, at most 1")
    whole, units = loads.sum(axis=1), loads[:, :-1].sum(axis=1)
    safe = np.where(whole > 0, whole, 1.0)
    met = np.where(whole > 0, units / safe, 1.0)
    natural = units.sum() / whole.sum()
    if outside == "even":
        share = np.full(met.shape, coverage)
    elif coverage >= natural:
        share = 1.0 - (1.0 - coverage) / (1.0 - natural) * (1.0 - met)
    else:
        share = met * coverage / natural
    # Where only the midfoot is loaded, there is no coil load to scale.
    share = np.where(units > 1e-9 * whole.max(), share, 0.0)
    scale = np.where(units > 0, share * whole / np.where(units > 0, units, 1.0), 0.0)
    return np.column_stack([loads[:, :-1] * scale[:, None], whole * (1.0 - share)])


@lru_cache(maxsize=64)
def table(
    kind: Literal["walk", "run"], speed_m_per_s: float, coverage: float, outside: Outside, leaning: float = 0.0
) -> Array:
    """Loads (`PHASES` + 1, 5) over stance in body weights, columns as in `COLUMNS`; a read-only array.

    ``leaning`` is the share of load moved from the outer (meta4) to the inner metatarsal (meta1), as in a turn.
    """
    stance = np.linspace(0.0, 1.0, PHASES + 1)
    pulses = WALKING if kind == "walk" else RUNNING
    loads = np.column_stack([pulse(stance, *pulses[column]) for column in COLUMNS])
    if kind == "walk":
        wave = -np.cos(4.0 * np.pi * stance) * np.sin(np.pi * stance) ** 2
        loads *= (1.0 + speed.modulation(speed_m_per_s) * wave)[:, None]
    made = covered(loads, coverage, outside)
    meta1, meta4 = REGIONS.index("meta1"), REGIONS.index("meta4")
    moved = leaning * made[:, meta4 if leaning > 0 else meta1]
    made[:, meta1] += moved
    made[:, meta4] -= moved
    made.flags.writeable = False
    return made
