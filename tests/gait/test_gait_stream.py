"""A long trial as a stream: what it says is what `analyse` says, whatever the blocks, and it keeps nothing."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from trials import recorded, walked

from simulators.people import Person, Run, Stand, Walk, trial
from smartshoe.calibration import Calibration
from smartshoe.errors import InputError, RefusedError, UnitError, UsageError
from smartshoe.files.atomic import json_text
from smartshoe.gait import Coverage, Event, GaitResult, Stride, analyse, analyse_stream
from smartshoe.gait import _day as day
from smartshoe.gait._day import DayResult
from smartshoe.gait._sums import Moments
from smartshoe.recording import Recording
from smartshoe.report.gait.terminal import by_foot
from smartshoe.report.numbers import plain
from smartshoe.units import MILLIBAR

# Sums in another order: what double precision leaves of them.
ROUNDING = 1e-9


def in_blocks(recording: Recording, size: int) -> list[Recording]:
    return [recording.taken(slice(k, k + size)) for k in range(0, len(recording), size)]


@lru_cache(maxsize=2)
def various() -> Recording:
    """Standing, walking, running, standing, walking: five minutes and a half, three stretches."""
    parts = ((Stand(), 40.0), (Walk(1.3), 120.0), (Run(2.68), 60.0), (Stand(), 30.0), (Walk(1.0), 80.0))
    made = trial(Person(), parts, 330.0, np.random.default_rng(3), sensors=False, noise_n=1.0, outside="even")
    return made.recording


@lru_cache(maxsize=2)
def various_whole() -> GaitResult:
    return analyse(various(), coverage=0.8)


def columns_of(recording: Recording) -> dict[str, np.ndarray[Any, Any]]:
    return {name: values.copy() for name, values in recording.columns() if name != "time_s"}


def assert_same_numbers(found: Mapping[str, Any], wanted: Mapping[str, Any], rel: float = ROUNDING) -> None:
    assert found.keys() == wanted.keys()
    for name, value in wanted.items():
        if isinstance(value, Mapping):
            assert_same_numbers(found[name], value, rel)
        elif isinstance(value, float):
            assert found[name] == pytest.approx(value, rel=rel, abs=ROUNDING), name
        else:
            assert found[name] == value, name


def assert_same_trial(found: DayResult, wanted: GaitResult) -> None:
    assert [(e.foot, e.event) for e in found.events] == [(e.foot, e.event) for e in wanted.events]
    assert [e.time_s for e in found.events] == pytest.approx([e.time_s for e in wanted.events], abs=ROUNDING)
    assert len(found.strides) == len(wanted.strides)
    for own, other in zip(found.strides, wanted.strides, strict=True):
        assert_same_numbers(own.to_dict(), other.to_dict())
    assert found.activity == wanted.activity
    assert_same_numbers(found.summary, wanted.summary)
    assert_same_numbers(found.to_dict()["forces"], wanted.to_dict()["forces"])


@given(size=st.integers(200, 80_000))
@settings(max_examples=3)
def test_blocks_of_any_size_say_what_the_whole_says(size: int) -> None:
    assert_same_trial(analyse_stream(in_blocks(various(), size), coverage=0.8), various_whole())


def test_readings_in_mbar_go_through_the_same_filters() -> None:
    columns = {name.replace("_n", "_mbar"): 0.5 * values for name, values in columns_of(various()).items()}
    pressed = recorded(various().time_s, columns)
    filters = [Calibration(a1=0.2, b0=2.0, b1=0.5, reading_unit=MILLIBAR, unit=name) for name in various().channels]
    found = analyse_stream(in_blocks(pressed, 3000), filters, coverage=0.8)
    assert_same_trial(found, analyse(pressed, filters, coverage=0.8))


@pytest.mark.parametrize("name", ["static", "lead", pytest.param("kalman", marks=pytest.mark.long), "smoother"])
def test_an_estimator_gives_a_stream_the_forces_of_the_whole(name: str) -> None:
    columns = {name.replace("_n", "_mbar"): 0.2 * values for name, values in columns_of(walked(14.0).recording).items()}
    columns["left_heel_mbar"][2000:2003] = np.nan
    pressed = recorded(walked(14.0).time_s, {n: v for n, v in columns.items() if n.endswith(("heel_mbar", "toe_mbar"))})
    units = [Calibration(a1=0.2, b0=5.2, b1=1.0, reading_unit=MILLIBAR, unit=name) for name in pressed.channels]
    found = analyse_stream(in_blocks(pressed, 1500), units, estimator=name)
    whole = analyse(pressed, units, estimator=name)
    # The record is shorter than the first look, so noise and density are the same; the smoother waits two seconds,
    # and what it has not seen by then moves a load by less than this.
    assert len(found.strides) == len(whole.strides) > 15
    for own, other in zip(found.strides, whole.strides, strict=True):
        assert_same_numbers(own.to_dict(), other.to_dict(), rel=1e-7)
    assert_same_numbers(found.to_dict()["forces"], whole.to_dict()["forces"], rel=1e-7)


def test_a_day_shows_itself_and_has_no_table_of_forces() -> None:
    found = analyse_stream(in_blocks(various(), 30_000), coverage=0.8)
    assert "body weight" in repr(found)
    assert "\n" not in repr(found)
    assert found.summary().splitlines()[0] in repr(found)
    assert found.summary["stride_time_s"]["left"]["mean"] > 0.5
    assert all(axis.lines for axis in found.plot().axes)
    with pytest.raises(UsageError, match="'forces' is not known of a DayResult: use one of strides, events"):
        found.to_frame("forces")
    assert len(found.to_frame()) == found.stride_count


def test_a_course_of_coverage_is_the_same_over_each_stance() -> None:
    whole = analyse(various(), coverage=Coverage.midfoot(0.8))
    found = analyse_stream(in_blocks(various(), 3000), coverage=Coverage.midfoot(0.8))
    assert_same_numbers(found.summary, whole.summary)
    for own, other in zip(found.strides[:-2], whole.strides[:-2], strict=True):
        assert_same_numbers(own.to_dict(), other.to_dict())


def test_regularity_is_told_against_the_strides_so_far() -> None:
    found, whole = analyse_stream([various()], coverage=0.8).indices, various_whole().indices
    for foot, values in whole.items():
        assert found[foot]["sequence_error_percent"] == values["sequence_error_percent"]
        # The pattern and the usual peaks are those up to the stretch, not of all strides: two strides in a hundred.
        assert found[foot]["deviation_percent"] == pytest.approx(values["deviation_percent"], rel=0.1)
        assert found[foot]["abnormality_percent"] == pytest.approx(values["abnormality_percent"], rel=0.1)


def test_two_files_are_one_trial() -> None:
    columns, time_s = columns_of(various()), various().time_s
    left, right = (
        recorded(at, {name: values for name, values in columns.items() if name.startswith(side)}, side)
        for side, at in (("left", time_s), ("right", time_s + 0.0013))
    )
    found = analyse_stream([in_blocks(left, 3000), in_blocks(right, 7000)], coverage=0.8)
    assert_same_trial(found, analyse([left, right], coverage=0.8))


def test_a_shoe_alone_is_analysed() -> None:
    left = recorded(various().time_s, {n: v for n, v in columns_of(various()).items() if n.startswith("left")})
    found = analyse_stream(in_blocks(left, 5000), coverage=0.8)
    assert_same_trial(found, analyse(left, coverage=0.8))
    assert [flag.kind for flag in found.flags if flag.kind == "one_shoe"] == ["one_shoe"]


def test_after_a_stop_of_the_recording_the_analysis_goes_on() -> None:
    whole = walked(120.0).recording
    parts = [whole.between(0.0, 50.0), whole.between(80.0, 120.0)]
    found = analyse_stream(parts, coverage=0.8)
    alone = [analyse(part, coverage=0.8) for part in parts]
    wanted = [event for part in alone for event in part.events]
    assert [(e.foot, e.event) for e in found.events] == [(e.foot, e.event) for e in wanted]
    assert [e.time_s for e in found.events] == pytest.approx([e.time_s for e in wanted], abs=ROUNDING)
    assert found.stride_count == sum(len(part.strides) for part in alone)
    assert found.recorded_s == pytest.approx(90.0, abs=0.02)
    assert [flag.where for flag in found.flags if flag.kind == "recording_stops"] == ["50.0-80.0 s"]


def test_short_gaps_are_bridged_and_told_as_in_a_short_trial() -> None:
    columns = columns_of(walked(60.0).recording)
    columns["left_heel_n"][2000:2080] = np.nan
    for values in columns.values():
        values[5000:5600] = np.nan
    gappy = recorded(walked(60.0).time_s, columns)
    found, whole = analyse_stream(in_blocks(gappy, 777), coverage=0.8), analyse(gappy, coverage=0.8)
    assert_same_trial(found, whole)
    assert [(f.kind, f.foot, f.where) for f in found.flags] == [(f.kind, f.foot, f.where) for f in whole.flags]


def test_a_unit_that_falls_silent_for_long_leaves_the_other_foot_alone() -> None:
    columns = columns_of(various())
    columns["right_toe_n"][20_000:] = np.nan
    found = analyse_stream(in_blocks(recorded(various().time_s, columns), 4000), coverage=0.8)
    left = [stride for stride in found.strides if stride.foot == "left"]
    wanted = [stride for stride in various_whole().strides if stride.foot == "left"]
    assert [s.start_s for s in left] == pytest.approx([s.start_s for s in wanted], abs=ROUNDING)
    assert [s.peak_n for s in left] == pytest.approx([s.peak_n for s in wanted], rel=ROUNDING)
    assert any(flag.kind == "gap_in_stance" and flag.foot == "right" for flag in found.flags)


def test_standing_longer_than_loads_wait_for_a_swing() -> None:
    made = trial(
        Person(), ((Walk(1.3), 60.0), (Stand(), 1000.0), (Walk(1.3), 60.0)), 1120.0, np.random.default_rng(5),
        sensors=False, noise_n=1.0, outside="even",
    )  # fmt: skip
    found, whole = analyse_stream(in_blocks(made.recording, 9000), coverage=0.8), analyse(made.recording, coverage=0.8)
    assert found.event_count == len(whole.events)
    assert found.activity == whole.activity == "standing"
    standing_n, wanted_n = found.forces.standing_total_n, whole.forces.standing_total_n
    assert standing_n is not None
    assert wanted_n is not None
    # A floor is known to some 2 N a foot (a swing's noise and remainder), and which two are used differs.
    assert standing_n == pytest.approx(wanted_n, abs=4.0)


def test_only_the_highest_reading_so_far_can_be_a_rail() -> None:
    columns, time_s = columns_of(various()), various().time_s
    heel = columns["left_heel_n"]
    top = float(heel.max())
    clipped = {**columns, "left_heel_n": np.minimum(heel, 0.8 * top)}
    found = analyse_stream(in_blocks(recorded(time_s, clipped), 5000), coverage=0.8)
    assert [(f.foot, f.unit) for f in found.flags if f.kind == "saturated"] == [("left", "heel")]
    # The same flat tops after a reading that lay higher are no rail.
    clipped["left_heel_n"][9000] = 2.0 * top
    found = analyse_stream(in_blocks(recorded(time_s, clipped), 5000), coverage=0.8)
    assert not [flag for flag in found.flags if flag.kind == "saturated"]


def test_lists_are_bounded_and_everything_is_handed_on(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(day, "LISTED", 100)
    events: list[Event] = []
    strides: list[Stride] = []

    def report(new_events: Any, new_strides: Any) -> None:
        events.extend(new_events)
        strides.extend(new_strides)

    found = analyse_stream(in_blocks(various(), 3000), coverage=0.8, report=report)
    whole = various_whole()
    assert [(e.foot, e.event) for e in events] == [(e.foot, e.event) for e in whole.events]
    assert [s.start_s for s in strides] == pytest.approx([s.start_s for s in whole.strides], abs=ROUNDING)
    result = json.loads(json_text(found.to_dict()))
    assert result["schema"] == "smartshoe.gait/1"
    assert len(result["strides"]) == 100
    assert result["stream"]["strides"] == len(whole.strides)
    assert result["stream"]["events"] == len(whole.events)
    assert max(event["time_s"] for event in result["events"]) <= result["stream"]["listed_to_s"]
    assert set(whole.to_dict()) < set(result)


def test_the_mean_peak_is_of_all_strides_listed_or_not(monkeypatch: pytest.MonkeyPatch) -> None:
    """The table's two rows of one mean, where the person walks more slowly after the last stride that is listed."""
    monkeypatch.setattr(day, "LISTED", 100)
    found = analyse_stream(in_blocks(various(), 3000))
    listed = [stride.peak_n for stride in found.strides if stride.foot == "left" and stride.peak_n is not None]
    rows = dict(by_foot(found))
    for k, foot in enumerate(("left", "right")):
        mean_n = found.to_dict()["summary"]["peak_n"][foot]["mean"]
        assert rows["mean peak* ± 95 % (N)"][k].split(" ± ")[0] == plain(mean_n)
        assert rows["peak force* (N)"][k].split(" (")[0] == plain(mean_n, 3)
    assert abs(float(np.mean(listed)) / found.summary["peak_n"]["left"]["mean"] - 1.0) > 0.02
    assert f"{found.stride_count} strides" in found.summary()


