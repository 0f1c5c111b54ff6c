"""A channel that is read more slowly than its table, and held: only the moments at which it was read are used."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from smartshoe import Recording, diagnose
from smartshoe.integrity import examine
from smartshoe.integrity._held_rate import without_held
from smartshoe.integrity.thresholds import Thresholds
from smartshoe.signals.lags import lagged

Array = NDArray[np.float64]
STANDARD = Thresholds()
STEP_S = 0.01


def _load_n(rates_n_per_s: tuple[float, ...] = (100.0, 250.0, 400.0)) -> Array:
    """Three triangles to 500 N at each rate, with rests."""
    corners_s, corners_n, at_s = [0.0], [0.0], 1.0
    for rate in (*rates_n_per_s,) * 3:
        for to in (0.0, 500.0, 0.0):
            at_s += 500.0 / rate if to or corners_n[-1] else 1.0
            corners_s.append(at_s)
            corners_n.append(to)
    return np.interp(np.arange(0.0, at_s, STEP_S), corners_s, corners_n)


def _held(values: Array, count: int) -> Array:
    return values[np.arange(values.size) // count * count]


def _recording(load_n: Array, reading_mbar: Array, name: str = "run") -> Recording:
    time_s = STEP_S * np.arange(load_n.size)
    return Recording.from_arrays(time_s=time_s, force_n=load_n, pressure_mbar=reading_mbar, name=name)


@settings(max_examples=25)
@given(st.integers(2, 12), st.sampled_from(["load", "reading"]), st.integers(0, 2**16))
def test_a_channel_that_is_held_is_used_where_it_was_read(count: int, which: str, seed: int) -> None:
    load_n = _load_n()
    noise = 0.05 * np.random.default_rng(seed).standard_normal(load_n.size)
    reading = 0.2 * load_n + noise
    given_ = _recording(_held(load_n, count), reading) if which == "load" else _recording(load_n, _held(reading, count))
    ((taken, (finding,)),) = without_held([given_], STANDARD)
    assert (finding.kind, finding.masks) == ("held_samples", False)
    assert finding.says.startswith(f"{'force' if which == 'load' else 'pressure'} is read every {0.01 * count:.3g} s")
    kept = np.round(taken.time_s / STEP_S).astype(int)
    assert (kept % count == 0).all()
    assert kept.size == pytest.approx(load_n.size / count, abs=2.0)
    np.testing.assert_array_equal(taken.force_n, load_n[kept])
    np.testing.assert_array_equal(taken.sensor.values, reading[kept])


@given(st.sampled_from([0.2, 1.0, 5.0]), st.integers(0, 2**16))
def test_a_coarse_grid_is_no_channel_that_is_held(grid_mbar: float, seed: int) -> None:
    load_n = _load_n()
    reading = 0.2 * load_n + 0.3 * grid_mbar * np.random.default_rng(seed).standard_normal(load_n.size)
    given_ = _recording(load_n, grid_mbar * np.round(reading / grid_mbar))
    assert without_held([given_], STANDARD) == [(given_, [])]
    # Nor is a load without noise, of one rate or several, on the grid of its converter.
    for rates in ((100.0,), (100.0, 250.0, 400.0)):
        coarse = _load_n(rates)
        smooth = _recording(5.0 * np.round(coarse / 5.0), 0.2 * coarse)
        assert without_held([smooth], STANDARD) == [(smooth, [])]


def test_what_one_recording_shows_holds_for_the_others() -> None:
    """Of one rate alone a load that is held looks as on a coarse grid."""
    several, single = (_recording(_held(load, 10), 0.2 * load) for load in (_load_n(), _load_n((250.0,))))
    assert without_held([single], STANDARD) == [(single, [])]
    (_, of_several), (taken, of_single) = without_held([several, single], STANDARD)
    assert len(of_several) == len(of_single) == 1
    assert np.diff(taken.time_s) == pytest.approx(0.1)


def test_a_plain_unit_whose_load_is_held_has_no_delay() -> None:
    runs = []
    for seed, rates in enumerate(((100.0, 250.0, 400.0), (150.0, 300.0))):
        load_n = _load_n(rates)
        noise = 0.05 * np.random.default_rng(seed).standard_normal(load_n.size)
        runs.append(_recording(_held(load_n, 10), 0.2 * load_n + noise, f"run_{seed}"))
    assert len(examine(runs).recordings[0]) == pytest.approx(len(runs[0]) / 10, abs=2)
    found = diagnose(runs)
    assert (found.verdict, found.causes) == ("adequate", ())
    assert sum(fault.kind == "held_samples" for fault in found.data_faults) == 2


def _stairs(count: int, seed: int, samples: int = 1500) -> Array:
    """A load that a converter sets anew every ``count`` samples, to anything."""
    drawn = np.random.default_rng(seed).uniform(20.0, 400.0, samples // count + 1)
    return np.repeat(drawn, count)[:samples]


def _behind(load_n: Array, lag: float, delay: int, seed: int) -> Array:
    """What lags behind a load, and comes after a delay (samples), with noise of 0.1 % of its span."""
    late = np.concatenate([np.full(delay, load_n[0]), load_n[: load_n.size - delay]])
    return 0.2 * lagged(late, 1.0, lag) + 0.08 * np.random.default_rng(seed).standard_normal(load_n.size)


COUNTS = pytest.mark.parametrize("count", [5, 12, 40])
UNITS = pytest.mark.parametrize(("lag", "delay"), [(0.1, 0), (3.0, 2), (12.0, 1)])


@COUNTS
@UNITS
@settings(max_examples=4)
@given(seed=st.integers(0, 2**16))
def test_a_load_that_was_set_step_by_step_is_known_between_its_steps(
    count: int, lag: float, delay: int, seed: int
) -> None:
    load_n = _stairs(count, seed)
    given_ = _recording(load_n, _behind(load_n, lag, delay, seed))
    assert without_held([given_], STANDARD) == [(given_, [])]


@COUNTS
@UNITS
@settings(max_examples=4)
@given(seed=st.integers(0, 2**16))
def test_a_load_that_went_on_while_its_value_stood_is_used_where_it_was_read(
    count: int, lag: float, delay: int, seed: int
) -> None:
    """The same values, between which the load went in lines."""
    at = np.arange(0, 1500, count)
    load_n = np.interp(np.arange(1500), at, _stairs(count, seed)[at])
    given_ = _recording(_held(load_n, count), _behind(load_n, lag, delay, seed))
    ((taken, findings),) = without_held([given_], STANDARD)
    assert [one.kind for one in findings] == ["held_samples"]
    assert len(taken) == pytest.approx(1500 / count, abs=2)


def test_a_short_recording_of_a_staircase_is_not_refused() -> None:
    load_n = _stairs(9, 4, 400)
    found = examine([_recording(load_n, _behind(load_n, 4.0, 2, 4))])
    assert (found.faults, found.refusals) == ((), ())
    assert len(found.recordings[0]) == 400


def test_a_table_of_a_blank_and_a_held_channel_is_used_at_the_moments_of_both() -> None:
    """And each of the two findings is of all samples that remain."""
    load_n = _load_n()
    reading = 0.2 * load_n + 0.05 * np.random.default_rng(1).standard_normal(load_n.size)
    reading[1::2] = np.nan
    found = examine([_recording(_held(load_n, 10), reading)])
    (taken,) = found.recordings
    assert len(taken) == pytest.approx(load_n.size / 10, abs=2)
    assert [(one.kind, one.share) for one in found.faults] == [("missing_samples", 1.0), ("held_samples", 1.0)]
    assert {(one.start_s, one.stop_s) for one in found.faults} == {(taken.time_s[0], taken.time_s[-1])}


@pytest.mark.parametrize("rest_s", [20.0, 60.0])
def test_a_load_that_was_set_step_by_step_after_a_preload_is_known_between_its_steps(rest_s: float) -> None:
    """Longer than the first four thousand samples after its first change: it is told where it moves."""
    stairs = 1.0 + np.round(_held(_load_n(), 10), 2)
    preload = np.ones(round(rest_s / STEP_S))
    load_n = np.concatenate([np.zeros(100), preload, stairs])
    given_ = _recording(load_n, _behind(load_n, 3.0, 0, 1))
    assert without_held([given_], STANDARD) == [(given_, [])]
    went_on = np.concatenate([np.zeros(100), preload, 1.0 + _load_n()])
    given_ = _recording(load_n, _behind(went_on, 3.0, 0, 1))
    ((taken, findings),) = without_held([given_], STANDARD)
    assert [one.kind for one in findings] == ["held_samples"]
    assert len(taken) == pytest.approx(load_n.size / 10, abs=2)
