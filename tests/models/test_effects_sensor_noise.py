"""Tests on a residual: what noise is, found where it is and not where it is not."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import lfilter

from smartshoe.models.effects import Conditions, NoiseEffect, catalogue, hum
from smartshoe.models.effects._sensor_evidence import SLOPE, SensorEvidence, growing_noise
from smartshoe.models.first_order import lag

STEP_S = 0.01
FLOOR = 0.001
TESTS = {name: one for name, one in catalogue().items() if isinstance(one, NoiseEffect)}


def _load(repeats: int) -> np.ndarray:
    """Triangles of 20, 8 and 2 s with rests, one after the other."""
    parts = [np.zeros(300)]
    for samples in (1000, 400, 100):
        up = np.arange(1, samples + 1) / samples
        parts += [up, 1.0 - up, np.zeros(300)] * repeats
    return np.concatenate(parts)


class Case:
    """A record with its prediction, and residuals of several kinds."""

    def __init__(self, repeats: int = 3) -> None:
        self.load = _load(repeats)
        self.n = self.load.size
        self.time_s = STEP_S * np.arange(self.n)
        self.prediction = 0.9 * self.load + 0.1 * lag(self.load, 0.3, STEP_S)
        self.slope = np.gradient(self.prediction, STEP_S)
        self.conditions = Conditions(self.time_s, self.load, STEP_S)

    def found(self, test: NoiseEffect, residual: np.ndarray) -> SensorEvidence | None:
        evidence = test.evidence(residual, self.conditions, self.prediction)
        assert evidence is None or evidence.value > evidence.threshold
        return evidence

    def all_found(self, residual: np.ndarray) -> set[str]:
        return {name for name, test in TESTS.items() if self.found(test, residual) is not None}


CASE = Case()


def _white(rng: np.random.Generator) -> np.ndarray:
    return FLOOR * rng.standard_normal(CASE.n)


def _coloured(rng: np.random.Generator, strength: float, tau_s: float) -> np.ndarray:
    keep = np.exp(-STEP_S / tau_s)
    return lfilter([strength * np.sqrt(1.0 - keep**2)], [1.0, -keep], rng.standard_normal(CASE.n))


def test_white_noise_alarms_no_test_more_often_than_one_in_a_thousand() -> None:
    rng = np.random.default_rng(11)
    alarms = [name for _ in range(60) for name in CASE.all_found(_white(rng))]
    # 240 tests at 1/1000: three alarms or more would come by chance once in 500 runs.
    assert len(alarms) <= 2


@pytest.mark.parametrize(
    "misfit",
    [
        lambda: 0.01 * CASE.prediction * (1.0 - CASE.prediction),  # a curve
        lambda: 0.02 * (CASE.prediction - lag(CASE.prediction, 10.0, STEP_S)),  # a lag
        lambda: 0.01 * np.sign(CASE.slope) * (np.abs(CASE.slope) > 0.01),  # a loop with corners
        lambda: 2e-5 * CASE.time_s * CASE.prediction,  # a drifting gain
        lambda: 2e-5 * CASE.time_s,  # a drifting zero
    ],
    ids=["curve", "lag", "loop", "gain_drift", "zero_drift"],
)  # fmt: skip
def test_an_unmodelled_cause_is_no_noise(misfit: Callable[[], np.ndarray]) -> None:
    assert CASE.all_found(misfit() + _white(np.random.default_rng(5))) == set()


@settings(max_examples=6, deadline=None)
@given(seed=st.integers(0, 10**6), strength=st.floats(0.001, 0.003), tau_s=st.floats(0.05, 0.8))
def test_coloured_noise_is_found_with_its_strength(seed: int, strength: float, tau_s: float) -> None:
    rng = np.random.default_rng(seed)
    residual = _white(rng) + _coloured(rng, strength, tau_s)
    evidence = CASE.found(TESTS["coloured_noise"], residual)
    assert evidence is not None
    # 50 s of repeats hold some sixty independent stretches of the longest memory.
    assert evidence.strength == pytest.approx(strength, rel=0.4)


def test_without_repeats_nothing_is_said_of_coloured_noise() -> None:
    single = Case(repeats=1)
    keep = np.exp(-STEP_S / 0.3)
    noise = lfilter([0.01], [1.0, -keep], np.random.default_rng(3).standard_normal(single.n))
    assert single.found(TESTS["coloured_noise"], noise) is None


@settings(max_examples=6, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_weights_put_on_by_hand_are_no_equal_cycles(seed: int) -> None:
    """Cycles of one peak and one rate whose weights stay for other times: a curve that is missed differs in them."""
    rng = np.random.default_rng(seed)
    weights = np.array([0.2, 0.4, 0.6, 0.8, 1.0, 0.8, 0.6, 0.4, 0.2, 0.0])
    stay = [np.repeat(weights, rng.integers(200, 800, weights.size)) for _ in range(4)]
    load = np.convolve(np.concatenate([np.zeros(300), *stay]), np.ones(20) / 20.0, mode="same")
    prediction = 0.9 * load + 0.1 * lag(load, 0.3, STEP_S)
    residual = 0.01 * load * (1.0 - load) + FLOOR * rng.standard_normal(load.size)
    conditions = Conditions(STEP_S * np.arange(load.size), load, STEP_S)
    assert TESTS["coloured_noise"].evidence(residual, conditions, prediction) is None


@settings(max_examples=6, deadline=None)
@given(seed=st.integers(0, 10**6), strength=st.floats(0.0015, 0.005))
def test_noise_that_grows_with_pressure_is_told_from_jitter(seed: int, strength: float) -> None:
    rng = np.random.default_rng(seed)
    residual = _white(rng) + strength * CASE.prediction * rng.standard_normal(CASE.n)
    evidence = CASE.found(TESTS["heteroscedastic_noise"], residual)
    assert evidence is not None
    assert evidence.strength == pytest.approx(strength, rel=0.25)
    jitter = CASE.found(TESTS["timing_jitter"], residual)
    # Its own false alarms apart: one in a thousand.
    assert jitter is None or jitter.value < 4.0 < evidence.value


@settings(max_examples=6, deadline=None)
@given(seed=st.integers(0, 10**6), jitter_s=st.floats(0.004, 0.008))
def test_jitter_is_told_from_noise_that_grows_with_pressure(seed: int, jitter_s: float) -> None:
    rng = np.random.default_rng(seed)
    moved = np.interp(CASE.time_s + jitter_s * rng.standard_normal(CASE.n), CASE.time_s, CASE.prediction)
    residual = _white(rng) + moved - CASE.prediction
    evidence = CASE.found(TESTS["timing_jitter"], residual)
    assert evidence is not None
    assert evidence.strength == pytest.approx(jitter_s * np.max(np.abs(CASE.slope)), rel=0.25)
    growing = CASE.found(TESTS["heteroscedastic_noise"], residual)
    assert growing is None or growing.value < 4.0 < evidence.value


def test_jitter_within_what_a_time_stamp_leaves_open_is_not_told() -> None:
    rng = np.random.default_rng(5)
    moved = np.interp(CASE.time_s + 0.15 * STEP_S * rng.standard_normal(CASE.n), CASE.time_s, CASE.prediction)
    residual = 0.2 * _white(rng) + moved - CASE.prediction
    assert growing_noise(residual, CASE.prediction, STEP_S, SLOPE) is not None
    assert CASE.found(TESTS["timing_jitter"], residual) is None


def test_ringing_and_a_coarse_lattice_are_no_jitter() -> None:
    rng = np.random.default_rng(8)
    kicks = np.diff(CASE.load, 2, prepend=0.0, append=CASE.load[-1])
    ringing = lfilter([0.5], [1.0, -2.0 * 0.98 * np.cos(0.5), 0.98**2], kicks)
    assert CASE.found(TESTS["timing_jitter"], 0.2 * FLOOR * rng.standard_normal(CASE.n) + ringing) is None
    reading = np.round((CASE.prediction + 0.1 * FLOOR * rng.standard_normal(CASE.n)) / 0.002) * 0.002
    assert CASE.found(TESTS["timing_jitter"], reading - CASE.prediction) is None
    assert CASE.found(TESTS["heteroscedastic_noise"], reading - CASE.prediction) is None


@settings(max_examples=10, deadline=None)
@given(
    seed=st.integers(0, 10**6),
    strength=st.floats(0.0004, 0.003),
    tone_hz=st.one_of(st.floats(49.9, 50.1), st.floats(59.95, 60.05), st.floats(3.0, 47.0), st.floats(179.9, 180.1)),
)
def test_a_tone_is_found_to_a_fraction_of_a_bin(seed: int, strength: float, tone_hz: float) -> None:
    rng = np.random.default_rng(seed)
    residual = _white(rng) + strength * np.sin(2 * np.pi * tone_hz * CASE.time_s + rng.uniform(0, 2 * np.pi))
    logged_hz, bin_hz = hum.alias_hz(tone_hz, STEP_S), 1.0 / (CASE.n * STEP_S)
    nyquist_hz = 0.5 / STEP_S
    if nyquist_hz - logged_hz < 2 * bin_hz:
        return  # as much of the tone as its phase leaves, possibly nothing
    found = hum.Hum().evidence(residual, CASE.conditions, CASE.prediction)
    assert found is not None
    assert found.frequency_hz == pytest.approx(logged_hz, abs=0.25 * bin_hz)
    assert np.hypot(found.cosine, found.sine) == pytest.approx(strength, rel=0.15)
    mains = [frequency for frequency in (50.0, 60.0, 180.0) if abs(frequency - tone_hz) < 0.1]
    assert set(mains) <= set(found.sources)
    cleaned = residual - hum.Hum().apply(
        np.zeros(CASE.n), CASE.conditions, np.array([found.cosine, found.sine, found.frequency_hz])
    )
    assert np.std(cleaned) == pytest.approx(FLOOR, rel=0.05)


def test_a_tone_at_half_the_sampling_rate_is_found() -> None:
    residual = _white(np.random.default_rng(2)) + 0.0005 * np.cos(2 * np.pi * 50.0 * CASE.time_s)
    found = hum.Hum().evidence(residual, CASE.conditions, CASE.prediction)
    assert found is not None
    assert 50.0 in found.sources
    assert found.frequency_hz == pytest.approx(50.0, abs=0.01)


def test_a_tone_that_the_load_has_is_the_loads() -> None:
    tone = np.sin(2 * np.pi * 7.0 * CASE.time_s)
    residual = _white(np.random.default_rng(2)) + 0.001 * tone
    test = partial(hum.Hum().evidence, residual, CASE.conditions)
    assert test(CASE.prediction) is not None
    assert test(CASE.prediction + 0.1 * tone) is None


@pytest.mark.parametrize("order", [2, 3, 5])
def test_a_harmonic_of_the_loads_rhythm_is_what_a_curve_or_a_loop_leaves(order: int) -> None:
    time_s = STEP_S * np.arange(4000)
    load = 0.5 - 0.45 * np.cos(2.0 * np.pi * 1.1 * time_s)
    conditions = Conditions(time_s, load, STEP_S)
    rng = np.random.default_rng(order)

    def tone(of_hz: float) -> np.ndarray:
        return 0.001 * np.cos(2.0 * np.pi * of_hz * time_s + 0.4) + FLOOR * rng.standard_normal(time_s.size)

    assert hum.Hum().evidence(tone(1.1 * order), conditions, load) is None
    assert hum.Hum().evidence(tone(1.1 * (order + 0.5)), conditions, load) is not None


@pytest.mark.parametrize(
    "noise",
    [
        lambda rng: 0.02 * CASE.slope * rng.standard_normal(CASE.n),  # bursts on fast ramps
        lambda rng: 0.002 * np.sin(2 * np.pi * 9.0 * CASE.time_s) * (CASE.slope > 0.15),  # there on some ramps only
        lambda rng: np.round(CASE.prediction / 0.01) * 0.01 - CASE.prediction,  # a lattice passed at an even speed
    ],
    ids=["bursts", "ramps", "lattice"],
)
def test_what_comes_and_goes_is_no_tone(noise: Callable[[np.random.Generator], np.ndarray]) -> None:
    rng = np.random.default_rng(6)
    for _ in range(5):
        assert CASE.found(TESTS["hum"], _white(rng) + noise(rng)) is None


@settings(max_examples=10, deadline=None)
@given(seed=st.integers(0, 10**6), tone_hz=st.floats(4.0, 45.0), quieter=st.floats(0.0, 0.35))
def test_what_is_quieter_while_the_load_rests_is_no_tone(seed: int, tone_hz: float, quieter: float) -> None:
    """Three quarters of the record move, so that it is steady enough; as loud at rest it is a tone."""
    rng = np.random.default_rng(seed)
    case = Case(repeats=6)
    resting = np.abs(np.gradient(case.load, STEP_S)) < 1e-9
    assert 0.1 < resting.mean() < 0.4
    white = FLOOR * rng.standard_normal(case.n)
    tone = 0.004 * np.sin(2.0 * np.pi * tone_hz * case.time_s)
    assert case.found(TESTS["hum"], white + np.where(resting, quieter * tone, tone)) is None
    assert case.found(TESTS["hum"], white + tone) is not None


@pytest.mark.parametrize(
    ("tone_hz", "logged_hz"), [(50.0, 50.0), (60.0, 40.0), (100.0, 0.0), (150.0, 50.0), (180.0, 20.0), (30.0, 30.0)]
)
def test_where_a_tone_comes_out_at_100_hz(tone_hz: float, logged_hz: float) -> None:
    assert hum.alias_hz(tone_hz, 0.01) == pytest.approx(logged_hz)


def test_noise_that_grows_with_the_root_of_the_reading_is_no_jitter() -> None:
    told = {"timing_jitter": 0, "heteroscedastic_noise": 0}
    for seed in range(20):
        rng = np.random.default_rng(seed)
        residual = 0.1 * _white(rng) + 0.02 * np.sqrt(CASE.prediction) * rng.standard_normal(CASE.n)
        for name in told:
            told[name] += CASE.found(TESTS[name], residual) is not None
    assert told == {"timing_jitter": 0, "heteroscedastic_noise": 20}


def test_the_size_of_jitter_is_told_without_an_exponent() -> None:
    prediction = 0.5 - 0.5 * np.cos(2 * np.pi * CASE.time_s / 12.5)
    rng = np.random.default_rng(2)
    residual = _white(rng) + 0.123 * np.gradient(prediction, STEP_S) * rng.standard_normal(CASE.n)
    evidence = TESTS["timing_jitter"].evidence(residual, CASE.conditions, prediction)
    assert evidence is not None
    assert evidence.says == "the noise grows with the slope of the reading, as from 120 ms of jitter in the sampling"
