"""Recordings that hold the same samples as another one are told, whatever they are called."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from smartshoe.integrity import twins
from smartshoe.recording import Recording

TIME_S = np.arange(0.0, 20.0, 0.01)
LOAD_N = 800.0 * np.abs(2.0 * (TIME_S / 4.0 % 1.0) - 1.0)


def _run(name: str, seed: int = 1, lost: int | None = None) -> Recording:
    reading = 0.1 * LOAD_N + np.random.default_rng(seed).standard_normal(TIME_S.size)
    if lost is not None:
        reading[lost] = np.nan
    return Recording.from_arrays(time_s=TIME_S, force_n=LOAD_N, pressure_mbar=reading, name=name)


def test_copies_are_told_once_each_by_the_first_that_holds_the_same() -> None:
    """By their places."""
    assert twins([_run("one"), _run("other", 2), _run("copy"), _run("again")]) == {
        place: f"{name} holds the same samples as one: it is one experiment, given twice"
        for place, name in ((2, "copy"), (3, "again"))
    }
    assert list(twins([_run("one", lost=7), _run("copy", lost=7)])) == [1]


def test_the_same_course_measured_again_is_another_experiment() -> None:
    assert twins([]) == {}
    assert twins([_run("one"), _run("again", 2), _run("one", lost=7), _run("one").taken(slice(0, 500))]) == {}
    one = _run("one")
    assert twins([one, one.without("pressure")]) == {}
    assert twins([one, one.with_channel(replace(one["force"], values=1.001 * LOAD_N))]) == {}
