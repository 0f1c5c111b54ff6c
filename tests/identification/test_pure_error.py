"""The F test of lack of fit, block by block: the same sums by plain loops over the repeats' samples."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import signal
from scipy.special import fdtrc

from smartshoe.errors import NotIdentifiableError, UsageError
from smartshoe.identification._cycles import CycleGroup, repeated_cycles
from smartshoe.identification.lack_of_fit import LackOfFitTest, _block_means, _dependence, lack_of_fit_of
from smartshoe.recording import Recording

Array = NDArray[np.float64]


def triangles(rates: list[float], rests_s: list[float]) -> Recording:
    """Triangles to 800 N, each after a rest, at 100 Hz."""
    at, load = [0.0], [0.0]
    for rate, rest_s in zip(rates, rests_s, strict=True):
        begin = at[-1] + rest_s
        at += [begin, begin + 800.0 / rate, begin + 1600.0 / rate]
        load += [0.0, 800.0, 0.0]
    time_s = np.arange(0.0, at[-1] + 3.0, 0.01)
    force_n = np.interp(time_s, at, load)
    return Recording.from_arrays(time_s=time_s, force_n=force_n, pressure_mbar=0.5 * force_n)


def blocks_of(group: CycleGroup, recording: Recording, residual: Array, block_s: float) -> list[list[list[float]]]:
    """By repeat and block its samples, NaN where missing."""
    count = int(round((group.last_s - group.first_s) / block_s, 6))
    table = []
    for repeat in group.repeats:
        row: list[list[float]] = [[] for _ in range(count)]
        places = group.places_s(repeat, [recording])
        for place, value in zip(places, residual[repeat.start : repeat.stop], strict=True):
            block = int(np.floor((place - group.first_s) / block_s))
            if group.first_s <= place <= group.last_s and block < count:
                row[block].append(float(value))
        table.append(row)
    return table


def plain(residual: Array, recording: Recording, unknowns: int) -> dict[str, object]:
    """The test by loops: F, its degrees as they are rounded, the share that repeats, and the cycles."""
    groups = repeated_cycles([recording])
    block_s = min(group.last_s - group.first_s for group in groups) / 16
    lack = pure = power = 0.0
    blocks = pure_blocks = cycles = 0
    tables = []
    for group in groups:
        table = blocks_of(group, recording, residual, block_s)
        table = [row for row in table if sum(np.isfinite(np.concatenate(row))) > 0.5 * sum(len(block) for block in row)]
        kept = [
            place
            for place in range(len(table[0]))
            if all(row[place] and sum(np.isfinite(row[place])) > 0.5 * len(row[place]) for row in table)
        ]
        seen = [[[value for value in row[place] if np.isfinite(value)] for place in kept] for row in table]
        deviations = np.zeros((len(seen), len(kept)))
        for at in range(len(kept)):
            every = [value for row in seen for value in row[at]]
            mean = sum(every) / len(every)
            lack += len(every) * mean**2
            power += sum(value**2 for value in every)
            for number, row in enumerate(seen):
                deviations[number, at] = np.sqrt(len(row[at])) * (sum(row[at]) / len(row[at]) - mean)
        pure += float(np.sum(deviations**2))
        blocks += len(kept)
        pure_blocks += len(kept) * (len(seen) - 1)
        cycles += len(seen)
        tables.append(deviations)
    whole, shrink = sum(float(np.sum(table**2)) for table in tables), 1.0
    for lag in range(1, max(table.shape[1] for table in tables) // 2):
        rho = 0.0
        for table in tables:
            for row in table:
                rho += sum(row[at] * row[at - lag] for at in range(lag, row.size)) / whole
        if abs(rho) < 2.0 / np.sqrt(pure_blocks):
            break
        shrink += 2.0 * rho**2
    variance = pure / pure_blocks
    statistic = lack / (blocks - unknowns) / variance
    free = ((blocks - unknowns) / shrink, pure_blocks / shrink)
    share = (lack - (blocks - unknowns) * variance) / power
    return {
        "statistic": pytest.approx(statistic, rel=1e-9),
        "p_value": pytest.approx(float(fdtrc(*free, statistic)), rel=1e-6, abs=1e-300),
        "degrees": (round(free[0]), round(free[1])),
        "repeatable_percent": pytest.approx(100.0 * min(max(share, 0.0), 1.0), abs=1e-9),
        "n_cycles": cycles,
    }


RECORDING = triangles([200.0, 400.0, 200.0, 400.0, 200.0], [1.0, 2.0, 1.5, 1.7, 1.2])


def _noise(correlation: float, seed: int = 4) -> Array:
    white = np.random.default_rng(seed).standard_normal(len(RECORDING) + 300)
    return np.asarray(signal.lfilter([1.0], [1.0, -correlation], white))[300:]


def _same(found: LackOfFitTest, wanted: dict[str, object]) -> None:
    for name, value in wanted.items():
        assert getattr(found, name) == value, name


@pytest.mark.parametrize("size", [1e-3, 40.0])
@pytest.mark.parametrize("correlation", [0.0, 0.9, 0.99])
@pytest.mark.parametrize("unknowns", [0, 6])
def test_the_test_is_that_of_plain_sums_over_blocks(size: float, correlation: float, unknowns: int) -> None:
    residual = size * _noise(correlation)
    found = lack_of_fit_of({"r": residual}, [RECORDING], unknowns=unknowns)
    _same(found, plain(residual, RECORDING, unknowns))
    assert found.n_cycles == 5


def test_what_repeats_is_said_and_what_does_not_is_not() -> None:
    wave = 0.02 * (RECORDING.force_n - 300.0)
    for residual, says in (
        (_noise(0.0) + wave, "the model lacks something"),
        (_noise(0.0), "no lack of fit is seen"),
    ):
        found = lack_of_fit_of({"r": residual}, [RECORDING], unknowns=3)
        _same(found, plain(residual, RECORDING, 3))
        assert says in found.says
    assert lack_of_fit_of({"r": 0.0 * wave + 3.0 + 1e-9 * _noise(0.0)}, [RECORDING], unknowns=0).repeatable_percent == (
        pytest.approx(100.0, abs=1e-6)
    )


@pytest.mark.parametrize(("seed", "lacks"), [(403, True), (423, True), (246, False), (20, False)])
def test_a_lack_is_said_below_one_percent(seed: int, lacks: bool) -> None:
    """Of white noise by chance: p is 0.007, 0.005, 0.011 and 0.018, where no sample lies on a block's border."""
    between = triangles([200.0, 400.0, 200.0, 400.0, 200.0], [1.0037, 2.0, 1.5, 1.7, 1.2])
    noise = np.random.default_rng(seed).standard_normal(len(between) + 300)[300:]
    found = lack_of_fit_of({"r": noise}, [between], unknowns=0)
    assert 0.004 < found.p_value < 0.02
    assert (found.p_value < 0.01) is lacks
    assert ("the model lacks something" in found.says) is lacks


