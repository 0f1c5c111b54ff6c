"""Bad input: said in a flag, and what can be computed is."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray
from trials import analysed, loads_of, ran, recorded, times_of, walked

from simulators.people import Person, Stand, trial
from smartshoe.calibration import Calibration
from smartshoe.errors import InputError, MissingChannelError, RefusedError, UnitError, UsageError
from smartshoe.gait import GaitResult, analyse
from smartshoe.units import MILLIBAR

Array = NDArray[np.float64]
Columns = dict[str, Array]


def _kinds(found: GaitResult) -> set[str]:
    return {flag.kind for flag in found.flags}


def _of(side: str, columns: Columns) -> Columns:
    return {name: values for name, values in columns.items() if name.startswith(side)}


def _exchanged(columns: Columns, *pairs: tuple[str, str]) -> Columns:
    made = dict(columns)
    for first, second in pairs:
        made[first], made[second] = columns[second], columns[first]
    return made


def test_a_good_trial_has_no_flags() -> None:
    assert analysed().flags == ()
    assert _kinds(analyse(ran().recording)) == set()


def test_one_shoe_tells_its_own_numbers() -> None:
    found = analyse(recorded(walked().time_s, _of("left", loads_of(walked()))), coverage=0.8)
    assert _kinds(found) == {"one_shoe"}
    assert np.array_equal(times_of(found, "left", "heel_strike"), times_of(analysed(), "left", "heel_strike"))
    assert found.summary["stride_time_s"]["left"] == analysed().summary["stride_time_s"]["left"]
    assert found.summary["double_support_percent"] is None
    assert found.forces.mean_total_n is None
    weight = found.forces.body_weight
    assert weight is not None
    assert weight.source == "one_shoe"
    assert abs(weight.value - 519.4) < 3.0 * weight.sd


def test_columns_without_a_side_are_taken_as_a_side_and_it_is_said() -> None:
    bare = {name.split("_", 1)[1]: values for name, values in _of("right", loads_of(walked())).items()}
    found = analyse(recorded(walked().time_s, bare))
    assert "side_unknown" in _kinds(found)
    told = analyse(recorded(walked().time_s, bare, name="right shoe"))
    assert "side_unknown" not in _kinds(told)
    assert list(told.feet) == ["right"]


def test_two_files_make_one_trial() -> None:
    columns = loads_of(walked())
    parts = [recorded(walked().time_s, _of(side, columns), side) for side in ("right", "left")]
    found = analyse(parts, coverage=0.8)
    assert found.flags == ()
    assert found.forces.mean_total_n == pytest.approx(analysed().forces.mean_total_n)
    with pytest.raises(UsageError, match="both hold the left shoe"):
        analyse([parts[1], parts[1]])


@pytest.mark.parametrize("late_s", [-0.2, -0.06, 0.06, 0.2])
def test_clocks_apart_are_noticed_and_the_mean_total_stands(late_s: float) -> None:
    columns = loads_of(walked())
    parts = [recorded(walked().time_s, _of("left", columns), "left")]
    parts.append(recorded(walked().time_s + late_s, _of("right", columns), "right"))
    found = analyse(parts, coverage=0.8)
    (flag,) = [flag for flag in found.flags if flag.kind == "clocks_apart"]
    told_ms = float(flag.says.split(" ms")[0].split()[-1])
    # The gait's own two double supports differ by some milliseconds over thirty strides.
    assert told_ms == pytest.approx(1e3 * abs(late_s), abs=6.0)
    assert ("later" if late_s > 0 else "earlier") in flag.says
    assert ("there would be a flight in walking" in flag.says) == (abs(late_s) > 0.1)
    assert found.forces.mean_total_n == pytest.approx(519.4, rel=0.02)


def test_clocks_of_different_rates_are_noticed() -> None:
    made = walked(60.0)
    columns = loads_of(made)
    parts = [recorded(made.time_s, _of("left", columns), "left")]
    parts.append(recorded(made.time_s * 1.001, _of("right", columns), "right"))
    (flag,) = [flag for flag in analyse(parts).flags if flag.kind == "clock_rates_differ"]
    assert "faster" in flag.says
    assert 800 < float(flag.says.split(" ppm")[0].split()[-1]) < 1200


def test_a_gap_inside_a_stance_is_said_and_its_stride_counts_in_no_mean() -> None:
    columns = loads_of(walked())
    strike_s = times_of(analysed(), "left", "heel_strike")[5]
    first = int((strike_s + 0.2) * 200)
    for name in _of("left", columns):
        columns[name][first : first + 30] = np.nan
    found = analyse(recorded(walked().time_s, columns), coverage=0.8)
    (flag,) = [flag for flag in found.flags if flag.kind == "gap_in_stance"]
    assert flag.foot == "left"
    assert flag.where.startswith(f"{first / 200:.1f}-")
    (stride,) = [stride for stride in found.strides if stride.gap]
    assert stride.start_s == pytest.approx(strike_s, abs=1e-3)
    assert found.summary["strides"]["left"] == analysed().summary["strides"]["left"] - 1


def test_rows_that_were_lost_are_a_gap_too() -> None:
    strike_s = times_of(analysed(), "left", "heel_strike")[5]
    keep = np.abs(walked().time_s - strike_s - 0.3) > 0.1
    found = analyse(recorded(walked().time_s[keep], {n: v[keep] for n, v in loads_of(walked()).items()}))
    assert "gap_in_stance" in _kinds(found)


def _metatarsals(columns: Columns) -> Columns:
    return _exchanged(columns, *((f"{side}_meta1_n", f"{side}_meta4_n") for side in ("left", "right")))


def _toes(columns: Columns) -> Columns:
    return _exchanged(columns, ("left_toe_n", "right_toe_n"))


@pytest.mark.parametrize("exchange", [_metatarsals, _toes])
def test_left_and_right_exchanged_are_noticed(exchange: Callable[[Columns], Columns]) -> None:
    found = analyse(recorded(walked().time_s, exchange(loads_of(walked()))))
    assert "left_right_swapped" in _kinds(found)
    assert "clocks_apart" not in _kinds(found)


@pytest.mark.parametrize(
    ("pair", "says"),
    [
        (("left_heel_n", "right_heel_n"), "its column seems to be the other foot's"),
        (("left_heel_n", "left_toe_n"), "heel and toe seem exchanged"),
    ],
)
def test_columns_out_of_order_are_noticed(pair: tuple[str, str], says: str) -> None:
    found = analyse(recorded(walked().time_s, _exchanged(loads_of(walked()), pair)))
    flags = [flag for flag in found.flags if flag.kind == "sequence_broken"]
    assert flags
    assert all(says in flag.says for flag in flags)
    assert found.indices["left"]["sequence_error_percent"] == 100.0


def test_a_file_named_for_the_other_foot_is_noticed() -> None:
    found = analyse(recorded(walked().time_s, _of("left", loads_of(walked())), name="right"))
    assert "left_right_swapped" in _kinds(found)


def test_whole_shoes_that_changed_sides_cannot_be_noticed() -> None:
    other = {"left": "right", "right": "left"}
    columns = {f"{other[n.split('_', 1)[0]]}_{n.split('_', 1)[1]}": v for n, v in loads_of(walked()).items()}
    assert analyse(recorded(walked().time_s, columns)).flags == ()


def test_loads_in_kilonewton_are_implausible_and_times_stand() -> None:
    found = analyse(recorded(walked().time_s, {name: 1e-3 * v for name, v in loads_of(walked()).items()}))
    assert "implausible_weight" in _kinds(found)
    assert found.summary["cadence_steps_per_min"] == pytest.approx(analysed().summary["cadence_steps_per_min"])


def test_loads_of_the_wrong_sign_are_turned() -> None:
    found = analyse(recorded(walked().time_s, {name: -v for name, v in loads_of(walked()).items()}), coverage=0.8)
    assert _kinds(found) == {"negative_load"}
    assert found.forces.mean_total_n == pytest.approx(analysed().forces.mean_total_n)


def test_a_shoe_that_was_not_worn_leaves_the_other_one_told() -> None:
    columns = {**loads_of(walked()), **{name: 0.0 * v + 3.0 for name, v in _of("right", loads_of(walked())).items()}}
    found = analyse(recorded(walked().time_s, columns))
    assert _kinds(found) >= {"no_stance"}
    assert "saturated" not in _kinds(found)
    assert found.summary["strides"]["left"] == analysed().summary["strides"]["left"]


def test_a_unit_that_is_silent_is_named() -> None:
    columns = {**loads_of(walked()), "left_meta1_n": np.zeros(walked().time_s.size)}
    (flag,) = [flag for flag in analyse(recorded(walked().time_s, columns)).flags if flag.kind == "silent_unit"]
    assert (flag.foot, flag.unit) == ("left", "meta1")


def test_a_unit_without_a_column_is_named() -> None:
    columns = loads_of(walked())
    del columns["left_meta1_n"]
    found = analyse(recorded(walked().time_s, columns))
    assert [flag.unit for flag in found.flags if flag.kind == "missing_unit"] == ["meta1"]
    assert np.array_equal(times_of(found, "right", "toe_off"), times_of(analysed(), "right", "toe_off"))


@pytest.mark.parametrize("values", [np.zeros(4000), np.random.default_rng(1).normal(0.0, 1.0, 4000)])
def test_no_stance_at_all_is_refused(values: Array) -> None:
    with pytest.raises(RefusedError, match="no stance is found"):
        analyse(recorded(np.arange(4000) / 200.0, dict.fromkeys(loads_of(walked()), values)))


def test_a_record_of_a_second_says_that_it_is_too_short() -> None:
    found = analyse(recorded(walked().time_s[:200], {n: v[:200] for n, v in loads_of(walked()).items()}))
    assert "too_short" in _kinds(found)
    assert found.strides == ()


def test_standing_that_was_never_unloaded_says_so() -> None:
    made = trial(Person(), Stand(), 20.0, np.random.default_rng(2), sensors=False)
    late = made.time_s > 5.0
    found = analyse(recorded(made.time_s[late], {n: v[late] for n, v in loads_of(made).items()}), coverage=0.8)
    assert found.activity == "standing"
    assert _kinds(found) == {"no_swing"}
    assert found.forces.standing_total_n == pytest.approx(519.4, rel=0.01)


def test_units_that_are_no_loads_are_refused() -> None:
    with pytest.raises(UnitError, match="left_heel is in m/s"):
        analyse(recorded(np.arange(40) / 200.0, {"left_heel_m_per_s": np.zeros(40)}))
    with pytest.raises(MissingChannelError, match="no column of a shoe's unit"):
        analyse(recorded(np.arange(40) / 200.0, {"pressure_mbar": np.zeros(40)}))
    with pytest.raises(InputError, match="no calibration of left_heel, whose column"):
        analyse(recorded(np.arange(40) / 200.0, {"left_heel_mbar": np.zeros(40), "left_toe_n": np.zeros(40)}))


def _calibration(unit: str, newton_per_mbar: float = 5.0) -> Calibration:
    return Calibration(
        a1=0.2, b0=newton_per_mbar, b1=0.2 * newton_per_mbar, reading_unit=MILLIBAR, unit=unit,
        load_range_n=(0.0, 300.0), rate_range_n_per_s=(50.0, 800.0),
    )  # fmt: skip


def test_loads_beyond_the_calibration_are_marked_not_hidden() -> None:
    columns = {f"{name[:-2]}_mbar": values / 5.0 for name, values in loads_of(walked()).items()}
    found = analyse(recorded(walked().time_s, columns), [_calibration(name[:-2]) for name in loads_of(walked())])
    beyond = [(flag.foot, flag.unit) for flag in found.flags if flag.kind == "beyond_calibration"]
    assert ("left", "heel") in beyond
    assert ("left", "meta1") not in beyond
    assert "beyond_calibrated_rate" in _kinds(found)
    assert found.feet["left"].load[:, 3].max() > 320.0


def test_a_reading_on_its_rail_is_marked() -> None:
    columns = loads_of(walked())
    columns["left_heel_n"] = np.minimum(columns["left_heel_n"], 300.0)
    (flag,) = [flag for flag in analyse(recorded(walked().time_s, columns)).flags if flag.kind == "saturated"]
    assert (flag.foot, flag.unit) == ("left", "heel")


def test_calibrations_are_matched_by_name() -> None:
    columns = {f"{name[:-2]}_mbar": values / 5.0 for name, values in loads_of(walked()).items()}
    shoe = recorded(walked().time_s, columns)
    by_region = analyse(shoe, [_calibration(region) for region in ("toe", "meta1", "meta4", "heel", "elbow")])
    assert by_region.feet["right"].is_force
    assert [flag.says for flag in by_region.flags if flag.kind == "unused_calibration"] == [
        "the calibration of elbow fits no column of the trial"
    ]
    with pytest.raises(UsageError, match="two calibrations are for unit 'toe'"):
        analyse(shoe, [_calibration("toe"), _calibration("toe")])
    with pytest.raises(UnitError, match="left_toe is in V"):
        analyse(recorded(walked().time_s, {"left_toe_v": np.ones(walked().time_s.size)}), _calibration("left_toe"))


@pytest.mark.parametrize(
    ("settings", "says"),
    [
        ({"coverage": 0.0}, "coverage is 0"),
        ({"coverage": np.nan}, "coverage is nan"),
        ({"body_weight_n": -1.0}, "body"),
    ],
)
def test_arguments_out_of_range_are_refused(settings: dict[str, float], says: str) -> None:
    with pytest.raises(UsageError, match=says):
        analyse(walked().recording, **settings)


def test_a_result_shows_itself_in_a_line_a_table_and_a_figure() -> None:
    found = analyse(ran().recording)
    assert "\n" not in repr(found)
    assert "<table>" in found._repr_html_()
    axes = found.plot().axes
    assert [axis.get_title() for axis in axes] == list(found.feet)
    assert all(axis.lines for axis in axes)
    assert {axis.get_ylabel() for axis in axes} == {"force (N)"}
