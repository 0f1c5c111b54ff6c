"""One of several recordings whose reading is late by a tenth of a second is told by what the others foretell of it."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.signal import lfilter

from simulators.hidden.recordings import HiddenCase, hide
from smartshoe import Recording, diagnose
from smartshoe.diagnosis import Thresholds
from smartshoe.integrity import examine
from smartshoe.integrity._apart import apart_s
from smartshoe.integrity._clocks import UNSEEN, Lags

Array = NDArray[np.float64]

STANDARD = Thresholds()
STEP_S = 0.01


def _run(late_s: float, seed: int, *, sign: float = 1.0, noise: float = 0.1) -> Recording:
    """Ramps of several rates; a third of the reading follows slowly."""
    rng = np.random.default_rng(seed)
    lasts_s = np.repeat(rng.uniform(0.3, 3.0, 20), 2)
    corners_s = np.concatenate([[0.0, 2.0], 2.0 + np.cumsum(lasts_s)])
    loads = np.concatenate([[0.0, 0.0], np.ravel([[height, 0.0] for height in rng.uniform(0.5, 1.0, 20)])])
    time_s = np.arange(0.0, corners_s[-1] + 2.0, STEP_S)
    load = np.interp(time_s, corners_s, loads)
    read = np.interp(time_s - late_s, corners_s, loads)
    keep = np.exp(-STEP_S / 2.0)
    read = 0.7 * read + 0.3 * lfilter([1.0 - keep], [1.0, -keep], read)
    return Recording.from_arrays(
        time_s=time_s,
        force_n=800.0 * load,
        pressure_mbar=sign * 100.0 * read + noise * rng.standard_normal(load.size),
        name=f"run_{seed}",
    )


def _apart(*runs: Recording, lags: tuple[Lags, ...] | None = None) -> dict[int, float]:
    return apart_s(runs, [one.sensor.present for one in runs], lags or (UNSEEN,) * len(runs), STANDARD)


@pytest.mark.parametrize("late_s", [-0.15, -0.1, 0.1, 0.15])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_one_that_is_late_is_told_by_how_much(late_s: float, sign: float) -> None:
    runs = [_run(late_s if seed == 2 else 0.0, seed, sign=sign) for seed in range(4)]
    assert _apart(*runs) == {2: pytest.approx(late_s, abs=0.01)}


def test_two_that_are_late_are_told_each() -> None:
    runs = [_run(lag_s, seed) for seed, lag_s in enumerate((0.0, 0.12, 0.0, 0.0, -0.12, 0.0))]
    assert _apart(*runs) == {1: pytest.approx(0.12, abs=0.03), 4: pytest.approx(-0.12, abs=0.03)}


def test_of_two_recordings_it_is_the_one_with_the_longer_lag_of_its_own() -> None:
    runs = _run(0.1, 1), _run(0.0, 2)
    for lags, found in (((0.02, 0.01), {0: 0.1}), ((0.01, 0.02), {1: -0.1})):
        own = tuple(Lags(np.ones(1), np.array([one])) for one in lags)
        assert _apart(*runs, lags=own) == {place: pytest.approx(lag, abs=0.01) for place, lag in found.items()}


def test_what_all_recordings_share_and_what_a_logger_delays_is_of_no_clock() -> None:
    assert _apart(_run(0.1, 1), _run(0.1, 2)) == {}
    assert _apart(_run(0.0, 1), _run(0.03, 2)) == {}
    assert _apart(_run(0.1, 1)) == {}
    assert _apart(_run(0.0, 1), _run(0.1, 2).taken(slice(0, 50))) == {}


def test_loads_of_a_few_percent_about_one_that_stands_tell_as_much() -> None:
    runs = [_run(lag_s, seed) for seed, lag_s in ((1, 0.0), (2, 0.1), (3, 0.0))]
    small = [one.with_channel(one.load.with_values(800.0 + 0.02 * one.load.values)) for one in runs]
    assert _apart(*small) == {1: pytest.approx(0.1, abs=0.01)}
    still = [one.with_channel(one.load.with_values(np.full(len(one), 5.0))) for one in runs]
    assert _apart(*still) == {}


def test_nor_is_a_lag_that_does_not_foretell_far_better() -> None:
    """Noise hides it."""
    assert _apart(_run(0.0, 1, noise=20.0), _run(0.1, 2, noise=20.0)) == {}


def _late(recording: Recording, by_s: float) -> Recording:
    time_s, sensor = recording.time_s, recording.sensor
    return recording.with_channel(sensor.with_values(np.interp(time_s - by_s, time_s, sensor.with_nan())))


@cache
def _sound(protocol: str) -> HiddenCase:
    return hide({}, protocol=protocol, seed=12, recordings=2)


@pytest.mark.parametrize("protocol", ["rates", "walking", "holds", "staircase", "shuffled", "step", "minor_loops"])
@pytest.mark.parametrize("by_s", [0.0, 0.1, -0.1])
def test_sound_units_are_told_two_clocks_where_there_are_two(protocol: str, by_s: float) -> None:
    case = _sound(protocol)
    found = examine([case.recordings[0], _late(case.recordings[1], by_s), *case.hold_out], STANDARD)
    assert found.clock_offset_s == pytest.approx((0.0, by_s, 0.0), abs=0.02)
    told = [(fault.kind, fault.recording) for fault in found.faults if fault.kind == "two_clocks"]
    assert told == ([("two_clocks", 1)] if by_s else [])


@pytest.mark.parametrize("protocol", ["walking", "staircase"])
def test_a_sound_unit_of_which_one_recording_is_late_is_as_good_as_another(protocol: str) -> None:
    case = _sound(protocol)
    found = diagnose([_late(case.recordings[0], 0.1), case.recordings[1]], case.hold_out)
    in_time = diagnose(case.recordings, case.hold_out)
    assert found.verdict == in_time.verdict
    assert [one.name for one in found.causes] == [one.name for one in in_time.causes]
    (said,) = [fault.says for fault in found.data_faults if fault.kind == "two_clocks"]
    assert "the reading is 0.10 s late, more than in the other recordings" in said
    assert "s earlier to the load's clock before anything else" in found.limits[0]
