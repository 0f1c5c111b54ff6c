"""A bladder made of a fitted model: rest, memory from press to press, units."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from smartshoe.errors import UsageError
from smartshoe.models.effects import Conditions, effect
from smartshoe.models.extended import ExtendedModel
from smartshoe.models.twin import TwinBladder


def _strong(name: str, strength: float) -> np.ndarray:
    """The effect's values with its first parameter, the strength, at ``strength``."""
    values = effect(name).start()
    values[0] = strength
    return values


BASELINE = ExtendedModel(0.9, 0.15, 0.3, 800.0, 180.0, "mbar")
WITH_MEMORY = (
    BASELINE.with_part(effect("play_hysteresis"), _strong("play_hysteresis", 0.02))
    .with_part(effect("linear_leak"), np.array([0.02]))
    .with_part(effect("zero_drift"), np.array([1e-4, 0.0, 60.0, 1.0]))
)


def _load_n(n: int, seed: int) -> np.ndarray:
    at = np.random.default_rng(seed).uniform(0.0, 800.0, 12)
    at[0] = 0.0
    return np.interp(np.arange(n), np.linspace(0, n, 12), at)


@given(cuts=st.lists(st.integers(0, 500), max_size=5), seed=st.integers(0, 100))
@settings(max_examples=20, deadline=None)
def test_memory_carries_on_from_press_to_press(cuts: list[int], seed: int) -> None:
    twin, load_n = TwinBladder(WITH_MEMORY), _load_n(500, seed)
    whole = twin.press(load_n, 100.0)
    twin.reset()
    parts = [twin.press(part, 100.0) for part in np.split(load_n, sorted(cuts))]
    np.testing.assert_allclose(np.concatenate(parts), whole, rtol=0, atol=1e-9)


def test_a_press_is_the_models_reading_from_rest_in_pascal() -> None:
    load_n = _load_n(2000, 3)
    conditions = Conditions(np.arange(2001) / 100.0, np.append(0.0, load_n) / 800.0, 0.01)
    np.testing.assert_allclose(
        TwinBladder(WITH_MEMORY).press(load_n, 100.0), 100.0 * WITH_MEMORY.reading(conditions)[1:], rtol=1e-12
    )


def test_a_held_load_settles_at_the_static_gain() -> None:
    twin = TwinBladder(BASELINE)
    pressure_pa = twin.press(np.full(20_000, 400.0), 100.0)
    assert pressure_pa[0] < 0.9 * pressure_pa[-1]  # it begins at rest, not under the load
    assert pressure_pa[-1] == pytest.approx(400.0 * twin.static_gain_pa_per_n, rel=1e-9)
    assert twin.static_gain_pa_per_n == pytest.approx(0.9 * 18_000.0 / 800.0)
    assert twin.effective_area_m2 * twin.static_gain_pa_per_n == pytest.approx(1.0 / BASELINE.wall_ratio)


def test_reset_forgets() -> None:
    twin, load_n = TwinBladder(WITH_MEMORY), _load_n(300, 1)
    first = twin.press(load_n, 100.0)
    twin.press(load_n, 100.0)
    twin.reset()
    assert np.array_equal(twin.press(load_n, 100.0), first)
    twin.reset()
    assert twin.press(load_n, 250.0).size == 300
    assert twin.press(np.zeros(0), 250.0).size == 0


def test_what_cannot_be_pressed_is_refused() -> None:
    twin = TwinBladder(BASELINE)
    with pytest.raises(UsageError, match="sample 2 of 3"):
        twin.press(np.array([1.0, np.nan, 2.0]), 100.0)
    with pytest.raises(UsageError, match="sample_rate_hz"):
        twin.press(np.ones(3), 0.0)
    twin.press(np.ones(3), 100.0)
    with pytest.raises(UsageError, match=r"100 Hz.*200 Hz"):
        twin.press(np.ones(3), 200.0)
    with pytest.raises(UsageError, match="not a pressure"):
        TwinBladder(ExtendedModel(0.9, 0.15, 0.3, 800.0, 4.0, "V"))
