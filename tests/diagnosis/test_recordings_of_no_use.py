"""A recording that no diagnosis can use, among such as it can: it is left out and said, and the others are judged."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from smartshoe import Recording, diagnose
from smartshoe.diagnosis._diagnose import _spread
from smartshoe.errors import InputError, NotIdentifiableError, UnitError, UsageError
from smartshoe.models.effects import Conditions
from smartshoe.models.extended import ExtendedModel
from smartshoe.units import find_unit

Array = NDArray[np.float64]

STEP_S, FULL_N, NOISE_MBAR = 0.02, 800.0, 0.05
MODEL = ExtendedModel(1.0, 0.08, 0.22, FULL_N, 100.0, "mbar")


def _run(name: str, period_s: float, low_n: float = 0.0, **metadata: str) -> Recording:
    """Triangles from ``low_n`` to full scale for a minute."""
    time_s = np.arange(0.0, 60.0, STEP_S)
    load_n = low_n + (FULL_N - low_n) * (1.0 - np.abs(2.0 * (time_s % period_s) / period_s - 1.0))
    reading = MODEL.reading(Conditions(time_s, load_n / FULL_N, STEP_S))
    reading = reading + NOISE_MBAR * np.random.default_rng(len(name)).standard_normal(time_s.size)
    return Recording.from_arrays(
        time_s=time_s, force_n=load_n, pressure_mbar=reading, name=name, metadata=metadata or None
    )


GOOD = _run("good", 8.0)
OTHER = _run("other", 5.0)


def _constant(one: Recording) -> Recording:
    return one.with_channel(replace(one.sensor, values=np.full(len(one), 10.0)))


def _as(one: Recording, name: str) -> Recording:
    """With its reading under another name, of which nothing tells that it is one."""
    return one.without(one.sensor.name).with_channel(replace(one.sensor, name=name, role="auxiliary"))


BAD = {
    "name its column with --sensor (columns: film)": _as(OTHER, "film"),
    "reference load": OTHER.without("force"),
    "one sample": OTHER.taken(slice(0, 1)),
    "constant": _constant(OTHER),
}


@pytest.mark.parametrize("why", BAD)
def test_a_recording_of_no_use_among_those_fitted_is_left_out(why: str) -> None:
    found = diagnose([BAD[why], GOOD])
    assert found.verdict == "adequate"
    (said,) = (one for one in found.limits if one.startswith("left out: other:"))
    assert why in said
    assert [(trace.name, trace.recording) for trace in found.traces] == [("good", 1)]
    assert {(fault.recording, fault.label) for fault in found.data_faults if fault.severity == "fatal"} == {
        (0, "other")
    }
    assert {fault.label for fault in found.data_faults if fault.recording == 1} <= {"good"}


@pytest.mark.parametrize("every", [2, 3])
def test_a_reading_logged_at_a_part_of_the_loads_rate_is_judged(every: int) -> None:
    lacking = np.arange(len(GOOD)) % every == 1
    found = diagnose(GOOD.with_channel(replace(GOOD.sensor, missing=lacking)))
    assert found.verdict == "adequate"
    assert found.baseline is not None
    assert found.baseline.rmse == pytest.approx(NOISE_MBAR, rel=0.1)


def test_noise_is_told_of_the_recording_that_has_it() -> None:
    hum = 0.3 * np.sin(2.0 * np.pi * 7.0 * GOOD.time_s)
    humming = GOOD.with_channel(replace(GOOD.sensor, values=GOOD.sensor.values + hum))
    found = diagnose([BAD["constant"], humming])
    assert {(fault.recording, fault.label) for fault in found.data_faults if fault.kind == "hum"} == {(1, "good")}


def test_held_out_recordings_of_no_use_are_replaced_by_load_cycles() -> None:
    found = diagnose(GOOD, hold_out=BAD["reference load"])
    assert found.verdict == "adequate"
    assert [trace.name for trace in found.traces] == ["good"]
    assert 0.1 < float(np.mean(found.traces[0].held_out)) < 0.6
    assert sum(one.startswith("left out: other:") for one in found.limits) == 1
    assert sum("load cycles of those that are fitted are held out instead" in one for one in found.limits) == 1
    beside = diagnose(GOOD, hold_out=[BAD["constant"], OTHER])
    assert [(trace.name, trace.recording) for trace in beside.traces] == [("good", 0), ("other", 2)]
    assert [bool(trace.held_out.all()) for trace in beside.traces] == [False, True]
    assert not any("held out instead" in one for one in beside.limits)


def test_where_none_of_those_to_be_fitted_is_of_use_it_is_refused() -> None:
    found = diagnose(BAD["constant"], hold_out=GOOD)
    assert found.verdict == "refused"
    assert "the reading is constant" in found.limits[0]
    assert found.limits[0] in found.says


def test_what_continues_a_recording_that_is_left_out_is_a_session_of_its_own() -> None:
    found = diagnose([BAD["constant"], _run("later", 8.0, continues="other")])
    assert "later continues other, which is left out: it is taken as a session of its own" in found.limits
    assert sum("continues" in one for one in found.limits) == 1


def test_a_load_that_pulls_refuses_where_it_is_fitted_and_is_left_out_where_it_is_held_out() -> None:
    pulled = _run("pulled", 5.0, low_n=-500.0)
    assert diagnose([GOOD, pulled]).verdict == "refused"
    found = diagnose(GOOD, hold_out=[pulled, OTHER])
    assert found.verdict == "adequate"
    assert [(trace.name, trace.recording) for trace in found.traces] == [("good", 0), ("other", 2)]
    (said,) = found.left_out
    assert found.limits == (f"left out: {said}", *found.limits_of_the_rest)
    assert said.startswith("pulled: the load runs from -4")
    assert "set it to zero at rest" in said  # what is a cell's zero, and no pull


def test_of_a_single_load_cycle_the_cycle_is_to_be_repeated() -> None:
    once = diagnose([_run("once", 59.0)])
    assert once.causes == ()
    assert once.next_experiment is not None
    assert (once.next_experiment.separates, once.next_experiment.protocol) == ((), "repeat")
    assert once.next_experiment.says.startswith("repeat the load cycle")


def test_of_a_unit_that_is_as_it_should_be_nothing_is_asked_for() -> None:
    found = diagnose([GOOD, OTHER])
    assert (found.verdict, found.next_experiment) == ("adequate", None)


@pytest.mark.parametrize("hold_out", [True, False])
def test_readings_of_two_quantities_are_refused_by_name(hold_out: bool) -> None:
    counted = OTHER.without("pressure").with_channel(replace(OTHER.sensor, unit=find_unit("counts")))
    with pytest.raises(UnitError, match=r"^other: pressure is in counts .* in mbar .*: give all recordings in units"):
        diagnose(GOOD, hold_out=counted) if hold_out else diagnose([GOOD, counted])


TWICE = "copy holds the same samples as good: it is one experiment, given twice"


def test_a_copy_confirms_nothing_and_is_left_out_and_said() -> None:
    """Held out it would judge what it was fitted to; fitted twice it would count twice."""
    copy = replace(GOOD, name="copy")
    found = diagnose([GOOD, OTHER], hold_out=copy)
    assert any(limit.startswith("left out: ") and TWICE in limit for limit in found.limits)
    assert [trace.name for trace in found.traces] == ["good", "other"]
    assert all(0.1 < float(np.mean(trace.held_out)) < 0.6 for trace in found.traces)
    assert sum("load cycles of those that are fitted are held out instead" in one for one in found.limits) == 1
    plain, beside = diagnose(GOOD, hold_out=OTHER), diagnose([GOOD, copy], hold_out=OTHER)
    assert [(trace.name, trace.recording) for trace in beside.traces] == [("good", 0), ("other", 2)]
    assert (beside.verdict, beside.baseline, beside.gain) == (plain.verdict, plain.baseline, plain.gain)
    assert beside.model is not None
    assert plain.model is not None
    assert beside.model.theta == pytest.approx(plain.model.theta, rel=1e-12)
    assert sum(TWICE in limit for limit in beside.limits) == 1


def test_a_copy_of_wild_values_taken_out_is_one_all_the_same() -> None:
    """Whatever a logger wrote where it had none."""
    values = GOOD.sensor.values.copy()
    values[[700, 900]] = -9999.0
    wild = GOOD.with_channel(replace(GOOD.sensor, values=values))
    copy = replace(
        wild.with_channel(replace(wild.sensor, values=np.where(values < -1e3, 99999.0, values))), name="copy"
    )
    found = diagnose([wild, OTHER, copy])
    assert [trace.name for trace in found.traces] == ["good", "other"]
    assert sum(TWICE in limit for limit in found.limits) == 1


@pytest.mark.parametrize("hold_out", [True, False])
def test_recordings_of_several_units_are_refused_by_the_units_names(hold_out: bool) -> None:
    left, right = replace(GOOD, unit="left toe"), replace(OTHER, unit="right heel")
    said = r"^recordings of different units \(left toe in good, right heel in other\): diagnose one unit at a time$"
    with pytest.raises(UsageError, match=said):
        diagnose(right, hold_out=left) if hold_out else diagnose([right, left])
    # What says nothing of its unit may be of any.
    assert diagnose(left, hold_out=OTHER).verdict == "adequate"
    assert diagnose(left, hold_out=replace(OTHER, unit="left toe")).verdict == "adequate"


def test_of_very_many_recordings_those_that_are_used_do_not_hang_on_their_order(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Six short ones, of which three are used: the shortest, the longest, and one between."""
    monkeypatch.setattr("smartshoe.diagnosis._diagnose.MOST_RECORDINGS", 3)
    given = [OTHER.taken(slice(0, 300 * (k + 4))) for k in range(6)]
    given = [Recording(one.time_s, one.channels, name=f"part {k}") for k, one in enumerate(given)]
    assert [one.name for one in _spread(given, "to fit")[0]] == ["part 0", "part 2", "part 5"]
    assert [one.name for one in _spread(given[::-1], "to fit")[0]] == ["part 5", "part 2", "part 0"]
    found = diagnose(given, hold_out=GOOD)
    assert found.verdict == "adequate"
    assert [one[:33] for one in found.limits if "are used" in one] == ["of 6 recordings to fit 3 are used"]
    short = [one.taken(slice(0, 20 + k)) for k, one in enumerate(given)]  # too few samples to tell anything
    found = diagnose(short)
    assert found.verdict == "refused"
    assert "are used" not in found.says
    assert found.limits[-1].startswith("of 6 recordings to fit 3 are used")


