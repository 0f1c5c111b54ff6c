"""One pass over an experiment: error and gradient of the first-order model, kept only as their inner products.

The slow twin, with which the tests compare, is `smartshoe.identification.prediction_error`.
"""

from __future__ import annotations

import numpy as np
from numba import njit

CHUNK = 256  # samples whose columns stay in the first-level cache
COLUMNS = 7  # d/d ln alpha, d/d p1, d/d p2, d/d delay, d/d offset, d/d start, error
_LAX = {"reassoc", "contract", "nsz"}  # sums may be reordered; nothing is assumed of NaN


@njit(cache=True, fastmath=_LAX)
def _recur(decay, last, drive, m):  # type: ignore[no-untyped-def]
    """x_j = decay x_(j-1) + drive_j in place, four samples at a time so that one need not wait for the other."""
    d2 = decay * decay
    d3, d4 = d2 * decay, d2 * d2
    whole = m // 4 * 4
    for j in range(0, whole, 4):
        x0 = drive[j]
        x1 = decay * x0 + drive[j + 1]
        x2 = decay * x1 + drive[j + 2]
        x3 = decay * x2 + drive[j + 3]
        drive[j] = decay * last + x0
        drive[j + 1] = d2 * last + x1
        drive[j + 2] = d3 * last + x2
        last = d4 * last + x3
        drive[j + 3] = last
    for j in range(whole, m):
        last = decay * last + drive[j]
        drive[j] = last
    return last


@njit(cache=True, fastmath=_LAX)
def inner_products(  # type: ignore[no-untyped-def]
    u, slope, y, counted, steps, holds, alpha, p1, p2, offset, start, active, out
):
    """Add the inner products (COLUMNS, COLUMNS) of gradient and error over counted samples to ``out``.

    ``u`` (n,) input, ``slope`` (n,) its derivative with respect to the delay (or size 0), ``y`` (n,) output,
    ``counted`` (n,) bool or size 0 for all, ``steps`` (1,) or (n - 1,) in s, ``holds`` (1 or n - 1, 6) rows E, A, B
    of `models.first_order.hold_coefficients` and their derivatives with respect to alpha. ``active`` (c,) the
    columns wanted, rising, the error's last. Only the upper triangle of ``out`` is filled. The model is
    y = p1 (u - w) + p2 w + offset + start exp(-alpha t) with w = alpha/(s + alpha) u.
    """
    n = u.size
    even = steps.size == 1
    delayed = slope.size > 0
    masked = counted.size > 0
    columns = np.empty((COLUMNS, CHUNK))
    lag, drift, slow = np.empty(CHUNK), np.empty(CHUNK), np.empty(CHUNK)
    fades, times = np.empty(CHUNK), np.empty(CHUNK)
    E, A, B, dE, dA, dB = holds[0]
    fades[0], times[0] = 1.0, 0.0
    if even:
        for j in range(1, CHUNK):
            fades[j] = fades[j - 1] * E
            times[j] = j * steps[0]
    u_last = w = u[0]
    v = 0.0
    s_last = ws = slope[0] if delayed else 0.0
    fade, time_s = 1.0, 0.0
    drop = p2 - p1
    at = 0
    while at < n:
        m = min(CHUNK, n - at)
        if even:
            # The first sample of all repeats u[0], which leaves the steady start as it is.
            lag[0] = A * u[at] + B * u_last
            for j in range(1, m):
                lag[j] = A * u[at + j] + B * u[at + j - 1]
            w_last = w
            w = _recur(E, w, lag, m)
            drift[0] = dE * w_last + dA * u[at] + dB * u_last
            for j in range(1, m):
                drift[j] = dE * lag[j - 1] + dA * u[at + j] + dB * u[at + j - 1]
            v = _recur(E, v, drift, m)
            if delayed:
                slow[0] = A * slope[at] + B * s_last
                for j in range(1, m):
                    slow[j] = A * slope[at + j] + B * slope[at + j - 1]
                ws = _recur(E, ws, slow, m)
                s_last = slope[at + m - 1]
            u_last = u[at + m - 1]
            for j in range(m):
                columns[4, j] = time_s + times[j]
                columns[5, j] = fade * fades[j]
            fade *= fades[m - 1] * E
            time_s += m * steps[0]
        else:
            for j in range(m):
                k = at + j
                if k > 0:
                    E, A, B, dE, dA, dB = holds[k - 1]
                    v = E * v + (dE * w + dA * u[k] + dB * u_last)
                    w = E * w + (A * u[k] + B * u_last)
                    if delayed:
                        ws = E * ws + (A * slope[k] + B * s_last)
                    fade *= E
                    time_s += steps[k - 1]
                u_last = u[k]
                if delayed:
                    s_last = slope[k]
                lag[j], drift[j], slow[j] = w, v, ws
                columns[4, j], columns[5, j] = time_s, fade
        for j in range(m):
            k = at + j
            columns[0, j] = alpha * (drop * drift[j] - start * columns[4, j] * columns[5, j])
            columns[1, j] = u[k] - lag[j]
            columns[2, j] = lag[j]
            columns[6, j] = p1 * (u[k] - lag[j]) + p2 * lag[j] + offset + start * columns[5, j] - y[k]
            columns[4, j] = 1.0
        if delayed:
            for j in range(m):
                columns[3, j] = p1 * slope[at + j] + drop * slow[j]
        if masked:
            for j in range(m):
                if not counted[at + j]:
                    columns[:, j] = 0.0
        for i in range(active.size):
            left = columns[active[i]]
            for k in range(i, active.size):
                right = columns[active[k]]
                total = 0.0
                for j in range(m):
                    total += left[j] * right[j]
                out[active[i], active[k]] += total
        at += m
