"""Files are written whole or not at all."""

from __future__ import annotations

import errno
import json
import math
import os
import stat
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from threading import Thread

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from smartshoe.errors import UsageError
from smartshoe.files.atomic import json_text, make_folder, replacing, results_folder, sync_folder, write_text
from smartshoe.files.journal import AppendedFile


def test_a_failure_leaves_the_old_file_and_no_litter(tmp_path: Path) -> None:
    target = tmp_path / "result.json"
    write_text(target, "old")

    def fail_half_way() -> None:
        with replacing(target) as temporary:
            temporary.write_text("half")
            raise RuntimeError

    with pytest.raises(RuntimeError):
        fail_half_way()
    assert target.read_text() == "old"
    assert list(tmp_path.iterdir()) == [target]


def test_writing_leaves_no_file_open(tmp_path: Path) -> None:
    before = len(list(Path("/dev/fd").iterdir()))
    for k in range(5):
        write_text(make_folder(tmp_path / f"{k}") / "result.json", "{}")
    assert len(list(Path("/dev/fd").iterdir())) <= before


def test_places_that_cannot_be_written_are_refused_in_one_sentence(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="is a directory"):
        write_text(tmp_path, "x")
    with pytest.raises(UsageError, match=r"x\.json cannot be written \(No such file or directory\): choose a folder"):
        write_text(tmp_path / "missing" / "x.json", "x")
    (tmp_path / "file").write_text("")
    with pytest.raises(UsageError, match=r"below cannot be made a folder \(Not a directory\): choose another --out"):
        make_folder(tmp_path / "file" / "below")


