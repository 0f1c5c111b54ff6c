"""A sweep of cheap cases, and a computation of them that takes no time."""

from __future__ import annotations

import json
import os
import time
from pathlib import Path

from smartshoe.runs.sweeps._case import computed
from smartshoe.runs.sweeps._plan import Case

SMALL = """\
title = "small"
seed = 3

[machine]
backend = "sim:instron"

[protocol.dynamic]
rates_n_per_s = [800.0]

[[unit]]
name = "left_toe"

[sweep]
seeds = [0, 1]

[sweep.vary]
"unit.left_toe.bladder.k1" = [1.2, 1.5]
"""


def write_scenario(folder: Path, text: str = SMALL) -> Path:
    path = folder / "small.toml"
    path.write_text(text, encoding="utf-8")
    return path


def empty(case: Case) -> str:
    """A case's text without running it."""
    figures = {"left_toe.rmse_compensated_n": float(case.seed) + float(case.values["unit.left_toe.bladder.k1"])}
    return json.dumps({"status": "done", "says": None, "figures": figures})


def slow(case: Case) -> str:
    """The case computed, after 20 ms in which a kill finds it at work; told in two files when it begins and ends."""
    _tell("SWEEP_BEGAN", case)
    time.sleep(0.02)
    text = empty(case) if "SWEEP_EMPTY" in os.environ else computed(case)
    _tell("SWEEP_ENDED", case)
    return text


def _tell(file: str, case: Case) -> None:
    with Path(os.environ[file]).open("a", encoding="utf-8") as told:
        told.write(f"{case.name}\n")
