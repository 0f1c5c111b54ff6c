"""A disk that keeps nothing but what was synced: what stands there after the plug was pulled."""

from __future__ import annotations

import os
import stat
from pathlib import Path

import pytest


class Disk:
    """Watches `os.fsync` and `os.fdatasync` while the ``monkeypatch`` lasts.

    A file's content is as at its last synchronisation; its name is there where its folder was synchronised after the
    name was given.
    """

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self._contents: dict[int, bytes] = {}
        self._names: dict[int, dict[str, int]] = {}
        self._held: list[int] = []  # so that no number is given to another file
        for name in ("fsync", "fdatasync"):
            if hasattr(os, name):
                monkeypatch.setattr(os, name, self._synced)

    def _synced(self, handle: int) -> None:
        state = os.fstat(handle)
        path = Path(f"/proc/self/fd/{handle}")
        if state.st_ino not in self._contents and state.st_ino not in self._names:
            self._held.append(os.open(path, os.O_RDONLY))
        if stat.S_ISDIR(state.st_mode):
            self._names[state.st_ino] = {entry.name: entry.stat().st_ino for entry in path.iterdir()}
        else:
            self._contents[state.st_ino] = path.read_bytes()

    def after_the_plug(self, folder: Path, into: Path) -> Path:
        """What is left of the files of ``folder``, as a new folder ``into``."""
        into.mkdir()
        for name, number in self._names.get(folder.stat().st_ino, {}).items():
            if not (folder / name).is_dir():
                (into / name).write_bytes(self._contents.get(number, b""))
            else:
                self.after_the_plug(folder / name, into / name)
        return into

    def close(self) -> None:
        """Let the files go."""
        for handle in self._held:
            os.close(handle)
