"""Indices of how regular a gait is: errors of the sequence of events, and distance from a reference pattern."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from smartshoe.arrays import Array
from smartshoe.gait._contact import Contacts
from smartshoe.gait._strides import Stride

POINTS = 101  # of a stride, 0 to 100 %


def overlaid(strides: Sequence[Stride], time_s: Array, loads: Array) -> Array:
    """The loads (n, r) or (n,) of each stride resampled at 0 to 100 % of it: (m, `POINTS`, r) or (m, `POINTS`)."""
    start = np.array([stride.start_s for stride in strides])
    end = np.array([stride.end_s for stride in strides])
    at = start[:, None] + (end - start)[:, None] * np.linspace(0.0, 1.0, POINTS)[None, :]
    flat = at.ravel()
    if loads.ndim == 1:
        return np.asarray(np.interp(flat, time_s, loads).reshape(len(strides), POINTS))
    columns = [np.interp(flat, time_s, loads[:, column]) for column in range(loads.shape[1])]
    return np.stack(columns, axis=1).reshape(len(strides), POINTS, loads.shape[1])


def pattern(mean: Array) -> Array | None:
    """A foot's mean stride (`POINTS`, r) divided by the largest sum over its units; None if it bears no load."""
    largest = float(mean.sum(axis=1).max())
    return np.asarray(mean / largest) if largest > 0 else None


def deviations(each: Array, reference: Array) -> Array:
    """Distance (m,) of strides (m, `POINTS`, r) from a pattern (`POINTS`, r): rms in percent of the pattern's peak.

    Strides are divided by the peak of the foot's mean stride, so body weight does not matter, but a lighter step does.
    """
    largest = float(each.mean(axis=0).sum(axis=1).max())
    if not largest > 0:
        return np.zeros(len(each))
    return np.asarray(100.0 * np.sqrt(np.mean((each / largest - reference[None]) ** 2, axis=(1, 2))))


def sequence_errors(contacts: Contacts, strides: Sequence[Stride]) -> tuple[int, int]:
    """How many strides break the order heel strike, foot flat, heel off, toe off, and how many were judged.

    A missing event breaks the order, as does a forefoot unit that is loaded before the heel. (0, 0) if the shoe has no
    heel unit or no metatarsal unit, without which foot flat and heel off are unknown.
    """
    if contacts.of_region("heel") is None or {"meta1", "meta4"}.isdisjoint(contacts.regions):
        return 0, 0
    index = {float(strike): k for k, strike in enumerate(contacts.strike_s) if np.isfinite(strike)}
    flat_s, heel_off_s = contacts.foot_flat_s, contacts.heel_off_s
    wrong = 0
    for stride in strides:
        k = index[stride.start_s]
        times = (stride.start_s, flat_s[k], heel_off_s[k], stride.toe_off_s)
        wrong += not all(np.isfinite(times)) or any(b <= a for a, b in pairwise(times))
    return wrong, len(strides)
