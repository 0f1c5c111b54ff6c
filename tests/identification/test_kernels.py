"""The compiled passes beside `PredictionError`'s against plain numpy."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from smartshoe.kernels.first_order import COLUMNS, respond
from smartshoe.kernels.residual import lagged_products, orthogonalise
from smartshoe.kernels.shift import shift
from smartshoe.kernels.srivc import INSTRUMENT, REGRESSOR, TARGET, delayed_products, instrument_products
from smartshoe.models.first_order import as_kernels_take, interpolation_taps, lag

SEEDS = st.integers(0, 2**32 - 1)


@given(seed=SEEDS, samples=st.integers(1, 1500), by=st.floats(-40.0, 40.0), rate=st.floats(0.1, 200.0))
@settings(max_examples=40)
def test_a_shift_is_the_sum_of_weighted_neighbours(seed: int, samples: int, by: float, rate: float) -> None:
    u = np.random.default_rng(seed).standard_normal(samples)
    value, slope = np.empty(samples), np.empty(samples)
    shift(u, by, rate, value, slope)
    whole = int(np.floor(by))
    taps, slopes = interpolation_taps(by - whole)
    neighbours = u[np.clip(np.arange(samples)[:, np.newaxis] + whole - 7 + np.arange(16), 0, samples - 1)]
    np.testing.assert_allclose(value, neighbours @ taps, rtol=0, atol=1e-12)
    np.testing.assert_allclose(slope, rate * (neighbours @ slopes), rtol=0, atol=1e-11 * rate)


@given(
    seed=SEEDS, samples=st.integers(2, 900), pole=st.floats(0.02, 60.0), even=st.booleans(), begin_s=st.floats(0.0, 1.0)
)  # fmt: skip
@settings(max_examples=40)
def test_a_response_is_the_plain_lags(seed: int, samples: int, pole: float, even: bool, begin_s: float) -> None:
    rng = np.random.default_rng(seed)
    step = 0.01 if even else rng.uniform(0.004, 0.03, samples - 1)
    u, out = rng.standard_normal(samples), np.empty(samples)
    respond(u, *as_kernels_take(step), begin_s, pole, 1.5, -0.7, 0.3, 2.0, out)
    time_s = begin_s + np.concatenate([[0.0], np.cumsum(np.broadcast_to(step, samples - 1))])
    w = lag(u, pole, step)
    expected = 1.5 * (u - w) - 0.7 * w + 0.3 + 2.0 * np.exp(-pole * time_s)
    np.testing.assert_allclose(out, expected, rtol=0, atol=1e-9)


@given(seed=SEEDS, samples=st.integers(2, 900), pole=st.floats(0.02, 60.0), even=st.booleans(), gaps=st.booleans())
@settings(max_examples=40)
def test_the_instruments_products_are_those_of_plain_filters(
    seed: int, samples: int, pole: float, even: bool, gaps: bool
) -> None:
    rng = np.random.default_rng(seed)
    step = 0.01 if even else rng.uniform(0.004, 0.03, samples - 1)
    u, y, x = rng.standard_normal((3, samples))
    counted = rng.random(samples) < 0.8 if gaps else np.zeros(0, dtype=bool)
    products = np.zeros((COLUMNS, COLUMNS))
    instrument_products(u, y, x, counted, *as_kernels_take(step), pole, products)
    fade = np.exp(-pole * np.concatenate([[0.0], np.cumsum(np.broadcast_to(step, samples - 1))]))
    slow_u, slow_y, slow_x = (lag(signal, pole, step) for signal in (u, y, x))
    columns = np.zeros((COLUMNS, samples))
    columns[INSTRUMENT], columns[REGRESSOR], columns[TARGET] = -slow_x / pole, -slow_y / pole, y - slow_y
    columns[1], columns[2], columns[3], columns[4] = u - slow_u, slow_u / pole, 1.0, fade
    kept = columns[:, counted] if gaps else columns
    size = np.sqrt(np.einsum("ij,ij->i", columns, columns)) + 1e-300
    assert products / np.outer(size, size) == pytest.approx(kept @ kept.T / np.outer(size, size), abs=1e-11)


@given(seed=SEEDS, shifts=st.integers(1, 12), stride=st.integers(1, 4), samples=st.integers(1, 300))
@settings(max_examples=30)
def test_delayed_products_are_correlations(seed: int, shifts: int, stride: int, samples: int) -> None:
    rng = np.random.default_rng(seed)
    u, w = rng.standard_normal((2, samples + (shifts - 1) * stride))
    y, inside, out = rng.standard_normal(samples), (rng.random(samples) < 0.8).astype(float), np.empty((shifts, 7))
    delayed_products(u, w, y, inside, stride, out)
    pairs = [(u, inside), (w, inside), (u * u, inside), (u * w, inside), (w * w, inside), (u, y), (w, y)]
    expected = np.stack([np.correlate(signal, mate)[::stride] for signal, mate in pairs], axis=1)
    assert out == pytest.approx(expected, abs=1e-10)


@given(seed=SEEDS, samples=st.integers(1, 3000), lags=st.integers(0, 20), share=st.sampled_from([0.0, 0.001, 0.3]))
@settings(max_examples=40)
def test_lagged_products_count_pairs_of_counted_samples(seed: int, samples: int, lags: int, share: float) -> None:
    rng = np.random.default_rng(seed)
    counted = rng.random(samples) >= share
    signal = rng.standard_normal(samples) * counted
    products, pairs = np.zeros(lags + 1), np.zeros(lags + 1, dtype=int)
    lagged_products(signal, counted, products, pairs)
    for by in range(lags + 1):
        later, earlier = slice(by, None), slice(0, max(samples - by, 0))
        assert pairs[by] == np.count_nonzero(counted[later] & counted[earlier])
        assert products[by] == pytest.approx(signal[later] @ signal[earlier], abs=1e-10)


@given(seed=SEEDS, samples=st.integers(30, 400), basis=st.integers(0, 6), dependent=st.booleans())
@settings(max_examples=30)
def test_what_is_left_of_rows_is_orthogonal_to_the_basis(seed: int, samples: int, basis: int, dependent: bool) -> None:
    rng = np.random.default_rng(seed)
    rows = rng.standard_normal((basis + 4, samples))
    if dependent and basis > 2:
        rows[basis - 1] = rows[0] - 2.0 * rows[1]
    span, rest = rows[:basis].copy(), rows[basis:].copy()
    orthogonalise(rows, basis)
    rest /= np.linalg.norm(rest, axis=1)[:, np.newaxis]
    fitted = np.linalg.lstsq(span.T, rest.T, rcond=1e-12)[0] if basis else np.zeros((0, 4))
    np.testing.assert_allclose(rows[basis:], rest - fitted.T @ span, rtol=0, atol=1e-10)
    gram = rows[:basis] @ rows[:basis].T
    assert gram == pytest.approx(np.diag(np.round(np.diag(gram))), abs=1e-12)
    assert np.sum(np.diag(gram) > 0.5) == (np.linalg.matrix_rank(span) if basis else 0)
