"""A disk that is full or may only be read: one sentence, results as they were or whole, and another call ends the work.

At each step on disk the refusal is injected; ``pytest -m bank tests/hostile/test_refusing_disks.py -s`` does so at the
steps of every command that writes, and as root runs them on a small tmpfs that is full, or mounted to be read only:
root is not held by the rights of files.
"""

from __future__ import annotations

import errno
import os
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from hosted_commands import Host, Tried, files_of
from writing_commands import WRITING

pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="forks the commands")
EVERYDAY = ("calibrations add", "identify", "stream")
REFUSALS = {"full": errno.ENOSPC, "read only": errno.EROFS}
MOST_STEPS = 24
FREE_BLOCKS = (0, 1, 2, 4, 16)  # of 4 KiB


@pytest.mark.parametrize("name", EVERYDAY)
def test_a_disk_that_refuses_is_told_in_one_sentence(host: Host, inputs: Path, tmp_path: Path, name: str) -> None:
    tried = Tried(host, inputs, tmp_path, name)
    for step, fault in ((2, errno.ENOSPC), (tried.steps // 2, errno.EROFS)):
        tried.stopped(step, fault)


@pytest.mark.bank
@pytest.mark.parametrize("name", WRITING)
def test_every_command_refused_step_by_step(host: Host, inputs: Path, tmp_path: Path, name: str) -> None:
    tried = Tried(host, inputs, tmp_path, name)
    steps = sorted({round(step) for step in np.linspace(1, tried.steps, MOST_STEPS)})
    for kind, fault in REFUSALS.items():
        told = sum(tried.stopped(step, fault).status != 0 for step in steps)
        assert told > 0
        print(f"\n{name}: {kind} at {len(steps)} of {tried.steps} steps, {told} refused")


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    """A tmpfs of 4 MiB."""
    folder = tmp_path / "disk"
    folder.mkdir()
    words = ["mount", "-t", "tmpfs", "-o", "size=4m", "none", str(folder)]
    if subprocess.run(words, capture_output=True, check=False).returncode:
        pytest.skip("may not mount a disk")
    yield folder
    subprocess.run(["umount", str(folder)], check=True)


def _fill(disk: Path, free_blocks: int) -> None:
    """Leave so many blocks."""
    filler = disk / "filler"
    state = os.statvfs(disk)
    with filler.open("wb") as file:
        file.write(b"\0" * (state.f_bavail - free_blocks) * state.f_bsize)


@pytest.mark.bank
@pytest.mark.parametrize("name", WRITING)
def test_every_command_on_a_disk_that_is_full(host: Host, inputs: Path, small_disk: Path, name: str) -> None:
    about, refused = WRITING[name], 0
    folder = small_disk / "in"
    for free in FREE_BLOCKS:
        shutil.copytree(inputs, folder)
        _fill(small_disk, free)
        before = files_of(folder)
        ended = host.run(about.words, folder)
        assert ended.status in (0, 2, 3), ended
        if ended.status:
            refused += 1
            assert ended.says.startswith("error: "), ended
            after = files_of(folder)
            assert {name: after[name] for name in before} == before
            assert not [path for path in folder.rglob("*") if ".partial" in path.name]
            # What a folder of several results holds is whole, each of it.
            assert all(after.values()) or about.grows or name == "calibrate"
        (small_disk / "filler").unlink()
        shutil.rmtree(folder)
    assert refused
    print(f"\n{name}: refused on a full disk {refused} of {len(FREE_BLOCKS)} times")


@pytest.mark.bank
@pytest.mark.parametrize("name", WRITING)
def test_every_command_on_a_disk_that_is_read_only(host: Host, inputs: Path, small_disk: Path, name: str) -> None:
    folder = small_disk / "in"
    shutil.copytree(inputs, folder)
    subprocess.run(["mount", "-o", "remount,ro", str(small_disk)], check=True)
    ended = host.run(WRITING[name].words, folder)
    assert ended.status == 2, ended
    assert ended.says.startswith("error: "), ended
