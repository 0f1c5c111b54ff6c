"""What was acknowledged is there after the plug was pulled, on a disk that keeps nothing but what was synced."""

from __future__ import annotations

from pathlib import Path

import pytest
from acknowledged import WRITERS, Writer
from pulled_plug import Disk

from smartshoe.errors import SmartShoeError
from smartshoe.files.atomic import write_text
from smartshoe.files.journal import Journal, read_journal
from smartshoe.runs.sweeps._folder import SweepFolder

pytestmark = pytest.mark.skipif(not Path("/proc/self/fd").is_dir(), reason="reads open files by /proc")
# Who asks for what to be on disk, in all of the source.
SITES = {
    "replacing _to_disk", "replacing sync_folder", "make_folder sync_folder", "AppendedFile.__init__ sync_folder",
    "AppendedFile.append _data_to_disk",
}  # fmt: skip


def _run(writer: Writer, root: Path, left_out: str = "") -> tuple[set[str], Exception | None]:
    """Pull the plug after each step: the sites that synchronised, and the first fault in what is left."""
    folder = root / "live"
    folder.mkdir(parents=True)
    with pytest.MonkeyPatch.context() as patch:
        disk = Disk(folder, patch, left_out)
        steps = writer(folder)
        try:
            for number, check in enumerate(steps):
                check(disk.after_the_plug(root / f"left{number}"))
        except (AssertionError, OSError, SmartShoeError, ValueError) as fault:
            return disk.sites, fault
        finally:
            steps.close()  # type: ignore[attr-defined]
            disk.close()
    return disk.sites, None


def test_the_disk_of_these_tests_forgets_what_was_not_synced(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    folder = tmp_path / "live"
    folder.mkdir()
    (folder / "before.txt").write_text("was there")
    disk = Disk(folder, monkeypatch)
    (folder / "unsynced.txt").write_text("gone")
    write_text(folder / "whole.txt", "kept")
    for name in ("before.txt", "whole.txt"):
        with (folder / name).open("a") as file:
            file.write(" and gone")
    (folder / "made").mkdir()
    (folder / "made" / "inside.txt").write_text("gone with its folder")
    left = disk.after_the_plug(tmp_path / "left")
    assert (left / "before.txt").read_text() == "was there"
    assert (left / "whole.txt").read_text() == "kept"
    assert (left / "unsynced.txt").read_text() == ""  # its name was there when the folder was synced
    assert not (left / "made").exists()
    disk.close()


@pytest.mark.parametrize("writer", WRITERS)
def test_what_was_acknowledged_is_there_after_the_plug_was_pulled(writer: str, tmp_path: Path) -> None:
    sites, fault = _run(WRITERS[writer], tmp_path)
    assert fault is None
    assert sites <= SITES


@pytest.mark.parametrize("site", sorted(SITES))
def test_a_synchronisation_that_is_left_out_is_missed(site: str, tmp_path: Path) -> None:
    faults = {name: _run(writer, tmp_path / name, left_out=site)[1] for name, writer in WRITERS.items()}
    assert any(fault is not None for fault in faults.values()), "nothing needs it, or no test notices"


def test_a_record_that_may_wait_is_on_disk_with_the_next_one_that_may_not(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    folder = tmp_path / "live"
    folder.mkdir()
    disk = Disk(folder, monkeypatch)
    with Journal(folder / "journal") as journal:
        journal.append(1, b"first", synced=False)
        assert read_journal(disk.after_the_plug(tmp_path / "one") / "journal").records == ()
        journal.append(1, b"second")
        records = read_journal(disk.after_the_plug(tmp_path / "two") / "journal").records
    assert [record.payload for record in records] == [b"first", b"second"]
    disk.close()


def test_a_sweeps_case_that_the_plug_took_is_none_and_not_half_of_one(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    folder = SweepFolder(tmp_path / "live")
    folder.cases.mkdir(parents=True)
    disk = Disk(folder.path, monkeypatch)
    folder.put("first", "{}")
    write_text(folder.cases / "second.json", "{}")  # which brings the first one's name to disk, and not its content
    left = SweepFolder(disk.after_the_plug(tmp_path / "left"))
    assert left.done() == {"second"}
    assert not left.holds("first")
    disk.close()
