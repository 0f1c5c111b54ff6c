"""Slow noise is told as noise, and what only looks like it is not; a jittered clock smooths what it samples."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import lfilter
from test_diagnosis_parts import RATE_HZ, recording, sessions_of
from test_long_recordings import plain, told_of

from smartshoe.diagnosis import Thresholds, _gauss_markov
from smartshoe.diagnosis._gauss_markov import _covariance, gauss_markov_of
from smartshoe.diagnosis._jittered import jitter_s, with_sampling_jitter
from smartshoe.diagnosis._residual_structure import residual_structure
from smartshoe.diagnosis._session import Session

NOISE = 0.001
STANDARD = Thresholds()


@pytest.fixture(scope="module")
def sessions() -> list[Session]:
    return sessions_of(recording(seed=1), recording(seed=2), recording(seed=3))[0]


def noises(sessions: list[Session], seed: int, tau_s: float = 0.0, rms: float = 0.0) -> list[np.ndarray]:
    """White noise and noise that remembers, (n,) a session."""
    rng = np.random.default_rng(seed)
    out = []
    for session in sessions:
        n, step_s = session.reading.size, session.conditions.step_s
        keep = float(np.exp(-step_s / tau_s)) if tau_s > 0.0 else 0.0
        drawn = np.sqrt(1.0 - keep**2) * rng.standard_normal(n + 2000)
        out.append(NOISE * rng.standard_normal(n) + rms * lfilter([1.0], [1.0, -keep], drawn)[2000:])
    return out


@settings(max_examples=8, deadline=None)
@given(st.integers(0, 999), st.floats(0.3, 2.0), st.floats(0.003, 0.05))
def test_first_order_noise_is_noise_however_strong(sessions, seed, tau_s, rms):
    residuals = noises(sessions, seed, tau_s, rms)
    found = gauss_markov_of(sessions, residuals, STANDARD)
    assert found is not None
    assert found.is_noise
    assert found.rms == pytest.approx(rms, rel=0.4)
    assert not residual_structure(sessions, residuals, STANDARD).significant


@pytest.mark.parametrize("tau_s", [0.4, 1.0])
def test_the_size_of_slow_noise_is_that_of_its_part_which_remembers(sessions, tau_s):
    """However soon it forgets, and however loud the white noise beside it is."""
    width = round(STANDARD.sensor_lag_s / sessions[0].conditions.step_s)
    ratios = []
    for seed in range(6):
        residuals = noises(sessions, seed, tau_s, 0.01)
        white = noises(sessions, seed + 100)
        found = gauss_markov_of(sessions, residuals, STANDARD)
        with_white = gauss_markov_of(
            sessions, [one + 8.0 * more for one, more in zip(residuals, white, strict=True)], STANDARD
        )
        assert found is not None
        assert with_white is not None
        means = [one[: one.size // width * width].reshape(-1, width).mean(axis=1) for one in residuals]
        rms = float(np.sqrt(np.mean(np.concatenate(means) ** 2)))
        ratios.append([found.rms / rms, with_white.rms / rms])
    assert np.mean(ratios, axis=0) == pytest.approx(1.0, abs=0.1)


@settings(max_examples=8, deadline=None)
@given(st.integers(0, 999), st.floats(0.01, 0.05))
def test_noise_that_grows_with_the_load_remembers_nothing(sessions, seed, loudest):
    """White noise of any loudness: neighbours agree by chance alone (White 1980)."""
    rng = np.random.default_rng(seed)
    residuals = [loudest * one.conditions.load**3 * rng.standard_normal(one.reading.size) for one in sessions]
    found = gauss_markov_of(sessions, residuals, STANDARD)
    assert found is not None
    assert not found.is_noise  # its loudness follows the load
    assert found.rms < 0.05 * loudest


def test_what_swings_is_foretold_though_neighbours_disagree(sessions):
    """A sawtooth of 3 Hz while the load moves: blocks of a fifth of a second alternate."""
    size = 0.01
    residuals = []
    for one, noise in zip(sessions, noises(sessions, 5), strict=True):
        moving = np.abs(one.conditions.rate_per_s) > STANDARD.still_per_s
        residuals.append(noise + size * moving * (2.0 * np.mod(3.1 * one.conditions.time_s, 1.0) - 1.0))
    found = gauss_markov_of(sessions, residuals, STANDARD)
    assert found is not None
    assert not found.is_noise
    assert found.rms > 0.1 * size
    assert residual_structure(sessions, residuals, STANDARD).significant


@pytest.mark.parametrize("tau_s", [0.4, 1.0])
def test_a_mean_of_slow_noise_is_known_by_how_often_it_forgets(sessions, tau_s):
    """Means over many memories scatter as first-order noise's do; one within a memory is a sample."""
    found = gauss_markov_of(sessions, noises(sessions, 3, tau_s, 0.01), STANDARD)
    assert found is not None
    rng, step_s = np.random.default_rng(8), 0.02
    keep = float(np.exp(-step_s / found.tau_s))
    slow = found.rms * np.sqrt(1.0 - keep**2) * lfilter([1.0], [1.0, -keep], rng.standard_normal(400_000))
    means = slow.reshape(-1, round(20.0 * tau_s / step_s)).mean(axis=1)
    assert found.sd_of_mean(20.0 * tau_s) == pytest.approx(float(means.std()), rel=0.1)
    assert found.sd_of_mean(0.01 * tau_s) == found.rms


