"""Protocols stay within their load and show what they are for; nuisances are projected out; lags are lags."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from test_diagnosis_parts import recording, sessions_of

from smartshoe.diagnosis._experiments import EXPERIMENTS, multisine, shuffled_loads
from smartshoe.diagnosis._sensitivity import marginal, nuisances
from smartshoe.models.extended import ExtendedModel
from smartshoe.signals.lags import lagged

UNIT = ExtendedModel(1.0, 0.3, 0.25, 800.0, 140.0, "mbar", (), 1.5)


@pytest.mark.parametrize("name", EXPERIMENTS)
def test_a_protocol_begins_and_ends_unloaded_and_never_leaves_its_load(name: str) -> None:
    protocol = EXPERIMENTS[name](640.0)
    time_s, load_n = protocol.corners()
    assert (load_n[0], load_n[-1]) == (0.0, 0.0)
    assert load_n.min() >= 0.0
    assert 0.9 * 640.0 <= load_n.max() <= 640.0 + 1e-9
    assert (np.diff(time_s) > 0.0).all()


def test_the_multisine_has_eleven_sines_of_one_size_about_half_the_load() -> None:
    protocol = multisine(800.0)
    start_s = 5.0  # a rest and the way up
    time_s = start_s + np.arange(0.0, 119.0, 0.02)
    load_n = protocol.load_at(time_s)
    frequency_hz = np.geomspace(0.02, 2.0, 11)
    waves = [np.exp(2j * np.pi * frequency * (time_s - start_s)) for frequency in frequency_hz]
    columns = np.column_stack([np.ones(time_s.size), *(part for wave in waves for part in (wave.real, wave.imag))])
    found = np.linalg.lstsq(columns, load_n, rcond=None)[0]
    sizes = np.hypot(found[1::2], found[2::2])
    assert found[0] == pytest.approx(400.0, abs=20.0)
    assert sizes.min() > 0.85 * sizes.max()  # straight lines between samples take something of the quickest
    # Eleven sines in phase would peak at eleven times one of them; Schroeder's phases, made for harmonics, at seven.
    assert np.ptp(load_n) / 2.0 < 8.0 * sizes.mean()


def test_shuffled_loads_have_no_trend_and_follow_small_and_large_ones_alike() -> None:
    _, load_n = shuffled_loads(1.0).corners()
    peaks = load_n[1:-1][(load_n[1:-1] > load_n[:-2]) & (load_n[1:-1] > load_n[2:])]
    assert peaks.size == 16
    assert abs(np.corrcoef(np.arange(16), peaks)[0, 1]) < 0.15
    assert (np.diff(peaks) != 0.0).all()


def test_the_nuisances_are_projected_out() -> None:
    session = sessions_of(recording(seed=1))[0][0]
    rows = np.random.default_rng(1).standard_normal((session.reading.size, 4))
    beside = nuisances(session, UNIT.relaxation_rate_per_s)[session.fitted]
    seen = rows[session.fitted]
    left = seen - beside @ np.linalg.lstsq(beside, seen, rcond=None)[0]
    assert marginal(rows, session, UNIT.relaxation_rate_per_s) == pytest.approx(left.T @ left, rel=1e-6, abs=1e-6)


def test_the_memory_from_before_the_recording_fades_from_its_first_sample() -> None:
    session = sessions_of(recording(seed=1))[0][0]
    late = replace(session, conditions=replace(session.conditions, time_s=session.conditions.time_s + 1000.0))
    early, shifted = (nuisances(one, UNIT.relaxation_rate_per_s)[:, 1] for one in (session, late))
    assert early[0] == shifted[0] == 1.0
    assert shifted == pytest.approx(early, rel=1e-9)


@settings(max_examples=20)
@given(st.floats(0.05, 5.0), st.floats(-3.0, 3.0), st.floats(-2.0, 2.0))
def test_a_lag_holds_a_hold_and_follows_a_ramp_late_by_its_time(tau_s: float, level: float, slope: float) -> None:
    step_s = 0.01
    time_s = np.arange(0.0, 30.0 * tau_s, step_s)
    assert lagged(np.full(50, level), step_s, tau_s) == pytest.approx(np.full(50, level), abs=1e-12)
    late = slope * time_s - lagged(slope * time_s, step_s, tau_s)
    # Of a sampled lag: step/(e^(step/tau) - 1) for the time constant.
    assert late[-1] == pytest.approx(slope * step_s / np.expm1(step_s / tau_s), rel=1e-6, abs=1e-9)
