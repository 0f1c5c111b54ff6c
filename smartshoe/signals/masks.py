"""Runs of True in a mask, and signals over what a mask says is missing."""

from __future__ import annotations

import numpy as np

from smartshoe.arrays import Array, Index, Mask


def runs_of(mask: Mask) -> tuple[Index, Index]:
    """First samples and one-past-last samples of the runs of True in ``mask`` (n,)."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(np.int8)))
    return edges[0::2], edges[1::2]


def bridged(time_s: Array, values: Array, present: Mask) -> Array:
    """A copy of ``values``, missing samples on the line between their neighbours: what the model takes for granted.

    A copy, since a compiled pass is compiled anew for arrays that may not be written.
    """
    if present.all() or not present.any():
        return np.array(values, dtype=float)
    return np.interp(time_s, time_s[present], values[present])
