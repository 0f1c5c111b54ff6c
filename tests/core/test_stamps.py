"""The step between stamps: of rounded ones that of the grid they came from, of others the median to the last bit."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from smartshoe.arrays import Array
from smartshoe.recording import Recording, sample_rate_of
from smartshoe.stamps import rounded_grid_step_s, usual_step_s


def _median_s(time_s: Array) -> float:
    return float(np.median(np.diff(time_s)))


def _recording(time_s: Array) -> Recording:
    return Recording.from_arrays(time_s=time_s, force_n=np.zeros(time_s.size))


def test_120_hz_to_four_decimals_is_120_hz() -> None:
    recording = _recording(np.round(np.arange(6000) / 120.0, 4))
    assert 1.0 / _median_s(recording.time_s) == pytest.approx(120.482, abs=1e-3)
    assert 1.0 / recording.sample_time_s == pytest.approx(120.0, rel=1e-6)
    assert recording.sample_rate_hz == 1.0 / recording.sample_time_s


def test_digits_that_become_fewer_decimals_as_time_goes_on() -> None:
    time_s = np.array([float(f"{one:.6g}") for one in np.arange(18000) / 120.0])
    assert 1.0 / usual_step_s(time_s) == pytest.approx(120.0, rel=1e-6)


@given(
    rate_hz=st.floats(20.0, 1000.0),
    decimals=st.integers(3, 6),
    start_s=st.floats(0.0, 100.0),
    missing=st.floats(0.0, 0.2),
    seed=st.integers(0, 2**32 - 1),
)
def test_any_rate_is_told_from_rounded_stamps_with_samples_missing(
    rate_hz: float, decimals: int, start_s: float, missing: float, seed: int
) -> None:
    rounding_s = 10.0**-decimals
    assume(rounding_s * rate_hz < 0.5)  # else a stamp rounded away and a missing sample look alike
    count = max(200, int(1.2e4 * rounding_s * rate_hz))  # else no end of the recording tells 1e-4
    there = np.random.default_rng(seed).random(count) >= missing
    time_s = np.round(start_s + np.flatnonzero(there) / rate_hz, decimals)
    assert 1.0 / usual_step_s(time_s) == pytest.approx(rate_hz, rel=1e-4)
    assert sample_rate_of(time_s) == pytest.approx(rate_hz, rel=1e-4)


@pytest.mark.parametrize("pause_s", [3.71234, 3600.0042])
def test_a_pause_that_is_no_whole_number_of_steps_parts_the_stamps(pause_s: float) -> None:
    grid_s = np.arange(1200) / 120.0
    time_s = np.round(np.concatenate([grid_s, grid_s[-1] + pause_s + grid_s]), 4)
    assert 1.0 / usual_step_s(time_s) == pytest.approx(120.0, rel=1e-5)


def test_stamps_that_scatter_more_than_they_were_rounded_keep_the_median_step() -> None:
    scattered_s = np.arange(5000) / 90.0 + np.random.default_rng(1).uniform(-0.001, 0.001, 5000)
    time_s = np.round(scattered_s, 3)
    assert usual_step_s(time_s) == _median_s(time_s)


EXACT = {
    "to the last digit": np.arange(3000) * 0.01,
    "no round number of decimals": np.arange(3000) / 120.0,
    "samples missing": np.delete(np.arange(3000), np.arange(7, 3000, 31)) * 0.01,
    "a pause": np.concatenate([np.arange(1000) * 0.01, 123.456 + np.arange(1000) * 0.01]),
    "two samples": np.array([0.0, 0.013]),
}


@pytest.mark.parametrize("name", EXACT)
def test_an_exact_grid_keeps_its_median_step(name: str) -> None:
    assert rounded_grid_step_s(EXACT[name]) is None
    assert _recording(EXACT[name]).sample_time_s == _median_s(EXACT[name])


def test_two_rates_keep_the_median_step() -> None:
    """Fast, then slowly: no one grid has both, whatever the digits."""
    for fast, slow in ((1000, 500), (500, 1000), (700, 1500)):
        begun_s = np.arange(fast) * 0.01
        time_s = np.round(np.concatenate([begun_s, begun_s[-1] + 0.02 * np.arange(1, slow)]), 2)
        assert usual_step_s(time_s) == _median_s(time_s)


def test_scattered_stamps_that_were_not_rounded_keep_the_median_step() -> None:
    time_s = np.arange(1000) / 33.0 + np.random.default_rng(2).uniform(-0.004, 0.004, 1000)
    assert usual_step_s(time_s) == _median_s(time_s)
    assert sample_rate_of(time_s) == pytest.approx(33.0, rel=1e-3)


@pytest.mark.parametrize(("places", "early_s"), [([150, 400, 700], 0.021), ([500], 0.02)])
def test_a_few_stamps_that_come_as_they_like_move_no_step(places: list[int], early_s: float) -> None:
    """A log of 25 Hz that writes a row half a step early when the machine turns."""
    steps_s = np.full(874, 0.04)
    steps_s[places] = early_s
    time_s = np.concatenate([[0.0], np.cumsum(steps_s)]).round(3)
    assert usual_step_s(time_s) == _median_s(time_s)
