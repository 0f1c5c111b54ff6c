"""`Journal`: an append-only file of records with checksums that survives a kill, a full disk and a power failure."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Self

from smartshoe.errors import FormatError, UsageError
from smartshoe.files.gate import read_bytes
from smartshoe.files.journal._appending import AppendedFile
from smartshoe.files.journal._records import LONGEST_PAYLOAD, OPENING, Record, packed, scan


@dataclass(frozen=True)
class Contents:
    """The content of a journal: its complete records, in order.

    ``torn_bytes`` at the end belong to a record that was being written when the writer stopped (and was not yet
    confirmed). ``damage`` are spans (start, stop) in bytes between complete records: a fault of the disk.
    """

    records: tuple[Record, ...]
    torn_bytes: int
    damage: tuple[tuple[int, int], ...] = ()

    @property
    def notes(self) -> tuple[str, ...]:
        """One sentence for everything that differs from what was written."""
        said = [f"{stop - start} bytes from byte {start} on are damaged and left out" for start, stop in self.damage]
        if self.torn_bytes:
            said.append(f"a record of {self.torn_bytes} bytes was cut short when the writer stopped and is left out")
        return tuple(said)


def read_journal(path: Path | str) -> Contents:
    """The journal's complete records; raises `InputError` if it cannot be read, `FormatError` if it is no journal."""
    path = Path(path)
    data = read_bytes(path)
    if len(data) < len(OPENING) and OPENING.startswith(data):
        return Contents((), len(data))  # the writer stopped while it created the file
    if not data.startswith(OPENING):
        raise FormatError(f"{path} is no journal (it begins with {data[:8]!r}): give one that a session wrote")
    records, damage = scan(data)
    torn = 0
    if damage and damage[-1][1] == len(data):
        start, stop = damage.pop()
        torn = stop - start
    return Contents(tuple(records), torn, tuple(damage))


class Journal:
    """A journal to append to; one writer at a time.

    Opening an existing one recovers it first: anything after the last complete record is cut off, everything before it
    is kept. ``recovered`` is its content.
    """

    def __init__(self, path: Path | str) -> None:
        self.path = Path(path)
        self._file = AppendedFile(self.path)
        try:
            if not self._file.lock():
                raise UsageError(f"{self.path} is being written by another session: wait for it to end, or end it")
            self.recovered = read_journal(self.path)
            self._file.cut(self._file.size - self.recovered.torn_bytes)
            if self._file.size == 0:
                self._file.append(OPENING)
        except BaseException:
            self._file.close()
            raise

    def clear(self) -> None:
        """Delete every recovered record and start the journal anew."""
        self._file.cut(0)
        self._file.append(OPENING)
        self.recovered = Contents((), 0)

    def append(self, kind: int, payload: bytes, *, synced: bool = True) -> None:
        """Append a record; it is on disk on return (``synced`` False: it survives a kill, but not a power failure).

        Raises `InputError` where the disk is full.
        """
        if not 0 <= kind <= 255 or len(payload) > LONGEST_PAYLOAD:
            raise UsageError(f"a record of kind {kind} and {len(payload)} bytes cannot be written: split it")
        self._file.append(packed(kind, payload), synced=synced)

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self.close()
