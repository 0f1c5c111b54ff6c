"""A compiled state that reverses gradually along the path travelled: a direction of motion that changes smoothly."""

from __future__ import annotations

import math

from numba import njit

from smartshoe.arrays import Array


@njit(cache=True)
def follow(step: Array, width: Array, start: float, out: Array) -> None:
    """Fill ``out`` (n,) with s, ds = (sgn(dx) - s) |dx|/``width``, exact for each ``step`` and ``width`` (n,)."""
    s = start
    for i in range(step.size):
        if step[i] != 0.0:
            sense = 1.0 if step[i] > 0.0 else -1.0
            s = sense + (s - sense) * math.exp(-abs(step[i]) / width[i])
        out[i] = s
