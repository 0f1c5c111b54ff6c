"""`LiveSession`: the shoes of a live page, their recording, and the notes; everything that pages show and ask for."""

from __future__ import annotations

import datetime
import secrets
import time
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from threading import RLock
from typing import Any

import numpy as np

from smartshoe.calibration import Calibration
from smartshoe.devices import Block, Shoe, ShoeEvent
from smartshoe.errors import UsageError
from smartshoe.live import _recorder as recorder
from smartshoe.live._guidance import Guidance
from smartshoe.live._lsl import Outlet
from smartshoe.live._pace import Pace
from smartshoe.live._shoe import LiveShoe, lost_in
from smartshoe.live._source import Source
from smartshoe.live._zeroing import zeros_of

NOTES_KEPT, STEPS_KEPT = 500, 400
LONGEST_WORD = 80
LONGEST_AGE_S = 120.0  # largest delay of a mark, whose word is typed after the moment it marks


class LiveSession:
    """Open shoes, shown until `close`. ``changed`` is called, from any thread, when there is something new to show.

    ``calibrations`` are for any of the shoes' units. ``record`` is the file to record to from the start; without it the
    page's button records to a file in the working folder, named by date and time. ``lsl`` opens an outlet on the Lab
    Streaming Layer for each shoe.
    """

    def __init__(
        self,
        shoes: Mapping[str, Shoe],
        calibrations: Sequence[Calibration] = (),
        *,
        record: Path | None = None,
        speed: float = 1.0,
        lsl: bool = False,
        changed: Callable[[], None] = lambda: None,
        clock: Callable[[], float] = time.perf_counter,
    ) -> None:
        self.id = secrets.token_hex(8)
        self.changed = changed
        self.began = datetime.datetime.now(datetime.UTC)
        self.pace = Pace(clock, clock(), speed)
        self.shoes = [LiveShoe(url, shoe, _calibrations_of(shoe, calibrations)) for url, shoe in shoes.items()]
        _require_all_used(self.shoes, calibrations)
        _require_distinct(self.shoes)
        self.recording: recorder.LiveRecording | None = None
        self.recorded: str | None = None  # summary of the last recording
        self.task: Guidance | None = None  # of the calibration session that this page shows, if any
        self._file = record
        self._outlets = [Outlet(live, clock()) for live in self.shoes] if lsl else []
        self._lock = RLock()
        self.notes: deque[dict[str, Any]] = deque(maxlen=NOTES_KEPT)
        self.steps: deque[dict[str, Any]] = deque(maxlen=STEPS_KEPT)
        self.noted = self.stepped = 0
        self._sources = [
            Source(live, clock, self._taker(k), self._teller(k), self._failer(k)) for k, live in enumerate(self.shoes)
        ]

    def start(self) -> None:
        """Start recording and reading; streams without a clock of their own start together, by their own time stamps.

        Raises `UsageError` if the file exists already, or if a live shoe is asked for at another speed than 1.
        """
        firsts = [source.first_s() for source in self._sources]
        if self.pace.speed != 1.0 and None in firsts:
            raise UsageError("--speed is for replay: and sim: shoes: a live shoe goes at its own")
        if self._file is not None:
            self._begin_from_start(self._file)
        self.pace = Pace(self.pace.clock, self.pace.clock(), self.pace.speed)
        zero_s = min((first for first in firsts if first is not None), default=0.0)
        for source, first in zip(self._sources, firsts, strict=True):
            source.start(self.pace, None if first is None else zero_s)

    def close(self) -> None:
        """Stop reading, then recording; raises `InputError` if not all data could be written."""
        for source in self._sources:
            source.close()
        self._outlets = []
        self.stop_recording()

    def _taker(self, index: int) -> Callable[[Block], None]:
        """The function that takes in the blocks of one shoe."""
        live = self.shoes[index]

        def take(block: Block) -> None:
            force_n = live.forces.push(block)
            host_s = block.host_time_s
            times_s = np.full(len(block), self.pace.clock()) if host_s is None else host_s
            session_s = self.pace.of_host(times_s)
            if self._outlets:
                self._outlets[index].push(block, times_s, force_n)
            steps = live.take(block, session_s, force_n)
            with self._lock:
                if self.recording is None:
                    live.samples += len(block)
                else:
                    device_s = [] if len(self.shoes) == 1 else [block.time_s]
                    shown = block if len(self.shoes) == 1 else live.on_session_time(block, session_s)
                    self.recording.samples(index, shown, [*device_s, *force_n.values()])
                for side, step in steps:
                    self.stepped += 1
                    self.steps.append({"time_s": round(step.time_s, 4), "foot": side, "event": step.event})
            self.changed()

        return take

    def _teller(self, index: int) -> Callable[[ShoeEvent], None]:
        """The function that notes the events of one shoe."""

        def tell(event: ShoeEvent) -> None:
            live = self.shoes[index]
            live.lost += lost_in([event])
            self.note(event.kind, event.says, shoe=index, at_s=self.pace.of_host(event.host_time_s))

        return tell

    def _failer(self, index: int) -> Callable[[str], None]:
        """The function that notes that a shoe's reading has failed."""

        def fail(says: str) -> None:
            self.shoes[index].state = "failed"
            self.note("failed", says, shoe=index)

        return fail

    def now_s(self) -> float:
        """The time at the right edge of the traces: now, or that of the last sample once all shoes have ended."""
        now_s = self.pace.now_s()
        if any(live.state != "over" for live in self.shoes):
            return now_s
        return min(now_s, max(live.newest_s for live in self.shoes))

    def note(self, kind: str, says: str, *, shoe: int | None = None, at_s: float | None = None) -> dict[str, Any]:
        """Add a note, which every page shows, and write it to the recording if there is one."""
        now_s = self.pace.now_s() if at_s is None else at_s
        note: dict[str, Any] = {"time_s": round(now_s, 4), "kind": kind, "says": says, "shoe": shoe}
        with self._lock:
            note["device_time_s"] = [live.device_time_s(now_s) for live in self.shoes]
            self.noted += 1
            self.notes.append(note)
            if self.recording is not None:
                self.recording.note(note)
        self.changed()
        return note

    def news(self, noted: int, stepped: int) -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
        """The notes and steps after the first ``noted`` and ``stepped``, as far as they are still held."""
        with self._lock:
            notes, steps = self.noted - noted, self.stepped - stepped
            return (list(self.notes)[-notes:] if notes else []), (list(self.steps)[-steps:] if steps else [])

    def mark(self, word: str, age_s: float = 0.0) -> dict[str, Any]:
        """Add a mark at ``age_s`` before now, with a word that a person typed."""
        clean = " ".join("".join(c if c.isprintable() else " " for c in word).split())[:LONGEST_WORD] or "mark"
        return self.note("mark", clean, at_s=self.pace.now_s() - min(max(age_s, 0.0), LONGEST_AGE_S) * self.pace.speed)

    def set_zero(self) -> list[dict[str, Any]]:
        """Make what the unloaded units show their zero, foot by foot; returns a note for each foot."""
        notes = []
        for index, live in enumerate(self.shoes):
            for says, columns, zeros in zeros_of(live):
                if zeros is not None:
                    live.set_zero(columns, zeros)
                notes.append(self.note("zero" if zeros is not None else "no_zero", says, shoe=index))
        return notes

    def start_recording(self) -> Path:
        """Start recording and return the file; raises `UsageError` if it cannot be created."""
        if self.recording is not None:
            return self.recording.path
        stem = self._file or Path(f"live_{datetime.datetime.now():%Y%m%d_%H%M%S}.csv")
        path = recorder.free_path(stem, self._sides())
        self._record_to(path)
        self.note("recording", f"recording to {path.name}")
        return path

    def stop_recording(self) -> None:
        """End the recording, if there is one; raises `InputError` if not all data could be written."""
        if self.recording is None:
            return
        self.note("recorded", f"{self.recording.path.name} ends here")
        with self._lock:
            ended, self.recording = self.recording, None
        ended.close()
        self.recorded = f"{ended.path}: {ended.count} samples"
        self.changed()

    def _begin_from_start(self, record: Path) -> None:
        """Record from the start; after an interrupted recording show its notes and use a new file."""
        left = recorder.interrupted_at(record, self._sides())
        path = record
        if left is not None:
            path = recorder.free_path(record, self._sides())
            for note in left.notes:
                self.notes.append({**note, "before": True})
            self.noted += len(left.notes)
        self._record_to(path)
        if left is not None:
            self.note("resumed", f"{left.says}; this goes on in {path.name}")

    def _record_to(self, path: Path) -> None:
        """Start a recording with a table for each shoe."""
        several = len(self.shoes) > 1
        layouts = [
            recorder.Layout(
                table,
                (
                    *(f"{name}_{live.unit.suffix}" for name in live.names),
                    *(["device_time_s"] if several else []),
                    *(f"{name}_force_estimate_n" for name in live.forces.names),
                ),
                {
                    "shoe": str(live.shoe),
                    "sample_rate_hz": repr(live.rate_hz),
                    "recorded": datetime.datetime.now(datetime.UTC).isoformat(timespec="milliseconds"),
                },
            )
            for live, table in zip(self.shoes, recorder.table_paths(path, self._sides()), strict=True)
        ]
        made = recorder.LiveRecording(path, layouts, self._acknowledge, self._failed)
        with self._lock:
            self.recording = made

    def _sides(self) -> list[str]:
        return [live.side for live in self.shoes]

    def _acknowledge(self, shoe: int, count: int) -> None:
        with self._lock:
            self.shoes[shoe].samples += count

    def _failed(self, says: str) -> None:
        with self._lock:
            self.recording = None
        self.note("failed", says)

    def health(self, clients: int) -> dict[str, Any]:
        """The state of the session in schema smartshoe.live/1, with each shoe's own numbers."""
        first = self.shoes[0]
        recording = self.recording
        return {
            "schema": "smartshoe.live/1",
            "samples": sum(live.samples for live in self.shoes),
            "lost": sum(live.lost for live in self.shoes),
            "rate_hz": first.rate_hz,
            "clients": clients,
            "recording": None if recording is None else {"file": recording.path.name, "samples": recording.count},
            "clock": first.clock_dict(),
            "shoes": [{"shoe": str(live.shoe), **live.to_dict()} for live in self.shoes],
        }


def _calibrations_of(shoe: Shoe, calibrations: Sequence[Calibration]) -> list[Calibration]:
    """The calibrations of a shoe's units."""
    names = {channel.name for channel in shoe.describe()}
    return [calibration for calibration in calibrations if calibration.unit in names]


def _require_all_used(shoes: Sequence[LiveShoe], calibrations: Sequence[Calibration]) -> None:
    """Raise `UsageError` for a calibration that fits no unit of the shoes."""
    names = [name for live in shoes for name in live.names]
    for calibration in calibrations:
        if calibration.unit not in names:
            raise UsageError(
                f"the calibration of {calibration.unit or 'an unnamed unit'} fits no unit of the shoes: they have"
                f" {', '.join(names)}"
            )


def _require_distinct(shoes: Sequence[LiveShoe]) -> None:
    """Raise `UsageError` if two shoes have a unit of the same name."""
    seen: dict[str, LiveShoe] = {}
    for live in shoes:
        for name in live.names:
            if name in seen:
                raise UsageError(
                    f"{seen[name].url} and {live.url} both have a unit {name}: say the foot of each in its address,"
                    " with side=left and side=right"
                )
            seen[name] = live