@pytest.mark.parametrize("step_s", [0.02, 0.1, 0.25, 1.0])
@pytest.mark.parametrize("echo_s", [1e-9, 0.1])
def test_a_memory_is_looked_for_over_what_lasts_at_any_pace(
    monkeypatch: pytest.MonkeyPatch, step_s: float, echo_s: float
) -> None:
    """Six seconds, of blocks of a sensor's lag, or of a sample where that is longer."""
    asked = []
    monkeypatch.setattr(_gauss_markov, "_covariance", lambda *given: asked.append(given[1]) or _covariance(*given))
    (session,) = sessions_of(recording(seed=1))[0]
    conditions = replace(session.conditions, step_s=step_s)
    found = gauss_markov_of(
        [replace(session, conditions=conditions)], noises([session], 1), replace(STANDARD, echo_s=echo_s)
    )
    assert found is not None
    assert asked == [round(6.0 / max(step_s, 2.0 * echo_s))]


def test_where_nothing_lasts_one_block_is_remembered(sessions: list[Session]) -> None:
    found = gauss_markov_of(sessions, noises(sessions, 1, 1.0, 0.01), replace(STANDARD, hold_s=1e-9))
    assert found is not None
    assert not found.is_noise


def averaged(rng: np.random.Generator, size: int, step_s: float, length_s: float) -> np.ndarray:
    """White noise through a running mean, of unit variance."""
    width = round(length_s / step_s)
    return np.convolve(rng.standard_normal(size + width - 1), np.ones(width), "valid") / np.sqrt(width)


def shaken(rng: np.random.Generator, size: int, step_s: float, period_s: float) -> np.ndarray:
    """A broad band about one frequency, a third of critical damping, of unit variance."""
    angle = 2.0 * np.pi * step_s / period_s
    radius = np.exp(-0.3 * angle)
    out = lfilter([1.0], [1.0, -2.0 * radius * np.cos(angle), radius**2], rng.standard_normal(size + 2000))[2000:]
    return out / out.std()


@pytest.mark.parametrize("drawn", [averaged, shaken])
@settings(max_examples=4, deadline=None)
@given(st.integers(0, 999), st.floats(0.5, 2.0), st.floats(0.003, 0.05))
def test_noise_of_any_spectrum_is_noise(sessions, drawn, seed, memory_s, rms):
    rng = np.random.default_rng(seed + 1)
    residuals = [
        noise + rms * drawn(rng, noise.size, one.conditions.step_s, memory_s)
        for noise, one in zip(noises(sessions, seed), sessions, strict=True)
    ]
    found = gauss_markov_of(sessions, residuals, STANDARD)
    assert found is not None
    assert found.is_noise
    assert not residual_structure(sessions, residuals, STANDARD).significant


def switching(session: Session, rng: np.random.Generator) -> np.ndarray:
    step_s = session.conditions.step_s
    return np.where(np.cumsum(rng.random(session.reading.size) < step_s / 3.0) % 2 == 0, -1.0, 1.0)


def sine(session: Session, rng: np.random.Generator) -> np.ndarray:
    return np.sqrt(2.0) * np.sin(2 * np.pi * session.conditions.time_s / 20.0 + rng.uniform(0, 6))


def seated(session: Session, rng: np.random.Generator) -> np.ndarray:
    return 2.0 * session.conditions.load * rng.standard_normal(int(session.cycle[-1]) + 1)[session.cycle]