def test_without_any_noise_all_of_it_repeats() -> None:
    """Of a residual that is the same in all repeats rounding takes the noise's place."""
    found = lack_of_fit_of({"r": np.full(len(RECORDING), 3.0)}, [RECORDING], unknowns=2)
    assert found.repeatable_percent == pytest.approx(100.0)
    assert found.p_value < 1e-30
    assert np.isfinite(found.statistic)
    with pytest.raises(NotIdentifiableError, match="residual is zero"):
        lack_of_fit_of({"r": np.zeros(len(RECORDING))}, [RECORDING], unknowns=2)


@pytest.mark.parametrize("share", [0.3, 0.45, 0.55, 0.7])
def test_blocks_and_repeats_that_do_not_count_for_the_most_part_are_left_out(share: float) -> None:
    groups = repeated_cycles([RECORDING])
    repeats = groups[0].repeats
    for first, last in ((0, 1), (0, len(repeats))):
        residual = _noise(0.0, seed=9)
        gone = np.random.default_rng(2).random(residual.size) < share
        for repeat in repeats[first:last]:
            here = slice(repeat.start, repeat.stop)
            residual[here] = np.where(gone[here], np.nan, residual[here])
        if last == 1 or share < 0.5:
            _same(lack_of_fit_of({"r": residual}, [RECORDING], unknowns=1), plain(residual, RECORDING, 1))


