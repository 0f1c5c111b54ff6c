"""The zero follows a drift in swing, and never eats a load that stays."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shoes import RATE_HZ, feet_n, foot_n, made

from smartshoe.errors import UsageError
from smartshoe.gait.field import SwingZero
from smartshoe.gait.field._swing_zero import HOP_S, MOST, SLEW_PER_S

FULL_SCALE_N = 800.0
NOISE_N = 2.0  # 0.3 % of full scale: the filtered signal of Chinimilli 2016


def noisy(forces: np.ndarray, seed: int = 0) -> np.ndarray:
    return forces + NOISE_N * np.random.default_rng(seed).standard_normal(forces.shape)


@pytest.mark.parametrize("activity", ["slow walk", "walk", "fast walk", "run"])
def test_a_drift_is_followed_at_every_speed(activity: str) -> None:
    found = made(activity, 120.0)
    forces = foot_n(found, "left")
    drift = np.outer(np.linspace(0.0, 1.0, forces.shape[0]), [40.0, 20.0, 10.0, -15.0])
    zero = SwingZero(4, sample_rate_hz=RATE_HZ)
    out = zero.push(noisy(forces + drift))
    # It lags by up to three strides and a hop (4 s of a drift of 0.33 N/s), and carries 2 N of noise in the mean.
    assert np.abs((out - forces)[-2000:].mean(axis=0)).max() < 1.6
    assert zero.swings > 60


def test_a_constant_offset_goes_at_the_slew_and_no_faster() -> None:
    forces = foot_n(made("walk", 120.0), "left") + 50.0
    zero = SwingZero(4, sample_rate_hz=RATE_HZ)
    out = zero.push(forces)
    applied = (forces - out)[:, 0]
    per_s = SLEW_PER_S * FULL_SCALE_N
    steps = np.flatnonzero(np.diff(applied)) + 1
    # From any change to any later one no faster than the slew, plus what was saved up in the ten seconds before.
    for first in steps[::7]:
        for last in steps[steps > first][::7]:
            assert applied[last] - applied[first] <= per_s * ((last - first) / RATE_HZ + 1.5)
    assert applied[-1] == pytest.approx(50.0, abs=1.0)


@given(st.floats(-400.0, 400.0))
@settings(max_examples=15)
def test_it_never_goes_beyond_what_warm_air_does(offset_n: float) -> None:
    zero = SwingZero(4, sample_rate_hz=RATE_HZ, slew_per_s=1.0)
    zero.push(foot_n(made("walk", 30.0), "left") + offset_n)
    assert np.abs(zero.zero).max() <= MOST * FULL_SCALE_N
    if abs(offset_n) < MOST * FULL_SCALE_N:
        assert zero.zero == pytest.approx(offset_n, abs=1.0)


@pytest.mark.parametrize("activity", ["stand", pytest.param("tiptoe", marks=pytest.mark.long)])
def test_a_person_who_stands_for_an_hour_keeps_the_load(activity: str) -> None:
    forces = foot_n(made(activity, 3600.0), "right")
    zero = SwingZero(4, sample_rate_hz=RATE_HZ)
    out = zero.push(noisy(forces + np.array([0.0, 30.0, 0.0, 5.0])))
    assert zero.swings == 0
    assert (out - forces).mean(axis=0) == pytest.approx([0.0, 30.0, 0.0, 5.0], abs=0.05)


def test_standing_after_a_walk_keeps_the_load_and_the_zero_that_was_learnt() -> None:
    walk, stand = foot_n(made("walk", 90.0), "left") + 25.0, foot_n(made("stand", 600.0, seed=2), "left") + 25.0
    zero = SwingZero(4, sample_rate_hz=RATE_HZ)
    zero.push(noisy(walk))
    learnt = zero.zero.copy()
    assert learnt == pytest.approx([25.0] * 4, abs=1.0)
    out = zero.push(noisy(stand[1000:]))
    assert zero.zero == pytest.approx(learnt, abs=0.1)
    assert out.sum(axis=1).mean() == pytest.approx(stand[1000:].sum(axis=1).mean() - 100.0, abs=4.0)


@given(st.lists(st.tuples(st.floats(1.2, 8.0), st.floats(0.0, 600.0)), min_size=2, max_size=10))
@settings(max_examples=30)
def test_loads_that_stay_for_more_than_a_second_are_never_zeroed(parts: list[tuple[float, float]]) -> None:
    """Shifting weight from foot to foot, sitting down, standing up."""
    total = np.concatenate([np.full(round(length * RATE_HZ), load) for length, load in parts * 3])
    zero = SwingZero(4, sample_rate_hz=RATE_HZ)
    zero.push(noisy(np.outer(total, [0.1, 0.2, 0.2, 0.5])))
    assert not zero.zero.any()


def test_a_foot_that_rests_unloaded_is_no_swing() -> None:
    forces = np.zeros((6000, 4)) + 30.0
    zero = SwingZero(4, sample_rate_hz=RATE_HZ)
    zero.push(noisy(forces))
    assert not zero.zero.any()


@given(st.lists(st.integers(1, 700), min_size=1, max_size=25), st.integers(0, 3))
@settings(max_examples=15)
def test_any_chunking_gives_the_same(cuts: list[int], seed: int) -> None:
    forces = noisy(foot_n(made("walk", 30.0), "left") + 20.0, seed)
    forces[900:930, 2] = np.nan
    whole = SwingZero(4, sample_rate_hz=RATE_HZ).push(forces)
    stream = SwingZero(4, sample_rate_hz=RATE_HZ)
    edges = [0, *np.minimum(np.cumsum(cuts), forces.shape[0]).tolist(), forces.shape[0]]
    parts = [stream.push(forces[a:b]) for a, b in pairwise(edges)]
    assert np.array_equal(np.concatenate(parts), whole)


@given(st.floats(0.01, 100.0))
@settings(max_examples=15)
def test_scale_and_unit_do_not_matter(factor: float) -> None:
    forces = noisy(foot_n(made("walk", 30.0), "left") + 20.0)
    newton = SwingZero(4, sample_rate_hz=RATE_HZ)
    other = SwingZero(4, sample_rate_hz=RATE_HZ, full_scale=FULL_SCALE_N * factor)
    expected = newton.push(forces)
    np.testing.assert_allclose(other.push(forces * factor) / factor, expected, rtol=1e-9, atol=1e-9)
    assert other.swings == newton.swings > 0


def test_it_is_causal() -> None:
    forces = noisy(foot_n(made("walk", 30.0), "left") + 20.0)
    whole = SwingZero(4, sample_rate_hz=RATE_HZ).push(forces)
    for stop in (1000, 3333):
        assert np.array_equal(SwingZero(4, sample_rate_hz=RATE_HZ).push(forces[:stop]), whole[:stop])


def test_values_that_are_not_there_hold_the_last() -> None:
    zero = SwingZero(2, sample_rate_hz=RATE_HZ)
    out = zero.push([[np.nan, 1.0], [2.0, np.nan], [np.inf, 4.0]])
    assert out.tolist() == [[0.0, 1.0], [2.0, 1.0], [2.0, 4.0]]


def test_both_feet_of_a_walk_agree_with_the_truth_once_zeroed() -> None:
    found = made("walk", 120.0)
    for side, total in feet_n(found).items():
        zero = SwingZero(4, sample_rate_hz=RATE_HZ)
        out = zero.push(foot_n(found, side) + 30.0).sum(axis=1)
        # 4 units of 30 N each, but for the little that a shoe still bears in the middle of a swing.
        assert abs((out - total)[-4000:].mean()) < 2.0


def test_reset_forgets() -> None:
    forces = noisy(foot_n(made("walk", 30.0), "left") + 20.0)
    zero = SwingZero(4, sample_rate_hz=RATE_HZ)
    first = zero.push(forces)
    zero.reset()
    assert np.array_equal(zero.push(forces), first)


@pytest.mark.parametrize(
    ("arguments", "says"),
    [({"sample_rate_hz": 0.0}, "sample_rate_hz"), ({"full_scale": -1.0}, "full_scale"), ({"units": 0}, "units")],
)
def test_wrong_settings_are_said(arguments: dict[str, float], says: str) -> None:
    with pytest.raises(UsageError, match=says):
        SwingZero(**{"units": 4, "sample_rate_hz": 200.0, **arguments})  # type: ignore[arg-type]
    with pytest.raises(UsageError, match="shape"):
        SwingZero(4, sample_rate_hz=200.0).push(np.zeros((5, 3)))


def test_it_looks_no_more_often_than_it_says() -> None:
    forces = noisy(foot_n(made("walk", 30.0), "left") + 20.0)
    applied = forces - SwingZero(4, sample_rate_hz=RATE_HZ).push(forces)
    changes = np.flatnonzero(np.abs(np.diff(applied[:, 0])) > 1e-9) + 1
    assert changes.size
    assert not (changes % round(HOP_S * RATE_HZ)).any()


def test_the_harm_of_a_load_that_mimics_a_swing_is_bounded_by_the_slew() -> None:
    """Weight shifted in the rhythm of steps onto a foot that stays on the ground: not to be told from a zero."""
    seconds = 20
    stance, rest = np.full(round(0.6 * RATE_HZ), 400.0), np.full(round(0.5 * RATE_HZ), 60.0)
    total = np.tile(np.concatenate([stance, rest]), round(seconds / 1.1))
    zero = SwingZero(4, sample_rate_hz=RATE_HZ)
    zero.push(noisy(np.outer(total, [0.1, 0.2, 0.2, 0.5])))
    assert 0.0 < zero.zero.max() <= SLEW_PER_S * FULL_SCALE_N * seconds
