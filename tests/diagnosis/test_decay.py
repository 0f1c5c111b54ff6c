"""A reading that falls without a moving load: time constant, share lost, and the law of its fall."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from smartshoe.diagnosis.decay import Decay, decay_of
from smartshoe.recording import Recording

Array = NDArray[np.float64]

TIME_S = np.arange(0.0, 100.0, 0.05)
NOISE_MBAR = 0.1


def _recording(pressure_mbar: Array, load_n: Array | None = None, seed: int = 0) -> Recording:
    noise = np.random.default_rng(seed).normal(0.0, NOISE_MBAR, pressure_mbar.size)
    loads = {} if load_n is None else {"force_n": load_n}
    return Recording.from_arrays(time_s=TIME_S[: pressure_mbar.size], pressure_mbar=pressure_mbar + noise, **loads)


def _found(pressure_mbar: Array, load_n: Array | None = None, seed: int = 0) -> Decay:
    decay = decay_of(_recording(pressure_mbar, load_n, seed))
    assert decay is not None
    return decay


@given(
    level=st.floats(50.0, 300.0), tau_s=st.floats(5.0, 60.0), waits_s=st.floats(0.0, 15.0), seed=st.integers(0, 10_000)
)
@settings(max_examples=15)
def test_an_exponential_is_known_with_its_time_constant(level: float, tau_s: float, waits_s: float, seed: int) -> None:
    decay = _found(level * np.exp(-np.maximum(TIME_S - waits_s, 0.0) / tau_s), seed=seed)
    assert decay.course == "exponential"
    # The onset is seen once 2 % of the fall are lost; an interval of 95 % is widened for one draw in twenty.
    half = max(2.0 * (decay.ci95_s[1] - decay.tau_s), 0.01 * tau_s)
    assert decay.tau_s == pytest.approx(tau_s, abs=half)
    assert decay.onset_s <= waits_s + 0.05 * tau_s + 0.5
    assert decay.plateau == 0.0


@given(order=st.one_of(st.floats(0.5, 0.8), st.floats(1.2, 2.0)), seed=st.integers(0, 10_000))
@settings(max_examples=15)
def test_a_flow_that_is_not_proportional_to_pressure_is_told_from_an_exponential(order: float, seed: int) -> None:
    base = np.maximum(1.0 + (order - 1.0) * TIME_S / 30.0, 1e-12)
    decay = _found(200.0 * base ** (-1.0 / (order - 1.0)), seed=seed)
    assert decay.course == ("slower" if order > 1.0 else "faster")
    assert decay.order == pytest.approx(order, abs=0.05)
    assert decay.order_ci95 is not None
    assert decay.order_ci95[0] < order + 0.02
    assert decay.order_ci95[1] > order - 0.02


def test_a_relaxation_ends_at_a_plateau() -> None:
    decay = _found(80.0 + 20.0 * np.exp(-TIME_S / 15.0))
    assert decay.plateau == pytest.approx(80.0, abs=0.5)
    assert decay.tau_s == pytest.approx(15.0, rel=0.03)
    assert decay.lost_percent == pytest.approx(20.0, abs=0.5)


def test_too_small_a_loss_tells_no_law() -> None:
    decay = _found(1000.0 * np.exp(-TIME_S / 5000.0))
    assert decay.course == "undecided"
    assert decay.order is None
    assert decay.tau_s == pytest.approx(5000.0, rel=0.05)
    assert "too little is lost" in decay.says


@pytest.mark.parametrize(
    "pressure_mbar",
    [
        np.full(TIME_S.size, 50.0),
        100.0 * (1.0 - np.exp(-TIME_S / 20.0)),
        50.0 + 50.0 * np.sin(TIME_S),
        100.0 * np.exp(-TIME_S[:10]),
    ],
    ids=["constant", "rising", "walking", "ten samples"],
)
def test_what_does_not_fall_steadily_is_no_decay(pressure_mbar: Array) -> None:
    assert decay_of(_recording(pressure_mbar)) is None


def test_a_load_that_moves_is_a_matter_for_the_diagnosis() -> None:
    falling = 100.0 * np.exp(-TIME_S / 20.0)
    assert decay_of(_recording(falling, 500.0 * np.exp(-TIME_S / 20.0))) is None


def test_the_sentence_says_what_would_tell_leak_from_relaxation() -> None:
    falling = 100.0 * np.exp(-TIME_S / 20.0)
    assert "only a logged load tells apart" in _found(falling).says
    assert "a load that stands still cannot tell apart" in _found(falling, np.full(TIME_S.size, 500.0)).says


def test_without_a_reading_there_is_none() -> None:
    assert decay_of(Recording.from_arrays(time_s=TIME_S, force_n=np.full(TIME_S.size, 5.0))) is None
