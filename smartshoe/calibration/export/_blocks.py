"""Facts about a block's C text that the templates need."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any

from smartshoe.models.effects.effect import CStep

_READS = re.compile(r"\bt\b")
_OWN = re.compile(r"\b(?:double|float|int64_t) t\b")  # a local variable of that name


def reads_time(body: str) -> bool:
    """Whether a block's code reads the time ``t``."""
    return _READS.search(body) is not None and _OWN.search(body) is None


def described(blocks: Sequence[tuple[str, CStep]]) -> list[dict[str, Any]]:
    """Name, body and use of the time, for each block with any code."""
    return [
        {"name": name, "body": step.body, "needs_time": reads_time(step.body)} for name, step in blocks if step.body
    ]
