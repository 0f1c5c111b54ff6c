"""Load from the pressure of a linear network of wall and gas; compiled on import."""

from __future__ import annotations

import numpy as np
from numba import njit

_LINE = "float64[::1]"


@njit(f"void({_LINE}, float64[:, ::1], {_LINE}, {_LINE}, float64, {_LINE}, {_LINE})", cache=True, error_model="numpy")
def unload(pressure, transition, drive, read, direct, state, load):  # type: ignore[no-untyped-def]
    """load_k = (pressure_k - read . s_k)/direct, s_(k+1) = transition s_k + drive load_k, into ``load`` (n,).

    ``transition`` (m, m), ``drive``, ``read`` (m,). ``state`` (m,) holds s and is updated, so that pushing block by
    block gives the same numbers.
    """
    m = state.size
    moved = np.empty(m)
    for k in range(pressure.size):
        value = pressure[k]
        for i in range(m):
            value -= read[i] * state[i]
        value /= direct
        load[k] = value
        for i in range(m):
            total = drive[i] * value
            for j in range(m):
                total += transition[i, j] * state[j]
            moved[i] = total
        for i in range(m):
            state[i] = moved[i]
