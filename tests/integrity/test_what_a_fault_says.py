"""The sentence of each fault, of one and of several: what there is, how large it is, and what becomes of it."""

from __future__ import annotations

import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from smartshoe.diagnosis import diagnose
from smartshoe.display import moment, percent
from smartshoe.integrity import examine
from smartshoe.integrity._sampling import short_recording
from smartshoe.integrity.thresholds import Thresholds
from smartshoe.recording import Recording

Array = NDArray[np.float64]

TIME_S = np.arange(0.0, 60.0, 0.01)
TRIANGLE = np.abs(2.0 * (TIME_S / 6.0 % 1.0) - 1.0)
NOISE = np.random.default_rng(4).standard_normal((2, TIME_S.size))
READING = TRIANGLE + 1e-3 * NOISE[0]


def _pressed(reading: Array, load: Array = TRIANGLE) -> Recording:
    return Recording.from_arrays(time_s=TIME_S, force_n=800.0 * load, pressure_mbar=100.0 * reading)


def _said(recording: Recording) -> tuple[str, str]:
    """The kind of the one fault that there is, and its sentence."""
    (fault,) = examine([recording]).faults
    return fault.kind, fault.says


def _changed(signal: Array, *changes: tuple[int, float]) -> Array:
    changed = signal.copy()
    for at, by in changes:
        changed[at] += by
    return changed


def test_a_spike_alone_is_said_with_its_size_and_several_with_the_largest() -> None:
    one, two = ((1111, 0.3),), ((1111, 0.3), (3000, -0.2))
    alone = "has an isolated spike of 30 % of its span: it is left out"
    several = "has 2 isolated spikes, the largest of 30 % of its span: they are left out"
    for changes, said in ((one, alone), (two, several)):
        assert _said(_pressed(_changed(READING, *changes))) == ("spikes", f"the reading {said}")
        load = _changed(TRIANGLE + 1e-3 * NOISE[1], *changes)
        assert _said(_pressed(READING, load)) == ("spikes", f"the reference load {said}")


def test_a_small_spike_has_a_size_too() -> None:
    held = np.clip(1.5 * TRIANGLE, 0.0, 1.0)
    spiked = _changed(held + 1e-5 * NOISE[0], (1222, 3.2e-3))
    assert "an isolated spike of 0.32 % of its span" in _said(_pressed(spiked, held))[1]


@pytest.mark.parametrize(
    ("missing", "said"),
    [
        (((1000, 1001),), "a gap of 0.02 s: about one sample (0.017 % of all) missing"),
        (((1000, 1050),), "a gap of 0.51 s: about 50 samples (0.83 % of all) missing"),
        (
            ((1000, 1050), (3000, 3010)),
            "2 gaps in time, the longest 0.51 s: about 60 samples (1 % of all) missing",
        ),
    ],
)
def test_a_gap_is_one_and_several_are_counted(missing: tuple[tuple[int, int], ...], said: str) -> None:
    kept = np.ones(TIME_S.size, dtype=bool)
    for first, stop in missing:
        kept[first:stop] = False
    assert _said(_pressed(READING).taken(kept)) == ("gaps", said)


@pytest.mark.parametrize(("count", "held"), [(1, "one sample"), (2, "2 samples in 0.01 s")])
def test_a_recording_of_one_sample_holds_one(count: int, held: str) -> None:
    few = _pressed(READING).taken(np.arange(TIME_S.size) < count)
    assert _said(few) == ("short_recording", f"the recording holds {held}: give at least 100 samples")


def test_what_is_over_before_a_reading_answers_is_too_short() -> None:
    """A logger's nanoseconds that were read as seconds; nothing of the size of their rate is made on the way."""
    time_s = 2e-11 * np.arange(3000)
    brief = Recording.from_arrays(time_s=time_s, force_n=np.sin(1e9 * time_s), pressure_mbar=np.cos(1e9 * time_s))
    for least_s, is_told in ((0.1, True), (1e-8, False)):
        said = [f.says for f in short_recording(brief, Thresholds(echo_s=least_s), is_thinned=False)]
        assert bool(said) == is_told
    found = diagnose(brief)
    assert found.verdict == "refused"
    assert found.limits == (
        "recording: the recording holds 3000 samples in 6e-08 s: a reading may take 0.1 s to answer its load, so give a"
        " longer one, or check the unit of its time",
    )


@pytest.mark.parametrize(
    ("gone", "said"),
    [
        (((500, 501),), "one sample: it is left out"),
        (((500, 503),), "3 samples in a row: they are left out"),
        (((500, 501), (700, 701)), "2 samples, each alone: they are left out"),
        (((500, 503), (700, 701)), "4 samples, in 2 stretches of up to 3: they are left out"),
    ],
)
def test_one_missing_sample_is_one_and_stretches_are_counted(gone: tuple[tuple[int, int], ...], said: str) -> None:
    holey = READING.copy()
    for first, stop in gone:
        holey[first:stop] = np.nan
    assert _said(_pressed(holey)) == ("missing_samples", f"the reading pressure is missing in {said}")


