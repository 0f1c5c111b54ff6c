"""Repeated cycles are found and laid on each other whatever the rests between them and wherever the samples fall."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from presses import press

from smartshoe.identification import identify
from smartshoe.identification._cycles import averaged_reading, repeated_cycles
from smartshoe.recording import Recording


def triangles(rates: list[float], rests_s: list[float], shift_s: float = 0.0, noise_n: float = 0.0) -> Recording:
    """Triangles to 800 N, each after a rest, sampled at 100 Hz from ``shift_s`` on; the reading is half the load."""
    at, load = [0.0], [0.0]
    for rate, rest_s in zip(rates, rests_s, strict=True):
        start = at[-1] + rest_s
        at += [start, start + 800.0 / rate, start + 1600.0 / rate]
        load += [0.0, 800.0, 0.0]
    time_s = np.arange(shift_s, at[-1] + 1.0, 0.01)
    force_n = np.interp(time_s, at, load)
    noisy = force_n + noise_n * np.random.default_rng(0).standard_normal(time_s.size)
    return Recording.from_arrays(time_s=time_s, force_n=noisy, pressure_mbar=0.5 * force_n)


@settings(max_examples=25, deadline=None)
@given(
    rests_s=st.lists(st.floats(0.5, 5.0), min_size=2, max_size=5),
    shift_s=st.floats(0.0, 0.0099),
    rate=st.sampled_from([50.0, 200.0, 800.0]),
)
def test_repeats_lie_on_each_other_for_any_rests_and_sampling_phase(
    rests_s: list[float], shift_s: float, rate: float
) -> None:
    recording = triangles([rate] * len(rests_s), rests_s, shift_s)
    (group,) = repeated_cycles([recording])
    assert len(group.repeats) == len(rests_s)
    assert group.rate_n_per_s == pytest.approx(rate, rel=1e-9)
    # The level half-way to the highest sample, which may lie half a step from the peak.
    assert group.duration_s == pytest.approx(800.0 / rate, abs=0.005)


@pytest.mark.parametrize("base_n", [0.0, 150.0])
def test_a_cycle_is_laid_by_the_level_half_way_up_from_its_own_foot(base_n: float) -> None:
    """Repeats that last 4 % longer or shorter lie on each other between mid-rise and mid-fall."""
    at, load, tops = [0.0], [base_n], []
    for slower in (1.0, 1.04, 0.96):
        start = at[-1] + 2.0
        at += [start, start + 4.0 * slower, start + 8.0 * slower]
        load += [base_n, base_n + 600.0, base_n]
        tops.append(at[-2])
    time_s = np.arange(0.0, at[-1] + 1.0, 0.01)
    force_n = np.interp(time_s, at, load)
    recording = Recording.from_arrays(time_s=time_s + 7.0, force_n=force_n, pressure_mbar=0.5 * force_n)
    (group,) = repeated_cycles([recording])
    assert (group.level_n, group.peak_n) == (
        pytest.approx(base_n + 300.0, abs=1.0),
        pytest.approx(base_n + 600.0, abs=1),
    )
    assert group.duration_s == pytest.approx(4.0, rel=0.01)
    for repeat, top_s, slower in zip(group.repeats, tops, (1.0, 1.04, 0.96), strict=True):
        assert (repeat.base_n, repeat.peak_n) == (pytest.approx(base_n, abs=2), pytest.approx(base_n + 600.0, abs=1))
        assert repeat.duration_s == pytest.approx(4.0 * slower, rel=0.01)
        up, down = repeat.crossings_s(base_n + 300.0)
        assert (up, down) == (
            pytest.approx(top_s - 2.0 * slower, abs=0.02),
            pytest.approx(top_s + 2.0 * slower, abs=0.02),
        )
        places = group.places_s(repeat, [recording])
        own = time_s[repeat.start : repeat.stop]
        assert np.interp([up, down], own, places) == pytest.approx([0.0, group.duration_s], abs=0.01)
        assert np.interp(top_s, own, places) == pytest.approx(0.5 * group.duration_s, abs=0.02)
        covered = places[group.covers(places)]
        assert (covered[0], covered[-1]) == (
            pytest.approx(group.first_s, abs=0.02),
            pytest.approx(group.last_s, abs=0.02),
        )
    assert group.first_s < -1.5
    assert group.last_s > 1.4 * group.duration_s


def test_of_a_long_rest_no_more_counts_than_the_cycle_lasts() -> None:
    (group,) = repeated_cycles([triangles([400.0, 400.0], [2.0, 60.0])])
    assert group.last_s == pytest.approx(2.5 * group.duration_s) or group.last_s < 2.5 * group.duration_s
    (longer,) = repeated_cycles([triangles([400.0, 400.0, 400.0], [2.0, 60.0, 60.0]), triangles([400.0], [2.0])])
    assert longer.last_s < 2.5 * longer.duration_s + 1e-9


def test_a_hold_at_the_top_makes_another_kind() -> None:
    plain = triangles([200.0, 200.0], [2.0, 2.0])
    time_s = np.arange(0.0, 28.0, 0.01)
    held_n = np.interp(time_s, [0.0, 2.0, 6.0, 8.0, 12.0, 14.0, 18.0, 20.0, 24.0], [0, 0, 800, 800, 0, 0, 800, 800, 0])
    held = Recording.from_arrays(time_s=time_s, force_n=held_n, pressure_mbar=0.5 * held_n)
    durations = sorted(group.duration_s for group in repeated_cycles([plain, held]))
    assert durations == pytest.approx([4.0, 6.0], rel=0.01)


def test_rates_and_peaks_are_told_apart() -> None:
    recording = triangles([100.0, 200.0, 103.0, 205.0, 400.0], [2.0, 1.0, 3.0, 2.0, 2.0], noise_n=1.0)
    groups = repeated_cycles([recording])
    assert [len(group.repeats) for group in groups] == [2, 2]
    assert [group.rate_n_per_s for group in groups] == pytest.approx([101.5, 202.5], rel=0.01)
    assert len(repeated_cycles([recording], skip_first=1)) == 1


def test_repeats_are_found_across_recordings() -> None:
    several = [triangles([400.0], [rest_s]) for rest_s in (1.0, 2.3, 3.1)]
    (group,) = repeated_cycles(several)
    assert [repeat.recording for repeat in group.repeats] == [0, 1, 2]
    assert not repeated_cycles(several[:1])


def test_the_averaged_reading_leaves_the_samples_own_noise_out() -> None:
    clean = triangles([200.0] * 4, [1.0, 2.0, 1.5, 1.7])
    rng = np.random.default_rng(1)
    noise = 3.0 * rng.standard_normal(len(clean))
    noisy = Recording.from_arrays(
        time_s=clean.time_s, force_n=clean.force_n, pressure_mbar=clean.sensor.values + noise + 7.0
    )
    (averaged,) = averaged_reading([noisy])
    inside = np.isfinite(averaged)
    assert 0.8 < inside.mean() < 1.0
    error = averaged[inside] - clean.sensor.values[inside] - 7.0
    count = int(inside.sum())
    # Independent noises correlate by 1/sqrt(n); neighbours share an interpolated sample, which doubles it at most.
    assert abs(np.corrcoef(error, noise[inside])[0, 1]) < 5 * 2 / np.sqrt(count)
    # Of three others the mean has 3/sqrt(3), less what interpolation smooths; corners and the rest's level add little.
    assert 0.6 * 3.0 / np.sqrt(3) < error.std() < 1.15 * 3.0 / np.sqrt(3)


def test_a_missing_sample_is_missing_in_no_more_than_its_neighbourhood() -> None:
    plain = press(repeats=3)
    gappy = press(repeats=3, gap=slice(1400, 1460))
    whole, lacking = averaged_reading([plain])[0], averaged_reading([gappy])[0]
    assert np.isfinite(lacking).sum() == np.isfinite(whole).sum()


def test_averaged_cycles_as_instruments_take_the_readings_noise_out_of_the_pole() -> None:
    recording = press(load_noise=1.0, reading_noise=4.0, repeats=4, rates=(100.0, 200.0, 400.0, 800.0))
    plain = identify(recording, estimator="output_error").parameters["a1"]
    instrumental = identify(recording, estimator="cycles").parameters["a1"]
    assert abs(instrumental.value - 0.215) < 4 * instrumental.sd
    assert abs(plain.value - 0.215) > 4 * plain.sd
