"""`SessionFolder`: all data of a session on disk, so that it can be resumed after a crash and analysed again.

``session.json`` is the plan, ``journal.smj`` holds every sample and event (`smartshoe.files.journal`), ``raw/`` the
machine's logs as they came. Results lie next to them and follow from these three alone.
"""

from __future__ import annotations

import hashlib
import json
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal, Self

import numpy as np

from smartshoe.devices import Block, ChannelDescription, Shoe
from smartshoe.devices.serial_link.inbox import joined
from smartshoe.errors import InputError, SmartShoeError, UsageError
from smartshoe.files.atomic import json_text, make_folder, replacing, write_text
from smartshoe.files.gate import foreign_code, inside, parsed_json, read_bytes, read_text
from smartshoe.files.journal import Journal, Record, read_journal
from smartshoe.files.logs import read, write
from smartshoe.recording import Channel, Recording
from smartshoe.runs.session import _samples as samples
from smartshoe.runs.session._plan import SessionPlan
from smartshoe.units import Unit, declared, find_unit

EVENT, SAMPLES = 1, 2
PLAN, JOURNAL, RAW = "session.json", "journal.smj", "raw"
State = Literal["open", "accepted", "rejected"]


@dataclass(eq=False)
class Attempt:
    """One pressing of an experiment: the shoe's blocks, the machine's log, and the faults that were found."""

    experiment: str
    number: int
    channels: tuple[ChannelDescription, ...]
    blocks: list[Block] = field(default_factory=list)
    log: Path | None = None
    source: str = ""
    columns: dict[str, Any] = field(default_factory=dict)
    state: State = "open"
    findings: list[dict[str, Any]] = field(default_factory=list)
    events: list[dict[str, Any]] = field(default_factory=list)

    @property
    def samples(self) -> int:
        """Number of samples of the shoe."""
        return sum(len(block) for block in self.blocks)

    def stream(self) -> Recording:
        """All units' readings as one recording; raises `InputError` if there are none."""
        blocks = [block for block in self.blocks if len(block)]
        if not blocks:
            raise InputError(f"{self.experiment}, attempt {self.number} holds no samples: press it again")
        whole = joined(blocks)
        readings = np.where(whole.missing, np.nan, whole.readings)
        channels = {}
        for column, channel in enumerate(self.channels):
            made = Channel.from_values(channel.name, readings[:, column], whole.unit, "sensor")
            channels[channel.name] = _with_instrument(made, channel)
        return Recording(whole.time_s, channels, name=self.experiment)

    def load(self) -> Recording:
        """The machine's log: load and other channels, without any reading of a unit."""
        if self.log is None:
            raise InputError(f"{self.experiment}, attempt {self.number} has no machine's log: press it again")
        found = read(self.log, partly=True, **self.columns)
        own = found.without(*(channel.name for channel in found.sensors))
        return replace(own, source=self.source or own.source)


def _with_instrument(channel: Channel, described: ChannelDescription) -> Channel:
    return replace(channel, range_=described.range_, resolution=described.resolution)


@contextmanager
def writing_to_disk(what: Path) -> Iterator[None]:
    """Turn an error of the disk within the block into an `InputError`; what was written before is not affected."""
    try:
        yield
    except (OSError, UsageError) as error:
        cause = error.__cause__ if isinstance(error, SmartShoeError) else error
        if not isinstance(cause, OSError):
            raise
        raise InputError(
            f"{what} takes no more data ({cause.strerror}): free some space; what was recorded before is kept"
        ) from error


