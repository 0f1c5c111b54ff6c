"""Loads of straight lines, for tests that count samples."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def course(*corners: tuple[int, float]) -> Array:
    """Straight lines of so many steps to such a load."""
    parts, at = [np.zeros(1)], 0.0
    for steps, share in corners:
        parts.append(np.linspace(at, share, steps + 1)[1:])
        at = share
    return np.concatenate(parts)
