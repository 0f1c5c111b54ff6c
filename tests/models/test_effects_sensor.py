"""Blocks of sensor, logger and machine: null, sign, clocks, smoothness, inverses on a stream and in C."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
from collections.abc import Mapping
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from smartshoe.models.effects import Conditions, Effect, Inverse, effect
from smartshoe.models.effects.hum import _over_floor
from smartshoe.models.effects.saturation import MOST_LOST
from smartshoe.models.extended import ExtendedModel

STEP_S = 0.02
PHYSICAL = (
    "sensor_nonlinearity", "gain_drift", "sensor_lag", "delay", "clock_drift", "zero_offset", "zero_drift", "warm_up",
    "saturation", "cross_talk", "load_cell_tare",
)  # fmt: skip
DATA = (
    "hum", "coloured_noise", "heteroscedastic_noise", "timing_jitter", "spikes", "quantisation", "held_samples",
    "dropouts",
)  # fmt: skip
INVERTED = (
    "sensor_nonlinearity", "gain_drift", "sensor_lag", "zero_offset", "zero_drift", "warm_up", "load_cell_tare", "hum",
    "saturation",
)  # fmt: skip
MEMORYLESS = tuple(name for name in INVERTED if name != "sensor_lag")

signals = arrays(float, st.integers(1, 120), elements=st.floats(-0.2, 1.2))


def _conditions(
    n: int, step_s: float = STEP_S, channels: bool = True, before: Mapping[str, float] | None = None
) -> Conditions:
    time_s = step_s * np.arange(n)
    return Conditions(
        time_s, _triangles(time_s), step_s,
        temperature_k=np.sin(time_s / 3.0) if channels else None,
        neighbour=np.abs(np.sin(time_s)) if channels else None,
        before=before or {},
    )  # fmt: skip


def _triangles(time_s: np.ndarray) -> np.ndarray:
    """A load with corners at whole seconds only: straight lines between samples for every step used here."""
    return np.abs((time_s % 8.0) - 4.0) / 4.0


def _drawn(one: Effect, draw: st.DrawFn, share: float = 1.0) -> np.ndarray:
    """Values within ``share`` of the bounds."""
    drawn = zip(one.start(), one.parameters, strict=True)
    return np.array([start + share * (draw(st.floats(p.lower, p.upper)) - start) for start, p in drawn])


def _strong(one: Effect) -> np.ndarray:
    """Shape of the first grid point, every strength one size above null."""
    return np.array(
        [start if p.null is None else p.null + p.size for start, p in zip(one.start(), one.parameters, strict=True)]
    )


@pytest.mark.parametrize("name", PHYSICAL + DATA)
@settings(max_examples=10, deadline=None)
@given(signal=signals, data=st.data())
def test_null_strengths_leave_the_signal_as_it_is(name: str, signal: np.ndarray, data: st.DataObject) -> None:
    one = effect(name)
    shape = {p.name: data.draw(st.floats(p.lower, p.upper)) for p in one.parameters if p.null is None}
    kept = signal.copy()
    out = one.apply(signal, _conditions(signal.size), one.start(shape))
    assert np.array_equal(out, kept)
    assert out is not signal
    assert one.is_physical == (name in PHYSICAL)


@pytest.mark.parametrize("name", [*PHYSICAL, "hum"])
@settings(max_examples=10, deadline=None)
@given(data=st.data())
def test_within_the_bounds_the_output_is_finite_and_the_input_untouched(name: str, data: st.DataObject) -> None:
    one = effect(name)
    signal = _triangles(STEP_S * np.arange(400))
    kept = signal.copy()
    out = one.apply(signal, _conditions(400), data.draw(st.composite(lambda draw: _drawn(one, draw))()))
    assert np.isfinite(out).all()
    assert np.array_equal(signal, kept)
    for p in one.parameters:
        assert p.lower <= (p.lower if p.null is None else p.null) <= p.upper
        assert all(p.lower <= shape[p.name] <= p.upper for shape in one.shapes if p.name in shape)


@pytest.mark.parametrize("name", PHYSICAL)
def test_derivatives_do_not_depend_on_the_step_that_takes_them(name: str) -> None:
    one = effect(name)
    signal, conditions = _triangles(STEP_S * np.arange(2000)) - 0.05, _conditions(2000)
    at = _strong(one)
    for j, p in enumerate(one.parameters):
        slopes = []
        for share in (1e-3, 4e-3):
            up, down = at.copy(), at.copy()
            up[j], down[j] = up[j] + share * p.size, down[j] - share * p.size
            rise = one.apply(signal, conditions, up) - one.apply(signal, conditions, down)
            slopes.append(rise / (2.0 * share * p.size))
        # One-sided differences are what a fit takes; symmetric ones have an error of second order only.
        assert np.linalg.norm(slopes[1] - slopes[0]) <= 2e-3 * np.linalg.norm(slopes[0]), p.name


@pytest.mark.parametrize("name", [name for name in PHYSICAL if name not in ("delay", "clock_drift", "sensor_lag")])
def test_a_finer_grid_gives_the_same_numbers(name: str) -> None:
    one = effect(name)
    values = _strong(one)
    coarse, fine = _conditions(801), _conditions(1601, STEP_S / 2)
    moved = one.apply(coarse.load, coarse, values) - one.apply(fine.load, fine, values)[::2]
    # A logged temperature is smoothed over whole samples.
    assert np.max(np.abs(moved)) < (1e-6 if name in ("gain_drift", "zero_drift") else 1e-12)


@pytest.mark.parametrize("name", ["delay", "clock_drift"])
def test_a_moved_signal_is_the_same_function_at_the_other_time(name: str) -> None:
    one, errors = effect(name), []

    def tone(t: np.ndarray) -> np.ndarray:
        return 0.5 - 0.5 * np.cos(2 * np.pi * 0.9 * t)

    for step_s in (0.04, 0.02, 0.01):
        conditions = _conditions(int(60 / step_s), step_s)
        late = 2.5 * step_s if name == "delay" else 2e-3  # half a sample is the worst fraction
        late_s = late if name == "delay" else late * conditions.time_s
        moved = one.apply(tone(conditions.time_s), conditions, np.array([late]))
        off = moved - tone(conditions.time_s - late_s)
        errors.append(float(np.max(np.abs(off[int(1.0 / step_s) : -int(1.0 / step_s)]))))
    assert errors[0] < 3e-4  # 28 samples a period; sixteen neighbours behind a window
    assert errors[1] < errors[0] / 3
    assert errors[2] < errors[1] / 3


def _sign(name: str, values: list[float], *, at: float = 0.5, channels: bool = True) -> float:
    """Mean change of a held pressure."""
    conditions = _conditions(500, channels=channels)
    return float(np.mean(effect(name).apply(np.full(500, at), conditions, np.array(values)) - at))


def test_signs_are_those_of_the_documentation() -> None:
    assert _sign("zero_offset", [0.01]) > 0
    assert _sign("load_cell_tare", [0.01]) > 0
    assert _sign("zero_drift", [1e-3, 0.0, 0.0, 1.0]) > 0
    assert _sign("gain_drift", [1e-3, 0.0, 0.0, 0.0, 1.0]) > 0
    assert _sign("gain_drift", [1e-3, 0.0, 0.0, 0.0, 1.0], at=0.0) == 0
    assert _sign("warm_up", [0.01, 5.0, 1.0]) > 0
    assert _sign("cross_talk", [0.01]) > 0
    assert _sign("saturation", [0.5, 0.4, 0.01, 0.0]) < 0
    assert _sign("saturation", [0.0, 0.9, 0.01, 1.0], at=-0.1) > 0.09
    assert _sign("sensor_nonlinearity", [0.01, 0.0, 0.0]) == pytest.approx(0.01)
    assert _sign("sensor_nonlinearity", [0.0, 0.01, 0.0], at=0.5 - 1 / 12**0.5) == pytest.approx(0.01)
    assert _sign("sensor_nonlinearity", [0.0, 0.0, 0.01], at=0.5 + 0.125**0.5) == pytest.approx(0.01)
    assert _sign("sensor_nonlinearity", [0.1, 0.04, 0.02], at=1.0) == 0
    rising = 0.1 * STEP_S * np.arange(300)
    for name, late in (("sensor_lag", [0.1, 0.2]), ("delay", [0.1]), ("clock_drift", [0.01])):
        change = effect(name).apply(rising, _conditions(300), np.array(late)) - rising
        assert np.all(change[20:-20] < 0), name


@pytest.mark.parametrize("second", [0.0, 0.2, 0.45])
def test_a_lag_follows_a_ramp_by_its_time_constant(second: float) -> None:
    conditions = _conditions(1000)
    ramp = 0.05 * conditions.time_s
    late = effect("sensor_lag").apply(ramp, conditions, np.array([0.3, second]))
    assert ramp[-1] - late[-1] == pytest.approx(0.05 * 0.3, rel=1e-9)
    # The two poles' responses to a ramp; at its first corner the cubic is no straight line.
    slow, fast = 0.3 * (1.0 - second), 0.3 * second
    fading = slow**2 * np.exp(-conditions.time_s / slow)
    fading -= fast**2 * np.exp(-conditions.time_s / fast) if fast else 0.0
    exact = ramp - 0.05 * (0.3 - fading / (slow - fast))
    assert np.max(np.abs(late - exact)) < 0.02 * 0.05 * STEP_S


@pytest.mark.parametrize("tau_s", [0.003, 0.02, 0.3])
def test_a_lag_converges_with_the_fourth_power_of_the_step(tau_s: float) -> None:
    errors = []
    for step_s in (0.08, 0.04, 0.02):
        conditions = _conditions(int(24 / step_s), step_s)
        turn = 2j * np.pi * 0.8
        late = effect("sensor_lag").apply(np.exp(turn * conditions.time_s).real, conditions, np.array([tau_s, 0.2]))
        response = 1.0 / (0.8 * tau_s * turn + 1.0) / (0.2 * tau_s * turn + 1.0)
        exact = (response * np.exp(turn * conditions.time_s)).real
        errors.append(float(np.max(np.abs(late - exact)[conditions.time_s > 8.0][:-2])))
    assert errors[0] < 2e-3
    assert errors[1] < errors[0] / 8  # to the third where the lag is far below the step
    assert errors[2] < errors[1] / 8


def test_a_lag_of_a_smoothed_and_thinned_load_is_that_of_the_load() -> None:
    fine_s, thinned = 0.001, 60
    load = _triangles(fine_s * np.arange(40000))
    window = np.hanning(2 * thinned + 1)[1:-1]

    def thin(signal: np.ndarray) -> np.ndarray:
        padded = np.pad(signal, thinned - 1, mode="edge")
        return np.convolve(padded, window / window.sum(), "valid")[::thinned]

    for tau_s in (0.005, 0.02, 0.1):
        fine = Conditions(fine_s * np.arange(load.size), load, fine_s)
        truth = thin(effect("sensor_lag").apply(load, fine, np.array([tau_s, 0.0])))
        coarse = Conditions(fine.time_s[::thinned], thin(load), fine_s * thinned)
        late = effect("sensor_lag").apply(coarse.load, coarse, np.array([tau_s, 0.0]))
        moved = np.sqrt(np.mean((truth - coarse.load) ** 2))
        assert np.sqrt(np.mean((truth - late) ** 2)) < 0.06 * moved


@pytest.mark.parametrize("name", ["gain_drift", "zero_drift"])
def test_a_temperature_coefficient_needs_a_temperature(name: str) -> None:
    one, p = effect(name), np.full(500, 0.5)
    coefficient, rate = one.start(), one.start()
    coefficient[1:3], rate[0] = (0.01, 0.0), 1e-3
    still = np.array_equal(one.apply(p, _conditions(500, channels=False), coefficient), p)
    assert still
    time_s = STEP_S * np.arange(500)
    for warmer_k, by_clock, by_temperature in (
        (2.0 * np.sin(time_s), True, True),
        (0.1 * time_s, False, True),  # a temperature that rises evenly is a clock
        (0.02 * np.sin(700.0 * time_s), True, False),  # a thermometer's noise
    ):
        conditions = Conditions(time_s, p, STEP_S, temperature_k=warmer_k)
        assert np.array_equal(one.apply(p, conditions, rate), p) != by_clock
        assert np.array_equal(one.apply(p, conditions, coefficient), p) != by_temperature
    assert one.inverse(coefficient, STEP_S) is None


@pytest.mark.parametrize("name", ["gain_drift", "zero_drift", "warm_up"])
def test_a_recording_that_continues_another_carries_the_clock_on(name: str) -> None:
    one, p = effect(name), np.full(600, 0.5)
    values = _strong(one)
    whole = one.apply(p, _conditions(600, channels=False), values)
    later = one.apply(p[300:], _conditions(300, channels=False, before={"time_s": 300 * STEP_S}), values)
    assert np.allclose(whole[300:], later, rtol=0, atol=1e-15)


@given(rate=st.floats(-1e-3, 1e-3), exponent=st.floats(0.4, 2.0), time_s=st.floats(0.0, 1e4))
def test_a_zero_and_a_gain_drift_by_a_power_of_the_time(rate: float, exponent: float, time_s: float) -> None:
    """Of all exponents alike a hundred times the rate in 100 s; of the root of time twice in four times as long."""

    def moved(name: str, at_s: float) -> float:
        drift, times_s = effect(name), np.array([0.0, at_s])
        values = drift.start({"exponent": exponent, "temperature_lag": 0.0})
        values[0] = rate
        return float(drift.apply(np.ones(2), Conditions(times_s, np.zeros(2), 1.0), values)[1]) - 1.0

    for name in ("zero_drift", "gain_drift"):
        assert moved(name, 100.0) == pytest.approx(100.0 * rate, abs=1e-12)
        assert moved(name, 4.0 * time_s) == pytest.approx(4.0**exponent * moved(name, time_s), abs=1e-12)


def test_a_thermometers_noise_is_not_added_to_the_reading() -> None:
    time_s = STEP_S * np.arange(5000)
    warmer_k = 2.0 * np.sin(time_s / 15.0)
    noisy_k = warmer_k + 0.1 * np.random.default_rng(1).standard_normal(time_s.size)
    p, values = np.zeros(time_s.size), np.array([0.0, 0.01, 0.0, 1.0])
    moved = effect("zero_drift").apply(p, Conditions(time_s, p, STEP_S, temperature_k=noisy_k), values)
    assert np.std(moved - 0.01 * warmer_k) < 0.2 * 0.01 * 0.1


@settings(max_examples=20, deadline=None)
@given(tau_s=st.floats(3.0, 300.0), period_s=st.floats(60.0, 900.0))
def test_a_sensors_body_follows_a_temperature_by_its_time_constant(tau_s: float, period_s: float) -> None:
    """A first-order lag's answer to a sine, its transient included: omega tau in phase and amplitude."""
    time_s = 0.05 * np.arange(40000)
    omega = 2.0 * np.pi / period_s
    ratio = omega * tau_s
    body_k = (np.sin(omega * time_s) - ratio * np.cos(omega * time_s) + ratio * np.exp(-time_s / tau_s)) / (
        1 + ratio**2
    )
    p = np.zeros(time_s.size)
    conditions = Conditions(time_s, p, 0.05, temperature_k=4.0 * np.sin(omega * time_s))
    for name, signal in (("zero_drift", p), ("gain_drift", p + 1.0)):
        values = effect(name).start()
        values[1:3] = 0.01, tau_s
        moved = effect(name).apply(signal, conditions, values) - signal
        # The thermometer is smoothed over three seconds, so that the corner where it begins is.
        assert np.max(np.abs(moved - 0.04 * body_k)) < 0.04 * 2.0 * omega


