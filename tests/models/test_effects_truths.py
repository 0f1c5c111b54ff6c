"""Effects of contact, wall and gas against truths with other equations: what a joint fit takes off the residual."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from scipy.optimize import least_squares

from simulators.effects.contact import ContactParameters
from simulators.effects.damage import PermanentSetParameters
from simulators.effects.friction import BoucWenParameters, StickSlipParameters
from simulators.effects.relaxation import PowerLawCreepParameters, SecondRelaxationParameters
from simulators.plant.bladder import SimulatedBladder
from simulators.plant.bladder_parameters import (
    BladderParameters,
    ConditioningParameters,
    GasHeatParameters,
    HysteresisParameters,
    LeakParameters,
    SofteningParameters,
)
from smartshoe.arrays import Array
from smartshoe.models.effects.catalogue import effect
from smartshoe.models.effects.effect import Conditions
from smartshoe.models.extended import ExtendedModel

PEAK_N, RATE_HZ = 800.0, 25.0
K1, K2, X = 1.341, 0.215, 0.38113  # the paper's left toe, Chinimilli 2016, Table 1
PLAIN = BladderParameters(K1, K2, effective_area_m2=PEAK_N / (7000.0 * (1.0 + K1 * X)))
N = 1.0 + K1 * X

# Truth, effect, and where the truth names one: the strength's value and how near to it the fit must come.
CASES: tuple[tuple[str, dict[str, Any], float | None, float], ...] = (
    ("second_relaxation", {"second_relaxation": SecondRelaxationParameters(0.15, 0.7)}, None, 0.0),
    ("second_relaxation", {"second_relaxation": SecondRelaxationParameters(0.1, 25.0)}, None, 0.0),
    ("power_law_creep", {"power_law_creep": PowerLawCreepParameters(0.15, 0.2)}, None, 0.0),
    ("power_law_creep", {"power_law_creep": PowerLawCreepParameters(0.1, 0.4)}, None, 0.0),
    ("linear_leak", {"leak": LeakParameters(linear_per_s=0.003)}, 0.003, 0.15),
    ("linear_leak", {"leak": LeakParameters(capillary_per_s=0.003)}, 0.003, 0.15),
    ("orifice_leak", {"leak": LeakParameters(orifice_per_s=0.0005)}, None, 0.0),
    ("orifice_leak", {"leak": LeakParameters(nozzle_per_s=0.0005)}, None, 0.0),
    ("gas_heat", {"gas_heat": GasHeatParameters(0.2, 1.0)}, 0.08, 0.1),
    ("gas_heat", {"gas_heat": GasHeatParameters(0.4, 1.5, 3)}, 0.16, 0.2),
    ("gas_compression", {"gas": "boyle"}, 7000.0 / 101_325.0, 0.1),
    ("wall_hardening", {"wall_stiffening": 1.0}, None, 0.0),
    ("wall_hardening", {"wall_hardening": 0.2}, None, 0.0),
    ("contact_area", {"contact": ContactParameters(saturation=0.3)}, None, 0.0),
    ("contact_area", {"static_exponent": 0.95}, 0.5**0.95 - 0.5, 0.1),
    ("dead_band", {"contact": ContactParameters(gap_n=15.0)}, 15.0 / PEAK_N, 0.05),
    ("play_hysteresis", {"hysteresis": HysteresisParameters(strength=0.01)}, 0.01, 0.1),
    ("play_hysteresis", {"stick_slip": StickSlipParameters(0.015)}, 0.015, 0.1),
    ("bouc_wen_hysteresis", {"bouc_wen": BoucWenParameters(0.01)}, 0.01, 0.1),
    ("bouc_wen_hysteresis", {"bouc_wen": BoucWenParameters(0.02, 0.2, 2.5, 0.1)}, 0.02, 0.1),
    ("load_unload_asymmetry", {"contact": ContactParameters(direction_gain=0.02)}, 0.02, 0.05),
    ("load_unload_asymmetry", {"contact": ContactParameters(direction_gain=-0.02, direction_turn_n=9.0)}, -0.02, 0.05),
    ("rate_gain", {"contact": ContactParameters(rate_gain=0.03)}, 0.03, 0.05),
    ("mullins_softening", {"softening": SofteningParameters(0.06)}, 0.06 * (N - 1.0) / N, 0.2),
    ("cycle_conditioning", {"conditioning": ConditioningParameters(-0.02, 4.0)}, -0.02, 0.02),
    ("permanent_set", {"permanent_set": PermanentSetParameters(0.0005)}, 0.0005 * (N - 1.0) / N, 0.1),
)


@cache
def loading() -> Conditions:
    """Triangles at 50 to 800 N/s and to several loads, holds at three, a minor loop."""
    corners = [(0.0, 0.0), (2.0, 0.0)]

    def to(load_n: float, rate_n_per_s: float) -> None:
        corners.append((corners[-1][0] + abs(load_n - corners[-1][1]) / rate_n_per_s, load_n))

    def stay(duration_s: float) -> None:
        corners.append((corners[-1][0] + duration_s, corners[-1][1]))

    for rate_n_per_s in (50.0, 100.0, 200.0, 400.0, 800.0):
        for peak_n in (500.0, PEAK_N) if rate_n_per_s > 50.0 else (PEAK_N,):
            to(peak_n, rate_n_per_s)
            to(0.0, rate_n_per_s)
            stay(1.0)
    for load_n in (250.0, PEAK_N, 500.0):
        to(load_n, 200.0)
        stay(15.0)
        to(0.0, 200.0)
        stay(5.0)
    for load_n in (600.0, 300.0, 700.0, 0.0):
        to(load_n, 300.0)
    stay(2.0)
    times_s, loads_n = np.array(corners).T
    time_s = np.arange(0.0, times_s[-1], 1.0 / RATE_HZ)
    return Conditions(time_s, np.interp(time_s, times_s, loads_n) / PEAK_N, 1.0 / RATE_HZ)


def simulated(model: ExtendedModel) -> Array:
    """The model's reading (n,); springs that bend in the loop know the arm beside them."""
    return model.simulate(loading())


