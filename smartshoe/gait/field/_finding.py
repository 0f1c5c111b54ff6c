"""`CheckResult`: the result of one check in the field, about a shoe or a unit."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

Verdict = Literal["ok", "warning", "fault", "unknown"]


@dataclass(frozen=True, slots=True)
class CheckResult:
    """The result of one check: its ``kind``, its ``verdict``, and one sentence, ``says``.

    ``unit`` is the unit or foot concerned ('' for all), ``span_s`` the time looked at, ``numbers`` further results by
    name. The verdict "unknown" means that the data do not allow the check.
    """

    kind: str
    verdict: Verdict
    says: str
    unit: str = ""
    span_s: tuple[float, float] | None = None
    numbers: Mapping[str, float] = field(default_factory=dict)

    def to_dict(self) -> dict[str, Any]:
        """The result as an object for JSON; numbers that are not finite become None."""
        return {
            "kind": self.kind,
            "verdict": self.verdict,
            "unit": self.unit,
            "span_s": None if self.span_s is None else list(self.span_s),
            "numbers": {name: float(x) if math.isfinite(x) else None for name, x in self.numbers.items()},
            "says": self.says,
        }
