"""Numbers for a person to read, with as many digits as the error bar justifies."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any


def plain(value: float | None, digits: int = 3) -> str:
    """``value`` with ``digits`` significant digits; a dash if it is None or not finite."""
    if value is None or not math.isfinite(value):
        return "–"
    if value == 0:
        return "0"
    decimals = max(0, digits - 1 - math.floor(math.log10(abs(value))))
    return f"{value:.{decimals}f}" if decimals <= 6 else f"{value:.{digits}g}"


def with_unit(number: str, unit: str) -> str:
    """A number with its unit; without the unit if that is "1"."""
    return number if unit == "1" else f"{number} {unit}"


def with_sd(parameter: Mapping[str, Any]) -> str:
    """``value ± sd``, both rounded to the two leading digits of the sd."""
    value, sd = parameter.get("value"), parameter.get("sd")
    if value is None:
        return "–"
    if sd is None or not math.isfinite(sd) or sd == 0:
        return plain(value, 5)
    decimals = 1 - math.floor(math.log10(sd))
    if decimals > 8 or abs(value) >= 1e7:
        return f"{value:.6g} ± {sd:.2g}"
    return f"{value:.{max(decimals, 0)}f} ± {sd:.{max(decimals, 0)}f}"
