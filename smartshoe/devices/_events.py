"""Events of a live stream besides samples: gaps, silences, reconnections, dropped samples; each as one sentence."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from threading import Lock
from typing import Any, ClassVar


@dataclass(frozen=True, slots=True)
class ShoeEvent:
    """An event of a live stream; ``host_time_s`` is when the host noticed it, by `time.perf_counter`."""

    kind: ClassVar[str] = "event"
    host_time_s: float

    @property
    def says(self) -> str:
        """The event as one sentence for the user."""
        return self.kind

    def to_dict(self) -> dict[str, Any]:
        """The event as a JSON object: ``kind``, the fields of that kind, and the sentence ``says``."""
        return {"kind": self.kind, **asdict(self), "says": self.says}


@dataclass(frozen=True, slots=True)
class Gap(ShoeEvent):
    """``lost`` samples that the device took between ``from_s`` and ``to_s`` (device time) never arrived."""

    kind: ClassVar[str] = "gap"
    lost: int
    from_s: float
    to_s: float

    @property
    def says(self) -> str:
        """The event as one sentence for the user."""
        return f"{self.lost} sample{'s' * (self.lost != 1)} lost between {self.from_s:.3f} and {self.to_s:.3f} s"


@dataclass(frozen=True, slots=True)
class Silence(ShoeEvent):
    """No valid frame has arrived for ``silent_s``."""

    kind: ClassVar[str] = "silence"
    silent_s: float

    @property
    def says(self) -> str:
        """The event as one sentence for the user."""
        return f"no valid frame for {self.silent_s:.1f} s"


@dataclass(frozen=True, slots=True)
class Disconnected(ShoeEvent):
    """The port was closed and will be reopened; ``reason`` is the message of the operating system or the watchdog."""

    kind: ClassVar[str] = "disconnected"
    reason: str

    @property
    def says(self) -> str:
        """The event as one sentence for the user."""
        return f"connection lost ({self.reason})"


@dataclass(frozen=True, slots=True)
class Reconnected(ShoeEvent):
    """Valid frames arrive again, ``away_s`` after the last one; the port had to be opened ``attempts`` times."""

    kind: ClassVar[str] = "reconnected"
    away_s: float
    attempts: int

    @property
    def says(self) -> str:
        """The event as one sentence for the user."""
        return f"connected again after {self.away_s:.1f} s, at attempt {self.attempts}"


@dataclass(frozen=True, slots=True)
class Restarted(ShoeEvent):
    """The device restarted its clock; the stream's time continues at ``resumes_s``, derived from the host's clock."""

    kind: ClassVar[str] = "restarted"
    resumes_s: float

    @property
    def says(self) -> str:
        """The event as one sentence for the user."""
        return f"the shoe restarted; its time goes on at {self.resumes_s:.3f} s"


@dataclass(frozen=True, slots=True)
class Dropped(ShoeEvent):
    """``samples`` that arrived between ``from_s`` and ``to_s`` (device time) were discarded, since nobody read them."""

    kind: ClassVar[str] = "dropped"
    samples: int
    from_s: float
    to_s: float

    @property
    def says(self) -> str:
        """The event as one sentence for the user."""
        return (
            f"{self.samples} samples between {self.from_s:.3f} and {self.to_s:.3f} s dropped:"
            " they were not read in time"
        )


@dataclass(frozen=True, slots=True)
class ToldLate(ShoeEvent):
    """The device's information arrived after readings had already been given out as counts; they stay counts."""

    kind: ClassVar[str] = "told_late"
    serial_number: str

    @property
    def says(self) -> str:
        """The event as one sentence for the user."""
        return f"shoe {self.serial_number} said its units only now: readings stay counts until it is opened again"


class EventLog:
    """Events in order of time, added from any thread; beyond ``limit`` they are only counted."""

    def __init__(self, limit: int = 100_000) -> None:
        self._limit = limit
        self._lock = Lock()
        self._kept: list[ShoeEvent] = []
        self.surplus = 0

    def add(self, *events: ShoeEvent) -> None:
        """Append ``events``."""
        with self._lock:
            room = self._limit - len(self._kept)
            self._kept.extend(events[: max(room, 0)])
            self.surplus += max(len(events) - max(room, 0), 0)

    def all(self) -> tuple[ShoeEvent, ...]:
        """Every stored event, oldest first."""
        with self._lock:
            return tuple(self._kept)
