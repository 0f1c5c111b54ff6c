"""A hum that was told is no structure of what is left, and what stands beside it still is."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.signal import lfilter

from smartshoe import Recording, diagnose
from smartshoe.diagnosis import Diagnosis
from smartshoe.diagnosis._averaging import smoothed, thinning_weights
from smartshoe.diagnosis._reported_lines import as_thinned, lines_of, reported_tones

Array = NDArray[np.float64]

RATE_HZ, FULL_N, FULL_MBAR, HUM = 500.0, 500.0, 300.0, 0.004
STEP_S = 1.0 / RATE_HZ


# -- the tones of a residual -------------------------------------------------------------------------------------------
def _session(size: int, step_s: float = 0.01, lost: slice = slice(0), held: slice = slice(0), thinned: int = 1) -> Any:
    usable, out = np.ones(size, dtype=bool), np.zeros(size, dtype=bool)
    usable[lost], out[held] = False, True
    at = SimpleNamespace(step_s=step_s)
    return SimpleNamespace(conditions=at, usable=usable, held_out=out, fitted=usable & ~out, thinned=thinned, index=1)


def _tone(size: int, hz: float, step_s: float = 0.01, phase: float = 1.0) -> Array:
    return np.asarray(np.sin(2.0 * np.pi * hz * step_s * np.arange(size) + phase))


@pytest.mark.parametrize("hz", [7.3, 31.0, 49.93, 50.0])
@pytest.mark.parametrize("off_in_bins", [-0.9, 0.0, 0.6])
def test_a_tone_is_found_where_it_is_though_it_was_told_a_bin_beside(hz: float, off_in_bins: float) -> None:
    size = 6000
    tone = 0.3 * _tone(size, hz)
    noisy = tone + 0.01 * np.random.default_rng(1).standard_normal(size)
    found = reported_tones(_session(size), noisy, [hz + off_in_bins / (0.01 * size)])
    assert np.sqrt(np.mean((found - tone) ** 2)) < 0.001


def test_it_is_that_of_the_samples_that_a_fit_may_use() -> None:
    size = 6000
    tone, held = 0.3 * _tone(size, 12.34), slice(2000, 3000)
    heard = tone + 0.005 * np.random.default_rng(2).standard_normal(size)
    other = heard.copy()
    other[held] += 5.0 * _tone(1000, 12.4)
    session = _session(size, lost=slice(4000, 4100), held=held)
    heard[4000:4100] = 1e3
    other[4000:4100] = -1e3
    found, found_in_other = (reported_tones(session, one, [12.34]) for one in (heard, other))
    np.testing.assert_array_equal(found, found_in_other)
    assert np.sqrt(np.mean((found - tone) ** 2)) < 0.001


def test_of_a_recording_that_only_judges_all_usable_samples_count_and_of_none_nothing() -> None:
    tone = _tone(3000, 12.34)
    np.testing.assert_allclose(reported_tones(_session(3000, held=slice(None)), tone, [12.34]), tone, atol=1e-3)
    assert not reported_tones(_session(3000, lost=slice(None)), tone, [12.34]).any()


def test_what_is_no_line_that_was_told_stays() -> None:
    size = 12000
    rng = np.random.default_rng(3)
    at_s = 0.01 * np.arange(size)
    wave = 0.02 * np.sign(np.sin(2.0 * np.pi * 0.11 * at_s)) + 0.02 * _tone(size, 19.0)
    noise = 0.01 * rng.standard_normal(size)
    left = wave + noise + 0.1 * _tone(size, 23.4)
    found = reported_tones(_session(size), left, [23.4])
    np.testing.assert_allclose(left - found, wave + noise, atol=1e-3)


def test_two_lines_are_both_taken_the_strongest_first() -> None:
    tones = _tone(6000, 12.5) + 0.2 * _tone(6000, 40.0)
    np.testing.assert_allclose(reported_tones(_session(6000), tones, [12.5, 40.0]), tones, atol=2e-3)


@pytest.mark.parametrize("factor", [1, 4, 10])
def test_a_tone_comes_out_of_the_average_as_the_reading_does(factor: int) -> None:
    """At a tenth of its rate a tone of 10.02 Hz comes out as one of 0.02 Hz: nothing slow is fitted there."""
    tone = _tone(5000, 10.02)
    session = _session(5000 // factor, thinned=factor)
    weights = thinning_weights(factor, 5000)
    slow = np.cos(0.001 * np.arange(5000.0))
    whole = smoothed(tone + slow, weights, factor)
    np.testing.assert_allclose(whole - as_thinned(tone, session), smoothed(slow, weights, factor), atol=1e-12)


def test_only_lines_of_the_recording_itself_count_and_each_once() -> None:
    faults: Any = [
        SimpleNamespace(recording=1, lines_hz=(50.0, 12.0)),
        SimpleNamespace(recording=0, lines_hz=(60.0,)),
        SimpleNamespace(recording=1, lines_hz=()),
        SimpleNamespace(recording=1, lines_hz=(12.0, 7.0)),
    ]
    assert lines_of(_session(10), faults) == (50.0, 12.0, 7.0)


# -- a whole diagnosis -------------------------------------------------------------------------------------------------
def _course(*parts: tuple[float, float]) -> Array:
    corners_s = np.cumsum([0.0, *(seconds for _, seconds in parts)])
    at_s = STEP_S * np.arange(round(float(corners_s[-1]) / STEP_S))
    return np.asarray(np.interp(at_s, corners_s, [0.0, *(level for level, _ in parts)]))


TRIANGLES = _course((0, 2), *((x, s) for s in (16.0, 4.0, 1.0) for _ in range(3) for x in (1.0, 0.0)), (0, 2))
STAIRS = _course((0, 2), *(part for x in (1, 2, 3, 4, 5, 6, 5, 4, 3, 2, 1, 0) for part in ((x / 6, 1 / 6), (x / 6, 4))))


def _solid(load: Array, share: float = 0.12, tau_s: float = 1.0) -> Array:
    """A standard linear solid: p + k (p - q) = f, q' = (p - q)/tau, whose reading creeps with tau (1 + k)."""
    keep, step = float(np.exp(-STEP_S / (tau_s * (1.0 + share)))), share / (1.0 + share)
    return np.asarray(load - step * lfilter([1.0, -1.0], [1.0, -keep], load))


