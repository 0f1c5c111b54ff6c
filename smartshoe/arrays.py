"""Array types by content; docstrings give their shapes, ``(n,)`` for n samples, ``(n, r)`` for r columns."""

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
    """``values`` as an array of real numbers, without a copy if possible.

    Raises `InputError` naming ``what`` otherwise. None counts as NaN, as in tables read by other libraries, and so does
    what a masked array hides.
    """
    try:
        given: Any = values if hasattr(getattr(values, "dtype", None), "kind") else np.asarray(values)
        if isinstance(given, np.ma.MaskedArray) and given.dtype.kind in "biufO":
            given = np.where(np.ma.getmaskarray(given), np.nan, given.data)  # numpy would use what the mask hides
        kinds = {given.dtype.kind}
        if "O" in kinds:
            of_each_type = {type(one): one for one in np.ravel(given) if one is not None}
            kinds = {np.asarray(one).dtype.kind for one in of_each_type.values()}
        if "c" in kinds:  # numpy would drop the imaginary part
            raise TypeError("complex numbers")
        if kinds & set("mM"):  # numpy would convert to nanoseconds, or days
            raise TypeError("dates or durations: seconds are (t - t[0]) / numpy.timedelta64(1, 's')")
        if kinds & set("SU"):  # numpy would parse the text
            raise TypeError("text")
        if values is None:
            raise TypeError("None")
        return np.asarray(given, dtype=float)
    except (TypeError, ValueError) as error:
        raise InputError(f"{what}: not all are real numbers ({error}): give these, NaN where one is missing") from error


def require_positive(value: Any, name: str) -> float:
    """``value`` as a finite number above 0; raises `UsageError` naming ``name`` otherwise."""
    try:
        number = float(value)
    except (TypeError, ValueError):
        raise UsageError(f"{name} is {value!r}: give a positive number") from None
    if not (np.isfinite(number) and number > 0.0):
        raise UsageError(f"{name} is {number:g}: give a positive number")
    return number
