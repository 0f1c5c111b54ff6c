"""The parts of a session by themselves: its stream, its waiting, its folder, its machine; how an experiment ends."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from bench_sessions import bench_plan

from smartshoe.calibration import Calibration
from smartshoe.devices import Block, ChannelDescription, Shoe, open_shoe
from smartshoe.errors import (
    DeviceError,
    DeviceTimeoutError,
    FormatError,
    InputError,
    RefusedError,
    SmartShoeError,
    UnitError,
    UsageError,
)  # fmt: skip
from smartshoe.files.logs import write
from smartshoe.protocol import Protocol, dynamic_protocol
from smartshoe.recording import Recording
from smartshoe.runs.session import PressingFault, SessionFolder, Unattended, analyse, conduct
from smartshoe.runs.session import _machine_run as machine_run
from smartshoe.runs.session import _procedure as procedure
from smartshoe.runs.session import _samples as samples
from smartshoe.runs.session._analysis import joined
from smartshoe.runs.session._folder import writing_to_disk
from smartshoe.runs.session._machine_run import LogByHand, machine_at
from smartshoe.runs.session._procedure import _Pressing, _Stream
from smartshoe.runs.session._publish import _card
from smartshoe.runs.session.streaming import StreamedForces
from smartshoe.units import MILLIBAR, VOLT

QUICK = Protocol("quick", dynamic_protocol((800.0,), rest_s=1.0).segments)
SLOW = Protocol("slow", dynamic_protocol((160.0,), rest_s=0.0).segments)  # ten seconds
UNIT = ChannelDescription("left_toe", "pressure", MILLIBAR, (0.0, 100.0), None, 200.0)


class _Clock:
    """Time that passes while something sleeps, and not otherwise."""

    def __init__(self) -> None:
        self.now_s = 1000.0

    def monotonic(self) -> float:
        return self.now_s

    def sleep(self, seconds: float) -> None:
        self.now_s += seconds


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> _Clock:
    made = _Clock()
    monkeypatch.setattr(procedure, "time", made)
    return made


def block(time_s: float, reading: float = 1.0, live: bool = False) -> Block:
    times = np.array([time_s])
    more = {"host_time_s": times, "arrival_s": times} if live else {}
    return Block(times, np.array([[reading]]), np.zeros((1, 1), dtype=bool), ("left_toe",), MILLIBAR, **more)


def stream_of(blocks: Iterator[Block], **shoe: Any) -> tuple[_Stream, list[Block], list[Any]]:
    """A stream of ``blocks``, what it keeps on disk, and what it notes and tells."""
    kept: list[Block] = []
    said: list[Any] = []
    folder: Any = SimpleNamespace(attempts=tuple, keep=kept.append, note=lambda kind, **facts: said.append(facts))
    operator: Any = SimpleNamespace(show=lambda *_: None, tell=said.append)
    made: Any = SimpleNamespace(**{"events": (), "describe": lambda: (UNIT,), **shoe, "blocks": lambda: blocks})
    return _Stream(made, folder, operator), kept, said


EMPTY = Block(np.zeros(0), np.zeros((0, 1)), np.zeros((0, 1), dtype=bool), ("left_toe",), MILLIBAR)


# -- the stream --------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("duration_s", [0.0, 3.0])
def test_so_much_of_a_stream_is_recorded_as_was_asked_for(clock: _Clock, duration_s: float) -> None:
    stream, kept, _ = stream_of(block(50.0 + 0.5 * k) for k in range(100))
    stream.record("", duration_s)
    assert kept[-1].time_s[0] - kept[0].time_s[0] == duration_s
    assert not stream.has_ended


def test_a_silent_stream_is_waited_for_half_a_minute(clock: _Clock) -> None:
    def silent() -> Iterator[Block]:
        for time_s in (0.0, 1.0):
            clock.sleep(20.0)  # each time a sample comes the wait begins anew
            yield EMPTY
            yield block(time_s)
        while True:
            clock.sleep(1.0)
            yield EMPTY

    stream, kept, _ = stream_of(silent())
    stream.record("", 100.0)
    assert len(kept) == 2
    assert clock.now_s - 1000.0 == pytest.approx(40.0 + procedure.SILENT_S, abs=1.5)


def test_what_befalls_a_shoe_is_noted_and_told_once_each() -> None:
    befallen: list[Any] = []

    def blocks() -> Iterator[Block]:
        for k in range(4):
            befallen.append(SimpleNamespace(says=f"event {k}", to_dict=lambda k=k: {"says": f"event {k}"}))
            yield block(float(k))

    stream, _, said = stream_of(blocks(), events=befallen)
    for _ in range(5):
        stream.next("", 0.0)
    assert said == [one for k in range(4) for one in ({"says": f"event {k}"}, f"event {k}")]
    assert stream.has_ended


@pytest.mark.parametrize("live", [True, False])
def test_a_live_shoe_is_read_on_while_a_person_is_waited_for(clock: _Clock, live: bool) -> None:
    stream, kept, _ = stream_of(block(float(k), live=live) for k in range(3))
    stream.next("", 0.0)
    stream.drain()
    assert len(kept) == (2 if live else 1)
    assert (clock.now_s > 1000.0) is not live
    for _ in range(4):
        stream.drain()
    assert len(kept) == (3 if live else 1)


def test_a_unit_that_sends_nothing_any_more_is_not_waited_for(clock: _Clock) -> None:
    stream, _, _ = stream_of(iter([block(0.0)]))
    stream.next("", 0.0)
    stream.rest("", "left_toe", 100.0)
    assert stream.has_ended


# -- the waiting -------------------------------------------------------------------------------------------------
def pressing_of(machine: Any, stream: Any, tail_s: float = 2.0) -> tuple[_Pressing, list[str]]:
    told: list[str] = []
    plan = bench_plan(tail_s=tail_s, wait_s=60.0)
    folder: Any = SimpleNamespace(plan=plan, path=Path("here"), keep_log=lambda *_: None, channels=(UNIT,))
    operator: Any = SimpleNamespace(tell=told.append)
    return _Pressing(folder, SLOW, 1, machine, stream, operator), told


def waited_out(pressing: _Pressing) -> None:
    while not pressing.is_over():
        pass


@pytest.mark.parametrize("is_live", [True, False])
def test_a_log_by_hand_is_waited_for_as_long_as_the_plan_says(
    clock: _Clock, is_live: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Beyond the test itself, where that is pressed now; every quarter of a minute it is said what is missing."""
    machine = LogByHand(tmp_path / "log.csv", "*.csv", {})
    monkeypatch.setattr(machine, "log", lambda: None)
    machine.reason = "it still grows"

    def next_block(*_: Any) -> object:
        clock.sleep(0.25)
        return object()

    stream: Any = SimpleNamespace(last_s=0.0, has_ended=False, is_live=is_live, next=next_block)
    pressing, told = pressing_of(machine, stream)
    with pytest.raises(DeviceTimeoutError, match="it still grows"):
        waited_out(pressing)
    assert clock.now_s - 1000.0 == pytest.approx(60.0 + 10.0 * is_live, abs=0.6)
    assert told == ["waiting for the machine's log: it still grows"] * int((60.0 + 10.0 * is_live) / 15.1)


