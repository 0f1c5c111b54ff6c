"""What a number of the record decides, seen by two values of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from smartshoe.diagnosis import Thresholds

STANDARD = Thresholds()


def decides(field: str, low: object, high: object, of: Callable[[Thresholds], object]) -> tuple[object, object]:
    """What ``of`` answers with the number ``field`` at ``low`` and at ``high``."""
    return of(replace(STANDARD, **{field: low})), of(replace(STANDARD, **{field: high}))
