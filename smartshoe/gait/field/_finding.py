"""`CheckResult`: what a check in the field has to say of a shoe or a unit, typed, with one sentence."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

Verdict = Literal["ok", "warning", "fault", "unknown"]


@dataclass(frozen=True, slots=True)
class CheckResult:
    """``kind`` of check, its ``verdict``, the ``unit`` (or foot; '' for all), ``span_s`` of time, ``numbers`` by name.

    "unknown" is a check that the data cannot carry out; ``says`` tells why.
    """

    kind: str
    verdict: Verdict
    says: str
    unit: str = ""
    span_s: tuple[float, float] | None = None
    numbers: Mapping[str, float] = field(default_factory=dict)

    def to_dict(self) -> dict[str, Any]:
        """The finding for JSON."""
        return {
            "kind": self.kind,
            "verdict": self.verdict,
            "unit": self.unit,
            "span_s": None if self.span_s is None else list(self.span_s),
            "numbers": {name: float(x) if math.isfinite(x) else None for name, x in self.numbers.items()},
            "says": self.says,
        }
