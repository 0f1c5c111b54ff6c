"""A gain that is seen over a narrow range, or within files only, is no gain to calibrate by."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from smartshoe.diagnosis import Thresholds
from smartshoe.diagnosis._baseline import baseline_of
from smartshoe.diagnosis._ranges import Ranges, _limit_foreign_gain, loads_beyond_fit, ranges_of
from smartshoe.diagnosis._scale import full_scale
from smartshoe.diagnosis._session import prepare
from smartshoe.models.effects import Conditions
from smartshoe.models.extended import ExtendedModel
from smartshoe.recording import Recording

Array = NDArray[np.float64]

TIME_S = np.arange(0.0, 40.0, 0.02)
TRIANGLE = np.abs(2.0 * (TIME_S / 5.0 % 1.0) - 1.0)
GAIN_MBAR_PER_N = 0.25
NOISE_MBAR = 0.02


def _ranges(*pairs: tuple[Array, Array], unit: str = "mbar", held_out: Sequence[bool] | None = None) -> Ranges:
    noise = np.random.default_rng(0).normal(0.0, NOISE_MBAR, TIME_S.size)
    recordings = [
        Recording.from_arrays(time_s=TIME_S, force_n=load, name=f"run_{k}", **{f"pressure_{unit}": reading + noise})
        for k, (load, reading) in enumerate(pairs)
    ]
    usable = [np.ones(TIME_S.size, dtype=bool) for _ in recordings]
    scale = full_scale(recordings, usable, Thresholds())
    sessions = prepare(recordings, usable, held_out, scale, [1], Thresholds())
    return ranges_of(sessions, baseline_of(sessions, scale), scale, Thresholds())


def _proportional(low_n: float, high_n: float) -> tuple[Array, Array]:
    load = low_n + (high_n - low_n) * TRIANGLE
    return load, GAIN_MBAR_PER_N * load


def test_a_unit_loaded_from_zero_has_nothing_to_be_said_of_its_range() -> None:
    assert _ranges(_proportional(0.0, 800.0)) == Ranges()


def test_a_narrow_range_whose_line_meets_zero_is_told_but_no_trap() -> None:
    found = _ranges(_proportional(600.0, 800.0))
    assert not found.is_trap
    assert "narrow range" in found.says[0]


def test_a_line_that_misses_zero_by_far_is_a_trap() -> None:
    load = 600.0 + 200.0 * TRIANGLE
    found = _ranges((load, 150.0 + 0.2 * GAIN_MBAR_PER_N * (load - 600.0)))
    assert found.is_trap
    assert "0.05 mbar/N" in found.says[0]
    assert "none to calibrate by" in found.says[0]


@pytest.mark.parametrize(
    ("share", "is_said"), [(0.0, False), (1e-12, False), (0.019, False), (0.021, True), (-0.3, True)]
)
def test_of_a_reading_whose_mean_was_taken_out_no_ratio_to_its_load_is_said(share: float, is_said: bool) -> None:
    """Within two per cent of what the load times the gain would be."""
    load = 600.0 + 200.0 * TRIANGLE
    moved = GAIN_MBAR_PER_N * (load - load.mean())
    found = _ranges((load, moved + share * GAIN_MBAR_PER_N * load.mean()))
    assert found.is_trap
    assert ("reading over load is" in found.says[0]) is is_said
    assert ("the mean reading is next to nothing: load and reading" in found.says[0]) is not is_said
    assert "the reading moves by 0.25 mbar/N (4 N/mbar)" in found.says[0]


def test_no_gain_is_divided_by_where_there_is_none() -> None:
    """Of a mean of exactly nothing, and between files that go opposite ways."""
    ends = np.repeat([600.0, 800.0], TIME_S.size // 2)
    falls = GAIN_MBAR_PER_N * (ends - 700.0)
    recordings = [
        Recording.from_arrays(time_s=TIME_S, force_n=ends, pressure_mbar=way * falls, name=f"run_{way:g}")
        for way in (1.0, -1.0)
    ]
    for given in (recordings[:1], recordings):
        usable = [np.ones(TIME_S.size, dtype=bool) for _ in given]
        scale = full_scale(given, usable, Thresholds())
        sessions = prepare(given, usable, None, scale, [1], Thresholds())
        found = ranges_of(sessions, baseline_of(sessions, scale), scale, Thresholds())
        assert found.is_trap
        assert "the mean reading is next to nothing" in found.says[0]


def test_no_line_goes_through_the_zero_of_a_sensor_whose_zero_is_a_convention() -> None:
    load = 600.0 + 200.0 * TRIANGLE
    found = _ranges((load, 150.0 + 0.2 * GAIN_MBAR_PER_N * (load - 600.0)), unit="mv")
    assert not found.is_trap
    assert "what lies below is extrapolated" in found.says[0]


def test_what_is_held_out_decides_over_no_range() -> None:
    load = 600.0 + 200.0 * TRIANGLE
    trap = load, 150.0 + 0.2 * GAIN_MBAR_PER_N * (load - 600.0)
    found = _ranges(_proportional(0.0, 800.0), trap, held_out=[True, False])
    assert found.is_trap
    assert "(601.3 to 800 N in run_1)" in found.says[0]  # all of its triangle
    judging = _ranges(_proportional(0.0, 800.0), trap, held_out=[False, True])
    assert (judging.is_trap, list(judging.says)) == (False, _foreign_ones(judging))  # but what its gain says of it


def test_gains_within_files_that_differ_from_the_gain_between_them_are_a_trap() -> None:
    pairs = []
    for middle in (200.0, 400.0, 800.0):
        load = middle * (1.0 + 0.05 * (TRIANGLE - 0.5))
        pairs.append((load, GAIN_MBAR_PER_N * (middle + 0.7 * (load - middle))))
    found = _ranges(*pairs)
    assert found.is_trap
    assert "between the files by 0.25 mbar/N" in found.says[-1]


@pytest.mark.parametrize("factor", [0.5, 1.0])
def test_files_over_different_ranges_of_one_unit_are_no_trap(factor: float) -> None:
    assert not _ranges(_proportional(0.0, 800.0), _proportional(0.0, 800.0 * factor)).is_trap


def _foreign_ones(found: Ranges) -> list[str]:
    return [said for said in found.says if "under the same load" in said]


@pytest.mark.parametrize(
    ("ratio", "told"),
    [(10.0, "10"), (0.1, "0.1"), (-1.0, "-1"), (4.1, "4.1"), (0.24, "0.24"), (3.9, None), (0.26, None), (1.0, None)],
)
def test_a_file_that_reads_many_times_what_the_first_does_or_the_other_way_is_named(
    ratio: float, told: str | None
) -> None:
    """Beyond twice what differs for certain: four times, or a quarter."""
    load, reading = _proportional(0.0, 800.0)
    found = _ranges((load, reading), (load, 1.1 * reading), (load, ratio * reading))
    if told is None:
        assert _foreign_ones(found) == []
        return
    (said,) = _foreign_ones(found)
    assert said.endswith("is it in another unit, of the other sign, or of another sensor?")
    name, shown = said.removesuffix(said.partition(" times what")[2]).removesuffix(" times what").split(" reads ")
    assert name == "run_2"
    assert float(shown) == pytest.approx(ratio, rel=0.02)
    assert "times what run_0 does under the same load: is it" in said


def test_it_is_named_beside_the_first_that_tells_its_gain_also_where_it_only_judges() -> None:
    load, reading = _proportional(0.0, 800.0)
    first, foreign = (load, reading), (load, 10.0 * reading)
    (said, again) = _foreign_ones(_ranges(foreign, first, first))
    assert (said[:11], again[:11]) == ("run_1 reads", "run_2 reads")
    assert "0.1 times what run_0 does" in said
    still = (np.full(TIME_S.size, 400.0), np.full(TIME_S.size, 400.0 * GAIN_MBAR_PER_N))  # of which none is told
    (said,) = _foreign_ones(_ranges(still, first, foreign))
    assert said.startswith("run_2 reads 10 times what run_1 does")
    (said,) = _foreign_ones(_ranges(first, foreign, held_out=[False, True]))
    assert said.startswith("run_1 reads 10 times what run_0 does")
    assert _limit_foreign_gain([("a", None), ("b", None)], Thresholds()) == []
    assert _limit_foreign_gain([], Thresholds()) == []
    (said,) = _limit_foreign_gain(
        [("level", 0.0), ("a", 1.0), ("b", 10.0)], Thresholds()
    )  # beside nothing none is many times
    assert said.startswith("b reads 10 times what a does")
    assert _limit_foreign_gain([("a", 0.1), ("b", 1.0)], replace(Thresholds(), clear=4.0)) == []


def _unlike_ones(found: Ranges) -> list[str]:
    return [said for said in found.says if "goes as high and as fast" in said]


@pytest.mark.parametrize(("ratio", "is_told"), [(1.24, False), (0.81, False), (1.26, True), (0.5, True), (3.9, True),
                                                (4.1, False), (0.26, True), (-0.5, False)])  # fmt: skip
def test_a_file_of_another_gain_under_a_like_load_is_named(ratio: float, is_told: bool) -> None:
    """By more than gains that are alike differ by; what is many times as much, or the other way, is named anyway."""
    load, reading = _proportional(0.0, 800.0)
    found = _ranges((load, reading), (1.1 * load, ratio * 1.1 * reading))
    assert bool(_unlike_ones(found)) is is_told
    assert not is_told or f"run_1 reads {ratio:.3g} times what run_0 does" in _unlike_ones(found)[0]


def test_a_file_that_only_judges_is_asked_whether_it_is_of_the_same_unit() -> None:
    load, reading = _proportional(0.0, 800.0)
    (said,) = _unlike_ones(_ranges((load, reading), (load, 2.0 * reading), held_out=[False, True]))
    assert said.startswith("run_1 reads 2 times what run_0 does")
    assert _unlike_ones(_ranges((load, reading), (load, 1.1 * reading), held_out=[False, True])) == []


def test_neither_a_curve_nor_a_rate_makes_a_file_another_units() -> None:
    """Loads that go less high, or more slowly, are not alike; of those that are, only what both have counts."""
    load, reading = _proportional(0.0, 800.0)
    slow = 800.0 * np.abs(2.0 * (TIME_S / 8.0 % 1.0) - 1.0)
    assert _unlike_ones(_ranges((load, reading), (0.7 * load, 2.0 * reading))) == []
    assert _unlike_ones(_ranges((load, reading), (slow, 2.0 * GAIN_MBAR_PER_N * slow))) == []
    higher = 1.2 * load
    curve = [(one, GAIN_MBAR_PER_N * (one + 1.5 * np.maximum(one - 800.0, 0.0))) for one in (load, higher)]
    assert _unlike_ones(_ranges(*curve)) == []


@pytest.mark.parametrize(("gain", "is_told"), [(1.0, False), (0.6, True)])
def test_what_relaxes_in_longer_holds_makes_a_file_no_other_units(gain: float, is_told: bool) -> None:
    """Holds of 16 s beside presses of 0.4 s, alike in height and rate, of a unit that doubles by relaxing."""
    holds, presses = (np.where(TIME_S % every < held, 800.0, 0.0) for every, held in ((20.0, 16.0), (2.0, 0.4)))
    unit = ExtendedModel(gain=1.0, relaxing_share=1.0, relaxation_rate_per_s=0.8, full_scale_load_n=1.0,
                         full_scale_reading=GAIN_MBAR_PER_N, reading_unit="mbar")  # fmt: skip
    loads = [np.convolve(load, np.full(10, 0.1), "same") for load in (holds, presses)]
    whole, brief = (unit.reading(Conditions(TIME_S, load, step_s=0.02)) for load in loads)
    assert np.polyfit(loads[1], brief, 1)[0] < 0.75 * np.polyfit(loads[0], whole, 1)[0]
    assert bool(_unlike_ones(_ranges((loads[0], whole), (loads[1], gain * brief)))) is is_told


@pytest.mark.parametrize(
    ("higher", "faster", "longer", "said"),
    [
        (1.2, 1.0, 1.0, None),
        (1.3, 1.0, 1.0, "change by up to 416 N/s (320 in what was fitted) and reach 1,040 N (800 in what was fitted)"),
        (1.0, 2.0, 1.0, "change by up to 640 N/s (320 in what was fitted)"),
        (1.0, 1.0, 2.0, "go on for 80 s (40 in what was fitted)"),
    ],
)
def test_loads_held_out_go_beyond_those_fitted_by_a_quarter(
    higher: float, faster: float, longer: float, said: str | None
) -> None:
    time_s = np.arange(0.0, 40.0 * longer, 0.02)
    fitted, held_out = (
        Recording.from_arrays(time_s=t, force_n=load, pressure_mbar=GAIN_MBAR_PER_N * load)
        for t, load in (
            (TIME_S, 800.0 * TRIANGLE),
            (time_s, 800.0 * higher * np.abs(2.0 * (faster * time_s / 5.0 % 1.0) - 1.0)),
        )
    )
    usable = [np.ones(one.time_s.size, dtype=bool) for one in (fitted, held_out)]
    scale = full_scale([fitted], usable[:1], Thresholds())
    told = loads_beyond_fit(
        prepare([fitted, held_out], usable, [False, True], scale, [1], Thresholds()), scale, Thresholds()
    )
    assert told == (None if said is None else f"the held-out loads {said}")


def test_what_held_out_loads_do_that_fitted_ones_lack_is_said() -> None:
    corners = np.array([0.0, 3.0, 5.0, 15.0, 17.0, 20.0])
    held = np.resize(np.interp(np.arange(0.0, 20.0, 0.02), corners, [0.0, 0.0, 1.0, 1.0, 0.0, 0.0]), TIME_S.size)
    pressed, resting = (
        Recording.from_arrays(time_s=TIME_S, force_n=800.0 * load, pressure_mbar=GAIN_MBAR_PER_N * load)
        for load in (TRIANGLE, held)
    )
    usable, scale = [np.ones(TIME_S.size, dtype=bool)] * 2, full_scale([pressed], [pressed.load.present], Thresholds())

    def told(*recordings: Recording) -> str | None:
        sessions = prepare(recordings, usable, [False, True], scale, [1], Thresholds())
        return loads_beyond_fit(sessions, scale, Thresholds())

    assert str(told(pressed, resting)).endswith(
        "what was fitted lacks loads held for some seconds, at several levels, rests without load between loads"
    )
    assert told(resting, pressed) is None


@pytest.mark.parametrize(("stops_at", "is_told"), [(0.5, True), (0.7, True), (0.8, False), (1.0, False)])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_reading_that_stands_still_over_a_quarter_of_the_loads_or_more_is_told(
    stops_at: float, is_told: bool, sign: float
) -> None:
    """On a stop it wanders by a little, so that it is no rail of equal numbers."""
    load, _ = _proportional(0.0, 800.0)
    wander = 0.5 * np.random.default_rng(1).standard_normal(load.size)
    said = _ranges((load, sign * (GAIN_MBAR_PER_N * np.minimum(load, 800.0 * stops_at) + wander))).says
    told = [one for one in said if "stands still" in one]
    assert bool(told) is is_told
    if told:
        begins_n = float(told[0].split()[1])
        assert begins_n == pytest.approx(800.0 * stops_at, abs=30.0)


def test_a_few_samples_of_a_peak_are_no_range_over_which_a_reading_stands_still() -> None:
    """A linear unit behind a lag of 0.1 s: most of its upper loads are one hold, far below the peak."""
    load = np.interp(TIME_S, [0.0, 5.0, 15.0, 19.9, 20.0, 20.1, 25.0], [0.0, 460.0, 460.0, 460.0, 800.0, 460.0, 460.0])
    lagged, share = np.zeros(load.size), 1.0 - np.exp(-0.02 / 0.1)
    for k in range(1, load.size):
        lagged[k] = lagged[k - 1] + share * (load[k] - lagged[k - 1])
    assert _ranges((load, GAIN_MBAR_PER_N * lagged)) == Ranges()
    assert _ranges((load, GAIN_MBAR_PER_N * load)) == Ranges()


def test_a_reading_that_bends_does_not_stand_still() -> None:
    load, _ = _proportional(0.0, 800.0)
    assert _ranges((load, 7.0 * np.sqrt(load))) == Ranges()


def test_whether_a_gain_is_a_trap_does_not_go_by_the_order_of_files() -> None:
    """What most of them say decides: the zero of one is off."""
    load = 600.0 + 200.0 * TRIANGLE
    proper, off = _proportional(600.0, 800.0), (load + 50.0, GAIN_MBAR_PER_N * load + 300.0)
    for given in ((proper, proper, off), (off, proper, proper), (proper, off, proper)):
        assert not _ranges(*given).is_trap
    trap = load, 150.0 + 0.2 * GAIN_MBAR_PER_N * (load - 600.0)
    for given in ((proper, trap, trap), (trap, proper, trap)):
        found = _ranges(*given)
        assert found.is_trap
