"""Parses JSON from outside: finite numbers, bounded depth and size."""

from __future__ import annotations

import json
import math
from typing import Any

from smartshoe.files.gate.limits import limits

_MOST_DIGITS = 400  # of a number as written; float64 has at most 309 before the point


def parsed_json(text: str | bytes) -> Any:
    """The JSON ``text`` as Python objects.

    Raises `ValueError` for invalid JSON, for NaN, infinity and numbers beyond float64, and where size or depth exceed
    the limits.
    """
    if len(text) > limits().json_bytes:
        raise ValueError(f"it has more than {limits().json_bytes} bytes")
    try:
        found = json.loads(text, parse_constant=_refused, parse_float=_finite, parse_int=_whole)
    except RecursionError:
        raise ValueError("it is nested too deep") from None
    _require_shallow(found)
    return found


def _refused(text: str) -> float:
    raise ValueError(f"it holds {text}")


def _finite(text: str) -> float:
    value = float(text)
    if not math.isfinite(value):
        raise ValueError(f"it holds {text[:20]}, which is beyond any number")
    return value


def _whole(text: str) -> int:
    if len(text) > _MOST_DIGITS or not math.isfinite(float(text)):
        raise ValueError(f"it holds a number of {len(text)} digits")
    return int(text)


def _require_shallow(found: Any) -> None:
    layer, deepest = [found], limits().json_depth
    for _ in range(deepest):
        inner = [item for item in layer if isinstance(item, dict | list)]
        if not inner:
            return
        layer = [item for each in inner for item in (each.values() if isinstance(each, dict) else each)]
    raise ValueError(f"it is nested deeper than {deepest}")