def test_as_many_places_as_unknowns_are_too_few_and_one_more_is_enough() -> None:
    residual = _noise(0.0)
    groups = repeated_cycles([RECORDING])
    block_s = min(group.last_s - group.first_s for group in groups) / 16
    places = sum(int(round((group.last_s - group.first_s) / block_s, 6)) for group in groups)
    assert lack_of_fit_of({"r": residual}, [RECORDING], unknowns=places - 1).degrees[0] == 1
    with pytest.raises(NotIdentifiableError, match=f"hold {places} counted places for {places} unknowns"):
        lack_of_fit_of({"r": residual}, [RECORDING], unknowns=places)


def test_a_kind_of_cycle_that_was_seen_but_once_says_nothing_and_the_other_stands() -> None:
    groups = repeated_cycles([RECORDING])
    residual = _noise(0.0)
    for repeat in groups[1].repeats[1:]:
        residual[repeat.start : repeat.stop] = np.nan
    found = lack_of_fit_of({"r": residual}, [RECORDING], unknowns=0)
    assert found.n_cycles == len(groups[0].repeats)


def test_means_are_of_the_samples_of_a_block() -> None:
    (group, *_) = repeated_cycles([RECORDING])
    block_s = (group.last_s - group.first_s) / 7.0
    residual = _noise(0.5)
    means, counts, squares = _block_means(group, [RECORDING], [residual], block_s)
    table = blocks_of(group, RECORDING, residual, block_s)
    assert means.shape == (len(group.repeats), 7)
    assert means == pytest.approx(np.array([[np.mean(block) for block in row] for row in table]))
    assert counts.tolist() == [[len(block) for block in row] for row in table]
    assert squares == pytest.approx(sum(value**2 for row in table for block in row for value in block))
    # Blocks as long as the cycle are one.
    assert _block_means(group, [RECORDING], [residual], 2.0 * block_s * 7.0)[0].shape[1] == 1


def test_a_dependence_ends_at_the_first_lag_within_its_own_noise() -> None:
    """Of rows of alternating ones each lag correlates by -(1 - k/m), (1 - k/m), ...; of noise none does."""
    turning = np.array([[1.0, -1.0] * 5, [-1.0, 1.0] * 5])
    squares = [(1.0 - k / 10.0) ** 2 for k in range(1, 5)]
    # Up to half of the row; of two rows ten are free, whose noise is 2/sqrt(10) = 0.63 and hides the fourth.
    assert _dependence([turning]) == pytest.approx(1.0 + 2.0 * sum(squares[:3]))
    assert _dependence([1e-3 * np.tile(turning, (5, 1))]) == pytest.approx(1.0 + 2.0 * sum(squares))
    # A shorter table has no pairs at its own length and beyond.
    both = [np.tile(turning, (5, 1)), np.array([[3.0, -3.0], [-3.0, 3.0]])]
    power = 100.0 + 36.0
    products = [-90.0 - 18.0, 80.0, -70.0, 60.0]
    assert _dependence(both) == pytest.approx(1.0 + 2.0 * sum((one / power) ** 2 for one in products))
    assert _dependence([np.zeros((3, 12))]) == 1.0
    rng = np.random.default_rng(1)
    assert _dependence([rng.standard_normal((4, 400))]) == 1.0


def test_numbers_for_json_are_those_of_the_test() -> None:
    found = lack_of_fit_of({"r": _noise(0.0)}, [RECORDING], unknowns=3)
    assert found.to_dict() == {
        "statistic": found.statistic, "p_value": found.p_value, "degrees": list(found.degrees),
        "repeatable_percent": found.repeatable_percent, "n_cycles": 5, "says": found.says,
    }  # fmt: skip
    assert LackOfFitTest(np.inf, np.nan, (1, 2), np.nan, 3, "so").to_dict()["statistic"] is None


def test_residuals_of_other_lengths_are_refused() -> None:
    with pytest.raises(UsageError, match="in order"):
        lack_of_fit_of({"r": np.zeros(len(RECORDING) - 1)}, [RECORDING], unknowns=0)
    with pytest.raises(NotIdentifiableError, match="no recording: no load cycle"):
        lack_of_fit_of({}, [], unknowns=0)
    with pytest.raises(NotIdentifiableError, match="no load cycle"):
        lack_of_fit_of({"r": _noise(0.0)}, [RECORDING], unknowns=0, skip_first=4)
