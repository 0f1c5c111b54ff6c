"""Figures of merit on cases whose answer is known."""

from __future__ import annotations

import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import smartshoe
from smartshoe.compensate import Calibration
from smartshoe.units import MILLIBAR
from smartshoe.validate import validate
from smartshoe.validate.metrics import delay_s, improvement_percent, largest_difference, loop_area, static_fit


@given(a=st.floats(0.1, 1e3), b=st.floats(0.1, 1e3))
@settings(max_examples=20)
def test_an_ellipse_encloses_pi_a_b(a, b):
    angle = np.linspace(0.0, 2 * np.pi, 2000, endpoint=False)
    # A polygon of n corners in an ellipse lacks 2 pi^2 / (3 n^2) of its area.
    assert loop_area(a * np.cos(angle), 5.0 + b * np.sin(angle)) == pytest.approx(np.pi * a * b, rel=2e-6)


def test_branches_a_constant_apart_differ_by_that_constant():
    load = np.concatenate([np.linspace(0.0, 800.0, 400), np.linspace(800.0, 0.0, 400)])
    estimate = load + np.where(np.arange(800) < 400, 12.0, -8.0)
    assert largest_difference(load, estimate, 400) == pytest.approx(20.0, rel=0.2)


@given(shift_s=st.floats(-0.05, 0.05))
@settings(max_examples=20)
def test_a_delay_is_found_below_one_sample(shift_s):
    time_s = np.arange(0.0, 10.0, 0.01)
    load, late = (np.sin(2 * np.pi * 0.7 * (time_s - d)) for d in (0.0, shift_s))
    assert delay_s(load, 0.8 * late + 3.0, 0.01) == pytest.approx(shift_s, abs=1e-3)


def _recording(gain: float) -> smartshoe.Recording:
    time_s = np.arange(0.0, 30.0, 0.01)
    load = np.interp(time_s, [2.0, 10.0, 18.0, 20.0, 21.0, 22.0], [0.0, 800.0, 0.0, 0.0, 800.0, 0.0])
    return smartshoe.Recording.from_arrays(
        time_s=time_s, force_n=load, pressure_mbar=load * gain, unit="left_toe"
    )


def test_a_pure_gain_error_is_all_of_p_and_nothing_over_static():
    calibration = Calibration(a1=1.0, b0=4.0, b1=4.0, reading_unit=MILLIBAR)
    result = validate(_recording(0.25), calibration, scale=2.0).to_dict()
    assert result["overall"]["improvement_percent"] == pytest.approx(100.0)
    assert result["overall"]["rmse_static_n"] == pytest.approx(0.0, abs=1e-9)
    assert [rate["rate_n_per_s"] for rate in result["rates"]] == [100.0, 800.0]
    assert result["static_fit"]["gain"] == pytest.approx(2.0)
    json.dumps(result, allow_nan=False)


def test_figures_without_a_value_are_null():
    time_s = np.arange(100) * 0.01
    flat = smartshoe.Recording.from_arrays(
        time_s=time_s, force_n=np.full(100, 5.0), pressure_mbar=np.ones(100)
    )
    result = validate(flat, Calibration(a1=1.0, b0=4.0, b1=4.0, reading_unit=MILLIBAR)).to_dict()
    assert result["rates"] == []
    assert result["overall"]["delay_s"] is None
    json.dumps(result, allow_nan=False)


def test_improvement_is_the_papers_and_the_line_is_least_squares():
    assert improvement_percent(50.0, 10.0) == pytest.approx(80.0)
    assert static_fit([1.0, 3.0, 5.0], [0.0, 1.0, 2.0]) == pytest.approx((2.0, 1.0))
