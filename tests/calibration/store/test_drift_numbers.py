"""A drift's numbers beside those of weighted least squares by their normal equations, and what is said of them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from datetime import timedelta
from pathlib import Path

import numpy as np
import pytest
from lives import FIRST_DAY, LEFT_TOE, aged, calibration, day
from scipy.stats import t as student

from smartshoe.calibration.store import CalibrationStore, HistoryEvent
from smartshoe.calibration.store.dates import moment
from smartshoe.calibration.store.drift import DriftStep, Trend, _jump, _trend, drift
from smartshoe.errors import UsageError
from smartshoe.models.parameter import Parameter
from smartshoe.units import VOLT

YEAR = 365.25


def trend_of(
    values: Sequence[float] | np.ndarray,
    sds: Sequence[float] | np.ndarray,
    days: Sequence[float],
    lives: Sequence[int] = (),
    name: str = "static_gain",
) -> Trend:
    numbers = np.array(lives or [0] * len(days), dtype=np.intp)
    dates = [FIRST_DAY + timedelta(days=at) for at in days]
    repairs = [
        HistoryEvent("repaired", "S1", dates[int(np.flatnonzero(numbers > k)[0])]) for k in range(int(numbers[-1]))
    ]
    return _trend(name, "N", np.array(days, dtype=float), np.array(values), np.array(sds), numbers, dates, repairs)


class Normal:
    """Levels and a slope a day by the normal equations, with the days as they are."""

    def __init__(self, days: Sequence[float], values: np.ndarray, sds: np.ndarray, pieces: Sequence[int]) -> None:
        levels = np.equal.outer(np.array(pieces), np.arange(pieces[-1] + 1)).astype(float)
        design = np.column_stack([levels, days])
        known = bool(np.isfinite(sds).all() and (sds > 0.0).all())
        weights = np.diag(sds**-2.0) if known else np.eye(values.size)
        inverse = np.linalg.inv(design.T @ weights @ design)
        self.theta = inverse @ design.T @ weights @ values
        left = values - design @ self.theta
        self.freedom = values.size - design.shape[1]
        self.scatter = math.sqrt(left @ weights @ left / self.freedom)
        self.covariance = inverse * (max(self.scatter, 1.0) if known else self.scatter) ** 2

    def interval(self, contrast: Sequence[float], scale: float = 1.0) -> tuple[float, float, float, float]:
        """Value, sd, and both bounds of 95 % by Student's t."""
        row = scale * np.array(contrast)
        value, sd = float(row @ self.theta), math.sqrt(row @ self.covariance @ row)
        half = float(student.ppf(0.975, self.freedom)) * sd
        return value, sd, value - half, value + half


def four(change: Parameter) -> tuple[float, float, float, float]:
    return change.value, change.sd, *change.ci95


DAYS = [0.0, 20.0, 50.0, 90.0, 100.0, 160.0, 200.0]
NOISE = np.array([0.3, -0.4, 0.1, 0.5, -0.6, 0.2, -0.1])


# -- a line and its levels -----------------------------------------------------------------------------------------
@pytest.mark.parametrize("lives", [[0] * 7, [0, 0, 0, 1, 1, 1, 1], [0, 0, 1, 1, 1, 2, 2]])
@pytest.mark.parametrize("noise", [0.02, 5.0])  # less than the errors, and more
@pytest.mark.parametrize("sds", ["uneven", "one is 0", "one is infinite", "unknown"])
def test_a_line_with_levels_is_that_of_the_normal_equations(lives: list[int], noise: float, sds: str) -> None:
    errors = np.linspace(0.5, 2.0, 7)
    if sds != "uneven":
        errors[3 if sds != "unknown" else slice(None)] = {"one is 0": 0.0, "one is infinite": np.inf}.get(sds, np.nan)
    values = 40.0 + 0.03 * np.array(DAYS) + noise * NOISE + 7.0 * np.array(lives)
    found, true = trend_of(values, errors, DAYS, lives), Normal(DAYS, values, errors, lives)
    pieces = lives[-1] + 1
    assert found.per_year is not None
    assert four(found.per_year) == pytest.approx(true.interval([0.0] * pieces + [1.0], YEAR), rel=1e-8)
    assert found.per_year.unit == "N/year"
    assert found.levels == pytest.approx(true.theta[:pieces], rel=1e-9)
    assert found.scatter == pytest.approx(true.scatter if sds == "uneven" else math.nan, rel=1e-8, nan_ok=True)
    assert len(found.repairs) == pieces - 1
    for k, step in enumerate(found.repairs):
        contrast = [0.0] * pieces + [0.0]
        contrast[k], contrast[k + 1] = -1.0, 1.0
        assert four(step.change) == pytest.approx(true.interval(contrast), rel=1e-8)
        assert step.change.unit == "N"
        assert step.date == FIRST_DAY + timedelta(days=DAYS[lives.index(k + 1)])
    for piece in range(pieces):
        line = true.theta[piece] + true.theta[-1] * np.array([0.0, 30.0, -10.0])
        assert found.fitted(np.array([0.0, 30.0, -10.0]), piece) == pytest.approx(line)


