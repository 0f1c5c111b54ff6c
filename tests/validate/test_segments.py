"""Cycles and rates are found again in noisy loads that were drawn with known rates."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from smartshoe.validate import find_cycles, group_by_rate


def _triangles(rates: list[float], low_n: float, high_n: float, rest_s: float, hold_s: float):
    corners = [(0.0, low_n)]
    for rate in rates:
        time = corners[-1][0]
        up = (high_n - low_n) / rate
        corners += [
            (time + rest_s + 0.01, low_n),
            (time + rest_s + up, high_n),
            (time + rest_s + up + hold_s + 0.01, high_n),
            (time + rest_s + 2 * up + hold_s + 0.01, low_n),
        ]
    corners.append((corners[-1][0] + rest_s + 0.5, low_n))
    at, load = np.array(corners).T
    time_s = np.arange(0.0, at[-1], 0.01)
    return time_s, np.interp(time_s, at, load)


@settings(max_examples=25)
@given(
    rates=st.lists(st.sampled_from([50.0, 100.0, 200.0, 400.0, 600.0, 800.0]), min_size=1, max_size=5),
    noise_n=st.floats(0.0, 5.0),
    rest_s=st.sampled_from([0.0, 1.0, 5.0]),
    hold_s=st.sampled_from([0.0, 2.0]),
    seed=st.integers(0, 2**31),
)
def test_drawn_rates_are_recovered(rates, noise_n, rest_s, hold_s, seed):
    time_s, load_n = _triangles(rates, 0.0, 800.0, rest_s, hold_s)
    noisy = load_n + np.random.default_rng(seed).normal(0.0, noise_n, load_n.size)
    cycles = find_cycles(time_s, noisy)
    assert len(cycles) == len(rates)
    # A ramp's slope has sd noise / (length * sqrt(n / 12)): under 1 % for 60 samples or more at 5 N.
    for cycle, rate in zip(cycles, rates, strict=True):
        assert cycle.loading_rate_n_per_s == pytest.approx(rate, rel=0.03)
        assert cycle.unloading_rate_n_per_s == pytest.approx(-rate, rel=0.03)


def test_strokes_that_never_rest_are_cycles_from_least_to_least():
    time_s, load_n = _triangles([10.0] * 4, 150.0, 185.0, 0.0, 0.0)
    noisy = load_n + np.random.default_rng(3).normal(0.0, 0.1, load_n.size)
    cycles = find_cycles(time_s, noisy)
    assert len(cycles) == 4
    assert all(cycle.low_n == pytest.approx(150.0, abs=1.0) for cycle in cycles)


def test_a_flat_noisy_load_has_no_cycle():
    assert find_cycles(np.arange(500) * 0.01, np.random.default_rng(1).normal(0.0, 3.0, 500)) == ()


def test_rates_within_ten_percent_are_one_group():
    groups = group_by_rate([101.0, 795.0, 99.0, 805.0, 50.0])
    assert [group.rate_n_per_s for group in groups] == [50.0, 100.0, 800.0]
    assert [group.indices for group in groups] == [(4,), (0, 2), (1, 3)]
