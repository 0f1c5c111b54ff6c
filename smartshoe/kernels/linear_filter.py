"""A linear filter like `scipy.signal.lfilter`, whose import would take longer than a calibration."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import ArrayLike

from smartshoe.arrays import Array


@njit(cache=True)
def run(numerator, denominator, values, state, out):  # type: ignore[no-untyped-def]
    """Filter in transposed direct form II; ``state`` (order,) is the initial state and is updated."""
    order = state.size
    if order == 1:
        b0, b1, a1, z = numerator[0], numerator[1], denominator[1], state[0]
        for k in range(values.size):
            x = values[k]
            y = z + b0 * x
            z = x * b1 - y * a1
            out[k] = y
        state[0] = z
        return
    for k in range(values.size):
        x = values[k]
        y = numerator[0] * x
        if order > 0:
            y += state[0]
            for j in range(order - 1):
                state[j] = state[j + 1] + x * numerator[j + 1] - y * denominator[j + 1]
            state[order - 1] = x * numerator[order] - y * denominator[order]
        out[k] = y


def linear_filter(
    numerator: ArrayLike, denominator: ArrayLike, values: Array, state: ArrayLike | None = None
) -> tuple[Array, Array]:
    """``values`` (n,) filtered by numerator/denominator (in powers z^-k, constant first), and the final state.

    ``state`` (order,) is the initial state, by default zeros: `scipy.signal.lfilter`'s ``zi``. The results equal
    lfilter's, bit for bit.
    """
    b, a = np.array(numerator, dtype=float), np.array(denominator, dtype=float)
    if b.size != a.size or a[0] != 1.0:
        size = max(b.size, a.size)
        b, a = np.append(b, np.zeros(size - b.size)) / a[0], np.append(a, np.zeros(size - a.size)) / a[0]
    left = np.zeros(b.size - 1) if state is None else np.array(state, dtype=float)
    given = np.array(values, dtype=float)  # a writeable copy: numba would compile again for read-only arrays
    out = np.empty(given.size)
    run(b, a, given, left, out)
    return out, left
