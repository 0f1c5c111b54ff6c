"""What a slow residual is made of, against slow twins that write every sum out, and at the very bounds that decide."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.signal import lfilter
from scipy.stats import norm

from smartshoe.diagnosis import Thresholds
from smartshoe.diagnosis._gauss_markov import (
    GaussMarkov,
    _autoregression,
    _blocks,
    _correlated_variance,
    _covariance,
    _kolmogorov,
    _lagged,
    _memory_s,
    _past_is_known,
    gauss_markov_of,
)
from smartshoe.diagnosis._noise import FLOOR, effective_noise_sd
from smartshoe.models.effects import Conditions

Array = NDArray[np.float64]

STANDARD = Thresholds()
STEP_S = 0.05  # four samples a block
WIDTH = 4
LARGEST = float(norm.isf(0.5 * STANDARD.false_alarm))
FEWEST = (LARGEST / STANDARD.same) ** 2


def _session(load: Array, usable: NDArray[np.bool_] | None = None, step_s: float = STEP_S) -> Any:
    kept = np.ones(load.size, dtype=bool) if usable is None else usable
    return SimpleNamespace(conditions=Conditions(step_s * np.arange(load.size), load, step_s), usable=kept)


def _means(signal: Array) -> Array:
    return np.array([np.mean(signal[k * WIDTH : (k + 1) * WIDTH]) for k in range(signal.size // WIDTH)])


# -- the twin -------------------------------------------------------------------------------------------------------
def _foretelling(covariance: Array, count: int) -> Array:
    """Weights of the past by Yule's and Walker's equations of every order, the one with Schwarz's least criterion."""
    found = [(count * math.log(covariance[0]), np.zeros(0))]
    for order in range(1, covariance.size):
        among = covariance[np.abs(np.subtract.outer(np.arange(order), np.arange(order)))]
        weights = np.linalg.solve(among, covariance[1 : order + 1])
        variance = float(covariance[0] - weights @ covariance[1 : order + 1])
        found.append((count * math.log(variance) + order * math.log(count), weights))
    return min(found, key=lambda one: one[0])[1]


