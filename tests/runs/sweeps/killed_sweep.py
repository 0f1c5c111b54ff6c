"""A sweep of `slow` cases on two processes, to be killed: ``python killed_sweep.py SCENARIO OUT``."""

from __future__ import annotations

import sys
from pathlib import Path

from small_sweeps import slow

from smartshoe.runs.sweeps._plan import read_plan
from smartshoe.runs.sweeps._running import sweep_plan

if __name__ == "__main__":
    sweep_plan(read_plan(sys.argv[1]), Path(sys.argv[2]), jobs=2, compute=slow)
