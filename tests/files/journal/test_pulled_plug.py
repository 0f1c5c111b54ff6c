"""What was acknowledged is there after the plug was pulled, on a disk that keeps nothing but what was synced."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from pulled_plug import Disk

from smartshoe.files.atomic import write_text
from smartshoe.files.journal import AppendedFile, Journal, read_journal

pytestmark = pytest.mark.skipif(not Path("/proc/self/fd").is_dir(), reason="reads open files by /proc")


@pytest.fixture
def disk(monkeypatch: pytest.MonkeyPatch) -> Iterator[Disk]:
    made = Disk(monkeypatch)
    yield made
    made.close()


def test_the_disk_of_these_tests_forgets_what_was_not_synced(disk: Disk, tmp_path: Path) -> None:
    folder = tmp_path / "live"
    folder.mkdir()
    (folder / "unsynced.txt").write_text("gone")
    write_text(folder / "whole.txt", "kept")
    with (folder / "whole.txt").open("a") as file:
        file.write(" and gone")
    left = disk.after_the_plug(folder, tmp_path / "left")
    assert (left / "whole.txt").read_text() == "kept"
    assert (left / "unsynced.txt").read_text() == ""  # its name was there when the folder was synced
    (folder / "later.txt").write_text("gone with its name")
    assert not (disk.after_the_plug(folder, tmp_path / "again") / "later.txt").exists()


def test_every_record_that_was_acknowledged_survives(disk: Disk, tmp_path: Path) -> None:
    folder = tmp_path / "live"
    folder.mkdir()
    with Journal(folder / "journal") as journal:
        write_text(folder / "plan.json", "{}")  # as a session does, which also brings the journal's name to disk
        for number in range(5):
            journal.append(1, bytes([number]) * 20)
            left = disk.after_the_plug(folder, tmp_path / f"left{number}")
            contents = read_journal(left / "journal")
            assert [record.payload[0] for record in contents.records] == list(range(number + 1))
            assert contents.notes == ()


def test_a_record_that_may_wait_is_on_disk_with_the_next_one_that_may_not(disk: Disk, tmp_path: Path) -> None:
    folder = tmp_path / "live"
    folder.mkdir()
    with Journal(folder / "journal") as journal:
        write_text(folder / "plan.json", "{}")
        journal.append(1, b"first", synced=False)
        assert read_journal(disk.after_the_plug(folder, tmp_path / "one") / "journal").records == ()
        journal.append(1, b"second")
        records = read_journal(disk.after_the_plug(folder, tmp_path / "two") / "journal").records
    assert [record.payload for record in records] == [b"first", b"second"]


def test_a_new_file_that_grows_keeps_its_name_and_every_piece(disk: Disk, tmp_path: Path) -> None:
    folder = tmp_path / "live"
    folder.mkdir()
    with AppendedFile(folder / "walk.csv", new=True) as file:
        for number, said in enumerate((b"time_s,left_toe_mbar\n", b"0.0,1.5\n", b"0.01,1.25\n")):
            file.append(said)
            left = disk.after_the_plug(folder, tmp_path / f"left{number}")
            assert (left / "walk.csv").read_bytes() == (folder / "walk.csv").read_bytes()
    assert (folder / "walk.csv").stat().st_size == 39
