"""What repeats and what wanders in a residual, against slow twins that write every sum out."""

from __future__ import annotations

import itertools
import math
import tracemalloc
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import nnls
from scipy.signal import lfilter
from scipy.stats import t as student

from smartshoe.diagnosis import Thresholds
from smartshoe.diagnosis._denoise import noise_sd
from smartshoe.diagnosis._lack_of_fit import (
    COLOURS,
    PLACES,
    TAPS,
    LackOfFit,
    _loudness,
    _mean_variance,
    _quiet_blocks,
    predicted_structure,
    repeating_structure,
    repeats,
    slow_structure,
)
from smartshoe.diagnosis._residual_structure import beyond_noise, worst_place
from smartshoe.models.effects import Conditions

Array = NDArray[np.float64]

STANDARD = Thresholds()
STEP_S = 0.1
ALIKE = STANDARD.cycle  # 0.08


def _session(load: Array, cycle: Any = None, usable: Any = None, step_s: float = STEP_S, name: str = "one") -> Any:
    kept = np.ones(load.size, dtype=bool) if usable is None else usable
    return SimpleNamespace(
        conditions=Conditions(step_s * np.arange(load.size), load, step_s),
        thinned=1,
        usable=kept,
        fitted=kept,
        cycle=np.zeros(load.size, dtype=np.intp) if cycle is None else cycle,
        recording=SimpleNamespace(name=name, time_s=step_s * np.arange(load.size)),
    )


def _pressed(*shapes: tuple[int, float], foot: float = 0.0) -> tuple[Array, NDArray[np.intp]]:
    """Half sines of so many samples to such a peak, twelve samples of rest before each; and the cycles' numbers."""
    loads, cycles = [], []
    for number, (count, peak) in enumerate(shapes):
        loads += [np.full(12, foot), foot + (peak - foot) * np.sin(np.pi * np.arange(1, count + 1) / (count + 1))]
        cycles.append(np.full(12 + count, number, dtype=np.intp))
    return np.concatenate(loads), np.concatenate(cycles)


# -- what repeats -----------------------------------------------------------------------------------------------------
def _slow_repeats(sessions: list[Any], residuals: list[Array]) -> list[tuple[list[Array], float]]:
    kinds: list[tuple[float, float, list[Any]]] = []
    total = 0
    for session, residual in zip(sessions, residuals, strict=True):
        load = session.conditions.load
        total += len(load)
        low, span = min(load), max(load) - min(load)
        for number in range(max(session.cycle) + 1):
            own = [i for i in range(len(load)) if session.cycle[i] == number]
            peak = max(load[i] for i in own)
            if peak - low <= 0.1 * span:
                continue
            above = [i for i in own if load[i] > low + 0.1 * (peak - low)]
            if len(above) < 8:
                continue
            span_of = range(above[0], above[-1] + 1)
            if sum(session.usable[i] for i in span_of) < 0.9 * len(span_of):
                continue
            rest = range(above[-1] + 1, own[-1] + 1)
            rests = len(rest) if sum(session.usable[i] for i in rest) >= 0.9 * len(rest) else 0
            duration_s = (above[-1] - above[0]) * session.conditions.step_s
            made = (session, residual, above, rests)
            for first_peak, first_s, cycles in kinds:
                if abs(peak - first_peak) <= ALIKE * first_peak and abs(duration_s - first_s) <= ALIKE * first_s:
                    cycles.append(made)
                    break
            else:
                kinds.append((peak, duration_s, [made]))
    found = []
    for _, first_s, cycles in kinds:
        if len(cycles) < 2:
            continue
        rest = min(rests for _, _, _, rests in cycles)
        count = round(64 * rest * STEP_S / first_s)
        rows = []
        for session, residual, above, _ in cycles:
            places = [above[0] + (above[-1] - above[0]) * k / 63.0 for k in range(64)]
            places += [above[-1] + rest * (k + 1) / count for k in range(count)]
            last = next(
                (i for i in range(above[-1], len(residual) - 1) if session.cycle[i + 1] != session.cycle[i]), None
            )
            seen = [i for i in range(above[0], (len(residual) if last is None else last + 1)) if session.usable[i]]
            rows.append(np.interp(places, seen, residual[seen]))
        found.append((rows, sum(above[-1] - above[0] + 1 + rest for _, _, above, _ in cycles) / total))
    return found


