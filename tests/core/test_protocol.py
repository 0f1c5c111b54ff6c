"""Protocols as the paper gives them (Section III, Fig. 4), and their limits."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from smartshoe.errors import LimitError
from smartshoe.protocol import MachineLimits, dynamic_protocol, static_protocol


def test_static_protocol_is_the_papers() -> None:
    protocol = static_protocol()
    time_s, load_n = protocol.corners()
    assert protocol.peak_load_n == 800.0
    # The first press: 45 N in 0.9 s, the last 5 N in 5 s, 5 s of hold, 1 s down, 5 s of rest.
    np.testing.assert_allclose(time_s[:6], [0, 0.9, 5.9, 10.9, 11.9, 16.9])
    np.testing.assert_allclose(load_n[:6], [0, 45, 50, 50, 0, 0])
    assert sum(segment.kind == "hold" for segment in protocol.segments) == 16
    assert protocol.peak_rate_n_per_s == pytest.approx(50.0)


@given(
    st.lists(st.floats(10, 900), min_size=1, max_size=5),
    st.floats(50, 1500),
    st.integers(1, 3),
    st.sampled_from([0.0, 0.5, 5.0]),
)
def test_dynamic_protocol_climbs_and_falls_at_each_rate(
    rates: list[float], peak: float, repeats: int, rest: float
) -> None:
    protocol = dynamic_protocol(rates, peak_n=peak, repeats=repeats, rest_s=rest)
    time_s, load_n = protocol.corners()
    slopes = np.abs(np.diff(load_n) / np.diff(time_s))
    climbing = slopes[slopes > 0]
    np.testing.assert_allclose(climbing, np.repeat(rates, 2 * repeats), rtol=1e-9)
    assert load_n.max() == pytest.approx(peak)
    assert load_n[-1] == 0.0


def test_limits_name_what_is_too_much() -> None:
    with pytest.raises(LimitError, match=r"2500 N.*2000 N"):
        dynamic_protocol(peak_n=2500.0).check(MachineLimits(load_n=2000.0))
    with pytest.raises(LimitError, match="N/s"):
        dynamic_protocol().check(MachineLimits(rate_n_per_s=100.0))


@pytest.mark.parametrize("rate", [0.0, -50.0, float("nan")])
def test_rates_that_are_no_rates_are_refused(rate: float) -> None:
    with pytest.raises(LimitError, match="positive"):
        dynamic_protocol([rate])
