"""Recordings of a few samples among good ones: little is learnt of them, and nothing else is lost."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from test_diagnosis_parts import MODEL

from smartshoe import Recording, diagnose
from smartshoe.diagnosis import Thresholds
from smartshoe.diagnosis._averaging import kernel, smoothed
from smartshoe.diagnosis._residual_structure import worst_place
from smartshoe.diagnosis._scale import Scale
from smartshoe.diagnosis._session import prepare
from smartshoe.models.effects import Conditions
from smartshoe.units import MILLIBAR

Array = NDArray[np.float64]

STANDARD = Thresholds()


def _pressed(count: int, period_s: float, name: str, seed: int = 0) -> Recording:
    """Triangles to 800 N at 100 Hz, with noise."""
    time_s = 0.01 * np.arange(count)
    load = 1.0 - np.abs(2.0 * (time_s / period_s % 1.0) - 1.0)
    noise = 0.03 * np.random.default_rng(seed).standard_normal(count)
    reading = MODEL.reading(Conditions(time_s, load, 0.01)) + noise
    return Recording.from_arrays(time_s=time_s, force_n=800.0 * load, pressure_mbar=reading, name=name)


GOOD = [_pressed(9_000, 30.0, "slow", 1), _pressed(6_000, 20.0, "less slow", 2)]


@pytest.mark.parametrize("count", [2, 3, 8, 60, 120])
@pytest.mark.parametrize("is_held_out", [True, False])
def test_a_diagnosis_bears_a_recording_of_any_length(count: int, is_held_out: bool) -> None:
    short = _pressed(count, 8.0, "short")
    found = diagnose(GOOD, hold_out=short) if is_held_out else diagnose([*GOOD, short])
    assert found.verdict == "adequate"
    left_out = any(said.startswith("left out: short") for said in found.limits)
    assert len(found.traces) == (2 if left_out else 3)
    assert left_out or count >= STANDARD.least_samples


@pytest.mark.parametrize("count", [104, 112, 160])
def test_a_reading_that_copies_a_load_of_many_corners_is_good_to_rounding(count: int) -> None:
    """A brake's torque, reckoned from the weight: the load is no noisier than its reading follows."""
    load = np.abs(np.cumsum(np.random.default_rng(3).standard_normal(count)))
    copied = Recording.from_arrays(time_s=0.02 * np.arange(count), force_n=load, pressure_mbar=0.127 * load)
    found = diagnose(copied)
    assert found.verdict == "adequate"
    assert found.baseline.fit_percent > 99.99


@pytest.mark.parametrize("count", [2, 3, 5, 30])
def test_a_window_is_no_longer_than_what_it_averages(count: int) -> None:
    run = _pressed(count, 8.0, "short")
    every = np.ones(count, dtype=bool)
    (one,) = prepare([run], [every], [False], Scale(800.0, 140.0, MILLIBAR), [25], STANDARD)
    assert one.reading.shape == one.usable.shape == one.conditions.time_s.shape
    expected = smoothed(run.sensor.values / 140.0, kernel(min(count, 25)), 25)
    assert one.reading == pytest.approx(expected)


@pytest.mark.parametrize(("count", "stretch"), [(1, "0-0 s"), (4, "2.2-3.0 s"), (40, "35-39 s")])
def test_where_a_residual_is_largest_is_told_of_as_many_stretches_as_there_are_samples(
    count: int, stretch: str
) -> None:
    """At a second a sample, so that nothing is averaged."""
    run = _pressed(count + 1, 8.0, "short")
    load = np.linspace(0.0, 1.0, count)
    one: Any = SimpleNamespace(
        thinned=1,
        conditions=Conditions(np.arange(count) * 1.0, load, 1.0),
        usable=np.ones(count, dtype=bool),
        recording=run,
    )
    assert worst_place([one], [load + 0.1], STANDARD).endswith(f"; the worst stretch is short, {stretch}")