def _slow_repeating(kinds: list[tuple[list[Array], float]]) -> tuple[float, float, int]:
    power = variance = 0.0
    pairs = 0
    for rows, share in kinds:
        count = len(rows)
        places = len(rows[0])
        products = [float(np.mean(rows[i] * rows[j])) for i in range(count) for j in range(i + 1, count)]
        mean = sum(rows) / count
        auto = [
            sum(
                float(np.sum((row - mean)[lag:] * (row - mean)[: places - lag])) / places for row in rows
            ) / (count - 1)
            for lag in range(places)
        ]  # fmt: skip
        fewer = [1.0 - lag / places for lag in range(places)]
        spread = (auto[0] ** 2 + 2.0 * sum(fewer[lag] * auto[lag] ** 2 for lag in range(1, places))) / places
        power += share * sum(products) / len(products)
        variance += share**2 * spread / len(products)
        pairs += len(products)
    return power, power / math.sqrt(variance), pairs


def _runs() -> tuple[list[Any], list[Array]]:
    rng = np.random.default_rng(5)
    shapes = [
        [(30, 1.0), (31, 1.05), (30, 1.0), (60, 1.0), (61, 0.96), (30, 0.5)],
        [(30, 0.97), (59, 1.0), (9, 1.0), (9, 1.0), (20, 0.05), (40, 0.3), (30, 0.5), (62, 1.0)],
    ]
    sessions, residuals = [], []
    for k, some in enumerate(shapes):
        load, cycle = _pressed(*some, foot=-0.02 * k)
        usable = np.ones(load.size, dtype=bool)
        if k:  # the last cycle lacks more than a tenth, the first less
            usable[np.flatnonzero(cycle == 7)[20:30]] = False
            usable[np.flatnonzero(cycle == 0)[20:22]] = False
        sessions.append(_session(load, cycle, usable, step_s=STEP_S))
        residuals.append(0.5 * load * (1.0 - load) + 0.1 * rng.standard_normal(load.size))
    return sessions, residuals


def test_rows_of_cycles_that_come_back_are_those_of_written_out_sums() -> None:
    sessions, residuals = _runs()
    found, twin = repeats(sessions, residuals, ALIKE), _slow_repeats(sessions, residuals)
    assert [rows.shape for rows, _ in found] == [(len(rows), len(rows[0])) for rows, _ in twin]
    assert {len(rows[0]) for rows, _ in twin} == {PLACES, PLACES + 1}  # some end in a sample below a tenth
    assert len(twin) == 4  # the fast, the slow, those of half the load, and the shortest
    for (rows, share), (slow_rows, slow_share) in zip(found, twin, strict=True):
        assert rows == pytest.approx(np.array(slow_rows), abs=1e-9)
        assert share == pytest.approx(slow_share)


@pytest.mark.parametrize("times", [1.0, 1e-3])
def test_the_power_of_what_repeats_and_its_score_are_those_of_written_out_sums(times: float) -> None:
    sessions, residuals = _runs()
    residuals = [times * one for one in residuals]
    found = repeating_structure(sessions, residuals, STANDARD)
    power, z, pairs = _slow_repeating(_slow_repeats(sessions, residuals))
    assert (found.rms, found.z, found.pairs) == (pytest.approx(math.sqrt(power)), pytest.approx(z), pairs)
    # What is each time the other way round does not repeat.
    signs = [np.where(one.cycle % 2, -1.0, 1.0) for one in sessions]
    turned = repeating_structure(sessions, [one * sign for one, sign in zip(residuals, signs, strict=True)], STANDARD)
    if turned.z < 0.0:
        assert turned.rms == 0.0


