"""What a result of a trial holds, as an object, as tables and as figures, of one that is written down."""

from __future__ import annotations

from dataclasses import fields, replace
from typing import Any

import numpy as np
import pytest

from smartshoe.errors import UsageError
from smartshoe.gait import Contacts, Coverage
from smartshoe.gait._events import Event
from smartshoe.gait._flag import Flag
from smartshoe.gait._force_sums import BodyWeight, Forces
from smartshoe.gait._result import DayResult, GaitFindings, GaitResult
from smartshoe.gait._series import FootSeries
from smartshoe.gait._strides import Stride

NAN = float("nan")


def contacts(strike_s: Any = (), off_s: Any = (), regions: tuple[str, ...] = ("toe", "heel")) -> Contacts:
    once = np.full((len(strike_s), len(regions)), NAN)
    return Contacts(regions, np.array(strike_s), np.array(off_s), once, once, np.zeros(0), np.zeros((0, len(regions))))


def foot(name: str, time_s: np.ndarray, *, is_force: bool = True, sd_n: float | None = None) -> FootSeries:
    count = time_s.size
    load = np.column_stack([10.0 * time_s, 20.0 * time_s])
    return FootSeries(
        name=name, time_s=time_s, rate_hz=10.0, regions=("toe", "heel"), symbol="N" if is_force else "mBar",
        is_force=is_force, load=load, force_n=load.sum(axis=1) / 0.8 if is_force else None,
        sd_n=None if sd_n is None else np.full(count, sd_n), centre=np.column_stack([time_s / 10.0, -time_s / 20.0]),
        state=np.arange(count, dtype=np.int8) % 4, membership=np.zeros((count, 6)), abnormality=np.zeros(count),
        missing=np.zeros(count, dtype=bool), contacts=contacts(), usual_peak=np.ones(2),
    )  # fmt: skip


LEFT_S, RIGHT_S = np.arange(10) / 10.0, 0.25 + np.arange(6) / 10.0
STRIDES = tuple(
    Stride(name, at, at + 1.0, at + 0.6, None, at + 0.4, 60.0 + at, 700.0, 300.0, None, False, False)
    for name, at in (("left", 0.0), ("right", 0.5), ("left", 1.0))
)
EVENTS = (
    Event(0.1, "left", "heel_strike"), Event(0.2, "right", "heel_strike"), Event(0.4, "left", "heel_off"),
    Event(0.7, "left", "toe_off"), Event(0.8, "right", "toe_off"),
)  # fmt: skip
FIGURES = {"cadence_steps_per_min": 110.123456, "strides": {"left": 2}, "nothing": None, "order_of_contact": ["heel"]}
FLAGS = (Flag("odd", "It is odd.", foot="left", unit="toe", where="0.0-1.0 s"),)
INDICES = {"left": {"deviation_percent": 1.5}, "right": {"deviation_percent": None}}
FORCES = Forces(BodyWeight(700.123, 3.0, "strides"), 699.0, 701.0, 5.0)


def result(**more: Any) -> GaitResult:
    made = GaitResult(
        activity="walking", events=EVENTS, strides=STRIDES, figures=FIGURES, indices=INDICES, forces=FORCES,
        flags=FLAGS, coverage=0.8, covering=Coverage(0.8),
        feet={"left": foot("left", LEFT_S, sd_n=4.0), "right": foot("right", RIGHT_S)},
        total_time_s=RIGHT_S, total_n=100.0 * RIGHT_S, standing_s=(),
    )  # fmt: skip
    return replace(made, **more)


def day(**more: Any) -> DayResult:
    whole = {one.name: getattr(result(), one.name) for one in fields(GaitFindings)}
    about = {"duration_s": 50.0, "recorded_s": 40.0, "event_count": 9, "stride_count": 7, "listed_s": 12.0}
    return DayResult(**whole | about | more)


