"""What a session does and says at its edges: rests and ranges, what is recorded when, what a plan and a stream hold."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bench_sessions import SHORT, SHORT_TOML, bench_plan

from smartshoe.calibration import Calibration
from smartshoe.calibration.store import CalibrationStore
from smartshoe.devices import Block, Shoe
from smartshoe.errors import InputError, LimitError, ScenarioError
from smartshoe.protocol import Protocol, Segment, dynamic_protocol
from smartshoe.recording import Channel, Recording
from smartshoe.runs.session import SessionFolder, SessionPlan, Unattended, analyse, conduct, protocols_named
from smartshoe.runs.session._checks import (
    AT_THE_END,
    Pressing,
    contact,
    first_fault,
    other_test,
    saturation,
    stream_too_short,
    zero_drift,
)
from smartshoe.units import MILLIBAR

RATE_HZ = 100.0


def pressed(last_s: float, moves_mbar: float) -> Pressing:
    """A press between two rests, the last one of ``last_s``; the unloaded reading rises from rest to rest."""
    presses = (Segment("rest", 0.0, 3.0), Segment("ramp", 800.0, 2.0), Segment("ramp", 0.0, 2.0))
    protocol = Protocol("once", (*presses, Segment("rest", 0.0, last_s)))
    time_s = np.arange(0.0, protocol.duration_s, 1.0 / RATE_HZ)
    load_n = protocol.load_at(time_s)
    reading = 0.1 * load_n + np.random.default_rng(1).normal(0.0, 0.01, time_s.size)
    reading += np.interp(time_s, [1.5, 7.0 + 0.5 * last_s], [0.0, moves_mbar])
    channel = replace(Channel.from_values("left_toe", reading, MILLIBAR, "sensor"), range_=(0.0, 200.0))
    stream = Recording(time_s, {"left_toe": channel})
    return Pressing("left_toe", protocol, stream, Recording.from_arrays(time_s=time_s, force_n=load_n))


@pytest.mark.parametrize(("last_s", "is_told"), [(0.2, False), (0.4, False), (0.6, True), (2.0, True)])
def test_the_zero_is_looked_at_in_rests_of_half_a_second_and_more(last_s: float, is_told: bool) -> None:
    """Of one rest alone nothing can be said."""
    found = zero_drift(pressed(last_s, 5.0))
    assert (found is not None) is is_told


@pytest.mark.parametrize(("percent", "is_told"), [(1.8, False), (2.2, True), (4.0, True)])
def test_a_zero_that_moves_by_a_fiftieth_of_the_span_is_told_with_its_size(percent: float, is_told: bool) -> None:
    found = zero_drift(pressed(2.0, 0.8 * percent))
    assert (found is not None) is is_told
    if found is not None:
        said = float(found.says.split(" moves by ")[1].split(" %")[0])
        assert said == pytest.approx(percent, rel=0.06)


def of_readings(values: np.ndarray, range_: tuple[float, float] | None) -> Pressing:
    """A stream of one unit, without a log."""
    channel = replace(Channel.from_values("left_toe", values, MILLIBAR, "sensor"), range_=range_)
    return Pressing("left_toe", SHORT, Recording(np.arange(values.size) / RATE_HZ, {"left_toe": channel}))


@pytest.mark.parametrize(("samples", "is_told"), [(2, False), (3, True)])
@pytest.mark.parametrize("range_", [(0.0, 200.0), (-100.0, 100.0), (-300.0, -100.0)])
def test_three_samples_in_the_last_two_hundredth_of_a_range_are_its_end(
    range_: tuple[float, float], samples: int, is_told: bool
) -> None:
    values = np.full(50, 0.5 * (range_[0] + range_[1]))
    values[:samples] = range_[1] - 0.9  # of 1.0
    found = saturation(of_readings(values, range_))
    assert (found is not None) is is_told
    assert found is None or f"({range_[1]:g} mbar) at 3 samples" in found.says
    values[:] = range_[1] - 1.1
    assert saturation(of_readings(values, range_)) is None


@pytest.mark.parametrize(("share", "is_told"), [(15.0, True), (25.0, False)])
def test_a_sensor_without_a_range_moves_where_it_moves_twenty_times_as_far_as_it_flickers(
    share: float, is_told: bool
) -> None:
    flicker = np.resize([0.0, 1.0], 400)
    found = contact(of_readings(flicker + (share - 1.0) * np.repeat([0.0, 1.0, 0.0, 1.0], 100), None))
    assert (found is not None) is is_told
    assert found is None or f"({share:.3g} mbar)" in found.says


def test_a_unit_that_was_read_once_has_moved_by_nothing() -> None:
    assert contact(of_readings(np.array([3.0]), (0.0, 200.0))) is not None
    assert contact(of_readings(np.array([3.0]), None)) is not None


def test_what_is_looked_for_in_a_log_is_nowhere_without_one() -> None:
    alone = replace(pressed(2.0, 0.0), load=None)
    assert first_fault(AT_THE_END, alone) is None
    assert alone.alignment is None
    assert alone.correlations == {}


def test_a_log_that_does_not_match_is_told_alone_and_not_judged_by_its_clock() -> None:
    good = pressed(2.0, 5.0)
    assert good.load is not None
    steps = 400.0 * np.abs(np.sin(np.cumsum(np.random.default_rng(5).normal(0.0, 0.1, len(good.load)))))
    other = replace(good, load=Recording.from_arrays(time_s=good.load.time_s, force_n=800.0 / steps.max() * steps))
    assert other.alignment is None
    assert first_fault((stream_too_short, zero_drift), other) is None
    found = first_fault((other_test,), other)
    assert found is not None
    assert f"(correlation {other.correlations['left_toe']:.2f})" in found.says


# -- what is recorded, and what is said --------------------------------------------------------------------------
class _Noting(Unattended):
    """Everything that the session says and asks for, in its order."""

    def __init__(self) -> None:
        self.heard: list[tuple[str, Any]] = []

    def streams(self, shoe: Shoe) -> None:
        self.heard.append(("streams", shoe.is_open))

    def tell(self, sentence: str) -> None:
        self.heard.append(("tell", sentence))

    def confirm(self, sentence: str, meanwhile: Any) -> None:
        self.heard.append(("confirm", sentence))

    def show(self, block: Block, experiment: str, elapsed_s: float) -> None:
        self.heard.append(("show", (experiment, elapsed_s, float(block.time_s[0]))))

    def of(self, kind: str) -> list[Any]:
        return [what for key, what in self.heard if key == kind]


def test_a_session_is_told_from_its_stream_to_its_last_pressing(tmp_path: Path) -> None:
    short, again = (Protocol(name, dynamic_protocol((800.0,), rest_s=1.0).segments) for name in ("short", "again"))
    operator = _Noting()
    with SessionFolder.begin(
        tmp_path, bench_plan(protocols=(short, again), zero_s=4.0, tail_s=3.0, rest_s=5.0)
    ) as folder:
        conduct(folder, operator)
        first, second = folder.attempts()
        conduct(folder, operator)  # nothing is left to be done
        assert len(folder.attempts()) == 2
    # The shoe is there for a page before its first reading is shown.
    assert operator.heard[0] == ("streams", True)
    assert operator.of("confirm") == [
        f"{name}: put left_toe under the anvil, unloaded; nothing else may touch the shoe"
        for name in ("short", "again")
    ]
    assert [said for said in operator.of("tell") if "no fault found" in said] == [
        f"{name}: recorded, no fault found" for name in ("short", "again")
    ]
    # Elapsed is counted from the machine's start.
    for name in ("short", "again"):
        elapsed = [s for experiment, s, _ in operator.of("show") if experiment == name]
        assert elapsed[0] == 0.0
        assert short.duration_s < max(elapsed) < short.duration_s + 3.5
    # Before the machine starts the unit is heard unloaded, and a little longer after it has ended.
    for attempt in (first, second):
        stream, load = attempt.stream(), attempt.load()
        at = Pressing("left_toe", short, stream, load).alignment
        assert at is not None
        machine_s = at.machine_time(stream.time_s)
        assert machine_s[0] < load.time_s[0] - 3.9
        assert machine_s[-1] > load.time_s[-1] + 2.9
        assert len(attempt.findings) == 0


def test_what_is_pressed_at_one_rate_is_judged_without_leaving_one_out(tmp_path: Path) -> None:
    one = Protocol("one", dynamic_protocol((400.0,), rest_s=2.0, repeats=2).segments)
    with SessionFolder.begin(tmp_path, bench_plan(protocols=(one,))) as folder:
        conduct(folder)
        result = analyse(folder)
    assert result.without_a_rate is None
    assert "leave_one_rate_out" not in result.to_dict()["identification"]
    assert result.identification.converged


@pytest.mark.parametrize("peak_n", [400.0, 780.0, 900.0])
def test_by_the_last_calibration_it_is_said_how_far_the_reading_will_go(tmp_path: Path, peak_n: float) -> None:
    """The end value of a held load, b1/a1 newtons a millibar, and the zero beside it."""
    store = CalibrationStore(tmp_path / "store")
    store.add(Calibration(0.2, 9.0, 1.6, MILLIBAR, serial_number="T7", created="2026-01-01"))
    store.add(Calibration(0.25, 9.0, 2.0, MILLIBAR, offset=2.5, serial_number="T7", created="2026-02-01"))
    protocol = Protocol("one", dynamic_protocol((800.0,), peak_n=peak_n, rest_s=1.0).segments)
    operator = _Noting()
    plan = bench_plan(serial_number="T7", store=str(store.folder), protocols=(protocol,))
    expected = f"{peak_n * 0.25 / 2.0 + 2.5:.0f}"
    with SessionFolder.begin(tmp_path / "session", plan) as folder:
        if peak_n == 900.0:
            with pytest.raises(LimitError, match=rf"at which left_toe would read {expected} mbar .* its range of 100"):
                conduct(folder, operator)
            assert folder.attempts() == []
            return
        conduct(folder, operator)
    assert f"one: left_toe is expected to reach {expected} of 100 mbar" in operator.of("tell")


# -- plans -------------------------------------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("change", "key"),
    [
        ({"zero_s": "long"}, "zero_s"),
        ({"unit": 3}, "unit"),
        ({"colour": "red"}, "colour"),
        ({"largest_repeats": 101}, "the plan"),
        ({"largest_repeats": -1}, "the plan"),
        ({"tail_s": -1.0}, "the plan"),
        ({"valid_for_days": 0.0}, "the plan"),
        ({"protocols": []}, "the plan"),
    ],
)
def test_a_plan_that_is_damaged_says_where(change: dict[str, Any], key: str) -> None:
    found = {**json.loads(json.dumps(bench_plan().to_dict())), **change}
    with pytest.raises(InputError, match=rf"^here: key '{key}': .*: restore the file from a copy$"):
        SessionPlan.from_dict(found, "here")


@pytest.mark.parametrize("change", [{"zero_s": 0.0}, {"largest_repeats": 0}, {"largest_repeats": 100}, {"wait_s": 0.0}])
def test_a_plan_may_ask_for_the_least_and_the_most(change: dict[str, Any]) -> None:
    plan = bench_plan(**change)
    assert SessionPlan.from_dict(json.loads(json.dumps(plan.to_dict())), "here") == plan


def test_a_file_of_protocols_is_one_whatever_its_ending(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "plan").write_text(SHORT_TOML)
    assert [one.name for one in protocols_named([str(tmp_path / "plan")])] == ["short"]
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ScenarioError, match=r"lost\.TOML does not exist"):
        protocols_named(["lost.TOML"])
