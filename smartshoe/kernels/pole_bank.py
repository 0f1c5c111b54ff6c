"""One input through many first-order lags at once; the plain twin is `smartshoe.models.first_order.lag`."""

from __future__ import annotations

import numpy as np
from numba import njit

from smartshoe.kernels.first_order import hold


@njit(cache=True)
def lag_bank(u, at, poles, step, last_u, last_at, lags, out):  # type: ignore[no-untyped-def]
    """w = pole/(s + pole) u under first-order hold into ``out`` (n, p); its final values into ``lags`` (p,).

    ``u`` (n,) is at the increasing whole times ``at`` (n,) of ``step`` s, ``poles`` (p,) in 1/s; ``last_u`` at
    ``last_at`` and ``lags`` are the state before. A gap is one long straight line, for which the hold is exact.
    """
    count = poles.size
    even, wide = np.empty((3, count)), np.empty((3, count))
    for i in range(count):
        even[0, i], even[1, i], even[2, i] = hold(poles[i], step)[:3]
    for k in range(u.size):
        gap = at[k] - last_at
        row = even
        if gap != 1:
            for i in range(count):
                wide[0, i], wide[1, i], wide[2, i] = hold(poles[i], gap * step)[:3]
            row = wide
        for i in range(count):
            lags[i] = row[0, i] * lags[i] + row[1, i] * u[k] + row[2, i] * last_u
            out[k, i] = lags[i]
        last_u, last_at = u[k], at[k]
