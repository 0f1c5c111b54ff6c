"""A lag of two poles, real or a pair, against the same differential equation solved by scipy, and undone."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.signal import StateSpace, cont2discrete, lfilter, ss2tf

from smartshoe.arrays import Array
from smartshoe.calibration import ExtendedCompensator
from smartshoe.models.effects import Conditions, effect
from smartshoe.models.extended import ExtendedModel

LAG = effect("sensor_lag")
STEP_S = 0.01
FINE = 200
SECOND_POLES = (0.05, 0.3, 0.45, 0.49, 0.5, 0.51, 0.7, 1.0, 1.5, 2.0)
TRIANGLES = np.interp(np.arange(300.0), [0, 20, 70, 130, 150, 220, 299], [0.0, 0.0, 1.0, 0.2, 0.2, 0.9, 0.1])


def _at(load: Array, step_s: float = STEP_S) -> Conditions:
    return Conditions(step_s * np.arange(load.size), load, step_s)


def _late(load: Array, tau_s: float, r: float, step_s: float = STEP_S) -> Array:
    return LAG.apply(load, _at(load, step_s), np.array([tau_s, r]))


def _filter(tau_s: float, r: float) -> StateSpace:
    """The equation in another form: two leaky integrators in a row, or a mass on a spring and a damper."""
    if r <= 0.5:
        one, two = 1.0 / ((1.0 - r) * tau_s), 1.0 / (r * tau_s)
        return StateSpace([[-one, 0.0], [two, -two]], [[one], [0.0]], [[0.0, 1.0]], [[0.0]])
    damping = 0.5 / np.sqrt(0.25 + (r - 0.5) ** 2)
    turn = 2.0 * damping / tau_s
    return StateSpace([[0.0, turn], [-turn, -2.0 * damping * turn]], [[0.0], [turn]], [[1.0, 0.0]], [[0.0]])


def _cubic(load: Array) -> Array:
    """The cubics through the four samples around each step, at ``FINE`` points a step; straight on beyond the ends."""
    padded = np.concatenate([[load[0]], load, [2.0 * load[-1] - load[-2]]])
    padded = np.concatenate([[load[0]], padded])
    s = np.arange(FINE) / FINE - 1.0
    nodes = np.array([-2.0, -1.0, 0.0, 1.0])
    others = [np.delete(nodes, k) for k in range(4)]
    shares = [np.prod([(s - o) / (nodes[k] - o) for o in others[k]], axis=0) for k in range(4)]
    steps = [sum(padded[k + j] * shares[j] for j in range(4)) for k in range(1, load.size)]
    return np.append(np.concatenate(steps), load[-1])


FINE_TRIANGLES = _cubic(TRIANGLES)


@pytest.mark.parametrize("steps", [0.01, 0.3, 3.0, 100.0])
@pytest.mark.parametrize("r", SECOND_POLES)
def test_it_solves_its_equation_for_steps_far_longer_and_far_shorter_than_the_lag(steps: float, r: float) -> None:
    tau_s = steps * STEP_S
    filter_ = _filter(tau_s, r)
    *matrices, _ = cont2discrete((filter_.A, filter_.B, filter_.C, filter_.D), STEP_S / FINE, method="foh")
    (above,), below = ss2tf(*matrices)
    exact = lfilter(above, below, FINE_TRIANGLES)[::FINE]  # from rest, as the load begins with it
    assert np.max(np.abs(_late(TRIANGLES, tau_s, r) - exact)) < 2e-7  # the fine grid's lines are no cubics


@given(distance=st.floats(0.0, 0.02), tau_s=st.floats(1e-4, 1.0))
def test_real_poles_go_over_into_a_pair(distance: float, tau_s: float) -> None:
    """On either side of equal poles q departs by the square of the distance, and no digits are lost."""
    wave = 0.5 - 0.5 * np.cos(2.0 * np.pi * 0.8 * STEP_S * np.arange(500))
    equal, real, pair = (_late(wave, tau_s, 0.5 + way * distance) for way in (0, -1, 1))
    near = 2.0 * (distance * tau_s * 2.0 * np.pi * 0.8) ** 2 + 1e-8
    assert np.max(np.abs(pair - equal)) < near
    assert np.max(np.abs(real - equal)) < near
    assert np.max(np.abs(0.5 * (real + pair) - equal)) < 0.1 * near + 1e-8


def test_at_one_it_is_a_butterworth_filter_and_at_the_bound_a_step_is_overshot_by_a_third() -> None:
    cutoff_hz, time_s = 2.0, 0.002 * np.arange(4000)
    wave = np.sin(2.0 * np.pi * cutoff_hz * time_s)
    passed = _late(wave, np.sqrt(2.0) / (2.0 * np.pi * cutoff_hz), 1.0, 0.002)[2000:-2]
    assert np.sqrt(2.0 * np.mean(passed**2)) == pytest.approx(np.sqrt(0.5), rel=1e-3)
    step = np.where(np.arange(3000) < 10, 0.0, 1.0)
    assert np.max(_late(step, 0.5, 1.0)) == pytest.approx(1.0432, abs=1e-3)
    assert np.max(_late(step, 0.5, LAG.parameters[1].upper)) == pytest.approx(1.35, abs=0.01)


@given(r=st.floats(0.0, 2.0), tau_s=st.floats(0.0, 3.0), step_s=st.floats(1e-4, 1.0))
def test_a_hold_stays_as_it_is_and_a_ramp_is_late_by_the_lag(r: float, tau_s: float, step_s: float) -> None:
    assert np.max(np.abs(_late(np.full(50, 0.7), tau_s, r, step_s) - 0.7)) < 1e-9
    step_s = max(step_s, tau_s / 20.0)
    ramp = np.arange(0.0, 120.0 * tau_s + 10.0 * step_s, step_s)
    late = _late(ramp, tau_s, r, step_s)
    assert ramp[-1] - late[-1] == pytest.approx(tau_s, rel=1e-6, abs=1e-8 * ramp[-1])


@pytest.mark.parametrize("r", [0.1, 0.45])
def test_real_poles_are_undone_by_a_lead_for_each(r: float) -> None:
    inverse = LAG.inverse(np.array([0.05, r]), STEP_S)
    assert inverse is not None
    reading = np.random.default_rng(1).uniform(-0.2, 1.2, 300)
    led = reading
    for tau_s in ((1.0 - r) * 0.05, r * 0.05):
        led = led + tau_s / STEP_S * np.diff(led, prepend=led[0])
    np.testing.assert_allclose(inverse.push(reading, STEP_S * np.arange(300)), led, rtol=0, atol=1e-12)


@pytest.mark.parametrize("r", [0.7, 1.0, 2.0])
def test_of_a_pair_all_but_the_swing_is_undone(r: float) -> None:
    """To first order of the step: what is left is (q - 1/4) tau^2 times the second slope."""
    values, errors = np.array([0.1, r]), []
    for step_s in (0.01, 0.005, 0.0025):
        time_s = np.arange(0.0, 20.0, step_s)
        load = 0.5 - 0.5 * np.cos(2.0 * np.pi * 0.3 * time_s)
        late = _late(load, *values, step_s)
        inverse = LAG.inverse(values, step_s)
        assert inverse is not None
        back = inverse.push(late, time_s)
        swing = (r - 0.5) ** 2 * 0.1**2 * np.gradient(np.gradient(late, step_s), step_s)
        errors.append(float(np.max(np.abs(back + swing - load)[:-3])))
    assert errors[0] < 0.01
    assert errors[1] == pytest.approx(errors[0] / 2, rel=0.1)
    assert errors[2] == pytest.approx(errors[1] / 2, rel=0.1)


@pytest.mark.parametrize(("tau_s", "r"), [(0.036, 1.64), (0.074, 1.0), (0.028, 1.0), (0.1, 2.0)])
def test_the_force_behind_a_pair_is_better_undone_than_left(tau_s: float, r: float) -> None:
    part = ExtendedModel(1.0, 0.0, 1.0, 800.0, 140.0, "mbar").with_part(LAG, np.array([tau_s, r]))
    load = np.interp(0.01 * np.arange(4000), [0, 2, 6, 10, 14, 15, 16, 40], [0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0])
    readings = part.reading(_at(load)) + 0.05 * np.random.default_rng(1).standard_normal(load.size)
    filter_ = ExtendedCompensator(part, 1.0 / STEP_S)
    off, left = filter_.apply(readings) / 800.0 - load, readings / filter_.reading_per_share - load
    assert np.sqrt(np.mean(off**2)) < 0.8 * np.sqrt(np.mean(left**2))


def test_a_file_from_before_there_were_pairs_says_the_same() -> None:
    stored = ExtendedModel(1.0, 0.1, 0.5, 800.0, 140.0, "mbar").with_part(LAG, np.array([0.05, 0.45])).to_dict()
    assert stored["effects"]["sensor_lag"] == {"time_constant": 0.05, "second_pole": 0.45}
    read = ExtendedModel.from_dict(stored).part("sensor_lag")
    assert read.values.tolist() == [0.05, 0.45]
    one, two = _late(TRIANGLES, 0.55 * 0.05, 0.0), _late(TRIANGLES, 0.45 * 0.05, 0.0)
    in_fractions = (0.55 * one - 0.45 * two) / 0.1
    np.testing.assert_allclose(_late(TRIANGLES, 0.05, 0.45), in_fractions, rtol=0, atol=1e-12)