def _slow_twin(sessions: list[Any], residuals: list[Array]) -> dict[str, float]:
    lags = 30  # six seconds by two tenths
    parts = []
    for session, residual in zip(sessions, residuals, strict=True):
        there = _means(session.usable.astype(float)) == 1.0
        level = _means(residual)
        level = np.where(there, level - np.mean(level[there]), 0.0)
        rate = np.abs(_means(np.gradient(session.conditions.load, STEP_S)))
        parts.append((level, there, _means(session.conditions.load), rate))
    total = sum(int(there.sum()) for _, there, _, _ in parts)
    covariance = np.zeros(lags + 1)
    for level, _, _, _ in parts:
        for k in range(lags + 1):
            covariance[k] += sum(level[i] * level[i + k] for i in range(level.size - k)) / total
    weights = _foretelling(covariance, total)
    order = weights.size
    squares, loads, rates, spectrum_statistic = [], [], [], 0.0
    for level, there, load, rate in parts:
        new = np.zeros(level.size)
        for i in range(level.size):
            if i >= order and there[i - order : i + 1].all():
                new[i] = level[i] - sum(weights[j] * level[i - 1 - j] for j in range(order))
                squares.append(new[i] ** 2)
                loads.append(load[i])
                rates.append(rate[i])
        power = np.abs(np.fft.fft(new)[1 : (new.size + 1) // 2]) ** 2
        if new.size % 2:  # the highest is left out as an even length's Nyquist frequency is
            power = power[:-1]
        along = [float(np.sum(power[: k + 1]) / np.sum(power)) - (k + 1) / power.size for k in range(power.size)]
        spectrum_statistic = max(spectrum_statistic, float(np.max(np.abs(along))) * math.sqrt(power.size))
    # What remembers is what is foretold, or what neighbours share and lead back to a step, where that is no chance.
    shared = []
    for lag in (1, 2):
        products = [level[i + lag] * level[i] for level, *_ in parts for i in range(level.size - lag)]
        is_chance = sum(products) <= LARGEST * math.sqrt(sum(one**2 for one in products))
        shared.append(0.0 if is_chance else sum(products) / total)
    one, two = shared
    remembered = min(one * one / two, covariance[0]) if 0.0 < two < one else one
    rms = math.sqrt(max(remembered, covariance[0] - np.mean(squares), 0.0))
    square = np.array(squares) / np.mean(squares)
    count = square.size
    clipped = np.minimum(square, LARGEST**2)
    level = np.concatenate([level[there] for level, there, _, _ in parts])
    return {
        "rms": rms,
        "spectrum_statistic": spectrum_statistic,
        "kurtosis_z": (float(np.mean(square**2)) - 3.0) / math.sqrt(24.0 / count),
        "load_z": max(abs(float(np.corrcoef(one, clipped)[0, 1])) for one in (loads, rates)) * math.sqrt(count),
        "excess_kurtosis": float(np.mean(level**4) / np.mean(level**2) ** 2) - 3.0,
    }


def _loaded(size: int, seed: int) -> Array:
    """An uneven course of loads."""
    rng = np.random.default_rng([seed, 3])
    return np.interp(np.arange(size), np.linspace(0, size, 40), rng.uniform(0.0, 1.0, 40))


@pytest.mark.parametrize("seed", range(4))
def test_what_a_slow_residual_is_made_of_is_that_of_written_out_sums(seed: int) -> None:
    """Two recordings, one of them torn; noise that follows the load, has a memory and a stray jump."""
    rng = np.random.default_rng(seed)
    sizes = (1203, 901)
    sessions, residuals = [], []
    for k, size in enumerate(sizes):
        load = _loaded(size, seed + k)
        kept = np.ones(size, dtype=bool)
        if k:
            kept[301:340] = False
        noise = lfilter([1.0], [1.0, -0.9, 0.1 * seed], rng.standard_normal(size) * (1.0 + seed * load))
        noise[600] += 40.0
        sessions.append(_session(load, kept))
        residuals.append(np.where(kept, 3.0 + noise, 1e3))
    found = gauss_markov_of(sessions, residuals, STANDARD)
    assert found is not None
    twin = _slow_twin(sessions, residuals)
    assert {name: getattr(found, name) for name in twin} == pytest.approx(twin, rel=1e-6)


def test_a_recording_of_which_nothing_is_there_adds_nothing() -> None:
    rng = np.random.default_rng(2)
    one = _session(_loaded(1400, 1))
    lost = _session(_loaded(400, 2), np.zeros(400, dtype=bool))
    residual = rng.standard_normal(1400)
    alone = gauss_markov_of([one], [residual], STANDARD)
    assert alone == gauss_markov_of([one, lost], [residual, rng.standard_normal(400)], STANDARD)
    assert alone is not None
    # Where one of two recordings is followed without any error the other is looked at alone, but for their number.
    quiet = gauss_markov_of([one, _session(_loaded(400, 2))], [residual, np.zeros(400)], STANDARD)
    assert quiet is not None
    assert quiet.spectrum_statistic == pytest.approx(alone.spectrum_statistic)


def test_in_fewer_blocks_nothing_is_told_of_noise() -> None:
    rng = np.random.default_rng(7)
    for count, told in ((math.floor(FEWEST), False), (math.ceil(FEWEST), True)):
        load = _loaded(count * WIDTH, 1)
        found = gauss_markov_of([_session(load)], [rng.standard_normal(load.size)], STANDARD)
        assert (found is not None) is told
        if found is not None:
            assert found.tau_s == 0.0  # white: an order of nought


def test_a_load_that_stands_still_is_followed_by_nothing() -> None:
    rng = np.random.default_rng(3)
    found = gauss_markov_of([_session(np.full(1200, 0.4))], [rng.standard_normal(1200)], STANDARD)
    assert found is not None
    assert found.load_z == 0.0


# -- its parts --------------------------------------------------------------------------------------------------------
def test_blocks_are_means_over_a_sensors_lag_about_the_mean_of_what_is_there() -> None:
    load = np.arange(22.0) / 22.0
    kept = np.ones(22, dtype=bool)
    kept[9] = False
    found = _blocks(_session(load, kept), np.arange(22.0) ** 2, STANDARD)
    assert list(found.complete) == [True, True, False, True, True]
    means = np.array([np.mean(np.arange(4.0 * k, 4.0 * k + 4.0) ** 2) for k in range(5)])
    about = means[[0, 1, 3, 4]].mean()
    assert found.residual == pytest.approx([*(means[:2] - about), 0.0, *(means[3:] - about)])
    assert found.load == pytest.approx((4.0 * np.arange(5) + 1.5) / 22.0)
    assert found.rate == pytest.approx(np.full(5, 1.0 / 22.0 / STEP_S))
    assert found.step_s == pytest.approx(0.2)
    falling = _blocks(_session(1.0 - load), np.arange(22.0), STANDARD)
    assert falling.rate == pytest.approx(np.full(5, 1.0 / 22.0 / STEP_S))
    # A log slower than the lag has one sample in a block.
    slow = _blocks(_session(load, step_s=0.5), np.arange(22.0), STANDARD)
    assert (slow.residual.size, slow.step_s) == (22, 0.5)


def test_covariances_are_sums_of_products_at_each_lag() -> None:
    assert _covariance(np.array([1.0, 2.0, -1.0, 3.0]), 4) == pytest.approx([15.0, -3.0, 5.0, 3.0, 0.0])


@pytest.mark.parametrize("weights", [(), (0.7,), (1.2, -0.6), (0.3, 0.0, 0.5)])
def test_levinsons_recursion_solves_yules_and_walkers_equations(weights: tuple[float, ...]) -> None:
    signal = lfilter([1.0], [1.0, *(-one for one in weights)], np.random.default_rng(8).standard_normal(3000))
    covariance = _covariance(signal, 10) / signal.size
    found = _autoregression(covariance, signal.size)
    assert found == pytest.approx(_foretelling(covariance, signal.size), abs=1e-9)
    assert found.size == len(weights)


def test_another_weight_must_be_worth_the_logarithm_of_the_count() -> None:
    """Schwarz (1978): n log variance falls by more than log n."""
    count = 100
    worth = math.sqrt(1.0 - math.exp(-math.log(count) / count))
    for reflected, order in ((0.999 * worth, 0), (1.001 * worth, 1)):
        assert _autoregression(np.array([2.0, 2.0 * reflected]), count).size == order


def test_what_is_foretold_wholly_needs_no_more() -> None:
    assert _autoregression(np.ones(4), 10) == pytest.approx([1.0])


def test_what_follows_a_gap_is_not_foretold() -> None:
    there = np.array([True, True, True, False, True, True, True, True])
    blocks: Any = SimpleNamespace(complete=there)
    assert list(_past_is_known(blocks, 0)) == list(there)
    assert list(_past_is_known(blocks, 2)) == [False, False, True, False, False, False, True, True]


@pytest.mark.parametrize("steps", [1, 4, 9])
def test_a_memory_is_the_time_constant_of_first_order_noise(steps: int) -> None:
    keep = math.exp(-1.0 / (steps - 1e-6))
    assert _memory_s(np.array([keep]), 10, 0.2) == pytest.approx(0.2 * steps)


def test_a_memory_that_lasts_beyond_what_is_looked_at_has_no_end() -> None:
    keep = math.exp(-1.0 / 9.999999)
    assert _memory_s(np.array([keep]), 10, 0.2) == math.inf
    assert _memory_s(np.array([keep]), 11, 0.2) == pytest.approx(2.0)
    assert _memory_s(np.array([1.0]), 10, 0.2) == math.inf
    assert _memory_s(np.zeros(0), 10, 0.2) == 0.0


def test_the_part_that_remembers_is_what_its_fall_leads_back_to() -> None:
    """With white noise beside it: covariances 3, 1.6, 1.28 are those of 2 times 0.8 to the lag, and of 1 white."""
    assert _correlated_variance(3.0, 1.6, 1.28) == pytest.approx(2.0)
    # No more than there is, no less than what a neighbour shares, and nothing where it shares none.
    assert _correlated_variance(1.8, 1.6, 1.28) == pytest.approx(1.8)
    assert _correlated_variance(3.0, 1.6, 1.9) == pytest.approx(1.6)
    assert _correlated_variance(3.0, 1.6, 0.0) == pytest.approx(1.6)
    assert _correlated_variance(3.0, 0.0, 0.5) == 0.0


def test_neighbours_agree_where_noise_alone_would_not() -> None:
    """Sum of products over the root of the sum of their squares: of n alike their root, of noise chance alone."""
    for count, sign, is_told in ((14, 1.0, False), (17, 1.0, True), (40, 1.0, True), (40, -1.0, False)):
        products = 2.0 * np.cumprod(np.full(count + 1, sign))
        block: Any = SimpleNamespace(residual=products)
        told = 4.0 * count if is_told else 0.0
        assert _lagged([block], 1, STANDARD) == pytest.approx(told)
    alternating: Any = SimpleNamespace(residual=np.resize([1.0, -1.0], 50))
    assert [_lagged([alternating, alternating], lag, STANDARD) for lag in (1, 2)] == [0.0, pytest.approx(96.0)]


def test_the_cumulative_periodogram_leaves_the_straight_line_by_a_lone_frequency() -> None:
    n = 64
    for place in (1, 5, 20, 31):
        wave = np.cos(2.0 * np.pi * place * np.arange(n) / n)
        off = max((place - 1) / 31.0, 1.0 - place / 31.0)
        assert _kolmogorov(wave) == pytest.approx(off * math.sqrt(31.0), rel=1e-6)
    assert _kolmogorov(np.ones(6) * 0.0) == 0.0
    assert _kolmogorov(np.array([1.0, -2.0, 1.0, 4.0])) == 0.0  # of one frequency nothing is told
    assert _kolmogorov(np.array([1.0, -2.0, 1.0, 4.0, 0.5, 2.0])) > 0.0  # of two it is


# -- what decides -----------------------------------------------------------------------------------------------------
QUIET = GaussMarkov(0.004, 1.0, 0.1, 0.1, 0.1, 0.0, STANDARD)
WHITE = math.sqrt(-0.5 * math.log(0.5 * STANDARD.false_alarm))
DEVIATIONS = QUIET._deviations
TWO_LEVELS = -2.0 * (4.0 / 5.0) ** 2


def test_bounds_of_noise_are_those_of_a_false_alarm() -> None:
    assert pytest.approx(LARGEST) == DEVIATIONS
    below, above = 1.0 - 1e-9, 1.0 + 1e-9
    for field, bound in (
        ("spectrum_statistic", WHITE), ("tau_s", STANDARD.lasting_s), ("kurtosis_z", DEVIATIONS),
        ("kurtosis_z", -DEVIATIONS), ("load_z", DEVIATIONS),
    ):  # fmt: skip
        told = [replace(QUIET, **{field: by * bound}).is_noise for by in (below, 1.0, above)]
        assert told == [True, False, False]


def test_bounds_of_a_switch_are_those_of_a_false_alarm_and_of_two_clear_levels() -> None:
    switching = replace(QUIET, kurtosis_z=50.0, excess_kurtosis=-1.8, tau_s=100.0)
    assert switching.switches
    for field, bound, then in (
        ("spectrum_statistic", WHITE, [True, False, False]),
        ("load_z", DEVIATIONS, [True, False, False]),
        ("kurtosis_z", DEVIATIONS, [False, False, True]),
        ("excess_kurtosis", TWO_LEVELS, [False, False, True]),
    ):
        told = [replace(switching, **{field: by * bound}).switches for by in (1.0 - 1e-9, 1.0, 1.0 + 1e-9)]
        assert told == then


# -- each correlation time once ---------------------------------------------------------------------------------------
def _slow_sd(residuals: list[Array], kept: list[NDArray[np.bool_]]) -> float:
    square = count = repeated = 0.0
    for residual, mask in zip(residuals, kept, strict=True):
        if mask.any():
            signal = np.where(mask, residual - residual[mask].mean(), 0.0)
            lags = [sum(signal[i] * signal[i + k] for i in range(signal.size - k)) for k in range(signal.size)]
            until = next((k for k, one in enumerate(lags) if one <= 0.0), signal.size)
            times = 1.0 + 2.0 * sum(lags[1:until]) / lags[0]
            square += lags[0]
            count += mask.sum()
            repeated += mask.sum() * times
    return math.sqrt(square / count * max(repeated / count, 1.0))


def test_a_correlation_time_is_the_sum_of_covariances_up_to_the_first_that_is_none() -> None:
    rng = np.random.default_rng(4)
    signals = [lfilter([1.0], [1.0, -0.8], rng.standard_normal(size)) for size in (150, 90, 40)]
    kept = [np.ones(150, dtype=bool), rng.random(90) < 0.8, np.zeros(40, dtype=bool)]
    assert effective_noise_sd(signals, kept) == pytest.approx(_slow_sd(signals, kept), rel=1e-6)
    # Neighbours that alternate tell no more than samples that are none of each other's.
    alternating = np.resize([1.0, -1.0], 100)
    assert effective_noise_sd([alternating], [np.ones(100, dtype=bool)]) == pytest.approx(1.0)
    nothing = effective_noise_sd([np.ones(20)], [np.ones(20, dtype=bool)])
    assert nothing == FLOOR == effective_noise_sd([], []) == 1e-6


@pytest.mark.parametrize("size", [3e-7, 1e-6, 1e-4])
def test_no_noise_is_less_than_a_sensors(size: float) -> None:
    """Neighbours that alternate count once each, so that their standard deviation is their size."""
    alternating = size * np.resize([1.0, -1.0], 100)
    found = effective_noise_sd([alternating], [np.ones(100, dtype=bool)])
    assert found == pytest.approx(max(size + 1e-9, 1e-6), rel=1e-9)