def test_what_is_no_trial_is_refused() -> None:
    rng = np.random.default_rng(1)
    nothing = recorded(np.arange(40_000) / 200.0, {f"left_{r}_n": rng.normal(size=40_000) for r in ("heel", "toe")})
    with pytest.raises(RefusedError, match="no stance is found"):
        analyse_stream(in_blocks(nothing, 1000))
    with pytest.raises(InputError, match="no block"):
        analyse_stream([iter(())])
    blocks = in_blocks(various(), 30_000)
    with pytest.raises(InputError, match="in order of time"):
        analyse_stream([blocks[0], blocks[0], blocks[1]])
    kilonewtons = {name.replace("_n", "_kn"): values for name, values in columns_of(blocks[1]).items()}
    with pytest.raises(UnitError, match="other units"):
        analyse_stream([blocks[0], recorded(blocks[1].time_s, kilonewtons)])
    with pytest.raises(InputError, match="lacks left_heel"):
        analyse_stream([blocks[0], blocks[1].without("left_heel")])


@given(st.lists(st.lists(st.floats(-1e3, 1e3), max_size=6), max_size=6))
def test_moments_of_groups_are_those_of_all(groups: list[list[float]]) -> None:
    moments, values = Moments(), np.array([value for group in groups for value in group])
    for group in groups:
        moments.add(group)
    assert moments.count == values.size
    assert moments.mean == pytest.approx(values.mean() if values.size else 0.0, abs=1e-9)
    assert moments.sd == pytest.approx(values.std(ddof=1) if values.size > 1 else 0.0, abs=1e-6)