@given(
    begins_k=st.floats(-20.0, 20.0), coefficient=st.floats(-0.01, 0.01), share=st.floats(0.0, 1.0), moves=st.booleans()
)
def test_a_gain_goes_with_the_temperature_from_recording_to_recording(
    begins_k: float, coefficient: float, share: float, moves: bool
) -> None:
    """A room that is warmer by a share of which counts, beside what goes on within the recording."""
    time_s = 0.1 * np.arange(2000)
    within_k = 3.0 * np.sin(time_s / 20.0) if moves else np.zeros(time_s.size)
    p, gain = np.full(time_s.size, 0.5), effect("gain_drift")
    here, first = (Conditions(time_s, p, 0.1, temperature_k=begun + within_k) for begun in (begins_k, 0.0))
    counts_k = begins_k if abs(begins_k) >= 0.2 else 0.0  # less than a cheap probe tells
    moved = gain.apply(p, here, np.array([0.0, coefficient, 0.0, share, 1.0]))
    alone = gain.apply(p, first, np.array([0.0, coefficient, 0.0, 0.0, 1.0]))
    assert np.allclose(moved - alone, 0.5 * coefficient * share * counts_k, rtol=0, atol=1e-12)
    # A zero of each recording's own is told anyway.
    zero = effect("zero_drift")
    values = np.array([0.0, coefficient, 0.0, 1.0])
    assert np.allclose(zero.apply(p, here, values), zero.apply(p, first, values), rtol=0, atol=1e-12)


