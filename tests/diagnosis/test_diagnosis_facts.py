"""Facts that the diagnosis's parts state about data whose answer is known without them."""

from __future__ import annotations

import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import lfilter
from test_diagnosis_parts import MODEL, recording, sessions_of

from smartshoe.diagnosis import Thresholds
from smartshoe.diagnosis._baseline import baseline_of
from smartshoe.diagnosis._characteristic import characteristic_of
from smartshoe.diagnosis._evidence import Evidence
from smartshoe.diagnosis._gauss_markov import gauss_markov_of
from smartshoe.diagnosis._inference import independent_count
from smartshoe.diagnosis._lack_of_fit import slow_structure
from smartshoe.diagnosis._residual_structure import worst_place
from smartshoe.diagnosis._session import Session
from smartshoe.diagnosis._zero import offsets
from smartshoe.diagnosis.decay import decay_of
from smartshoe.recording import Recording


@pytest.fixture(scope="module")
def sessions() -> list[Session]:
    return sessions_of(recording(seed=1), recording(seed=2), recording(seed=3))[0]


@pytest.mark.parametrize("share", [0.1, 0.6])
def test_the_baseline_of_a_linear_solid_is_that_solid(share: float) -> None:
    truth = replace(MODEL, relaxing_share=share, relaxation_rate_per_s=0.3)
    found = baseline_of(*sessions_of(recording(truth, noise=0.0)))
    assert found.relaxing_share == pytest.approx(share, rel=0.1)
    assert found.relaxation_rate_per_s == pytest.approx(0.3, rel=0.15)  # the grid's neighbours are 1.2 apart


def test_a_zero_that_is_moved_is_the_recordings_own_offset() -> None:
    plain = recording(seed=1)
    moved = Recording.from_arrays(
        time_s=plain.time_s, force_n=plain.force_n, pressure_mbar=plain.sensor.values + 7.0, name="moved"
    )
    both, scale = sessions_of(plain, moved)
    found = offsets(both, baseline_of(both, scale)) * scale.reading
    assert found[1] - found[0] == pytest.approx(7.0, abs=0.01)


def test_of_a_single_recording_each_load_cycle_can_be_left_out() -> None:
    """And of several each recording."""
    assert independent_count(sessions_of(recording(rates=(200, 800)))[0], Thresholds()) == 6
    assert independent_count(sessions_of(recording(seed=1), recording(seed=2))[0], Thresholds()) == 2


def test_cycles_are_counted_of_a_load_that_moves_by_a_part_of_the_largest() -> None:
    (session,), _ = sessions_of(recording(rates=(200, 800)))
    shallow = replace(session.conditions, load=0.7 + 0.05 * session.conditions.load)
    assert independent_count([replace(session, conditions=shallow)], Thresholds()) == 6


@given(st.integers(0, 999), st.integers(1, 5))
@settings(max_examples=15)
def test_evidence_is_that_of_gaussian_data(seed: int, members: int) -> None:
    """-2 log of the density of y ~ N(0, 1 + X S^2 X'), by its own matrix, but for a constant."""
    rng = np.random.default_rng(seed)
    columns, y, sds = rng.standard_normal((30, 6)), rng.standard_normal(30), rng.uniform(0.1, 3.0, members)
    index = rng.permutation(6)[:members]
    together = np.column_stack([y, columns])
    known = SimpleNamespace(_reduced=together.T @ together)
    _, _, fall = Evidence._solve(known, index + 1, sds)  # type: ignore[arg-type]
    own = columns[:, index] * sds
    covariance = np.eye(30) + own @ own.T
    assert y @ y - fall == pytest.approx(
        y @ np.linalg.solve(covariance, y) + np.linalg.slogdet(covariance)[1], rel=1e-9
    )


@settings(max_examples=6)
@given(st.integers(0, 999), st.floats(0.5, 2.0))
def test_what_a_slow_noise_amounts_to_does_not_depend_on_white_noise_beside_it(
    sessions: list[Session], seed: int, tau_s: float
) -> None:
    rng, rms, residuals = np.random.default_rng(seed), 0.01, []
    for session in sessions:
        n, step_s = session.reading.size, session.conditions.step_s
        keep = float(np.exp(-step_s / tau_s))
        slow_part = lfilter([1.0], [1.0, -keep], np.sqrt(1 - keep**2) * rng.standard_normal(n + 500))[500:]
        # As large as the slow one in the means that are looked at.
        residuals.append(rms * slow_part + rms * np.sqrt(Thresholds().sensor_lag_s / step_s) * rng.standard_normal(n))
    found = gauss_markov_of(sessions, residuals, Thresholds())
    assert found is not None
    assert found.rms == pytest.approx(rms, rel=0.5)


def test_noise_that_is_louder_in_parts_is_no_structure(sessions: list[Session]) -> None:
    rng = np.random.default_rng(5)
    found = []
    for session in sessions:
        loud = np.where(np.arange(session.reading.size) // 200 % 2 == 0, 1.0, 4.0)
        found.append(0.001 * loud * rng.standard_normal(loud.size))
    assert abs(slow_structure(sessions, found, Thresholds(hold_s=1.0)).z) < 4.0
    sines = [0.002 * np.sin(2 * np.pi * session.conditions.time_s / 20.0) for session in sessions]
    both = [noise + sine for noise, sine in zip(found, sines, strict=True)]
    assert slow_structure(sessions, both, Thresholds(hold_s=1.0)).rms == pytest.approx(0.002 / np.sqrt(2), rel=0.15)


def test_it_is_said_where_the_slow_part_is_not_where_samples_jump(sessions: list[Session]) -> None:
    quiet, drifting, jumping = (np.zeros(session.reading.size) for session in sessions)
    drifting += 0.012
    jumping += 0.05 * (-1.0) ** np.arange(jumping.size)
    said = worst_place(sessions, [quiet, drifting, jumping], Thresholds())
    assert f"; the worst stretch is {sessions[1].recording.name}, " in said


def test_branches_of_fast_strokes_are_told_by_a_short_echo() -> None:
    """Friction, at strokes of 0.6 s: the load's direction is looked at over half of the echo."""
    time_s = np.arange(0.0, 60.0, 0.01)
    load = 100.0 * (2.0 * np.abs(2.0 * (time_s / 0.6 % 1.0) - 1.0) - 1.0)
    lasting_memory = Recording.from_arrays(time_s=time_s, force_n=load, pressure_mbar=5.0 * np.sign(np.gradient(load)))
    said = characteristic_of(lasting_memory, Thresholds(echo_s=1 / 12))
    assert said is not None
    assert float(re.findall(r"lies ([\d.]+) mbar above", said)[0]) == pytest.approx(5.0, rel=0.02)


@pytest.mark.parametrize(("order", "words"), [(1.0, ", as one exponential:"), (1.6, ", slower than exponentially")])
def test_by_which_law_a_reading_falls_is_said(order: float, words: str) -> None:
    time_s = np.arange(0.0, 100.0, 0.05)
    base = np.exp(-time_s / 20.0) if order == 1.0 else (1.0 + (order - 1.0) * time_s / 20.0) ** (-1.0 / (order - 1.0))
    noise = 0.1 * np.random.default_rng(1).standard_normal(time_s.size)
    found = decay_of(Recording.from_arrays(time_s=time_s, pressure_mbar=200.0 * base + noise))
    assert found is not None
    assert words in found.says
