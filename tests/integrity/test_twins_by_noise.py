"""Recordings that are copies of others in other digits or units, or at another rate, are told by their noise."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from smartshoe import Recording, diagnose
from smartshoe.diagnosis import Thresholds
from smartshoe.integrity import twins_by_noise

STANDARD = Thresholds()
TIME_S = np.arange(0.0, 20.0, 0.01)
LOAD_N = 800.0 * np.abs(2.0 * (TIME_S / 4.0 % 1.0) - 1.0)


def _run(name: str, seed: int = 1) -> Recording:
    reading = 0.1 * LOAD_N + np.random.default_rng(seed).standard_normal(TIME_S.size)
    return Recording.from_arrays(time_s=TIME_S, force_n=LOAD_N, pressure_mbar=reading, name=name)


def _written(digits: int = 4, share: int = 1, shift: float = 0.0, name: str = "copy") -> Recording:
    """The course of `_run`, in kPa of so many ``digits``, with every ``share``-th row and its times from ``shift``."""
    one = _run("one").taken(slice(None, None, share))
    columns = {"force_n": one.force_n.round(digits), "pressure_kpa": (0.1 * one.sensor.values).round(digits)}
    return Recording.from_arrays(time_s=one.time_s + shift, name=name, **columns)


@pytest.mark.parametrize(
    "written",
    [{}, {"digits": 2}, {"share": 2}, {"digits": 3, "share": 3, "shift": 5.0}],
    ids=["unit", "digits", "rate", "all of them"],
)
def test_a_copy_in_other_digits_units_or_rate_is_told_by_its_noise(written: dict[str, float]) -> None:
    for one, other in ((_run("one"), _written(**written)), (_written(**written), _run("one"))):
        (place,) = found = twins_by_noise((one, other), STANDARD)
        assert place == 1
        assert found[1].at.all()
        assert found[1].says == (
            f"{other.name} has the same noise as {one.name}, in other digits or units, or at another rate: it is one"
            " experiment, given twice"
        )


@given(st.integers(0, 2**32 - 1), st.floats(-5.0, 3.0), st.sampled_from([0.0, 1e-3, 0.03, 1.0, 10.0]))
def test_repetitions_of_one_course_are_no_copies_however_quiet_or_coarse(seed: int, log_sd: float, step: float) -> None:
    """The same load, to the sample, and a reading with noise of any size on a grid of any step."""
    rng = np.random.default_rng(seed)
    courses = (0.1 * LOAD_N + 10.0**log_sd * rng.standard_normal(LOAD_N.size) for _ in range(2))
    readings = [step * np.rint(one / step) if step else one for one in courses]
    runs = [
        Recording.from_arrays(time_s=TIME_S, force_n=LOAD_N, pressure_mbar=one, name=name)
        for one, name in zip(readings, ("one", "again"), strict=True)
    ]
    assert np.array_equal(*readings) or twins_by_noise(runs, STANDARD) == {}


def test_the_same_shape_without_noise_is_no_copy() -> None:
    """Its second differences keep their signs: nothing shows that it was recorded once only."""
    shape = 40.0 * (1.0 + np.sin(TIME_S * 40.0))
    runs = [
        Recording.from_arrays(time_s=TIME_S, force_n=10.0 * shape, pressure_mbar=shape + off, name=f"run_{off}")
        for off in (0.0, 1e-3)
    ]
    assert twins_by_noise(runs, STANDARD) == {}


def test_one_reading_beside_another_load_column_is_one_experiment() -> None:
    one = _run("one")
    assert [*twins_by_noise((one, one.with_channel(replace(one["force"], values=1.01 * LOAD_N))), STANDARD)] == [1]
    assert twins_by_noise((one, one.with_channel(replace(one["force"], values=800.0 - LOAD_N))), STANDARD) == {}


def test_recordings_without_one_load_and_one_reading_are_refused_for_that() -> None:
    one = _run("one")
    two = one.with_channel(replace(one.sensor, name="second", values=2.0 * one.sensor.values))
    for other in (one.without("force"), one.without("pressure"), two):
        assert twins_by_noise((other, one, other), STANDARD) == {}
        assert diagnose(other).verdict == "refused"


def test_a_diagnosis_does_not_judge_on_a_rounded_copy() -> None:
    found = diagnose(_run("one"), hold_out=_written(digits=2))
    assert found.left_out == (
        "copy has the same noise as one, in other digits or units, or at another rate: it is one experiment, given"
        " twice",
    )