def test_shapes_that_differ_by_what_is_not_logged_are_one() -> None:
    drift, lag = effect("zero_drift"), effect("sensor_lag")
    assert [dict(one) for one in drift.shapes_with({"neighbour"})] == [
        {"temperature_lag": 3.0, "exponent": 1.0}, {"temperature_lag": 3.0, "exponent": 0.5},
    ]  # fmt: skip
    assert drift.shapes_with({"temperature"}) == drift.shapes
    gain = effect("gain_drift")
    assert [len(gain.shapes_with(logged)) for logged in ((), {"temperature"}, {"temperature", "temperatures"})] == [
        1, 2, 4,
    ]  # fmt: skip
    assert lag.shapes_with(()) == lag.shapes


def test_a_file_from_before_sensors_lagged_behind_a_temperature_has_no_such_lag_and_a_steady_drift() -> None:
    now = ExtendedModel(1.0, 0.1, 0.5, 800.0, 140.0, "mbar").with_part("zero_drift", np.array([1e-5, 2e-3, 0.0, 1.0]))
    stored = now.to_dict()
    before = {**stored, "effects": {"zero_drift": {"drift_rate": 1e-5, "temperature_coefficient": 2e-3}}}
    assert ExtendedModel.from_dict(before).to_dict() == stored
    gain = {"drift_rate": 1e-5, "temperature_coefficient": 2e-3, "temperature_lag": 60.0}
    told = ExtendedModel.from_dict({**stored, "effects": {"gain_drift": gain}})
    assert told.to_dict()["effects"]["gain_drift"] == {**gain, "carried_over": 0.0, "exponent": 1.0}
    with pytest.raises(KeyError):
        ExtendedModel.from_dict({**stored, "effects": {"zero_drift": {"drift_rate": 1e-5}}})


