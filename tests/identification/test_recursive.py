"""Recursive identification: the same estimate as over the whole recording, however the stream is cut."""

from __future__ import annotations

from contextlib import suppress
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from presses import TOE, press

from smartshoe.errors import NotIdentifiableError, UsageError
from smartshoe.identification import identify
from smartshoe.identification._sufficient_statistics import BANK, FASTEST, SLOWEST, bank_weights
from smartshoe.identification.recursive import RecursiveIdentification
from smartshoe.kernels.pole_bank import lag_bank
from smartshoe.models import simulate
from smartshoe.models.first_order import lag
from smartshoe.recording import Recording

SD = 1e-4  # of the standard deviation: far above interpolation (1e-9 of the signal), far below what matters


def signals(recording: Recording) -> tuple[np.ndarray, np.ndarray]:
    """Load and reading as logged, NaN where missing."""
    load = np.where(recording.load.present, recording.force_n, np.nan)
    return load, np.where(recording.sensor.present, recording.sensor.values, np.nan)


def streamed(recordings: list[Recording], **choices: object) -> RecursiveIdentification:
    session = RecursiveIdentification(sample_rate_hz=100.0, unit="left_toe", **choices)
    for index, recording in enumerate(recordings):
        session.start_experiment(f"{index}")
        session.push(*signals(recording))
    return session


def require_same(recordings: list[Recording], **choices: object) -> None:
    whole = identify(recordings, delay=0.0, estimator="output_error", tolerance=1e-12, **choices)
    found = streamed(recordings, **choices).estimate()
    assert list(found.parameters) == list(whole.parameters)
    for name, parameter in whole.parameters.items():
        assert abs(found.parameters[name].value - parameter.value) < SD * parameter.sd, name
        assert found.parameters[name].sd == pytest.approx(parameter.sd, rel=SD), name
        assert found.parameters[name].unit == parameter.unit
    sd = np.sqrt(np.diag(whole.covariance))
    assert found.covariance / np.outer(sd, sd) == pytest.approx(whole.covariance / np.outer(sd, sd), abs=SD)
    pairs = [(found.offsets, whole.offsets), (found.initial_states, whole.initial_states)]
    for mine, other in pairs:
        for one, two in zip(mine.values(), other.values(), strict=True):
            assert abs(one.value - two.value) <= SD * two.sd
            assert one.sd == pytest.approx(two.sd, rel=SD)
    assert found.rmse == pytest.approx(whole.rmse, rel=1e-8)
    assert found.fit_percent == pytest.approx(whole.fit_percent, abs=1e-7)
    assert (found.n_samples, found.n_missing) == (whole.n_samples, whole.n_missing)
    assert found.compensator().offset == pytest.approx(whole.compensator().offset, abs=1e-4)


@pytest.mark.parametrize("direction", ["inverse", "forward"])
@pytest.mark.parametrize("pole", [0.02, 0.215, 50.0])
def test_the_stream_gives_what_the_whole_gives(direction: str, pole: float) -> None:
    k1, k2, _ = TOE
    noise = {"load_noise" if direction == "inverse" else "reading_noise": 2.23 if pole == 0.215 else 0.05}
    require_same([press((k1, k2, k2 / pole), offset=4.0, start_s=5.0, **noise)], direction=direction)


@pytest.mark.parametrize("direction", ["inverse", "forward"])
def test_several_experiments_have_offsets_and_starts_of_their_own(direction: str) -> None:
    noise = {"load_noise": 1.0} if direction == "inverse" else {"reading_noise": 1.0}
    one, two = press(offset=4.0, start_s=5.0, **noise), press(offset=-2.0, start_s=3.0, seed=1, **noise)
    require_same([one, two], direction=direction)


@pytest.mark.parametrize("direction", ["inverse", "forward"])
def test_an_experiment_of_a_second_counts_beside_a_long_one(direction: str) -> None:
    noise = {"load_noise": 1.0} if direction == "inverse" else {"reading_noise": 1.0}
    long = press(offset=4.0, start_s=5.0, **noise)
    require_same([long.between(8.0, 9.0), long], direction=direction)


@pytest.mark.parametrize("direction", ["inverse", "forward"])
def test_what_is_fixed_stays_fixed(direction: str) -> None:
    noise = {"load_noise": 1.0} if direction == "inverse" else {"reading_noise": 1.0}
    require_same([press(offset=4.0, **noise)], direction=direction, offset=4.0, initial_state="steady")


@pytest.mark.parametrize("direction", ["inverse", "forward"])
def test_missing_samples_are_bridged_as_in_the_whole(direction: str) -> None:
    clean = press(offset=3.0, load_noise=1.0, reading_noise=0.1)
    load, reading = clean.force_n.copy(), clean.sensor.values.copy()
    rng = np.random.default_rng(3)
    load[rng.random(load.size) < 0.05] = np.nan
    reading[rng.random(load.size) < 0.05] = np.nan
    load[:7], reading[:4], reading[900:1100], load[1500:1520], reading[-5:] = (np.nan,) * 5
    broken = Recording.from_arrays(time_s=clean.time_s, force_n=load, pressure_mbar=reading)
    require_same([broken], direction=direction)


