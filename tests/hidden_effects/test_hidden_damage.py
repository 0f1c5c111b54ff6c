"""A wall that what it has borne has made softer at all loads, hyperbolically, the first loading included."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from bank import PLAIN, within_reach

from smartshoe.diagnosis import diagnose
from smartshoe.recording import Recording

GAINED = 0.5
HALF_WAY = 0.6  # of full scale: the largest load by which half of it is there


def _damaged(recording: Recording, full_scale_n: float) -> Recording:
    """Every recording begins anew: the wall has recovered."""
    reading = recording.sensors[0]
    # A mean over samples, so that noise makes no maximum.
    quiet = np.convolve(recording.force_n, np.full(15, 1.0 / 15.0), "same")
    most = np.maximum.accumulate(np.maximum(quiet, 0.0)) / full_scale_n
    zero = float(np.median(reading.values[:50]))
    grown = zero + (reading.values - zero) * (1.0 + GAINED * most / (HALF_WAY + most))
    return recording.with_channel(replace(reading, values=grown))


@pytest.mark.parametrize("seed", range(4))
def test_a_wall_that_is_damaged_by_its_largest_load_is_told(seed: int) -> None:
    """Not as softening below the largest load and a bent sensor beside it."""
    case = within_reach({}, PLAIN[seed % len(PLAIN)], seed, recordings=2)
    full_scale_n = max(float(one.force_n.max()) for one in case.recordings)
    fitted, held_out = ([_damaged(one, full_scale_n) for one in some] for some in (case.recordings, case.hold_out))
    found = diagnose(fitted, held_out)
    assert found.verdict == "explained"
    told = found.causes[0]
    assert told.name == "mullins_softening"
    assert told.parameters["at_once"].value > 0.5
    assert found.explained_percent > 0.8 * found.explainable_percent
