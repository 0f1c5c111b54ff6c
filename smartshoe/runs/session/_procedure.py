"""The live part of a session: checks limits, then presses and records each experiment until it has no fault."""

from __future__ import annotations

import time
from collections.abc import Iterator
from itertools import count
from typing import TYPE_CHECKING

import numpy as np

from smartshoe.devices import Block, Shoe, open_shoe
from smartshoe.errors import DeviceError, InputError, LimitError, RefusedError, UsageError
from smartshoe.protocol import Protocol
from smartshoe.recording import Recording
from smartshoe.runs.session._checks import AS_IT_GOES, AT_THE_END, Pressing, PressingFault, first_fault
from smartshoe.runs.session._folder import Attempt, SessionFolder
from smartshoe.runs.session._machine_run import LOOK_EVERY_S, LogByHand, MachineSide, machine_at
from smartshoe.runs.session._operator import Operator, Unattended
from smartshoe.runs.session._plan import SessionPlan

if TYPE_CHECKING:
    from smartshoe.calibration import Calibration

SILENT_S = 30.0
IDLE_S = 0.05
REPORT_EVERY_S = 15.0
REST_OVER_S = 5.0
AT_REST_SHARE = 1e-4  # of the range: largest change between successive segments at rest
LOOK_AT_EVERY_S = 2.0  # interval at which the stream is checked while it runs


def conduct(folder: SessionFolder, operator: Operator | None = None) -> None:
    """Press every experiment of the plan that is not done yet; at any moment ``folder`` holds what was recorded so far.

    Raises `UsageError` and `LimitError` before anything moves, `DeviceError` if a device fails, `InputError` if a log
    cannot be read or the disk accepts no data, `RefusedError` if an experiment stays faulty after the last repeat. In
    all cases the session can be resumed.
    """
    operator = operator or Unattended()
    plan = folder.plan
    done = folder.accepted()
    missing = [protocol for protocol in plan.protocols if protocol.name not in done]
    if not missing:
        return
    with open_shoe(plan.shoe) as shoe:
        names = [channel.name for channel in shoe.describe()]
        if plan.unit not in names:
            raise UsageError(f"{plan.unit} is no unit of {shoe}: use one of {', '.join(names)}")
        machine = machine_at(plan.machine, shoe, plan.unit)
        try:
            _check_limits(machine, missing)
            _check_range(plan, shoe, missing, operator)
            folder.note_stream(shoe)
            operator.streams(shoe)
            stream = _Stream(shoe, folder, operator)
            stream.record("", 0.0)
            if stream.time_s is None:
                raise DeviceError(f"{plan.shoe} sent no samples: see that the shoe is switched on and streams")
            for protocol in missing:
                _experiment(folder, protocol, machine, stream, operator)
        finally:
            machine.close()


def _check_limits(machine: MachineSide, protocols: list[Protocol]) -> None:
    """Check every protocol before the first one moves anything."""
    for protocol in protocols:
        machine.check(protocol)
    if isinstance(machine, LogByHand) and not machine.is_folder and len(protocols) > 1:
        raise UsageError(
            f"log:{machine.target} is one test's log and there are {len(protocols)} protocols: give log:FOLDER, in"
            " which each test's log is a new file"
        )


def _check_range(plan: SessionPlan, shoe: Shoe, protocols: list[Protocol], operator: Operator) -> None:
    """Refuse loads at which, by an earlier calibration, the reading would exceed the sensor's range."""
    channel = next(channel for channel in shoe.describe() if channel.name == plan.unit)
    earlier = _earlier(plan)
    if channel.range_ is None or earlier is None or earlier.reading_unit.quantity != channel.unit.quantity:
        return
    high = channel.range_[1]
    for protocol in protocols:
        reading = protocol.peak_load_n * earlier.a1 / earlier.b1 + earlier.offset
        predicted = float(earlier.reading_unit.convert(np.array([reading]), channel.unit)[0])
        if predicted > high:
            raise LimitError(
                f"protocol {protocol.name} asks for {protocol.peak_load_n:g} N, at which {plan.unit} would read"
                f" {predicted:.0f} {channel.unit.symbol} by its last calibration, beyond its range of {high:g}: lower"
                " the load"
            )
        operator.tell(
            f"{protocol.name}: {plan.unit} is expected to reach {predicted:.0f} of {high:g} {channel.unit.symbol}"
        )