@pytest.mark.parametrize("every", [2, 3])
def test_a_copy_of_what_is_used_only_where_its_reading_was_logged_is_left_out_too(every: int) -> None:
    half = GOOD.with_channel(replace(GOOD.sensor, missing=np.arange(len(GOOD)) % every > 0))
    found = diagnose([half, replace(half, name="copy")])
    assert [(trace.name, trace.time_s.size) for trace in found.traces] == [("good", len(GOOD) // every)]
    assert sum(TWICE in limit for limit in found.limits) == 1


@pytest.mark.parametrize("why", ["reference load", "constant"])
def test_of_very_many_recordings_one_of_no_use_is_left_out_and_said_once(
    why: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The other sentences begin with how many are used."""
    monkeypatch.setattr("smartshoe.diagnosis._diagnose.MOST_RECORDINGS", 2)
    found = diagnose([BAD[why], GOOD.taken(slice(0, 2000)), GOOD.taken(slice(0, 1500))])
    (said,) = found.left_out
    assert why in said
    assert found.limits == (f"left out: {said}", *found.limits_of_the_rest)
    assert found.limits_of_the_rest[0].startswith("of 3 recordings to fit 2 are used")


def test_what_is_no_number_of_a_unit_or_too_little_for_a_full_scale_is_refused_by_name() -> None:
    for area in ("wide", "0", "-0.001"):
        declared = replace(GOOD, metadata={"effective_area_m2": area})
        with pytest.raises(InputError, match=f"good: effective_area_m2 is '{area}': give a positive number in m2"):
            diagnose(declared)
    pressed = np.zeros(len(GOOD))
    pressed[1500:1502] = FULL_N
    once = Recording.from_arrays(time_s=GOOD.time_s, force_n=pressed, pressure_mbar=0.1 * pressed, name="once")
    with pytest.raises(NotIdentifiableError, match="once: load or reading never leaves zero"):
        diagnose(once)