def test_cross_talk_without_a_neighbour_does_nothing() -> None:
    p = np.full(50, 0.5)
    assert np.array_equal(effect("cross_talk").apply(p, _conditions(50, channels=False), np.array([0.3])), p)


def _pushed(inverse: Inverse, signal: np.ndarray, time_s: np.ndarray, cuts: list[int]) -> np.ndarray:
    edges = [0, *sorted(min(cut, signal.size) for cut in cuts), signal.size]
    parts = [inverse.push(signal[a:b], time_s[a:b]) for a, b in pairwise(edges)]
    return np.concatenate(parts)


@pytest.mark.parametrize("name", INVERTED)
@settings(max_examples=15, deadline=None)
@given(signal=signals, data=st.data(), cuts=st.lists(st.integers(0, 120), max_size=4))
def test_an_inverse_recovers_the_input_however_the_stream_is_cut(
    name: str, signal: np.ndarray, data: st.DataObject, cuts: list[int]
) -> None:
    one = effect(name)
    conditions = _conditions(signal.size, channels=False)
    values = data.draw(st.composite(lambda draw: _drawn(one, draw, 0.5))())
    if name in ("gain_drift", "zero_drift"):
        values[1] = 0.0
    inverse = one.inverse(values, STEP_S)
    if inverse is None:
        assert name == "sensor_nonlinearity"
        fine = np.linspace(0.0, 1.0, 4001)
        assert np.min(np.diff(one.apply(fine, _conditions(4001), values))) < 0.06 * (fine[1] - fine[0])
        return
    out = one.apply(signal, conditions, values)
    whole = _pushed(inverse, out, conditions.time_s, [])
    inverse.reset()
    assert np.array_equal(_pushed(inverse, out, conditions.time_s, cuts), whole)
    if name in MEMORYLESS:
        assert np.max(np.abs(whole - signal)) < 1e-12


