"""Records shoes: a plain table for each and a journal of notes, written by a thread of its own, valid at any moment.

Every sample goes to ``FILE`` (with two shoes ``FILE_left`` and ``FILE_right``, or ``_1`` and ``_2``), every mark, zero
and event of a shoe to ``FILE.smj`` next to it. What was acknowledged is on disk and survives a kill or a power failure.
"""

from __future__ import annotations

import json
import queue
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from smartshoe.arrays import Array
from smartshoe.devices import Block
from smartshoe.errors import InputError, SmartShoeError, UsageError
from smartshoe.files.journal import AppendedFile, Journal, read_journal

NOTE, END = 1, 2
WRITE_EVERY_S = 0.1
MOST_WAITING = 20_000  # in pieces: covers minutes during which the disk does not respond
JOURNAL = ".smj"


@dataclass(frozen=True)
class Layout:
    """A shoe's table: its file, its columns ``name_unit`` after the time, and its facts for ``# key: value`` lines."""

    path: Path
    columns: tuple[str, ...]
    facts: Mapping[str, str]


@dataclass
class Interrupted:
    """A recording that was cut short: its notes, and a sentence that says so."""

    path: Path
    notes: list[dict[str, Any]] = field(default_factory=list)

    @property
    def says(self) -> str:
        """The interruption in one sentence for a person."""
        return f"the recording {self.path.name} was interrupted; all that was acknowledged is in it"


def table_paths(path: Path, sides: Sequence[str]) -> list[Path]:
    """A file for each shoe: ``path`` itself for one shoe, with the side or a number in its name for several."""
    if len(sides) == 1:
        return [path]
    names = sides if all(sides) and len(set(sides)) == len(sides) else [str(k + 1) for k in range(len(sides))]
    return [path.with_name(f"{path.stem}_{side}{path.suffix}") for side in names]


def journal_path(path: Path) -> Path:
    """The path of the journal next to a recording."""
    return path.with_name(path.name + JOURNAL)


def is_taken(path: Path, sides: Sequence[str]) -> bool:
    """Whether a file of the recording ``path`` exists already."""
    return any(p.exists() for p in [journal_path(path), *table_paths(path, sides)])


def free_path(path: Path, sides: Sequence[str]) -> Path:
    """``path``, or the first of ``path_2``, ``path_3``, ... for which no file exists."""
    number, found = 1, path
    while is_taken(found, sides):
        number += 1
        found = path.with_name(f"{path.stem}_{number}{path.suffix}")
    return found


def interrupted_at(path: Path, sides: Sequence[str]) -> Interrupted | None:
    """What a killed session left at ``path``; its tables are cut to whole rows. None if there is nothing.

    Raises `UsageError` if the recording there was ended properly, or if the file there is not a recording.
    """
    if not is_taken(path, sides):
        return None
    beside = journal_path(path)
    records = read_journal(beside).records if beside.exists() else ()
    if not beside.exists() or any(record.kind == END for record in records):
        raise UsageError(f"{path} is there already and is not overwritten: choose another name for --record")
    for table in table_paths(path, sides):
        if table.exists():
            _cut_to_whole_rows(table)
    return Interrupted(path, [json.loads(record.payload) for record in records if record.kind == NOTE])


def _cut_to_whole_rows(path: Path) -> None:
    """Remove an incomplete last line."""
    data = path.read_bytes()[-(1 << 16) :]
    torn = len(data) - (data.rfind(b"\n") + 1)
    if torn:
        with AppendedFile(path) as file:
            file.cut(file.size - torn)


class LiveRecording:
    """A recording under way. `samples` and `note` may be called from any thread and never wait for the disk.

    ``acknowledge(shoe, count)`` is called from the writing thread when samples are on disk; ``fail`` is called once, if
    the disk accepts no more data.
    """

    def __init__(
        self,
        path: Path,
        layouts: Sequence[Layout],
        acknowledge: Callable[[int, int], None],
        fail: Callable[[str], None],
    ) -> None:
        """Create the files; raises `UsageError` if one cannot be created."""
        self.path, self.count = path, 0
        self._acknowledge, self._fail = acknowledge, fail
        self._pieces: queue.Queue[tuple[int, bytes, int] | None] = queue.Queue(MOST_WAITING)
        self._error: str | None = None
        self._files: list[AppendedFile] = []
        # The journal comes first: by it an interrupted recording is recognised.
        beside = journal_path(path)
        is_new = not beside.exists()
        self._journal = Journal(beside)
        try:
            for layout in layouts:
                file = AppendedFile(layout.path, new=True)
                self._files.append(file)
                head = [f"# {key}: {value}\n" for key, value in layout.facts.items()]
                file.append("".join([*head, ",".join(["time_s", *layout.columns]), "\n"]).encode())
        except SmartShoeError:
            for file in self._files:
                file.close()
                file.path.unlink()
            self._journal.close()
            if is_new:
                beside.unlink()
            raise
        self._thread = threading.Thread(target=self._run, name=f"writer of {path}", daemon=True)
        self._thread.start()

    def samples(self, shoe: int, block: Block, columns: Sequence[Array] = ()) -> None:
        """Queue samples of a shoe: its readings and further ``columns`` (n,), in the order of the layout."""
        readings = np.where(block.missing, np.nan, block.readings)
        table = np.column_stack([block.time_s, readings, *columns])
        rows = (",".join("" if value != value else repr(value) for value in row) for row in table.tolist())
        self._put((shoe, "".join(f"{row}\n" for row in rows).encode(), len(block)))

    def note(self, note: Mapping[str, Any]) -> None:
        """Queue a note: a mark, a zero or an event."""
        self._put((-1, json.dumps(note, allow_nan=False).encode(), 0))

    def close(self) -> None:
        """Write what is queued, end the journal and close all files; raises `InputError` if writing failed."""
        self._pieces.put(None)
        self._thread.join()
        if self._error is not None:
            raise InputError(self._error)

    def _put(self, piece: tuple[int, bytes, int]) -> None:
        """Queue a piece (shoe or -1 for a note, data, number of samples); never waits."""
        if self._error is not None:
            return
        try:
            self._pieces.put_nowait(piece)
        except queue.Full:
            self._failed(
                f"{self.path}: the disk stands still and the recording ends here; what was acknowledged is kept"
            )

    def _run(self) -> None:
        """Write queued pieces in batches until the recording is closed or writing fails."""
        is_over = False
        while not is_over and self._error is None:
            pieces = [self._pieces.get()]
            if pieces[0] is not None:
                time.sleep(WRITE_EVERY_S)  # several blocks share one flush to disk
            while not self._pieces.empty():
                pieces.append(self._pieces.get_nowait())
            is_over = None in pieces
            try:
                self._write([piece for piece in pieces if piece is not None])
            except (SmartShoeError, OSError) as error:
                self._failed(f"the recording ends here: {error}")
        try:
            if self._error is None:
                self._journal.append(END, b"{}")
        finally:
            self._journal.close()
            for file in self._files:
                file.close()

    def _write(self, pieces: Sequence[tuple[int, bytes, int]]) -> None:
        """Append pieces to the tables and acknowledge their samples, then append notes to the journal."""
        for shoe, file in enumerate(self._files):
            own = [piece for piece in pieces if piece[0] == shoe]
            if own:
                file.append(b"".join(data for _, data, _ in own))
                count = sum(count for _, _, count in own)
                self.count += count
                self._acknowledge(shoe, count)
        for shoe, data, _ in pieces:
            if shoe < 0:
                self._journal.append(NOTE, data)

    def _failed(self, says: str) -> None:
        if self._error is None:
            self._error = says
            self._fail(says)
