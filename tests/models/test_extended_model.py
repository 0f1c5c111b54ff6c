"""The chain of effects: null is the baseline, sensitivities are derivatives, a file gives the model back."""

from __future__ import annotations

import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from smartshoe.errors import UsageError
from smartshoe.models.core import Core
from smartshoe.models.effects import Conditions, blocks, catalogue, effect
from smartshoe.models.effects.effect import PLACES
from smartshoe.models.elements import Arm
from smartshoe.models.extended import ExtendedModel

NAMES = [
    *(name for name, one in catalogue().items() if one.parameters and one.is_physical),
    *(one.name for family in blocks().values() for one in family),
]


def conditions(seed: int = 0, n: int = 600, step_s: float = 0.05) -> Conditions:
    rng = np.random.default_rng(seed)
    corners = np.concatenate([[0.0, 0.0, 1.0, 0.0, 0.5, 0.5, 0.0], rng.uniform(0, 1, 4), [0.0]])
    load = np.interp(np.linspace(0, corners.size - 1, n), np.arange(corners.size), corners)
    time_s = step_s * np.arange(n)
    return Conditions(time_s, load, step_s, 0.0, 0.01 * time_s, np.roll(load, 40))


def baseline() -> ExtendedModel:
    return ExtendedModel(0.98, 0.08, 0.22, 800.0, 140.0, "mbar")


def values_of(name: str) -> np.ndarray:
    """Strengths at their typical size, within bounds."""
    one = effect(name)
    start = one.start()
    moved = [
        value if p.null is None else min(max(p.null + p.size, p.lower), p.upper)
        for p, value in zip(one.parameters, start, strict=True)
    ]
    return np.array(moved)


@pytest.mark.parametrize("name", NAMES)
def test_an_effect_at_null_leaves_the_chain_as_it_is(name: str) -> None:
    at = conditions()
    with_null = baseline().with_part(effect(name))
    assert_allclose(with_null.simulate(at), baseline().simulate(at), atol=1e-12)


@given(st.sampled_from([name for name in NAMES if name != "zero_offset"]), st.floats(-0.5, 0.5))
def test_a_zero_moves_any_reading_by_itself(name: str, zero: float) -> None:
    """A fit leaves each recording its own offset, so what a curve or a rail was fitted to has none."""
    at = conditions()
    model = baseline().with_part(effect(name), values_of(name))
    moved = model.with_part(effect("zero_offset"), np.array([zero]))
    assert_allclose(moved.simulate(at), model.simulate(at) + model.gain * zero, atol=1e-12)


@pytest.mark.parametrize("name", NAMES)
def test_a_model_survives_its_file(name: str) -> None:
    model = baseline().with_part(effect(name), values_of(name))
    again = ExtendedModel.from_dict(json.loads(json.dumps(model.to_dict())))
    assert_array_equal(again.simulate(conditions()), model.simulate(conditions()))


@pytest.mark.parametrize("name", NAMES)
def test_sensitivities_are_those_of_the_whole_chain(name: str) -> None:
    """Running anew only from a parameter's own block must give what running all of it gives."""
    at = conditions()
    model = baseline().with_part(effect("zero_offset"), np.array([0.01])) if name != "zero_offset" else baseline()
    model = model.with_part(effect(name), values_of(name))
    reading, slopes = model.sensitivities(at)
    assert_array_equal(reading, model.simulate(at))
    from smartshoe.models.extended import derivative_step

    for j, (_, parameter) in enumerate(model.parameters):
        moved = model.theta
        step = derivative_step(parameter, moved[j])
        moved[j] += step
        whole = (model.at(moved).simulate(at) - reading) / step
        assert_allclose(slopes[:, j], whole, atol=1e-6)
        if j in (1, 2):  # what the arm does not move gives the same to the last digit
            assert_array_equal(slopes[:, j], whole)
    of_it = [j for j, (owner, _) in enumerate(model.parameters) if owner == name]
    assert_array_equal(model.own_sensitivities(name, at, model.trace(at)), slopes[:, of_it])