def fitted(model: ExtendedModel, reading: Array) -> tuple[Array, float]:
    """Parameters and sum of squares left, by least squares on the output error."""
    bounds = [(one.lower, one.upper) for _, one in model.parameters]
    start = np.clip(model.theta, *np.transpose(bounds))
    scale = [one.size if one.null is not None else max(abs(x), 1e-3)
             for (_, one), x in zip(model.parameters, start, strict=True)]  # fmt: skip
    found = least_squares(
        lambda theta: simulated(model.at(theta)) - reading,
        start, jac=lambda theta: model.at(theta).sensitivities(loading())[1],
        bounds=np.transpose(bounds), x_scale=scale, max_nfev=40,
    )  # fmt: skip
    return found.x, 2.0 * float(found.cost)


@pytest.mark.parametrize(("name", "options", "strength", "near"), CASES)
def test_the_block_takes_off_what_the_refitted_baseline_leaves(
    name: str, options: dict[str, Any], strength: float | None, near: float
) -> None:
    pressure_pa = SimulatedBladder(replace(PLAIN, **options)).press(PEAK_N * loading().load, RATE_HZ)
    reading = pressure_pa / (PLAIN.static_gain_pa_per_n * PEAK_N)
    plain = ExtendedModel(1.0, 0.05, 0.3, PEAK_N, 1.0, "1")
    offset = effect("zero_offset")
    baseline = min(
        (fitted(replace(plain, relaxing_share=share, relaxation_rate_per_s=rate).with_part(offset), reading)
         for share, rate in ((0.1, 0.2), (0.05, 1.5))), key=lambda one: one[1],
    )  # fmt: skip
    left_rms = np.sqrt(baseline[1] / reading.size)
    assert 5e-4 <= left_rms <= 0.04
    made, found = effect(name), []
    for shape in made.shapes:
        values = made.start(shape)
        values[0] += 0.3 * made.parameters[0].size
        for share, rate in {(baseline[0][1], baseline[0][2]), (0.1, 0.2)}:
            start = replace(plain, relaxing_share=share, relaxation_rate_per_s=rate)
            found.append(fitted(start.with_part(made, values).with_part(offset), reading))
    theta, left = min(found, key=lambda one: one[1])
    print(
        f"{name:22s} {100 * left_rms:.3f} % of full scale, {100 * (1 - left / baseline[1]):.2f} % removed, {theta[3:]}"
    )
    assert 1.0 - left / baseline[1] >= 0.98
    if strength is not None:
        assert theta[3] == pytest.approx(strength, rel=near)