MEMORY = """
import sys
from pathlib import Path
import numpy as np
from simulators.people import Person, Walk, trial
from smartshoe.gait import analyse_stream
from smartshoe.recording import Recording
from smartshoe.report.gait.terminal import by_foot
from smartshoe.report.numbers import plain

made = trial(Person(), Walk(1.3), 60.0, np.random.default_rng(1), sensors=False, noise_n=1.0).recording
columns = {name: values for name, values in made.columns() if name != "time_s"}


def blocks():
    for minute in range(int(sys.argv[1])):
        yield Recording.from_arrays(time_s=made.time_s + 60.0 * minute, name="day", **columns)


found = analyse_stream(blocks(), coverage=0.8)
held = dict(line.split(":") for line in Path("/proc/self/status").read_text().splitlines() if ":" in line)
print(found.stride_count, held["VmHWM"].split()[0])
"""


@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="the peak is read from Linux's /proc")
def test_memory_does_not_grow_with_the_recording() -> None:
    # Not getrusage: a child's peak there begins with that of the process that started it.
    strides, peak_kb = {}, {}
    for minutes in (5, 25):
        said = subprocess.run(
            [sys.executable, "-c", MEMORY, str(minutes)], check=True, capture_output=True, text=True
        ).stdout.split()
        strides[minutes], peak_kb[minutes] = int(said[0]), int(said[1])
    assert strides[25] > 4 * strides[5]
    # 20 minutes of readings are 15 MB, their strides and events as objects 2 MB; the allocator's own play is less.
    assert peak_kb[25] - peak_kb[5] < 10_000
    assert peak_kb[25] < 500_000
