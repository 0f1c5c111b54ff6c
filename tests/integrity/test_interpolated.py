"""A channel that was measured more slowly than its table and interpolated: only what was measured is used."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from test_held_between_samples import STEP_S, _held, _load_n, _recording
from test_integrity_clean import SHAPES

from smartshoe import diagnose
from smartshoe.integrity import examine
from smartshoe.integrity._interpolated import without_interpolated
from smartshoe.integrity.thresholds import Thresholds
from smartshoe.protocol import dynamic_protocol, static_protocol

Array = NDArray[np.float64]
STANDARD = Thresholds()
SEEDS = st.integers(0, 2**16)
EACH = settings(max_examples=25)
FEW = settings(max_examples=10)


def _moments(size: int, factor: float, phase: float, jitter: float = 0.0, seed: int = 0) -> Array:
    """(k,) in samples: ``factor`` apart, one at ``phase``, each early or late by chance."""
    at = phase + factor * np.arange(-1, size / factor + 2)
    return np.asarray(at + jitter * factor * np.random.default_rng(seed).uniform(-1.0, 1.0, at.size))


def _interpolated(values: Array, factor: float, phase: float) -> Array:
    """(n,) the lines between values at even moments."""
    at, here = _moments(values.size, factor, phase), np.arange(values.size)
    return np.interp(here, at, np.interp(at, here, values))


def _noisy(seed: int, noise_n: float = 0.3, noise_mbar: float = 0.05) -> tuple[Array, Array]:
    rng, load_n = np.random.default_rng(seed), _load_n()
    reading = 0.2 * load_n + noise_mbar * rng.standard_normal(load_n.size)
    return load_n + noise_n * rng.standard_normal(load_n.size), reading


@EACH
@given(st.integers(2, 60), st.integers(0, 59), st.sampled_from(["load", "reading"]), SEEDS)
def test_each_moment_is_found_to_the_sample(factor: int, phase: int, which: str, seed: int) -> None:
    phase %= factor
    load_n, reading = _noisy(seed)
    if which == "load":
        given_ = _recording(_interpolated(load_n, factor, phase), reading)
    else:
        given_ = _recording(load_n, _interpolated(reading, factor, phase))
    taken, (finding,) = without_interpolated(given_, STANDARD)
    name = "force" if which == "load" else "pressure"
    assert (finding.kind, finding.masks) == ("interpolated", False)
    assert finding.says.startswith(f"{name} was measured every {0.01 * factor:.3g} s and interpolated to 100 Hz")
    kept = np.round(taken.time_s / STEP_S).astype(int)
    assert np.mean(kept % factor == phase) > 0.99  # where noise happens to lie on a line the moment is not seen
    assert kept.size == pytest.approx(load_n.size / factor, abs=2.0)
    np.testing.assert_array_equal(taken.force_n, given_.force_n[kept])
    np.testing.assert_array_equal(taken.sensor.values, given_.sensor.values[kept])


@EACH
@given(st.floats(3.0, 40.0), st.floats(0.0, 1.0), st.floats(0.0, 0.2), st.sampled_from([None, 3, 6]), SEEDS)
def test_moments_between_samples_and_uneven_ones_are_found(
    factor: float, phase: float, jitter: float, digits: int | None, seed: int
) -> None:
    """A merge of two logs: neither clock knows of the other, and the table was written with some digits."""
    assume(factor * (1.0 - 2.0 * jitter) >= 3.5)  # a knot may bend two samples: one between two knots is straight
    load_n, reading = _noisy(seed)
    here, at = np.arange(load_n.size), _moments(load_n.size, factor, phase * factor, jitter, seed)
    measured_n = np.interp(at, here, load_n)
    logged_n = np.interp(here, at, measured_n)
    given_ = _recording(logged_n if digits is None else np.round(logged_n, digits), reading)
    taken, findings = without_interpolated(given_, STANDARD)
    assert [one.kind for one in findings] == ["interpolated"]
    assert len(taken) == pytest.approx(load_n.size / factor, rel=0.05)
    nearest = np.argmin(np.abs(at - taken.time_s[:, None] / STEP_S), axis=1)
    # Of a load that hardly bends the last digits hide where: most are found to a tenth of a sample.
    assert np.median(np.abs(taken.time_s / STEP_S - at[nearest])) < 0.1
    assert np.median(np.abs(taken.force_n - measured_n[nearest])) < 0.1 * 0.3


@EACH
@given(st.floats(5.0, 40.0), st.floats(0.0, 1.0), st.sampled_from([None, 5]), SEEDS)
def test_the_moments_of_a_spline_are_found(factor: float, phase: float, digits: int | None, seed: int) -> None:
    load_n, reading = _noisy(seed)
    here, at = np.arange(load_n.size), _moments(load_n.size, factor, phase * factor)
    logged_n = CubicSpline(at, np.interp(at, here, load_n))(here)
    given_ = _recording(logged_n if digits is None else np.round(logged_n, digits), reading)
    taken, findings = without_interpolated(given_, STANDARD)
    assert [one.kind for one in findings] == ["interpolated"]
    assert np.median(np.diff(taken.time_s)) == pytest.approx(STEP_S * factor, rel=0.02)


def test_of_two_interpolated_channels_the_slower_one_decides() -> None:
    load_n, reading = _noisy(1)
    given_ = _recording(_interpolated(load_n, 4, 1.5), _interpolated(reading, 15, 3.0))
    taken, (finding,) = without_interpolated(given_, STANDARD)
    assert finding.says.startswith("pressure was measured every 0.15 s")
    assert np.diff(taken.time_s) == pytest.approx(0.15)


@EACH
@given(
    st.sampled_from(sorted(SHAPES)),
    st.sampled_from([0.0, 0.1, 0.3, 0.5, 0.8, 1.2, 3.0]),
    st.floats(-3.0, 0.9),
    st.booleans(),
    SEEDS,
)
def test_a_measured_load_is_never_told(shape: str, steps: float, exponent: float, is_rounded: bool, seed: int) -> None:
    """Of any shape: on a grid of any step, with noise of any number of them, none too."""
    time_s, grid_n = np.arange(0.0, 200.0, STEP_S), 10.0**exponent
    load_n = 800.0 * SHAPES[shape](time_s)
    load_n += steps * grid_n * np.random.default_rng(seed).standard_normal(time_s.size)
    if is_rounded:
        load_n = grid_n * np.round(load_n / grid_n)
    given_ = _recording(load_n, _noisy(seed)[1][:1].repeat(time_s.size) + 0.2 * load_n)
    assert without_interpolated(given_, STANDARD) == (given_, [])


@pytest.mark.parametrize("digits", [None, 3, 1])
@FEW
@given(st.floats(20.0, 800.0), st.floats(0.0, 3.0), st.integers(1, 40))
def test_ramps_of_a_machine_without_noise_are_lines_of_its_own(digits, rate, rest_s, cycles) -> None:
    """Triangles of one rate bend as often and as evenly as anything can; a staircase's treads and risers too."""
    for protocol in (
        dynamic_protocol((rate,), repeats=cycles, rest_s=rest_s),
        static_protocol(tuple(100.0 + 20.0 * n for n in range(cycles)), hold_s=1.0 + rest_s),
    ):
        corners_s, corners_n = protocol.corners()
        time_s = np.arange(0.0, min(corners_s[-1], 300.0), STEP_S)
        load_n = np.interp(time_s, corners_s, corners_n)
        load_n = load_n if digits is None else np.round(load_n, digits)
        reading = 0.2 * load_n + 0.05 * np.random.default_rng(cycles).standard_normal(load_n.size)
        given_ = _recording(load_n, reading)
        assert without_interpolated(given_, STANDARD) == (given_, [])