def _teeth(load: Array) -> Array:
    """A wave over the load, as the teeth of a spindle leave: no effect of the catalogue."""
    return np.asarray(0.003 * np.sin(2.0 * np.pi * 7.0 * load))


def _told(hum: float, teeth: bool = False) -> Diagnosis:
    rng = np.random.default_rng(4)
    runs = []
    for name, load in (("triangles", TRIANGLES), ("stairs", STAIRS)):
        reading = _solid(load) + (_teeth(load) if teeth else 0.0) + hum * _tone(load.size, 50.0, STEP_S)
        noise, off = (rng.standard_normal(load.size) for _ in range(2))
        runs.append(
            Recording.from_arrays(
                name=name, time_s=STEP_S * np.arange(load.size), force_n=FULL_N * (load + 0.0002 * off),
                pressure_mbar=FULL_MBAR * (reading + 0.0005 * noise),
            )
        )  # fmt: skip
    return diagnose(runs)


def test_a_hum_that_keeps_step_with_the_load_cycles_is_told_and_leaves_nothing_unexplained() -> None:
    """Each ramp lasts for whole periods of the mains, so that the hum repeats with the cycles as an effect does."""
    found = _told(HUM)
    assert (found.verdict, found.causes) == ("adequate", ())
    assert {fault.kind for fault in found.data_faults} == {"hum"}
    assert found.baseline is not None
    assert found.baseline.rmse > 0.5 * HUM * FULL_MBAR  # which says what the simulation is off by, hum and all


@pytest.mark.long
def test_an_effect_that_has_no_name_is_seen_beside_a_hum_as_without_one() -> None:
    with_hum, without = _told(HUM, teeth=True), _told(0.0, teeth=True)
    assert {fault.kind for fault in with_hum.data_faults} == {"hum"}
    assert (with_hum.verdict, without.verdict) == ("unexplained", "unexplained")
    assert with_hum.baseline is not None
    assert without.baseline is not None
    assert with_hum.baseline.structure_rms == pytest.approx(without.baseline.structure_rms, rel=0.2)
