"""A gain that settles with the way that the load has gone, hyperbolically, whatever the cycles are."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from bank import PLAIN, within_reach

from smartshoe.diagnosis import diagnose
from smartshoe.recording import Recording

GAINED = 0.08
HALF_WAY = 4.0  # full scales, up and down, after which half of it is there


def _settling(recording: Recording, full_scale_n: float) -> Recording:
    """Every recording begins anew: the wall has recovered."""
    reading = recording.sensors[0]
    # Blocks of samples, so that noise makes no way.
    coarse = np.interp(np.arange(len(recording)), np.arange(0, len(recording), 25), recording.force_n[::25])
    way = np.cumsum(np.abs(np.diff(coarse, prepend=coarse[0]))) / full_scale_n
    zero = float(np.median(reading.values[:50]))
    grown = zero + (reading.values - zero) * (1.0 + GAINED * way / (HALF_WAY + way))
    return recording.with_channel(replace(reading, values=grown))


@pytest.mark.parametrize("seed", range(4))
def test_a_gain_that_settles_with_the_loads_way_is_told(seed: int) -> None:
    case = within_reach({}, PLAIN[seed % len(PLAIN)], seed, recordings=2)
    full_scale_n = max(float(one.force_n.max()) for one in case.recordings)
    fitted, held_out = ([_settling(one, full_scale_n) for one in some] for some in (case.recordings, case.hold_out))
    found = diagnose(fitted, held_out)
    assert found.verdict == "explained"
    told = found.causes[0]
    assert told.name == "cycle_conditioning"
    assert told.confidence > 0.5
    assert told.parameters["by_way"].value > 0.5
    assert found.explained_percent > 0.9 * found.explainable_percent