def test_what_swings_on_at_rest_repeats_as_what_swings_under_load() -> None:
    """For as long as the unit rests after each of them, and no longer."""
    load, cycle = np.zeros(500), np.repeat(np.arange(3), [160, 160, 180])
    for start in (20, 180, 340):
        load[start : start + 60] = 1.0
    ringing = np.zeros(500)
    for start in (80, 240, 400):
        ringing[start : start + 40] = 0.01 * np.sin(0.9 * np.arange(40)) * np.exp(-0.05 * np.arange(40))
    noise = 1e-4 * np.random.default_rng(2).standard_normal(500)
    ((rows, share),) = repeats([_session(load, cycle)], [ringing + noise], ALIKE)
    assert share == pytest.approx(3 * (60 + 80) / 500)
    assert rows.shape == (3, PLACES + round(PLACES * 80 / 59))
    found = repeating_structure([_session(load, cycle)], [ringing + noise], STANDARD)
    assert found.significant
    assert found.rms == pytest.approx(np.sqrt(np.mean(ringing**2)), rel=0.1)


def test_loads_of_one_height_and_duration_that_go_by_other_courses_repeat_nothing() -> None:
    """What a model missed of a random load was taken for noise, since it was another in "repeats" that were none."""
    load, cycle = _pressed(*[(60, 1.0)] * 4)
    skewed = np.sin(np.pi * np.linspace(0.0, 1.0, 60) ** 2)
    for number in range(4):
        load[np.flatnonzero(cycle == number)[12:]] = skewed if number % 2 else skewed[::-1]
    found = repeats([_session(load, cycle)], [load], ALIKE)
    assert [rows.shape[0] for rows, _ in found] == [2, 2]
    for rows, _ in found:
        assert rows[1] == pytest.approx(rows[0])
    whole = repeating_structure([_session(load, cycle)], [load], STANDARD)
    assert whole.pairs == 2


def test_of_many_repeats_the_sums_are_those_over_all_pairs_in_memory_for_one_each() -> None:
    count = 1000
    load, cycle = _pressed(*[(16, 1.0)] * count)
    residual = 0.02 * load * (1.0 - load) + np.random.default_rng(4).standard_normal(load.size)
    ((rows, share),) = repeats([_session(load, cycle)], [residual], ALIKE)
    products = (rows @ rows.T / PLACES)[np.triu_indices(count, 1)]
    noise = rows - rows.mean(axis=0)
    auto = sum(np.correlate(row, row, "full")[PLACES - 1 :] for row in noise) / (PLACES * (count - 1))
    spread = (auto[0] ** 2 + 2.0 * np.sum((1.0 - np.arange(1, PLACES) / PLACES) * auto[1:] ** 2)) / PLACES
    tracemalloc.start()
    found = repeating_structure([_session(load, cycle)], [residual], STANDARD)
    _, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert found.rms == pytest.approx(math.sqrt(max(share * products.mean(), 0.0)), rel=1e-10)
    assert found.z == pytest.approx(products.mean() / math.sqrt(spread / products.size), rel=1e-10)
    assert found.pairs == products.size
    assert most < 10 * rows.nbytes  # all products would be sixteen times as many


def test_cycles_that_have_no_sample_are_passed_over() -> None:
    """Few thinned samples, cut into more parts of the time than there are."""
    load, cycle = _pressed((40, 1.0), (40, 1.0))
    (told,), (spaced,) = (repeats([_session(load, by * cycle)], [load], ALIKE) for by in (1, 5))
    assert np.array_equal(told[0], spaced[0])
    assert (
        repeating_structure([_session(np.linspace(0.0, 1.0, 4), np.arange(4) * 3)], [np.ones(4)], STANDARD).pairs == 0
    )


def test_a_single_pair_is_enough_to_repeat_and_not_to_be_significant() -> None:
    load, cycle = _pressed((40, 1.0), (40, 1.0))
    bow = load * (1.0 - load) + 1e-3 * np.random.default_rng(1).standard_normal(load.size)
    found = repeating_structure([_session(load, cycle)], [bow], STANDARD)
    assert (found.pairs, found.significant) == (1, False)
    assert found.z > 10.0


