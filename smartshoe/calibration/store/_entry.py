"""What the store holds: calibrations of units, and events in the life of the units."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime, timedelta
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from smartshoe.calibration.store.dates import days_between, iso

if TYPE_CHECKING:
    from smartshoe.calibration import Calibration

EventKind = Literal["placed", "repaired", "retired"]
EVENT_KINDS: tuple[EventKind, ...] = ("placed", "repaired", "retired")


@dataclass(frozen=True, slots=True)
class Entry:
    """A stored calibration: its unit, its date, the unit's place, and how long it is valid.

    ``name`` is that of the file, without its suffix; ``order`` counts the calibrations of a unit as they were added,
    and decides between two of the same date. ``valid_for_days`` is None where no expiry was given.
    """

    name: str
    serial_number: str
    date: datetime
    position: str
    valid_for_days: float | None
    note: str
    order: int
    fingerprint: str
    path: Path

    @property
    def expires(self) -> datetime | None:
        """The last moment at which the calibration is valid; None without an expiry."""
        return None if self.valid_for_days is None else self.date + timedelta(days=self.valid_for_days)

    def is_expired(self, at: datetime) -> bool:
        """Whether ``at`` lies further from the calibration's date, before or after, than its validity."""
        return self.valid_for_days is not None and abs(days_between(self.date, at)) > self.valid_for_days

    def calibration(self) -> Calibration:
        """The calibration itself, read from its file; raises `InputError` where that is damaged."""
        from smartshoe.calibration import Calibration

        return Calibration.load(self.path)

    def to_dict(self) -> dict[str, Any]:
        """The entry without the calibration itself, for JSON."""
        expires = self.expires
        return {
            "name": self.name,
            "serial_number": self.serial_number,
            "date": iso(self.date),
            "position": self.position,
            "valid_for_days": self.valid_for_days,
            "expires": None if expires is None else iso(expires),
            "note": self.note,
            "order": self.order,
            "fingerprint": self.fingerprint,
            "path": str(self.path),
        }


@dataclass(frozen=True, slots=True)
class HistoryEvent:
    """An event in a unit's life: placed at a ``position`` (replacing any other unit there), repaired or retired."""

    kind: EventKind
    serial_number: str
    date: datetime
    position: str = ""
    note: str = ""
    order: int = 0

    def to_dict(self) -> dict[str, Any]:
        """The event for JSON."""
        return {
            "kind": self.kind,
            "serial_number": self.serial_number,
            "date": iso(self.date),
            "position": self.position,
            "note": self.note,
            "order": self.order,
        }

    @property
    def happened(self) -> str:
        """The event without its date, such as "placed at left_toe"."""
        return f"{self.kind} at {self.position}" if self.kind == "placed" else self.kind

    @property
    def says(self) -> str:
        """The event as one clause."""
        return f"{self.happened} on {iso(self.date)}" + (f" ({self.note})" if self.note else "")


@dataclass(frozen=True, slots=True)
class Found:
    """The result of a search for ``date``: the entry, and remarks about its age."""

    entry: Entry
    date: datetime
    says: str

    @property
    def is_expired(self) -> bool:
        """Whether the calibration is not valid at that date, any more or yet."""
        return self.entry.is_expired(self.date)

    @property
    def age_days(self) -> float:
        """Days from the calibration to the date, negative where the date is earlier."""
        return days_between(self.entry.date, self.date)

    def calibration(self) -> Calibration:
        """The calibration itself."""
        return self.entry.calibration()

    def to_dict(self) -> dict[str, Any]:
        """The result for JSON."""
        found: Mapping[str, Any] = self.entry.to_dict()
        return {**found, "age_days": self.age_days, "is_expired": self.is_expired, "says": self.says}