@settings(max_examples=200, deadline=None)
@given(
    signal=arrays(float, st.integers(1, 60), elements=st.floats(-0.5, 3.0)), lost=st.floats(0.0, MOST_LOST),
    level=st.floats(0.1, 1.5), knee=st.floats(1e-3, 0.08), rail=st.floats(0.0, 1.0), cut=st.integers(0, 60),
)  # fmt: skip
def test_a_bend_that_leaves_half_of_the_slope_is_undone(
    signal: np.ndarray, lost: float, level: float, knee: float, rail: float, cut: int
) -> None:
    """Below zero too, where the rail leaves as much; else what is read there stays as it is."""
    one, values, conditions = effect("saturation"), np.array([lost, level, knee, rail]), _conditions(signal.size)
    inverse = one.inverse(values, STEP_S)
    if lost == 0.0 and rail > MOST_LOST:
        assert inverse is None
        return
    assert inverse is not None
    read = one.apply(signal, conditions, values)
    whole = inverse.push(read, conditions.time_s)
    assert np.array_equal(_pushed(inverse, read, conditions.time_s, [cut]), whole)
    expected = np.where(read < 0.0, read, signal) if rail > MOST_LOST else signal
    assert np.max(np.abs(whole - expected)) < 1e-12


@pytest.mark.parametrize("lost", [np.nextafter(MOST_LOST, 1.0), 0.9, 1.0])
def test_a_reading_that_loses_more_than_half_of_its_slope_is_lost(lost: float) -> None:
    assert effect("saturation").inverse(np.array([lost, 0.8, 0.01, 0.0]), STEP_S) is None