class SessionFolder:
    """A session's folder, opened for writing (`begin`, `resume`) or only for reading (`open`)."""

    def __init__(self, path: Path, plan: SessionPlan, journal: Journal | None) -> None:
        self.path, self.plan = path, plan
        self._journal = journal
        self.channels: tuple[ChannelDescription, ...] = ()
        self.notes: tuple[str, ...] = journal.recovered.notes if journal is not None else ()

    # -- opening -----------------------------------------------------------------------------------------------
    @classmethod
    def begin(cls, path: Path | str, plan: SessionPlan) -> Self:
        """Start a new session; raises `UsageError` if the folder already holds one with recorded samples."""
        folder = make_folder(path)
        make_folder(folder / RAW)
        # Take the journal's lock first: its holder may be recording into this very file at the moment.
        journal = Journal(folder / JOURNAL)
        try:
            if any(record.kind == SAMPLES for record in journal.recovered.records):
                raise UsageError(
                    f"{folder} holds a session already: go on with --resume {folder}, or choose another --out"
                )
            journal.clear()
            write_text(folder / PLAN, json_text(plan.to_dict()))
        except BaseException:
            journal.close()
            raise
        return cls(folder, plan, journal)

    @classmethod
    def resume(cls, path: Path | str) -> Self:
        """Reopen a session for writing; its journal is recovered up to the last complete record."""
        folder = Path(path)
        plan = _plan_of(folder)
        make_folder(folder / RAW)
        return cls(folder, plan, Journal(folder / JOURNAL))

    @classmethod
    def open(cls, path: Path | str) -> Self:
        """Open a session for reading only; raises `InputError` if its journal cannot be read."""
        found = cls(Path(path), _plan_of(Path(path)), None)
        found.notes = read_journal(found.path / JOURNAL).notes
        return found

    def close(self) -> None:
        """Close the journal."""
        if self._journal is not None:
            self._journal.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    # -- writing -----------------------------------------------------------------------------------------------
    def note(self, event: str, **facts: Any) -> None:
        """Append an event; it is on disk when this returns."""
        self._append(EVENT, json.dumps({"event": event, **facts}, allow_nan=False).encode())

    def note_stream(self, shoe: Shoe) -> None:
        """Append a description of the stream that follows: its channels and the shoe's firmware."""
        channels = [
            {
                "name": c.name,
                "unit": c.unit.symbol,
                "range": None if c.range_ is None else list(c.range_),
                "resolution": c.resolution,
                "rate_hz": c.rate_hz,
            }
            for c in shoe.describe()
        ]
        self.channels = shoe.describe()
        said = getattr(shoe, "information", None)  # what a live shoe's firmware reports
        self.note("stream", shoe=str(shoe), channels=channels, information=None if said is None else str(said))

    def keep(self, block: Block) -> None:
        """Append a block of samples; that of a live shoe is on disk when this returns.

        Samples with a virtual clock can be produced again: they survive a kill at once, a power failure only after the
        next event.
        """
        self._append(SAMPLES, samples.packed(block), synced=block.arrival_s is not None)

    def keep_log(self, log: Recording | Path, name: str, columns: dict[str, Any]) -> None:
        """Store the machine's log below ``raw/`` (a file is copied byte by byte) and append an event about it."""
        target = self.path / RAW / f"{name}{log.suffix if isinstance(log, Path) else '.csv'}"
        with writing_to_disk(target):
            if isinstance(log, Path):
                with replacing(target) as temporary:
                    shutil.copyfile(log, temporary)
            else:
                write(log, target)
        self.note("log", file=f"{RAW}/{target.name}", sha256=_sha256(target), columns=columns,
                  source=str(log) if isinstance(log, Path) else log.label)  # fmt: skip

    def _append(self, kind: int, payload: bytes, *, synced: bool = True) -> None:
        if self._journal is None:
            raise UsageError(f"{self.path} was opened to be read: resume the session to write")
        self._journal.append(kind, payload, synced=synced)

    # -- reading -----------------------------------------------------------------------------------------------
    def attempts(self) -> list[Attempt]:
        """All pressings so far, oldest first; raises `InputError` if the journal is not valid."""
        contents = read_journal(self.path / JOURNAL)
        with foreign_code(self.path / JOURNAL, "session's journal", "restore it from a copy"):
            return list(self._attempts(iter(contents.records)))

    def _attempts(self, records: Iterator[Record]) -> Iterator[Attempt]:
        channels: tuple[ChannelDescription, ...] = ()
        attempt: Attempt | None = None
        for record in records:
            if record.kind == SAMPLES:
                if attempt is not None and attempt.state == "open":
                    names = tuple(channel.name for channel in channels)
                    attempt.blocks.append(samples.unpacked(record.payload, names, channels[0].unit))
                continue
            said = parsed_json(record.payload)
            event = said["event"]
            if event == "stream":
                channels = tuple(_channel(item) for item in said["channels"])
            elif event == "begin":
                if attempt is not None:
                    yield attempt
                attempt = Attempt(str(said["experiment"]), int(said["attempt"]), channels)
            elif attempt is not None and event == "log":
                attempt.log, attempt.source = self._checked(said), str(said["source"])
                attempt.columns = {
                    key: str(said["columns"][key]) for key in ("time", "force") if key in said["columns"]
                }
            elif attempt is not None and event in ("accepted", "rejected"):
                attempt.state, attempt.findings = event, [dict(finding) for finding in said["findings"]]
            elif attempt is not None and event == "shoe":
                attempt.events.append(said)
        if attempt is not None:
            yield attempt

    def _checked(self, said: dict[str, Any]) -> Path:
        path = inside(self.path, str(said["file"]), self.path / JOURNAL)
        if _sha256(path) != said["sha256"]:
            raise InputError(f"{path} is not the file that the session recorded (its sha256 differs): restore it")
        return path

    def accepted(self) -> dict[str, Attempt]:
        """The accepted pressing of each experiment that is done."""
        return {attempt.experiment: attempt for attempt in self.attempts() if attempt.state == "accepted"}


def _plan_of(folder: Path) -> SessionPlan:
    file = folder / PLAN
    try:
        found = parsed_json(read_text(file, "a session's plan"))
    except InputError as error:
        if file.is_file():
            raise
        raise UsageError(f"{folder} holds no session ({error}): give the --out of one") from error
    except ValueError as error:
        raise InputError(f"{file} is damaged ({error}): restore it from a copy") from error
    return SessionPlan.from_dict(found, str(file))


def _channel(item: dict[str, Any]) -> ChannelDescription:
    unit: Unit = find_unit(item["unit"]) or declared(item["unit"])
    range_ = None if item["range"] is None else (float(item["range"][0]), float(item["range"][1]))
    resolution = None if item["resolution"] is None else float(item["resolution"])
    return ChannelDescription(str(item["name"]), unit.quantity, unit, range_, resolution, float(item["rate_hz"]))


def _sha256(path: Path) -> str:
    try:
        return hashlib.sha256(read_bytes(path)).hexdigest()
    except InputError as error:
        raise InputError(f"{error}; restore the session's raw files") from error
