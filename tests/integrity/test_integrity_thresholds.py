"""Numbers of the record by which faults of the data are told: what each decides."""

from __future__ import annotations

import math
from dataclasses import fields, replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.signal import lfilter

from smartshoe import diagnose
from smartshoe.errors import UsageError
from smartshoe.integrity import Integrity, examine
from smartshoe.integrity.thresholds import Thresholds, decided_by
from smartshoe.recording import Recording

Array = NDArray[np.float64]

STANDARD = Thresholds()
TIME_S = np.arange(0.0, 60.0, 0.01)
TRIANGLE = np.abs(2.0 * (TIME_S / 6.0 % 1.0) - 1.0)
# Levels of no period, each reached within half a second.
WANDERING = np.interp(TIME_S, *np.array([(3.0 * k + 0.5 * j, (k * 0.618) % 1.0) for k in range(20) for j in (1, 6)]).T)
NOISE = np.random.default_rng(4).standard_normal(TIME_S.size)


def _pressed(reading: Array, load: Array = TRIANGLE, time_s: Array = TIME_S) -> Recording:
    return Recording.from_arrays(time_s=time_s, force_n=800.0 * load, pressure_mbar=100.0 * reading)


def _found(recording: Recording, **numbers: object) -> Integrity:
    return examine([recording], replace(STANDARD, **numbers))


def _kinds(recording: Recording, **numbers: object) -> set[str]:
    return {fault.kind for fault in _found(recording, **numbers).faults}


def test_least_samples_are_those_that_a_recording_must_have() -> None:
    brief = _pressed(TRIANGLE + 1e-3 * NOISE).taken(slice(0, 150))
    assert "short_recording" in _kinds(brief, least_samples=200)
    assert "short_recording" not in _kinds(brief, least_samples=100)


def test_faulty_share_is_how_many_gaps_are_the_loggers_way() -> None:
    kept = np.ones(TIME_S.size, dtype=bool)
    kept[50::33] = False
    gappy = _pressed(TRIANGLE + 1e-3 * NOISE).taken(kept)
    assert "gaps" in _kinds(gappy, faulty_share=0.05)
    assert "gaps" not in _kinds(gappy, faulty_share=0.02)


def test_follows_is_the_share_of_a_reading_that_its_load_must_explain() -> None:
    noisy = _pressed(TRIANGLE + 0.3 * NOISE)
    assert _found(noisy, follows=0.3).refusals == ()
    assert "does not follow" in _found(noisy, follows=0.7).refusals[0]


def test_clear_is_how_much_of_a_recording_must_be_sound() -> None:
    holed = _pressed(np.where(np.random.default_rng(1).random(TIME_S.size) < 0.4, np.nan, TRIANGLE + 1e-3 * NOISE))
    assert _found(holed, clear=2.0).refusals == ()
    assert "record it again" in _found(holed, clear=1.5).refusals[0]


def test_same_is_how_far_steps_of_time_may_differ() -> None:
    shaken_s = TIME_S + 0.002 * np.random.default_rng(2).uniform(-1.0, 1.0, TIME_S.size)
    recording = _pressed(np.interp(shaken_s, TIME_S, TRIANGLE), np.interp(shaken_s, TIME_S, TRIANGLE), shaken_s)
    assert "uneven_sampling" in _kinds(recording, same=0.2)
    assert "uneven_sampling" not in _kinds(recording, same=0.5)


def test_material_is_how_much_a_rail_must_cut_off() -> None:
    cut = _pressed(np.minimum(TRIANGLE, 0.93))
    assert "saturation" in _kinds(cut, material=2e-4)
    assert "saturation" not in _kinds(cut, material=0.1)


def test_echo_is_how_late_a_reading_may_answer_a_knock() -> None:
    knock = 0.2 * (np.arange(TIME_S.size) % 401 == 200)
    late = _pressed(TRIANGLE + np.roll(knock, 20) + 1e-3 * NOISE, TRIANGLE + knock)
    assert "reading has" in " ".join(fault.says for fault in _found(late, echo_s=0.1).faults)
    assert "reading has" not in " ".join(fault.says for fault in _found(late, echo_s=0.4).faults)


def test_twice_the_echo_is_the_longest_lag_that_is_not_of_two_clocks() -> None:
    late = _pressed(np.interp(TIME_S - 0.35, TIME_S, WANDERING) + 1e-3 * NOISE, WANDERING)
    assert "two_clocks" in _kinds(late, echo_s=0.1)
    assert "two_clocks" not in _kinds(late, echo_s=0.25)


def test_bins_are_how_finely_a_lag_is_looked_for() -> None:
    late = _pressed(np.interp(TIME_S - 0.35, TIME_S, WANDERING) + 1e-3 * NOISE, WANDERING)
    assert "two_clocks" in _kinds(late, bins=4000)
    assert "two_clocks" not in _kinds(late, bins=60)


def test_local_is_the_stretch_whose_own_noise_counts() -> None:
    burst = 1e-3 * NOISE * np.where(TIME_S % 7.3 < 0.3, 12.0, 1.0)
    assert "spikes" not in _kinds(_pressed(TRIANGLE + burst), local=32)
    assert "spikes" in _kinds(_pressed(TRIANGLE + burst), local=2048)


