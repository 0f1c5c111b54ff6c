"""A recording that judges is judged on its own clock, whatever clock those that are fitted go by."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from simulators.hidden.recordings import HiddenCase, hide
from smartshoe.arrays import Array
from smartshoe.diagnosis import Diagnosis, diagnose
from smartshoe.integrity import examine
from smartshoe.recording import Recording


@cache
def _sound() -> HiddenCase:
    return hide({}, protocol="mixed", seed=40, recordings=2)


def _late_by(recording: Recording, lag_s: float | Array) -> Recording:
    """The reading of a logger whose clock is behind by so much."""
    time_s, sensor = recording.time_s, recording.sensor
    shown_s = np.clip(time_s - lag_s, time_s[0], time_s[-1])
    return recording.with_channel(sensor.with_values(CubicSpline(time_s, sensor.values)(shown_s)))


def _parting(recording: Recording, rate: float) -> Recording:
    """The reading of a logger whose clock falls behind by ``rate`` s a second."""
    return _late_by(recording, rate * (recording.time_s - recording.time_s[0]))


@cache
def _plain(count: int) -> Diagnosis:
    """Of so many recordings of one clock."""
    case = _sound()
    return diagnose(case.recordings[:count], case.hold_out)


@pytest.mark.parametrize(
    ("count", "rate"),
    [
        (1, 0.003),
        (2, -0.0005),
        *(pytest.param(*one, marks=pytest.mark.long) for one in ((1, -0.0005), (2, 0.003))),
    ],
)
def test_a_sound_recording_is_judged_as_well_beside_fitted_ones_whose_clocks_part(rate: float, count: int) -> None:
    case = _sound()
    fitted = [_parting(one, rate) for one in case.recordings[:count]]
    found, plain = diagnose(fitted, case.hold_out), _plain(count)
    assert found.verdict == "explained"
    cause = found.causes[0]
    assert cause.name == "clock_drift"
    assert cause.parameters["clock_rate_error"].value == pytest.approx(rate, rel=0.1)
    assert found.extended is not None
    assert plain.baseline is not None
    assert found.extended.rmse < 1.2 * plain.baseline.rmse
    assert not any("another unit" in said or "is worse than" in said for said in found.limits)
    (said,) = [said for said in found.limits if "was shifted to" in said]
    assert " more each second; it was shifted to their clock before it is used as held-out data" in said


@pytest.mark.parametrize("rate", [0.003, 0.0005])
def test_a_recording_whose_clock_parts_is_judged_on_that_of_the_fitted_ones(rate: float) -> None:
    case = _sound()
    held_out = [_parting(one, rate) for one in case.hold_out]
    found, plain = diagnose(case.recordings, held_out), _plain(2)
    assert found.baseline is not None
    assert plain.baseline is not None
    assert found.baseline.rmse < 1.2 * plain.baseline.rmse
    assert any("it was shifted to their clock" in said for said in found.limits)
    assert not any("another unit" in said for said in found.limits)


@pytest.mark.parametrize(
    ("fitted", "judging", "seed"),
    [
        ("minor_loops", "holds", 40),
        ("minor_loops", "shuffled", 41),
        ("staircase", "recovery", 41),
        ("mixed", "rates", 40),
    ],
)
def test_a_recording_whose_clock_parts_as_those_of_the_fitted_ones_do_is_on_their_clock(
    fitted: str, judging: str, seed: int
) -> None:
    """None of them tells it alone: beside others that part as it does, a line of its own halves what is left of it."""
    first, later = (hide({}, protocol=one, seed=seed, recordings=2) for one in (fitted, judging))
    alike = [_parting(one, 0.0005) for one in (*first.recordings, later.hold_out[0])]
    assert not examine(alike, count=len(first.recordings)).others


@pytest.mark.long
def test_a_recording_that_is_late_by_some_milliseconds_more_is_judged_on_the_clock_of_the_fitted_ones() -> None:
    """Such a lag shows beside a model only; the causes had been rejected for it, as worse on held-out data."""
    case = hide(["power_law_creep"], protocol="mixed", seed=7, recordings=2)
    late = [_late_by(one, 0.02) for one in case.hold_out]
    found, plain = diagnose(case.recordings, late), diagnose(case.recordings, case.hold_out)
    assert [(one.name, one.confidence) for one in found.causes] == [(one.name, one.confidence) for one in plain.causes]
    assert found.extended is not None
    assert plain.extended is not None
    assert found.verdict == plain.verdict == "explained"
    assert found.extended.rmse < 1.2 * plain.extended.rmse
    said = [said for said in found.limits if "the reading lags those of the fitted recordings by" in said]
    assert len(said) == len(late)
    assert not any("was shifted" in said for said in plain.limits)