def _earlier(plan: SessionPlan) -> Calibration | None:
    """The unit's last calibration in the store; None if there is none."""
    if not plan.serial_number:
        return None
    from smartshoe.calibration.store import CalibrationStore

    history = CalibrationStore(plan.store).history(plan.serial_number)
    return history[-1].calibration() if history else None


class _Stream:
    """The shoe's blocks, each written to disk before anything else uses it; every wait is bounded."""

    def __init__(self, shoe: Shoe, folder: SessionFolder, operator: Operator) -> None:
        self._blocks: Iterator[Block] = shoe.blocks()
        self._shoe, self._folder, self._operator = shoe, folder, operator
        self._reported = 0
        self.has_ended = False
        self.is_live = False
        self.is_first = not folder.attempts()
        self.time_s: float | None = None
        self.blocks: list[Block] = []

    def next(self, experiment: str, elapsed_s: float) -> Block | None:
        """The next block with samples, None if none came (or none will)."""
        block = next(self._blocks, None)
        self._note_events()
        if block is None:
            self.has_ended = True
            return None
        if not len(block):
            return None
        self.is_live = self.is_live or block.arrival_s is not None
        self._folder.keep(block)
        self.blocks.append(block)
        self.time_s = float(block.time_s[-1])
        self._operator.show(block, experiment, elapsed_s)
        return block

    @property
    def last_s(self) -> float:
        """Time of the last sample, 0 before the first."""
        return 0.0 if self.time_s is None else self.time_s

    def begin(self) -> None:
        """Start a pressing: forget the blocks in memory."""
        self.blocks = []

    def record(self, experiment: str, duration_s: float) -> None:
        """Record ``duration_s`` of the stream; stops early after `SILENT_S` without samples."""
        heard, first_s = time.monotonic(), None
        while not self.has_ended and time.monotonic() - heard < SILENT_S:
            block = self.next(experiment, 0.0)
            if block is None:
                continue
            heard = time.monotonic()
            first_s = float(block.time_s[0]) if first_s is None else first_s
            if block.time_s[-1] - first_s >= duration_s:
                break

    def rest(self, experiment: str, unit: str, longest_s: float) -> None:
        """Record until the unit's unloaded reading is steady: no model includes the memory of an earlier pressing."""
        channel = next(channel for channel in self._shoe.describe() if channel.name == unit)
        size = 1.0 if channel.range_ is None else channel.range_[1] - channel.range_[0]
        begin_s, before = self.last_s, np.inf
        while not self.has_ended and self.last_s - begin_s < longest_s:
            first = len(self.blocks)
            self.record(experiment, REST_OVER_S)
            blocks = self.blocks[first:]
            readings = [block.readings[:, block.names.index(unit)] for block in blocks]
            if not readings:
                return
            now = float(np.mean(np.concatenate(readings)))
            if abs(now - before) <= AT_REST_SHARE * size:
                return
            before = now

    def drain(self) -> None:
        """Record what a live shoe sends while nothing is pressed; for a simulated or replayed one only wait."""
        if self.is_live and not self.has_ended:
            self.next("", 0.0)
        else:
            time.sleep(IDLE_S)

    def _note_events(self) -> None:
        events = self._shoe.events
        for event in events[self._reported :]:
            self._folder.note("shoe", **event.to_dict())
            self._operator.tell(event.says)
        self._reported = len(events)


def _experiment(
    folder: SessionFolder, protocol: Protocol, machine: MachineSide, stream: _Stream, operator: Operator
) -> None:
    """Press until no fault is found, with at most ``largest_repeats`` repeats."""
    plan = folder.plan
    before = sum(attempt.experiment == protocol.name for attempt in folder.attempts())
    for again in count():
        operator.confirm(
            f"{protocol.name}: put {plan.unit} under the anvil, unloaded; nothing else may touch the shoe"
            if again == 0
            else f"{protocol.name}, once more: unload {plan.unit} and let it rest",
            stream.drain,
        )
        fault = _press(folder, protocol, before + again + 1, machine, stream, operator)
        if fault is None:
            folder.note("accepted", findings=[])
            operator.tell(f"{protocol.name}: recorded, no fault found")
            return
        # A recording together with its log cannot be pressed again.
        recorded = stream.has_ended or (machine.by_hand and not stream.is_live)
        left = 0 if recorded else plan.largest_repeats - again
        repeat = operator.wants_repeat(fault, left)
        if not repeat and not fault.grave:
            folder.note("accepted", findings=[fault.to_dict()])
            return
        folder.note("rejected", findings=[fault.to_dict()])
        if not repeat or left == 0:
            kind = InputError if fault.kind == "other_test" else RefusedError
            times = f"{again + 1} time{'s' * (again > 0)}"
            raise kind(f"{protocol.name}, pressed {times}: {fault.says}; then go on with --resume {folder.path}")


