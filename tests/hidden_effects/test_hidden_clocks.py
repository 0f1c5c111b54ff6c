"""Loads and readings that two devices logged, started by hand: in each file the reading is late by another time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from bank import PLAIN, within_reach
from daily import first_and_bank

from smartshoe.diagnosis import Diagnosis, diagnose
from smartshoe.recording import Recording

LAGS_S = (0.018, -0.012, 0.005)


def _late(recording: Recording, lag_s: float) -> Recording:
    reading, time_s = recording.sensor, recording.time_s
    return recording.with_channel(replace(reading, values=np.interp(time_s - lag_s, time_s, reading.values)))


def _found(effects: dict[str, float], seed: int, lags_s: Sequence[float]) -> Diagnosis:
    case = within_reach(effects, PLAIN[seed % len(PLAIN)], seed, recordings=2)
    runs = [_late(one, lag_s) for one, lag_s in zip((*case.recordings, *case.hold_out), lags_s, strict=True)]
    count = len(case.recordings)
    return diagnose(runs[:count], runs[count:])


@pytest.mark.parametrize("effects", [{}, {"orifice_leak": 1.0}, {"wall_hardening": 1.0}, {"play_hysteresis": 1.0}])
@pytest.mark.parametrize("seed", first_and_bank(range(4), {1}))
def test_files_that_are_each_late_by_another_time_have_their_units_causes_and_no_delay(
    effects: dict[str, float], seed: int
) -> None:
    late, at_once = (_found(effects, seed, lags_s) for lags_s in (LAGS_S, (0.0, 0.0, 0.0)))
    assert {cause.effect.kind for cause in late.causes} == {cause.effect.kind for cause in at_once.causes}
    assert late.verdict == at_once.verdict
    told = [said for said in late.limits if "as with two clocks" in said]
    assert len(told) == len(LAGS_S)
    assert all("delays of this recording are not diagnosed" in said for said in told)
