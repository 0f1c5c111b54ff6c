"""A reading that falls without a moving load: time constant, share lost, and the law of its fall."""

from __future__ import annotations

import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.signal import lfilter

from smartshoe.diagnosis import Thresholds
from smartshoe.diagnosis.decay import Decay, decay_of
from smartshoe.errors import UsageError
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
    assert "too little of the fall is seen" in decay.says
    # Nor where it began: it is a straight line from the first sample on.
    assert decay.from_start_s == decay.tau_s
    assert " from " not in decay.says


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
    assert "only a logged load can tell which" in _found(falling).says
    assert "no load that stands still can tell which" in _found(falling, np.full(TIME_S.size, 500.0)).says


def _said(text: str, pattern: str) -> float:
    (number,) = re.findall(pattern, text)
    return float(number)


@pytest.mark.parametrize(
    ("tau_s", "words"), [(200.0, "200 s"), (1200.0, "20 min"), (6000.0, "100 min"), (12_600.0, "3.5 h")]
)
def test_a_time_constant_is_told_in_seconds_minutes_or_hours(tau_s: float, words: str) -> None:
    time_s = tau_s / 100.0 * TIME_S[::2]
    reading = 100.0 * np.exp(-time_s / tau_s)
    decay = decay_of(Recording.from_arrays(time_s=time_s, pressure_mbar=reading))
    assert decay is not None
    assert f"with a time constant of {words}" in decay.says


def test_what_is_lost_and_within_which_time_is_said_from_the_onset() -> None:
    waits_s, tau_s = 30.0, 20.0
    decay = _found(200.0 * np.exp(-np.maximum(TIME_S - waits_s, 0.0) / tau_s))
    last = 100.0 * (1.0 - np.exp(-(TIME_S[-1] - waits_s) / tau_s))
    assert decay.lost_percent == pytest.approx(last, abs=1.5)
    assert decay.onset_s == pytest.approx(waits_s, abs=2.0)
    assert decay.within_s == pytest.approx(TIME_S[-1] - decay.onset_s, abs=0.5)
    assert decay.from_start_s > 1.5 * decay.tau_s
    assert _said(decay.says, r"falls by ([\d.]+) %") == pytest.approx(decay.lost_percent, abs=0.1)
    assert _said(decay.says, r" in ([\d.]+) s from") == pytest.approx(decay.within_s, abs=0.1)
    assert _said(decay.says, r"from ([\d.]+) s on") == pytest.approx(decay.onset_s, abs=0.1)
    assert _said(decay.says, r"\(([\d.]+) s when counted from the first sample") == pytest.approx(
        decay.from_start_s, abs=0.1
    )
    at_once = _found(200.0 * np.exp(-TIME_S / tau_s))
    assert at_once.from_start_s == pytest.approx(at_once.tau_s, rel=0.02)
    assert "counted from" not in at_once.says
    assert " s on" not in at_once.says


def test_a_plateau_is_said_in_the_readings_unit() -> None:
    decay = _found(80.0 + 20.0 * np.exp(-TIME_S / 15.0))
    assert _said(decay.says, r"towards ([\d.]+) mbar") == pytest.approx(80.0, abs=0.5)
    assert decay.course == "exponential"
    assert decay.order == pytest.approx(1.0, abs=0.1)


def test_a_reading_below_zero_that_dies_away_falls_too() -> None:
    decay = _found(-100.0 * np.exp(-TIME_S / 20.0))
    assert decay.tau_s == pytest.approx(20.0, rel=0.03)
    assert decay.lost_percent == pytest.approx(99.3, abs=0.7)


def test_an_interval_is_as_wide_as_the_noise_makes_it_scatter() -> None:
    found = [_found(100.0 * np.exp(-TIME_S / 40.0), seed=seed) for seed in range(40)]
    taus = np.array([one.tau_s for one in found])
    halves = np.array([0.5 * (one.ci95_s[1] - one.ci95_s[0]) for one in found])
    assert float(np.median(halves)) == pytest.approx(1.96 * float(np.std(taus, ddof=1)), rel=0.4)
    assert np.mean(np.abs(taus - 40.0) < halves) >= 0.8


def test_an_interval_is_wider_where_what_is_left_goes_on_from_sample_to_sample() -> None:
    """As if so many fewer samples were there; of a smooth rest some are counted still."""
    falls = 100.0 * np.exp(-TIME_S / 40.0)
    rng = np.random.default_rng(2)
    white = rng.standard_normal(TIME_S.size)
    walks = lfilter([np.sqrt(1.0 - 0.99**2)], [1.0, -0.99], rng.standard_normal(TIME_S.size))

    def half(off: Array) -> float:
        one = decay_of(Recording.from_arrays(time_s=TIME_S, pressure_mbar=falls + off))
        assert one is not None
        return one.ci95_s[1] - one.tau_s

    assert half(walks) > 3.0 * half(white)
    slowly = np.sin(2.0 * np.pi * TIME_S / 50.0)
    assert half(walks) < half(slowly) < 40.0 * half(white)


