"""Numbers as a person reads them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any


def number(value: float | None, digits: int = 3) -> str:
    """``value`` to ``digits`` significant digits; a dash where there is none."""
    if value is None or not math.isfinite(value):
        return "–"
    if value == 0:
        return "0"
    places = digits - 1 - math.floor(math.log10(abs(value)))
    if -3 <= places <= 7:
        return f"{round(value, places):.{max(places, 0)}f}"
    return f"{value:.{digits - 1}e}"


def with_sd(parameter: Mapping[str, Any] | None) -> str:
    """``value ± sd``: the error bar to two significant digits, the value to the same place."""
    value = None if parameter is None else parameter.get("value")
    if parameter is None or value is None:
        return "–"
    sd = parameter.get("sd")
    if sd is None or not math.isfinite(sd):
        return number(value, 5)
    if sd == 0:
        return f"{number(value, 5)} (fixed)"
    places = 1 - math.floor(math.log10(sd))
    if -3 <= places <= 9:
        return f"{round(value, places):.{max(places, 0)}f} ± {round(sd, places):.{max(places, 0)}f}"
    return f"{value:.4e} ± {sd:.1e}"


def verdict(overall: Mapping[str, Any]) -> str:
    """One sentence: what the compensation does beyond a straight line."""
    static, after = overall.get("rmse_static_n"), overall.get("rmse_compensated_n")
    if static is None or after is None:
        return "There is nothing to compare."
    if after > static:
        return f"Compensation is worse than a straight line: {number(after)} N against {number(static)} N."
    gain = number(overall.get("improvement_over_static_percent"), 2)
    return f"Compensation leaves {number(after)} N rms where the best straight line leaves {number(static)} N ({gain} % less)."