@pytest.mark.parametrize("pairs", [2, 5, 40])
def test_a_score_is_significant_beyond_students_quantile(pairs: int) -> None:
    bound = float(student.isf(0.5 * STANDARD.false_alarm, pairs - 1))
    told = [LackOfFit(0.1, by * bound, pairs, STANDARD).significant for by in (0.99999, 1.00001)]
    assert told == [False, True]


@pytest.mark.parametrize("pairs", [2, 5, 40])
def test_structure_would_show_where_its_variance_is_beyond_students_quantile_of_noise(pairs: int) -> None:
    bound = float(student.isf(0.5 * STANDARD.false_alarm, pairs - 1))
    one = LackOfFit(0.0, 0.0, pairs, STANDARD, 1e-6)
    assert not one.would_detect(0.999e-3 * bound**0.5)
    assert one.would_detect(1.001e-3 * bound**0.5)
    assert not replace(one, pairs=1).would_detect(9.0)
    assert not LackOfFit(0.0, 0.0, pairs, STANDARD).would_detect(9.0)


def test_what_a_test_would_show_is_what_it_finds_significant() -> None:
    load, cycle = _pressed(*[(40, 1.0)] * 6)
    noise = 1e-3 * np.random.default_rng(1).standard_normal(load.size)
    found = repeating_structure([_session(load, cycle)], [noise], STANDARD)
    assert not found.significant
    assert found.z == pytest.approx((found.rms**2 or found.z * found.variance_sd) / found.variance_sd)
    least = np.sqrt(float(student.isf(0.5 * STANDARD.false_alarm, found.pairs - 1)) * found.variance_sd)
    bow = load * (1.0 - load)
    bow *= 1.5 * least / np.sqrt(np.mean(bow**2))
    assert found.would_detect(1.5 * least)
    assert repeating_structure([_session(load, cycle)], [noise + bow], STANDARD).significant


@pytest.mark.parametrize(("count", "is_told"), [(9, False), (10, True)])
def test_a_cycle_of_fewer_than_eight_samples_above_a_tenth_is_not_laid_over_others(count: int, is_told: bool) -> None:
    """Of a half sine of n samples those but the first and the last lie above a tenth of it, n of 20 or more."""
    load, cycle = _pressed((count, 1.0), (count, 1.0))
    load[load < 0.35] = 0.0
    assert np.count_nonzero(load[cycle == 0] > 0.1) == (7 if count == 9 else 8)
    assert bool(repeats([_session(load, cycle)], [load], ALIKE)) is is_told


@pytest.mark.parametrize(("lost", "is_told"), [(4, True), (5, False)])
def test_a_cycle_that_lacks_more_than_a_tenth_is_not_laid_over_others(lost: int, is_told: bool) -> None:
    load, cycle = np.zeros(160), np.repeat(np.arange(2), 80)
    load[20:60] = load[100:140] = 1.0
    usable = np.ones(160, dtype=bool)
    usable[25 : 25 + lost] = False
    assert bool(repeats([_session(load, cycle, usable)], [load], ALIKE)) is is_told


def test_what_is_masked_in_each_cycle_repeats_nothing() -> None:
    """A reading that is tied at its rail is as wrong each time, and no matter of the model."""
    load, cycle = np.zeros(160), np.repeat(np.arange(2), 80)
    load[20:60] = load[100:140] = 1.0
    usable, residual = np.ones(160, dtype=bool), np.zeros(160)
    usable[38:42] = usable[118:122] = False
    residual[~usable] = 9.0
    ((rows, _),) = repeats([_session(load, cycle, usable)], [residual], ALIKE)
    assert np.all(rows == 0.0)


@pytest.mark.parametrize(("height", "duration"), [(1.08, 25), (0.92, 25), (1.0, 27), (1.0, 23)])
def test_cycles_of_a_kind_differ_by_no_more_than_that_share(height: float, duration: int) -> None:
    """Durations 24 steps and two more or less, heights 8 hundredths more or less: at the very bound, and beyond."""
    load, cycle = np.zeros(120), np.repeat(np.arange(2), 60)
    load[10:36] = 1.0
    load[70 : 71 + duration] = height
    share = max(abs(height - 1.0), abs(duration - 25) / 25.0)
    for alike, kinds in ((share + 1e-9, 1), (share - 1e-9, 0)):
        assert len(repeats([_session(load, cycle)], [load], alike)) == kinds