def test_values_that_lie_on_a_line_are_as_sure_as_their_digits() -> None:
    values = 40.0 + 0.03 * np.array(DAYS)
    found = trend_of(values, np.full(7, np.nan), DAYS)
    assert found.per_year is not None
    away = np.array(DAYS) - np.mean(DAYS)
    # The rounding of the largest value, 1e-12 of it, stands for the scatter.
    assert found.per_year.sd == pytest.approx(YEAR * 46.0e-12 / np.linalg.norm(away), rel=0.5)
    assert found.per_year.value == pytest.approx(0.03 * YEAR)


@pytest.mark.parametrize("sds", [[0.1, 0.1], [math.nan, math.nan]])
def test_two_values_have_a_slope_and_nothing_to_judge_it_by(sds: list[float]) -> None:
    found = trend_of([9.0, 9.3], sds, [0.0, 100.0])
    assert found.per_year is not None
    assert found.per_year.value == pytest.approx(0.003 * YEAR)
    assert all(math.isnan(number) for number in four(found.per_year)[1:])
    assert math.isnan(found.scatter)
    assert not found.moves
    assert found.says == "static gain: 1.1 N/year, from too few calibrations for an interval"


def test_where_no_slope_can_be_told_the_levels_are_means_by_weight() -> None:
    found = trend_of([9.0, 9.3, 10.0, 10.6], [0.1, 0.2, 0.1, 0.2], [0.0, 0.0, 50.0, 50.0], [0, 0, 1, 1])
    assert found.per_year is None
    assert not found.moves
    # Weights of 4 to 1; of two values each 0.3 and 0.6 apart: chi-square 0.09 / 0.05 + 0.36 / 0.05 with 2 degrees.
    assert found.levels == pytest.approx([9.06, 10.12])
    assert found.scatter == pytest.approx(math.sqrt(9.0 / 2.0))
    (step,) = found.repairs
    sd = math.sqrt(4.5 * 2.0 / 125.0)  # each level's weight is 100 + 25
    half = student.ppf(0.975, 2) * sd
    assert four(step.change) == pytest.approx((1.06, sd, 1.06 - half, 1.06 + half))
    assert found.fitted(np.array([0.0, 99.0]), 1) == pytest.approx([10.12, 10.12])
    assert found.says == "static gain: no trend can be distinguished from the repairs"


def test_a_trend_is_told_whole() -> None:
    found = trend_of([9.0, 9.1, 9.4, 9.2], [0.1, 0.1, np.inf, 0.1], [0.0, 10.0, 20.0, 30.0], [0, 0, 1, 1])
    assert found.per_year is not None
    assert found.to_dict() == {
        "unit": "N", "values": [9.0, 9.1, 9.4, 9.2], "sds": [0.1, 0.1, None, 0.1],
        "per_year": found.per_year.to_dict(), "repairs": [step.to_dict() for step in found.repairs], "jumps": [],
        "scatter": None, "says": found.says,
    }  # fmt: skip
    known = trend_of([9.0, 9.1, 9.4], [0.1] * 3, [0.0, 10.0, 20.0])
    assert known.to_dict()["scatter"] == known.scatter > 0.0
    assert trend_of([9.0, 9.1], [0.1] * 2, [0.0, 0.0]).to_dict()["per_year"] is None


@pytest.mark.parametrize(
    ("ci95", "leaves_out"),
    [((0.0, 1.0), False), ((-1.0, 0.0), False), ((1e-9, 1.0), True), ((-1.0, -1e-9), True), ((-1.0, 1.0), False),
     ((math.nan, math.nan), False)],
)  # fmt: skip
def test_a_change_counts_where_its_interval_leaves_out_zero(ci95: tuple[float, float], leaves_out: bool) -> None:
    change = Parameter(0.5, 0.1, ci95, "N")
    step = DriftStep(moment("2026-03-31"), change, "so")
    assert step.is_significant == leaves_out
    assert step.to_dict() == {"date": "2026-03-31", "change": change.to_dict(), "says": "so"}
    trend = trend_of([9.0, 9.1, 9.4], [0.1] * 3, [0.0, 10.0, 20.0])
    assert replace(trend, per_year=change).moves == leaves_out


