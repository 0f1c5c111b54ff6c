"""How regular a gait is: errors of sequence, and distance from a reference pattern."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from smartshoe.gait.contact import Contacts
from smartshoe.gait.strides import Stride

Array = NDArray[np.float64]

POINTS = 101  # of a stride, 0 to 100 %


def overlaid(strides: Sequence[Stride], time_s: Array, loads: Array) -> Array:
    """Loads (n, r) or (n,) of each stride at 0 to 100 % of it: (m, `POINTS`, r) or (m, `POINTS`)."""
    start = np.array([stride.start_s for stride in strides])
    end = np.array([stride.end_s for stride in strides])
    at = start[:, None] + (end - start)[:, None] * np.linspace(0.0, 1.0, POINTS)[None, :]
    flat = at.ravel()
    if loads.ndim == 1:
        return np.asarray(np.interp(flat, time_s, loads).reshape(len(strides), POINTS))
    columns = [np.interp(flat, time_s, loads[:, column]) for column in range(loads.shape[1])]
    return np.stack(columns, axis=1).reshape(len(strides), POINTS, loads.shape[1])


def pattern(strides: Sequence[Stride], time_s: Array, loads: Array) -> Array | None:
    """A foot's mean stride (`POINTS`, r), divided by the largest mean whole load; None without a stride."""
    if not strides:
        return None
    mean = overlaid(strides, time_s, loads).mean(axis=0)
    largest = float(mean.sum(axis=1).max())
    return np.asarray(mean / largest) if largest > 0 else None


def deviations(strides: Sequence[Stride], time_s: Array, loads: Array, reference: Array) -> Array:
    """Distance (m,) of each stride from a reference pattern (`POINTS`, r): rms, in percent of the reference's peak.

    Each stride is divided by the foot's mean peak, so that body weight does not matter and a light step does.
    """
    each = overlaid(strides, time_s, loads)
    largest = float(each.mean(axis=0).sum(axis=1).max())
    if not largest > 0:
        return np.zeros(len(strides))
    return np.asarray(100.0 * np.sqrt(np.mean((each / largest - reference[None]) ** 2, axis=(1, 2))))


def sequence_errors(contacts: Contacts, strides: Sequence[Stride]) -> tuple[int, int]:
    """How many strides break the order heel strike, foot flat, heel off, toe off, and of how many.

    An event that is missing breaks it, as does a unit of the forefoot that is loaded before the heel. Of none where
    the shoe has no heel or no metatarsal unit to tell foot flat and heel off by.
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


def indices_of(
    contacts: Mapping[str, Contacts],
    strides: Sequence[Stride],
    time_s: Mapping[str, Array],
    loads: Mapping[str, Array],
    abnormality: Mapping[str, Array],
    reference: Mapping[str, Array] | None,
) -> dict[str, dict[str, float | None]]:
    """Each foot's indices in percent: sequence errors, deviation from the reference pattern, abnormality.

    The reference is each foot's own mean stride where none is given.
    """
    found: dict[str, dict[str, float | None]] = {}
    for foot, own in contacts.items():
        walked = [stride for stride in strides if stride.foot == foot and not stride.gap]
        wrong, count = sequence_errors(own, walked)
        wanted = reference.get(foot) if reference else pattern(walked, time_s[foot], loads[foot])
        deviation = None
        if walked and wanted is not None and wanted.shape[1] == loads[foot].shape[1]:
            deviation = float(np.mean(deviations(walked, time_s[foot], loads[foot], wanted)))
        inside = np.zeros(time_s[foot].size, dtype=bool)
        for stride in walked:
            first, last = np.searchsorted(time_s[foot], [stride.start_s, stride.end_s])
            inside[first:last] = True
        found[foot] = {
            "sequence_error_percent": 100.0 * wrong / count if count else None,
            "deviation_percent": deviation,
            "abnormality_percent": float(100.0 * abnormality[foot][inside].mean()) if inside.any() else None,
        }
    return found
