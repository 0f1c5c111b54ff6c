"""A recording on an even grid: what stands for each place of it, what rests, and the noise that is left of its load."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from smartshoe import Recording
from smartshoe.diagnosis import Thresholds
from smartshoe.diagnosis._averaging import kernel, smoothed
from smartshoe.diagnosis._denoise import followed_share, noise_sd, without_noise
from smartshoe.diagnosis._jittered import jitter_s, with_sampling_jitter
from smartshoe.diagnosis._scale import Scale
from smartshoe.diagnosis._session import Session, prepare
from smartshoe.integrity.thresholds import largest_of_noise
from smartshoe.units import MILLIBAR, VOLT

Array = NDArray[np.float64]

STANDARD = Thresholds()
STEP_S = 0.02
SCALE = Scale(800.0, 140.0, MILLIBAR)


def _course(*corners: tuple[int, float], begun: float = 0.0) -> Array:
    parts, at = [np.full(1, begun)], begun
    for steps, share in corners:
        parts.append(np.linspace(at, share, steps + 1)[1:])
        at = share
    return np.concatenate(parts)


def _prepared(run: Recording, scale: Scale = SCALE, factor: int = 1) -> Session:
    return prepare([run], [np.ones(len(run), dtype=bool)], [False], scale, [factor], STANDARD)[0]


def _pressed(load: Array, reading: Array | None = None, unit: str = "mbar") -> Recording:
    shown = {f"pressure_{unit}": 140.0 * (load if reading is None else reading)}
    return Recording.from_arrays(time_s=STEP_S * np.arange(load.size), force_n=800.0 * load, **shown)


def test_each_place_of_an_even_grid_is_of_the_sample_that_is_near() -> None:
    """Time stamps that scatter, and a gap of some samples."""
    rng = np.random.default_rng(3)
    time_s = STEP_S * np.arange(400) + 0.3 * STEP_S * rng.uniform(-1.0, 1.0, 400)
    time_s[0] = 0.0
    time_s = np.delete(time_s, np.arange(150, 158)) + 7.0
    load = 0.5 + 0.4 * np.sin(time_s)
    reading = 0.5 * load
    reading[[60, 300]] = np.nan
    run = Recording.from_arrays(
        time_s=time_s, force_n=800.0 * load, pressure_mbar=140.0 * reading, pressure_2_mbar=14.0 * time_s,
        temperature_k=300.0 + time_s,
    )  # fmt: skip
    assert not run.is_uniform
    session = _prepared(run)
    step_s, t = run.sample_time_s, time_s - time_s[0]
    count = math.floor(t[-1] / step_s) + 1
    even = np.array([k * step_s for k in range(count)])
    assert session.conditions.time_s == pytest.approx(even)
    good = []
    for at in even:
        later = [k for k in range(t.size) if t[k] >= at - 0.5 * step_s]
        nearest = later[0] if later else t.size - 1
        good.append(bool(np.isfinite(reading[nearest])) and abs(t[nearest] - at) < step_s)
    kept = smoothed(np.array(good, dtype=float), kernel(3), 1) > 0.7
    assert list(np.flatnonzero(session.usable != kept)) == []
    assert 8 <= np.count_nonzero(~kept) <= 24
    present = np.isfinite(reading)
    bridged = np.interp(t, t[present], reading[present])
    assert session.reading == pytest.approx(smoothed(np.interp(even, t, bridged), kernel(3), 1), abs=1e-9)
    beside = session.conditions
    assert beside.temperature_k == pytest.approx(smoothed(np.interp(even, t, t), kernel(3), 1))
    assert beside.neighbour == pytest.approx(0.1 * smoothed(np.interp(even, t, time_s), kernel(3), 1))


def _levels(*levels: float) -> Array:
    """Long rests at such levels, and ways between them."""
    corners: list[tuple[int, float]] = []
    for level in levels:
        corners += [(60, level), (100, level)]
    return _course(*corners, begun=levels[0])


def _resting(session: Session, level: float) -> bool:
    load = session.conditions.load
    there = np.abs(load - level) < 1e-4
    assert there.sum() > 50
    (told,) = set(session.resting[there])
    return bool(told)


@pytest.mark.parametrize(
    ("levels", "resting"),
    [
        # Within two hundredths of the lowest load, or of nothing where that is higher.
        ((0.0, 1.0, 0.019, 0.9, 0.021, 1.0), {0.0: True, 0.019: True, 0.021: False, 1.0: False}),
        ((-0.05, 1.0, 0.0, 0.9, -0.031, 1.0), {-0.05: True, -0.031: True, 0.0: False}),
        ((0.1, 1.0, 0.3, 0.9), {0.1: False, 0.3: False}),
        ((0.01, 1.0, 0.029, 0.9, 0.031, 0.8), {0.01: True, 0.029: True, 0.031: False}),
    ],
)
def test_a_unit_rests_within_what_stands_still_about_its_lowest_load(
    levels: tuple[float, ...], resting: dict[float, bool]
) -> None:
    session = _prepared(_pressed(_levels(*levels)))
    for level, told in resting.items():
        assert _resting(session, level) is told


def test_a_gauge_that_reads_nothing_tells_that_a_tare_is_a_rest() -> None:
    load = _levels(0.3, 1.0, 0.3, 0.9)
    bare = np.where(load < 0.31, 0.0, load)
    assert _resting(_prepared(_pressed(load, bare)), 0.3)
    assert not _resting(_prepared(_pressed(load)), 0.3)
    volts = Scale(800.0, 140.0, VOLT)
    assert not _resting(_prepared(_pressed(load, bare, "v"), volts), 0.3)
    # Where the load falls lower later on that is its rest.
    lower = _levels(0.3, 1.0, 0.1, 0.9)
    session = _prepared(_pressed(lower, np.where(lower < 0.31, 0.0, lower)))
    assert (_resting(session, 0.1), _resting(session, 0.3)) == (True, False)


@pytest.mark.parametrize("factor", [1, 5])
def test_a_load_is_without_its_noise_and_level_at_rest_and_what_is_left_is_said(factor: int) -> None:
    rng = np.random.default_rng(5)
    load = _levels(0.0, 1.0, 0.0, 0.6, 0.0) + 1e-3 * rng.standard_normal(801)
    read = load - 1e-3 * np.random.default_rng(6).standard_normal(801)  # which does not follow the load's noise
    session = _prepared(_pressed(load, read), factor=factor)
    raw = noise_sd(load, STANDARD)
    quiet, left, _ = without_noise(load, STEP_S, raw, STANDARD)
    assert session.denoised.raw_sd == pytest.approx(raw)
    assert session.denoised.remaining_sd == pytest.approx(left)
    assert session.denoised.load == pytest.approx(quiet)
    weights = kernel(max(factor, 3))
    assert session.conditions.load_noise == pytest.approx(left * math.sqrt(float(np.sum(weights**2))))
    base = min(float(np.quantile(quiet, 0.02)), 0.02, float(quiet[0]))
    level = quiet.copy()
    reach = largest_of_noise(801, STANDARD) * raw
    below = np.flatnonzero(quiet < base + 0.005)
    for run in np.split(below, np.flatnonzero(np.diff(below) > 1) + 1):
        near = run[np.abs(quiet[run] - np.median(quiet[run])) < reach]
        if near.size > 10:
            level[near] = quiet[near].mean()
    assert session.conditions.load == pytest.approx(smoothed(level, weights, factor), abs=1e-12)


@pytest.mark.parametrize("late", [0, 3])
def test_what_a_reading_follows_is_no_noise_of_its_load(late: int) -> None:
    """A shaker moves a load as fast as noise does, and is read, or some samples later."""
    rng = np.random.default_rng(7)
    shaken = 0.5 + 0.1 * rng.standard_normal(4000)
    reading = np.roll(0.8 * shaken, late) + 0.01 * rng.standard_normal(4000)
    # Of the reading's variance the noise is a share of (0.01/0.08)^2.
    assert followed_share(shaken, reading, STANDARD) == pytest.approx(1.0 / (1.0 + 0.125**2), abs=0.01)
    session = _prepared(_pressed(shaken, reading))
    assert session.denoised.raw_sd == pytest.approx(
        0.0125, rel=0.1
    )  # in shares of the load: what the reading's own hides
    assert noise_sd(shaken, STANDARD) > 0.09
    for other, share in ((rng.standard_normal(4000), 0.0), (shaken + 0.3 * rng.standard_normal(4000), 0.0)):
        assert followed_share(shaken, other, STANDARD) == share  # none of it, or not nearly all
    # Too few places to tell: each has nine before it, of which none is a corner's.
    assert followed_share(shaken[:40], reading[:40], STANDARD) == 0.0
    assert followed_share(shaken[:8], reading[:8], STANDARD) == 0.0
    assert followed_share(shaken, np.ones(4000), STANDARD) == 0.0


def test_of_a_long_load_every_so_many_samples_tell_the_lowest() -> None:
    load = np.tile(_levels(-0.05, 1.0), 40)
    assert load.size > 10_000
    session = _prepared(_pressed(load))
    assert _resting(session, -0.05)


def test_a_reading_that_follows_a_jittered_load_in_each_sample_shows_no_jitter() -> None:
    rng = np.random.default_rng(1)
    time_s = STEP_S * np.arange(3000)
    course = np.clip(3.0 * np.abs((time_s / 2.5) % 2.0 - 1.0) - 1.0, 0.0, 1.0)
    shaken = np.interp(time_s + 0.03 * rng.standard_normal(3000), time_s, course) + 1e-3 * rng.standard_normal(3000)
    noise = 1e-3 * rng.standard_normal(3000)
    assert jitter_s(course, shaken, STEP_S) == pytest.approx(0.03, rel=0.2)
    assert jitter_s(shaken, 2.0 * shaken + noise, STEP_S) == 0.0
    told: Any = jitter_s(course, -3.0 * shaken, STEP_S)
    assert told == pytest.approx(jitter_s(course, shaken, STEP_S))


def test_a_load_is_smoothed_by_the_jitter_of_what_it_was_smoothed_to() -> None:
    rng = np.random.default_rng(1)
    time_s = 0.02 * np.arange(3000)
    load = np.clip(3.0 * np.abs((time_s / 2.5) % 2.0 - 1.0) - 1.0, 0.0, 1.0)
    reading = 1.3 * np.interp(time_s + 0.03 * rng.standard_normal(3000), time_s, load)
    reading += 1e-3 * rng.standard_normal(3000)
    seen = load
    for _ in range(3):
        sd = jitter_s(seen, reading, 0.02) / 0.02
        assert sd > 1.0
        seen = gaussian_filter1d(load, sd, mode="nearest")
    assert with_sampling_jitter(load, reading, 0.02, STANDARD) == pytest.approx(seen)
    assert jitter_s(0.0 * load, reading, 0.02) == 0.0
    # What is later than any echo is no jitter, and what does not fit better is none either.
    assert with_sampling_jitter(load, reading, 0.02, replace(STANDARD, echo_s=0.02)) is load
    # Whatever the gain between them.
    assert jitter_s(load, 7.0 * reading, 0.02) == pytest.approx(jitter_s(load, reading, 0.02))
