"""The kernel with every effect of wall and air: against the plain one, against analysis, and against finer steps."""

from __future__ import annotations

from dataclasses import replace
from math import gamma

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from simulators.effects.contact import ContactParameters
from simulators.effects.damage import PermanentSetParameters
from simulators.effects.friction import BoucWenParameters, StickSlipParameters
from simulators.effects.outside import Odd
from simulators.effects.relaxation import PowerLawCreepParameters, SecondRelaxationParameters
from simulators.plant._steppers import PlainStepper, WallStepper
from simulators.plant._wall_stepping import nozzle_flow
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

PLAIN = BladderParameters(1.341, 0.215, effective_area_m2=0.0623)
K1 = 1.341 * 0.38113
FIRST_EFFECTS = replace(
    PLAIN,
    static_exponent=0.9,
    wall_hardening=0.2,
    hysteresis=HysteresisParameters(strength=0.02),
    leak=LeakParameters(0.01, 0.002),
    gas_heat=GasHeatParameters(0.5, 0.8),
    temperature=TemperatureParameters(0.01, 2.0, 60.0),
    softening=SofteningParameters(0.1),
    conditioning=ConditioningParameters(0.02),
)
EFFECTS = {
    "wall_stiffening": replace(PLAIN, wall_stiffening=1.0),
    "second_relaxation": replace(PLAIN, second_relaxation=SecondRelaxationParameters(0.5, 1.0)),
    "power_law_creep": replace(PLAIN, power_law_creep=PowerLawCreepParameters(0.5, 0.3)),
    "stick_slip": replace(PLAIN, stick_slip=StickSlipParameters(0.03)),
    "bouc_wen": replace(PLAIN, bouc_wen=BoucWenParameters(0.03)),
    "permanent_set": replace(PLAIN, permanent_set=PermanentSetParameters(0.01)),
    "capillary": replace(PLAIN, leak=LeakParameters(capillary_per_s=0.02)),
    "nozzle": replace(PLAIN, leak=LeakParameters(nozzle_per_s=0.005)),
    "heat_modes": replace(PLAIN, gas_heat=GasHeatParameters(0.5, 1.0, 4)),
    "contact_area": replace(PLAIN, contact=ContactParameters(saturation=0.3)),
    "gap": replace(PLAIN, contact=ContactParameters(gap_n=40.0)),
    "direction": replace(PLAIN, contact=ContactParameters(direction_gain=0.03)),
    "rate": replace(PLAIN, contact=ContactParameters(rate_gain=0.1)),
    "resonance": replace(PLAIN, odd=Odd(resonance=0.3)),
    "pinch": replace(PLAIN, odd=Odd(pinch=0.3, pinch_share=0.9, seed=2)),
    "seating": replace(PLAIN, odd=Odd(seating=0.05)),
    "snap": replace(PLAIN, odd=Odd(snap=0.05)),
}


