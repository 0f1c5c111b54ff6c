"""Walls that soften as no equation of the catalogue says: hyperbolically, by the load's way or by its peaks."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from bank import PLAIN, within_reach
from daily import first_and_bank

from smartshoe.arrays import Array
from smartshoe.diagnosis import diagnose
from smartshoe.recording import Recording

COARSE = 25  # samples: finer noise makes no way and no peak


def by_way(load: Array) -> Array:
    """8 % in the end, half of it after four full scales up and down, whatever the cycles are."""
    way = np.cumsum(np.abs(np.diff(load, prepend=load[0])))
    return 0.08 * way / (4.0 + way)


def by_peak(load: Array) -> Array:
    """By the largest load that was borne, at all loads, the first loading included; half at 60 % of full scale."""
    most = np.maximum.accumulate(np.maximum(load, 0.0))
    return 0.5 * most / (0.6 + most)


def _softened(recording: Recording, full_scale_n: float, gained: Callable[[Array], Array]) -> Recording:
    """Every recording begins anew: the wall has recovered."""
    reading = recording.sensors[0]
    samples = np.arange(len(recording))
    load = np.interp(samples, samples[::COARSE], recording.force_n[::COARSE]) / full_scale_n
    zero = float(np.median(reading.values[:50]))
    grown = zero + (reading.values - zero) * (1.0 + gained(load))
    return recording.with_channel(replace(reading, values=grown))


@pytest.mark.parametrize(
    ("gained", "name", "shape", "share"),
    [(by_way, "cycle_conditioning", "by_way", 0.9), (by_peak, "mullins_softening", "at_once", 0.8)],
)
@pytest.mark.parametrize("seed", first_and_bank(range(4), {0}))
def test_a_wall_that_softens_by_a_law_of_its_own_is_told(
    gained: Callable[[Array], Array], name: str, shape: str, share: float, seed: int
) -> None:
    """It is the first cause: no bent sensor, no drift of the gain comes before it."""
    case = within_reach({}, PLAIN[seed % len(PLAIN)], seed, recordings=2)
    full_scale_n = max(float(one.force_n.max()) for one in case.recordings)
    fitted, held_out = (
        [_softened(one, full_scale_n, gained) for one in some] for some in (case.recordings, case.hold_out)
    )
    found = diagnose(fitted, held_out)
    assert found.verdict == "explained"
    told = found.causes[0]
    assert told.name == name
    assert told.confidence > 0.5
    assert told.parameters[shape].value > 0.5
    assert found.explained_percent > share * found.explainable_percent