# -- what wanders -----------------------------------------------------------------------------------------------------
def _slow_quiet(rows: Array) -> list[int]:
    power = [float(np.sum((row - np.mean(row)) ** 2)) for row in rows]
    return [k for k, one in enumerate(power) if one <= np.quantile(power, 0.9)]


def _slow_loudness(rows: Array) -> Array:
    fast = []
    for row in rows:
        jumps = [abs(b - a) for a, b in itertools.pairwise(row)]
        most = 2.0 * np.median(jumps) / 0.674489750196  # twice the standard deviation, by the median
        fast.append(sum(min(one, most) ** 2 for one in jumps) / len(jumps))
    usual = sum(fast[k] for k in _slow_quiet(rows)) / len(_slow_quiet(rows))
    return np.array(fast) / usual


def _slow_mean_variance(centred: Array, step_s: float) -> float:
    width = centred.shape[1]
    rows = centred[_slow_quiet(centred)]
    found = [float(np.mean([row[i] * row[i + k] for row in rows for i in range(width - k)])) for k in range(width // 2)]
    take_out = np.eye(width) - np.ones((width, width)) / width

    def seen(covariance: Array) -> list[float]:
        changed = take_out @ covariance @ take_out
        return [float(np.mean([changed[i, i + k] for i in range(width - k)])) for k in range(width // 2)]

    best = (math.inf, 0.0)
    for k in range(5):
        tau_s = 0.1 * (6.0 / 5.0 / 0.1) ** (k / 4.0)  # from an echo to a few in a block
        coloured = np.array([[math.exp(-abs(i - j) * step_s / tau_s) for j in range(width)] for i in range(width)])
        (w, c), off = nnls(np.column_stack([seen(np.eye(width)), seen(coloured)]), np.array(found))
        best = min(best, (off, w / width + c * float(np.mean(coloured))))
    return best[1]


def _slow_slow(sessions: list[Any], residuals: list[Array]) -> tuple[float, float, int]:
    excess: list[float] = []
    spread = 0.0
    for session, residual in zip(sessions, residuals, strict=True):
        width = max(4, round(6.0 / session.conditions.step_s))
        cut = [slice(k * width, (k + 1) * width) for k in range(residual.size // width)]
        rows = np.array([residual[one] for one in cut if session.usable[one].all()])
        if len(cut) < 5 or len(rows) < 5:
            continue
        means = rows.mean(axis=1)
        variance = _slow_mean_variance(rows - means[:, None], session.conditions.step_s)
        expected = variance * _slow_loudness(rows)
        excess += list(means**2 - expected)
        spread += 2.0 * float(np.sum(expected**2)) + (0.25 * float(np.sum(expected))) ** 2
    return float(np.mean(excess)), float(np.sum(excess)) / math.sqrt(spread), len(excess)


def _noise(size: int, keep: float, seed: int) -> Array:
    return np.asarray(lfilter([1.0], [1.0, -keep], np.random.default_rng(seed).standard_normal(size)))


@pytest.mark.parametrize(("step_s", "keep"), [(0.3, 0.0), (0.3, 0.6), (0.5, 0.8), (2.0, 0.1)])
def test_blocks_are_judged_as_by_written_out_sums(step_s: float, keep: float) -> None:
    sessions, residuals = [], []
    for seed, size in enumerate((500, 260, 90)):
        usable = np.ones(size, dtype=bool)
        usable[31:34] = False
        loud = 1.0 + 2.0 * (np.arange(size) > 0.7 * size)
        drift = 0.4 * np.sin(np.arange(size) / 30.0)
        sessions.append(_session(np.zeros(size), usable=usable, step_s=step_s))
        residuals.append(np.where(usable, loud * _noise(size, keep, seed) + drift, 1e4))
    found, (mean, z, count) = slow_structure(sessions, residuals, STANDARD), _slow_slow(sessions, residuals)
    assert (found.z, found.pairs) == (pytest.approx(z, rel=1e-5), count)
    assert found.rms == pytest.approx(math.sqrt(max(mean, 0.0)), rel=1e-5)


def test_four_blocks_tell_nothing_and_five_do() -> None:
    noise = _noise(100, 0.3, 2)
    for size, blocks in ((99, 0), (100, 5)):
        assert slow_structure([_session(np.zeros(size), step_s=0.3)], [noise[:size]], STANDARD).pairs == blocks
    lost = np.ones(120, dtype=bool)
    lost[[3, 119]] = False
    assert (
        slow_structure([_session(np.zeros(120), usable=lost, step_s=0.3)], [_noise(120, 0.3, 2)], STANDARD).pairs == 0
    )
    lost[119] = True
    assert (
        slow_structure([_session(np.zeros(120), usable=lost, step_s=0.3)], [_noise(120, 0.3, 2)], STANDARD).pairs == 5
    )


def test_the_quiet_are_the_nine_tenths_with_the_least_power_about_their_mean() -> None:
    rows = np.array([[0.0, size, 0.0, -size] for size in (3.0, 1.0, 9.0, 2.0, 4.0, 5.0, 6.0, 7.0, 8.0, 1.5)])
    rows[1] += 100.0
    assert list(np.flatnonzero(~_quiet_blocks(rows))) == [2]


def test_how_loud_a_block_is_goes_by_its_neighbours_differences_but_one_jump() -> None:
    rows = np.stack([_noise(40, 0.0, seed) * size for seed, size in enumerate((1.0, 2.0, 1.0, 4.0, 1.0, 1.0))])
    rows[2, 20:] += 50.0
    assert _loudness(rows, 2.0) == pytest.approx(_slow_loudness(rows))
    assert _loudness(rows, 2.0)[2] < 2.0
    assert list(_loudness(np.ones((3, 8)), 2.0)) == [1.0, 1.0, 1.0]


@pytest.mark.parametrize(("keep", "width"), [(0.0, 12), (0.7, 12), (0.9, 13), (0.97, 20)])
def test_what_noise_leaves_in_a_mean_is_fitted_as_by_written_out_matrices(keep: float, width: int) -> None:
    rows = _noise(40 * width, keep, width).reshape(40, width)
    centred = rows - rows.mean(axis=1, keepdims=True)
    assert _mean_variance(centred, 0.3, STANDARD) == pytest.approx(_slow_mean_variance(centred, 0.3), rel=1e-6)
    assert COLOURS == 5


# -- in all -----------------------------------------------------------------------------------------------------------
# -- what a filter of the load predicts -----------------------------------------------------------------------------
def _random_loads(seed: int, count: int = 3000) -> list[Any]:
    """Two recordings of a load that goes to and fro at random, as fast as in a quarter of a second."""
    rng = np.random.default_rng(seed)
    return [_session(lfilter([1.0], [1.0, -0.8], 0.1 * rng.standard_normal(count)), step_s=0.05) for _ in range(2)]


def _ringing(session: Any) -> Array:
    """What a mode of 3 Hz, damped by a twentieth, answers to the load's increments."""
    turn = 2.0 * math.pi * 3.0 * 0.05
    poles = np.exp([complex(-0.05 * turn, turn), complex(-0.05 * turn, -turn)])
    load = session.conditions.load
    return np.asarray(lfilter([1.0], np.poly(poles).real, np.diff(load, prepend=load[0])))


def _slow_predicted(sessions: list[Any], residuals: list[Array]) -> tuple[float, float, int]:
    reach = STANDARD.clear * STANDARD.settled_s
    ratios, saved, count = [], 0.0, 0
    for first in (True, False):
        rows, targets = [], []
        for session, residual in zip(sessions, residuals, strict=True):
            load, step_s = session.conditions.load, session.conditions.step_s
            at = [i for i in range(load.size) if (i < load.size // 2) is first and session.fitted[i]]
            ago = [np.interp(np.array(at) * step_s - k * reach / TAPS, step_s * np.arange(load.size), load)
                   for k in range(TAPS + 1)]  # fmt: skip
            rows.append(np.column_stack([ago[k] - ago[k + 1] for k in range(TAPS)]))
            targets.append(residual[at])
        whole, target = np.vstack(rows), np.concatenate(targets)
        ridge = math.sqrt(1e-6 * float(np.sum(whole**2)))
        weights = np.linalg.lstsq(
            np.vstack([whole, ridge * np.eye(TAPS)]), np.concatenate([target, np.zeros(TAPS)]), rcond=None
        )[0]
        for session, residual in zip(sessions, residuals, strict=True):
            load, step_s = session.conditions.load, session.conditions.step_s
            at = [i for i in range(load.size) if (i < load.size // 2) is not first and session.fitted[i]]
            width = round(STANDARD.hold_s / step_s)
            for begin in range(0, len(at), width):
                block = np.array(at[begin : begin + width])
                ago = [np.interp(block * step_s - k * reach / TAPS, step_s * np.arange(load.size), load)
                       for k in range(TAPS + 1)]  # fmt: skip
                left = residual[block] - sum(weights[k] * (ago[k] - ago[k + 1]) for k in range(TAPS))
                ratios.append(math.log(np.sum(residual[block] ** 2) / np.sum(left**2)))
                saved += float(np.sum(residual[block] ** 2) - np.sum(left**2))
                count += block.size
    score = float(np.mean(ratios)) / (float(np.std(ratios, ddof=1)) / math.sqrt(len(ratios)))
    return math.sqrt(max(saved / count, 0.0)), score, len(ratios)


def test_what_a_filter_of_the_load_predicts_is_that_of_written_out_sums() -> None:
    sessions = _random_loads(1, 700)
    sessions[1].fitted = np.arange(700) % 50 > 4
    residuals = [_ringing(one) + 0.1 * np.random.default_rng(2).standard_normal(700) for one in sessions]
    rms, score, blocks = _slow_predicted(sessions, residuals)
    found = predicted_structure(sessions, residuals, STANDARD)
    assert (found.rms, found.z, found.pairs) == (pytest.approx(rms, rel=1e-6), pytest.approx(score, rel=1e-6), blocks)


@pytest.mark.parametrize("seed", range(3))
def test_a_unit_that_rings_under_random_loads_is_told_from_noise_of_that_colour(seed: int) -> None:
    """Neither repeats, and neither is slow: only the load, which the one follows, tells them apart."""
    sessions, others = _random_loads(seed), _random_loads(100 + seed)
    rings = [_ringing(one) for one in sessions]
    found = predicted_structure(sessions, rings, STANDARD)
    rms = math.sqrt(float(np.mean(np.square(rings))))
    assert found.significant
    assert 0.75 * rms < found.rms <= rms
    assert not repeating_structure(sessions, rings, STANDARD).significant
    noise = predicted_structure(sessions, [_ringing(one) for one in others], STANDARD)
    assert not noise.significant
    assert noise.rms < 0.2 * rms
    loud = [one + 10.0 * other for one, other in zip(rings, [_ringing(one) for one in others], strict=True)]
    assert predicted_structure(sessions, loud, STANDARD).rms < 2.0 * rms


def test_of_a_load_that_stands_of_nothing_left_and_of_few_blocks_nothing_is_predicted() -> None:
    still = [_session(np.full(600, 0.5))]
    for sessions, residual in ((still, np.random.default_rng(1).standard_normal(600)), (still, np.zeros(600))):
        found = predicted_structure(sessions, [residual], STANDARD)
        assert (found.rms, found.significant) == (0.0, False)
    short = _random_loads(1, 100)[:1]
    assert predicted_structure(short, [_ringing(short[0])], STANDARD).pairs == 0


def test_what_is_beyond_white_noise_is_counted_by_samples() -> None:
    long, short = (_session(np.zeros(size)) for size in (900, 300))
    part = np.ones(300, dtype=bool)
    part[:100] = False
    short = replace_fitted(short, part)
    rng = np.random.default_rng(3)
    first = np.sin(np.arange(900) / 40.0) + 0.2 * rng.standard_normal(900)
    second = 3.0 + 0.1 * rng.standard_normal(300)
    square, white = 0.0, 0.0
    for one in (first, second[100:]):
        square += float(np.sum(one**2))
        white += one.size * noise_sd(one, STANDARD) ** 2
    found = beyond_noise([long, short], [first, second], STANDARD)
    assert found == pytest.approx(math.sqrt((square - white) / 1100.0))
    assert beyond_noise([], [], STANDARD) == 0.0
    # Less than white noise leaves nothing.
    steep = np.resize([1.0, -1.0], 900)
    assert beyond_noise([long], [steep], STANDARD) == 0.0


def replace_fitted(session: Any, fitted: NDArray[np.bool_]) -> Any:
    return SimpleNamespace(**{**vars(session), "fitted": fitted})


@pytest.mark.parametrize(
    ("level", "rate", "words"),
    [
        (0.0, 0.0, "0-25 % of full load while the load stands"),
        (0.25, 1.0, "25-50 % of full load while loading"),
        (0.499, -1.0, "25-50 % of full load while unloading"),
        (0.75, 1.0, "75-100 % of full load while loading"),
        (1.2, 1.0, "75-100 % of full load while loading"),
        (-0.3, -1.0, "0-25 % of full load while unloading"),
    ],
)
def test_the_place_of_the_largest_part_is_said(level: float, rate: float, words: str) -> None:
    """A session of one rate and one load, and a quiet one that is as long."""
    size = 200
    load = np.full(size, level)
    loud, quiet = _session(load, name="loud"), _session(np.full(size, 0.6), name="quiet")
    loud.conditions.cache["rate_per_s"] = np.full(size, rate)
    said = worst_place([quiet, loud], [np.full(size, 0.01), np.full(size, 1.0)], STANDARD)
    assert words in said
    assert said.startswith("100 % of the power that is left lies at")
    assert "(50 % of the samples)" in said
    assert "; the worst stretch is loud, " in said


@pytest.mark.parametrize(("by", "words"), [(0.99, "while the load stands"), (1.0, "while loading")])
def test_a_load_is_held_below_the_slowest_ramp(by: float, words: str) -> None:
    one = _session(np.full(100, 0.5))
    one.conditions.cache["rate_per_s"] = np.full(100, by * STANDARD.still_per_s)
    assert words in worst_place([one], [np.ones(100)], STANDARD)


def test_a_load_that_moves_at_every_sample_is_never_held() -> None:
    """However slowly it is logged: half of its samples differ from the last by less than what counts as a ramp."""
    steps = np.random.default_rng(2).normal(0.0, 0.06, 300)
    load = 0.5 + np.convolve(steps, 0.8 ** np.arange(40))[:300]
    one = _session(load, step_s=9.0)
    slowly = np.abs(one.conditions.rate_per_s) < STANDARD.still_per_s
    assert slowly.mean() > 0.3
    said = worst_place([one], [1.0 * slowly], STANDARD)
    assert "held" not in said


def test_the_tenth_of_the_time_with_the_largest_part_is_said() -> None:
    one = _session(np.full(1001, 0.5))
    usable = one.usable.copy()
    usable[950:1000] = False
    one = SimpleNamespace(**{**vars(one), "usable": usable})
    residual = np.full(1001, 0.1)
    residual[330:360] = 1.0
    residual[950:1000] = 50.0  # masked
    assert worst_place([one], [residual], STANDARD).endswith("; the worst stretch is one, 30-40 s")
    # Noise that averages out within half a second is no slow part.
    residual[600:700] = np.resize([2.0, -2.0], 100)
    assert worst_place([one], [residual], STANDARD).endswith("; the worst stretch is one, 30-40 s")
    assert worst_place([one], [np.zeros(1001)], STANDARD).startswith("0 % of the power that is left lies at")
    # It is the file's own time, which need not begin at none.
    one.recording.time_s += 2215.0
    assert worst_place([one], [residual], STANDARD).endswith("; the worst stretch is one, 2245-2255 s")
