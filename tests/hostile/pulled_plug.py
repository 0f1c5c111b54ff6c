"""A disk that keeps nothing but what was synced: what stands there after the plug was pulled."""

from __future__ import annotations

import os
import stat
import sys
from pathlib import Path

import pytest

_SYNCING = ("_to_disk", "sync_folder", "_data_to_disk")  # who calls these is who wants something on disk


class Disk:
    """Watches `os.fsync` and `os.fdatasync` below ``root`` while the ``monkeypatch`` lasts.

    What stands in ``root`` at the beginning is on the disk. From then on a file's content is as at its last
    synchronisation, and its name is there where its folder was synchronised after the name was given. ``sites`` are
    the functions that asked for synchronisations; those of the site ``left_out`` are not made.
    """

    def __init__(self, root: Path, monkeypatch: pytest.MonkeyPatch, left_out: str = "") -> None:
        self.sites: set[str] = set()
        self._root, self._left_out = root, left_out
        self._contents: dict[int, bytes] = {}
        self._entries: dict[int, dict[str, tuple[int, bool]]] = {}
        self._held: dict[int, int] = {}  # open, so that no inode's number is given to another file
        for path in [root, *root.rglob("*")]:
            self._keep(path)
        for name in ("fsync", "fdatasync"):
            if hasattr(os, name):
                monkeypatch.setattr(os, name, self._synced)

    def _synced(self, handle: int) -> None:
        site = _site()
        self.sites.add(site)
        if site != self._left_out:
            self._keep(Path(f"/proc/self/fd/{handle}"))

    def _keep(self, path: Path) -> None:
        state = self._hold(path)
        if stat.S_ISDIR(state.st_mode):
            self._entries[state.st_ino] = {
                item.name: (self._hold(item).st_ino, item.is_dir()) for item in path.iterdir()
            }
        else:
            self._contents[state.st_ino] = path.read_bytes()

    def _hold(self, path: Path) -> os.stat_result:
        state = path.stat()
        if state.st_ino not in self._held:
            self._held[state.st_ino] = os.open(path, os.O_RDONLY)
        return state

    def after_the_plug(self, into: Path) -> Path:
        """What is left of ``root``, as a new folder ``into``."""
        self._lay(self._root.stat().st_ino, into)
        return into

    def _lay(self, folder: int, into: Path) -> None:
        into.mkdir()
        for name, (number, is_folder) in self._entries.get(folder, {}).items():
            if is_folder:
                self._lay(number, into / name)
            else:
                (into / name).write_bytes(self._contents.get(number, b""))

    def close(self) -> None:
        """Let the files go."""
        for handle in self._held.values():
            os.close(handle)


def _site() -> str:
    """The function that asked for the synchronisation under way, and what it asked for."""
    frame = sys._getframe(2)
    asked = frame.f_code.co_name
    while frame.f_code.co_name in _SYNCING:
        assert frame.f_back is not None
        asked, frame = frame.f_code.co_name, frame.f_back
    return f"{frame.f_code.co_qualname} {asked}"
