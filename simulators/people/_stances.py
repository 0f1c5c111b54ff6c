"""The contacts of a foot, one after another, and their loads at any given times."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from simulators.people.shape import COLUMNS, PHASES
from smartshoe.arrays import Array, Index

LARGEST_WARP = 0.12
WARPS = np.linspace(-LARGEST_WARP, LARGEST_WARP, 49)


def smooth_step(share: Array) -> Array:
    """Rises from 0 to 1 as the share (n,) does, with zero slope and curvature at both ends."""
    s = np.clip(share, 0.0, 1.0)
    return np.asarray(s**3 * (10.0 - 15.0 * s + 6.0 * s**2))


@dataclass(frozen=True, eq=False)
class Stances:
    """A foot's contacts, in order and without overlap.

    ``begin_s``, ``duration_s`` and ``amplitude_n`` (m,); ``kind`` (m,) is the row of ``tables`` (k, `PHASES` + 1, 5);
    ``height`` and ``warp`` (m, 5) are each region's own factor of load and shift of phase, x + warp 4x(1 - x).
    ``fade_s`` (m, 2) is begin and end of a fade where walking follows or precedes standing: ``fades`` (m,) is 1 where
    the load fades in, -1 where it fades out, 0 otherwise.
    """

    begin_s: Array
    duration_s: Array
    amplitude_n: Array
    kind: Index
    height: Array
    warp: Array
    tables: Array
    fade_s: Array
    fades: Array

    def loads_n(self, time_s: Array) -> Array:
        """Loads (n, 5) in N at the times (n,), columns as in `COLUMNS`; zero between contacts."""
        loads = np.zeros((time_s.size, len(COLUMNS)))
        if self.begin_s.size == 0:
            return loads
        which = np.searchsorted(self.begin_s, time_s, side="right") - 1
        first = np.maximum(which, 0)
        stance = (time_s - self.begin_s[first]) / self.duration_s[first]
        on = np.flatnonzero((which >= 0) & (stance < 1.0))
        if on.size == 0:
            return loads
        which, stance = which[on], stance[on]
        bow = 4.0 * stance * (1.0 - stance)
        row = self.kind[which]
        amplitude = self.amplitude_n[which]
        fading = np.flatnonzero(self.fades[which])
        if fading.size:
            at = which[fading]
            share = (time_s[on[fading]] - self.fade_s[at, 0]) / (self.fade_s[at, 1] - self.fade_s[at, 0])
            rising = smooth_step(share)
            amplitude[fading] *= np.where(self.fades[at] > 0, rising, 1.0 - rising)
        for column in range(len(COLUMNS)):
            place = (stance + self.warp[which, column] * bow) * PHASES
            before = np.clip(place.astype(np.intp), 0, PHASES - 1)
            part = place - before
            low, high = self.tables[row, before, column], self.tables[row, before + 1, column]
            loads[on, column] = amplitude * self.height[which, column] * (low + part * (high - low))
        return loads


def mean_heights(tables: Sequence[Array]) -> Array:
    """Mean over stance (k, warps, 5) of each table's columns, for each of `WARPS`."""
    stance = (np.arange(PHASES) + 0.5) / PHASES
    bow = 4.0 * stance * (1.0 - stance)
    grid = np.linspace(0.0, 1.0, PHASES + 1)
    return np.array(
        [
            [
                [np.interp(stance + warp * bow, grid, made[:, column]).mean() for column in range(len(COLUMNS))]
                for warp in WARPS
            ]
            for made in tables
        ]
    )


def mean_load(means: Array, kind: Index, height: Array, warp: Array) -> Array:
    """Mean load (m,) over each stance at amplitude one; ``means`` as returned by `mean_heights`."""
    place = (np.clip(warp, WARPS[0], WARPS[-1]) - WARPS[0]) / (WARPS[1] - WARPS[0])
    before = np.clip(place.astype(np.intp), 0, WARPS.size - 2)
    part = place - before
    column = np.arange(len(COLUMNS))
    low, high = means[kind[:, None], before, column], means[kind[:, None], before + 1, column]
    return np.asarray(np.sum(height * (low + part * (high - low)), axis=1))
