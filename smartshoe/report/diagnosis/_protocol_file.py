"""Writes a protocol as a table of a scenario, which can be run as it is."""

from __future__ import annotations

import json
import re
import textwrap
import tomllib
from collections.abc import Sequence
from pathlib import Path

from smartshoe.protocol import Protocol

_OURS = "# proposed by a diagnosis; its next run in this folder replaces this file or takes it away"


def table_name(name: str) -> str:
    """``name`` as a bare TOML key that is also a file's stem: letters, digits, - and _."""
    return re.sub(r"[^A-Za-z0-9_-]+", "_", name).strip("_") or "next_experiment"


def protocol_text(steps: Protocol, comments: Sequence[str] = ()) -> str:
    """The protocol as ``[protocol.NAME]`` with its corners (time in s, load in N), after ``comments`` as lines.

    The text can be pasted into a scenario; NAME is the protocol's name, made a bare key. The first line is that by
    which `earlier_protocols` knows the file.
    """
    lines = [_OURS, *(f"# {line}" for comment in comments for line in textwrap.wrap(comment, 110))]
    lines += [f"[protocol.{table_name(steps.name)}]", 'kind = "segments"', "corners = ["]
    for time_s, load_n in zip(*steps.corners(), strict=True):
        lines.append(f"    [{_number(time_s)}, {_number(load_n)}],")
    return "\n".join([*lines, "]"]) + "\n"


def earlier_protocols(folder: Path) -> list[Path]:
    """The files in ``folder`` that are as `protocol_text` wrote them: none that was renamed or made a scenario of."""
    return [path for path in sorted(folder.glob("*.toml")) if _is_ours(path)]


def _is_ours(path: Path) -> bool:
    try:
        text = path.read_text(encoding="utf-8")
        tables = tomllib.loads(text)
    except (OSError, ValueError):  # such as a folder of that name, or no TOML
        return False
    return text.startswith(_OURS) and list(tables) == ["protocol"] and list(tables["protocol"]) == [path.stem]


def _number(value: float) -> str:
    return json.dumps(round(float(value), 9))
