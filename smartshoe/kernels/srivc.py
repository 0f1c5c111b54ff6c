"""Passes over an experiment for SRIVC: its inner products, and those for the initial search of the delay."""

from __future__ import annotations

import numpy as np
from numba import njit

from smartshoe.kernels.first_order import CHUNK, COLUMNS, add_products, hold, leave_out, recur

INSTRUMENT, REGRESSOR, TARGET = 0, 5, 6  # columns; 1 to 4 are both instruments and regressors
_LAX = {"reassoc", "contract", "nsz"}


@njit(cache=True, fastmath=_LAX)
def instrument_products(u, y, x, counted, step_s, uneven, pole, out):  # type: ignore[no-untyped-def]
    """Add the inner products (COLUMNS, COLUMNS) of SRIVC's filtered signals over counted samples to ``out``.

    ``u``, ``y``, ``x`` (n,) input, output and the instrument's output, ``counted`` (n,) bool or size 0 for all,
    ``step_s`` and ``uneven`` as in `inner_products`. With f = pole/(s + pole) the columns are the instrument
    -f x/pole, then u - f u, f u/pole, 1 and exp(-pole t), the regressor -f y/pole and the target y - f y.
    """
    n = u.size
    columns = np.empty((COLUMNS, CHUNK))
    instrument, rest, lag, ones = columns[0], columns[1], columns[2], columns[3]
    fading, regressor, target = columns[4], columns[5], columns[6]
    E, A, B, _, _, _ = hold(pole, step_s)
    u_slow, y_slow, x_slow, fade = u[0], y[0], x[0], 1.0
    u_last, y_last, x_last = u[0], y[0], x[0]
    for at in range(0, n, CHUNK):
        m = min(CHUNK, n - at)
        us, ys, xs = u[at:], y[at:], x[at:]
        if uneven is None:
            lag[0], regressor[0] = A * us[0] + B * u_last, A * ys[0] + B * y_last
            instrument[0] = A * xs[0] + B * x_last
            for j in range(1, m):
                lag[j] = A * us[j] + B * us[j - 1]
            for j in range(1, m):
                regressor[j] = A * ys[j] + B * ys[j - 1]
            for j in range(1, m):
                instrument[j] = A * xs[j] + B * xs[j - 1]
            u_slow, y_slow, x_slow = recur(E, 0.0, u_slow, y_slow, x_slow, lag, regressor, instrument, m)
            for j in range(m):
                fading[j] = fade
                fade *= E
        else:
            for j in range(m):
                if at + j > 0:
                    E, A, B, _, _, _ = hold(pole, uneven[at + j - 1])
                    u_slow = E * u_slow + (A * us[j] + B * u_last)
                    y_slow = E * y_slow + (A * ys[j] + B * y_last)
                    x_slow = E * x_slow + (A * xs[j] + B * x_last)
                    fade *= E
                u_last, y_last, x_last = us[j], ys[j], xs[j]
                lag[j], regressor[j], instrument[j], fading[j] = u_slow, y_slow, x_slow, fade
        u_last, y_last, x_last = us[m - 1], ys[m - 1], xs[m - 1]
        for j in range(m):
            ones[j] = 1.0
            rest[j] = us[j] - lag[j]
            lag[j] /= pole
        for j in range(m):
            target[j] = ys[j] - regressor[j]
            regressor[j] /= -pole
        for j in range(m):
            instrument[j] /= -pole
        if counted.size > 0:
            leave_out(counted[at:], columns, m)
        add_products(columns, m, out)


@njit(cache=True, fastmath=_LAX)
def delayed_products(u, w, y, inside, stride, out):  # type: ignore[no-untyped-def]
    """Sums over the m samples of ``y`` and ``inside`` with u and w, shifted by another ``stride`` samples per row.

    ``out`` (shifts, 7) receives the sums of u, w, u u, u w, w w where inside (m,) is 1, and of u y and w y.
    """
    m = y.size
    for row in range(out.shape[0]):
        a, b = u[row * stride : row * stride + m], w[row * stride : row * stride + m]
        of_u = of_w = uu = uw = ww = uy = wy = 0.0
        for j in range(m):
            p, q = a[j] * inside[j], b[j] * inside[j]
            of_u += p
            of_w += q
            uu += p * a[j]
            uw += p * b[j]
            ww += q * b[j]
            uy += a[j] * y[j]
            wy += b[j] * y[j]
        out[row, 0], out[row, 1], out[row, 2], out[row, 3] = of_u, of_w, uu, uw
        out[row, 4], out[row, 5], out[row, 6] = ww, uy, wy
