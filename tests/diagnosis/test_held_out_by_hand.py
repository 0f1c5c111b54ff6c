"""Errors on what is held out and their gains, against written-out sums."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import t as student
from told_columns import MODEL, SCALE, STANDARD, past_columns, session_under, sessions_under, some_load

from smartshoe.diagnosis._force import force_error
from smartshoe.diagnosis._held_out import Errors, errors, gain
from smartshoe.diagnosis._own_terms import own_terms_of, residual_of
from smartshoe.diagnosis._sensitivity import (
    rows_where,
)

Array = NDArray[np.float64]


@pytest.mark.parametrize("share", [0.1, -0.1, 0.0])
def test_an_offset_and_a_past_are_ridge_estimates_of_what_was_fitted(share: float) -> None:
    model = replace(MODEL, relaxing_share=share)
    for held in (np.arange(220) > 150, np.ones(220, dtype=bool)):
        one = session_under(some_load(220, 3), np.zeros(220), 3, held=held)
        residual = 0.3 + 0.1 * np.random.default_rng(6).standard_normal(220)
        mask = one.fitted if one.fitted.any() else one.usable
        past = past_columns(one, 0.3 / (1.0 + share))
        holds = max(abs(share) * 1.1, 1e-6)
        spread = np.std(residual[mask])
        wide = np.concatenate([past[mask], [[0.0, spread / holds]]])
        expected = np.linalg.lstsq(wide, np.append(residual[mask], 0.0), rcond=None)[0]
        found, added = own_terms_of(one, model, residual)
        assert found == pytest.approx(expected, rel=1e-6, abs=1e-9)
        assert added == pytest.approx(past @ expected)
    lost = session_under(some_load(50, 3), np.zeros(50), lost=1.1)
    assert own_terms_of(lost, model, np.ones(50))[0] == pytest.approx([0.0, 0.0])


def test_errors_are_sums_over_held_out_cycles_and_deviations_from_each_mean() -> None:
    sessions = sessions_under(MODEL, noise=0.05)
    held = []
    for one in sessions:
        held.append(session_under(one.conditions.load, one.reading, 4, held=np.isin(one.cycle, [1, 4, 6])))
    held[1].cycle[:] = np.minimum(held[1].cycle, 5)
    found = errors([*held, sessions[0]], MODEL)
    squares, counts, spread = [], [], 0.0
    for one in held:
        residual = residual_of(one, MODEL)
        for number in range(7):
            inside = [k for k in range(residual.size) if one.judged[k] and one.cycle[k] == number]
            if inside:
                squares.append(sum(residual[k] ** 2 for k in inside))
                counts.append(len(inside))
        values = one.reading[one.judged]
        spread += float(np.sum((values - np.mean(values)) ** 2))
    assert found.squares == pytest.approx(squares)
    assert list(found.counts) == counts
    assert found.spread == pytest.approx(math.sqrt(spread / sum(counts)))
    expected = math.sqrt(sum(squares) / sum(counts))
    assert found.rmse == pytest.approx(expected)
    assert found.fit_percent == pytest.approx(100.0 * (1.0 - expected / found.spread))
    level = replace(found, spread=0.0)
    assert (level.fit_percent, level.variance_explained_percent) == (0.0, 0.0)


def test_a_gain_is_of_norms_and_its_interval_of_cycles_left_out_in_turn() -> None:
    rng = np.random.default_rng(3)
    before = Errors(rng.uniform(1.0, 2.0, 12), np.full(12, 5.0), 1.0)
    after = Errors(rng.uniform(0.1, 1.0, 12), np.full(12, 5.0), 1.0)

    def gained(log_ratio: float) -> float:
        return 100.0 * (1.0 - math.exp(0.5 * log_ratio))

    for count in (12, 3, 2):
        a, b = after.squares[:count], before.squares[:count]
        found = gain(replace(before, squares=b), replace(after, squares=a), SCALE, STANDARD)
        whole = math.log(sum(a) / sum(b))
        assert found.gain_percent == pytest.approx(gained(whole))
        kept = [[k for k in range(count) if k != out] for out in range(count)]
        logs = [math.log(sum(a[k]) / sum(b[k])) for k in kept]
        sd = math.sqrt((count - 1) / count * sum((one - sum(logs) / count) ** 2 for one in logs))
        reach = float(student.isf(0.025, count - 1)) * sd
        assert found.ci95 == pytest.approx((gained(whole + reach), gained(whole - reach)))
        assert found.ci95[0] < found.gain_percent < found.ci95[1]


def test_no_error_at_all_is_a_number_too() -> None:
    none, some = (Errors(np.full(3, size), np.full(3, 5.0), 1.0) for size in (0.0, 1.0))
    one = replace(some, squares=np.array([1.0, 0.0, 0.0]))
    assert gain(none, none, SCALE, STANDARD).gain_percent == 0.0
    assert gain(some, none, SCALE, STANDARD).gain_percent == pytest.approx(100.0)
    for before, after in ((none, some), (one, some), (some, one)):
        found = gain(before, after, SCALE, STANDARD)
        assert np.isfinite([found.gain_percent, *found.ci95]).all()


@pytest.mark.parametrize("count", [2, 3, 4, 6, 12])
def test_models_that_are_alike_differ_beyond_chance_as_often_as_an_interval_says(count: int) -> None:
    """About one in forty on either side. Cycles of unlike sizes, and errors of which the models share a half."""
    rng = np.random.default_rng(count)
    drawn = 2000
    size = rng.uniform(0.5, 1.5, (drawn, count, 1))
    shared, own, other = size * rng.standard_normal((3, drawn, count, 10))
    times = np.ones(count)
    losses = gains = certain = 0
    for first, second in zip(np.sum((shared + own) ** 2, 2), np.sum((shared + other) ** 2, 2), strict=True):
        found = gain(Errors(first, times, 1.0), Errors(second, times, 1.0), SCALE, STANDARD)
        losses += found.ci95[1] < 0.0
        gains += found.ci95[0] > 0.0
        certain += found.is_loss
    assert 0.015 * drawn < min(losses, gains)
    assert max(losses, gains) < 0.04 * drawn
    assert certain == (losses if count >= STANDARD.few else 0)


@pytest.mark.parametrize(("count", "grows", "is_loss"), [(5, 1.001, True), (4, 1.001, False), (5, 0.999, False)])
def test_a_loss_is_of_what_is_material_and_of_more_than_a_few_cycles(count: int, grows: float, is_loss: bool) -> None:
    rmse = 0.01 + grows * STANDARD.material
    cycles = np.linspace(0.9, 1.1, count)
    before, after = (Errors(cycles * square, np.ones(count), 1.0) for square in (1e-4, rmse**2))
    found = gain(before, after, SCALE, STANDARD)
    assert found.ci95[1] < 0.0
    assert found.is_loss is is_loss
    coarse = replace(STANDARD, material=2.0 * STANDARD.material)
    assert not gain(before, after, SCALE, coarse).is_loss


@pytest.mark.parametrize(("before", "after", "grown"), [(3.0, 5.0, 4.0), (5.0, 3.0, 0.0), (2.0, 2.0, 0.0)])
def test_an_error_grows_by_the_root_of_what_its_square_does(before: float, after: float, grown: float) -> None:
    """Of one cycle as of many: it is what verdicts ask, certain or not."""
    first, second = (Errors(np.array([(0.001 * rms) ** 2]), np.ones(1), 1.0) for rms in (before, after))
    assert gain(first, second, SCALE, STANDARD).growth(SCALE) == pytest.approx(0.001 * grown)


def test_a_forces_error_is_that_of_the_compensated_reading() -> None:
    """Of a model without an arm the force is the reading over the gain; its offset is the recording's own."""
    plain = replace(MODEL, relaxing_share=0.0)
    squares = {"fitted": 0.0, "judged": 0.0}
    counts = {"fitted": 0, "judged": 0}
    held = []
    for seed, size in enumerate((200, 150)):
        load = some_load(size, seed)
        noise = 0.02 * np.random.default_rng(seed).standard_normal(size)
        one = session_under(load, 1.1 * load + 0.2 + noise, seed, held=np.arange(size) > 0.4 * size)
        held.append(one)
        _, own = own_terms_of(one, plain, one.reading - plain.simulate(one.conditions))
        off = 800.0 * ((one.reading - own) / 1.1 - load)
        for which in squares:
            part = off[getattr(one, which)]
            squares[which] += float(part @ part)
            counts[which] += part.size
    unjudged = session_under(some_load(80, 1), np.zeros(80))
    fitted_n, judged_n = (math.sqrt(squares[which] / counts[which]) for which in squares)
    assert force_error(held, plain).fitted_n == pytest.approx(fitted_n, rel=1e-6)
    assert force_error([held[0], unjudged, held[1]], plain).held_out_n == pytest.approx(judged_n, rel=1e-6)
    assert math.isnan(force_error([unjudged], plain).held_out_n)


def test_rows_of_cycles_of_scattered_samples_and_of_none_are_those_of_the_mask() -> None:
    columns = np.asfortranarray(np.random.default_rng(3).standard_normal((600, 4)))
    masks = [np.arange(600) // 200 != 1, np.arange(600) % 3 > 0, np.zeros(600, dtype=bool), np.arange(600) == 7]
    for mask in masks:
        found = rows_where(mask, columns)
        np.testing.assert_array_equal(found, columns[mask])
        assert found.flags.f_contiguous
    assert rows_where(np.ones(600, dtype=bool), columns) is columns