def through(corners_n: list[float], seconds: float, rate_hz: float = 1000.0) -> np.ndarray:
    """A load in straight lines from zero through the corners and back, its corners rounded over 40 ms."""
    corners = [0.0, *corners_n, 0.0]
    at_s = np.arange(round(seconds * rate_hz) + 1) / rate_hz
    sharp = np.interp(at_s, np.linspace(0.1, seconds - 0.1, len(corners)), corners)
    width = round(0.04 * rate_hz) | 1
    return np.convolve(np.pad(sharp, width // 2, mode="edge"), np.full(width, 1 / width), mode="valid")


def pressed(parameters: BladderParameters, load_n: np.ndarray, rate_hz: float = 1000.0) -> np.ndarray:
    return SimulatedBladder(parameters).press(load_n, rate_hz)


@pytest.mark.parametrize("gas", ["linear", "boyle"])
@pytest.mark.parametrize("parameters", [PLAIN, FIRST_EFFECTS])
def test_both_kernels_agree_to_rounding_where_both_know_the_effects(parameters, gas):
    parameters = replace(parameters, gas=gas)
    load_n = through([800, 100, 600, 0, 400, 50], 6.0)
    found = []
    for kind in (PlainStepper, WallStepper):
        stepper = kind(parameters)
        stepper.reset(0)
        found.append(stepper.advance(load_n, 1, 1e-3)[0])
    assert np.abs(found[0] - found[1]).max() < 1e-12


@pytest.mark.parametrize("name", EFFECTS)
def test_memory_carries_over_and_a_reset_forgets_it(name):
    load_n = through([800, 100, 600, 0, 400, 50], 6.0, 250.0)
    bladder = SimulatedBladder(EFFECTS[name])
    whole = bladder.press(load_n, 250.0)
    again = SimulatedBladder(EFFECTS[name])
    parts = np.concatenate([again.press(part, 250.0) for part in np.split(load_n, [1, 2, 300, 301, 900])])
    # A filter started anew from its state rounds otherwise than one that runs through.
    np.testing.assert_allclose(parts, whole, rtol=0, atol=1e-6)
    bladder.reset()
    if name not in ("pinch", "seating"):  # which cycles these strike is drawn for each session
        assert np.array_equal(bladder.press(load_n, 250.0), whole)


@pytest.mark.parametrize("name", EFFECTS)
def test_each_effect_converges_with_the_step(name):
    corners = [800, 100, 600, 0, 400]
    plain, coarse, fine, finest = (
        pressed(EFFECTS[name] if k else PLAIN, through(corners, 6.0, rate), rate)[:: round(rate / 100)]
        for k, rate in enumerate((1000.0, 1000.0, 4000.0, 16000.0))
    )
    size = np.abs(finest - plain).max()
    assert size > 5.0
    # The rounded corners of the loads themselves differ by a thousandth of their 40 ms; the relay of `snap` switches
    # a step earlier or later, which one sample may see.
    allowed = 0.3 if name == "snap" else 0.03
    assert np.quantile(np.abs(coarse - finest), 0.99) < allowed * size
    assert np.sqrt(np.mean((fine - finest) ** 2)) < 0.5 * np.sqrt(np.mean((coarse - finest) ** 2)) + 1e-3


@settings(max_examples=10, deadline=None)
@given(alpha=st.floats(0.1, 0.6), stiffness=st.floats(0.01, 1))
def test_ladder_of_arms_relaxes_by_a_power_law(alpha, stiffness):
    weight, rate = PowerLawCreepParameters(stiffness, alpha).arms()
    time_s = np.geomspace(0.1, 1000, 30)
    modulus = (weight * np.exp(-np.outer(time_s, rate))).sum(axis=1)
    assert gamma(alpha) > 0
    # The ladder ends at 1e5 s: what lies beyond is (t/1e5 s)^alpha of the modulus.
    np.testing.assert_allclose(modulus, stiffness * time_s**-alpha, rtol=0.01 + 1.2 * (1000 / 1e5) ** alpha)


def test_second_relaxation_thins_under_stress_as_its_equation_says():
    parameters = replace(PLAIN, k2=1e-9, second_relaxation=SecondRelaxationParameters(0.8, 0.7, 0.3))
    load_n = through([800, 800, 200], 4.0)
    time_s = np.arange(load_n.size) / 1000
    stress, K3 = load_n / (0.0623 * AMBIENT_PA), 0.8 * 0.38113
    width = 0.3 * parameters.full_scale_deformation

    def slope(t: float, q: np.ndarray) -> np.ndarray:
        e = (np.interp(t, time_s, stress) + K3 * q) / (1 + K1 + K3)
        return width / 0.7 * np.sinh((e - q) / width)

    q = solve_ivp(slope, (0, time_s[-1]), [0.0], t_eval=time_s, rtol=1e-9, atol=1e-12, max_step=0.01).y[0]
    expected = AMBIENT_PA * (stress + K3 * q) / (1 + K1 + K3)
    # Second order of the step, in units of the time constant.
    assert np.abs(pressed(parameters, load_n) - expected).max() < 1e-4 * expected.max()


def test_friction_closes_its_loop_at_any_rate_and_dissipates():
    for parameters in (EFFECTS["stick_slip"], EFFECTS["bouc_wen"]):
        areas = []
        for seconds in (6, 24):
            # Sharp corners: rounded ones would reach less far at the higher rate.
            load_n = np.interp(np.linspace(0, 6, 1000 * seconds + 1), range(7), [0, 800, 100, 800, 100, 800, 0])
            pressure_pa = pressed(replace(parameters, k2=1e-9), load_n)
            loop = slice(500 * seconds, 2500 * seconds // 3 + 1)
            areas.append(np.trapezoid(load_n[loop], pressure_pa[loop]))
        assert areas[0] > 1e4
        assert areas[1] == pytest.approx(areas[0], rel=1e-3)


def test_nozzle_flow_is_the_square_root_for_small_pressures_and_odd_in_direction_there():
    pressure = np.array([0.01, 0.02, 0.04])
    flow = np.array([nozzle_flow(p) for p in pressure])
    assert flow == pytest.approx(np.sqrt(pressure), rel=0.03)  # compressibility: about p/2; laminar: 3e-4/(2 p)
    assert nozzle_flow(-0.01) == pytest.approx(-flow[0], rel=0.02)
    assert nozzle_flow(0.0) == 0.0
    assert nozzle_flow(1e-6) / nozzle_flow(5e-7) == pytest.approx(2.0, rel=0.01)  # laminar


def test_heat_modes_share_the_heat_and_the_slowest_has_the_time_constant():
    share, rate = GasHeatParameters(1.0, 2.0, 6).spread()
    assert share.sum() == pytest.approx(1.0)
    assert rate[0] == 0.5
    assert (np.diff(rate) > 0).all()
    assert share[0] > 0.7


def test_oddities_strike_each_session_anew_and_only_some_cycles():
    bladder = SimulatedBladder(replace(PLAIN, odd=Odd(pinch=0.5, pinch_from=0.2, pinch_share=0.5, seed=1)))
    load_n = through([800, 0] * 11 + [800], 24.0)
    first = bladder.press(load_n, 1000.0)
    bladder.reset()
    second = bladder.press(load_n, 1000.0)
    assert not np.array_equal(first, second)
    plain = pressed(PLAIN, load_n)
    peaks = (np.linspace(0.1, 23.9, 25)[1::2] * 1000).round().astype(int)
    struck = (plain - first)[peaks] > 100
    assert 0 < struck.sum() < struck.size
