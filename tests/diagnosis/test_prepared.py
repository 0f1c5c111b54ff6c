"""Recordings prepared for a diagnosis: what is held out, on which clock they are, and what is said beforehand."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from test_procedure_by_hand import LOAD, STANDARD, TIME_S

from smartshoe import Recording
from smartshoe.diagnosis._prepared import prepared
from smartshoe.integrity import OneClock

Array = NDArray[np.float64]


def test_recordings_are_prepared_with_what_is_held_out_and_what_is_said_beforehand() -> None:
    def run(seed: int) -> Recording:
        noise = 0.1 * np.random.default_rng(seed).standard_normal(600)
        return Recording.from_arrays(
            time_s=TIME_S, force_n=800.0 * LOAD, pressure_mbar=140.0 * LOAD + noise, name=f"run_{seed}"
        )

    runs = [run(seed) for seed in range(3)]
    usable = tuple(np.ones(600, dtype=bool) for _ in runs)

    def integrity(*lags_s: float, shared: OneClock | None = None) -> Any:
        return SimpleNamespace(
            clock_offset_s=lags_s,
            clock_rate=(0.0,) * 3,
            one_clock=shared,
            usable=usable,
            others=frozenset(),
            are_about_mean=False,
            judged_lags_s={},
        )

    def with_lag(lag_s: float) -> Any:
        return integrity(*(lag_s,) * 3, shared=OneClock(lag_s, 0.0))

    found = prepared(runs, 2, with_lag(0.0), STANDARD)
    assert [bool(one.held_out.all()) for one in found.sessions] == [False, False, True]
    assert [one.thinned for one in found.fine] == [1, 1, 1]
    assert not found.is_no_unit
    assert found.start.parts == ()
    within = prepared(runs, 3, with_lag(0.0), STANDARD)
    assert all(0.1 < float(one.held_out.mean()) < 0.6 for one in within.sessions)
    late = prepared(runs, 3, with_lag(0.3), STANDARD)
    ((name, value),) = [(one.name, one.values) for one in late.start.parts]
    assert (name, value) == ("delay", pytest.approx([0.3]))
    assert (late.start.relaxing_share, late.start.relaxation_rate_per_s) == (0.08, 0.22)
    assert not late.is_moved
    # A reading that is moved by itself matters where it is fitted.
    for lags, count, is_moved in (((0.3, 0.0, 0.0), 2, True), ((0.0, 0.0, 0.3), 2, False), ((0.0, 0.0, 0.3), 3, True)):
        assert prepared(runs, count, integrity(*lags), STANDARD).is_moved is is_moved
    # What the load adds up to is no unit's either, but for a reading whose edges are late.
    added_up = np.cumsum(LOAD - LOAD.mean())
    integrals = [replace_reading(one, 140.0 * added_up / np.ptp(added_up)) for one in runs]
    assert prepared(integrals, 3, with_lag(0.0), STANDARD).is_integral
    assert not prepared(integrals, 3, with_lag(0.3), STANDARD).is_integral
    assert not within.is_integral
    # Friction in each recording is no unit's; in one of them it is said.
    lasting_memory = [replace_reading(one, 5.0 * np.sign(np.gradient(LOAD))) for one in runs]
    assert prepared(lasting_memory, 3, with_lag(0.0), STANDARD).is_no_unit
    mixed = prepared([runs[0], lasting_memory[1], runs[2]], 3, with_lag(0.0), STANDARD)
    assert not mixed.is_no_unit
    assert sum("friction; Coulomb" in said for said in mixed.limits) == 1
    assert sum("friction; Coulomb" in said for said in prepared(runs, 3, with_lag(0.0), STANDARD).limits) == 0


def replace_reading(one: Recording, reading: Array) -> Recording:
    return Recording.from_arrays(time_s=one.time_s, force_n=one.force_n, pressure_mbar=reading, name=one.name)
