"""A table that was merged from two rates: the slower channel is blank in the rows between its own."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from smartshoe import Recording
from smartshoe.integrity import Integrity, examine

Array = NDArray[np.float64]

TIME_S = 0.01 * np.arange(6000)
TRIANGLE = np.abs(2.0 * (TIME_S / 6.0 % 1.0) - 1.0)
LOAD_N = 800.0 * TRIANGLE + 0.3 * np.random.default_rng(0).standard_normal(TIME_S.size)
READING = 100.0 * TRIANGLE + 0.05 * np.random.default_rng(1).standard_normal(TIME_S.size)
ROW = np.arange(TIME_S.size)
EVERYWHERE = np.ones(TIME_S.size, dtype=bool)


def _there(load: NDArray[np.bool_], reading: NDArray[np.bool_] = EVERYWHERE) -> Integrity:
    """What is found where the channels are logged in those rows."""
    blank = {"force_n": np.where(load, LOAD_N, np.nan), "pressure_mbar": np.where(reading, READING, np.nan)}
    return examine([Recording.from_arrays(time_s=TIME_S, room_degc=20.0 + 0.0 * TIME_S, **blank)])


@pytest.mark.parametrize("every", [2, 3, 10])
@pytest.mark.parametrize("first", [0, 1])
@pytest.mark.parametrize("which", ["load", "reading"])
def test_a_channel_that_is_blank_at_an_even_pace_is_used_where_it_is_logged(every: int, first: int, which: str) -> None:
    logged = ROW % every == first
    found = _there(logged) if which == "load" else _there(EVERYWHERE, logged)
    (said,) = found.faults
    name = "force" if which == "load" else "pressure"
    assert (said.kind, said.says) == (
        "missing_samples",
        f"{name} is logged every {0.01 * every:.3g} s and blank in the rows between: of all channels only those moments"
        " are used",
    )
    (taken,) = found.recordings
    np.testing.assert_array_equal(taken.time_s, TIME_S[logged])
    np.testing.assert_array_equal(taken.force_n, LOAD_N[logged])
    np.testing.assert_array_equal(taken.sensor.values, READING[logged])
    assert found.refusals == ()
    assert found.usable[0].all()


@pytest.mark.parametrize("every", [2, 10])
def test_rows_that_two_rates_never_share_are_drawn_on_lines(every: int) -> None:
    """But where the channel lacks samples of its own."""
    logged = ROW % every == 0
    missing = np.abs(ROW - 3 * every) < every
    found = _there(logged, ~logged & ~missing)
    assert found.faults[0].says.endswith("only those moments are used, what is blank there on lines between its own")
    (taken,) = found.recordings
    reading = taken.channels["pressure"]
    assert np.flatnonzero(~reading.present).tolist() == [0, 2, 3, 4]
    at = 20
    middle = 0.5 * (READING[at * every - 1] + READING[at * every + 1])
    assert reading.values[at] == pytest.approx(middle)
    assert found.usable[0].sum() == taken.time_s.size - 4


@pytest.mark.parametrize("share", [0.2, 0.8])
def test_blanks_at_no_even_pace_are_missing(share: float) -> None:
    there = np.random.default_rng(2).random(TIME_S.size) > share
    found = _there(there)
    assert "is missing in" in found.faults[0].says
    assert found.faults[0].share == pytest.approx(np.mean(~there))
    assert bool(found.refusals) is (share > 0.5)


def test_a_pace_that_is_no_whole_number_of_rows_is_even_to_a_row() -> None:
    found = _there(np.isin(ROW, np.rint(np.arange(0.0, 6000.0, 10.0 / 3.0))))
    assert [fault.kind for fault in found.faults] == ["missing_samples", "uneven_sampling"]
    assert len(found.recordings[0]) == 1800


def test_a_stretch_that_lacks_its_load_is_missing() -> None:
    found = _there((ROW < 2000) | (ROW > 4000))
    assert [fault.says for fault in found.faults] == [
        "the reference load force is missing in 2001 samples in a row: they are left out"
    ]


def test_what_the_slower_channel_lacks_of_its_own_is_a_gap() -> None:
    found = _there((ROW % 10 == 0) & ((ROW < 2000) | (ROW > 2100)))
    assert [fault.kind for fault in found.faults] == ["missing_samples", "gaps"]