def test_a_reading_that_repeats_once_is_one_and_several_are_told_with_the_longest_row() -> None:
    reading = np.rint((TRIANGLE + 1e-4 * NOISE[0]) / 1e-5) * 1e-5
    reading[1234] = reading[1233]
    one = "1 reading repeats the one before while the load moves: it is left out"
    assert _said(_pressed(reading)) == ("held_samples", one)
    reading[2345:2351] = reading[2344]
    several = "7 readings repeat the one before while the load moves, up to 6 in a row: they are left out"
    assert _said(_pressed(reading)) == ("held_samples", several)


def test_a_reading_drops_out_once_or_so_many_times() -> None:
    reading = READING.copy()
    for gone, times, samples in ((slice(580, 620), "once, for", 40), (slice(1190, 1200), "2 times, for up to", 50)):
        reading[gone] = 0.0
        kind, said = _said(_pressed(reading))
        assert kind == "dropouts"
        assert said == (
            f"the reading drops out {times} 0.4 s, to about 0 mbar, while the load stays:"
            f" {samples} samples are left out"
        )


def test_a_coarse_step_is_said_with_the_rms_error_that_it_leaves() -> None:
    """A step of two percent over the root of twelve."""
    kind, said = _said(_pressed(np.rint(TRIANGLE / 0.02) * 0.02))
    assert kind == "quantisation"
    (error,) = re.findall(r"an rms error of ([\d.]+) % that", said)
    assert float(error) == pytest.approx(2.0 / np.sqrt(12.0), rel=0.03)
    assert said == (
        f"the reading is quantised in steps of 2 mbar, 2 % of its span: an rms error of {error} % that averaging does"
        " not remove"
    )


def test_two_clocks_are_said_with_the_lag_and_what_to_do() -> None:
    """Levels of no period, each reached within half a second."""
    corners = [(3.0 * k + 0.5 * j, (k * 0.618) % 1.0) for k in range(20) for j in (1, 6)]
    load = np.interp(TIME_S, *np.array(corners).T)
    kind, said = _said(_pressed(np.interp(TIME_S - 0.35, TIME_S, load) + 1e-3 * NOISE[0], load))
    assert kind == "two_clocks"
    (late_s,) = re.findall(r"^load and reading come from two clocks: the reading is ([\d.]+) s late, more", said)
    assert float(late_s) == pytest.approx(0.35, abs=0.02)
    assert "more than the unit's relaxation explains (record both by one clock, unless the unit is itself" in said


@pytest.mark.parametrize(
    ("begins_s", "said"), [(0.0, "10-20 s"), (1e5, "100010-100020 s"), (1.7e9, "1700000010-1700000020 s")]
)
def test_where_a_fault_lies_is_told_on_a_clock_that_counts_from_any_day(begins_s: float, said: str) -> None:
    reading = _changed(READING, (1000, 0.3), (2000, 0.3))
    late = Recording.from_arrays(
        time_s=TIME_S + begins_s, force_n=800.0 * TRIANGLE, pressure_mbar=100.0 * reading, name="late"
    )
    (fault,) = examine([late]).faults
    assert fault.to_dict()["where"] == f"late, {said}"


@given(at_s=st.floats(-1e9, 2e9))
def test_a_moment_is_told_to_the_millisecond(at_s: float) -> None:
    assert float(moment(at_s)) == pytest.approx(at_s, rel=0.0, abs=1e-3)
    assert "e" not in moment(at_s) or abs(at_s) < 1e-3


@given(at_s=st.floats(1e-3, 1e7), digits=st.integers(3, 6))
def test_a_time_is_told_to_its_digits_however_many_are_noughts(at_s: float, digits: int) -> None:
    for exact_s in (at_s, float(round(at_s, -2)) or 100.0):
        told = moment(exact_s, digits)
        assert float(told) == pytest.approx(exact_s, rel=0.5 * 10.0 ** (1 - digits))
        assert "e" not in told or exact_s < 1e-3
    assert moment(3600.0, digits) == "3600"


@given(share=st.floats(-1e3, 1e3), signed=st.booleans())
def test_a_share_is_told_in_percent_without_a_power_of_ten(share: float, signed: bool) -> None:
    said = percent(share, signed=signed).removesuffix(" %")
    assert "e+" not in said
    assert float(said) == pytest.approx(100.0 * share, rel=0.05)


def test_shares_in_percent_by_hand() -> None:
    assert percent(0.5, signed=True) == "+50 %"
    assert percent(1.3) == "130 %"
    assert percent(0.00012) == "0.012 %"