@given(
    lost=st.floats(0.0, 1.0), level=st.floats(0.1, 1.5), knee=st.floats(1e-3, 0.08), rail=st.floats(0.0, 1.0),
)  # fmt: skip
def test_the_slope_left_is_that_of_the_curve(lost: float, level: float, knee: float, rail: float) -> None:
    one, values, step = effect("saturation"), np.array([lost, level, knee, rail]), 1e-7
    signal = np.linspace(-0.0102, 2.0, 500)  # 0 and the rail's corner lie between
    ends = [one.apply(signal + by, _conditions(signal.size), values) for by in (step, -step)]
    slope = (ends[0] - ends[1]) / (2.0 * step)
    assert np.max(np.abs(one.slope_left(signal, values) - slope)) < 1e-3


def test_an_effect_that_clips_and_says_no_more_leaves_no_slope() -> None:
    assert not effect("delay").slope_left(np.ones(3), np.array([0.1])).any()


def test_the_inverse_of_a_lag_is_right_to_first_order_of_the_step() -> None:
    one, values, errors = effect("sensor_lag"), np.array([0.2, 0.2]), []
    for step_s in (0.02, 0.01, 0.005):
        conditions = _conditions(int(24 / step_s), step_s)
        inverse = one.inverse(values, step_s)
        assert inverse is not None
        back = inverse.push(one.apply(conditions.load, conditions, values), conditions.time_s)
        errors.append(float(np.sqrt(np.mean((back - conditions.load) ** 2))))
    assert errors[0] < 0.02 * 0.25  # the rise within a step
    assert errors[1] == pytest.approx(errors[0] / 2, rel=0.1)
    assert errors[2] == pytest.approx(errors[1] / 2, rel=0.1)


