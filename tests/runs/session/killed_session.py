"""Runs sessions in forked children for the kill tests: a line ``SECONDS WHAT DIR`` starts one, killed after SECONDS.

Every sample that a child has shown is acknowledged by a line with the running count, after it was journaled.
"""

from __future__ import annotations

import os
import signal
import sys
import time
from pathlib import Path

from bench_sessions import bench_plan

from smartshoe.devices import Block
from smartshoe.runs.session import SessionFolder, Unattended, analyse, conduct, publish


class _Acknowledging(Unattended):
    def __init__(self) -> None:
        self._count = 0

    def show(self, block: Block, experiment: str, elapsed_s: float) -> None:
        self._count += len(block)
        os.write(1, f"{self._count}\n".encode())


def run(folder: Path, judged: bool) -> None:
    """A session, with result and report where it is ``judged``."""
    with SessionFolder.begin(folder, bench_plan()) as session:
        conduct(session, _Acknowledging())
        if judged:
            publish(analyse(session), folder)


def main() -> None:
    """Fork a child for every line of stdin; 0 seconds let it end."""
    # What is imported late is imported here, so that a child's time is the session's.
    import smartshoe.identification
    import smartshoe.report.calibration  # noqa: F401

    print("ready", flush=True)
    for line in sys.stdin:
        wait_s, what, folder = line.strip().split(" ", 2)
        began = time.perf_counter()
        child = os.fork()
        if child == 0:
            run(Path(folder), what == "judged")
            os.write(1, b"done\n")
            os._exit(0)
        time.sleep(max(0.0, float(wait_s) - (time.perf_counter() - began)))
        if float(wait_s) > 0.0:
            os.kill(child, signal.SIGKILL)  # not waited for yet, so that its number is still its own
        os.waitpid(child, 0)
        os.write(1, b"ended\n")


if __name__ == "__main__":
    main()
