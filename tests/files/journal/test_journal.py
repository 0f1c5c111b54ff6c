"""A journal keeps what it acknowledged: through cuts, damage, a full disk and a second writer."""

from __future__ import annotations

import errno
import os
import resource
import struct
import subprocess
import sys
import tempfile
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from smartshoe.errors import FormatError, InputError, UsageError
from smartshoe.files.atomic import write_text
from smartshoe.files.journal import AppendedFile, Journal, _appending, _journal, _records, read_journal

RECORDS = st.lists(st.tuples(st.integers(0, 255), st.binary(max_size=60)), min_size=1, max_size=8)


def _written(path: Path, records: list[tuple[int, bytes]]) -> list[int]:
    """The journal of ``records`` at ``path``; returns the file's size after each."""
    ends = []
    with Journal(path) as journal:
        for kind, payload in records:
            journal.append(kind, payload)
            ends.append(path.stat().st_size)
    return ends


@contextmanager
def _second_piece(path: Path, broken: ModuleType, name: str, by: Callable[..., Any]) -> Iterator[AppendedFile]:
    """A file with a first piece, to which a second is appended while something is ``broken``, and a third after it."""
    with AppendedFile(path, new=True) as file:
        file.append(b"first\n")
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(broken, name, by)
            yield file
        file.append(b"third\n")


def _content(path: Path) -> list[tuple[int, bytes]]:
    return [(record.kind, record.payload) for record in read_journal(path).records]


@settings(max_examples=40)
@given(RECORDS, st.data())
def test_a_journal_that_is_cut_anywhere_keeps_every_whole_record_and_goes_on(
    records: list[tuple[int, bytes]], data: st.DataObject
) -> None:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "journal"
        ends = _written(path, records)
        cut = data.draw(st.integers(0, path.stat().st_size))
        path.write_bytes(path.read_bytes()[:cut])
        whole = [record for record, end in zip(records, ends, strict=True) if end <= cut]
        assert _content(path) == whole
        with Journal(path) as journal:
            journal.append(7, b"after")
        assert _content(path) == [*whole, (7, b"after")]
        assert read_journal(path).notes == ()


@settings(max_examples=60)
@given(RECORDS, st.data())
def test_a_flipped_bit_costs_its_own_record_and_no_other(records: list[tuple[int, bytes]], data: st.DataObject) -> None:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "journal"
        ends = _written(path, records)
        first = ends[0] - 12 - len(records[0][1])
        at = data.draw(st.integers(first, ends[-1] - 1))
        damaged = bytearray(path.read_bytes())
        damaged[at] ^= 1 << data.draw(st.integers(0, 7))
        path.write_bytes(damaged)
        hit = next(index for index, end in enumerate(ends) if at < end)
        kept = [record for index, record in enumerate(records) if index != hit]
        # A payload that looks like a record, marker and checksum and all, is not made by this test.
        assert _content(path) == kept
        assert read_journal(path).notes


def test_what_follows_damage_is_not_cut_off_when_the_journal_is_opened_again(tmp_path: Path) -> None:
    path = tmp_path / "journal"
    ends = _written(path, [(1, b"first"), (1, b"second"), (1, b"third")])
    damaged = bytearray(path.read_bytes())
    damaged[ends[0] + 3] ^= 0xFF
    path.write_bytes(damaged)
    with Journal(path) as journal:
        assert len(journal.recovered.records) == 2
        journal.append(1, b"fourth")
    assert [payload for _, payload in _content(path)] == [b"first", b"third", b"fourth"]


def test_a_journal_that_begins_anew_remembers_nothing(tmp_path: Path) -> None:
    _written(tmp_path / "journal", [(1, b"of another session")])
    with Journal(tmp_path / "journal") as journal:
        journal.clear()
        assert journal.recovered.records == ()
        assert journal.recovered.notes == ()
        journal.append(2, b"new")
    assert _content(tmp_path / "journal") == [(2, b"new")]


def test_a_second_writer_is_kept_out(tmp_path: Path) -> None:
    with Journal(tmp_path / "journal") as journal:
        journal.append(1, b"kept")
        with pytest.raises(UsageError, match="another session"):
            Journal(tmp_path / "journal")
    assert _content(tmp_path / "journal") == [(1, b"kept")]


def test_a_file_that_is_no_journal_is_refused_and_left_alone(tmp_path: Path) -> None:
    path = tmp_path / "journal"
    path.write_bytes(b"time_s,force_n\n0,0\n")
    with pytest.raises(FormatError, match="no journal"):
        Journal(path)
    assert path.read_bytes() == b"time_s,force_n\n0,0\n"


def test_an_appended_file_does_not_overwrite(tmp_path: Path) -> None:
    (tmp_path / "walk.csv").write_text("kept")
    with pytest.raises(UsageError, match="is there already"):
        AppendedFile(tmp_path / "walk.csv", new=True)
    assert (tmp_path / "walk.csv").read_text() == "kept"