@given(cuts=st.lists(st.integers(0, 2900), max_size=12), singles=st.integers(0, 40), asked=st.booleans())
@settings(max_examples=12, deadline=None)
def test_how_the_stream_is_cut_makes_no_difference(cuts: list[int], singles: int, asked: bool) -> None:
    load, reading = signals(press(load_noise=1.0, offset=2.0, gap=slice(1000, 1050)))
    whole = RecursiveIdentification(sample_rate_hz=100.0)
    whole.push(load, reading)
    parts = RecursiveIdentification(sample_rate_hz=100.0)
    for k in range(singles):
        parts.push(float(load[k]), float(reading[k]))
    places = [singles, *sorted(max(cut, singles) for cut in cuts), load.size]
    for begin, end in pairwise(places):
        parts.push(load[begin:end], reading[begin:end])
        if asked:  # an estimate on the way leaves the rest as it is
            with suppress(NotIdentifiableError):
                parts.estimate()
    one, other = whole.estimate(), parts.estimate()
    assert one.parameters == other.parameters
    assert np.array_equal(one.covariance, other.covariance)


def test_error_bars_shrink_with_the_root_of_the_samples() -> None:
    repeats = [press(load_noise=2.0, offset=1.0, seed=seed) for seed in range(8)]
    few, many = streamed(repeats[:2]).estimate(), streamed(repeats).estimate()
    for name in ("a1", "b0", "b1"):
        # Information adds up; what differs is the noise as estimated, good to 1/sqrt(2 n) = 1 %, and the slopes at a1.
        assert few.parameters[name].sd / many.parameters[name].sd == pytest.approx(2.0, rel=0.05), name


def test_memory_does_not_grow_with_the_samples() -> None:
    session = RecursiveIdentification(sample_rate_hz=100.0)
    time_s = np.arange(0.0, 1280.0, 0.01)
    reading = 300.0 * (1.0 - np.abs((time_s / 5.0) % 2.0 - 1.0))
    force_n = simulate(0.2, 1.6, 0.3, reading, time_s) + np.random.default_rng(0).normal(0.0, 2.0, time_s.size)
    sd, held = [], []
    for part in (slice(0, 8_000), slice(8_000, 32_000), slice(32_000, 128_000)):
        session.push(force_n[part], reading[part])
        a1 = session.estimate().parameters["a1"]
        assert abs(a1.value - 0.2) < 5 * a1.sd
        sd.append(a1.sd)
        held.append(session.state_bytes)
    assert sd == sorted(sd, reverse=True)
    assert held[0] == held[1] == held[2]


@pytest.mark.parametrize(
    ("load", "reading", "says"),
    [
        ([1.0], [2.0], "1 samples"),
        (np.full(100, 5.0), np.arange(100.0), "load is constant"),
        (np.arange(100.0), np.full(100, 5.0), "reading is constant"),
        (np.arange(100.0), np.arange(100.0), "has not fallen"),
        (-np.arange(100.0), -np.arange(100.0), "has not risen"),
        (
            np.sin(np.arange(1000) / 300) + np.random.default_rng(2).normal(0, 0.01, 1000),
            np.sin(np.arange(1000) / 300),
            "relaxation",
        ),
        (np.random.default_rng(0).normal(size=1000), np.random.default_rng(1).normal(size=1000), "does not follow"),
    ],
)
def test_what_is_missing_so_far_is_named(load: np.ndarray, reading: np.ndarray, says: str) -> None:
    session = RecursiveIdentification(sample_rate_hz=100.0)
    session.push(load, reading)
    with pytest.raises(NotIdentifiableError, match=says):
        session.estimate()


def test_nothing_pushed_is_refused_too() -> None:
    with pytest.raises(NotIdentifiableError, match="0 samples"):
        RecursiveIdentification(sample_rate_hz=100.0).compensator()


@pytest.mark.parametrize(
    "wrong",
    [{"direction": "up"}, {"delay_s": 0.1}, {"offset": "free"}, {"initial_state": "rest"}, {"scale": 0.0}],
)
def test_wrong_choices_are_named(wrong: dict[str, object]) -> None:
    with pytest.raises(UsageError, match=next(iter(wrong))):
        RecursiveIdentification(sample_rate_hz=100.0, **wrong)


def test_wrong_calls_are_named() -> None:
    session = RecursiveIdentification(sample_rate_hz=100.0)
    with pytest.raises(UsageError, match="shape"):
        session.push([1.0, 2.0], [1.0])
    session.push(1.0, 1.0)
    with pytest.raises(UsageError, match="already"):
        session.start_experiment("experiment 1")


@given(ln_alpha=st.floats(np.log(0.02), np.log(50.0)), seed=st.integers(0, 1000))
@settings(max_examples=25, deadline=None)
def test_the_bank_holds_every_lag_between_its_poles(ln_alpha: float, seed: int) -> None:
    assert (BANK.max(), BANK.min()) == pytest.approx((FASTEST, SLOWEST))
    u = np.cumsum(np.random.default_rng(seed).normal(size=400))
    gaps = np.random.default_rng(seed).random(400) < 0.8
    gaps[[0, -1]] = True
    at = np.flatnonzero(gaps)
    out, lags = np.empty((at.size, BANK.size)), np.full(BANK.size, u[0])
    lag_bank(u[at], at, BANK, 0.01, u[0], -1, lags, out)
    bridged = np.interp(np.arange(400), at, u[at])
    truth = lag(bridged, float(np.exp(ln_alpha)), 0.01)[at]
    weights, slopes = bank_weights(ln_alpha)
    np.testing.assert_allclose(out @ weights, truth, rtol=0, atol=1e-7 * np.max(np.abs(u)))
    ahead, behind = bank_weights(ln_alpha + 1e-4)[0], bank_weights(ln_alpha - 1e-4)[0]
    np.testing.assert_allclose(out @ slopes, out @ (ahead - behind) / 2e-4, rtol=0, atol=1e-5 * np.max(np.abs(u)))
