"""Writes a protocol as a table of a scenario, which can be run as it is."""

from __future__ import annotations

import json
import re
import textwrap
from collections.abc import Sequence

from smartshoe.protocol import Protocol


def table_name(name: str) -> str:
    """``name`` as a bare TOML key that is also a file's stem: letters, digits, - and _."""
    return re.sub(r"[^A-Za-z0-9_-]+", "_", name).strip("_") or "next_experiment"


def protocol_text(steps: Protocol, comments: Sequence[str] = ()) -> str:
    """The protocol as ``[protocol.NAME]`` with its corners (time in s, load in N), after ``comments`` as lines.

    The text can be pasted into a scenario; NAME is the protocol's name, made a bare key.
    """
    lines = [f"# {line}" for comment in comments for line in textwrap.wrap(comment, 110)]
    lines += [f"[protocol.{table_name(steps.name)}]", 'kind = "segments"', "corners = ["]
    for time_s, load_n in zip(*steps.corners(), strict=True):
        lines.append(f"    [{_number(time_s)}, {_number(load_n)}],")
    return "\n".join([*lines, "]"]) + "\n"


def _number(value: float) -> str:
    return json.dumps(round(float(value), 9))
