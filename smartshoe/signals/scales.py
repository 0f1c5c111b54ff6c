"""Scales that round nothing, for squares and sums of numbers however large or small."""

from __future__ import annotations

import numpy as np

from smartshoe.arrays import Array


def power_of_two(values: Array) -> float:
    """What brings the largest of ``values`` to about one, without rounding any: the square of 1e300 is no number."""
    _, exponent = np.frexp(np.max(np.abs(values)))
    return float(np.ldexp(1.0, -max(int(exponent), -1000)))
