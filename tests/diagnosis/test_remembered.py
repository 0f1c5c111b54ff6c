"""A drift of the zero is none where what an effect's arm remembers of loads before the recordings stands for it."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from told_columns import MODEL, STANDARD, STEP_S, session_under, some_load

from smartshoe.diagnosis import _remembered
from smartshoe.diagnosis._likelihood import Fit, Likelihood, fit
from smartshoe.diagnosis._members import fit_with
from smartshoe.diagnosis._own_terms import residual_of
from smartshoe.diagnosis._remembered import may_be_remembered
from smartshoe.models.effects import Conditions, effect
from smartshoe.models.extended import ExtendedModel

CREEPS = MODEL.with_part("second_relaxation", [0.04, 15.0])
NOISE = 0.0005
SIZE = 600


def _told(name: str, without: Fit) -> Any:
    return SimpleNamespace(effect=effect(name), member=SimpleNamespace(name=name, without=without))


def _found(unit: ExtendedModel, begins: float, missed: int = 0, name: str = "warm_up") -> tuple[Fit, Any]:
    """A fit with a zero that moves, and what is asked of it: recordings that begin at a load, ``missed`` before."""
    sessions = []
    for seed in range(3):
        load = np.concatenate([np.linspace(0.0, begins, missed), some_load(SIZE, seed)])
        load[missed : missed + 20] = np.linspace(begins, load[missed + 20], 20)
        at = Conditions(STEP_S * np.arange(load.size), load, STEP_S)
        noise = NOISE * np.random.default_rng(seed).standard_normal(SIZE)
        sessions.append(session_under(load[missed:], unit.simulate(at)[missed:] + noise, seed))
    likelihood = Likelihood(sessions, NOISE, MODEL, STANDARD)
    less = fit(likelihood, CREEPS)
    found = fit(likelihood, fit_with(effect(name), less.model, likelihood).model)
    assert less.cost > found.cost + 100.0  # a drift follows it
    return found, _told(name, less)


@pytest.mark.parametrize("missed", [20, 80])
def test_what_an_arm_remembers_of_loads_before_a_recording_is_no_warm_up(missed: int) -> None:
    """The recorder is started in a load that the unit has borne for some seconds only."""
    found, drift = _found(CREEPS, 0.6, missed)
    assert may_be_remembered(drift, found.model, found.likelihood.sessions, STANDARD)


@pytest.mark.parametrize(("begins", "time_constant_s"), [(0.0, 15.0), (0.0, 150.0), (0.6, 150.0)])
def test_a_warm_up_is_one_where_recordings_begin_at_rest_or_no_arm_remembers_for_as_long(
    begins: float, time_constant_s: float
) -> None:
    found, drift = _found(CREEPS.with_part("warm_up", [0.03, time_constant_s, 1.0]), begins)
    assert not may_be_remembered(drift, found.model, found.likelihood.sessions, STANDARD)


def test_where_no_arm_was_found_or_nothing_drifts_by_itself_there_is_nothing_to_stand_for() -> None:
    found, drift = _found(CREEPS, 0.6, 20)
    sessions, model = found.likelihood.sessions, found.model
    bare = _told("warm_up", fit(found.likelihood, MODEL))
    assert not may_be_remembered(bare, model.without("second_relaxation"), sessions, STANDARD)
    for other in ("gain_drift", "zero_offset", "cross_talk"):
        another = _told(other, drift.member.without)
        assert not may_be_remembered(another, model, sessions, STANDARD)


@pytest.mark.parametrize("missed", [20, 80])
def test_what_an_arm_remembers_is_no_set_either(missed: int) -> None:
    found, drift = _found(CREEPS, 0.6, missed, "permanent_set")
    assert may_be_remembered(drift, found.model, found.likelihood.sessions, STANDARD)


@pytest.mark.parametrize("begins", [0.0, 0.6])
def test_a_set_that_grows_with_the_loads_borne_is_one_though_an_arm_was_found(begins: float) -> None:
    found, drift = _found(CREEPS.with_part("permanent_set", [0.002, 1.2]), begins, name="permanent_set")
    assert not may_be_remembered(drift, found.model, found.likelihood.sessions, STANDARD)


def test_an_arm_whose_time_the_set_has_changed_stands_for_it_with_another_of_its_times() -> None:
    found, drift = _found(CREEPS, 0.6, 20, "permanent_set")
    at = {part.name: part.values for part in found.model.parts}
    share = float(at["second_relaxation"][0])
    slower = found.model.without("second_relaxation").with_part("second_relaxation", [share, 110.0])
    assert may_be_remembered(drift, slower, found.likelihood.sessions, STANDARD)


def test_a_past_is_weighed_against_the_noise_of_all_samples(monkeypatch: pytest.MonkeyPatch) -> None:
    found, drift = _found(CREEPS, 0.6, 20)
    weighed = []
    monkeypatch.setattr(_remembered, "_cost_with_arms", lambda *about: weighed.append(about[-1]) or math.inf)
    assert not may_be_remembered(drift, found.model, found.likelihood.sessions, STANDARD)
    without = drift.member.without.model
    left = [residual_of(one, without)[one.fitted] for one in found.likelihood.sessions]
    assert weighed == pytest.approx([np.mean(np.concatenate(left) ** 2)] * len(weighed))
