"""A stretch that was logged at a lower rate than the rest is used as far as fits can follow it, or said not to be."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from smartshoe.diagnosis import Thresholds
from smartshoe.diagnosis._prepared import prepared
from smartshoe.diagnosis._slow_segments import limit_slow_segments, spacing_of
from smartshoe.integrity import examine
from smartshoe.recording import Recording

STANDARD = Thresholds()
Array = NDArray[np.float64]


def _stamps(*stretches: tuple[int, float]) -> Array:
    """(n,) times of stretches of so many samples, so far apart."""
    return np.concatenate([[0.0], np.cumsum(np.concatenate([np.full(count, step) for count, step in stretches]))])


def _seen(time_s: Array, at_s: Array, good: NDArray[np.bool_], longest_s: float) -> list[NDArray[np.bool_]]:
    moving = np.arange(time_s.size) % 2.0
    spacing = spacing_of(time_s, moving, at_s, longest_s, STANDARD)
    return [spacing.followed(good), spacing.too_slow(good)]


def test_moments_between_samples_as_far_apart_as_those_about_them_are_known() -> None:
    time_s = _stamps((200, 0.01), (200, 0.03), (200, 0.05))
    at_s = np.arange(0.0, time_s[-1], 0.01)
    near, far = _seen(time_s, at_s, np.ones(time_s.size, dtype=bool), 0.035)
    assert np.array_equal(near, at_s <= 8.0 + 1e-9)
    assert np.array_equal(far, ~near)


@pytest.mark.parametrize("step_s", [0.01, 0.03])
def test_what_is_missing_in_an_even_stretch_is_a_gap_and_not_slow(step_s: float) -> None:
    time_s = np.delete(_stamps((500, step_s), (20, 0.01)), [100, 101, 300])
    at_s = np.arange(0.0, time_s[-1], 0.01)
    near, far = _seen(time_s, at_s, np.ones(time_s.size, dtype=bool), 1.0)
    lacking = ((at_s > 99.0 * step_s) & (at_s < 102.0 * step_s)) | ((at_s > 299.0 * step_s) & (at_s < 301.0 * step_s))
    assert np.mean(near != ~lacking) < 0.005  # stamps are rounded
    assert not far.any()


def test_nor_is_known_what_lies_beside_a_sample_that_is_at_fault() -> None:
    time_s = _stamps((300, 0.03))
    good = np.arange(time_s.size) != 100
    at_s = np.array([2.985, 3.015, 2.96, 3.04])
    near, far = _seen(time_s, at_s, good, 0.035)
    assert near.tolist() == [False, False, True, True]
    assert not far.any()


def _run(slower: int, name: str, rate_hz: float = 100.0) -> Recording:
    """Triangles; of the second half every so manieth sample."""
    at = np.arange(8000)
    at = at[(at < 4000) | (at % slower == 0)]
    time_s = at / rate_hz
    load = 800.0 * np.abs((time_s / 10.0) % 1.0 - 0.5)
    noise = np.random.default_rng(len(name)).standard_normal((2, at.size))
    return Recording.from_arrays(
        time_s=time_s, force_n=load + 0.2 * noise[0], pressure_mbar=0.25 * load + 0.05 * noise[1], name=name
    )


@pytest.mark.parametrize(("slower", "is_used"), [(1, True), (2, True), (3, True), (50, False)])
def test_half_a_recording_at_a_lower_rate_is_used_or_said_not_to_be(slower: int, is_used: bool) -> None:
    runs = [_run(slower, "one"), _run(slower, "other")]
    integrity = examine(runs, STANDARD)
    ready = prepared(runs, 2, integrity, STANDARD)
    for one in (*ready.sessions, *ready.fine):
        half = one.usable.size // 2
        assert one.usable[:half].mean() > 0.99
        used = float(one.usable[half + 50 :].mean())
        assert used > 0.99 if is_used else used < 0.05  # at full rate the samples themselves are there
        assert not one.gap_ends or not is_used
    said = [one for one in ready.limits if "of it is not used" in one]
    if is_used:
        assert said == []
        return
    assert len(said) == 2
    assert "one: 50 % of it is not used, between 40" in said[0]
    assert " s: samples are 0.5 s apart there" in said[0]


def test_between_quick_stretches_the_slow_ones_are_as_far_apart_as_they_are() -> None:
    """A cell that is logged ten times a second in each pulse, and every ten seconds while it is charged again."""
    pulse, rest = np.arange(0.0, 40.0, 0.1), 40.0 + np.arange(0.0, 2000.0, 10.0)
    time_s = np.concatenate([start + np.concatenate([pulse, rest]) for start in (0.0, 2040.0)])
    load = np.where(np.fmod(time_s, 2040.0) < 40.0, 5.0, 1.0 + np.sin(time_s))
    run = Recording.from_arrays(time_s=time_s, force_n=load, cell_v=3.0 + 0.1 * load)
    (said,) = limit_slow_segments(run, np.ones(len(run), dtype=bool), 0.35, STANDARD)
    assert "samples are 10 s apart there; to follow this load, fits need one every 0.35 s" in said


def test_nothing_is_said_of_what_is_logged_evenly_or_shakes() -> None:
    run = _run(1, "even")
    usable = np.ones(len(run), dtype=bool)
    assert limit_slow_segments(run, usable, 0.001, STANDARD) == []
    rng = np.random.default_rng(1)
    shaken = Recording.from_arrays(
        time_s=run.time_s + 0.004 * rng.uniform(-1.0, 1.0, len(run)),
        force_n=run.force_n,
        pressure_mbar=run.sensor.values,
    )
    assert limit_slow_segments(shaken, usable, 0.035, STANDARD) == []


def test_a_hold_may_be_logged_ever_more_slowly() -> None:
    """Relaxation tests are: no load moves between the samples, so that no fit has to follow one there."""
    ramp, hold = np.arange(0.0, 10.0, 0.02), 10.0 + np.geomspace(0.02, 290.0, 120)
    time_s = np.concatenate([start + np.concatenate([ramp, hold]) for start in (0.0, 300.02)])
    load = 40.0 * np.minimum(np.fmod(time_s, 300.02), 10.0)
    noise = 0.02 * np.random.default_rng(4).standard_normal(time_s.size)
    runs = [
        Recording.from_arrays(time_s=time_s, force_n=load, pressure_mbar=0.25 * load + noise, name=name)
        for name in ("one", "other")
    ]
    ready = prepared(runs, 2, examine(runs, STANDARD), STANDARD)
    assert not any("of it is not used" in one for one in ready.limits)
    for one in ready.sessions:
        held = one.conditions.load > 0.99
        assert one.usable[held].mean() > 0.99
        assert np.allclose(one.reading[held & one.usable], one.conditions.load[held & one.usable], atol=0.002)