@pytest.fixture(params=[("null", 3), ("zero", 5)], ids=["null", "zero"])
def device(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    """A device; for root, whom nothing keeps from replacing the machine's own where the code is wrong, a new one."""
    name, number = request.param
    if os.geteuid() != 0:
        return Path("/dev") / name
    made = tmp_path / name
    try:
        os.mknod(made, stat.S_IFCHR | 0o666, os.makedev(1, number))
        os.close(os.open(made, os.O_WRONLY))
    except OSError as error:
        pytest.skip(f"no device can be made here ({error.strerror})")
    return made


def test_a_device_is_written_to_and_never_replaced(device: Path) -> None:
    before = device.stat()
    write_text(device, "x")
    after = device.stat()
    assert stat.S_ISCHR(after.st_mode)
    assert (after.st_ino, after.st_rdev, after.st_mode) == (before.st_ino, before.st_rdev, before.st_mode)


@pytest.mark.parametrize("name", ["/dev/stdout", "/dev/fd/1", "link"])
def test_standard_output_by_its_name_is_appended_to(name: str, tmp_path: Path) -> None:
    (tmp_path / "link").symlink_to("/dev/stdout")
    code = (
        f"from smartshoe.files.atomic import write_text; print('one'); write_text({name!r}, 'two\\n'); print('three')"
    )
    with (tmp_path / "out.txt").open("w") as out:
        subprocess.run([sys.executable, "-c", code], stdout=out, check=True, cwd=tmp_path)
    assert (tmp_path / "out.txt").read_text() == "one\ntwo\nthree\n"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["link", "out.txt"]


def test_a_pipe_gets_the_whole_text_and_without_a_reader_a_refusal(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    with pytest.raises(UsageError, match="cannot be written"):
        write_text(pipe, "x")
    reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    write_text(pipe, "whole")
    assert os.read(reader, 100) == b"whole"
    os.close(reader)
    assert stat.S_ISFIFO(pipe.stat().st_mode)


def test_a_pipe_whose_reader_is_slow_is_waited_for(tmp_path: Path) -> None:
    pipe, text = tmp_path / "pipe", "0123456789" * 40_000  # many times what a pipe holds
    os.mkfifo(pipe)
    reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    os.set_blocking(reader, True)
    got = []

    def read() -> None:
        time.sleep(0.05)
        while piece := os.read(reader, 50_000):
            got.append(piece)

    reading = Thread(target=read, daemon=True)
    reading.start()
    write_text(pipe, text)
    reading.join(30.0)
    os.close(reader)
    assert b"".join(got).decode() == text


def test_a_link_stays_and_the_file_that_it_leads_to_is_replaced(tmp_path: Path) -> None:
    (tmp_path / "far").mkdir()
    target, link = tmp_path / "far" / "result.json", tmp_path / "result.json"
    target.write_text("old")
    link.symlink_to(Path("far") / "result.json")
    write_text(link, "new")
    assert link.is_symlink()
    assert target.read_text() == "new"
    assert [path.name for path in target.parent.iterdir()] == ["result.json"]


def test_a_link_in_a_circle_is_refused(tmp_path: Path) -> None:
    (tmp_path / "a").symlink_to("b")
    (tmp_path / "b").symlink_to("a")
    with pytest.raises(UsageError, match="leads to itself"):
        write_text(tmp_path / "a", "x")


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() != 0, reason="only root may lay another's link")
def test_a_strangers_link_in_a_folder_of_everybody_is_not_followed(tmp_path: Path) -> None:
    shared = tmp_path / "shared"
    shared.mkdir()
    shared.chmod(0o1777)
    (tmp_path / "mine").write_text("old")
    (shared / "result.json").symlink_to(tmp_path / "mine")
    os.lchown(shared / "result.json", 12345, 12345)
    with pytest.raises(UsageError, match="somebody else"):
        write_text(shared / "result.json", "new")
    assert (tmp_path / "mine").read_text() == "old"
    # One's own link there, and anybody's in a folder of one's own, are.
    (shared / "own.json").symlink_to(tmp_path / "mine")
    write_text(shared / "own.json", "new")
    assert (tmp_path / "mine").read_text() == "new"
    (tmp_path / "theirs.json").symlink_to(tmp_path / "mine")
    os.lchown(tmp_path / "theirs.json", 12345, 12345)
    write_text(tmp_path / "theirs.json", "newer")
    assert (tmp_path / "mine").read_text() == "newer"


@pytest.mark.parametrize("name", ["n" * 250 + ".csv", "m" * 300 + ".csv", "a\0b"])
def test_a_name_is_written_or_refused_in_one_sentence(name: str, tmp_path: Path) -> None:
    if len(name) < 255 and "\0" not in name:
        write_text(tmp_path / name, "x")
        assert (tmp_path / name).read_text() == "x"
        return
    with pytest.raises(UsageError, match="cannot be written"):
        write_text(tmp_path / name, "x")
    assert list(tmp_path.iterdir()) == []


@settings(max_examples=30)
@given(
    st.text(st.sampled_from("a.é脚👣"), min_size=1, max_size=60),
    st.text(st.sampled_from("a.é脚👣"), min_size=1, max_size=60),
)
def test_whatever_name_a_disk_takes_is_written(stem: str, ending: str) -> None:
    name = f"x{stem}.{ending}"
    while len(name.encode()) > 255:
        name = name[1:]
    with tempfile.TemporaryDirectory() as folder:
        write_text(Path(folder) / name, "whole")
        assert (Path(folder) / name).read_text() == "whole"
        assert len(list(Path(folder).iterdir())) == 1


def test_json_is_a_line_of_text_that_reads_back_and_holds_no_nan() -> None:
    result = {"unit": "linke Ferse", "value": 0.1 + 0.2}
    assert json.loads(json_text(result)) == result
    assert json_text(result).endswith("}\n")
    # A person may read it, and its bytes stay what they are: files are named by them.
    assert json_text({"unit": "Füße", "value": [1, 0.5]}) == '{\n "unit": "Füße",\n "value": [\n  1,\n  0.5\n ]\n}\n'
    with pytest.raises(ValueError, match="nan"):
        json_text({"value": math.nan})


@contextmanager
def _as_nobody() -> Iterator[None]:
    """Root may write anywhere: within the block it is nobody. What is reached by an open folder stays in reach."""
    if os.geteuid() != 0:
        yield
        return
    os.setresuid(65534, 65534, 0)
    try:
        yield
    finally:
        os.setresuid(0, 0, 0)


@pytest.fixture
def open_folder() -> Iterator[Path]:
    """A folder that everybody may reach: pytest's own are the user's alone."""
    with tempfile.TemporaryDirectory() as name:
        Path(name).chmod(0o755)
        yield Path(name)


@pytest.mark.skipif(not hasattr(os, "setresuid"), reason="needs the rights of Linux")
def test_a_folder_that_may_not_be_written_to_is_refused_and_keeps_its_files(open_folder: Path) -> None:
    shut, unlisted = open_folder / "shut", open_folder / "unlisted"
    for folder, rights in ((shut, 0o555), (unlisted, 0o333)):
        folder.mkdir()
        (folder / "result.json").write_text("old")
        folder.chmod(rights)
    with _as_nobody():
        with pytest.raises(UsageError, match="shut is not writable"):
            make_folder(shut)
        with pytest.raises(UsageError, match="cannot be made a folder"):
            make_folder(shut / "new")
        with pytest.raises(UsageError, match="exists and is writable"):
            write_text(shut / "result.json", "new")
        with pytest.raises(UsageError, match="exists and is writable"):
            AppendedFile(shut / "walk.csv", new=True)
        write_text(make_folder(unlisted / "new") / "result.json", "new")
        write_text(unlisted / "result.json", "new")
    for folder in (shut, unlisted):
        folder.chmod(0o755)
    assert (shut / "result.json").read_text() == "old"
    assert (unlisted / "result.json").read_text() == (unlisted / "new" / "result.json").read_text() == "new"
    assert [path.name for path in shut.iterdir()] == ["result.json"]


def test_a_full_disk_is_one_sentence(tmp_path: Path) -> None:
    (tmp_path / "x.json").write_text("old")

    def fill_the_disk() -> None:
        with replacing(tmp_path / "x.json") as temporary:
            temporary.write_text("half")
            raise OSError(errno.ENOSPC, "No space left on device")

    with pytest.raises(UsageError, match="free some space"):
        fill_the_disk()
    assert (tmp_path / "x.json").read_text() == "old"
    assert [path.name for path in tmp_path.iterdir()] == ["x.json"]


@pytest.mark.parametrize(("number", "is_told"), [(errno.EIO, True), (errno.EINVAL, False), (errno.ENOTSUP, False)])
def test_a_folder_that_cannot_be_synced_is_told_but_where_the_file_system_knows_no_such_thing(
    number: int, is_told: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def failing(handle: int) -> None:
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr(os, "fsync", failing)
    if is_told:
        with pytest.raises(OSError, match=os.strerror(number)):
            sync_folder(tmp_path)
    else:
        sync_folder(tmp_path)


def test_the_content_reaches_the_disk_before_its_name_and_the_name_before_the_return(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A pulled plug keeps what was synced: the content, then the rename, then the folder, in this order."""
    target, steps = tmp_path / "x.json", []
    fsync, rename = os.fsync, Path.replace

    def synced(handle: int) -> None:
        of_folder = stat.S_ISDIR(os.fstat(handle).st_mode)
        steps.append("folder" if of_folder else os.pread(handle, 100, 0).decode())
        fsync(handle)

    def renamed(self: Path, to: Path) -> Path:
        steps.append("rename")
        return rename(self, to)

    monkeypatch.setattr(os, "fsync", synced)
    monkeypatch.setattr(Path, "replace", renamed)
    write_text(target, "whole")
    assert steps == ["whole", "rename", "folder"]


def test_a_folder_made_for_results_that_never_came_goes_again(tmp_path: Path) -> None:
    def fail(folder: Path, holds: bool) -> None:
        with results_folder(folder) as made:
            assert made.is_dir()
            if holds:
                write_text(made / "of_use.json", "{}")
            raise KeyboardInterrupt

    for stood, of_new in ((tmp_path, "a/b"), (tmp_path / "there", "")):
        stood.mkdir(exist_ok=True)
        with pytest.raises(KeyboardInterrupt):
            fail(stood / of_new, holds=False)
        assert stood.is_dir()
        assert list(stood.iterdir()) == []
    with pytest.raises(KeyboardInterrupt):
        fail(tmp_path / "c" / "d", holds=True)
    assert (tmp_path / "c" / "d" / "of_use.json").exists()
