"""`AppendedFile`: pieces are appended to a file completely and on disk, or not at all."""

from __future__ import annotations

import os
from pathlib import Path
from types import TracebackType
from typing import Self

from smartshoe.errors import InputError, UsageError
from smartshoe.files.atomic import sync_folder


class AppendedFile:
    """A file that only grows; not for several writers at once.

    `append` returns when the piece is on disk (``fdatasync`` after each piece). With ``synced`` False the piece is only
    handed to the operating system until the next synced one: it survives a kill, but not a power failure. Where the
    disk is full, a partly written piece is cut off again, so that the file ends with the last complete one.
    """

    def __init__(self, path: Path | str, *, new: bool = False) -> None:
        """Open ``path`` for appending; ``new`` raises `UsageError` where it already exists."""
        self.path = Path(path)
        flags = os.O_WRONLY | os.O_APPEND | os.O_CREAT | (os.O_EXCL if new else 0) | getattr(os, "O_BINARY", 0)
        try:
            self._handle: int | None = os.open(self.path, flags, 0o666)
        except FileExistsError as error:
            raise UsageError(f"{self.path} is there already and is not overwritten: choose another name") from error
        except OSError as error:
            raise UsageError(
                f"{self.path} cannot be written ({error.strerror}): choose a folder that exists and is writable"
            ) from error
        self.size = os.fstat(self._handle).st_size
        if self.size == 0:  # just created, or by a writer whose sync of the name a power failure prevented
            sync_folder(self.path.parent)

    def append(self, piece: bytes, *, synced: bool = True) -> None:
        """Append ``piece``; raises `InputError`, with nothing half-written, where the disk does not accept it."""
        if self._handle is None:
            raise UsageError(f"{self.path} is closed: open it anew to append")
        done = 0
        try:
            while done < len(piece):
                done += os.write(self._handle, memoryview(piece)[done:])
            if synced:
                _data_to_disk(self._handle)
        except BaseException as error:
            if done < len(piece) or isinstance(error, OSError):
                size, self.size = self.size, self.size + done
                self.cut(size)
            else:
                self.size += done
            if not isinstance(error, OSError):  # Ctrl-C
                raise
            raise InputError(
                f"{self.path} takes no more data ({error.strerror}): free some space; what was recorded before is kept"
            ) from error
        self.size += len(piece)

    def cut(self, size: int) -> None:
        """Shorten the file to ``size`` bytes; raises `InputError` where the disk refuses."""
        if self._handle is None or size == self.size:
            return
        try:
            os.ftruncate(self._handle, size)
        except OSError as error:
            raise InputError(f"{self.path} cannot be repaired ({error.strerror}): make it writable") from error
        self.size = size

    def lock(self) -> bool:
        """Lock out other writers until the file is closed; False where another one holds the lock."""
        try:
            import fcntl
        except ImportError:  # Windows lacks these locks
            return True
        if self._handle is None:
            return False
        try:
            fcntl.flock(self._handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            return False
        return True

    def close(self) -> None:
        """Close the file; appended pieces are kept."""
        if self._handle is not None:
            handle, self._handle = self._handle, None
            os.close(handle)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self.close()


def _data_to_disk(handle: int) -> None:
    # Not every platform has fdatasync; fsync also writes the times, which costs more.
    getattr(os, "fdatasync", os.fsync)(handle)
