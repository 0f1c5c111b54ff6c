"""Differences in sd and in newtons, trends with intervals that hold, repairs and jumps told apart."""

from __future__ import annotations

import math
from dataclasses import replace
from datetime import timedelta
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from lives import FIRST_DAY, LEFT_TOE, SDS, aged, calibration, day
from scipy.stats import chi2, linregress
from scipy.stats import t as student

from smartshoe.calibration import Calibration
from smartshoe.calibration.store import CalibrationStore
from smartshoe.calibration.store.compare import Comparison, compare
from smartshoe.calibration.store.drift import Trend, _trend, drift
from smartshoe.calibration.store.quantities import quantities, top_load_n
from smartshoe.errors import UsageError
from smartshoe.units import VOLT

# Between samples the reading is taken as straight, and it bends: a millionth of the load, in second order of the step.
BETWEEN_SAMPLES_N = 1e-5


def test_a_calibration_agrees_with_itself() -> None:
    found = compare(calibration(), calibration())
    assert found.p_value == 1.0
    assert max(abs(item.largest_n) for item in found.forces) < BETWEEN_SAMPLES_N
    assert all(item.difference == 0.0 for item in found.parameters)


@given(st.floats(-0.05, 0.05))
def test_a_change_of_gain_is_that_share_of_the_load_at_every_rate(share: float) -> None:
    found = compare(calibration(), calibration(aged(0, 0, 1.0 + share)))
    for item in found.forces:
        assert item.largest_n == pytest.approx(share * 800.0, abs=BETWEEN_SAMPLES_N)
        if abs(share) > 1e-5:
            assert item.at_load_n == pytest.approx(800.0)


def test_a_change_of_the_fast_gain_alone_shows_most_at_the_fast_rate() -> None:
    a1, b0, b1 = LEFT_TOE
    found = compare(calibration(), calibration((a1, 1.02 * b0, b1)))
    sizes = [abs(item.largest_n) for item in found.forces]
    assert sizes == sorted(sizes)
    # At 800 N/s the ramp of 1 s is short against 1/a1 = 4.7 s: nearly the whole 2 % of 800 N.
    assert 13.0 < sizes[-1] < 16.0


def test_the_sd_of_the_force_difference_is_what_drawn_errors_give() -> None:
    rng = np.random.default_rng(1)
    drawn = [
        compare(calibration(rng=rng), calibration(rng=rng), (200.0,)).forces[0]
        for _ in range(100)
    ]  # fmt: skip
    # At the load where it is largest, a difference of zero mean has |x|/sd above the half-normal's mean 0.8.
    ratio = np.array([abs(item.largest_n) / item.sd_n for item in drawn])
    assert 0.6 < ratio.mean() < 2.0


def test_p_values_of_unchanged_units_are_uniform() -> None:
    rng = np.random.default_rng(2)
    p = np.array([compare(calibration(rng=rng), calibration(rng=rng), (200.0,)).p_value for _ in range(300)])
    # 300 draws: the share below 0.05 has sd 0.0126; four of them.
    assert abs((p < 0.05).mean() - 0.05) < 0.05
    assert abs(p.mean() - 0.5) < 4 * math.sqrt(1 / 12 / 300)


def test_a_changed_unit_is_called_changed() -> None:
    rng = np.random.default_rng(3)
    found = compare(calibration(rng=rng), calibration(aged(0, 0, 1.01), rng=rng))
    assert found.p_value < 1e-6
    assert "has changed" in found.says
    by_name = {item.name: item for item in found.parameters}
    assert by_name["static_gain"].in_sd > 5.0
    assert by_name["static_gain"].percent == pytest.approx(1.0, abs=0.2)


@pytest.mark.parametrize(("chance", "says"), [(0.008, "has changed"), (0.015, "")])
def test_a_unit_is_called_changed_where_errors_do_it_less_than_once_in_a_hundred(chance: float, says: str) -> None:
    a1, b0, b1 = LEFT_TOE

    def changed_by(sds: float) -> Comparison:
        return compare(calibration(), calibration((a1, b0 + sds * SDS[1], b1)), (200.0,))

    # The quadratic form of the difference is a chi-square of three, one for a1, b0 and b1 each.
    one = chi2.isf(changed_by(1.0).p_value, 3)
    found = changed_by(math.sqrt(chi2.isf(chance, 3) / one))
    assert found.p_value == pytest.approx(chance, rel=1e-6)
    assert ("has changed" in found.says) == bool(says)


