"""What a person should know before trusting a number: one sentence, and where."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from smartshoe.arrays import Array, Mask
from smartshoe.signals.masks import runs_of

MOST_SPANS = 3
JOINED_S = 0.5  # spans less than that apart are one


@dataclass(frozen=True, slots=True)
class Flag:
    """``kind`` is the word that scripts rely on; ``foot`` and ``unit`` None where it concerns no one in particular."""

    kind: str
    says: str
    foot: str | None = None
    unit: str | None = None
    where: str = "all"

    def to_dict(self) -> dict[str, Any]:
        """The contract's form."""
        return {"kind": self.kind, "foot": self.foot, "unit": self.unit, "where": self.where, "says": self.says}


def spans_of(time_s: Array, mask: Mask) -> list[tuple[float, float]]:
    """Begin and end in s of the runs of True, those less than `JOINED_S` apart as one."""
    first, after = runs_of(mask)
    spans: list[tuple[float, float]] = []
    for start, stop in zip(time_s[first], time_s[after - 1], strict=True):
        if spans and start - spans[-1][1] < JOINED_S:
            spans[-1] = (spans[-1][0], float(stop))
        else:
            spans.append((float(start), float(stop)))
    return spans


def where_text(spans: Sequence[tuple[float, float]]) -> str:
    """The first few time spans as text; "and 12 more, to 118.2 s" for the rest."""
    said = ", ".join(f"{start:.1f}-{stop:.1f} s" for start, stop in spans[:MOST_SPANS])
    more = len(spans) - MOST_SPANS
    return said if more <= 0 else f"{said} and {more} more, to {spans[-1][1]:.1f} s"