# -- as an object --------------------------------------------------------------------------------------------------
OBJECT = {
    "schema": "smartshoe.gait/1",
    "activity": "walking",
    "events": [{"time_s": one.time_s, "foot": one.foot, "event": one.event} for one in EVENTS],
    "strides": [one.to_dict() for one in STRIDES],
    "summary": FIGURES,
    "indices": INDICES,
    "forces": {
        "body_weight_n": {"value": 700.123, "sd": 3.0}, "body_weight_source": "strides", "mean_total_n": 699.0,
        "standing_total_n": 701.0, "rmse_estimate_n": 5.0, "coverage": 0.8,
    },
    "flags": [{"kind": "odd", "foot": "left", "unit": "toe", "where": "0.0-1.0 s", "says": "It is odd."}],
}  # fmt: skip


def test_a_result_is_told_whole() -> None:
    assert result().to_dict() == OBJECT
    unknown = result(forces=Forces(None, None, None, None)).to_dict()["forces"]
    assert unknown == dict.fromkeys(unknown) | {"coverage": 0.8}
    assert set(unknown) == set(OBJECT["forces"])


def test_a_days_result_says_how_much_of_it_is_listed() -> None:
    stream = {"duration_s": 50.0, "recorded_s": 40.0, "events": 9, "strides": 7, "listed_to_s": 12.0}
    assert day().to_dict() == OBJECT | {"stream": stream}
    assert day(listed_s=None).to_dict()["stream"]["listed_to_s"] is None


def test_a_summary_is_figures_by_name_and_a_table() -> None:
    summary = result().summary
    assert dict(summary) == FIGURES
    # Neither what is not known nor what is by foot is in the table.
    assert summary().splitlines() == [
        "walking: 3 strides, 5 events, body weight 700.1 N (strides)",
        "figure                    value",
        "cadence steps per min     110.1",
        "order of contact       ['heel']",
        "It is odd.",
    ]
    bare = result(forces=Forces(None, None, None, None), flags=(), figures={})
    assert bare.summary() == "walking: 3 strides, 5 events"
    assert repr(bare) == "<GaitResult walking: 3 strides, 5 events>"
    assert day().summary() == summary().replace(
        "3 strides, 5 events", "7 strides, 9 events"
    )  # of all, not of those listed


# -- as tables -----------------------------------------------------------------------------------------------------
def test_tables_are_of_strides_events_and_for_a_trial_of_forces() -> None:
    for found in (result(), day()):
        assert found.to_frame().to_dict("records")[1]["start_s"] == 0.5
        assert found.to_frame()["stance_percent"].tolist() == [60.0, 60.5, 61.0]
        assert list(found.to_frame().columns) == list(Stride.__dataclass_fields__)
        assert found.to_frame("strides").shape == (3, 12)
        events = found.to_frame("events")
        assert list(events.columns) == ["time_s", "foot", "event"]
        assert events.to_numpy().tolist() == [[one.time_s, one.foot, one.event] for one in EVENTS]
    empty = result(strides=(), events=())
    assert list(empty.to_frame().columns) == list(Stride.__dataclass_fields__)
    assert list(empty.to_frame("events").columns) == ["time_s", "foot", "event"]
    known = "use one of strides, events"
    with pytest.raises(UsageError, match=f"^table 'forces' is not known of a DayResult: {known}$"):
        day().to_frame("forces")
    with pytest.raises(UsageError, match=f"^table 'x' is not known of a GaitResult: {known}, forces$"):
        result().to_frame("x")  # type: ignore[arg-type]


