"""White noise beside a signal: found whatever slow course lies below it."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from smartshoe.signals.noise import NORMAL_QUARTILE, is_switched, robust_sd, white_noise_sd


@given(seed=st.integers(0, 2**32 - 1), sd=st.floats(1e-3, 1e3), order=st.sampled_from([2, 3]))
def test_the_noise_is_found_beside_any_course_that_differences_take_off(seed: int, sd: float, order: int) -> None:
    rng = np.random.default_rng(seed)
    at = np.linspace(-1.0, 1.0, 3000)
    course = np.polynomial.Polynomial(10.0 * sd * rng.standard_normal(order))(at)
    noise = sd * rng.standard_normal(at.size)
    assert white_noise_sd(noise + course, order=order) == pytest.approx(white_noise_sd(noise, order=order), rel=1e-6)
    # A median of 3000 correlated differences has a standard error of some 3 %.
    assert white_noise_sd(noise, order=order) == pytest.approx(sd, rel=0.2)
    assert white_noise_sd(noise, noise, order=order, most=1000) == pytest.approx(sd, rel=0.3)


@given(values=st.lists(st.floats(-1e6, 1e6), min_size=1, max_size=30))
def test_the_robust_sd_is_the_median_of_the_size(values: list[float]) -> None:
    given_ = np.array(values)
    assert robust_sd(given_) == pytest.approx(float(np.median(np.abs(given_))) / NORMAL_QUARTILE, rel=1e-12)


def test_signals_too_short_have_none() -> None:
    assert white_noise_sd(np.zeros(3), order=3) == 0.0
    assert robust_sd(np.zeros(0)) == 0.0


@pytest.mark.parametrize("levels", [(0.0, 5.0), (0.0, 200.0, 400.0, 600.0, 800.0)])
@pytest.mark.parametrize("stays", [2, 3, 10])
@pytest.mark.parametrize("seed", range(5))
def test_what_stays_on_a_few_levels_is_switched(levels: tuple[float, ...], stays: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    assert is_switched(np.repeat(rng.choice(levels, 400), stays), 5, 1e-4)


@pytest.mark.parametrize("seed", range(5))
def test_what_toggles_between_steps_of_a_grid_is_not(seed: int) -> None:
    rng = np.random.default_rng(seed)
    assert not is_switched(rng.choice([0.0, 0.1], 2000, p=[0.7, 0.3]), 5, 1e-4)
    assert not is_switched(np.rint(0.6 * rng.standard_normal(2000)), 5, 1e-4)
    assert not is_switched(rng.standard_normal(2000), 5, 1e-4)
    # A staircase of more levels, a constant, and a single sample beside it.
    assert not is_switched(np.repeat(np.arange(6.0), 50), 5, 1e-4)
    assert not is_switched(np.zeros(200), 5, 1e-4)
    assert not is_switched((np.arange(200) == 90).astype(float), 5, 1e-4)
