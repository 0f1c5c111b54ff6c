"""Arrays by what they hold; their shapes stand in the docstrings, ``(n,)`` for n samples, ``(n, r)`` for r columns."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from smartshoe.errors import InputError, UsageError

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Index = NDArray[np.intp]
Integers = NDArray[np.int64]


def numbers_of(values: ArrayLike, what: str) -> Array:
    """``values`` as real numbers, not copied where they are; raises `InputError` naming ``what`` where they are none.

    None counts as NaN, as in a table read elsewhere.
    """
    try:
        kind = getattr(getattr(values, "dtype", None), "kind", None) or np.asarray(values).dtype.kind
        if kind == "c":  # numpy would drop the imaginary part
            raise TypeError("complex numbers")
        if kind in "mM":  # numpy would count nanoseconds, or days
            raise TypeError("dates or durations: seconds are (t - t[0]) / numpy.timedelta64(1, 's')")
        return np.asarray(values, dtype=float)
    except (TypeError, ValueError) as error:
        raise InputError(f"{what}: not all are real numbers ({error}): give these, NaN where one is missing") from error


def require_positive(value: Any, name: str) -> float:
    """``value`` as a finite number above 0; raises `UsageError` naming it where it is none."""
    try:
        number = float(value)
    except (TypeError, ValueError):
        raise UsageError(f"{name} is {value!r}: give a positive number") from None
    if not (np.isfinite(number) and number > 0.0):
        raise UsageError(f"{name} is {number:g}: give a positive number")
    return number