def test_held_samples_are_no_lines() -> None:
    load_n, reading = _noisy(2)
    given_ = _recording(_held(load_n, 10), reading)
    assert without_interpolated(given_, STANDARD) == (given_, [])


def test_a_walk_on_a_slow_load_is_judged_where_the_load_was_measured() -> None:
    """A load that changes within 0.1 s: between two values of a load of 10 Hz a plain unit does what none explains."""
    time_s = np.arange(0.0, 90.0, STEP_S)
    runs = []
    for seed in range(3):
        rng = np.random.default_rng(seed)
        load_n = 600.0 * np.clip(1.5 * np.sin(2.0 * np.pi * (0.85 + 0.05 * seed) * time_s), 0.0, 1.0)
        load_n += 0.3 * rng.standard_normal(time_s.size)
        reading = 0.2 * load_n + 0.05 * rng.standard_normal(time_s.size)
        runs.append(_recording(_interpolated(load_n, 10.0, 3.4), reading, f"run_{seed}"))
    assert len(examine(runs).recordings[0]) == pytest.approx(900, abs=2)
    found = diagnose(runs[:2], hold_out=runs[2:])
    assert (found.verdict, found.causes) == ("adequate", ())
    assert sum(fault.kind == "interpolated" for fault in found.data_faults) == 3