@pytest.mark.parametrize("is_live", [True, False])
def test_a_live_shoe_that_falls_silent_ends_the_test(clock: _Clock, is_live: bool) -> None:
    machine: Any = SimpleNamespace(by_hand=False, log=lambda: None)

    def next_block(*_: Any) -> object | None:
        clock.sleep(1.0)
        return object() if clock.now_s < 1020.0 else None

    stream: Any = SimpleNamespace(last_s=0.0, has_ended=False, is_live=is_live, next=next_block)
    pressing, _ = pressing_of(machine, stream)
    if not is_live:  # a file that is played back sends when it sends
        assert not any(pressing.is_over() for _ in range(200))
        return
    with pytest.raises(DeviceError, match=r"has sent nothing for 30 s.*--resume here"):
        waited_out(pressing)
    assert clock.now_s - 1000.0 == pytest.approx(20.0 + procedure.SILENT_S, abs=1.5)


def test_a_recording_that_has_ended_waits_for_its_log_alone(clock: _Clock) -> None:
    log = object()
    machine: Any = SimpleNamespace(by_hand=True, columns={}, log=lambda: log if clock.now_s > 1005.0 else None)
    stream: Any = SimpleNamespace(last_s=0.0, has_ended=True, is_live=False, next=None)
    pressing, _ = pressing_of(machine, stream)
    while not pressing.is_over():
        assert clock.now_s < 1010.0
    assert clock.now_s > 1005.0


