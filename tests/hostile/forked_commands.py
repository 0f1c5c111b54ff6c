"""Runs command lines in forked children, each with a fault on the disk at a step of its own.

A JSON line ``{"folder": ..., "words": [...], "step": N, "fault": F, "after_s": T}`` on stdin starts one: at its N-th
step on disk (0: never) a file opened to be written, made whole, renamed or removed, a folder made, a piece appended,
it is killed (F is "kill") or the step fails with the error number F. ``after_s`` kills it from outside, then. Answered
by a line with its status (-9: killed), how many steps it took and what it said. ``"here": true`` runs it in this
process, so that what is imported late is imported once.
"""

from __future__ import annotations

import contextlib
import io
import json
import os
import signal
import sys
import time
from pathlib import Path
from typing import Any

from smartshoe.cli import run_command

WRITES = os.O_WRONLY | os.O_RDWR
STEPS = ("os.rename", "os.remove", "os.mkdir", "os.truncate")


class _Steps:
    """Counts what a command does on disk below ``folder``, and lets the chosen step fail."""

    def __init__(self, folder: Path, last: int, fault: int | str) -> None:
        self.count, self._folder, self._last, self._fault = 0, folder, last, fault
        sys.addaudithook(self._heard)
        for name in ("fsync", "fdatasync", "write"):
            setattr(os, name, self._counted(getattr(os, name)))

    def _heard(self, event: str, about: tuple[Any, ...]) -> None:
        opened = event == "open" and not isinstance(about[0], int) and isinstance(about[2], int) and about[2] & WRITES
        if (opened or event in STEPS) and self._is_below(about[0]):
            # What goes is taken away also where nothing more can be written.
            self._step(can_fail=event != "os.remove")

    def _is_below(self, name: Any) -> bool:
        if isinstance(name, int):
            name = Path(f"/proc/self/fd/{name}").readlink()
        return (Path.cwd() / os.fsdecode(name)).is_relative_to(self._folder)

    def _counted(self, call: Any) -> Any:
        def counted(handle: int, *arguments: Any) -> Any:
            if self._is_below(handle):
                self._step()
            return call(handle, *arguments)

        return counted

    def _step(self, can_fail: bool = True) -> None:
        self.count += 1
        if self.count != self._last:
            return
        if self._fault == "kill":
            os.kill(os.getpid(), signal.SIGKILL)
        elif can_fail:
            assert isinstance(self._fault, int)
            raise OSError(self._fault, os.strerror(self._fault))


def _child(asked: dict[str, Any], answer: int) -> None:
    os.chdir(asked["folder"])
    told = os.write
    steps = _Steps(Path(asked["folder"]).resolve(), asked["step"], asked["fault"])
    said = io.StringIO()
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(said):
        status = run_command(asked["words"])
    told(answer, json.dumps([status, steps.count, said.getvalue()[-2000:]]).encode())


def _forked(asked: dict[str, Any]) -> str:
    mine, its = os.pipe()
    child = os.fork()
    if child == 0:
        try:
            _child(asked, its)
        finally:
            os._exit(0)
    os.close(its)
    if asked.get("after_s"):
        time.sleep(asked["after_s"])
        os.kill(child, signal.SIGKILL)  # not waited for yet, so that its number is still its own
    _, ended = os.waitpid(child, 0)
    with os.fdopen(mine) as answer:
        said = answer.read()
    return said if said else json.dumps([-os.WTERMSIG(ended) if os.WIFSIGNALED(ended) else None, 0, ""])


def main() -> None:
    """One command a line of stdin."""
    print("ready", flush=True)
    out = sys.stdout
    for line in sys.stdin:
        asked = json.loads(line)
        if asked.get("here"):
            os.chdir(asked["folder"])
            with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
                said = json.dumps([run_command(asked["words"]), 0, ""])
            os.chdir("/")
        else:
            said = _forked(asked)
        print(said, file=out, flush=True)


if __name__ == "__main__":
    main()