def _press(
    folder: SessionFolder, protocol: Protocol, number: int, machine: MachineSide, stream: _Stream, operator: Operator
) -> PressingFault | None:
    """Carry out and record one pressing; returns the first fault found, or None."""
    plan = folder.plan
    folder.note("begin", experiment=protocol.name, attempt=number)
    stream.begin()
    stream.record(protocol.name, plan.zero_s)
    if not stream.is_first:
        operator.tell(f"{protocol.name}: waiting until {plan.unit} has come to rest")
        stream.rest(protocol.name, plan.unit, plan.rest_s)
    stream.is_first = False
    if isinstance(machine, LogByHand):
        machine.fresh_only = stream.is_live
        operator.tell(f"start the test {protocol.name} on the machine now, then export its log to {machine}")
    machine.start(protocol)
    pressing = _Pressing(folder, protocol, number, machine, stream, operator)
    while not pressing.is_over():
        fault = pressing.look()
        if fault is not None:
            operator.tell(fault.says)
            operator.tell("stop the test on the machine")
            return fault
    evidence = _evidence(folder, protocol, number, stream.blocks, folder.attempts()[-1].load())
    return first_fault(AT_THE_END, evidence)


class _Pressing:
    """The state of the loop during one test: the stream is read, the log awaited, and every wait is bounded."""

    def __init__(
        self,
        folder: SessionFolder,
        protocol: Protocol,
        number: int,
        machine: MachineSide,
        stream: _Stream,
        operator: Operator,
    ) -> None:
        self._folder, self._protocol, self._machine, self._stream = folder, protocol, machine, stream
        self._number = number
        self._start_s = self._looked_s = stream.last_s
        self._operator = operator
        self._done_s: float | None = None
        self._began = self._heard = self._reported = time.monotonic()

    def is_over(self) -> bool:
        """Record the next block; True once the log is there and the stream covers the test."""
        plan, stream = self._folder.plan, self._stream
        if self._done_s is None:
            self._await_log()
        if self._done_s is not None:
            # A log that is delivered by hand comes long after the test; a machine that ran is followed a little longer.
            tail_s = 0.0 if self._machine.by_hand else plan.tail_s
            long_enough = stream.last_s - self._start_s >= self._protocol.duration_s + tail_s
            if stream.has_ended or (long_enough and stream.last_s - self._done_s >= tail_s):
                return True
        if stream.has_ended:
            time.sleep(LOOK_EVERY_S)
        elif stream.next(self._protocol.name, stream.last_s - self._start_s) is not None:
            self._heard = time.monotonic()
        elif stream.is_live and time.monotonic() - self._heard > SILENT_S:
            raise DeviceError(
                f"{plan.shoe} has sent nothing for {SILENT_S:g} s: see that it is switched on and near, then go on with"
                f" --resume {self._folder.path}"
            )
        return False

    def _await_log(self) -> None:
        log = self._machine.log()
        if log is not None:
            self._folder.keep_log(log, f"{self._protocol.name}_{self._number}", self._machine.columns)
            self._done_s = self._stream.last_s
            return
        waited_s = time.monotonic() - self._began
        bound_s = self._folder.plan.wait_s + (self._protocol.duration_s if self._stream.is_live else 0.0)
        if not isinstance(self._machine, LogByHand):
            return
        if waited_s > bound_s:
            raise self._machine.late(waited_s)
        if time.monotonic() - self._reported > REPORT_EVERY_S:
            self._reported = time.monotonic()
            self._operator.tell(f"waiting for the machine's log: {self._machine.reason}")

    def look(self) -> PressingFault | None:
        """A fault seen in the stream so far, examined at intervals; only for a test that a person can stop."""
        stream = self._stream
        if not (self._machine.by_hand and stream.is_live) or stream.last_s - self._looked_s < LOOK_AT_EVERY_S:
            return None
        self._looked_s = stream.last_s
        return first_fault(AS_IT_GOES, _evidence(self._folder, self._protocol, self._number, stream.blocks))


def _evidence(
    folder: SessionFolder, protocol: Protocol, number: int, blocks: list[Block], load: Recording | None = None
) -> Pressing:
    so_far = Attempt(protocol.name, number, folder.channels, blocks)
    return Pressing(folder.plan.unit, protocol, so_far.stream(), load)
