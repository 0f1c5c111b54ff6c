"""What holds of every command line, whatever it is given."""

from __future__ import annotations

import contextlib
import io
import resource
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from smartshoe.cli import run_command

STATUSES = (0, 2, 3, 4, 5)  # of the contract; 1 says that smartshoe itself is at fault
LONGEST_LINE = 420
LONGEST_S = 10.0  # of processor time
MOST_KIB = 1 << 20


@dataclass(frozen=True)
class Ended:
    """How a command ended."""

    status: int
    out: str
    err: str

    @property
    def last_line(self) -> str:
        return self.err.rstrip("\n").rpartition("\n")[2]


def _state(folder: Path, kept: Sequence[str]) -> dict[Path, int]:
    """When each file and folder changed; where folders named ``kept`` record what happens, only files outside them."""
    return {
        path: path.stat().st_mtime_ns
        for path in folder.rglob("*")
        if not kept or (path.is_file() and not set(kept) & set(path.relative_to(folder).parts))
    }


def _held_kib() -> int:
    """What this process holds now; 0 where the system does not tell."""
    pages = Path("/proc/self/statm")
    return int(pages.read_text().split()[1]) * resource.getpagesize() // 1024 if pages.exists() else 0


def ended(arguments: Sequence[str], folder: Path, kept: Sequence[str] = ()) -> Ended:
    """Run a command line in this process and hold it against the contract; ``folder`` is where it may write.

    Folders named ``kept`` (a session's, a store) may change though the command is refused.
    """
    before = _state(folder, kept)
    peak_kib, held_kib = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss, _held_kib()
    began_s = time.process_time()
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        status = run_command([str(argument) for argument in arguments])
    found = Ended(status, out.getvalue(), err.getvalue())
    assert status in STATUSES, found
    assert "Traceback" not in found.err
    assert time.process_time() - began_s < LONGEST_S, found
    # The peak is the process's own, and what earlier tests left in it is no command's.
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss <= max(peak_kib, held_kib + MOST_KIB), found
    if status != 0:
        assert found.last_line.startswith("error: "), found
        assert len(found.last_line) < LONGEST_LINE, found
        assert found.last_line.isprintable(), found
        assert _state(folder, kept) == before, "a refused command left or changed a file"
    assert not [path for path in folder.rglob("*") if "partial" in path.name]
    return found
