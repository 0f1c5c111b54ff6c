"""A load that is logged in coarse steps is put back between them, and what stays unknown of it is said."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from simulators.hidden.recordings import hide
from smartshoe import Recording, diagnose
from smartshoe.diagnosis import Thresholds
from smartshoe.integrity import examine
from smartshoe.integrity._stepped_load import _one_value_a_level, _through_edges, between_steps

Array = NDArray[np.float64]

STANDARD = Thresholds()
STEP_N = 20.0


def _coarse(recording: Recording, step_n: float = STEP_N) -> Recording:
    load = recording.load
    return recording.with_channel(load.with_values(step_n * np.rint(load.with_nan() / step_n)))


def _logged(load: Array, reading: Array, noise: float = 0.02) -> Recording:
    rng = np.random.default_rng(1)
    return Recording.from_arrays(
        time_s=0.01 * np.arange(load.size),
        force_n=load,
        pressure_mbar=0.1 * reading + noise * rng.standard_normal(load.size),
    )


def _lines(*corners: tuple[float, float]) -> Array:
    at_s, loads = zip(*corners, strict=True)
    return np.interp(np.arange(0.0, at_s[-1], 0.01), at_s, loads)


RAMPS_N = _lines(
    (0.0, 0.0), (3.0, 0.0), (8.0, 803.0), (13.0, 0.0), (16.0, 0.0), (18.0, 607.0), (20.0, 0.0), (23.0, 0.0)
)


# -- by hand ----------------------------------------------------------------------------------------------------------
def test_a_load_that_goes_on_lies_on_lines_through_the_edges_of_its_steps() -> None:
    time_s = np.arange(9.0)
    logged = np.repeat([0.0, 20.0, 40.0], 3)
    # The edges, 10 and 30, are half-way between samples; rests at either end come to them as fast as between them.
    lines = [0.0, 10.0 - 20.0 / 3.0 * 1.5, 10.0 - 10.0 / 3.0, *(10.0 + 20.0 / 3.0 * np.array([0.5, 1.5, 2.5]))]
    expected = [*lines, 30.0 + 10.0 / 3.0, 40.0, 40.0]
    assert _through_edges(time_s, logged, 20.0) == pytest.approx(np.array(expected))


def test_one_that_stands_lies_in_the_middle_and_one_that_turns_comes_no_farther() -> None:
    time_s = np.arange(19.0)
    logged = np.array([0.0, 0, 20, 20, 40, *[60.0] * 9, 40, 20, 20, 0, 0])
    found = _through_edges(time_s, logged, 20.0)
    assert found[6:13] == pytest.approx(60.0)
    logged = np.array([0.0, *[0.0] * 4, *[20.0] * 4, 40.0, *[20.0] * 4, *[0.0] * 5])
    assert _through_edges(time_s, logged, 20.0)[9] == pytest.approx(30.0 + 20.0 / 4.0 * 0.5)


@pytest.mark.parametrize("logged", [np.zeros(5), np.array([0.0, 0.0, 20.0, 20.0])])
def test_one_that_hardly_changes_is_as_it_was(logged: Array) -> None:
    assert _through_edges(np.arange(float(logged.size)), logged, 20.0) is logged


def test_values_of_one_level_that_differ_by_rounding_are_one() -> None:
    """As on a grid of a seventh: two of them have no edge between them."""
    levels = np.array([0, 1, 2, 3, 3, 2, 1, 0, 0, 1, 2, 2, 1, 0])
    values = 300.0 + 800.0 * levels / 7.0
    shaken = values + np.where(np.arange(values.size) % 3, 0.0, 1e-12)
    assert np.unique(shaken).size > 4
    found = _one_value_a_level(shaken, 800.0 / 7.0)
    assert np.unique(found).size == 4
    assert found == pytest.approx(values, abs=1e-9)


# -- recordings -------------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_ramps_are_put_back_and_the_error_is_that_of_a_load_that_stands(sign: float) -> None:
    found, (told,) = between_steps(_coarse(_logged(RAMPS_N, sign * RAMPS_N)), STANDARD)
    before, after = (float(np.std(one - RAMPS_N)) for one in (STEP_N * np.rint(RAMPS_N / STEP_N), found.load.values))
    assert before > 3.0
    assert after < 0.7
    assert told.kind == "quantisation"
    assert told.error == pytest.approx(0.1 * STEP_N / np.sqrt(12.0), rel=0.01)
    assert told.says.startswith("the load is quantised in steps of 20 N, 2.5 % of its span: ")


def test_weights_are_as_heavy_as_they_are_logged() -> None:
    """The reading stands with them, and creeps."""
    load = np.repeat([0.0, 20, 40, 60, 80, 60, 40, 20, 0, 20, 60, 80, 40, 0], 300)
    crept = np.repeat(np.diff(load[::300], prepend=0.0), 300) * np.tile(1.0 - np.exp(-np.arange(300) / 100.0), 14)
    recording = _logged(load, load + 0.1 * crept)
    found, told = between_steps(recording, STANDARD)
    assert (found is recording, told) == (True, [])


@pytest.mark.parametrize("seed", range(8, 12))
def test_a_commanded_staircase_of_even_ramps_is_on_no_grid(seed: int) -> None:
    """One sample on each level of its ramps: within them it moves by rounding alone, which any reading may go with."""
    corners = [(0.0, 0.0), (3.0, 0.0)]
    for k, level in enumerate((200.0, 400.0, 600.0, 800.0, 600.0, 400.0, 200.0, 0.0)):
        corners += [(4.0 + 8.0 * k, level), (11.0 + 8.0 * k, level)]
    time_s = 0.02 * np.arange(3400)
    load = np.round(np.interp(time_s, *zip(*corners, strict=True)), 5)
    noise = 0.05 * np.random.default_rng(seed).standard_normal(load.size)
    recording = Recording.from_arrays(time_s=time_s, force_n=load, pressure_mbar=0.1 * load + noise)
    assert between_steps(recording, STANDARD)[1] == []


def test_a_grid_that_noise_takes_out_is_left_and_so_is_a_fine_one() -> None:
    noisy = RAMPS_N + 8.0 * np.random.default_rng(2).standard_normal(RAMPS_N.size)
    for load, step_n in ((noisy, STEP_N), (RAMPS_N, 0.5), (RAMPS_N, 1e-6)):
        recording = _coarse(_logged(load, RAMPS_N), step_n)
        assert between_steps(recording, STANDARD) == (recording, [])


def test_what_is_missing_stays_missing() -> None:
    coarse = _coarse(_logged(RAMPS_N, RAMPS_N))
    values = coarse.load.values.copy()
    values[500:520] = np.nan
    found, _ = between_steps(coarse.with_channel(coarse.load.with_values(values)), STANDARD)
    assert np.flatnonzero(~found.load.present).tolist() == list(range(500, 520))


# -- diagnoses --------------------------------------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("protocol", "seed"),
    [
        ("staircase", 1),
        *(pytest.param(*case, marks=pytest.mark.long) for case in (("rates", 1), ("holds", 0), ("step", 1))),
        pytest.param("rates", 2, marks=pytest.mark.bank),
    ],
)
def test_a_sound_unit_is_as_good_as_such_a_load_can_tell(protocol: str, seed: int) -> None:
    """Each was unexplained, but for what two of them were told."""
    case = hide({}, protocol=protocol, seed=seed)
    found = diagnose([_coarse(one) for one in case.recordings], [_coarse(one) for one in case.hold_out])
    assert (found.verdict, found.causes) == ("adequate", ())


@pytest.mark.parametrize(
    ("effect", "percent", "protocol", "seed"),
    [
        ("zero_drift", 0.6, "rates_and_holds", 5),
        pytest.param("second_relaxation", 0.6, "mixed", 6, marks=pytest.mark.long),
        pytest.param("linear_leak", 1.0, "mixed", 6, marks=pytest.mark.long),
    ],
)
def test_an_effect_is_named_as_under_a_fine_load(effect: str, percent: float, protocol: str, seed: int) -> None:
    case = hide({effect: percent}, protocol=protocol, seed=seed)
    found = diagnose([_coarse(one) for one in case.recordings], [_coarse(one) for one in case.hold_out])
    assert found.verdict == "explained"
    assert [cause.name for cause in found.causes] == [effect]


def test_the_fault_is_told_of_each_recording() -> None:
    case = hide({}, protocol="rates", seed=1)
    found = examine([_coarse(one) for one in case.recordings], STANDARD)
    assert [(fault.kind, fault.recording) for fault in found.faults] == [
        ("quantisation", place) for place in range(len(case.recordings))
    ]
