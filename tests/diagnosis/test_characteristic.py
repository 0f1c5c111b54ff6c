"""How a reading runs over its load, told without a model."""

from __future__ import annotations

import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from smartshoe.diagnosis import Thresholds
from smartshoe.diagnosis._characteristic import characteristic_of
from smartshoe.recording import Recording

Array = NDArray[np.float64]

TIME_S = np.arange(0.0, 60.0, 0.01)
TRIANGLE = 100.0 * (2.0 * np.abs(2.0 * (TIME_S / 6.0 % 1.0) - 1.0) - 1.0)


def _said(reading: Array, load: Array = TRIANGLE) -> str | None:
    return characteristic_of(Recording.from_arrays(time_s=TIME_S, force_n=load, pressure_mbar=reading), Thresholds())


def _rising() -> Array:
    return np.sign(np.gradient(TRIANGLE))


@given(half=st.floats(1.0, 50.0), offset=st.floats(-200.0, 200.0), seed=st.integers(0, 1000))
@settings(max_examples=15)
def test_friction_is_seen_as_a_reading_that_follows_the_direction(half: float, offset: float, seed: int) -> None:
    noise = np.random.default_rng(seed).normal(0.0, 0.05 * half, TIME_S.size)
    said = _said(offset + half * _rising() + noise)
    assert said is not None
    assert "not follow this load but its direction" in said
    assert float(re.findall(r"lies ([\d.]+) mbar above", said)[0]) == pytest.approx(half, rel=0.02)


def test_friction_that_opposes_lies_below() -> None:
    said = _said(-5.0 * _rising())
    assert said is not None
    assert "5 mbar below" in said


@pytest.mark.parametrize(
    ("reading", "words"),
    [
        (50.0 * np.tanh(TRIANGLE / 20.0), "it flattens"),
        (TRIANGLE**3 / 1e4, "it steepens"),
        (TRIANGLE, "nearly straight"),
    ],
    ids=["saturates", "hardens", "straight"],
)
def test_the_curve_is_told(reading: Array, words: str) -> None:
    said = _said(reading)
    assert said is not None
    assert words in said


def test_slopes_are_those_of_the_curve() -> None:
    said = _said(3.0 * TRIANGLE)
    assert said is not None
    assert [float(value) for value in re.findall(r"by ([\d.]+) mbar/N", said)] == pytest.approx([3.0, 3.0], rel=0.01)


def test_a_reading_that_has_nothing_to_do_with_the_load_has_no_course() -> None:
    assert _said(np.random.default_rng(1).normal(0.0, 1.0, TIME_S.size)) is None
    assert _said(np.full(TIME_S.size, 5.0)) is None
