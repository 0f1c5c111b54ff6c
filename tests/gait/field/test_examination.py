"""A shoe as a whole: what is well is said to be, each fault is named as what it is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from shoes import BODY_WEIGHT_N, calibrations, made

from smartshoe.errors import MissingChannelError, UsageError
from smartshoe.gait.field.examination import Examination, examine, examine_trial
from smartshoe.recording import Channel, Recording
from smartshoe.units import MILLIBAR


def recorded(activity: str = "walk") -> Recording:
    return made(activity, 40.0, sensors=True).recording


def changed(recording: Recording, name: str, values: np.ndarray) -> Recording:
    channel = recording[name]
    fresh = Channel.from_values(name, values, channel.unit, channel.role)
    return recording.with_channel(replace(fresh, range_=channel.range_))


def check(recording: Recording, **more: object) -> Examination:
    return examine(
        recording, calibrations(), **{"body_weight_n": BODY_WEIGHT_N, "coverage": 0.8, **more}  # type: ignore[arg-type]
    )  # fmt: skip


def complaints(found: Examination) -> set[tuple[str, str, str]]:
    return {(f.kind, f.unit, f.verdict) for f in found.findings if f.verdict in ("fault", "warning")}


@pytest.mark.parametrize("activity", ["slow walk", "walk", "fast walk", "run", "stand", "tiptoe"])
def test_a_healthy_pair_of_shoes_is_ok(activity: str) -> None:
    found = check(recorded(activity))
    assert complaints(found) == set()
    assert found.verdict == "ok"
    (weight,) = found.of_kind("body_weight")
    # Readings through sensor and converter, calibrated without error.
    assert weight.numbers["ratio"] == pytest.approx(1.0, abs=0.01)
    assert len(found.of_kind("zero")) == 8


def test_warm_air_is_told_as_warm_air() -> None:
    recording = recorded()
    for name, channel in recording.channels.items():
        recording = changed(recording, name, channel.values + 27.0)
    found = check(recording)
    at_start = next(f for f in found.of_kind("temperature") if f.says.startswith("since the calibration"))
    assert at_start.numbers["delta_k"] == pytest.approx(8.0, abs=0.3)
    assert {f.verdict for f in found.of_kind("temperature")} == {"warning"}


def test_warming_during_a_trial_is_seen_in_swing() -> None:
    recording = recorded()
    for name, channel in recording.channels.items():
        recording = changed(recording, name, channel.values + 13.5 * recording.time_s / recording.time_s[-1])
    found = check(recording)
    in_swing = [f for f in found.of_kind("temperature") if f.says.startswith("in swing")]
    assert [f.numbers["delta_k"] for f in in_swing] == pytest.approx([4.0, 4.0], abs=0.5)
    assert all(f.verdict == "warning" for f in found.of_kind("swing_zero"))


def test_a_dead_heel_costs_body_weight() -> None:
    recording = recorded()
    noise = 0.05 * np.random.default_rng(0).standard_normal(len(recording))
    found = check(changed(recording, "left_heel", noise))
    assert complaints(found) == {("dead", "left_heel", "fault"), ("body_weight", "", "fault")}
    assert found.findings[0].verdict == "fault"


def test_a_stuck_toe_is_named() -> None:
    recording = recorded()
    values = recording["right_toe"].values.copy()
    values[4000:] = values[4000]
    assert ("stuck", "right_toe", "fault") in complaints(check(changed(recording, "right_toe", values)))


def test_weight_in_the_shoe_at_the_start_is_named() -> None:
    recording = recorded()
    found = check(changed(recording, "left_heel", recording["left_heel"].values + 20.0))
    assert ("zero", "left_heel", "fault") in complaints(found)


def test_a_start_without_a_rest_is_no_fault() -> None:
    recording = recorded().between(10.0, 40.0)
    found = check(recording)
    assert {f.verdict for f in found.of_kind("zero")} == {"unknown"}
    assert found.verdict == "ok"


def test_another_units_calibration_is_found_by_body_weight() -> None:
    wrong = [replace(c, b0=1.3 * c.b0, b1=1.3 * c.b1) for c in calibrations()]
    found = examine(recorded(), wrong, body_weight_n=BODY_WEIGHT_N, coverage=0.8)
    assert complaints(found) == {("body_weight", "", "fault")}


def test_forces_need_no_calibration() -> None:
    found = examine(made("walk", 40.0).recording, body_weight_n=BODY_WEIGHT_N, coverage=0.8)
    assert found.verdict == "ok"
    assert found.of_kind("body_weight")[0].verdict == "ok"


def test_readings_without_calibrations_are_checked_as_far_as_they_go() -> None:
    found = examine(recorded(), body_weight_n=BODY_WEIGHT_N)
    assert found.of_kind("body_weight")[0].verdict == "unknown"
    assert "give --calibration" in found.of_kind("body_weight")[0].says
    assert found.of_kind("zero")[0].verdict == "ok"


def test_a_unit_that_never_sent_is_a_fault_and_nothing_breaks() -> None:
    recording = recorded()
    found = check(changed(recording, "left_meta1", np.full(len(recording), np.nan)))
    assert ("no_samples", "left_meta1", "fault") in complaints(found)


def test_what_is_no_shoe_is_said() -> None:
    with pytest.raises(MissingChannelError, match="no unit of a shoe"):
        examine(Recording.from_arrays(time_s=[0.0, 1.0], pressure_mbar=[0.0, 1.0]))
    with pytest.raises(UsageError, match="two calibrations"):
        examine(recorded(), [*calibrations(), calibrations()[0]])
    with pytest.raises(UsageError, match="right_toe"):
        examine_trial([recorded().without("right_toe")], calibrations())


def test_a_few_samples_say_nothing_and_break_nothing() -> None:
    recording = recorded().taken(slice(0, 3))
    found = check(recording)
    assert found.verdict == "unknown"


def test_volts_are_checked_too() -> None:
    recording = recorded()
    from smartshoe.units import VOLT

    volts = {
        name: Channel.from_values(name, 0.5 + channel.in_unit(MILLIBAR) / 50.0, VOLT, "sensor")
        for name, channel in recording.channels.items()
    }
    found = examine(Recording(recording.time_s, volts))
    assert {f.kind for f in found.findings} == {"zero"}


def one_shoe(side: str) -> Recording:
    recording = recorded()
    return replace(
        recording.without(*(name for name in recording.channels if not name.startswith(side))), source=f"{side}.csv"
    )


def test_two_files_of_one_shoe_each_are_weighed_together() -> None:
    left, right = one_shoe("left"), one_shoe("right")
    # Half a second between the two clocks changes no mean over strides.
    late = replace(right, time_s=right.time_s + 0.5)
    found = examine_trial([left, late], calibrations(), body_weight_n=BODY_WEIGHT_N, coverage=0.8)
    (weight,) = found[-1].findings
    assert weight.verdict == "ok"
    assert weight.numbers["ratio"] == pytest.approx(1.0, abs=0.01)
    assert all(not item.of_kind("body_weight") for item in found[:-1])
    alone = examine_trial([left], calibrations()[:4], body_weight_n=BODY_WEIGHT_N, coverage=0.8)
    assert "give both shoes" in alone[0].of_kind("body_weight")[0].says


def test_a_calibration_by_region_serves_columns_without_a_side() -> None:
    left = one_shoe("left")
    bare = Recording(
        left.time_s,
        {name.removeprefix("left_"): replace(c, name=name.removeprefix("left_")) for name, c in left.channels.items()},
    )
    own = [replace(c, unit=c.unit.removeprefix("left_")) for c in calibrations()[:4]]
    found = examine(bare, own, body_weight_n=BODY_WEIGHT_N, coverage=0.8)
    assert len(found.of_kind("swing_zero")) == 4


def test_counts_at_rest_without_a_scale_are_no_fault() -> None:
    """A text line's counts have no range: a rest alone does not say how much a count is."""
    time_s = np.arange(400) / 200.0
    noise = np.random.default_rng(3).integers(-1, 2, (4, 400))
    columns = {f"{name}_counts": 100.0 * k + noise[k] for k, name in enumerate(("toe", "meta1", "meta4", "heel"))}
    found = examine(Recording.from_arrays(time_s=time_s, **columns))
    zeros = [finding for finding in found.findings if finding.kind == "zero"]
    assert [finding.verdict for finding in zeros] == ["unknown"]
    assert "--calibration" in zeros[0].says
