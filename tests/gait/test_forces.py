"""Forces against truth: totals, peaks, body weight, standing, and what passes beside the units."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from calibrated import eight_calibrations
from force_scoring import peak_errors, total_error
from trials import analysed, loads_of, ran, recorded, stood, walked

from simulators.people import Person, Stand, Tiptoe, Walk, trial
from smartshoe.calibration import Calibration
from smartshoe.errors import InputError, UsageError
from smartshoe.gait import Coverage, analyse, learn_coverage


@pytest.fixture(scope="module")
def calibrations() -> list[Calibration]:
    return eight_calibrations()


@pytest.mark.parametrize("speed", [0.8, 1.3, 2.0])
def test_total_force_of_walking_through_calibrated_units(speed: float, calibrations: list[Calibration]) -> None:
    made = trial(Person(), Walk(speed), 30.0, np.random.default_rng(7), outside="even")
    found = analyse(made.recording, calibrations, coverage=0.8)
    assert total_error(found, made) < 0.03
    assert np.median(np.abs(peak_errors(found, made))) < 0.03
    weight = found.forces.body_weight
    assert weight is not None
    assert weight.value == pytest.approx(519.4, rel=0.01)


def test_a_learned_course_of_coverage_knows_when_the_midfoot_bears(calibrations: list[Calibration]) -> None:
    rng = np.random.default_rng(8)
    made, teach = (trial(Person(), Walk(1.3), seconds, rng, outside="midfoot") for seconds in (30.0, 20.0))
    learned = learn_coverage(analyse(teach.recording, calibrations), teach.total_n)
    assert learned.share == pytest.approx(0.8, abs=0.01)
    errors = {
        name: total_error(analyse(made.recording, calibrations, coverage=coverage), made)
        for name, coverage in (("even", 0.8), ("published", Coverage.midfoot(0.8)), ("learned", learned))
    }
    assert errors["learned"] < 0.03
    assert errors["learned"] < errors["published"] < 0.5 * errors["even"]


def test_a_course_of_coverage_survives_its_file(tmp_path: Path) -> None:
    course = Coverage.midfoot(0.75)
    course.save(tmp_path / "course.csv")
    assert Coverage.load(tmp_path / "course.csv") == course
    assert course.course is not None
    # What passes beside the units is the rest of the impulse.
    assert np.mean(course.course) == pytest.approx(0.25 / 0.75)
    # A runner's stance is short, and loads the midfoot otherwise.
    assert course.least_stance_s == pytest.approx(0.4)
    (tmp_path / "other.csv").write_text("a,b\n1,2\n")
    with pytest.raises(InputError, match=r"other\.csv is no course of coverage"):
        Coverage.load(tmp_path / "other.csv")
    with pytest.raises(UsageError, match=r"coverage is 1\.2"):
        Coverage(1.2)


def test_the_published_course_is_left_out_of_running() -> None:
    even, published = (analyse(ran().recording, coverage=way) for way in (0.8, Coverage.midfoot(0.8)))
    assert np.array_equal(even.feet["left"].force_n, published.feet["left"].force_n)
    walking = analyse(walked().recording, coverage=Coverage.midfoot(0.8))
    # The share of the impulse stays, when it comes does not.
    assert walking.forces.mean_total_n == pytest.approx(analysed().forces.mean_total_n, rel=0.005)
    moved = np.abs(walking.feet["left"].force_n - analysed().feet["left"].force_n)
    assert moved.max() > 50.0


def test_standing_total_after_correction(calibrations: list[Calibration]) -> None:
    made = trial(Person(), ((Tiptoe(), 15.0), (Stand(), 45.0)), 60.0, np.random.default_rng(9))
    found = analyse(made.recording, calibrations, coverage=0.8)
    assert found.activity == "standing"
    assert found.forces.standing_total_n == pytest.approx(519.4, rel=0.01)
    assert found.forces.mean_total_n == found.forces.standing_total_n


def test_an_estimator_gives_forces_with_error_bars(calibrations: list[Calibration]) -> None:
    made = trial(Person(), Walk(1.3), 4.0, np.random.default_rng(10), outside="even")
    plain, barred = (analyse(made.recording, calibrations, coverage=0.8, estimator=way) for way in (None, "lead"))
    assert total_error(barred, made) == pytest.approx(total_error(plain, made), rel=0.05)
    for foot in barred.feet.values():
        assert foot.sd_n is not None
        assert (foot.sd_n > 0.0).all()
    assert "left_total_sd_n" in barred.to_frame("forces")
    with pytest.raises(UsageError, match="estimator 'best' is not known"):
        analyse(made.recording, calibrations, estimator="best")


def test_body_weight_is_the_mean_total_over_whole_strides() -> None:
    weight = analysed().forces.body_weight
    assert weight is not None
    assert weight.source == "strides"
    assert abs(weight.value - 519.4) < 4.0 * weight.sd
    assert 0.0 < weight.sd < 10.0


def test_body_weight_given_is_kept_and_a_mismatch_said() -> None:
    found = analyse(walked().recording, body_weight_n=519.4, coverage=1.0)
    assert found.to_dict()["forces"]["body_weight_n"] == {"value": 519.4, "sd": 0.0}
    (flag,) = [flag for flag in found.flags if flag.kind == "body_weight_mismatch"]
    assert "coverage of 0.80" in flag.says


def test_drift_of_the_zero_is_taken_from_the_swings() -> None:
    time_s = walked().time_s
    drifting = {name: values + 0.5 * time_s for name, values in loads_of(walked()).items()}
    found = analyse(recorded(time_s, drifting), coverage=0.8)
    assert found.forces.mean_total_n == pytest.approx(analysed().forces.mean_total_n, rel=2e-3)


def test_the_expected_error_is_that_of_the_swing() -> None:
    # Four units of 1 N noise each, two feet, over the coverage: sqrt(8) / 0.8, and the last of each release.
    assert analysed().forces.rmse_estimate_n == pytest.approx(np.sqrt(8.0) / 0.8, rel=0.1)


def test_impulse_and_peak_are_those_of_the_true_stance() -> None:
    for stride in analysed().strides[4:10]:
        truth_n = walked().total_n[stride.foot]
        first, last = np.searchsorted(walked().time_s, [stride.start_s, stride.toe_off_s])
        # Regions vary by 3 % from stance to stance, so that the share under the units does by a half of that.
        assert stride.impulse_n_s == pytest.approx(truth_n[first:last].sum() / 200.0, rel=0.03)
        assert stride.peak_n == pytest.approx(truth_n[first:last].max(), rel=0.03)


def test_the_standing_total_of_loads_in_newton() -> None:
    found = analyse(stood().recording, coverage=0.8)
    assert found.forces.standing_total_n == pytest.approx(519.4, rel=0.005)