def test_without_errors_nothing_is_claimed() -> None:
    found = compare(calibration(has_errors=False), calibration(aged(0, 0, 1.01)))
    assert math.isnan(found.p_value)
    assert "cannot be told" in found.says
    assert found.to_dict()["p_value"] is None


def test_an_extended_calibration_compares_by_its_model() -> None:
    from smartshoe.calibration import extended_calibration

    plain = calibration()
    extended = extended_calibration(plain.model(), load_range_n=(0.0, 800.0))
    found = compare(plain, extended, (200.0,))
    # Two ways to discretise one filter: the bilinear step of 1/800 of the press and the exact one.
    assert abs(found.forces[0].largest_n) < 0.5


@pytest.mark.parametrize("rate_n_per_s", [50.0, 800.0])
def test_an_extended_calibration_without_effects_differs_as_its_coefficients_do(rate_n_per_s: float) -> None:
    from smartshoe.calibration import extended_calibration

    a1, b0, b1 = LEFT_TOE
    other = calibration((2.0 * a1, b0, 2.0 * b1))  # relaxes twice as fast
    extended = extended_calibration(other.model(), load_range_n=(0.0, 800.0))
    (plain,), (found,) = (compare(calibration(), one, (rate_n_per_s,)).forces for one in (other, extended))
    assert abs(plain.largest_n) > 5.0
    assert found.largest_n == pytest.approx(plain.largest_n, rel=0.05)
    assert found.rms_n == pytest.approx(plain.rms_n, rel=0.05)


def test_compared_is_up_to_the_load_that_all_have_seen() -> None:
    def seen(top_n: float | None) -> Calibration:
        return replace(calibration(), load_range_n=None if top_n is None else (0.0, top_n))

    assert top_load_n([seen(None), seen(600.0), seen(500.0)]) == 500.0
    assert top_load_n([seen(0.5), seen(600.0)]) == 0.5
    assert top_load_n([seen(0.0), seen(600.0)]) == 600.0
    assert top_load_n([seen(None)]) == top_load_n([]) == 800.0


def test_readings_in_different_units_are_not_compared() -> None:
    with pytest.raises(UsageError, match="V and mbar"):
        compare(calibration(), replace(calibration(), reading_unit=VOLT))


def test_the_static_gain_carries_the_covariance() -> None:
    rng = np.random.default_rng(4)
    gains = [quantities(calibration(rng=rng))["static_gain"].value for _ in range(2000)]
    # An sd from 2000 draws is known to 1/sqrt(2*2000) = 1.6 %.
    assert quantities(calibration())["static_gain"].sd == pytest.approx(np.std(gains), rel=0.08)


# -- drift -----------------------------------------------------------------------------------------------------
def life(
    folder: Path, rng: np.random.Generator, *, count: int = 10, gain_per_year: float = 0.0, placed: float = 0.0,
    repaired: float | None = None, factor: float = 1.0, sd_share: float = 1.0,
) -> CalibrationStore:  # fmt: skip
    store = CalibrationStore(folder)
    for k in range(count):
        at = 30.0 * k
        now = factor if repaired is not None and at >= repaired else 1.0
        theta = aged(at, gain_per_year, now * (1.0 + placed * rng.standard_normal()))
        store.add(calibration(theta, rng=rng, created=day(at), sd_share=sd_share))
    return store


def test_a_trend_is_found_with_its_size(tmp_path: Path) -> None:
    found = drift(life(tmp_path, np.random.default_rng(5), gain_per_year=-0.02), "S1")
    gain = found.trends["static_gain"]
    assert gain.moves
    assert gain.per_year is not None
    true = -0.02 * LEFT_TOE[2] / LEFT_TOE[0]
    assert gain.per_year.ci95[0] < true < gain.per_year.ci95[1]
    assert not found.trends["a1"].moves
    assert "drifts" in found.says


@pytest.mark.parametrize("has_errors", [False, True])
@pytest.mark.parametrize("count", [3, 6])
def test_a_slope_and_its_error_are_those_of_linear_regression(tmp_path: Path, count: int, has_errors: bool) -> None:
    rng, store = np.random.default_rng(11), CalibrationStore(tmp_path)
    for k in range(count):  # scattered by far more than the calibrations' own errors
        theta = aged(30.0 * k, -0.02, 1.0 + 0.01 * rng.standard_normal())
        store.add(calibration(theta, created=day(30.0 * k), has_errors=has_errors))
    trend = drift(store, "S1").trends["static_gain"]
    line = linregress(trend.days, trend.values)
    assert trend.jumps == ()
    assert trend.per_year is not None
    later = trend.days + 10.0
    expected = line.intercept + line.slope * later
    assert trend.fitted(later, 0) == pytest.approx(expected, rel=1e-4 if has_errors else 1e-12)
    # Errors that go with the values weight them a little differently.
    assert trend.per_year.value == pytest.approx(365.25 * line.slope, rel=0.02 if has_errors else 1e-9)
    assert trend.per_year.sd == pytest.approx(365.25 * line.stderr, rel=0.02 if has_errors else 1e-9)
    half = 0.5 * (trend.per_year.ci95[1] - trend.per_year.ci95[0])
    assert half == pytest.approx(student.ppf(0.975, count - 2) * trend.per_year.sd)