def test_memory_is_the_relaxation_that_still_follows() -> None:
    keep = float(np.exp(-0.01 / 30.0))
    fast = 0.5 + 0.5 * np.sin(np.cumsum(1.0 + np.sin(0.3 * TIME_S)) * 0.01 * 2.0)
    slow = _pressed(lfilter([1.0 - keep], [1.0, -keep], fast - fast.mean()) + 1e-4 * NOISE, fast)
    assert _found(slow, memory_s=(0.3, 3.0, 30.0)).refusals == ()
    assert "does not follow" in _found(slow, memory_s=(0.3,)).refusals[0]


def test_false_alarm_is_how_far_noise_may_reach() -> None:
    slow = np.interp(TIME_S, [0.0, 30.0, 60.0], [0.0, 1.0, 0.0])
    spiked = slow + 1e-3 * NOISE
    spiked[1111] += 0.009
    assert "spikes" in _kinds(_pressed(spiked, slow), false_alarm=0.01)
    assert "spikes" not in _kinds(_pressed(spiked, slow), false_alarm=1e-12)


def test_material_is_the_error_from_which_on_a_lattice_is_a_fault() -> None:
    coarse = _pressed(np.rint(TRIANGLE / 0.02) * 0.02)
    assert "quantisation" in _kinds(coarse, material=2e-4)
    assert "quantisation" not in _kinds(coarse, material=1e-2)


@pytest.mark.parametrize("material", [float("nan"), float("inf"), -1.0, 0.0, 0.5001, 2.0, "a", True])
def test_what_is_material_is_a_share_above_zero_up_to_a_half(material: float) -> None:
    with pytest.raises(UsageError, match=r"material is .*: give a"):
        diagnose(_pressed(TRIANGLE), material=material)
    for within in (0.5, 1e-9):
        assert decided_by(None, within).material == within


@given(st.floats(1e-7, 0.5))
def test_who_asks_for_less_has_better_units_and_who_asks_for_more_has_those_that_others_have(material: float) -> None:
    """Nothing else is decided otherwise, whatever the record that is given."""
    for record in (None, replace(STANDARD, imperfection=5e-4, tolerable=3e-3, clear=3.0)):
        usual = record or STANDARD
        found, finer = decided_by(record, material), min(material / 2e-4, 1.0)
        assert (found.imperfection, found.tolerable) == pytest.approx(
            (finer * usual.imperfection, finer * usual.tolerable), rel=1e-12
        )
        kept = {"imperfection": usual.imperfection, "tolerable": usual.tolerable}
        assert replace(found, **kept) == replace(usual, material=material)
    more, less = (decided_by(None, by * material) for by in (1.0, 0.5))
    assert less.imperfection <= more.imperfection <= STANDARD.imperfection
    assert less.tolerable <= more.tolerable <= STANDARD.tolerable


def test_where_nothing_is_asked_for_the_record_decides_as_it_is() -> None:
    """Also one of another smallest error: what is less, or more, is so beside that."""
    given_one = replace(STANDARD, material=1e-3)
    assert decided_by(None) == STANDARD
    assert decided_by(given_one) is given_one
    assert decided_by(given_one, 1e-3) == given_one
    assert decided_by(given_one, 5e-4).imperfection == pytest.approx(0.5 * STANDARD.imperfection)


@pytest.mark.parametrize(
    ("name", "number", "asked"),
    [
        ("standing", float("nan"), "a number of at least 0.0001 and at most 0.5"),
        ("hold_s", None, "a number above 0"),
        ("hold_s", float("inf"), "a number above 0"),
        ("imperfection", 0.0, "a number above 0"),
        ("strength_sd", 0.0, "a number above 0"),
        ("false_name", 0.0, "a number above 0 and at most 1"),
        ("false_alarm", 1.5, "a number above 0 and at most 1"),
        ("standing", 0.0, "a number of at least 0.0001"),
        ("standing", 0.99e-4, "a number of at least 0.0001"),
        ("clear", 0.5, "a number of at least 1"),
        ("held_out_every", 1, "a whole number of at least 2"),
        ("least_samples", 0, "a whole number above 0"),
        ("local", 64.5, "a whole number of at least 4"),
        ("local", 1, "a whole number"),
        ("bins", 0, "a whole number"),
        ("memory_s", (0.3, "x"), "a number above 0"),
        ("memory_s", (0.0, 3.0), "a number above 0"),
        ("memory_s", (), "a tuple of numbers that rise"),
        ("memory_s", (3.0, 3.0), "a tuple of numbers that rise"),
        ("memory_s", 3.0, "a tuple of numbers that rise"),
        ("kind_odds", (1.0, 2.0), "a tuple of four"),
    ],
)
def test_what_nothing_can_be_decided_by_is_refused(name: str, number: object, asked: str) -> None:
    with pytest.raises(UsageError, match=f"{name} is .*: give {asked}"):
        replace(STANDARD, **{name: number})


def test_each_number_is_taken_at_its_bounds() -> None:
    for one in fields(Thresholds):
        for bound in (one.metadata["least"], one.metadata["most"]):
            if bound is not None and math.isfinite(bound):
                assert getattr(replace(STANDARD, **{one.name: bound}), one.name) == bound


@pytest.mark.parametrize("given", [3, 0, {}])
@pytest.mark.parametrize("material", [None, 1e-3])
def test_thresholds_of_another_type_are_refused(given: object, material: float | None) -> None:
    with pytest.raises(UsageError, match=f"thresholds is of type {type(given).__name__}: give Thresholds"):
        diagnose(_pressed(TRIANGLE), thresholds=given, material=material)  # type: ignore[arg-type]
