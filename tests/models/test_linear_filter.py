"""The compiled filter is scipy's, bit for bit."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from smartshoe.kernels.linear_filter import linear_filter


@pytest.mark.parametrize(("top", "bottom"), [(1, 1), (2, 2), (1, 2), (2, 1), (3, 3), (1, 4), (5, 2)])
def test_numbers_and_state_are_those_of_scipy(top: int, bottom: int) -> None:
    rng = np.random.default_rng(10 * top + bottom)
    numerator, denominator = rng.normal(size=top), np.concatenate([[1.0], 0.3 * rng.normal(size=bottom - 1)])
    values, state = rng.normal(size=1000), rng.normal(size=max(top, bottom) - 1)
    expected, expected_state = lfilter(numerator, denominator, values, zi=state)
    found, left = linear_filter(numerator, denominator, values, state)
    np.testing.assert_array_equal(found, expected)
    np.testing.assert_array_equal(left, expected_state)


def test_a_denominator_that_is_not_monic_divides_both() -> None:
    values = np.arange(20.0)
    np.testing.assert_allclose(
        linear_filter([1.0, 0.5], [2.0, 0.4], values)[0], lfilter([1.0, 0.5], [2.0, 0.4], values), rtol=1e-14
    )