COMPILER = shutil.which("gcc") or shutil.which("cc")


@pytest.mark.skipif(COMPILER is None, reason="no C compiler (gcc or cc) on the path")
def test_c_gives_the_numbers_of_push(tmp_path: Path) -> None:
    assert COMPILER is not None
    rng = np.random.default_rng(4)
    signal, time_s = rng.uniform(-0.2, 1.2, 500), STEP_S * np.arange(500)
    inverses: dict[str, Inverse] = {}
    for name in INVERTED:
        one = effect(name)
        values = _strong(one) if name in ("sensor_lag", "saturation") else -_strong(one)
        values = np.array([abs(v) if p.null is None else v for v, p in zip(values, one.parameters, strict=True)])
        if name in ("gain_drift", "zero_drift"):
            values[1] = 0.0
        found = one.inverse(values, STEP_S)
        assert found is not None
        inverses[name] = found
    for name, lag, values in (("pair", "sensor_lag", [0.03, 1.2]), ("by_direction", "flexible_lag", [0.03, -0.4])):
        found = effect(lag).inverse(np.array(values), STEP_S)
        assert found is not None
        inverses[name] = found
    steps = {name: inverse.c_step(f"b{k}") for k, (name, inverse) in enumerate(inverses.items())}
    members = {member: start for step in steps.values() for member, start in step.states.items()}
    source = ["#include <math.h>", "typedef struct {"]
    source += [f"    double {member};" for member in members] + ["} filter;"]
    for name, step in steps.items():
        starts = "".join(f" f->{member} = {start!r};" for member, start in step.states.items())
        source += [
            f"void {name}(double *values, const double *times, long n);",
            f"void {name}(double *values, const double *times, long n)\n{{",
            "    filter state, *f = &state;\n    long at;",
            f"    (void)f;\n    (void)times;\n   {starts}",
            "    for (at = 0; at < n; at++) {\n        double x = values[at];\n        const double t = times[at];",
            "        (void)t;\n" + step.body + "\n        values[at] = x;\n    }\n}",
        ]
    (tmp_path / "inverses.c").write_text("\n".join(source) + "\n")
    flags = ["-std=c99", "-O2", "-Wall", "-Wextra", "-Werror", "-pedantic", "-Wconversion", "-Wshadow"]
    done = subprocess.run(
        [COMPILER, *flags, "-ffp-contract=off", "-shared", "-fPIC", "inverses.c", "-o", "inverses.so", "-lm"],
        cwd=tmp_path, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    library = ctypes.CDLL(str(tmp_path / "inverses.so"))
    numbers = np.ctypeslib.ndpointer(dtype=float, flags="C_CONTIGUOUS")
    for name, inverse in inverses.items():
        run = getattr(library, name)
        run.argtypes, run.restype = [numbers, numbers, ctypes.c_long], None
        by_c = signal.copy()
        run(by_c, time_s, by_c.size)
        assert np.max(np.abs(by_c - inverse.push(signal, time_s))) < 1e-12, name


def test_a_tone_beside_which_nothing_is_left_stands_out_without_overflow() -> None:
    """A load of exactly even triangles, thousands of them: between its harmonics there is not even noise."""
    power = np.zeros(2000)
    power[::50] = 1e300
    with np.errstate(over="raise", invalid="raise", divide="raise"):
        ratio, _ = _over_floor(power, 20, 3)
        nothing, _ = _over_floor(np.zeros(100), 20, 3)
    assert (ratio[::50] > 1e6).all()
    assert np.count_nonzero(ratio) == 40
    assert not nothing.any()