def test_what_lacks_and_when_the_recording_begins_change_nothing() -> None:
    falls = 100.0 * np.exp(-TIME_S / 20.0) + NOISE_MBAR * np.random.default_rng(1).standard_normal(TIME_S.size)
    whole = decay_of(Recording.from_arrays(time_s=TIME_S, pressure_mbar=falls))
    later = decay_of(Recording.from_arrays(time_s=TIME_S + 500.0, pressure_mbar=falls))
    torn = decay_of(
        Recording.from_arrays(time_s=TIME_S, pressure_mbar=np.where((TIME_S > 20.0) & (TIME_S < 25.0), np.nan, falls))
    )
    assert whole is not None
    assert later is not None
    assert torn is not None
    assert (later.tau_s, later.onset_s) == (pytest.approx(whole.tau_s, rel=1e-6), pytest.approx(whole.onset_s))
    assert torn.tau_s == pytest.approx(whole.tau_s, rel=0.02)


def test_a_load_that_stands_still_but_for_a_blip_stands() -> None:
    falling = 100.0 * np.exp(-TIME_S / 20.0)
    load = np.full(TIME_S.size, 500.0)
    load[1000:1010] = 650.0
    assert "stands still" in _found(falling, load).says


def test_a_fall_with_a_rise_in_it_is_none() -> None:
    sinks = 100.0 * np.exp(-TIME_S / 40.0)
    assert decay_of(_recording(sinks + 60.0 * ((TIME_S > 40.0) & (TIME_S < 60.0)))) is None
    assert decay_of(_recording(sinks + 1.0 * ((TIME_S > 40.0) & (TIME_S < 60.0)))) is not None
    assert decay_of(_recording(-5.0 - 50.0 * (1.0 - np.exp(-TIME_S / 40.0)))) is None  # away from zero


def test_without_a_reading_there_is_none() -> None:
    assert decay_of(Recording.from_arrays(time_s=TIME_S, force_n=np.full(TIME_S.size, 5.0))) is None


@given(
    fills_s=st.floats(0.2, 6.0),
    rises_s=st.floats(0.0, 0.5),
    sign=st.sampled_from([1.0, -1.0]),
    seed=st.integers(0, 999),
)
@settings(max_examples=20)
def test_a_unit_that_is_filled_while_the_log_runs_decays_from_when_it_is_full(
    fills_s: float, rises_s: float, sign: float, seed: int
) -> None:
    full_s = fills_s * (1.0 + rises_s)
    fills = np.clip((TIME_S - fills_s) / (full_s - fills_s + 1e-9), 0.0, 1.0)
    pressure = 100.0 * fills * np.exp(-np.maximum(TIME_S - full_s, 0.0) / 60.0)
    decay = _found(sign * pressure, seed=seed)
    assert decay.tau_s == pytest.approx(60.0, rel=0.02)
    assert decay.lost_percent == pytest.approx(100.0 * (1.0 - np.exp(-(97.5 - full_s) / 60.0)), abs=2.0)
    assert full_s - 0.5 <= decay.onset_s <= full_s + 3.0
    assert "counted from the first sample" not in decay.says


def test_zeros_before_a_fall_divide_nothing() -> None:
    pressure = np.where(TIME_S < 1.0, 0.0, 100.0 * np.exp(-(TIME_S - 1.0) / 60.0))
    decay = decay_of(Recording.from_arrays(time_s=TIME_S, pressure_mbar=pressure))
    assert decay is not None
    assert decay.tau_s == pytest.approx(60.0, rel=1e-3)


def test_a_load_that_lacks_throughout_is_absent() -> None:
    falling = 100.0 * np.exp(-TIME_S / 20.0)
    assert "only a logged load can tell which" in _found(falling, np.full(TIME_S.size, np.nan)).says


def test_a_vacuum_that_dies_away_ends_below_zero() -> None:
    decay = _found(-20.0 - 80.0 * np.exp(-TIME_S / 15.0))
    assert decay.plateau == pytest.approx(-20.0, abs=0.5)
    assert "towards -20 mbar" in decay.says
    assert decay.course == "exponential"
    assert decay.lost_percent == pytest.approx(80.0, abs=0.5)


@given(seed=st.integers(0, 10_000), noise_mbar=st.sampled_from([3.0, 5.0, 8.0]))
@settings(max_examples=40)
def test_noise_as_loud_as_the_fall_is_no_error(seed: int, noise_mbar: float) -> None:
    noise = np.random.default_rng(seed).normal(0.0, noise_mbar, 500)
    time_s = 0.1 * np.arange(500)
    decay = decay_of(Recording.from_arrays(time_s=time_s, pressure_mbar=90.0 + 10.0 * np.exp(-time_s / 5.0) + noise))
    assert decay is None or (decay.tau_s > 0.0 and decay.ci95_s[0] <= decay.tau_s <= decay.ci95_s[1])


@pytest.mark.parametrize("bins", [10, 24, 80, 800, 4000])
def test_a_decay_is_known_by_however_few_points_a_lag_is_looked_for(bins: int) -> None:
    decay = decay_of(_recording(100.0 * np.exp(-TIME_S / 20.0)), Thresholds(bins=bins))
    assert decay is not None
    assert decay.tau_s == pytest.approx(20.0, rel=0.02)


@pytest.mark.parametrize("given_", [0.02, 0.0, "0.02", {}])
def test_a_decay_is_decided_by_thresholds_alone(given_: object) -> None:
    with pytest.raises(UsageError, match=f"thresholds is of type {type(given_).__name__}: give Thresholds"):
        decay_of(_recording(100.0 * np.exp(-TIME_S / 20.0)), given_)  # type: ignore[arg-type]
