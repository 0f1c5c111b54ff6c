"""`Flag`: what a person should know before trusting a number, in one sentence, with the times it concerns."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from smartshoe.arrays import Array, Mask
from smartshoe.signals.masks import runs_of

MOST_SPANS = 3
JOINED_S = 0.5  # spans that are less than this apart are joined


@dataclass(frozen=True, slots=True)
class Flag:
    """A warning. ``kind`` is a fixed word for scripts; ``foot`` and ``unit`` are None if it concerns no single one."""

    kind: str
    says: str
    foot: str | None = None
    unit: str | None = None
    where: str = "all"

    def to_dict(self) -> dict[str, Any]:
        """The flag as an object for JSON."""
        return {"kind": self.kind, "foot": self.foot, "unit": self.unit, "where": self.where, "says": self.says}


def spans_of(time_s: Array, mask: Mask) -> list[tuple[float, float]]:
    """Begin and end in s of each run of True in ``mask`` (n,); runs less than `JOINED_S` apart are joined."""
    first, after = runs_of(mask)
    spans: list[tuple[float, float]] = []
    for start, stop in zip(time_s[first], time_s[after - 1], strict=True):
        if spans and start - spans[-1][1] < JOINED_S:
            spans[-1] = (spans[-1][0], float(stop))
        else:
            spans.append((float(start), float(stop)))
    return spans


def where_text(spans: Sequence[tuple[float, float]]) -> str:
    """The first few time spans as text, with "and 12 more, to 118.2 s" for the rest."""
    said = ", ".join(f"{start:.1f}-{stop:.1f} s" for start, stop in spans[:MOST_SPANS])
    more = len(spans) - MOST_SPANS
    return said if more <= 0 else f"{said} and {more} more, to {spans[-1][1]:.1f} s"
