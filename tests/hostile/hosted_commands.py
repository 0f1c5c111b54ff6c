"""The process that forks commands with faults on their disk, and the law that all of them keep."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

from contract import LONGEST_LINE, STATUSES
from writing_commands import OLD, WRITING

KILLED = -9
Files = dict[str, bytes]


@dataclass(frozen=True, slots=True)
class Stopped:
    """How a command ended: its status (-9: killed), its steps on disk, its last line."""

    status: int
    steps: int
    says: str


class Host:
    """Runs `forked_commands`."""

    def __init__(self) -> None:
        self._process = subprocess.Popen(
            [sys.executable, str(Path(__file__).with_name("forked_commands.py"))],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
            env={**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"},
        )  # fmt: skip
        assert self._line() == "ready"

    def _line(self) -> str:
        assert self._process.stdout is not None
        return self._process.stdout.readline().strip()

    def run(
        self,
        words: str,
        folder: Path,
        step: int = 0,
        fault: int | str = "kill",
        after_s: float = 0.0,
        here: bool = False,
    ) -> Stopped:
        """Run ``words`` in ``folder``, with a ``fault`` at ``step`` or a kill ``after_s``, or in the host itself."""
        assert self._process.stdin is not None
        asked = {"folder": str(folder), "words": words.split(" "), "step": step, "fault": fault, "after_s": after_s,
                 "here": here}  # fmt: skip
        self._process.stdin.write(json.dumps(asked) + "\n")
        self._process.stdin.flush()
        status, steps, said = json.loads(self._line())
        assert "Traceback" not in said, said
        return Stopped(status, steps, said.rstrip("\n").rpartition("\n")[2])

    def close(self) -> None:
        """End it."""
        self._process.communicate()


def files_of(folder: Path) -> Files:
    """Every file that is no temporary one, by its name in ``folder``; the store's index only saves time.

    A MAT-file begins with the time at which it was written.
    """
    return {
        path.relative_to(folder).as_posix(): path.read_bytes()[124 if path.suffix == ".mat" else 0 :]
        for path in folder.rglob("*")
        if path.is_file() and not path.name.startswith(".") and path.name != "index.json"
    }


class Tried:
    """A command and what it comes to, undisturbed."""

    def __init__(self, host: Host, inputs: Path, root: Path, name: str) -> None:
        self.host, self.inputs, self.root, self.name = host, inputs, root, name
        self.about = WRITING[name]
        self._made = 0
        assert host.run(self.about.words, self.fresh(), here=True).status == 0
        whole = self.fresh()
        calm = host.run(self.about.words, whole)
        assert calm.status == 0, calm
        self.steps, self.final = calm.steps, files_of(whole)
        assert self.steps > 2

    def fresh(self) -> Path:
        """A folder with what the command reads, and results as they were."""
        self._made += 1
        folder = self.root / str(self._made)
        shutil.copytree(self.inputs, folder)
        for name in self.about.stood:
            (folder / name).parent.mkdir(exist_ok=True)
            (folder / name).write_bytes(OLD)
        return folder

    def stopped(self, step: int = 0, fault: int | str = "kill", after_s: float = 0.0) -> Stopped:
        """Run it with a fault: each file is then as it was or whole, and the command called again ends its work."""
        folder = self.fresh()
        before = files_of(folder)
        ended = self.host.run(self.about.words, folder, step, fault, after_s)
        where = (self.name, step, fault, ended)
        if ended.status != KILLED:
            self._keeps_the_contract(ended, folder)
        after = files_of(folder)
        assert before.keys() <= after.keys(), where
        if self.name == "calibrate":
            _is_recoverable(after, where)
        else:
            for name, content in after.items():
                whole = self.final.get(name)
                is_beginning = self.about.grows and whole is not None and whole.startswith(content)
                assert is_beginning or content in (before.get(name), whole), (*where, name)
        if ended.status != 0:
            self._ends_its_work(folder)
        shutil.rmtree(folder)
        return ended

    def _keeps_the_contract(self, ended: Stopped, folder: Path) -> None:
        where = (self.name, ended)
        assert ended.status in STATUSES, where
        assert not [path for path in folder.rglob("*") if ".partial" in path.name], where
        if ended.status:
            assert ended.says.startswith("error: "), where
            assert len(ended.says) < LONGEST_LINE, where
        elif self.name != "calibrate":
            assert files_of(folder) == self.final, where

    def _ends_its_work(self, folder: Path) -> None:
        words = [self.about.again] if self.about.again else []
        # A session that was stopped before its plan was there is begun anew.
        done = [self.host.run(said, folder).status for said in (*words, self.about.words)[:2]]
        assert 0 in done, (self.name, done)
        found = files_of(folder)
        if self.name == "calibrate":
            assert json.loads(found["o/result.json"])
        elif self.about.grows:
            assert found["p.csv"] == self.final["o.csv"]
        else:
            assert found == self.final, self.name


def _is_recoverable(files: Files, where: object) -> None:
    """Of a session: results are whole or not there (its journal has tests of its own)."""
    for name, content in files.items():
        if name.endswith(".json"):
            assert json.loads(content), where
        if name.endswith(".html"):
            assert content.rstrip().endswith(b"</html>"), where