def test_a_new_files_rights_are_those_that_the_umask_leaves(tmp_path: Path) -> None:
    before = os.umask(0o020)
    try:
        AppendedFile(tmp_path / "walk.csv", new=True).close()
        write_text(tmp_path / "result.json", "{}")
        umask = os.umask(0o020)
    finally:
        os.umask(before)
    assert umask == 0o020  # left as it was
    assert {path.stat().st_mode & 0o777 for path in tmp_path.iterdir()} == {0o646}


FILL = """
import sys
from smartshoe.errors import InputError
from smartshoe.files.journal import Journal
journal = Journal(sys.argv[1])
try:
    for number in range(1000):
        journal.append(1, number.to_bytes(4, "little") * 50)
        print(number, flush=True)
except InputError as error:
    print(error, file=sys.stderr)
    sys.exit(3)
"""


def test_a_full_disk_ends_with_one_sentence_and_every_acknowledged_record(tmp_path: Path) -> None:
    path, room = tmp_path / "journal", 10_000
    done = subprocess.run(
        [sys.executable, "-c", FILL, str(path)],
        capture_output=True,
        text=True,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (room, room)),
    )
    acknowledged = [int(line) for line in done.stdout.split()]
    assert done.returncode == 3
    assert "takes no more data" in done.stderr
    assert done.stderr.count("\n") == 1
    assert 40 < len(acknowledged) < 60
    contents = read_journal(path)
    assert [int.from_bytes(record.payload[:4], "little") for record in contents.records] == acknowledged
    assert contents.torn_bytes == 0  # what did not fit was taken back


def test_a_piece_that_was_written_stays_where_ctrl_c_comes_while_it_is_synced(tmp_path: Path) -> None:
    def interrupted(_: int) -> None:
        raise KeyboardInterrupt

    with _second_piece(tmp_path / "walk.csv", _appending, "_data_to_disk", interrupted) as file:
        with pytest.raises(KeyboardInterrupt):
            file.append(b"second\n")
        assert file.size == 13
    assert (tmp_path / "walk.csv").read_bytes() == b"first\nsecond\nthird\n"


def test_a_piece_that_the_disk_does_not_sync_is_taken_back(tmp_path: Path) -> None:
    def refused(_: int) -> None:
        raise OSError(errno.EIO, "Input/output error")

    with (
        _second_piece(tmp_path / "walk.csv", _appending, "_data_to_disk", refused) as file,
        pytest.raises(InputError, match="takes no more data"),
    ):
        file.append(b"second\n")
    assert (tmp_path / "walk.csv").read_bytes() == b"first\nthird\n"


def test_half_a_piece_is_taken_back_where_ctrl_c_comes_while_it_is_written(tmp_path: Path) -> None:
    written = os.write
    pieces = iter([3])

    def half(handle: int, data: memoryview) -> int:
        for length in pieces:
            return written(handle, data[:length])
        raise KeyboardInterrupt

    with _second_piece(tmp_path / "walk.csv", os, "write", half) as file, pytest.raises(KeyboardInterrupt):
        file.append(b"second\n")
    assert (tmp_path / "walk.csv").read_bytes() == b"first\nthird\n"


def test_records_are_of_the_longest_length_and_kind_and_none_beyond(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(_journal, "LONGEST_PAYLOAD", 8)
    monkeypatch.setattr(_records, "LONGEST_PAYLOAD", 8)
    kept = [(0, b"12345678"), (255, b"")]
    with Journal(tmp_path / "journal") as journal:
        for kind, payload in kept:
            journal.append(kind, payload)
        for kind, payload in ((256, b""), (-1, b""), (0, b"123456789")):
            with pytest.raises(UsageError, match="cannot be written"):
                journal.append(kind, payload)
    assert _content(tmp_path / "journal") == kept
    assert read_journal(tmp_path / "journal").notes == ()


def test_a_record_holds_256_mebibytes_and_no_byte_more(tmp_path: Path) -> None:
    with Journal(tmp_path / "journal") as journal, pytest.raises(UsageError, match="268435457 bytes cannot be written"):
        journal.append(1, bytes(256 * 2**20 + 1))
    assert _content(tmp_path / "journal") == []


def test_a_journal_that_cannot_be_read_says_so(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="does not exist"):
        read_journal(tmp_path / "none")


@pytest.mark.parametrize("missing", [1, 7])
def test_a_record_that_says_more_bytes_than_there_are_is_none(missing: int) -> None:
    """Though its checksum is that of those that are there: it was never written so."""
    payload = bytes(range(40))
    checked = struct.pack("<BBI", 3, 0, len(payload) + missing)
    head = _records.MARKER + checked + struct.pack("<I", zlib.crc32(payload, zlib.crc32(checked)))
    assert _records.record_at(head + payload, 0) is None
    whole = _records.packed(3, payload)
    found = _records.record_at(b"xx" + whole, 2)
    assert found == _records.Record(3, payload, len(whole) + 2)
