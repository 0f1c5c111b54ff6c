"""A folder that a colleague sent holds Python files: no process that a command starts imports them."""

from __future__ import annotations

import atexit
import gc
import subprocess
import sys
from pathlib import Path

import pytest

from smartshoe import cli
from smartshoe.kernels import warm_up


@pytest.fixture
def ran(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """What is there once a module of the caller's folder has run."""
    folder = tmp_path / "sent"
    (folder / "smartshoe").mkdir(parents=True)
    for name in ("colorsys.py", "smartshoe/__init__.py", "smartshoe/version.py"):
        (folder / name).write_text(f"open({str(tmp_path / 'ran')!r}, 'w')\n")
    monkeypatch.chdir(folder)
    monkeypatch.setenv("PYTHONSAFEPATH", "")
    return tmp_path / "ran"


def test_workers_of_a_command_do_not_import_from_the_callers_folder(ran: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    started = [sys.executable, "-m", "colorsys"]
    monkeypatch.setattr(gc, "set_threshold", lambda *_: None)  # of the whole process
    monkeypatch.setattr(cli, "run_command", lambda _: subprocess.run(started, check=True).returncode)
    with pytest.raises(SystemExit, match="0"):
        cli.main()
    assert not ran.exists()


def test_nor_does_the_process_that_compiles(ran: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    waits = []
    begun = subprocess.Popen

    def of_less_work(command: list[str], **how: object) -> subprocess.Popen[bytes]:
        return begun([*command[:-1], "smartshoe.version"], **how)  # type: ignore[call-overload, no-any-return]

    monkeypatch.setattr(warm_up, "CACHE", tmp_path / "empty")
    monkeypatch.setattr(subprocess, "Popen", of_less_work)
    monkeypatch.setattr(atexit, "register", waits.append)
    warm_up.begin()
    assert [wait() for wait in waits] == [0]
    assert not ran.exists()
