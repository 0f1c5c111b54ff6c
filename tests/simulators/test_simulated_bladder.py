"""The bladder's physics against plain, slow twins and against laws."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import signal
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from simulators.plant.bladder import SimulatedBladder
from simulators.plant.bladder_parameters import (
    AMBIENT_PA,
    BladderParameters,
    ConditioningParameters,
    GasHeatParameters,
    HysteresisParameters,
    LeakParameters,
    SofteningParameters,
    TemperatureParameters,
)
from smartshoe.errors import UsageError

LEFT_TOE = BladderParameters(1.341, 0.215, effective_area_m2=0.0623)
EVERYTHING = replace(
    LEFT_TOE,
    gas="boyle",
    static_exponent=0.9,
    wall_hardening=0.2,
    hysteresis=HysteresisParameters(strength=0.02),
    leak=LeakParameters(0.01, 0.002),
    gas_heat=GasHeatParameters(0.5, 0.8),
    temperature=TemperatureParameters(0.01, 2.0, 60.0),
    softening=SofteningParameters(0.1),
    conditioning=ConditioningParameters(0.02),
)

knots = st.lists(st.floats(0, 800), min_size=2, max_size=8)
passive = st.builds(
    BladderParameters,
    k1=st.floats(0.01, 5),
    k2=st.floats(0.01, 5),
    c=st.floats(0.05, 20),
    effective_area_m2=st.floats(0.02, 0.1),
    wall_hardening=st.floats(0, 2),
    gas=st.sampled_from(["linear", "boyle"]),
)


def through(corners_n: list[float], seconds: float = 2.0, rate_hz: float = 1000.0) -> np.ndarray:
    """A load that goes in straight lines from zero through the corners and back to zero."""
    corners = [0.0, *corners_n, 0.0]
    at_s = np.arange(int(seconds * rate_hz) + 1) / rate_hz
    return np.interp(at_s, np.linspace(0, seconds, len(corners)), corners)


def pressed(parameters: BladderParameters, load_n: np.ndarray, rate_hz: float = 1000.0) -> np.ndarray:
    return SimulatedBladder(parameters).press(load_n, rate_hz)


@settings(max_examples=25, deadline=None)
@given(
    k1=st.floats(0.01, 5),
    k2=st.floats(0.01, 5),
    c=st.floats(0.05, 20),
    heat=st.floats(0, 1),
    tau=st.floats(0.1, 5),
    corners=knots,
)
def test_linear_bladder_is_the_papers_transfer_function_with_heat_as_a_lead(k1, k2, c, heat, tau, corners):
    """P/f = H/(H + K1 + K2 s/(s + k2/c)), H = 1 + 0.4 heat s/(s + 1/tau); without heat eq. (2)-(4)."""
    parameters = BladderParameters(k1, k2, c, gas_heat=GasHeatParameters(heat, tau))
    K1, K2, r, g = k1 * 0.38113, k2 * 0.38113, k2 / c, 0.4 * heat
    gas = np.array([1 + g, 1 / tau])
    wall = np.array([K1 + K2, K1 * r])
    arm, air = np.array([1, r]), np.array([1, 1 / tau])
    system = (np.polymul(gas, arm), np.polyadd(np.polymul(gas, arm), np.polymul(wall, air)))
    load_n = through(corners)
    time_s = np.arange(load_n.size) / 1000
    expected = signal.lsim(system, load_n / parameters.effective_area_m2, time_s)[1]
    # Exact for piecewise linear deformation, which a piecewise linear load gives up to (rate x step)^2.
    bound = 1e-6 * (1 + r**2 + 1 / tau**2) * (np.abs(expected).max() + 1e-9)
    assert np.abs(pressed(parameters, load_n) - expected).max() <= bound + 1e-9


def test_boyle_hardening_and_leak_follow_the_differential_equation():
    parameters = replace(LEFT_TOE, gas="boyle", wall_hardening=0.5, leak=LeakParameters(0.05, 0.01))
    load_n = through([800, 500, 500, 700], seconds=8.0)
    time_s = np.arange(load_n.size) / 1000
    K1, K2, rate = 1.341 * 0.38113, 0.215 * 0.38113, 0.215

    def solved(t: float, q: float, w: float) -> tuple[float, float]:
        stress = np.interp(t, time_s, load_n) / parameters.effective_area_m2 / AMBIENT_PA

        def off(e: float) -> float:
            bent = 1 + 0.5 * (e / parameters.full_scale_deformation) ** 2
            return (1 - w) / (1 - e) - 1 + K1 * e * bent + K2 * (e - q) - stress

        e = brentq(off, -0.5, 0.9, xtol=1e-14)
        return e, (1 - w) / (1 - e) - 1

    def slope(t: float, y: np.ndarray) -> list[float]:
        e, p = solved(t, y[0], y[1])
        return [(e - y[0]) * rate, 0.05 * p + 0.01 * p / np.sqrt(abs(p) + 1e-4)]

    found = solve_ivp(slope, (0, 8), [0, 0], t_eval=time_s[::100], rtol=1e-8, atol=1e-11, max_step=0.05)
    twin_pa = [AMBIENT_PA * solved(t, *y)[1] for t, y in zip(found.t, found.y.T, strict=True)]
    np.testing.assert_allclose(pressed(parameters, load_n)[::100], np.array(twin_pa), rtol=0, atol=0.02)  # of 10,000 Pa


@pytest.mark.parametrize(
    "effects",
    [
        {"c": 0.01},
        {"leak": LeakParameters(0.5)},
        {"gas_heat": GasHeatParameters(0.8, 0.2)},
        {"gas": "boyle", "wall_hardening": 0.5, "leak": LeakParameters(0.3), "gas_heat": GasHeatParameters(0.5, 0.5)},
    ],
)
def test_halving_the_step_converges_at_second_order(effects):
    parameters = replace(LEFT_TOE, **effects)
    finest, errors = 16000.0, []

    def load(rate_hz: float) -> np.ndarray:
        return 400 * (1 - np.cos(3 * np.arange(int(2 * rate_hz) + 1) / rate_hz))

    reference = pressed(parameters, load(finest), finest)[:: int(finest / 1000)]
    for rate_hz in (1000.0, 2000.0):
        errors.append(np.abs(pressed(parameters, load(rate_hz), rate_hz)[:: int(rate_hz / 1000)] - reference).max())
    assert 3.5 < errors[0] / errors[1] < 4.6


@settings(max_examples=40, deadline=None)
@given(parameters=passive, corners=knots, seconds=st.floats(0.5, 20))
def test_work_done_on_a_bladder_from_rest_is_never_negative(parameters, corners, seconds):
    """From rest the stored energy is zero: the work on it covers what is stored and what is dissipated."""
    bladder = SimulatedBladder(parameters)
    load_n = through(corners, seconds)
    bladder.press(load_n, 1000.0)
    e = bladder.deformation
    work = np.cumsum(0.5 * (load_n[1:] + load_n[:-1]) * np.diff(e))
    # The trapezoidal rule's error, and rounding.
    assert work.min() >= -1e-6 * (load_n.max() * np.abs(e).max() + 1e-9)


@settings(max_examples=25, deadline=None)
@given(strength=st.floats(0.001, 0.05), half_width_n=st.floats(5, 80), peak=st.floats(200, 800), low=st.floats(0, 150))
def test_hysteresis_dissipates_over_a_closed_cycle_the_same_at_any_rate(strength, half_width_n, peak, low):
    # A wall without an arm to speak of, so that only the rate-independent loop is left.
    parameters = BladderParameters(
        1.3, 1e-9, hysteresis=HysteresisParameters(strength=strength, half_width_n=half_width_n)
    )
    areas = []
    for seconds in (2.0, 8.0):
        bladder = SimulatedBladder(parameters)
        cycle = through([peak, low, peak, low], seconds)
        pressure_pa = bladder.press(cycle, 1000.0)
        peaks = np.linspace(0, cycle.size - 1, 6).astype(int)
        loop = slice(peaks[1], peaks[3] + 1)
        areas.append(np.trapezoid(cycle[loop], pressure_pa[loop]))
        rising, falling = slice(peaks[2], peaks[3]), slice(peaks[1], peaks[2])
        same_load = np.interp(0.5 * (peak + low), cycle[rising], pressure_pa[rising])
        on_the_way_down = np.interp(0.5 * (peak + low), cycle[falling][::-1], pressure_pa[falling][::-1])
        assert on_the_way_down >= same_load - 1e-6  # friction holds the wall back: less pressure while loading
    assert areas[0] >= -1e-6 * peak
    assert areas[1] == pytest.approx(areas[0], rel=0.01, abs=1e-4 * peak * np.ptp(pressure_pa))


@pytest.mark.parametrize("parameters", [LEFT_TOE, EVERYTHING])
def test_memory_carries_over_from_call_to_call(parameters):
    load_n = through([800, 100, 600, 0, 400, 50], seconds=6.0, rate_hz=250.0)
    whole = pressed(parameters, load_n, 250.0)
    bladder = SimulatedBladder(parameters)
    parts = [bladder.press(part, 250.0) for part in np.split(load_n, [1, 2, 300, 301, 900])]
    assert np.array_equal(np.concatenate(parts), whole)
    bladder.reset()
    assert np.array_equal(bladder.press(load_n, 250.0), whole)


def test_sealed_air_warmed_by_8_kelvin_rises_by_27_millibar():
    held = replace(
        LEFT_TOE, k1=1e6, temperature=TemperatureParameters(drift_k_per_s=0.08)
    )  # a rigid wall keeps the volume
    assert pressed(held, np.zeros(100_001))[-1] == pytest.approx(2700, rel=0.01)


def test_warming_settles_with_its_time_constant():
    held = replace(LEFT_TOE, k1=1e6, temperature=TemperatureParameters(warming_k=3.0, warming_time_constant_s=20.0))
    pressure_pa = pressed(held, np.zeros(200_000))
    assert pressure_pa[19_999] == pytest.approx(AMBIENT_PA * 3 / 300 * (1 - np.exp(-1)), rel=1e-3)
    assert pressure_pa[-1] == pytest.approx(AMBIENT_PA * 3 / 300, rel=1e-3)


def test_a_load_that_is_not_finite_is_refused_by_its_place():
    with pytest.raises(UsageError, match="load sample 2 of 3"):
        pressed(LEFT_TOE, np.array([0.0, np.nan, 1.0]))


def test_boyles_law_adds_the_linearisation_error_of_the_audit():
    soft = BladderParameters(1e-9, 1e-9, effective_area_m2=0.04, gas="boyle")
    bladder = SimulatedBladder(soft)
    pressure_pa = bladder.press(through([800], seconds=20.0), 1000.0)
    assert pressure_pa.max() == pytest.approx(20_000, rel=1e-6)  # no wall: the gas bears all of the stress
    np.testing.assert_allclose(
        (1 + pressure_pa / AMBIENT_PA) * (1 - bladder.deformation), np.ones(pressure_pa.size), rtol=1e-6
    )


def test_a_leak_loses_pressure_in_a_hold_and_ends_below_zero():
    load_n = np.concatenate([np.full(20_000, 600.0), np.zeros(2_000)])
    sealed, leaking = pressed(LEFT_TOE, load_n), pressed(replace(LEFT_TOE, leak=LeakParameters(0.02)), load_n)
    assert leaking[19_999] < 0.9 * sealed[19_999]
    assert leaking[-1] < -100
    # The arm relaxes onto the gas: sealed, the pressure creeps up in a hold.
    assert sealed[19_999] > sealed[1_000]


def test_heat_of_compression_falls_within_seconds_of_a_ramp():
    load_n = np.interp(np.arange(10_000) / 1000, [0, 1], [0, 800])
    extra = pressed(replace(LEFT_TOE, k2=1e-9, gas_heat=GasHeatParameters(1.0, 1.0)), load_n)
    assert extra[1_000] > extra[3_000] > extra[9_999]


def test_softening_changes_only_the_reloading_below_the_largest_load():
    soft = replace(LEFT_TOE, k2=1e-9, softening=SofteningParameters(0.2))
    load_n = through([400, 0, 400, 0, 800], seconds=12.0)
    virgin, found = pressed(replace(soft, softening=SofteningParameters()), load_n), pressed(soft, load_n)
    first, second = slice(0, 2_000), slice(4_001, 5_500)
    assert np.abs(found - virgin)[first].max() < 1e-6
    assert (found - virgin)[second][100:-100].min() > 1
    beyond = (load_n > 402) & (np.arange(load_n.size) > 8_000) & (np.gradient(load_n) > 0)
    assert np.abs(found - virgin)[beyond].max() < 1e-6


def test_conditioning_counts_cycles_not_seconds():
    settled = replace(LEFT_TOE, k2=1e-9, conditioning=ConditioningParameters(0.03, 2.0))
    for seconds in (10.0, 40.0):
        load_n = through([800, 0] * 4 + [800], seconds)
        peaks = pressed(settled, load_n)[np.linspace(0, load_n.size - 1, 11).astype(int)[1::2]]
        assert peaks / peaks[0] == pytest.approx(1 + 0.03 * (1 - np.exp(-np.arange(5) / 2)), rel=1e-9)


def test_power_law_scales_the_load_about_full_scale():
    bent = pressed(replace(LEFT_TOE, k2=1e-9, static_exponent=0.65), np.array([0.0, 200.0, 800.0]), 1.0)
    assert bent[1] / bent[2] == pytest.approx(0.25**0.65)
