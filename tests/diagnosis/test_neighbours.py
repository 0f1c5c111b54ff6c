"""Of several channels beside the unit's own, the one that its reading holds is the neighbour; a copy of it is none."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from smartshoe import Recording, diagnose
from smartshoe.diagnosis import Thresholds
from smartshoe.diagnosis._neighbours import neighbours_of, with_one_neighbour
from smartshoe.recording import Channel
from smartshoe.units import MILLIBAR

Array = NDArray[np.float64]

STANDARD = Thresholds()
TIME_S = 0.02 * np.arange(6000)
LOAD_N = 800.0 * np.clip(1.0 - np.abs(TIME_S % 12.0 - 6.0) / 4.0, 0.0, 1.0)


def _pressed(late_s: float) -> Array:
    return 0.1 * np.roll(LOAD_N, round(late_s / 0.02))


def _noise(seed: int) -> Array:
    return np.asarray(0.05 * np.random.default_rng(seed).standard_normal(TIME_S.size))


HEEL, TOE = _pressed(5.0) + _noise(1), _pressed(8.0) + _noise(2)
READING = _pressed(0.0) + 0.02 * _pressed(5.0) + _noise(3)


def _recording(**beside: Array) -> Recording:
    one = Recording.from_arrays(time_s=TIME_S, force_n=LOAD_N, pressure_mbar=READING, name="pressed")
    for name, values in beside.items():
        one = one.with_channel(Channel.from_values(name, values, MILLIBAR))
    return one


def _of(*recordings: Recording, count: int | None = None) -> tuple[list[list[str]], list[str]]:
    usable = [np.ones(len(one), dtype=bool) for one in recordings]
    kept, said = with_one_neighbour(recordings, len(recordings) if count is None else count, usable, STANDARD)
    return [[one.name for one in neighbours_of(each)] for each in kept], said


@pytest.mark.parametrize("beside", [{"heel": HEEL, "toe": TOE}, {"toe": TOE, "heel": HEEL}], ids="-".join)
def test_it_is_the_one_that_the_reading_follows_in_whatever_column_it_stands(beside: dict[str, Array]) -> None:
    assert _of(_recording(**beside)) == (
        [["heel"]],
        ["cross talk is not looked for of toe, but of heel alone, which the reading follows best"],
    )


def test_of_a_single_one_nothing_is_said() -> None:
    assert _of(_recording(toe=TOE)) == ([["toe"]], [])
    assert _of(_recording()) == ([[]], [])


def test_what_is_held_out_does_not_choose() -> None:
    fitted, held_out = _recording(toe=TOE, heel=HEEL), _recording(toe=0.02 * _pressed(5.0), heel=TOE)
    assert _of(fitted, held_out, count=1)[0] == [["heel"], ["heel"]]


def test_one_that_not_all_recordings_hold_is_none() -> None:
    assert _of(_recording(toe=TOE), _recording(heel=HEEL)) == (
        [[], []],
        ["cross talk is not looked for of toe, heel: not all recordings hold it"],
    )


def test_the_same_channel_in_another_column_is_none_and_one_with_noise_of_its_own_is() -> None:
    copy = np.round(0.3 * READING + 2.0, 4)
    assert _of(_recording(meta1=copy)) == ([[]], ["meta1 reads as the unit does, noise and all: it is no neighbour"])
    assert _of(_recording(meta1=copy, heel=HEEL))[0] == [["heel"]]
    assert _of(_recording(meta1=0.3 * (READING - _noise(3)) + _noise(4))) == ([["meta1"]], [])


def test_one_under_the_same_quick_load_is_no_copy() -> None:
    """At ten samples a period third differences are the load's, and no noise."""
    load = 400.0 + 400.0 * np.sin(2 * np.pi * 5.0 * TIME_S)
    one = Recording.from_arrays(time_s=TIME_S, force_n=load, pressure_mbar=0.1 * load + _noise(1))
    other = Channel.from_values("meta1", 0.05 * load + _noise(2), MILLIBAR)
    assert _of(one.with_channel(other)) == ([["meta1"]], [])


def test_cross_talk_is_named_of_the_second_of_two_neighbours() -> None:
    found = diagnose(_recording(toe=TOE, heel=HEEL))
    assert [cause.name for cause in found.causes] == ["cross_talk"]
    assert any("of heel alone" in said for said in found.limits)
