"""The closed-form Preisach operator against relays that are switched one by one, and its laws."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from simulators.plant.preisach import MEMORY, everett, loop_shape, mean_curve, relays_up

loads = st.lists(st.floats(0, 1000), min_size=1, max_size=20)
shapes = st.builds(loop_shape, st.floats(5, 100), st.floats(0.05, 1), st.just(800.0)).map(lambda pair: pair[0])


class Operator:
    def __init__(self, shape: np.ndarray) -> None:
        self.shape, self.count = shape, 1
        self.turning, self.partial = np.zeros(MEMORY), np.zeros(MEMORY)

    def __call__(self, load_n: float) -> float:
        share, self.count = relays_up(load_n, self.turning, self.partial, self.count, self.shape)
        return share


def relay_by_relay(shape: np.ndarray, history: list[float]) -> list[float]:
    """160 x 160 relays at the midpoints of equal shares of the density."""
    r_low, r_high, low, high = shape
    share = (np.arange(160) + 0.5) / 160
    fine = np.linspace(0, 1, 4001)
    centre = low + (high - low) * np.interp(share, fine**2 * (3 - 2 * fine), fine)
    r = (r_low + (r_high - r_low) * share)[:, None]
    up = np.zeros((160, 160), dtype=bool)
    result = []
    for load_n in history:
        up = np.where(load_n >= centre + r, True, np.where(load_n <= centre - r, False, up))
        result.append(float(up.mean()))
    return result


@settings(max_examples=40, deadline=None)
@given(shape=shapes, history=loads)
def test_closed_form_equals_relays_one_by_one(shape, history):
    operator = Operator(shape)
    # Each relay line may be off by one relay in 160.
    assert [operator(x) for x in history] == pytest.approx(relay_by_relay(shape, history), abs=1.5 / 160)


@settings(max_examples=40, deadline=None)
@given(shape=shapes, history=loads, pieces=st.integers(2, 7))
def test_only_turning_points_count(shape, history, pieces):
    direct, finely = Operator(shape), Operator(shape)
    last = 0.0
    for load_n in history:
        for share in np.linspace(0, 1, pieces + 1)[1:]:
            through = finely(load_n if share == 1 else last + share * (load_n - last))
        assert through == pytest.approx(direct(load_n), abs=1e-12)
        last = load_n


@settings(max_examples=40, deadline=None)
@given(shape=shapes, history=loads, top=st.floats(0, 1500))
def test_a_larger_maximum_wipes_out_the_past_and_zero_load_all_of_it(shape, history, top):
    operator, fresh = Operator(shape), Operator(shape)
    for load_n in history:
        operator(load_n)
    top = max(top, *history) + 1
    assert operator(top) == pytest.approx(fresh(top), abs=1e-12)
    assert operator(0.0) == 0.0
    assert operator(300.0) == pytest.approx(Operator(shape)(300.0), abs=1e-12)


@settings(max_examples=40, deadline=None)
@given(shape=shapes, lower=st.floats(0, 900), step=st.floats(0, 300), more=st.floats(0, 100))
def test_everett_function_grows_with_the_triangle(shape, lower, step, more):
    inner = everett(lower + step, lower, shape)
    assert -1e-12 <= inner <= everett(lower + step + more, lower, shape) + 1e-12
    assert inner <= everett(lower + step, lower - more, shape) + 1e-12


def test_deep_nesting_beyond_the_memory_forgets_the_smallest_loops_only():
    shape, _ = loop_shape(5.0, 1.0, 800.0)
    operator = Operator(shape)
    swing = 400 * 0.995 ** np.arange(3 * MEMORY) * (-1.0) ** np.arange(3 * MEMORY)
    shares = [operator(400 + x) for x in swing]
    assert np.isfinite(shares).all()
    assert operator.count < MEMORY
    fresh = Operator(shape)
    assert operator(900.0) == pytest.approx(fresh(900.0), abs=1e-12)


def test_loop_is_closed_at_zero_load_and_its_half_width_is_what_is_said():
    shape, half = loop_shape(40.0, 0.9, 800.0)
    operator = Operator(shape)
    up = np.linspace(0, 1500, 3001)
    rising = np.array([operator(x) for x in up])
    falling = np.array([operator(x) for x in up[::-1]])[::-1]
    assert mean_curve(0.0, shape) == rising[0] == falling[0] == 0.0
    assert (falling - rising).max() / 2 == pytest.approx(half, rel=1e-3)
    assert 0.5 * (falling + rising) == pytest.approx(np.array([mean_curve(x, shape) for x in up]), abs=1e-12)