# -- jumps ---------------------------------------------------------------------------------------------------------
def test_every_jump_is_told_and_in_order_of_time() -> None:
    days = [30.0 * k for k in range(14)]
    steps = 3.0 * (np.arange(14) >= 9) - 1.0 * (np.arange(14) >= 4)
    values = 40.0 + 0.01 * np.array(days) + 0.05 * np.resize([1.0, -1.0, 0.5], 14) + steps
    found = trend_of(values, np.full(14, np.nan), days)
    assert [jump.date for jump in found.jumps] == [FIRST_DAY + timedelta(days=days[k]) for k in (4, 9)]
    assert found.pieces.tolist() == [0] * 4 + [1] * 5 + [2] * 5
    true = Normal(days, values, np.full(14, np.nan), found.pieces.tolist())
    for k, jump in enumerate(found.jumps):
        contrast = [0.0] * 4
        contrast[k], contrast[k + 1] = -1.0, 1.0
        assert four(jump.change) == pytest.approx(true.interval(contrast), rel=1e-8)
    first, second = found.jumps
    low, high = first.change.ci95
    assert first.says == (
        f"static gain changed by {first.change.value:.3g} N (95 %: {low:.3g} to {high:.3g}) between {day(90)} and"
        f" {day(120)}, which no repair explains"
    )
    assert found.says.endswith(f"% a year; {first.says}; {second.says}")
    assert found.repairs == ()


@pytest.mark.parametrize("at", [3, 6, 9])
def test_a_large_jump_is_told_where_it_is_and_once(at: int) -> None:
    days = [30.0 * k for k in range(12)]
    values = 40.0 + 0.05 * np.resize([1.0, -1.0, 0.5], 12) + 5.0 * (np.arange(12) >= at)
    found = trend_of(values, np.full(12, np.nan), days)
    assert [jump.date for jump in found.jumps] == [FIRST_DAY + timedelta(days=days[at])]


@pytest.mark.parametrize("at", [5, 9, 13])
def test_of_gaps_that_all_look_like_jumps_the_strongest_is_one(at: int) -> None:
    """Beside a step each of its neighbours divides the values nearly as well."""
    rng = np.random.default_rng(at)
    days = np.cumsum(rng.uniform(5.0, 60.0, 18))
    values = 2.0 * (np.arange(18) >= at) + 0.1 * rng.standard_normal(18)
    whole = np.zeros(18, dtype=np.intp)
    assert _jump(days, values, np.full(18, 0.1), whole) == at
    beside = np.delete(np.arange(18), at)  # without the first value behind it the next gap is
    assert _jump(days[beside], values[beside], np.full(17, 0.1), whole[beside]) == at


@pytest.mark.parametrize(("shift", "is_told"), [(0.06, True), (-0.06, False)])
def test_a_jump_beside_a_repair_is_one_of_the_gaps_within_its_pieces(shift: float, is_told: bool) -> None:
    days, lives = [30.0 * k for k in range(11)], [0] * 7 + [1] * 4
    noise = np.random.default_rng(4).normal(0.0, 0.3, 11)
    split = [0] * 3 + [1] * 4 + [2] * 4

    def chance(size: float) -> float:
        """By Student's t, times nine: of ten gaps the repair is in one."""
        true = Normal(days, 40.0 + noise + size * (np.array(split) > 0), np.full(11, np.nan), split)
        value, sd, *_ = true.interval([-1.0, 1.0, 0.0, 0.0])
        return 9.0 * 2.0 * float(student.sf(abs(value) / sd, true.freedom))

    sizes = np.linspace(0.5, 10.0, 20001)
    at_one = sizes[np.argmax([chance(size) < 0.01 for size in sizes[::50]]) * 50]
    found = trend_of(40.0 + noise + (1.0 + shift) * at_one * (np.array(split) > 0), np.full(11, np.nan), days, lives)
    assert [jump.date for jump in found.jumps] == [FIRST_DAY + timedelta(days=90.0)] * is_told
    assert len(found.repairs) == 1


def test_a_step_that_a_repair_explains_is_no_jump_and_the_other_way() -> None:
    days = [30.0 * k for k in range(12)]
    values = 40.0 + 0.05 * np.resize([1.0, -1.0, 0.5], 12) + 3.0 * (np.arange(12) >= 6)
    explained = trend_of(values, np.full(12, np.nan), days, [0] * 6 + [1] * 6)
    assert (len(explained.repairs), len(explained.jumps)) == (1, 0)
    assert "which no repair" not in explained.says
    beside = trend_of(values, np.full(12, np.nan), days, [0] * 9 + [1] * 3)
    assert (len(beside.repairs), len(beside.jumps)) == (1, 1)
    assert not beside.repairs[0].is_significant
    assert "at the repair" not in beside.says
    assert "at the repair" in explained.says


