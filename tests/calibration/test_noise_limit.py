"""What alternates is passed as often as asked, a hold as it is, a ramp late by what is told."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from smartshoe.calibration._noise_limit import NoiseLimit, noise_gain

TIMES = np.zeros(4000)


@settings(max_examples=20)
@given(st.floats(0.02, 1.0))
def test_an_alternating_signal_is_passed_by_the_gain_and_a_hold_as_it_is(gain: float) -> None:
    limit = NoiseLimit(gain)
    assert abs(limit.push(np.resize([1.0, -1.0], 4000), TIMES)[-1]) == pytest.approx(gain, rel=1e-9)
    limit.reset()
    assert limit.push(np.full(50, 7.0), TIMES[:50]) == pytest.approx(np.full(50, 7.0), rel=1e-12)


@settings(max_examples=20)
@given(st.floats(0.02, 1.0))
def test_a_ramp_is_late_by_the_lag_that_is_told(gain: float) -> None:
    limit, ramp = NoiseLimit(gain), np.arange(4000.0)
    assert ramp[-1] - limit.push(ramp, TIMES)[-1] == pytest.approx(limit.lag_steps, rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("gain", [0.05, 0.3])
def test_the_gain_for_noise_knows_nothing_of_what_came_before_and_leaves_nothing_behind(gain: float) -> None:
    limit = NoiseLimit(gain)
    limit.push(np.full(10, 1e15), TIMES[:10])  # of which a part in 10^13 is left after 64 samples
    assert noise_gain(limit) == pytest.approx(gain, rel=1e-2)
    assert limit.push(np.full(5, 3.0), TIMES[:5]) == pytest.approx(np.full(5, 3.0), rel=1e-12)
