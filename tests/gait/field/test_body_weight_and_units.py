"""Strides weigh the body; a unit that does not answer is named."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shoes import BODY_WEIGHT_N, RATE_HZ, feet_n, foot_n, made

from smartshoe.errors import UsageError
from smartshoe.gait.field import check_body_weight, check_units

NAMES = ("toe", "meta1", "meta4", "heel")


@pytest.mark.parametrize("activity", ["slow walk", "walk", "fast walk", "run", "stand", "tiptoe"])
@pytest.mark.parametrize("weight_n", [250.0, 519.4, 1100.0])
def test_the_mean_force_is_body_weight(activity: str, weight_n: float) -> None:
    found = made(activity, 60.0, body_weight_n=weight_n)
    check = check_body_weight(found.time_s, feet_n(found), weight_n, coverage=0.8)
    assert check.verdict == "ok"
    # Momentum balance holds over whole strides; where a stride is cut differs by a sample or two.
    assert check.numbers["ratio"] == pytest.approx(1.0, abs=0.005)


@given(st.floats(0.5, 2.0), st.floats(0.3, 1.0))
@settings(max_examples=20)
def test_only_the_ratio_counts(factor: float, coverage: float) -> None:
    found = made("walk", 30.0)
    feet = {side: total * factor for side, total in feet_n(found).items()}
    check = check_body_weight(found.time_s, feet, BODY_WEIGHT_N * factor * 0.8 / coverage, coverage=coverage)
    plain = check_body_weight(found.time_s, feet_n(found), BODY_WEIGHT_N, coverage=0.8)
    assert check.numbers["ratio"] == pytest.approx(plain.numbers["ratio"], rel=1e-9)


@given(st.floats(1.0, 8.0), st.floats(20.0, 30.0))
@settings(max_examples=10)
def test_where_the_trial_is_cut_does_not_matter(first_s: float, last_s: float) -> None:
    found = made("walk", 60.0)
    part = (found.time_s >= first_s) & (found.time_s < last_s)
    feet = {side: total[part] for side, total in feet_n(found).items()}
    check = check_body_weight(found.time_s[part], feet, BODY_WEIGHT_N, coverage=0.8)
    assert check.numbers["ratio"] == pytest.approx(1.0, abs=0.02)


def test_the_interval_holds_as_often_as_it_says() -> None:
    inside, count = 0, 40
    for seed in range(count):
        found = made("walk", 40.0, seed=100 + seed)
        numbers = check_body_weight(found.time_s, feet_n(found), BODY_WEIGHT_N, coverage=0.8).numbers
        inside += numbers["low_n"] <= numbers["expected_n"] <= numbers["high_n"]
    # 95 %: 38 of 40 with an sd of 1.4.
    assert inside >= 34


@pytest.mark.parametrize(("gain", "verdict"), [(0.7, "fault"), (1.0, "ok"), (1.051, "warning"), (1.3, "fault")])
def test_a_wrong_gain_is_told(gain: float, verdict: str) -> None:
    found = made("walk", 60.0)
    feet = {side: gain * total for side, total in feet_n(found).items()}
    assert check_body_weight(found.time_s, feet, BODY_WEIGHT_N, coverage=0.8).verdict == verdict


def test_a_heel_that_is_missing_is_a_fault() -> None:
    found = made("walk", 60.0)
    feet = {"left": foot_n(found, "left").sum(axis=1), "right": foot_n(found, "right")[:, :3].sum(axis=1)}
    check = check_body_weight(found.time_s, feet, BODY_WEIGHT_N, coverage=0.8)
    assert check.verdict == "fault"
    assert check.numbers["ratio"] < 0.9


def test_what_cannot_be_checked_is_not() -> None:
    found = made("walk", 60.0)
    one = check_body_weight(found.time_s, {"left": feet_n(found)["left"]}, BODY_WEIGHT_N)
    assert one.verdict == "unknown"
    assert "give both shoes" in one.says
    short = {side: total[:1000] for side, total in feet_n(found).items()}
    assert check_body_weight(found.time_s[:1000], short, BODY_WEIGHT_N).verdict == "unknown"
    empty = {side: 0.0 * total for side, total in feet_n(found).items()}
    assert check_body_weight(found.time_s, empty, BODY_WEIGHT_N).verdict == "unknown"


@pytest.mark.parametrize(("weight_n", "coverage"), [(0.0, 1.0), (float("nan"), 1.0), (500.0, 0.0), (500.0, 1.5)])
def test_weights_that_cannot_be_are_said(weight_n: float, coverage: float) -> None:
    with pytest.raises(UsageError):
        check_body_weight([0.0, 1.0], {"left": [0.0, 1.0]}, weight_n, coverage=coverage)


# -- units that do not answer ------------------------------------------------------------------------------------
def readings_of(activity: str, noise: float = 0.3, side: str = "left") -> tuple[np.ndarray, np.ndarray]:
    found = made(activity, 60.0)
    forces = foot_n(found, side)
    step = 0.25  # a converter of 12 bits over 800 N and some
    drawn = forces + noise * np.random.default_rng(4).standard_normal(forces.shape)
    return found.time_s, np.round(drawn / step) * step


def kinds(time_s: np.ndarray, readings: np.ndarray, **more: object) -> list[tuple[str, str]]:
    found = check_units(time_s, readings, NAMES, full_scale=800.0, **more)  # type: ignore[arg-type]
    return [(finding.kind, finding.unit) for finding in found]


@pytest.mark.parametrize("activity", ["slow walk", "walk", "fast walk", "run", "stand", "tiptoe"])
@pytest.mark.parametrize("noise", [0.0, 0.3, 3.0])
def test_units_that_answer_are_left_alone(activity: str, noise: float) -> None:
    assert kinds(*readings_of(activity, noise)) == []


@pytest.mark.parametrize("unit", range(4))
@pytest.mark.parametrize("value", [0.0, 137.0])
def test_a_stuck_unit_is_named(unit: int, value: float) -> None:
    time_s, readings = readings_of("walk")
    readings[4000:7000, unit] = value
    (finding,) = check_units(time_s, readings, NAMES, full_scale=800.0)
    assert (finding.kind, finding.unit) == ("stuck", NAMES[unit])
    assert finding.span_s == pytest.approx((time_s[4000], time_s[6999]), abs=0.05 + 2.5 * (value == 0.0))


@pytest.mark.parametrize("unit", range(4))
def test_a_dead_unit_is_named_though_it_has_noise(unit: int) -> None:
    time_s, readings = readings_of("walk")
    readings[:, unit] = 5.0 + np.random.default_rng(1).standard_normal(time_s.size)
    assert kinds(time_s, readings) == [("dead", NAMES[unit])]


def test_a_unit_that_is_not_loaded_in_standing_is_no_dead_one() -> None:
    time_s, readings = readings_of("stand")
    readings[:, 0] = 0.0
    assert kinds(time_s, readings) == []


def test_gaps_are_summed() -> None:
    time_s, readings = readings_of("walk")
    readings[1000:1040, 1] = np.nan  # 0.2 s: a burst, no gap
    assert kinds(time_s, readings) == []
    readings[2000:2400, 1] = readings[5000:5200, 1] = np.nan
    (finding,) = check_units(time_s, readings, NAMES, full_scale=800.0)
    assert finding.numbers["gap_s"] == pytest.approx(3.0, abs=2.0 / RATE_HZ)


def test_a_unit_that_never_sent_is_said_once() -> None:
    time_s, readings = readings_of("walk")
    readings[:, 3] = np.nan
    assert kinds(time_s, readings) == [("no_samples", "heel")]


@pytest.mark.parametrize("high", [None, 150.0])
def test_a_rail_is_told(high: float | None) -> None:
    time_s, readings = readings_of("walk")
    readings[:, 3] = np.minimum(readings[:, 3], 150.0)
    more = {} if high is None else {"range_high": [800.0, 800.0, 800.0, high]}
    assert kinds(time_s, readings, **more) == [("saturated", "heel")]


@given(st.floats(0.01, 100.0), st.floats(-50.0, 50.0))
@settings(max_examples=10)
def test_scale_and_offset_do_not_matter(factor: float, offset: float) -> None:
    time_s, readings = readings_of("walk")
    readings[:, 0] = 5.0 + np.random.default_rng(1).standard_normal(time_s.size)
    readings[4000:7000, 2] = 100.0
    found = check_units(time_s, (readings + offset) * factor, NAMES, full_scale=800.0 * factor)
    assert [(finding.kind, finding.unit) for finding in found] == [("dead", "toe"), ("stuck", "meta4")]


def test_shapes_that_do_not_fit_are_said() -> None:
    with pytest.raises(UsageError, match="shape"):
        check_units(np.arange(10.0), np.zeros((10, 3)), NAMES, full_scale=1.0)