# -- what is said --------------------------------------------------------------------------------------------------
def test_a_zero_that_moves_has_no_share_a_year(tmp_path: Path) -> None:
    store = CalibrationStore(tmp_path)
    for k in range(5):
        store.add(calibration(created=day(73.05 * k), offset=0.5 * k + 0.01 * (k == 2)))
    found = drift(store, "S1")
    assert list(found.trends) == ["static_gain", "a1", "b0", "b1", "zero"]
    zero = found.trends["zero"]
    assert zero.per_year is not None
    low, high = zero.per_year.ci95
    assert zero.says == f"zero rises: {zero.per_year.value:.3g} mbar/year (95 %: {low:.3g} to {high:.3g})"
    assert zero.per_year.value == pytest.approx(2.5, rel=0.02)
    assert zero.moves
    assert not found.trends["a1"].moves
    assert " a1 " not in found.trends["a1"].says
    assert found.trends["a1"].says.startswith("a1 shows no trend: ")


def test_a_drift_is_told_whole(tmp_path: Path) -> None:
    store = CalibrationStore(tmp_path)
    for k in range(4):
        made = calibration(aged(0, 0, 1.0 + 0.001 * k), created=day(100.0 * k))
        store.add(replace(made, load_range_n=(0.0, 700.0 - 10.0 * k)))
    store.place("S1", "left_heel", day(3)), store.repair("S2", day(150))
    found = drift(store, "S1")
    assert found.to_dict() == {
        "schema": "smartshoe.drift/1", "serial_number": "S1",
        "calibrations": [entry.to_dict() for entry in store.history("S1")],
        "events": [event.to_dict() for event in store.events("S1")],
        "top_load_n": 670.0,
        "trends": {name: trend.to_dict() for name, trend in found.trends.items()},
        "says": found.says,
    }  # fmt: skip
    assert len(found.events) == 1
    for name, trend in found.trends.items():
        assert trend.name == name
        assert trend.days.tolist() == [0.0, 100.0, 200.0, 300.0]
        assert trend.repairs == ()
    assert found.trends["static_gain"].values[2] == pytest.approx(1.002 * LEFT_TOE[2] / LEFT_TOE[0])
    assert "a year at 670 N (" in found.says


@pytest.mark.parametrize(("repaired", "pieces"), [(99.0, 1), (100.0, 1), (101.0, 2), (250.0, 3), (301.0, 4), (-5.0, 0)])
def test_a_calibration_of_the_moment_of_a_repair_is_after_it(tmp_path: Path, repaired: float, pieces: int) -> None:
    store = CalibrationStore(tmp_path)
    for k in range(4):
        store.add(calibration(aged(0, 0, 1.0 + 0.001 * k), created=day(100.0 * k)))
    store.repair("S1", day(repaired)), store.place("S1", "left_heel", day(150))
    trend = drift(store, "S1").trends["static_gain"]
    assert np.flatnonzero(np.diff(trend.pieces)).tolist() == [pieces - 1] * (0 < pieces < 4)
    assert [step.date for step in trend.repairs] == [moment(day(repaired))] * (0 < pieces < 4)


@pytest.mark.parametrize("count", [2, 3])
def test_too_few_calibrations_between_repairs_tell_no_drift(tmp_path: Path, count: int) -> None:
    store = CalibrationStore(tmp_path)
    for k in range(count):
        store.add(calibration(aged(0, 0, 1.0 + 0.001 * k), created=day(100.0 * k)))
        store.repair("S1", day(100.0 * k + 50))
    start = f"unit S1, {count} calibrations over {100 * (count - 1)} days"
    assert drift(store, "S1").says == f"{start}: too few between repairs to tell a trend of the static gain"


def test_a_drift_with_a_jump_says_it_at_the_end(tmp_path: Path) -> None:
    store = CalibrationStore(tmp_path)
    for k in range(10):
        factor = (1.0 + 0.0005 * (-1.0) ** k) * (1.1 if k > 4 else 1.0)
        store.add(calibration(aged(0, 0, factor), created=day(30.0 * k)))
    found = drift(store, "S1")
    (jump,) = found.trends["static_gain"].jumps
    assert found.says.startswith("unit S1, 10 calibrations over 270 days: the static gain shows no drift beyond")
    assert found.says.endswith(f"; {jump.says}")


def test_readings_of_two_units_have_no_drift(tmp_path: Path) -> None:
    store = CalibrationStore(tmp_path)
    store.add(calibration()), store.add(replace(calibration(created=day(30)), reading_unit=VOLT))
    with pytest.raises(UsageError, match="V and mbar, which do not compare"):
        drift(store, "S1")
