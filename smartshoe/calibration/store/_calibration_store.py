"""`CalibrationStore`: all calibrations of all units, and the events in the units' lives."""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from dataclasses import replace
from datetime import date, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from smartshoe.calibration.store import _files as files
from smartshoe.calibration.store._entry import Entry, EventKind, Found, HistoryEvent
from smartshoe.calibration.store.dates import days_between, iso, moment
from smartshoe.errors import InputError, RefusedError, UsageError

if TYPE_CHECKING:
    from smartshoe.calibration import Calibration

VARIABLE = "SMARTSHOE_STORE"
SCHEMA = "smartshoe.calibrations/1"
When = str | date | datetime


def default_folder() -> Path:
    """$SMARTSHOE_STORE where it is set, else ``calibrations`` in the user's data folder."""
    said = os.environ.get(VARIABLE)
    if said:
        return Path(said)
    from platformdirs import user_data_path

    return user_data_path("smartshoe", appauthor=False) / "calibrations"


def is_store(folder: Path | str) -> bool:
    """Whether a folder is a store, where each unit has its own folder, rather than a folder of calibration files."""
    return (Path(folder) / files.UNITS).is_dir()


class CalibrationStore:
    """Calibrations in a folder of plain files, which are read again at each query.

    Dates are ISO strings, dates or datetimes (UTC unless stated). Nothing is overwritten or removed. Several processes
    may add and read at once. ``faults`` says for each unusable file why.
    """

    def __init__(self, folder: Path | str | None = None) -> None:
        self.folder = default_folder() if folder is None else Path(folder)
        if self.folder.exists() and not self.folder.is_dir():
            raise UsageError(f"{self.folder} is a file: give a folder with --store")
        self.faults: tuple[str, ...] = ()

    def __str__(self) -> str:
        return str(self.folder)

    # -- adding ------------------------------------------------------------------------------------------------
    def add(
        self,
        calibration: Calibration,
        *,
        serial_number: str | None = None,
        date: When | None = None,
        position: str | None = None,
        valid_for_days: float | None = None,
        note: str = "",
    ) -> Entry:
        """Store ``calibration`` and return its entry; adding the same one twice stores it once.

        Arguments that are not given default to the calibration's own ``serial_number``, ``created`` and ``unit``.
        Raises `UsageError` where serial number or date is missing, where they contradict, or where the calibration is
        already stored with another validity or note.
        """
        serial = calibration.serial_number or (serial_number or "")
        if serial_number and serial != serial_number:
            raise UsageError(
                f"the calibration says serial number {serial!r}, not {serial_number!r}: leave --serial-number out, or"
                " give the other unit's file"
            )
        files.folder_name(serial)
        if date is None and not calibration.created:
            raise UsageError(f"the calibration of {serial} has no date: give one with --date")
        at = moment(date if date is not None else calibration.created, f"the date of {serial}'s calibration")
        if valid_for_days is not None and not (math.isfinite(valid_for_days) and valid_for_days > 0.0):
            raise UsageError(f"valid for {valid_for_days:g} days: give a number above 0, or none")
        where = calibration.unit if position is None else position
        created = calibration.created or iso(at)
        stored = replace(calibration, serial_number=serial, unit=where, created=created).to_dict()
        history = self.history(serial)
        same = [entry for entry in history if entry.fingerprint == files.fingerprint(stored)]
        said = (at, valid_for_days, note)
        for entry in same:
            if (entry.date, entry.valid_for_days, entry.note) == said:
                return entry
        if same:
            raise UsageError(
                f"this calibration of {serial} is in the store already, as {same[0].name} with another date, validity"
                " or note: nothing is overwritten there"
            )
        about = {
            "serial_number": serial,
            "date": iso(at),
            "position": where,
            "valid_for_days": None if valid_for_days is None else float(valid_for_days),
            "note": note,
            "order": 1 + max((entry.order for entry in history), default=0),
        }
        path = files.write_calibration(self.folder, stored, about)
        return files.entry_of(self.folder, path.relative_to(self.folder).as_posix(), {
            **about, "fingerprint": files.fingerprint(stored)
        })  # fmt: skip

    def place(self, serial_number: str, position: str, date: When, note: str = "") -> HistoryEvent:
        """Record that from ``date`` on the unit sits at ``position`` ("left_toe"), in place of any other unit."""
        if not position.strip():
            raise UsageError("no position is given: name where the unit sits, for example left_toe")
        if not position.isprintable():
            raise UsageError(f"position {position!r} holds what cannot be printed: name it like left_toe")
        return self._happened("placed", serial_number, date, position, note)

    def repair(self, serial_number: str, date: When, note: str = "") -> HistoryEvent:
        """Record a repair of the unit: calibrations from before are not valid after it, nor the other way round."""
        return self._happened("repaired", serial_number, date, "", note)

    def retire(self, serial_number: str, date: When, note: str = "") -> HistoryEvent:
        """Record that the unit is out of use from ``date`` on."""
        return self._happened("retired", serial_number, date, "", note)

    def _happened(self, kind: EventKind, serial_number: str, at: When, position: str, note: str) -> HistoryEvent:
        before = [event for event in self.events(serial_number) if event.kind == kind]
        event = HistoryEvent(kind, serial_number, moment(at), position.strip(), note)
        for other in before:
            if replace(other, order=0) == event:
                return other
        numbered = replace(event, order=1 + max((other.order for other in self.events()), default=0))
        files.write_event(self.folder, numbered)
        return numbered

    # -- contents ----------------------------------------------------------------------------------------------
    def _read(self) -> tuple[list[Entry], list[HistoryEvent]]:
        """Every entry and event; files that the index lacks, or that differ from it, are read and indexed."""
        now = files.listing(self.folder)
        known = files.read_index(self.folder)
        items: dict[str, Any] = {}
        faults: list[str] = []
        entries: list[Entry] = []
        events: list[HistoryEvent] = []
        for relative, state in now.items():
            try:
                item, made = files.made_of(self.folder, relative, state, known.get(relative))
            except InputError as error:
                faults.append(str(error))
                continue
            if isinstance(made, Entry):
                entries.append(made)
            else:
                events.append(made)
            items[relative] = {"state": list(state), "item": item}
        if items != known and now:
            faults += filter(None, [files.write_index(self.folder, items)])
        self.faults = tuple(faults)
        entries.sort(key=lambda entry: (entry.serial_number, entry.date, entry.order, entry.name))
        events.sort(key=lambda event: (event.date, event.order))
        return entries, events

    def entries(self) -> tuple[Entry, ...]:
        """Every calibration, by serial number and date."""
        return tuple(self._read()[0])

    def events(self, serial_number: str | None = None) -> tuple[HistoryEvent, ...]:
        """Every event, or those of one unit, by date."""
        return tuple(e for e in self._read()[1] if serial_number is None or e.serial_number == serial_number)

    @property
    def serial_numbers(self) -> tuple[str, ...]:
        """The serial numbers of all units with a calibration or an event."""
        entries, events = self._read()
        return tuple(sorted({e.serial_number for e in entries} | {e.serial_number for e in events}))

    def to_dict(self, date: When, unit: str | None = None) -> dict[str, Any]:
        """The object that ``smartshoe calibrations list --json`` writes, schema smartshoe.calibrations/1.

        Places and expiry are those at ``date``; ``unit``, a serial number or a place, restricts the list to it.
        """
        at = moment(date, "--date")
        entries, events = self._read()
        serials: Sequence[str] = sorted({e.serial_number for e in entries} | {e.serial_number for e in events})
        if unit is not None:
            wanted = unit if unit in serials else self.unit_at(unit, at)
            serials = [serial for serial in serials if serial == wanted]
        return {
            "schema": SCHEMA,
            "store": str(self),
            "date": iso(at),
            "units": [
                {
                    "serial_number": serial,
                    "position": self.position_of(serial, at),
                    "calibrations": [
                        {**entry.to_dict(), "is_expired": entry.is_expired(at)}
                        for entry in entries
                        if entry.serial_number == serial
                    ],
                    "events": [event.to_dict() for event in events if event.serial_number == serial],
                }
                for serial in serials
            ],
        }

    def history(self, serial_number: str) -> tuple[Entry, ...]:
        """The calibrations of a unit by date, () where there is none; two of one date in the order they were added."""
        return tuple(entry for entry in self._read()[0] if entry.serial_number == serial_number)

    def entry(self, name: str) -> Entry:
        """The calibration whose name begins with ``name``; raises `UsageError` where none or more than one does."""
        found = [entry for entry in self._read()[0] if entry.name.startswith(name) or _hash(entry).startswith(name)]
        if len(found) != 1:
            many = f"names {len(found)} calibrations" if found else "is no calibration"
            raise UsageError(f"{name!r} {many} in {self}: take a name from smartshoe calibrations list")
        return found[0]

    # -- queries -----------------------------------------------------------------------------------------------
    def latest(self, serial_number: str) -> Entry:
        """The unit's last calibration, regardless of later events; raises `UsageError` where there is none."""
        history = self.history(serial_number)
        if not history:
            raise UsageError(self._unknown(serial_number))
        return history[-1]

    def nearest(self, serial_number: str, date: When, *, refuse_expired: bool = False) -> Found:
        """The calibration nearest in time to ``date`` with no repair in between; the earlier one of two equally near.

        Raises `UsageError` where the unit is not known, `RefusedError` where it was retired by then or no calibration
        lies between the same repairs, and, with ``refuse_expired``, where the one found has expired.
        """
        at = moment(date)
        entries, all_events = self._read()
        history = [entry for entry in entries if entry.serial_number == serial_number]
        events = [event for event in all_events if event.serial_number == serial_number]
        if not history:
            raise UsageError(self._unknown(serial_number))
        for event in events:
            if event.kind == "retired" and event.date <= at and not _back_in_use(event, events, at):
                raise RefusedError(f"unit {serial_number} was {event.says}: use the unit that took its place")
        since, until = segment(events, at)
        fitting = [e for e in history if (since is None or e.date >= since) and (until is None or e.date < until)]
        if not fitting:
            bounds = (("since", since), ("before", until))
            said = " and ".join(f"{word} its repair on {iso(when)}" for word, when in bounds if when is not None)
            raise RefusedError(f"unit {serial_number} has no calibration {said}: calibrate it")
        # Of two calibrations with the same date, the one added last counts.
        best = min(fitting, key=lambda e: (abs(days_between(e.date, at)), e.date, -e.order))
        found = Found(best, at, _says(best, at))
        if refuse_expired and found.is_expired:
            raise RefusedError(f"{found.says}: calibrate the unit anew, or allow expired calibrations")
        return found

    def position_of(self, serial_number: str, date: When) -> str:
        """The place of a unit at ``date``, '' where that is not known or another unit has taken the place."""
        at = moment(date)
        entries, events = self._read()
        placed = [e for e in events if e.kind == "placed" and e.date <= at]
        own = [e for e in placed if e.serial_number == serial_number]
        if own:
            later = placed[placed.index(own[-1]) + 1 :]
            return "" if any(e.position == own[-1].position for e in later) else own[-1].position
        said = [e.position for e in entries if e.serial_number == serial_number and e.date <= at and e.position]
        if not said or any(e.position == said[-1] for e in placed):
            return ""
        return said[-1]

    def unit_at(self, position: str, date: When) -> str:
        """The serial number of the unit that sits at ``position`` at ``date``.

        Recorded placements decide; before the first one, the only unit whose calibrations name the position. Raises
        `UsageError` where there is none, `RefusedError` where several are possible.
        """
        at = moment(date)
        entries, events = self._read()
        placed = [event for event in events if event.kind == "placed"]
        here = [event for event in placed if event.position == position and event.date <= at]
        if here:
            serial = here[-1].serial_number
            gone = [e for e in placed if e.serial_number == serial and e.date <= at][-1]
            if gone.position != position:
                raise RefusedError(
                    f"unit {serial} left {position} for {gone.position} on {iso(gone.date)} and none was entered in its"
                    " place: enter one with smartshoe calibrations swap"
                )
            return serial
        elsewhere = {event.serial_number for event in placed}
        claims = {entry.serial_number for entry in entries if entry.position == position}
        rest = sorted(claims - elsewhere) or sorted(claims if len(claims) == 1 else ())
        if not rest:
            raise UsageError(
                f"{position!r} is neither a unit of {self} nor a place at which one is known to sit on {iso(at)}: see"
                " smartshoe calibrations list, or enter it with smartshoe calibrations swap"
            )
        if len(rest) > 1:
            raise RefusedError(
                f"{len(rest)} units claim {position} ({', '.join(rest)}): say which sits there with"
                f" smartshoe calibrations swap {position} SERIAL --date"
            )
        return rest[0]

    def _unknown(self, serial_number: str) -> str:
        known = self.serial_numbers
        there = f"it has {', '.join(known[:8])}{', ...' if len(known) > 8 else ''}" if known else "it is empty"
        return f"no calibration of unit {serial_number!r} in {self} ({there}): add one with smartshoe calibrations add"


