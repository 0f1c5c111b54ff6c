"""Readings that a logger holds while the signal's own motion hides the noise, and what stands there by itself."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d

from smartshoe.arrays import Array
from smartshoe.integrity import examine
from smartshoe.integrity._noise_beside import noise_under_motion
from smartshoe.integrity.thresholds import Thresholds
from smartshoe.recording import Recording

COUNT = 6000
STANDARD = Thresholds()


def load(seed: int, smooth: float) -> Array:
    """(n,) a random load of 0 to 1 that is smooth over as many samples."""
    walk = gaussian_filter1d(np.random.default_rng(seed).standard_normal(COUNT), smooth, truncate=8.0)
    return np.asarray((walk - walk.min()) / np.ptp(walk))


def noise(seed: int, share: float) -> Array:
    return share * np.random.default_rng(seed + 500).standard_normal(COUNT)


def held(reading: Array, starts: Array, length: int) -> tuple[Array, Array]:
    """(n,) the ``reading`` with ``length`` equal samples from each of ``starts`` on, and (n,) which ones repeat."""
    out, repeats = reading.copy(), np.zeros(COUNT, dtype=bool)
    for start in starts:
        out[start : start + length] = reading[start]
        repeats[start + 1 : start + length] = True
    return out, repeats


def left_out(load_share: Array, reading: Array) -> Array:
    """(n,) what `examine` masks of a unit of 500 N and 100 mbar."""
    time_s = 0.01 * np.arange(COUNT)
    given = Recording.from_arrays(time_s=time_s, force_n=500.0 * load_share, pressure_mbar=100.0 * reading)
    return np.asarray(~examine([given]).usable[0])


def friction(load_share: Array, width: float) -> Array:
    out, state = np.empty(COUNT), load_share[0]
    for k, value in enumerate(load_share):
        out[k] = state = min(max(state, value - width), value + width)
    return out


STARTS = np.array([700, 1501, 2333, 3000, 4242])


@pytest.mark.parametrize("grid", [0.0, 1e-5])
@pytest.mark.parametrize(("smooth", "length"), [(6.0, 5), (6.0, 8), (6.0, 12), (10.0, 5), (20.0, 8)])
@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.long) for seed in (1, 2))])
def test_what_repeats_beside_noise_is_held_however_fast_the_signal_moves(
    seed: int, smooth: float, length: int, grid: float
) -> None:
    """And however little: none of these readings repeats by chance."""
    share = load(seed, smooth)
    reading = share + noise(seed, 1e-3)
    reading = np.rint(reading / grid) * grid if grid else reading
    assert not left_out(share, reading).any()
    reading, repeats = held(reading, STARTS, length)
    found = left_out(share, reading)
    assert not found[~repeats].any()
    assert found[repeats].mean() > 0.79  # one run of five may be taken for friction


@pytest.mark.parametrize("smooth", [8.0, 20.0])
@pytest.mark.parametrize("seed", range(3))
def test_friction_without_noise_is_not_held(seed: int, smooth: float) -> None:
    share = load(seed, smooth)
    assert not left_out(share, friction(share, 0.05)).any()


@pytest.mark.parametrize("seed", range(3))
def test_a_dead_band_amid_the_readings_is_not_held_though_noise_comes_before_it(seed: int) -> None:
    share = load(seed, 6.0)
    pulled = share + noise(seed, 1e-3) - 0.5
    dead = np.sign(pulled) * np.maximum(np.abs(pulled) - 0.1, 0.0)
    assert left_out(share, dead).mean() < 0.01


@pytest.mark.parametrize("steps", [0.3, 1.0, 3.0])
@pytest.mark.parametrize("seed", range(3))
def test_readings_on_a_grid_as_coarse_as_their_noise_are_not_held(seed: int, steps: float) -> None:
    share = load(seed, 6.0)
    grid = 1e-3 / steps
    assert not left_out(share, np.rint((share + noise(seed, 1e-3)) / grid) * grid).any()


def under_motion(reading: Array, start: int, length: int, least: float = 0.0) -> float:
    where = np.array([start]), np.array([start + length - 1])
    return float(noise_under_motion(reading, *where, np.array([True]), least, STANDARD)[0])


def test_the_noise_is_seen_beside_a_run_and_corners_do_not_raise_it() -> None:
    size = [under_motion(held(load(7, 6.0) + noise(s, 1e-3), [2000], 8)[0], 2000, 8) for s in range(40)]
    assert np.median(size) == pytest.approx(1e-3, rel=0.25)  # the lesser of two sides
    corners = np.interp(np.arange(COUNT), np.arange(0, COUNT, 11), np.arange(546) % 2) + noise(1, 1e-6)
    assert under_motion(held(corners, [2000], 8)[0], 2000, 8) < 1e-5


def test_no_noise_is_seen_where_there_is_none_or_less_than_asked_or_at_an_end() -> None:
    assert under_motion(held(load(7, 6.0), [2000], 8)[0], 2000, 8) < 1e-5
    noisy = held(load(7, 6.0) + noise(7, 1e-3), [2000, 10], 8)[0]
    assert under_motion(noisy, 2000, 8, 1e-4) > 0.0
    assert under_motion(noisy, 2000, 8, 2e-2) == 0.0
    assert under_motion(noisy, 10, 8) == 0.0
    assert under_motion(noisy[:4], 0, 2) == 0.0