@pytest.mark.parametrize("unknown", [switching, sine, seated])
def test_an_unknown_effect_is_no_noise(sessions, unknown):
    rng = np.random.default_rng(4)
    residuals = [noise + 0.01 * unknown(one, rng) for noise, one in zip(noises(sessions, 4), sessions, strict=True)]
    found, left = gauss_markov_of(sessions, residuals, STANDARD), residual_structure(sessions, residuals, STANDARD)
    assert found is not None
    assert not found.is_noise
    assert left.significant
    assert not left.is_noise
    assert found.switches == (unknown is switching)
    assert ("switches between two levels" in left.says) == (unknown is switching)


def test_too_little_tells_nothing(sessions):
    assert gauss_markov_of([], [], STANDARD) is None
    assert gauss_markov_of(sessions, [np.zeros(one.reading.size) for one in sessions], STANDARD) is None


# -- jitter ------------------------------------------------------------------------------------------------------------
@settings(max_examples=6, deadline=None)
@given(st.integers(0, 999), st.floats(0.04, 0.08))
def test_jitter_is_known_by_its_noise_and_smooths_as_it_does(seed, truth_s):
    rng = np.random.default_rng(seed)
    clean = recording(noise=0.0)
    t, load = clean.time_s, clean.force_n / 800.0
    reading = np.interp(t + truth_s * rng.standard_normal(t.size), t, load) + NOISE * rng.standard_normal(t.size)
    assert jitter_s(load, reading, 1 / RATE_HZ) == pytest.approx(truth_s, rel=0.2)
    left = np.convolve(reading - with_sampling_jitter(load, reading, 1 / RATE_HZ, STANDARD), np.ones(25) / 25, "valid")
    unsmoothed = np.convolve(reading - load, np.ones(25) / 25, "valid")
    assert np.std(left) < 1.01 * np.std(unsmoothed)


def test_without_jitter_the_load_stays_as_it_is():
    one = recording(noise=NOISE)
    load, reading = one.force_n / 800.0, one.sensor.values / 140.0
    assert with_sampling_jitter(load, reading, 1 / RATE_HZ, STANDARD) is load


@pytest.mark.parametrize("louder", [1.25, 1.4])
def test_slow_noise_that_is_louder_as_the_load_moves_is_structure_by_what_it_is_louder(
    sessions: list[Session], louder: float
) -> None:
    """While the load is held it is the noise that is there all along."""
    moves = [np.where(np.abs(one.conditions.rate_per_s) < STANDARD.still_per_s, 1.0, louder) for one in sessions]
    told = []
    for seed in range(6):
        plain = noises(sessions, seed, 0.5, 0.01)
        found = gauss_markov_of(sessions, [by * one for by, one in zip(moves, plain, strict=True)], STANDARD)
        assert found is not None
        quiet = gauss_markov_of(sessions, plain, STANDARD)
        assert quiet is not None
        assert quiet.beyond_noise == 0.0
        if not found.is_noise:  # as it may be where it is hardly louder
            told.append((found.beyond_noise, found.rms, quiet.rms))
    assert len(told) >= 3
    beyond, whole, noise = np.sqrt(np.mean(np.square(told), axis=0))
    assert beyond == pytest.approx(np.sqrt(whole**2 - noise**2), rel=0.35)
    assert beyond < 0.8 * whole


def test_what_switches_is_structure_though_it_does_so_while_the_load_is_held(sessions: list[Session]) -> None:
    rng = np.random.default_rng(5)
    levels = [
        0.01 * np.sign(np.repeat(rng.standard_normal(one.reading.size // 40 + 1), 40)[: one.reading.size])
        for one in sessions
    ]
    found = gauss_markov_of(sessions, [a + b for a, b in zip(levels, noises(sessions, 3), strict=True)], STANDARD)
    assert found is not None
    assert not found.is_noise
    assert found.beyond_noise == found.rms > 0.005


@pytest.mark.parametrize("stride", [5, 20])
def test_white_noise_of_a_slow_log_is_white_and_no_effect(stride: int) -> None:
    """The average that a log passes before it is thinned spans several samples at 20 or 5 Hz, and correlates them."""
    found = told_of(plain, stride=stride, noise_mbar=0.4)
    assert found.verdict == "adequate"
    assert found.data_faults == ()
