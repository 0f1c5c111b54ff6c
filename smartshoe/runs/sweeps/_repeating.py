"""The command that repeats one case of a sweep."""

from __future__ import annotations

import datetime
import json
import shlex
from collections.abc import Mapping
from typing import Any

from smartshoe.runs.sweeps._plan import SweepPlan


def command_of(plan: SweepPlan, case: int) -> str:
    """The ``smartshoe run`` command with the seed and the values of a case (0-based)."""
    words = ["smartshoe", "run", str(plan.source.path), "--seed", str(plan.design.seed(case))]
    for key, value in plan.design.values(case).items():
        words += ["--set", f"{key}={toml_text(value)}"]
    return shlex.join([*words, "--out", f"out/{plan.name(case)}"])


def toml_text(value: Any) -> str:
    """A value in TOML syntax, on one line."""
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{json.dumps(str(k))} = {toml_text(v)}" for k, v in value.items()) + "}"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(toml_text(each) for each in value) + "]"
    if isinstance(value, datetime.date | datetime.time):
        return value.isoformat()
    return repr(value) if isinstance(value, float) else json.dumps(value, ensure_ascii=False)
