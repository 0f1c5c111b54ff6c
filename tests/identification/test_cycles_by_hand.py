"""Cycles that repeat, and rates that are left out: numbers done by hand."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.typing import NDArray
from presses import press

from smartshoe.identification._cycles import (
    CycleGroup,
    Repeat,
    _are_alike,
    _at,
    _line,
    _mean_of_finite,
    averaged_reading,
    repeated_cycles,
)
from smartshoe.identification._experiment import prepare
from smartshoe.identification.leave_out import (
    _compensated,
    _error_of_unseen,
    _figures,
    _force_error,
    _in_one_unit,
    _span_of,
)
from smartshoe.models import simulate
from smartshoe.models.first_order import shifted
from smartshoe.recording import Recording
from smartshoe.signals import loading

Array = NDArray[np.float64]


# -- cycles ----------------------------------------------------------------------------------------------------------
UP_AND_DOWN = Repeat(0, 0, 10, base_n=100.0, peak_n=700.0, rise=(200.0, -100.0), fall=(-100.0, 1500.0))


def test_two_lines_cross_a_level_and_last_from_mid_rise_to_mid_fall() -> None:
    """The load is 200 t - 100 on the way up and 1500 - 100 t on the way down."""
    assert UP_AND_DOWN.rate_n_per_s == 150.0
    assert UP_AND_DOWN.crossings_s(300.0) == (2.0, 12.0)
    assert UP_AND_DOWN.duration_s == pytest.approx(11.0 - 2.5)


def test_a_line_is_fitted_through_the_middle_of_a_ramp() -> None:
    time_s = 2.0 + np.arange(20) / 9.7
    load = 50.0 + 300.0 * (time_s - 2.0)
    load[:2], load[-2:] = 50.0, 650.0  # corners, below a tenth of the way and above nine
    assert _line(time_s, load, 50.0, 650.0) == pytest.approx((300.0, -550.0))
    bent = load.copy()
    bent[12] += 7.0
    inner = slice(2, 18)
    assert _line(time_s, bent, 50.0, 650.0) == pytest.approx(tuple(np.polyfit(time_s[inner], bent[inner], 1)))


@pytest.mark.parametrize(
    ("progress", "is_line"),
    [([0.0, 0.5, 1.0], False), ([0.0, 0.3, 0.7, 1.0], True), ([0.0, 0.125, 0.875, 1.0], True),
     ([0.0, 0.0625, 0.5, 0.9375, 1.0], False), ([0.0, 0.15, 0.5, 1.0], True)],
)  # fmt: skip
def test_two_samples_between_a_tenth_and_nine_tenths_make_a_line(progress: list[float], is_line: bool) -> None:
    load = 40.0 + 80.0 * np.array(progress)
    assert (_line(np.arange(load.size, dtype=float), load, 40.0, 120.0) is not None) is is_line


@pytest.mark.parametrize(
    ("changes", "are_alike"),
    [
        ({}, True),
        ({"rise": (216.0, -100.0)}, True),
        ({"peak_n": 730.0}, True),
        ({"peak_n": 740.0}, False),
        ({"peak_n": 660.0}, False),
        # Both ramps steeper, with their middles where they were.
        ({"rise": (218.0, -145.0), "fall": (-109.0, 1599.0)}, True),
        ({"rise": (224.0, -160.0), "fall": (-112.0, 1632.0)}, False),
        ({"rise": (176.0, -40.0), "fall": (-88.0, 1368.0)}, False),
        # Held for longer or shorter at the top.
        ({"fall": (-100.0, 1580.0)}, True),
        ({"fall": (-100.0, 1590.0)}, False),
        ({"fall": (-100.0, 1410.0)}, False),
    ],
)
def test_cycles_are_alike_within_a_tenth_of_rate_and_length_and_a_twentieth_of_peak(
    changes: dict[str, float], are_alike: bool
) -> None:
    assert _are_alike(replace(UP_AND_DOWN, **changes), [UP_AND_DOWN, UP_AND_DOWN]) is are_alike  # type: ignore[arg-type]


def test_the_ends_that_every_repeat_covers_belong_to_it() -> None:
    group = CycleGroup(1.0, 1.0, 1.0, 1.0, -0.5, 2.0, ())
    assert group.covers(np.array([-0.6, -0.5, 0.0, 2.0, 2.1])).tolist() == [False, True, True, True, False]


def test_a_mean_is_of_those_that_are_there() -> None:
    rows = np.array([[1.0, np.nan, np.nan, 4.0], [3.0, 5.0, np.nan, 0.0], [8.0, np.nan, np.nan, -1.0]])
    assert _mean_of_finite(rows) == pytest.approx([4.0, 5.0, np.nan, 1.0], nan_ok=True)


def _triangles(peaks_s: tuple[float, ...], end_s: float, begin_s: float = 0.0, zero: float = 0.0) -> Recording:
    """Triangles of 2 s up and 2 s down to 800 N about ``peaks_s``, and a reading that drifts and rises with them."""
    time_s = np.arange(0.0, end_s, 0.01)
    load = np.maximum.reduce([np.maximum(800.0 - 400.0 * np.abs(time_s - peak), 0.0) for peak in peaks_s])
    reading = zero + 0.5 * load + 0.3 * time_s * (load > 0.0)
    return Recording.from_arrays(time_s=time_s + begin_s, force_n=load, pressure_mbar=reading)


def test_each_cycle_reaches_to_the_next_and_the_last_to_the_end() -> None:
    recordings = [_triangles((3.0, 10.0), 15.0, begin_s=40.0), _triangles((4.0,), 8.0)]
    (group,) = repeated_cycles(recordings)
    first, second, third = group.repeats
    assert [one.recording for one in group.repeats] == [0, 0, 1]
    assert abs(first.start - 100) <= 25
    assert first.stop == second.start
    assert abs(second.start - 800) <= 25
    assert (second.stop, third.stop) == (1500, 800)
    for one, peak in ((first, 3.0), (second, 10.0), (third, 4.0)):
        # Ramps lead a little beyond their ends, where the load rests.
        assert (one.base_n, one.peak_n) == (pytest.approx(0.0, abs=1.0), pytest.approx(800.0, abs=1.0))
        assert one.crossings_s(400.0) == pytest.approx((peak - 1.0, peak + 1.0), abs=0.01)
        places = group.places_s(one, recordings)
        assert places[0] == pytest.approx(0.01 * one.start - (peak - 1.0), abs=0.01)
        assert np.diff(places) == pytest.approx(0.01, rel=1e-2)
    places = [group.places_s(one, recordings) for one in group.repeats]
    assert group.first_s == max(float(place[0]) for place in places)
    # Of 800 samples of the shortest 3 s and more after mid-rise, less than 2.5 times the 2 s that the cycle lasts.
    assert group.last_s == pytest.approx(min(5.0, *(float(place[-1]) for place in places)))
    assert (group.rate_n_per_s, group.level_n) == (pytest.approx(400.0, rel=1e-3), pytest.approx(400.0, abs=1.0))
    assert (group.duration_s, group.peak_n) == (pytest.approx(2.0, rel=1e-3), pytest.approx(800.0, abs=1.0))
    assert len(repeated_cycles(recordings, skip_first=1)) == 0


def test_of_each_sample_the_mean_is_that_of_the_others_with_its_own_zero() -> None:
    recordings = [_triangles((3.0, 10.0), 15.0, begin_s=40.0, zero=30.0), _triangles((4.0,), 8.0, zero=-20.0)]
    (group,) = repeated_cycles(recordings)
    means = averaged_reading(recordings)
    zeros = [30.0, -20.0]
    signals = [one.sensor.values - zero for one, zero in zip(recordings, zeros, strict=True)]
    for repeat in group.repeats:
        places = group.places_s(repeat, recordings)
        inside = group.covers(places)
        others = [one for one in group.repeats if one is not repeat]
        rows = [_at(group, one, recordings, signals, places[inside]) for one in others]
        own = means[repeat.recording][repeat.start : repeat.stop]
        assert own[inside] == pytest.approx(np.mean(rows, axis=0) + zeros[repeat.recording], abs=1e-6)
        assert np.isnan(own[~inside]).all()
    # A second of rest before the first cycle belongs to none.
    assert np.isnan(means[0][:70]).all()


def test_of_a_recording_without_a_reading_at_rest_the_zero_is_nothing() -> None:
    recordings = [_triangles((3.0, 10.0), 15.0), _triangles((4.0,), 8.0)]
    reading = recordings[1].sensor.values.copy()
    reading[recordings[1].force_n <= 45.0] = np.nan
    blind = Recording.from_arrays(
        time_s=recordings[1].time_s, force_n=recordings[1].force_n, pressure_mbar=reading + 5.0
    )
    plain, other = averaged_reading(recordings)[1], averaged_reading([recordings[0], blind])[1]
    both = np.isfinite(plain) & np.isfinite(other)
    assert both.sum() > 300
    assert other[both] == pytest.approx(plain[both], abs=1e-6)


# -- a rate that is left out -----------------------------------------------------------------------------------------
def _found(**changes: object) -> SimpleNamespace:
    zeros = {"a": SimpleNamespace(value=6.0), "b": SimpleNamespace(value=10.0)}
    values = {
        "coefficients": (0.25, 1.6, 0.6), "direction": "inverse", "load_offsets": zeros, "offset": 4.0,
        "delay_s": SimpleNamespace(value=0.013),
    }  # fmt: skip
    return SimpleNamespace(**{**values, **changes})


def test_force_is_the_reading_behind_the_compensator() -> None:
    (experiment,), _ = prepare([press(reading_noise=1.0)])
    force_n = simulate(0.25, 1.6, 0.6, experiment.reading, experiment.time_s)
    assert _compensated(_found(), experiment.reading, experiment) == pytest.approx(force_n)  # type: ignore[arg-type]
    assert _force_error(_found(), experiment, experiment.reading) is experiment.reading  # type: ignore[arg-type]
    turned = _force_error(_found(direction="forward"), experiment, experiment.reading)  # type: ignore[arg-type]
    assert turned == pytest.approx(-force_n)


@pytest.mark.parametrize("rests", [True, False])
def test_of_an_unseen_recording_the_zero_is_that_of_its_own_rest_or_of_the_others(rests: bool) -> None:
    """At rest the reading is its zero and the static reading of what the load cell shows beyond its zero of 8 N."""
    (experiment,), _ = prepare([press(offset=30.0, load_offset=3.0, reading_noise=0.5)])
    mask = experiment.mask.copy()
    mask[50:60] = False
    if not rests:
        mask[:150] = False
    experiment = replace(experiment, mask=mask)
    rest = np.flatnonzero(mask[:150])
    offset = 4.0
    if rests:
        offset = float(np.mean(experiment.reading[rest] - (experiment.load_n[rest] - 8.0) * 0.25 / 0.6))
    reading, _ = shifted(experiment.reading - offset, experiment.time_s, experiment.step, 0.013)
    if rests:
        reading[0] = reading[rest].mean()
    wanted = simulate(0.25, 1.6, 0.6, reading, experiment.time_s) + 8.0 - experiment.load_n
    assert _error_of_unseen(_found(), experiment, 150) == pytest.approx(wanted, abs=1e-9)  # type: ignore[arg-type]


def test_figures_are_the_root_of_the_mean_square_and_the_largest_of_what_there_is() -> None:
    assert _figures([np.array([3.0, -4.0]), np.zeros(0), np.array([0.0, 0.0])]) == (2.5, 4.0)
    assert np.isnan(_figures([np.zeros(0)])).tolist() == [True, True]


def test_cycles_are_left_out_with_the_rest_after_them() -> None:
    (experiment,), _ = prepare([press(rates=(200.0, 400.0), repeats=2)])
    found = loading.cycles(experiment.time_s, experiment.load_n)
    assert len(found) == 4
    stops = [cycle.start for cycle in found[1:]] + [experiment.time_s.size]
    for members in ((0, 3), (1, 2), ()):
        wanted = np.zeros(experiment.time_s.size, dtype=bool)
        for index in members:
            wanted[found[index].start : max(stops[index], found[index].stop)] = True
        told = _span_of(experiment, found, {id(found[index]) for index in members})
        assert told.tolist() == wanted.tolist()


def test_readings_are_in_the_first_recordings_unit() -> None:
    first = press(gap=slice(700, 720))
    reading = np.where(first.sensor.present, first.sensor.values / 10.0, np.nan)
    other = Recording.from_arrays(time_s=first.time_s, force_n=first.force_n, pressure_kpa=reading, name="other")
    mine, told = _in_one_unit([first, other])
    assert mine is first
    assert told.sensor.unit == first.sensor.unit
    assert told.sensor.present.tolist() == first.sensor.present.tolist()
    seen = first.sensor.present
    assert told.sensor.values[seen] == pytest.approx(first.sensor.values[seen])
    assert not seen[700:720].any()
