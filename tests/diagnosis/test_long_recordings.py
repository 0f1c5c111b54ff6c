"""Recordings of hours: the times that a unit may take grow with them, so that a slow unit is judged as a quick one."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from test_known_units import HOLDS_N, PEAK_N, TRIANGLES_N, Array, _solid, _times

from smartshoe import Recording, diagnose
from smartshoe.diagnosis import Diagnosis, Thresholds
from smartshoe.models.effects import blocks, catalogue, effect

STANDARD = Thresholds()
TAU_S, SETTLES_S, SECOND_S = 5.0, 60.0, 40.0


def plain(load: Array) -> Array:
    return 2.0 * _solid(load, TAU_S)


def _creeping(load: Array) -> Array:
    return 1.7 * _solid(load, 2.0) + 0.3 * _solid(load, SECOND_S)


def _warming(load: Array) -> Array:
    return plain(load) + 0.04 * PEAK_N * (1.0 - np.exp(-_times(load) / SETTLES_S))


def told_of(
    unit: Callable[[Array], Array], *, slower: float = 1.0, stride: int = 2, noise_mbar: float = 0.05
) -> Diagnosis:
    """The diagnosis of a unit so many times slower, under loads that are, logged at every ``stride``-th sample."""
    rng, runs = np.random.default_rng(0), []
    for name, load in (("triangles", TRIANGLES_N), ("holds", HOLDS_N), ("again", TRIANGLES_N)):
        read = unit(load)[::stride]
        runs.append(
            Recording.from_arrays(
                time_s=slower * _times(load)[::stride],
                force_n=load[::stride],
                pressure_mbar=read + noise_mbar * rng.standard_normal(read.size),
                name=name,
            )
        )
    return diagnose(runs[:2], hold_out=runs[2:])


def test_a_slow_unit_is_as_good_as_a_quick_one() -> None:
    slower = 1000.0
    told = told_of(plain, slower=slower)
    assert told.verdict == "adequate"
    pole_s = 1.0 / (told.model.relaxation_rate_per_s / (1.0 + told.model.relaxing_share))
    assert pole_s == pytest.approx(slower * TAU_S, rel=0.02)
    assert not any("end of its range" in one for one in told.limits)


@pytest.mark.parametrize(
    ("unit", "name", "time_s"), [(_creeping, "second_relaxation", None), (_warming, "warm_up", SETTLES_S)]
)
def test_what_a_quick_unit_has_a_slow_one_has_by_the_same_law(
    unit: Callable[[Array], Array], name: str, time_s: float | None
) -> None:
    """Seconds or minutes: the same samples have the same cause, of the same size, in another unit of time."""
    quick, slow = (told_of(unit, slower=slower).causes for slower in (1.0, 100.0))
    assert [one.name for one in quick] == [one.name for one in slow] == [name]
    strength, time = (tuple(quick[0].parameters)[k] for k in (0, 1))
    assert slow[0].parameters[strength].value == pytest.approx(quick[0].parameters[strength].value, rel=0.01)
    assert slow[0].parameters[time].value == pytest.approx(100.0 * quick[0].parameters[time].value, rel=0.01)
    if time_s is not None:
        assert slow[0].parameters[time].value == pytest.approx(100.0 * time_s, rel=0.1)


EFFECTS = [*catalogue().values(), *(block for family in blocks().values() for block in family)]


@given(st.sampled_from(EFFECTS), st.floats(1.0, 1000.0))
def test_only_slow_times_are_longer(one, stretch) -> None:  # type: ignore[no-untyped-def]
    """Bounds below, strengths, rates and all other shapes are as they were; the shapes of usual lengths are kept."""
    longer = one.lasting(stretch)
    assert longer.shapes[: len(one.shapes)] == one.shapes
    for before, after in zip(one.parameters, longer.parameters, strict=True):
        is_slow = before.unit == "s" and before.null is None
        assert after.upper == pytest.approx(before.upper * (stretch if is_slow else 1.0))
        assert (after.lower, after.null, after.size) == (before.lower, before.null, before.size)
    again = longer.lasting(1.0)
    assert again is longer


def test_longer_times_are_searched_at_factors_of_two_to_four() -> None:
    longer = effect("second_relaxation").lasting(100.0)
    times = [shape["time_constant"] for shape in longer.shapes]
    assert times[-1] == pytest.approx(100.0 * 60.0)
    assert all(2.0 <= b / a <= 4.2 for a, b in pairwise(times))
    for stretch in (1.9, 2.0, 3.9, 4.1, 30.0):
        more = [shape["time_constant"] for shape in effect("second_relaxation").lasting(stretch).shapes[4:]]
        assert all(2.0 <= b / a <= 4.0 for a, b in pairwise(more))
        assert len(more) > 1 or stretch < 2.0
    assert longer.parameters[1].upper == pytest.approx(12_000.0)
    assert longer.parameters[1].widened.upper == pytest.approx(100_000.0)


@pytest.mark.parametrize(
    ("longest_s", "memory_s"),
    [
        (10.0, (0.3, 3.0, 30.0)),
        (2999.0, (0.3, 3.0, 30.0)),
        (3000.0, (0.3, 3.0, 30.0, 300.0)),
        (90_000.0, (0.3, 3.0, 30.0, 300.0, 3000.0)),
    ],
)
def test_laws_may_depart_by_memories_of_up_to_a_tenth_of_the_longest_recording(
    longest_s: float, memory_s: tuple[float, ...]
) -> None:
    assert STANDARD.lasting(longest_s).memory_s == pytest.approx(memory_s)
    assert STANDARD.lasting(longest_s).material == STANDARD.material
