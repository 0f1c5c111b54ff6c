"""Load cycles: how many there are, and to which a sample belongs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from smartshoe.arrays import Array, Index
from smartshoe.integrity.thresholds import Thresholds
from smartshoe.models.effects import Conditions
from smartshoe.signals.loading import rises_of

if TYPE_CHECKING:
    from smartshoe.diagnosis._session import Session


def least_rise(load: Array, thresholds: Thresholds) -> float:
    """By how much a load (n,) must rise to make a cycle: a share of full scale, or of its own span if that is less."""
    return thresholds.cycle * min(1.0, max(float(np.ptp(load)), 1e-9))


def rises_in(conditions: Conditions, thresholds: Thresholds) -> Index:
    """First and last sample (k, 2) of each rise of the load that makes a cycle; cached in the conditions."""

    def found() -> Array:
        load = conditions.load
        return np.array(rises_of(load, least_rise(load, thresholds)), dtype=float).reshape(-1, 2)

    return conditions.kept("rises", (thresholds.cycle,), found).astype(np.intp)


def load_cycles(sessions: Sequence[Session], thresholds: Thresholds) -> int:
    """The number of load cycles in fitted recordings."""
    return sum(len(rises_in(one.conditions, thresholds)) for one in sessions if one.fitted.any())


def have_later_cycles(sessions: Sequence[Session], thresholds: Thresholds) -> bool:
    """Whether any fitted recording holds more than one load cycle."""
    return any(load_cycles([session], thresholds) > 1 for session in sessions)


def cycles_of(conditions: Conditions, thresholds: Thresholds) -> Index:
    """(n,) number of the load cycle; of equal parts of the time where there are too few cycles to hold some out."""
    load = conditions.load
    threshold = least_rise(load, thresholds)
    # A cycle begins at the foot of a rise, after a rest at its last low sample.
    starts = []
    for foot in rises_in(conditions, thresholds)[:, 0]:
        level = load[foot] + 0.25 * threshold
        end = int(foot)
        while end + 1 < load.size and load[end + 1] <= level:
            end += 1
        starts.append(end)
    fewest = 2 * thresholds.held_out_every  # so that at least two are held out
    if len(starts) < fewest:
        parts = np.arange(load.size) * (2 * fewest) // load.size
        return np.asarray(parts, dtype=np.intp)
    cycle = np.zeros(load.size, dtype=np.intp)
    cycle[starts[1:]] = 1
    return np.cumsum(cycle)