def test_the_drift_of_a_unit_that_is_not_there_says_which_are(tmp_path: Path) -> None:
    store = life(tmp_path, np.random.default_rng(5), count=1)
    with pytest.raises(UsageError, match=r"no calibration of unit 'S2'.*it has S1"):
        drift(store, "S2")
    with pytest.raises(UsageError, match="unit S1 has one calibration"):
        drift(store, "S1")


def gain_of_a_life(rng: np.random.Generator, count: int, placed: float) -> Trend:
    """What `drift` follows of the static gain of a life that stays as it is: laws over many need no files."""
    found = [
        quantities(calibration(aged(0.0, 0.0, 1.0 + placed * rng.standard_normal()), rng=rng))["static_gain"]
        for _ in range(count)
    ]
    days = 30.0 * np.arange(count)
    values, sds = np.array([one.value for one in found]), np.array([one.sd for one in found])
    dates = [FIRST_DAY + timedelta(days=float(at)) for at in days]
    return _trend("static_gain", found[0].unit, days, values, sds, np.zeros(count, dtype=np.intp), dates, [])


def test_a_life_without_files_is_what_drift_follows(tmp_path: Path) -> None:
    of_files = drift(life(tmp_path, np.random.default_rng(6), placed=0.002), "S1").trends["static_gain"]
    bare = gain_of_a_life(np.random.default_rng(6), 10, 0.002)
    assert bare.to_dict() == of_files.to_dict()


@pytest.mark.parametrize("count", [3, 6])
def test_what_scatters_less_than_its_errors_has_the_slope_error_of_those(tmp_path: Path, count: int) -> None:
    store = CalibrationStore(tmp_path)
    for k in range(count):  # three have one degree of freedom left
        store.add(calibration(created=day(30.0 * k)))
    trend = drift(store, "S1").trends["static_gain"]
    assert trend.per_year is not None
    lever = np.linalg.norm(trend.days - trend.days.mean())
    assert trend.per_year.sd == pytest.approx(365.25 * quantities(calibration())["static_gain"].sd / lever)
    assert trend.scatter == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("placed", [0.0, 0.002])
def test_the_interval_of_the_slope_holds(placed: float) -> None:
    rng = np.random.default_rng(6)
    inside, count = 0, 120
    for _ in range(count):
        trend = gain_of_a_life(rng, 6, placed)
        assert trend.per_year is not None
        inside += trend.per_year.ci95[0] < 0.0 < trend.per_year.ci95[1]
    # 95 %: of 120, 114 with an sd of 2.4; errors that the sds explain are covered more often, by Birge's rule.
    assert inside >= 107


def test_a_repair_parts_levels_but_not_the_trend(tmp_path: Path) -> None:
    store = life(tmp_path, np.random.default_rng(7), gain_per_year=-0.02, repaired=150.0, factor=1.04)
    store.repair("S1", day(149))
    gain = drift(store, "S1").trends["static_gain"]
    (step,) = gain.repairs
    assert step.is_significant
    level = LEFT_TOE[2] / LEFT_TOE[0]
    assert step.change.ci95[0] < 0.04 * level < step.change.ci95[1] * 1.01
    assert gain.per_year is not None
    assert gain.per_year.value == pytest.approx(-0.02 * level, rel=0.2)
    assert gain.jumps == ()


def test_a_jump_that_no_repair_explains_is_told_with_its_place(tmp_path: Path) -> None:
    store = life(tmp_path, np.random.default_rng(8), gain_per_year=-0.02, repaired=150.0, factor=0.97)
    gain = drift(store, "S1").trends["static_gain"]
    (jump,) = gain.jumps
    assert jump.says.endswith("between 2025-05-06 and 2025-06-05, which no repair explains")
    assert gain.per_year is not None
    assert gain.per_year.value == pytest.approx(-0.02 * LEFT_TOE[2] / LEFT_TOE[0], rel=0.2)