@given(st.lists(st.sampled_from(NAMES), min_size=2, max_size=4, unique=True))
@settings(max_examples=20, deadline=None)
def test_blocks_stand_in_the_chains_order_whatever_the_order_they_came_in(names: list[str]) -> None:
    one, other = baseline(), baseline()
    for name in names:
        one = one.with_part(effect(name), values_of(name))
    for name in reversed(names):
        other = other.with_part(effect(name), values_of(name))
    places = [PLACES.index(part.effect.place) if part else PLACES.index("core") for part in one.chain]
    assert places == sorted(places)
    assert_allclose(one.simulate(conditions()), other.simulate(conditions()), atol=1e-9)


def test_theta_goes_in_and_out() -> None:
    model = baseline().with_part(effect("linear_leak"), np.array([0.01]))
    again = model.at(model.theta)
    assert_array_equal(again.theta, model.theta)
    assert [owner for owner, _ in model.parameters] == ["baseline"] * 3 + ["linear_leak"]


def test_the_baseline_is_an_arm_and_a_gain() -> None:
    at = conditions()
    assert_allclose(baseline().simulate(at), 0.98 * Core([Arm(0.08, 0.22)], 1.6).simulate(at.load, at.step_s))


@pytest.mark.parametrize(("name", "values"), [("second_relaxation", [0.1, 12.0]), ("linear_leak", [1e-3])])
def test_what_continues_a_recording_begins_with_what_the_wall_and_the_gas_had_come_to(
    name: str, values: list[float]
) -> None:
    load = np.interp(np.arange(2000), [0, 400, 500, 900, 1000, 1400, 1999], [0.0, 1.0, 1.0, 0.0, 0.0, 0.7, 0.0])
    time_s = 0.02 * np.arange(2000)
    model = ExtendedModel(1.0, 0.1, 0.2, 800.0, 140.0, "mbar").with_part(name, values)
    whole = model.simulate(Conditions(time_s, load, 0.02))
    later = Conditions(time_s[:1000], load[1000:], 0.02, earlier=load[:1000])
    assert_allclose(model.simulate(later), whole[1000:], rtol=0.0, atol=1e-12)
    rested = model.simulate(Conditions(time_s[:1000], load[1000:], 0.02))
    assert np.max(np.abs(rested - whole[1000:])) > 1e-3


def test_an_unknown_effect_is_refused_with_the_names_there_are() -> None:
    with pytest.raises(UsageError, match="linear_leak"):
        effect("magic")


def test_models_that_differ_elsewhere_in_the_chain_share_their_core() -> None:
    model = baseline()
    assert model.with_part("zero_offset", np.array([0.01])).core is model.core
    assert model.at(model.theta * np.array([1.1, 1.0, 1.0])).core is model.core
    assert model.at(model.theta * np.array([1.0, 1.1, 1.0])).core is not model.core


@given(st.floats(0.01, 1.0), st.sampled_from([1.3, 1.6, 3.0]))
@settings(max_examples=20, deadline=None)
def test_what_makes_a_hold_fall_makes_it_fall_at_the_rate_that_was_asked_for(rate_per_s: float, ratio: float) -> None:
    step_s = 0.01 / rate_per_s
    load = np.ones(301)
    load[0] = 0.0
    held = Conditions(step_s * np.arange(load.size), load, step_s)
    model = ExtendedModel(1.0, 0.0, 0.22, 800.0, 140.0, "mbar", (), ratio)
    told = {
        name: values for name, one in catalogue().items() if (values := one.falling_at(rate_per_s, ratio)) is not None
    }
    assert told.keys() == {"linear_leak"}  # by a law that is a hole's no hold falls at a rate
    for name, values in told.items():
        reading = model.with_part(effect(name), values).simulate(held)[1:]
        assert_allclose(np.diff(np.log(reading)) / step_s, -rate_per_s, rtol=1e-3)


def test_a_hold_falls_no_faster_than_the_parameter_goes() -> None:
    (rate,) = effect("linear_leak").parameters
    assert effect("linear_leak").falling_at(9.0, 1.6) == [rate.upper]