def test_while_a_person_can_stop_the_machine_the_stream_is_looked_at_every_two_seconds() -> None:
    stream: Any = SimpleNamespace(last_s=10.0, is_live=True, blocks=[block(0.1 * k, 99.9) for k in range(5)])
    machine: Any = SimpleNamespace(by_hand=True)
    pressing, _ = pressing_of(machine, stream)
    seen = []
    for stream.last_s in np.arange(10.0, 17.0, 0.5):
        fault = pressing.look()
        if fault is not None:
            assert fault.kind == "saturation"
            seen.append(float(stream.last_s))
    assert seen == [12.0, 14.0, 16.0]
    stream.last_s = 20.0
    for changed, name in ((stream, "is_live"), (machine, "by_hand")):
        setattr(changed, name, False)
        assert pressing.look() is None
        setattr(changed, name, True)
    assert pressing.look() is not None


# -- how an experiment ends --------------------------------------------------------------------------------------
MOVES = PressingFault("zero_drift", "the zero moves", grave=False)
HANGS = PressingFault("no_contact", "nothing is pressed")
OTHER = PressingFault("other_test", "give the log of this test")


class _Says(Unattended):
    def __init__(self, wants: bool | None) -> None:
        self.wants, self.confirmed = wants, list[str]()

    def confirm(self, sentence: str, meanwhile: object) -> None:
        self.confirmed.append(sentence)

    def wants_repeat(self, finding: PressingFault, repeats_left: int) -> bool:
        return super().wants_repeat(finding, repeats_left) if self.wants is None else self.wants


