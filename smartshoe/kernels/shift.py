"""Interpolates a signal between its samples: one weighted sum of sixteen neighbours, and its derivative."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

NEIGHBOURS = 16
CHUNK = 512  # samples that stay in the first-level cache
_LAX = {"reassoc", "contract", "nsz"}


@njit(cache=True)
def fill_taps(fraction, taps, slopes):  # type: ignore[no-untyped-def]
    """The weights (16,) of `models.first_order.interpolation_taps`, and their derivatives."""
    half = NEIGHBOURS // 2
    total = total_slope = 0.0
    for j in range(NEIGHBOURS):
        x = fraction - (j + 1 - half)
        angle = math.pi * x
        if abs(x) > 1e-4:
            sinc = math.sin(angle) / angle
            sinc_slope = (math.cos(angle) - sinc) / x
        else:
            sinc, sinc_slope = 1.0 - angle * angle / 6.0, -math.pi * angle / 3.0
        window = 0.5 + 0.5 * math.cos(angle / half)
        taps[j] = sinc * window
        slopes[j] = sinc_slope * window - sinc * (0.5 * math.pi / half) * math.sin(angle / half)
        total += taps[j]
        total_slope += slopes[j]
    missing, missing_slope = fraction, 1.0
    for j in range(NEIGHBOURS):
        taps[j] /= total
        slopes[j] = (slopes[j] - taps[j] * total_slope) / total
        missing -= (j + 1 - half) * taps[j]
        missing_slope -= (j + 1 - half) * slopes[j]
    taps[half - 1] -= missing
    taps[half] += missing
    slopes[half - 1] -= missing_slope
    slopes[half] += missing_slope


@njit(cache=True, fastmath=_LAX)
def shift(u, samples, rate, value, slope):  # type: ignore[no-untyped-def]
    """``u`` (n,) at k + ``samples`` into ``value`` (n,), ``rate`` times its derivative over ``samples`` into ``slope``.

    ``rate`` converts the caller's unit of delay to samples. Beyond its ends u keeps its end values.
    """
    n = u.size
    taps, slopes, padded = np.empty(NEIGHBOURS), np.empty(NEIGHBOURS), np.empty(CHUNK + NEIGHBOURS)
    whole = math.floor(samples)
    fill_taps(samples - whole, taps, slopes)
    for j in range(NEIGHBOURS):
        slopes[j] *= rate
    first = int(whole) + 1 - NEIGHBOURS // 2
    for at in range(0, n, CHUNK):
        m = min(CHUNK, n - at)
        low, high = at + first, at + first + m + NEIGHBOURS
        if low >= 0 and high <= n:
            near = u[low:high]
        else:
            near = padded[: m + NEIGHBOURS]
            for k in range(near.size):
                near[k] = u[min(max(low + k, 0), n - 1)]
        here, rise = value[at : at + m], slope[at : at + m]
        for k in range(m):
            here[k] = rise[k] = 0.0
        # Four neighbours at a time: as many as fit in registers with their eight weights.
        for j in range(0, NEIGHBOURS, 4):
            a, b, c, d = taps[j], taps[j + 1], taps[j + 2], taps[j + 3]
            e, f, g, h = slopes[j], slopes[j + 1], slopes[j + 2], slopes[j + 3]
            v = near[j:]
            for k in range(m):
                here[k] += a * v[k] + b * v[k + 1] + c * v[k + 2] + d * v[k + 3]
                rise[k] += e * v[k] + f * v[k + 1] + g * v[k + 2] + h * v[k + 3]
