"""Runs command lines in forked children for the kill tests: a JSON line ``[STEP, FOLDER, WORDS]`` starts one there.

The child ends itself with SIGKILL at its STEP-th step on disk (0: never): a file opened to be written, made whole,
renamed or removed, a folder made, a piece appended. Answers with a line ``[STATUS, STEPS]``.
"""

from __future__ import annotations

import json
import os
import signal
import sys
from typing import Any

from smartshoe.cli import run_command

WRITES = os.O_WRONLY | os.O_RDWR
STEPS = ("os.rename", "os.remove", "os.mkdir", "os.truncate")


class _Steps:
    """Counts what a command does on disk, and ends it at the chosen step."""

    def __init__(self, last: int) -> None:
        self.count, self._last = 0, last
        sys.addaudithook(self._heard)
        for name in ("fsync", "fdatasync", "write"):
            setattr(os, name, self._counted(getattr(os, name)))

    def _heard(self, event: str, about: tuple[Any, ...]) -> None:
        # Descriptors and devices are no files; kernels are kept elsewhere and belong to no command.
        opened = event == "open" and isinstance(about[2], int) and about[2] & WRITES
        if (opened or event in STEPS) and "__pycache__" not in str(about[0]) and not str(about[0]).startswith("/dev/"):
            self._step()

    def _counted(self, call: Any) -> Any:
        def counted(*arguments: Any) -> Any:
            self._step()
            return call(*arguments)

        return counted

    def _step(self) -> None:
        self.count += 1
        if self.count == self._last:
            os.kill(os.getpid(), signal.SIGKILL)


def _child(step: int, folder: str, words: list[str], answer: int) -> None:
    os.chdir(folder)
    quiet = os.open(os.devnull, os.O_WRONLY)
    os.dup2(quiet, 1)
    os.dup2(quiet, 2)
    told = os.write
    steps = _Steps(step)
    status = run_command(words)
    told(answer, json.dumps([status, steps.count]).encode())


def main() -> None:
    """One child a line of stdin."""
    # What is imported late is imported here, so that a child's steps are the command's.

    print("ready", flush=True)
    for line in sys.stdin:
        step, folder, words = json.loads(line)
        mine, its = os.pipe()
        child = os.fork()
        if child == 0:
            try:
                _child(step, folder, words, its)
            finally:
                os._exit(0)
        os.close(its)
        _, ended = os.waitpid(child, 0)
        with os.fdopen(mine) as answer:
            said = answer.read()
        print(said if os.WIFEXITED(ended) and said else json.dumps([-os.WTERMSIG(ended), 0]), flush=True)


if __name__ == "__main__":
    main()