@pytest.mark.parametrize(
    ("fault", "wants", "states", "ends"),
    [
        (MOVES, False, ["accepted"], None),
        (MOVES, None, ["rejected", "accepted"], None),
        (HANGS, False, ["rejected"], RefusedError),
        (HANGS, None, ["rejected", "rejected"], RefusedError),
        (HANGS, True, ["rejected", "rejected"], RefusedError),
        (MOVES, True, ["rejected", "rejected"], RefusedError),
        (OTHER, False, ["rejected"], InputError),
    ],
)
def test_a_fault_is_repeated_accepted_or_the_end(
    fault: PressingFault, wants: bool | None, states: list[str], ends: type[SmartShoeError] | None,
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    """``wants`` says whether a person wants it pressed again: at most once, whoever asks for more."""
    monkeypatch.setattr(procedure, "AT_THE_END", (lambda _: fault,))
    operator = _Says(wants)
    with SessionFolder.begin(tmp_path, bench_plan(protocols=(QUICK,), largest_repeats=1, rest_s=0.0)) as folder:
        if ends is None:
            conduct(folder, operator)
        else:
            with pytest.raises(ends, match=f"pressed {len(states)} time{'s' * (len(states) > 1)}: {fault.says}; then"):
                conduct(folder, operator)
        assert [attempt.state for attempt in folder.attempts()] == states
        assert [attempt.findings for attempt in folder.attempts()] == [[fault.to_dict()]] * len(states)
        assert [attempt.number for attempt in folder.attempts()] == list(range(1, len(states) + 1))
    assert ["once more" in sentence for sentence in operator.confirmed] == [False, True][: len(states)]


def test_the_page_tells_which_attempt_was_accepted_and_what_was_wrong_before(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    faults = iter([HANGS, None])
    monkeypatch.setattr(procedure, "AT_THE_END", (lambda _: next(faults),))
    with SessionFolder.begin(tmp_path, bench_plan(protocols=(QUICK,), rest_s=0.0)) as folder:
        conduct(folder)
        result = analyse(folder)
    card = dict(_card(result, None))
    assert card["unit"] == "left_toe, serial number not given"
    assert card["pressed: quick"] == "accepted at attempt 2; attempt 1: nothing is pressed"
    assert "the reading stands at the end of the sensor's range; another unit" in " ".join(card.values())
    assert card["clocks"] == f"quick: beside the shoe's the machine's clock is {result.clocks['quick'].says}"
    told = result.to_dict()
    assert [(one["attempt"], one["state"], one["findings"]) for one in told["attempts"]] == [
        (1, "rejected", [HANGS.to_dict()]),
        (2, "accepted", []),
    ]
    assert told["attempts"][1]["samples"] == result.attempts[1].samples > len(result.recordings["quick"])


@pytest.mark.parametrize(("every", "to_fit_hz"), [(1, 200.0), (4, 50.0)])
def test_what_is_fitted_is_read_as_often_as_the_slower_of_the_two(every: int, to_fit_hz: float, tmp_path: Path) -> None:
    with SessionFolder.begin(tmp_path, bench_plan(protocols=(QUICK,))) as folder:
        conduct(folder)
        (attempt,) = folder.attempts()
        stream, load = attempt.stream(), attempt.load()
        plan = folder.plan
    at_200 = np.arange(load.time_s[0], load.time_s[-1], 0.005)
    fine = Recording.from_arrays(time_s=at_200, force_n=np.interp(at_200, load.time_s, load.force_n))
    thinned = fine.taken(np.arange(len(fine)) % every == 0)
    pressing: Any = SimpleNamespace(stream=lambda: stream, load=lambda: thinned, experiment="quick", number=1)
    for to_fit, rate_hz in ((False, 200.0), (True, to_fit_hz)):
        found, _ = joined(plan, pressing, to_fit=to_fit)
        assert found.sample_rate_hz == pytest.approx(rate_hz, rel=1e-3)
        assert [channel.name for channel in found.sensors] == ["left_toe"]
        assert (found.name, found.unit, found.source) == ("quick", "left_toe", "quick, attempt 1")


# -- the folder --------------------------------------------------------------------------------------------------
def test_a_disk_that_refuses_is_told_from_what_a_person_did_wrong(tmp_path: Path) -> None:
    with (
        pytest.raises(InputError, match=r"raw takes no more data \(No space left on device\)"),
        writing_to_disk(Path("raw")),
    ):
        raise OSError(28, os.strerror(28))
    with pytest.raises(InputError, match=r"\(Read-only file system\)"), writing_to_disk(Path("raw")):
        raise UsageError("cannot be written") from OSError(30, os.strerror(30))
    for mistake in (UsageError("a bad name"), DeviceError("it failed")):
        with pytest.raises(type(mistake)) as found, writing_to_disk(Path("raw")):
            raise mistake
        assert found.value is mistake


def test_a_session_that_is_only_read_takes_nothing(tmp_path: Path) -> None:
    SessionFolder.begin(tmp_path, bench_plan()).close()
    with SessionFolder.open(tmp_path) as folder, pytest.raises(UsageError, match="opened to be read"):
        folder.note("begin", experiment="short", attempt=1)


def test_an_attempt_without_samples_or_log_says_so(tmp_path: Path) -> None:
    with SessionFolder.begin(tmp_path, bench_plan()) as folder:
        folder.note("begin", experiment="short", attempt=3)
        (attempt,) = folder.attempts()
    with pytest.raises(InputError, match="short, attempt 3 holds no samples"):
        attempt.stream()
    with pytest.raises(InputError, match="short, attempt 3 has no machine's log"):
        attempt.load()


def test_a_log_that_came_as_a_file_is_kept_byte_by_byte_with_its_columns(tmp_path: Path) -> None:
    log = tmp_path / "Specimen.txt"
    log.write_bytes(b"force_n\ttime_s\tother_n\n1\t0\t7\n2\t1\t8\n3\t2\t9\n")
    columns = {"force": "other_n", "time": "time_s"}
    with SessionFolder.begin(tmp_path / "session", bench_plan()) as folder:
        folder.note("begin", experiment="short", attempt=1)
        folder.keep_log(log, "short_1", columns)
        (attempt,) = folder.attempts()
    assert attempt.log == tmp_path / "session" / "raw" / "short_1.txt"
    assert attempt.log.read_bytes() == log.read_bytes()
    assert attempt.columns == columns
    load = attempt.load()
    assert load.force_n.tolist() == [7.0, 8.0, 9.0]
    assert load.source == str(log)


def test_what_a_unit_is_comes_back_from_the_journal(tmp_path: Path) -> None:
    channels = (UNIT, ChannelDescription("left_heel", "voltage", VOLT, None, 0.01, 100.0))
    shoe: Any = SimpleNamespace(describe=lambda: channels, information="board 7")
    with SessionFolder.begin(tmp_path, bench_plan()) as folder:
        folder.note_stream(shoe)
        folder.note("begin", experiment="short", attempt=1)
        folder.note("shoe", says="a gap")
        assert folder.channels == channels
        (attempt,) = folder.attempts()
    assert attempt.channels == channels
    assert [event["says"] for event in attempt.events] == ["a gap"]


@pytest.mark.parametrize("change", [lambda data: data[:-1], lambda data: data + b"\0", lambda data: data[:5]])
def test_a_block_that_was_cut_is_no_block(change: Any) -> None:
    data = samples.packed(block(1.0, live=True))
    with pytest.raises(FormatError, match="the journal is"):
        samples.unpacked(change(data), ("left_toe",), MILLIBAR)
    with pytest.raises(FormatError, match="another session"):
        samples.unpacked(data, ("left_toe", "left_heel"), MILLIBAR)


# -- the machine -------------------------------------------------------------------------------------------------
def test_a_log_by_hand_is_named_with_its_columns_and_pattern(tmp_path: Path) -> None:
    shoe: Any = None
    folder = machine_at(f"log:{tmp_path}?pattern=*.txt&force=Load&time=T", shoe, "left_toe")
    assert isinstance(folder, LogByHand)
    assert (str(folder), folder.columns) == (f"{tmp_path}/*.txt", {"force": "Load", "time": "T"})
    file = machine_at(f"log:{tmp_path / 'x.csv'}", shoe, "left_toe")
    assert (str(file), file.columns) == (str(tmp_path / "x.csv"), {})
    with pytest.raises(UsageError, match="has no option 'colour'"):
        machine_at(f"log:{tmp_path}?colour=red", shoe, "left_toe")
    with pytest.raises(UsageError, match="nowhere does not exist"):
        machine_at(f"log:{tmp_path / 'nowhere' / 'x.csv'}", shoe, "left_toe")


@pytest.mark.parametrize(
    ("share", "is_fresh", "is_taken"), [(0.94, True, False), (0.96, True, True), (0.5, False, True)]
)
def test_a_fresh_log_is_whole_once_it_has_reached_its_peak(
    share: float, is_fresh: bool, is_taken: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(machine_run, "SETTLED_S", 0.0)
    time_s = np.arange(0.0, SLOW.duration_s, 0.1)
    write(Recording.from_arrays(time_s=time_s, force_n=share * SLOW.load_at(time_s)), tmp_path / "log.csv")
    machine = LogByHand(tmp_path / "log.csv", "*.csv", {})
    assert machine.log() is None  # nothing is awaited yet
    machine.fresh_only = is_fresh
    machine.start(SLOW)
    assert machine.log() == (tmp_path / "log.csv" if is_taken else None)
    if not is_taken:
        assert machine.reason.endswith(f"has reached {800 * share:.0f} N of 800 N so far")


@pytest.mark.parametrize(("age_s", "is_taken"), [(1.0, False), (3.0, True)])
def test_a_log_counts_once_it_has_not_changed_for_two_seconds(age_s: float, is_taken: bool, tmp_path: Path) -> None:
    write(Recording.from_arrays(time_s=np.arange(3.0), force_n=np.array([0.0, 800.0, 0.0])), tmp_path / "log.csv")
    changed_ns = (tmp_path / "log.csv").stat().st_mtime_ns - int(1e9 * age_s)
    os.utime(tmp_path / "log.csv", ns=(changed_ns, changed_ns))
    machine = LogByHand(tmp_path / "log.csv", "*.csv", {})
    machine.start(SLOW)
    assert machine.log() == (tmp_path / "log.csv" if is_taken else None)
    assert is_taken or machine.reason.endswith("still grows")


def test_why_a_log_did_not_come_is_said_in_words_that_help(tmp_path: Path) -> None:
    machine = LogByHand(tmp_path / "log.csv", "*.csv", {})
    machine.start(SLOW)
    late = machine.late(7.0)
    assert isinstance(late, DeviceTimeoutError)
    assert str(late).startswith("the machine's log did not come within 7 s")
    (tmp_path / "log.csv").write_text("time_s,force_n\n0,0\n")
    assert isinstance(machine.late(7.0), InputError)


# -- a stream's forces -------------------------------------------------------------------------------------------
@pytest.fixture
def shoe() -> Iterator[Shoe]:
    with open_shoe("sim:walk", duration_s=1.0) as made:
        yield made


def test_calibrations_that_do_not_fit_a_shoe_are_refused(shoe: Shoe) -> None:
    of_heel, of_nose = (Calibration(0.3, 5.0, 2.5, MILLIBAR, unit=unit) for unit in ("left_heel", "nose"))
    with pytest.raises(UsageError, match=r"of nose fits no unit of .* it has left_toe"):
        StreamedForces([of_heel, of_nose], shoe)
    with pytest.raises(UsageError, match="two calibrations of left_heel"):
        StreamedForces([of_heel, of_heel], shoe)
    forces = StreamedForces([Calibration(0.3, 5.0, 2.5, VOLT, unit="left_heel")], shoe)
    with pytest.raises(UnitError, match="takes V, the shoe sends mbar"):
        forces.push(next(iter(shoe.blocks())))


@pytest.mark.parametrize(("lost", "steps"), [(1, 2), (100, 101), (399, 400), (5000, 400)])
def test_a_filter_goes_on_over_what_is_lost_for_two_seconds_at_most(shoe: Shoe, lost: int, steps: int) -> None:
    calibration = Calibration(0.3, 5.0, 2.5, MILLIBAR, unit="left_heel")
    forces, filter_ = StreamedForces([calibration], shoe), calibration.compensator(200.0)
    names = tuple(channel.name for channel in shoe.describe())

    def at(time_s: np.ndarray, reading: float) -> Block:
        shape = (time_s.size, len(names))
        return Block(time_s, np.full(shape, reading), np.zeros(shape, dtype=bool), names, MILLIBAR)

    first = forces.push(at(0.005 * np.arange(50), 30.0))["left_heel"]
    np.testing.assert_allclose(first, filter_.push(np.full(50, 30.0)), rtol=1e-12)
    second = forces.push(at(0.005 * (49 + lost + 1 + np.arange(20)), 60.0))["left_heel"]
    even = np.concatenate([np.full(steps - 1, np.nan), np.full(20, 60.0)])
    np.testing.assert_allclose(second, filter_.push(even)[steps - 1 :], rtol=1e-12)
