"""`Parameter`: a number with its uncertainty and unit."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from smartshoe.signals.noise import NORMAL_95


def finite_or_none(value: float) -> float | None:
    """``value`` as a plain float, None where it is not finite (JSON has no NaN)."""
    return float(value) if math.isfinite(value) else None


@dataclass(frozen=True, slots=True)
class Parameter:
    """``value`` in ``unit`` with standard deviation ``sd`` (0 where fixed) and 95 % confidence interval ``ci95``."""

    value: float
    sd: float
    ci95: tuple[float, float]
    unit: str

    @classmethod
    def from_sd(cls, value: float, sd: float, unit: str, quantile: float = NORMAL_95) -> Parameter:
        """A parameter whose interval is ``value`` plus and minus ``quantile`` standard deviations."""
        return cls(float(value), float(sd), (float(value - quantile * sd), float(value + quantile * sd)), unit)

    def to_dict(self) -> dict[str, Any]:
        """The contract's object: value, sd, ci95, unit; None where a number is not finite."""
        return {
            "value": finite_or_none(self.value),
            "sd": finite_or_none(self.sd),
            "ci95": [finite_or_none(bound) for bound in self.ci95],
            "unit": self.unit,
        }
