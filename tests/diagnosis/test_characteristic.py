"""How a reading runs over its load, told without a model."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from smartshoe.diagnosis import Thresholds
from smartshoe.diagnosis._characteristic import (
    Branches,
    branches_of,
    characteristic_of,
    conductance_of,
    friction_of,
)
from smartshoe.recording import Recording

Array = NDArray[np.float64]

TIME_S = np.arange(0.0, 60.0, 0.01)
STANDARD = Thresholds()
TRIANGLE = 100.0 * (2.0 * np.abs(2.0 * (TIME_S / 6.0 % 1.0) - 1.0) - 1.0)


def _said(reading: Array, load: Array = TRIANGLE) -> str | None:
    return characteristic_of(Recording.from_arrays(time_s=TIME_S, force_n=load, pressure_mbar=reading), STANDARD)


def _rising() -> Array:
    return np.sign(np.gradient(TRIANGLE))


@given(half=st.floats(1.0, 50.0), offset=st.floats(-200.0, 200.0), seed=st.integers(0, 1000))
@settings(max_examples=15)
def test_friction_is_seen_as_a_reading_that_follows_the_direction(half: float, offset: float, seed: int) -> None:
    noise = np.random.default_rng(seed).normal(0.0, 0.05 * half, TIME_S.size)
    said = _said(offset + half * _rising() + noise)
    assert said is not None
    assert "not follow this load but its direction" in said
    assert float(re.findall(r"lies ([\d.]+) mbar above", said)[0]) == pytest.approx(half, rel=0.02)


def test_friction_that_opposes_lies_below() -> None:
    said = _said(-5.0 * _rising())
    assert said is not None
    assert "5 mbar below" in said


@pytest.mark.parametrize(
    ("reading", "words"),
    [
        (50.0 * np.tanh(TRIANGLE / 20.0), "it flattens"),
        (TRIANGLE**3 / 1e4, "it steepens"),
        (TRIANGLE, "nearly straight"),
    ],
    ids=["saturates", "hardens", "straight"],
)
def test_the_curve_is_told(reading: Array, words: str) -> None:
    said = _said(reading)
    assert said is not None
    assert words in said


@pytest.mark.parametrize(
    ("reading", "is_of_friction"),
    [
        (50.0 * np.tanh(TRIANGLE / 20.0), True),
        (60.0 + 50.0 * np.tanh(TRIANGLE / 20.0), False),
        (60.0 + 50.0 * np.sign(TRIANGLE) * np.abs(TRIANGLE / 100.0) ** 0.25, False),
    ],
    ids=["odd", "of one sign", "a contact, its axes exchanged"],
)
def test_friction_is_named_only_where_load_and_reading_have_two_signs(reading: Array, is_of_friction: bool) -> None:
    """What opposes a motion turns with it; a curve that flattens may be anything."""
    said = str(_said(reading))
    assert "it flattens" in said
    assert ("as friction does that saturates" in said) is is_of_friction
    assert ("damping" in said) is is_of_friction


def test_slopes_are_those_of_the_curve() -> None:
    said = _said(3.0 * TRIANGLE)
    assert said is not None
    assert [float(value) for value in re.findall(r"by ([\d.]+) mbar/N", said)] == pytest.approx([3.0, 3.0], rel=0.01)


def test_a_reading_that_has_nothing_to_do_with_the_load_has_no_course() -> None:
    assert _said(np.random.default_rng(1).normal(0.0, 1.0, TIME_S.size)) is None
    assert _said(np.full(TIME_S.size, 5.0)) is None


def _numbers(said: str | None) -> tuple[float, float, float]:
    """Slopes about the middle and at the ends, and how far the branches lie to either side."""
    assert said is not None
    middle, ends = (float(value) for value in re.findall(r"by ([\d.]+) mbar/N", said))
    return middle, ends, float(re.findall(r"lie ([\d.e-]+) mbar to either side", said)[0])


def test_slopes_of_a_curve_are_told_where_they_are() -> None:
    """Of u + 2 u^3 on -1..1: lines through its middle quarter and its outer halves, either side."""
    u = np.linspace(-1.0, 1.0, 4001)
    curve = u + 2.0 * u**3
    middle, ends, apart = _numbers(_said(100.0 * (TRIANGLE / 100.0 + 2.0 * (TRIANGLE / 100.0) ** 3)))
    for part, found in ((np.abs(u) < 0.25, middle), (u > 0.5, ends)):
        assert found == pytest.approx(float(np.polyfit(u[part], curve[part], 1)[0]), rel=0.05)
    assert apart < 1.0


def test_ends_that_differ_are_told_by_their_mean() -> None:
    lower, upper = np.minimum(TRIANGLE + 30.0, 0.0), np.maximum(TRIANGLE - 30.0, 0.0)
    _, ends, _ = _numbers(_said(TRIANGLE + 1.0 * upper + 3.0 * lower))
    assert ends == pytest.approx(0.5 * (2.0 + 4.0), rel=0.05)  # beyond 30 of 100, so over the outer halves


@given(half=st.floats(1.0, 15.0), slope=st.floats(0.5, 4.0))
@settings(max_examples=10)
def test_a_loop_is_told_by_half_its_width(half: float, slope: float) -> None:
    middle, ends, apart = _numbers(_said(slope * TRIANGLE + half * _rising()))
    assert apart == pytest.approx(half, rel=0.03)
    assert (middle, ends) == (pytest.approx(slope, rel=0.05), pytest.approx(slope, rel=0.05))


def test_how_much_the_curve_and_the_branches_explain() -> None:
    def found(reading: Array) -> Branches:
        one = branches_of(Recording.from_arrays(time_s=TIME_S, force_n=TRIANGLE, pressure_mbar=reading), STANDARD)
        assert one is not None
        return one

    line, lasting_memory = found(TRIANGLE), found(10.0 * _rising())
    assert line.by_curve == pytest.approx(1.0, abs=0.01)
    assert (lasting_memory.by_curve, lasting_memory.by_branch) == (
        pytest.approx(0.0, abs=0.02),
        pytest.approx(1.0, abs=0.02),
    )
    assert lasting_memory.ups == pytest.approx(np.full(lasting_memory.place.size, 10.0))
    assert lasting_memory.mean == pytest.approx(np.zeros(lasting_memory.place.size))
    noise = 20.0 * np.random.default_rng(3).standard_normal(TIME_S.size)
    power = float(np.var(TRIANGLE))
    assert found(TRIANGLE + noise).by_curve == pytest.approx(power / (power + 400.0), abs=0.03)
    assert line.place[0] == pytest.approx(-98.0, abs=6.0)
    assert line.place[-1] == pytest.approx(98.0, abs=6.0)
    assert np.diff(line.place) == pytest.approx(np.full(line.place.size - 1, np.diff(line.place)[0]))


def test_a_load_that_goes_one_way_only_has_no_branches() -> None:
    up = np.linspace(-100.0, 100.0, TIME_S.size)
    assert branches_of(Recording.from_arrays(time_s=TIME_S, force_n=up, pressure_mbar=up), STANDARD) is None
    still = Recording.from_arrays(time_s=TIME_S, force_n=np.full(TIME_S.size, 5.0), pressure_mbar=TRIANGLE)
    assert branches_of(still, STANDARD) is None
    few = Recording.from_arrays(time_s=TIME_S[:40], force_n=TRIANGLE[:40], pressure_mbar=TRIANGLE[:40])
    assert branches_of(few, STANDARD) is None


def test_only_friction_is_told_as_friction() -> None:
    def told(reading: Array) -> str | None:
        return friction_of(Recording.from_arrays(time_s=TIME_S, force_n=TRIANGLE, pressure_mbar=reading), STANDARD)

    assert "friction" in str(told(5.0 * _rising()))
    assert told(TRIANGLE) is None
    assert told(TRIANGLE + 5.0 * _rising()) is None
    assert told(np.random.default_rng(1).standard_normal(TIME_S.size)) is None
    drifting = np.where(TIME_S < 30.0, 1.0, 0.3) * 5.0 * _rising()
    assert told(drifting) is None  # friction comes back as it was
    assert "friction" in str(told(np.where(TIME_S < 30.0, 1.0, 0.6) * 5.0 * _rising()))


@given(noise=st.floats(0.0, 2.0), drift=st.floats(-10.0, 10.0), cycles=st.integers(2, 12), seed=st.integers(0, 1000))
@settings(max_examples=25)
def test_friction_is_told_through_noise_and_a_zero_that_drifts(
    noise: float, drift: float, cycles: int, seed: int
) -> None:
    phase = np.linspace(0.0, cycles, TIME_S.size, endpoint=False) % 1.0
    load = 100.0 * (1.0 - 2.0 * np.abs(2.0 * phase - 1.0))
    reading = 5.0 * np.sign(0.5 - phase) + drift * TIME_S / TIME_S[-1]
    reading += noise * np.random.default_rng(seed).standard_normal(TIME_S.size)
    said = friction_of(Recording.from_arrays(time_s=TIME_S, force_n=load, pressure_mbar=reading), STANDARD)
    assert "its direction" in str(said)


@pytest.mark.parametrize("late_s", [0.0, 60.0, 3600.0])
def test_friction_is_told_also_where_the_last_sample_comes_late(late_s: float) -> None:
    time_s = TIME_S.copy()
    time_s[-1] += late_s
    made = Recording.from_arrays(time_s=time_s, force_n=TRIANGLE, pressure_mbar=5.0 * _rising())
    assert "its direction" in str(friction_of(made, STANDARD))


def test_what_wanders_is_seldom_told_as_friction() -> None:
    """The branches of a random walk explain some of it over two load cycles, and are others in the second."""
    slow = 100.0 * (2.0 * np.abs(2.0 * (TIME_S / 30.0 % 1.0) - 1.0) - 1.0)
    told = by_whole = 0
    for seed in range(120):
        walk = np.cumsum(np.random.default_rng(seed).standard_normal(TIME_S.size))
        made = Recording.from_arrays(time_s=TIME_S, force_n=slow, pressure_mbar=walk)
        found = branches_of(made, STANDARD)
        assert found is not None
        by_whole += found.by_branch >= STANDARD.follows > found.by_curve
        told += friction_of(made, STANDARD) is not None
    assert by_whole >= 12
    assert told <= by_whole / 5


@given(power=st.floats(0.8, 1.2), floor_s=st.floats(1e-5, 1e-3), seed=st.integers(0, 1000))
@settings(max_examples=15)
def test_a_resistance_that_falls_as_contacts_grow_is_better_diagnosed_as_a_conductance(
    power: float, floor_s: float, seed: int
) -> None:
    """Only where that is nearer to a line, and of no other quantity."""
    load = 101.0 + TRIANGLE
    conducts = floor_s + 1e-4 * load**power
    noisy = conducts * np.random.default_rng(seed).normal(1.0, 0.01, load.size)

    def said(**reading: Array) -> str | None:
        recording = Recording.from_arrays(time_s=TIME_S, force_n=load, **reading)  # type: ignore[arg-type]
        sensor = next(iter(reading)).rsplit("_", 1)[0]
        channel = recording.channels[sensor]
        return conductance_of([recording.with_channel(replace(channel, role="sensor"))], STANDARD)

    told = said(resistance_ohm=1.0 / noisy)
    assert told is not None
    line, conductance = (float(found) for found in re.findall(r"explains ([\d.]+) % .* and ([\d.]+) %", told)[0])
    assert line < conductance
    assert "1/resistance" in told
    assert said(pressure_mbar=1.0 / noisy) is None
    assert said(resistance_ohm=1e3 * noisy) is None
    assert said(resistance_ohm=1.0 / noisy - 1.0 / noisy.min()) is None  # a difference of resistances has no reciprocal


@given(
    count=st.integers(100, 1200), cycles=st.integers(2, 8), seed=st.integers(0, 1000), grid=st.sampled_from([0.0, 1.0])
)
@settings(max_examples=30)
def test_a_straight_line_is_never_bent_however_short_or_coarse(count: int, cycles: int, seed: int, grid: float) -> None:
    phase = np.linspace(0.0, cycles, count, endpoint=False) % 1.0
    load = 800.0 * (1.0 - np.abs(2.0 * phase - 1.0))
    reading = 0.1 * load + np.random.default_rng(seed).normal(0.0, 0.1, count)
    reading = grid * np.round(reading / grid) if grid else reading
    said = characteristic_of(
        Recording.from_arrays(time_s=0.1 * np.arange(count), force_n=load, pressure_mbar=reading), STANDARD
    )
    assert said is None or "nearly straight" in said or "too little was recorded to tell its shape" in said
    slopes = [float(value) for value in re.findall(r"by ([\d.]+) mbar/N", said or "")]
    assert slopes == pytest.approx([0.1] * len(slopes), rel=0.2)
