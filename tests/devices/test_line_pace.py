"""The pace of text lines: their rate, and the samples lost between them, told from times as coarse as the period."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, example, given
from hypothesis import strategies as st

from smartshoe.arrays import Array, Integers
from smartshoe.devices.serial_link._line_pace import LinePace

TICK_S = 1e-3  # of millis()
MEASURED_S = 1.2
rates = st.floats(1.0, 994.0) | st.just(1000.0)
phases = st.floats(0.0, 1.0)


def told(rate_hz: float, phase: float, came: Integers) -> tuple[LinePace, Integers]:
    """The pace of a sketch that prints ``millis()`` with each sample, and what it says of those that came."""
    steps_s = TICK_S * np.diff(np.floor((phase + came / rate_hz) / TICK_S + 1e-6))
    pace = LinePace.of(steps_s)
    return pace, pace.samples(steps_s)


def samples(rate_hz: float, more: int = 0) -> Integers:
    return np.arange(int(MEASURED_S * rate_hz) + 2 + more)


@given(rates, phases)
@example(992.0, 0.0)  # nearer to 1000 a step of 2 ms is a lost sample
def test_of_a_whole_stream_nothing_is_lost_and_the_rate_is_right(rate_hz: float, phase: float) -> None:
    pace, taken = told(rate_hz, phase, samples(rate_hz))
    assert (taken == 1).all()
    assert 1.0 / pace.period_s == pytest.approx(rate_hz, rel=2e-3)


@given(rates.filter(lambda rate_hz: rate_hz >= 10.0), phases, st.integers(5, 200), st.floats(0.0, 1.0))
def test_a_hole_is_told_wherever_it_is_and_leaves_the_rate(rate_hz: float, phase: float, lost: int, at: float) -> None:
    whole = samples(rate_hz, more=lost)
    first = 1 + int(at * (whole.size - lost - 2))
    pace, taken = told(rate_hz, phase, np.delete(whole, np.s_[first : first + lost]))
    assert np.flatnonzero(taken > 1).tolist() == [first - 1]
    assert taken[first - 1] - 1 == pytest.approx(lost, abs=2)  # a tick more or less, as long as a sample
    assert 1.0 / pace.period_s == pytest.approx(rate_hz, rel=2e-3)


@given(st.floats(20.0, 330.0), phases)
def test_each_lost_sample_is_told_where_the_clock_is_finer_than_the_period(rate_hz: float, phase: float) -> None:
    whole = samples(rate_hz)
    pace, taken = told(rate_hz, phase, whole[(whole % 20 != 7) | (whole == whole[-1])])
    assert taken.sum() == whole.size - 1
    assert 1.0 / pace.period_s == pytest.approx(rate_hz, rel=2e-3)


def test_a_lost_sample_is_told_where_each_tick_is_a_sample() -> None:
    assert told(1000.0, 0.0, np.delete(samples(1000.0), [300, 800]))[1].sum() == samples(1000.0).size - 1


@given(st.floats(20.0, 1000.0), st.integers(0, 99))
def test_a_loop_that_is_not_even_loses_nothing(rate_hz: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    steps_s: Array = rng.uniform(0.7, 1.3, int(MEASURED_S * rate_hz) + 2) / rate_hz
    pace = LinePace.of(steps_s)
    assert (pace.samples(steps_s) == 1).all()
    assert 1.0 / pace.period_s == pytest.approx(1.0 / steps_s.mean(), rel=1e-6)
    assume(steps_s.size > 20)
    steps_s[11] *= 40.0
    assert np.flatnonzero(LinePace.of(steps_s).samples(steps_s) > 1).tolist() == [11]
