"""Effects of a sensor and a logger on a signal, where each sample needs its own weights."""

from __future__ import annotations

import math

import numpy as np
from numba import njit


@njit(cache=True, fastmath={"reassoc", "contract", "nsz"})
def at_places(u, late, weights, out):  # type: ignore[no-untyped-def]
    """out[k] = u interpolated at k - late[k], in samples; beyond its ends u keeps its end values.

    ``u``, ``late``, ``out`` (n,). ``weights`` (m + 1, 16) are those of the neighbours -7 ... 8 of a position at the
    fractions 0, 1/m, ... 1 past a sample; they are interpolated between two fractions. ``out`` is overwritten.
    """
    n, fractions = u.size, weights.shape[0] - 1
    for k in range(n):
        place = k - late[k]
        whole = math.floor(place)
        fine = (place - whole) * fractions
        row = min(int(fine), fractions - 1)
        share = fine - row
        first = int(whole) - 7
        total = 0.0
        if first >= 0 and first + 16 <= n:
            near, far = 0.0, 0.0
            for j in range(16):
                near += weights[row, j] * u[first + j]
                far += weights[row + 1, j] * u[first + j]
            total = near + share * (far - near)
        else:
            for j in range(16):
                weight = weights[row, j] + share * (weights[row + 1, j] - weights[row, j])
                total += weight * u[min(max(first + j, 0), n - 1)]
        out[k] = total


@njit(cache=True)
def driven(u, weights, first):  # type: ignore[no-untyped-def]
    """(n,) ``first``, then the sum of ``weights`` (4,) times ``u`` two samples and one before, there, and one after.

    Before its beginning ``u`` (n >= 2,) keeps its first value, and after its end it goes on along a line.
    """
    n = u.size
    out = np.empty(n, weights.dtype)
    out[0] = first
    for k in range(1, n - 1):
        out[k] = weights[0] * u[max(k - 2, 0)] + weights[1] * u[k - 1] + weights[2] * u[k] + weights[3] * u[k + 1]
    last = 2.0 * u[n - 1] - u[n - 2]
    out[n - 1] = weights[0] * u[max(n - 3, 0)] + weights[1] * u[n - 2] + weights[2] * u[n - 1] + weights[3] * last
    return out


@njit(cache=True)
def lagged_by_direction(start, rise, keep_rising, fall, keep_falling):  # type: ignore[no-untyped-def]
    """w (n,), each ``keep`` times the value before plus the drive of its step: ``rise`` (n,) if w rises, else ``fall``.

    Where neither leads w in its own direction, the followed signal crosses w, and w stays.
    """
    out = np.empty(rise.size)
    last = start
    for k in range(rise.size):
        up, down = keep_rising * last + rise[k], keep_falling * last + fall[k]
        if up > last:
            last = up
        elif down < last:
            last = down
        out[k] = last
    return out


@njit(cache=True)
def lagged_by_pair(start, drive, keep, share):  # type: ignore[no-untyped-def]
    """Re w + ``share`` Im w (n,) of complex w, each ``keep`` times the value before plus the ``drive`` of its step."""
    out = np.empty(drive.size)
    last = complex(start)
    for k in range(drive.size):
        last = keep * last + drive[k]
        out[k] = last.real + share * last.imag
    return out
