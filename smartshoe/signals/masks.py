"""Runs of True in a mask, and interpolation of signals over missing samples."""

from __future__ import annotations

import numpy as np

from smartshoe.arrays import Array, Index, Mask


def runs_of(mask: Mask) -> tuple[Index, Index]:
    """Start and end indices (end excluded) of the runs of True in ``mask`` (n,)."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(np.int8)))
    return edges[0::2], edges[1::2]


def bridged(time_s: Array, values: Array, present: Mask) -> Array:
    """A copy of ``values`` with missing samples interpolated linearly between their neighbours, as the model assumes.

    It is a copy because compiled functions would be compiled again for read-only arrays.
    """
    if present.all() or not present.any():
        return np.array(values, dtype=float)
    return np.interp(time_s, time_s[present], values[present])


def level_stretches(values: Array, width: int, reach: float) -> Mask:
    """(n,) True in stretches of ``width`` samples, an odd number, of ``values`` (n,) that lie within ``reach``."""
    from scipy.ndimage import maximum_filter1d, minimum_filter1d

    within = maximum_filter1d(values, width, mode="nearest") - minimum_filter1d(values, width, mode="nearest")
    return np.asarray(maximum_filter1d((within <= reach).astype(np.uint8), width, mode="constant").astype(bool))
