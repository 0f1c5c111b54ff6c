"""White noise beside a signal: found whatever slow course lies below it."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from smartshoe.signals.noise import NORMAL_QUARTILE, robust_sd, white_noise_sd


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
