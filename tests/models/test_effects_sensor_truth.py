"""Blocks against truths of another form: how much of what the refitted baseline leaves a block removes."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np
import pytest
from scipy.optimize import least_squares
from scipy.signal import StateSpace, lsim

from simulators.effects.sensing import Curve, Limit, OutputDrift
from simulators.plant.bladder import SimulatedBladder
from simulators.plant.bladder_parameters import BladderParameters
from smartshoe.models.effects import Conditions, Effect, effect
from smartshoe.models.first_order import lag

FINE_S, EVERY = 0.001, 25
FULL_N = 800.0
SPAN = 0.8  # of the sensor's range, at full-scale load


@cache
def _unit() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Time, load (shares of full scale) and pressure (shares of the sensor's range) at 1 kHz."""
    parts = [np.zeros(3000)]
    for rate in (50, 100, 200, 400, 800):
        samples = round(FULL_N / rate / FINE_S)
        up = np.arange(1, samples + 1) / samples
        parts += [up, 1.0 - up, np.zeros(2000)] * 2
    ramp = np.arange(1, 4001) / 4000 * 0.9
    parts += [ramp, np.full(12000, 0.9), ramp[::-1], np.zeros(6000)]
    load = np.concatenate(parts)
    unit = SimulatedBladder(BladderParameters(k1=1.341, k2=0.515))
    pressure = unit.press(FULL_N * load, 1.0 / FINE_S) / unit.parameters.nominal_pressure_pa(FULL_N)
    return FINE_S * np.arange(load.size), load, SPAN * pressure


def _fit(reading: np.ndarray, conditions: Conditions, added: Effect | None, shape: dict[str, float]) -> float:
    """Sum of squares after the baseline, and the block where there is one, are fitted together."""
    parameters = added.parameters if added else ()
    begin = added.start(shape) if added else np.zeros(0)
    size = np.array([p.size for p in parameters])

    def error(theta: np.ndarray) -> np.ndarray:
        slow = lag(conditions.load, np.exp(theta[0]), conditions.step_s)
        pressure = slow + theta[1] * (conditions.load - slow)
        if added is not None:
            pressure = added.apply(pressure, conditions, size * theta[3:])
        return theta[2] * pressure - reading

    low = np.array([p.lower for p in parameters]) / size
    high = np.array([p.upper for p in parameters]) / size
    first = begin / size + np.array([0.0 if p.null is None else 0.05 for p in parameters])
    start = np.concatenate([[np.log(0.4), 0.9, SPAN], np.clip(first, low, high)])
    bounds = np.concatenate([[-9.0, 0.0, 0.0], low]), np.concatenate([[9.0, 3.0, 3.0], high])
    return 2.0 * float(least_squares(error, start, bounds=bounds, max_nfev=60).cost)


def _late(delay_s: float, skew: float) -> np.ndarray:
    time_s, _, share = _unit()
    return np.interp(time_s * (1.0 - skew) - delay_s, time_s, share)


def _filtered(t: np.ndarray, p: np.ndarray, hz: float, damping: float) -> np.ndarray:
    """Behind a mass on a spring and a damper, as a state space of scipy."""
    turn = 2.0 * np.pi * hz
    mass = StateSpace([[0.0, turn], [-turn, -2.0 * damping * turn]], [[0.0], [turn]], [[1.0, 0.0]], [[0.0]])
    return np.asarray(lsim(mass, p, t)[1])


CASES: dict[str, tuple[str, Callable[[np.ndarray, np.ndarray], np.ndarray], dict[str, float]]] = {
    "a bridge": ("sensor_nonlinearity", lambda t, p: Curve(bridge=0.2)(p), {}),
    "a compressing amplifier": ("sensor_nonlinearity", lambda t, p: Curve(compression=1.5)(p), {}),
    "a gain that compounds": ("gain_drift", lambda t, p: p * np.exp(4e-4 * t), {}),
    "die and package": (
        "warm_up",
        lambda t, p: p + OutputDrift(warm_up_percent=1.5, warm_up_time_constant_s=40.0).zero(t, 0.0),
        {"time_constant": 30.0, "stretch": 1.0},
    ),
    "a hard stop": ("saturation", lambda t, p: Limit(70.0)(p), {"level": 0.85, "knee": 0.01}),
    "a soft stop": ("saturation", lambda t, p: Limit(90.0, softness=0.1)(p), {"level": 0.85, "knee": 0.03}),
    "a port": ("sensor_lag", lambda t, p: lag(p, 1.0 / 0.06, FINE_S), {"second_pole": 0.1}),
    "a port and a filter": (
        "sensor_lag",
        lambda t, p: lag(lag(p, 1.0 / 0.1, FINE_S), 4.0 / 0.1, FINE_S),
        {"second_pole": 0.1},
    ),
    "a Butterworth filter": ("sensor_lag", lambda t, p: _filtered(t, p, 3.0, np.sqrt(0.5)), {"second_pole": 0.4}),
    "a tube with its cavity": ("sensor_lag", lambda t, p: _filtered(t, p, 5.0, 0.4), {"second_pole": 0.4}),
    "a transport delay": ("delay", lambda t, p: _late(0.033, 0.0), {}),
    "a slow clock": ("clock_drift", lambda t, p: _late(0.0, 4e-4), {}),
}  # fmt: skip


@pytest.mark.parametrize("case", CASES)
def test_a_block_removes_what_a_truth_of_another_form_leaves(case: str) -> None:
    name, truth, shape = CASES[case]
    time_s, load, share = _unit()
    reading = truth(time_s, share)[::EVERY]
    conditions = Conditions(time_s[::EVERY], load[::EVERY], FINE_S * EVERY)
    before = _fit(reading, conditions, None, {})
    assert 0.002 * SPAN < np.sqrt(before / reading.size) < 0.05 * SPAN  # 0.2 to 5 % of full scale
    assert _fit(reading, conditions, effect(name), shape) < 0.01 * before