def _hash(entry: Entry) -> str:
    return entry.name.rpartition("_")[2]


def _back_in_use(retired: HistoryEvent, events: list[HistoryEvent], at: datetime) -> bool:
    return any(e.kind == "placed" and retired.date < e.date <= at for e in events)


def segment(events: Sequence[HistoryEvent], at: datetime) -> tuple[datetime | None, datetime | None]:
    """The last repair up to ``at`` and the first one after it among a unit's ``events``; None where there is none."""
    repairs = sorted(event.date for event in events if event.kind == "repaired")
    return (
        max((repair for repair in repairs if repair <= at), default=None),
        min((repair for repair in repairs if repair > at), default=None),
    )


def _says(entry: Entry, at: datetime) -> str:
    days = (at.date() - entry.date.date()).days
    size = f"{abs(days)} day{'s' * (abs(days) > 1)}"
    when = f"{size} {'before' if days > 0 else 'after'} that" if days else "of the same day"
    said = f"calibration {entry.name} of unit {entry.serial_number}, {when}"
    if entry.is_expired(at):
        said += f", has expired: it holds for {entry.valid_for_days:g} days"
    return said


def find(store: CalibrationStore, unit: str, date: When, *, refuse_expired: bool = False) -> Found:
    """The calibration to use at ``date`` for ``unit``, which is a serial number or else a position ("left_toe").

    Raises the errors of `CalibrationStore.nearest` and `CalibrationStore.unit_at`.
    """
    serial = unit if unit in store.serial_numbers else store.unit_at(unit, date)
    return store.nearest(serial, date, refuse_expired=refuse_expired)
