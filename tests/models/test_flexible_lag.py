"""A lag that depends on the direction, against the equation solved by another method, and undone."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from smartshoe.arrays import Array
from smartshoe.models.effects import Conditions, effect

LAG = effect("flexible_lag")


def _at(load: Array, step_s: float) -> Conditions:
    return Conditions(step_s * np.arange(load.size), load, step_s)


@given(tau_s=st.floats(0.02, 0.5), direction=st.floats(-0.9, 0.9))
def test_a_rise_is_late_by_one_time_and_a_fall_by_another(tau_s: float, direction: float) -> None:
    load = np.interp(np.arange(4000), [0, 2000, 3999], [0.0, 1.0, 0.0005])
    late = LAG.apply(load, _at(load, 0.01), np.array([tau_s, direction]))
    assert load[1990] - late[1990] == pytest.approx(0.05 * tau_s * (1.0 + direction), rel=1e-3)
    assert late[-9] - load[-9] == pytest.approx(0.05 * tau_s * (1.0 - direction), rel=1e-3)


@given(tau_s=st.floats(0.005, 0.5))
def test_without_a_direction_it_is_the_lag_of_one_pole(tau_s: float) -> None:
    load = np.interp(np.arange(600), [0, 100, 250, 400, 599], [0.0, 0.9, 0.3, 0.8, 0.0])
    at = _at(load, 0.02)
    alike = LAG.apply(load, at, np.array([tau_s, 0.0])), effect("sensor_lag").apply(load, at, np.array([tau_s, 0.0]))
    np.testing.assert_allclose(*alike, rtol=0, atol=1e-12)
    # However little of a direction there is, it is that of another recursion.
    np.testing.assert_allclose(LAG.apply(load, at, np.array([tau_s, 1e-9])), alike[1], rtol=0, atol=1e-8)


@pytest.mark.parametrize("direction", [-0.9, -0.3, 0.6])
def test_it_solves_its_equation(direction: float) -> None:
    """By Runge and Kutta's method, with a sine, of which the cubic between samples is nearly exact."""
    tau_s, step_s = 0.1, 0.01

    def load(t: Array | float) -> Array:
        return np.asarray(0.5 - 0.5 * np.cos(2.0 * np.pi * 0.4 * np.asarray(t)))

    def slope(t: float, y: Array) -> Array:
        left = load(t) - y
        return np.asarray(left / (tau_s * (1.0 + np.sign(left) * direction)))

    time_s = step_s * np.arange(1000)
    exact = solve_ivp(slope, (0.0, time_s[-1]), [0.0], t_eval=time_s, max_step=0.05, rtol=1e-7, atol=1e-9).y[0]
    late = LAG.apply(load(time_s), _at(load(time_s), step_s), np.array([tau_s, direction]))
    moved = float(np.max(np.abs(load(time_s) - exact)))
    assert np.max(np.abs(late - exact)[:-2]) < 2e-3 * moved  # the step in which the sign changes takes one of the two


@pytest.mark.parametrize("direction", [-0.9, 0.5])
def test_its_inverse_is_right_to_first_order_of_the_step(direction: float) -> None:
    values, errors = np.array([0.2, direction]), []
    for step_s in (0.02, 0.01, 0.005):
        load = np.interp(np.arange(0.0, 24.0, step_s), np.arange(13) * 2.0, np.tile([0.0, 1.0], 7)[:13])
        inverse = LAG.inverse(values, step_s)
        assert inverse is not None
        back = inverse.push(LAG.apply(load, _at(load, step_s), values), step_s * np.arange(load.size))
        errors.append(float(np.sqrt(np.mean((back - load) ** 2))))
    assert errors[0] < 0.02 * 0.5  # the rise within a step
    assert errors[1] == pytest.approx(errors[0] / 2, rel=0.25)
    assert errors[2] == pytest.approx(errors[1] / 2, rel=0.25)


def test_it_is_looked_for_where_cycles_repeat_and_has_no_name() -> None:
    assert LAG.needs_cycles
    assert LAG.why_unnamed
    assert not effect("flexible_gain_drift").why_unnamed
