"""Parameters in units, arms that an effect bent, and shapes at a bound, against what is known beforehand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from courses import prepared, pressed, triangles
from test_diagnosis_parts import MODEL, likelihood_of, recording, sessions_of

from smartshoe.diagnosis._arms import arms_of, effect_count, with_another_pole, with_arm
from smartshoe.diagnosis._laws import _is_stretched
from smartshoe.diagnosis._likelihood import fit
from smartshoe.diagnosis._parameters import parameters_of
from smartshoe.diagnosis._scale import Scale
from smartshoe.diagnosis._state import state_at
from smartshoe.models.effects import effect
from smartshoe.models.elements import Arm
from smartshoe.units import MILLIBAR


# -- parameters in units ------------------------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("name", "values", "parameter", "expected", "unit"),
    [
        ("dead_band", (0.05, 0.2, 0.0), "lost_load", 0.05 * 600.0, "N"),
        ("sensor_nonlinearity", (0.02, 0.0, 0.0), "bow", 0.02 * 1.5 * -200.0, "mbar"),
        ("zero_drift", (1e-4, 0.0, 60.0, 1.0), "drift_rate", 1e-4 * 1.5 * -200.0, "mbar/s"),
        ("zero_drift", (1e-4, 2e-3, 60.0, 1.0), "temperature_coefficient", 2e-3 * 1.5 * -200.0, "mbar/K"),
        ("delay", (0.03,), "delay", 0.03, "s"),
    ],
)
def test_shares_of_full_scale_become_newtons_and_the_readings_unit(
    name: str, values: tuple[float, ...], parameter: str, expected: float, unit: str
) -> None:
    """What stands before the chain's gain comes out as many times as large, here of a reading that falls."""
    sessions, _ = prepared(pressed(triangles()))
    conditions = [replace(one.conditions, temperature_k=one.conditions.time_s % 7.0) for one in sessions]
    sessions = [replace(one, conditions=logged) for one, logged in zip(sessions, conditions, strict=True)]
    model = replace(MODEL, gain=1.5).with_part(effect(name), np.array(values))
    found = parameters_of(fit(likelihood_of(sessions), model, 0), name, Scale(600.0, -200.0, MILLIBAR))
    assert set(found) == {one.name for one in effect(name).parameters}
    assert (found[parameter].value, found[parameter].unit) == (pytest.approx(expected), unit)


def test_an_interval_stays_within_what_is_possible() -> None:
    sessions, _ = sessions_of(recording(seed=1))
    model = MODEL.with_part(effect("linear_leak"), np.array([1e-7]))
    one = parameters_of(fit(likelihood_of(sessions), model, 0), "linear_leak", Scale(800.0, 140.0, MILLIBAR))
    leak = one["leak_rate"]
    assert leak.sd > 1e-7
    assert leak.ci95[0] == 0.0
    assert leak.ci95[1] == pytest.approx(leak.value + 1.96 * leak.sd, rel=1e-3)


def test_what_nothing_in_the_data_depends_on_may_be_anything() -> None:
    """A share lost below zero, of readings that never are: not known to be none."""
    sessions, _ = sessions_of(recording(seed=1))
    model = MODEL.with_part(effect("saturation"), np.array([0.3, 0.8, 0.05, 0.0]))
    rail = parameters_of(fit(likelihood_of(sessions), model, 0), "saturation", Scale(800.0, 140.0, MILLIBAR))["rail"]
    assert (rail.value, rail.ci95, rail.to_dict()["sd"]) == (0.0, (0.0, 1.0), None)


# -- arms and laws ------------------------------------------------------------------------------------------------
def test_an_arm_of_an_effect_that_creeps_may_be_the_baselines() -> None:
    model = replace(MODEL, relaxing_share=-0.02).with_part(effect("second_relaxation"), np.array([0.1, 5.0]))
    model = model.with_part(effect("power_law_creep"), np.array([0.01, 0.2])).with_part("delay")
    ((name, arm),) = arms_of(model)
    assert (name, arm.share, arm.rate_per_s) == ("second_relaxation", pytest.approx(0.1), pytest.approx(0.2))
    assert effect_count(model) == 4  # one that falls in the place of a wall's arm is an effect
    assert effect_count(replace(model, relaxing_share=0.02)) == 3
    swapped = with_arm(model, Arm(0.3, 2.0))
    assert (swapped.relaxing_share, swapped.relaxation_rate_per_s) == (0.3, 2.0)
    assert swapped.names == model.names


def test_a_rate_that_an_effect_bent_is_found_anew_without_it() -> None:
    truth = replace(MODEL, relaxing_share=0.3, relaxation_rate_per_s=0.3)
    sessions, _ = prepared(recording(truth, rates=(200, 800)), factor=6)
    likelihood = likelihood_of(sessions)
    bent = replace(truth, relaxing_share=0.02, relaxation_rate_per_s=20.0)
    start = fit(likelihood, bent.with_part(effect("second_relaxation"), np.array([0.3, 2.0])))
    state = state_at(start)
    found = with_another_pole(state)
    assert found.fit.model.relaxation_rate_per_s == pytest.approx(0.3, rel=0.05)
    assert found.fit.model.relaxing_share == pytest.approx(0.3, rel=0.05)
    assert found.fit.model.parts == ()


def test_a_shape_at_a_bound_is_stretched() -> None:
    law = effect("dead_band")
    for softness, has_extreme_arm in ((0.2, False), (0.03, True), (1.0, False), (3.0, True)):
        assert _is_stretched(MODEL.with_part(law, np.array([0.05, softness, 0.1])), law) is has_extreme_arm
    for onset, has_extreme_arm in ((0.0, False), (1.5, True)):  # that it sets in at once is no stretch
        assert _is_stretched(MODEL.with_part(law, np.array([0.05, 0.2, onset])), law) is has_extreme_arm
    # A strength at its bound is no shape, nor are another effect's.
    leak = effect("linear_leak")
    assert not _is_stretched(MODEL.with_part(leak, np.array([0.0])), leak)
    below = MODEL.with_part(effect("dead_band"), np.array([0.05, 0.03, 0.0]))
    assert not _is_stretched(below.with_part(leak, np.array([0.01])), leak)