def test_the_table_of_forces_stands_on_the_first_foots_times() -> None:
    found = result().columns()
    assert list(found) == [
        "time_s", "left_toe_n", "left_heel_n", "left_total_n", "left_total_sd_n", "right_toe_n", "right_heel_n",
        "right_total_n", "total_n", "left_centre_along_percent", "left_centre_medial_percent", "left_phase",
        "right_centre_along_percent", "right_centre_medial_percent", "right_phase",
    ]  # fmt: skip
    inside = (LEFT_S >= 0.25) & (LEFT_S <= 0.75)
    known = {"toe_n": 10.0 * LEFT_S, "heel_n": 20.0 * LEFT_S, "total_n": 37.5 * LEFT_S,
             "centre_along_percent": 10.0 * LEFT_S, "centre_medial_percent": -5.0 * LEFT_S}  # fmt: skip
    for name, values in known.items():
        assert found[f"left_{name}"] == pytest.approx(values)
        assert found[f"right_{name}"] == pytest.approx(np.where(inside, values, NAN), nan_ok=True)
    assert found["total_n"] == pytest.approx(np.where(inside, 100.0 * LEFT_S, NAN), nan_ok=True)
    assert found["left_total_sd_n"].tolist() == [4.0] * 10
    assert found["left_phase"].tolist() == [0, 1, 2, 3, 0, 1, 2, 3, 0, 1]
    # Of the right one, whose samples lie from 0.25 to 0.75 s, the nearest: at 0.3 s half way, to the even place.
    assert found["right_phase"][[0, 1, 2, 7, 8, 9]].tolist() == [0, 0, 0, 0, 1, 1]
    nearest = np.clip(np.round((LEFT_S - 0.25) * 10.0).astype(int), 0, 5)
    assert found["right_phase"].tolist() == (nearest % 4).tolist()
    frame = result().to_frame("forces")
    assert frame["left_phase"].tolist() == [
        "swing",
        "heel",
        "flat",
        "push",
        "swing",
        "heel",
        "flat",
        "push",
        "swing",
        "heel",
    ]
    assert frame["right_toe_n"].to_numpy() == pytest.approx(found["right_toe_n"], nan_ok=True)


def test_readings_without_a_calibration_are_told_in_their_unit() -> None:
    feet = {"left": foot("left", LEFT_S, is_force=False)}
    found = result(feet=feet, total_n=None).columns()
    assert list(found)[:4] == ["time_s", "left_toe_mbar", "left_heel_mbar", "left_centre_along_percent"]
    assert "total_n" not in found


# -- as figures ----------------------------------------------------------------------------------------------------
def lines_of(axis: Any) -> dict[str, tuple[list[float], list[float]]]:
    return {line.get_label(): (list(line.get_xdata()), list(line.get_ydata())) for line in axis.lines}


def test_the_figure_of_a_trial_shows_each_foot_with_its_events() -> None:
    axes = result().plot().axes
    assert [axis.get_title() for axis in axes] == ["left", "right"]
    for axis, (name, own) in zip(axes, result().feet.items(), strict=True):
        drawn = lines_of(axis)
        assert list(drawn) == ["whole foot", "toe", "heel", "heel strike", "toe off"]
        assert own.force_n is not None
        for label, values in (("whole foot", own.force_n), ("toe", own.load[:, 0]), ("heel", own.load[:, 1])):
            assert drawn[label][0] == own.time_s.tolist()
            assert drawn[label][1] == values.tolist()
        at = {"left": ([0.1], [0.7]), "right": ([0.2], [0.8])}[name]
        assert (drawn["heel strike"], drawn["toe off"]) == ((at[0], [0.0]), (at[1], [0.0]))
        assert (axis.get_xlabel(), axis.get_ylabel()) == ("time (s)", "force (N)")
        assert len(axis.get_legend().get_texts()) == 5
    bare = result(feet={"left": foot("left", LEFT_S, is_force=False)}, total_n=None).plot().axes
    assert [axis.get_ylabel() for axis in bare] == ["reading (mBar)"]
    assert list(lines_of(bare[0])) == ["toe", "heel", "heel strike", "toe off"]


def test_the_figure_of_a_day_shows_each_foots_strides() -> None:
    times, shares = day().plot().axes
    assert lines_of(times) == {"left": ([0.0, 1.0], [1.0, 1.0]), "right": ([0.5], [1.0])}
    assert [line[1] for line in lines_of(shares).values()] == [[60.0, 61.0], [60.5]]
    assert [line[0] for line in lines_of(shares).values()] == [[0.0, 1.0], [0.5]]
    assert (times.get_ylabel(), shares.get_ylabel()) == ("stride time (s)", "stance (% of stride)")
    assert shares.get_xlabel() == "time (s)"
    assert [text.get_text() for text in times.get_legend().get_texts()] == ["left", "right"]