def test_no_jump_lies_between_two_calibrations_of_one_moment(tmp_path: Path) -> None:
    rng, store = np.random.default_rng(13), CalibrationStore(tmp_path)
    for k, at in enumerate((0, 30, 60, 90, 90, 120, 150, 180)):  # pressed twice on one day, and it jumped there
        store.add(calibration(aged(0, 0, 1.0 if k < 4 else 1.1), rng=rng, created=day(at)))
    for trend in drift(store, "S1").trends.values():
        assert all("between 2025-04-06 and 2025-04-06" not in jump.says for jump in trend.jumps)


def test_a_quiet_life_has_no_jumps() -> None:
    rng = np.random.default_rng(9)
    found = [gain_of_a_life(rng, 10, 0.002).jumps for _ in range(60)]
    # One in a hundred by construction; 60 lives with four or more has a chance of 1 in 300.
    assert sum(map(len, found)) < 4


def test_two_calibrations_have_a_slope_and_no_interval(tmp_path: Path) -> None:
    found = drift(life(tmp_path, np.random.default_rng(10), count=2), "S1")
    slope = found.trends["static_gain"].per_year
    assert slope is not None
    assert math.isnan(slope.sd)
    assert not found.trends["static_gain"].moves
    assert "too few" in found.says


def test_a_repair_between_two_calibrations_leaves_no_trend(tmp_path: Path) -> None:
    store = life(tmp_path, np.random.default_rng(11), count=2)
    store.repair("S1", day(10))
    found = drift(store, "S1")
    assert found.trends["static_gain"].per_year is None
    assert found.to_dict()["trends"]["static_gain"]["per_year"] is None


def test_calibrations_of_one_moment_have_a_level_and_no_trend(tmp_path: Path) -> None:
    store = CalibrationStore(tmp_path)
    for factor in (1.0, 1.01, 1.03):
        store.add(calibration(aged(0, 0, factor), created=day(0), has_errors=False))
    gain = drift(store, "S1").trends["static_gain"]
    assert gain.per_year is None
    assert gain.levels == pytest.approx([np.mean(gain.values)])


def test_calibrations_without_errors_are_weighted_alike(tmp_path: Path) -> None:
    store = CalibrationStore(tmp_path)
    for k in range(6):
        store.add(calibration(aged(30.0 * k, 0.02), created=day(30.0 * k), has_errors=False))
    trend = drift(store, "S1").trends["static_gain"]
    assert trend.per_year is not None
    assert trend.per_year.value == pytest.approx(0.02 * LEFT_TOE[2] / LEFT_TOE[0], rel=1e-6)
    assert math.isnan(trend.scatter)


@pytest.mark.parametrize("count", [0, 1])
def test_a_drift_needs_two_calibrations(tmp_path: Path, count: int) -> None:
    with pytest.raises(UsageError, match="S1"):
        drift(life(tmp_path, np.random.default_rng(0), count=count), "S1")


def test_the_figure_shows_every_calibration(tmp_path: Path) -> None:
    from smartshoe.report.drift import headline, write_drift
    from smartshoe.report.paper.drift import draw_drift

    store = life(tmp_path / "store", np.random.default_rng(12), repaired=150.0, factor=0.97)
    store.repair("S1", day(60), "<new> tube")
    found = drift(store, "S1")
    written = write_drift(tmp_path / "out", found)
    page = written["report"].read_text()
    assert "&lt;new&gt; tube" in page
    assert page.count("calibrated at left_toe") == 10
    assert page.count("data-chart=") == len(found.trends) - ("c" in found.trends)
    grade, says = headline(found)
    assert grade == "look"
    assert says.startswith("the static gain jumped by -25 N at 800 N, which no repair explains")
    axes = [axis for axis in draw_drift(found).axes if axis.get_visible()]
    assert len(axes) == len(found.trends)
    # The jump of the static gain is shaded, each repair dashed.
    assert len(axes[0].patches) == 1
    assert sum(line.get_linestyle() == "--" for line in axes[0].lines) == 1


def test_numbers_without_scatter_do_not_move_by_their_rounding(tmp_path: Path) -> None:
    store = CalibrationStore(tmp_path)
    for k in range(8):
        store.add(calibration(aged(0, 0, 1.0 if k < 4 else 1.1), created=day(30.0 * k), has_errors=False))
    store.repair("S1", day(100))
    trend = drift(store, "S1").trends["static_gain"]
    assert not trend.moves
    assert trend.jumps == ()
    assert trend.repairs[0].change.value == pytest.approx(0.1 * LEFT_TOE[2] / LEFT_TOE[0])
