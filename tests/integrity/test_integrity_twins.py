"""Recordings that share samples with another one are told, whatever they are called and wherever those begin."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from smartshoe import Recording, diagnose
from smartshoe.diagnosis import Thresholds
from smartshoe.integrity import Twin, twins

STANDARD = Thresholds()
TIME_S = np.arange(0.0, 20.0, 0.01)
LOAD_N = 800.0 * np.abs(2.0 * (TIME_S / 4.0 % 1.0) - 1.0)


def _run(name: str, seed: int = 1, lost: int | None = None) -> Recording:
    reading = 0.1 * LOAD_N + np.random.default_rng(seed).standard_normal(TIME_S.size)
    if lost is not None:
        reading[lost] = np.nan
    return Recording.from_arrays(time_s=TIME_S, force_n=LOAD_N, pressure_mbar=reading, name=name)


def _part(of: Recording, begin: int, stop: int, name: str) -> Recording:
    """Cut out, on a clock that starts at zero again."""
    part = of.taken(slice(begin, stop))
    return Recording.from_arrays(
        time_s=part.time_s - part.time_s[0],
        force_n=part.force_n,
        pressure_mbar=part.sensor.with_nan(),
        name=name,
    )


def _told(*recordings: Recording) -> dict[int, Twin]:
    return twins(recordings, STANDARD)


def _sampled(count: int, seed: int, load_step_n: float = 0.0, step: float = 0.0, noise: float = 1.0) -> Recording:
    """Triangles with rests, load and reading with noise and on a grid."""
    rng = np.random.default_rng(seed)
    load = 800.0 * np.maximum(np.abs(2.0 * (np.arange(count) % 700 / 700.0) - 1.0) - 0.5, 0.0)
    values = (one + noise * rng.standard_normal(count) for one in (load, 0.1 * load))
    gridded = [
        size * np.rint(one / size) if size else one for one, size in zip(values, (load_step_n, step), strict=True)
    ]
    return Recording.from_arrays(
        time_s=0.01 * np.arange(count), force_n=gridded[0], pressure_mbar=gridded[1], name=f"run_{seed}"
    )


def test_copies_are_told_once_each_by_the_first_that_holds_the_same() -> None:
    """By their places."""
    found = _told(_run("one"), _run("other", 2), _run("copy"), _run("again"))
    assert {place: one.says for place, one in found.items()} == {
        place: f"{name} holds the same samples as one: it is one experiment, given twice"
        for place, name in ((2, "copy"), (3, "again"))
    }
    assert all(one.at.all() for one in found.values())
    assert list(_told(_run("one", lost=7), _run("copy", lost=7))) == [1]


def test_the_same_course_measured_again_is_another_experiment() -> None:
    assert _told() == {}
    assert _told(_run("one"), _run("again", 2)) == {}
    one = _run("one")
    assert _told(one, one.without("pressure")) == {}
    assert _told(one, one.with_channel(replace(one["force"], values=1.001 * LOAD_N))) == {}


def test_what_was_cropped_is_told_whichever_is_given_first() -> None:
    whole, part = _run("whole"), _part(_run("whole"), 300, 1500, "part")
    (found,) = _told(whole, part).values()
    assert found.at.all()
    assert found.says == "part holds the same samples as whole: it is one experiment, given twice"
    (found,) = _told(part, whole).values()
    assert np.flatnonzero(found.at).tolist() == list(range(300, 1500))
    assert found.says == "whole holds the same samples as part from 3 to 14.99 s: it is one experiment, given twice"


def test_recordings_that_overlap_share_the_overlap_alone() -> None:
    whole = _run("whole")
    (found,) = _told(_part(whole, 0, 1200, "first"), _part(whole, 1000, 2000, "second")).values()
    assert np.flatnonzero(found.at).tolist() == list(range(200))


def test_one_that_was_put_together_of_pieces_is_told_all_of_them() -> None:
    one, other = _run("one"), _run("other", 2)
    pieces = [_part(one, 500, 900, "a"), _part(other, 100, 700, "b")]
    joined = Recording.from_arrays(
        time_s=0.01 * np.arange(1000),
        force_n=np.concatenate([piece.force_n for piece in pieces]),
        pressure_mbar=np.concatenate([piece.sensor.values for piece in pieces]),
        name="joined",
    )
    (found,) = _told(one, other, joined).values()
    assert found.at.all()
    assert found.says.startswith("joined holds the same samples as one, other: ")
    (found,) = _told(*pieces, one).values()
    assert found.says.startswith("one holds the same samples as a from 5 to 8.99 s: ")


@pytest.mark.parametrize("lost", [700, 1999])
def test_a_sample_that_is_lost_in_one_of_them_ends_no_copy(lost: int) -> None:
    (found,) = _told(_run("one"), _run("copy", lost=lost)).values()
    assert not found.at[lost]
    assert found.at.sum() == TIME_S.size - 1


def test_fewer_samples_than_tell_anything_are_not_looked_at() -> None:
    few = STANDARD.least_samples
    assert _told(_run("one"), _part(_run("one"), 0, few - 1, "short")) == {}
    assert list(_told(_run("one"), _part(_run("one"), 0, few, "enough"))) == [1]


@pytest.mark.parametrize(
    ("load_step_n", "step", "noise"),
    [
        *((3.2, 0.4, noise) for noise in (0.3, 1.0)),
        *((32.0, 4.0, noise) for noise in (0.3, 1.0)),
        *((0.0, 4.0, noise) for noise in (0.05, 0.3, 1.0)),
        *(pytest.param(*steps, 0.05, marks=pytest.mark.long) for steps in ((3.2, 0.4), (32.0, 4.0))),
    ],
)
def test_coarse_readings_are_not_alike_by_chance_and_copies_of_them_are_told(
    load_step_n: float, step: float, noise: float
) -> None:
    """Rests at one value for seconds in each, 20 to 200 levels."""
    runs = [_sampled(4000, seed, load_step_n, step, noise) for seed in range(12)]
    assert _told(*runs) == {}
    (found,) = _told(*runs, _part(runs[3], 1000, 3000, "part")).values()
    assert found.at.all()


def test_a_signal_that_stands_or_repeats_itself_says_nothing_but_as_a_whole() -> None:
    assert _told(_standing(900), _standing(1200)) == {}
    assert list(_told(_standing(900), _standing(900))) == [1]
    periods = [_sampled(count, 1, noise=0.0) for count in (4900, 3500, 4900)]
    assert list(_told(*periods)) == [2]


def _standing(count: int) -> Recording:
    return Recording.from_arrays(
        time_s=0.01 * np.arange(count), force_n=np.full(count, 5.0), pressure_mbar=np.full(count, 12.0)
    )


def test_it_takes_no_time() -> None:
    long, short = _sampled(73_000, 1), [_sampled(300, seed) for seed in range(2, 2002)]
    begun = time.process_time()
    assert list(_told(long, _part(long, 20_000, 50_000, "part"))) == [1]
    assert _told(*short) == {}
    assert time.process_time() - begun < 3.0  # some tenths of one


def _pressed(seed: int, count: int = 6000) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    rng = np.random.default_rng(seed)
    peaks_n = np.repeat(rng.uniform(300.0, 800.0, count // 400), 400)
    load = peaks_n * np.maximum(np.sin(2.0 * np.pi * np.arange(count) / 400.0), 0.0)
    return load + 0.3 * rng.standard_normal(count), 0.1 * load + 0.1 * rng.standard_normal(count)


def _measured(seed: int, name: str) -> Recording:
    load, reading = _pressed(seed)
    return Recording.from_arrays(time_s=0.01 * np.arange(load.size), force_n=load, pressure_mbar=reading, name=name)


@pytest.mark.long
def test_a_diagnosis_does_not_judge_on_what_it_was_fitted_to() -> None:
    """Left out where nothing else is there, else judged on the rest."""
    one, other = _measured(1, "one"), _measured(2, "other")
    found = diagnose([one, other], hold_out=[_part(one, 1000, 4000, "part")])
    assert found.left_out == ("part holds the same samples as one: it is one experiment, given twice",)
    assert any("load cycles of those that are fitted are held out instead" in said for said in found.limits)
    found = diagnose([_part(one, 0, 3000, "part"), other], hold_out=[one])
    assert found.left_out == ()
    assert any(
        said.startswith("left out: one holds the same samples as part from 0 to 29.99 s") for said in found.limits
    )
    judged = next(trace for trace in found.traces if trace.held_out.any())
    assert not judged.usable[:2900].any()
    assert judged.usable[3100:].all()
