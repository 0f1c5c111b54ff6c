"""Forces of a foot above its floor, the total of both feet on one time base, and spells of standing."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from smartshoe.arrays import Array, Mask
from smartshoe.gait._contact import Contacts
from smartshoe.gait._strides import MOST_MISSING, Stride
from smartshoe.gait._trial import Foot

LEAST_STANDING_S = 2.0
SETTLED_S = 0.5  # at each end of a spell of standing, left out of its mean


@dataclass(frozen=True, eq=False)
class TotalForce:
    """The sum of the feet's forces: ``force_n`` (n,) at ``time_s`` (n,), and where either foot lacks a sample."""

    time_s: Array
    force_n: Array
    missing: Mask


def above_floor(foot: Foot, contacts: Contacts) -> Array:
    """Loads (n, r) above what each unit reads in swing, which is interpolated linearly between swings.

    If no swing was seen the loads are returned as they are.
    """
    load = foot.load
    if contacts.floor_time_s.size == 0:
        return load
    for column in range(load.shape[1]):
        load[:, column] -= np.interp(foot.time_s, contacts.floor_time_s, contacts.floor[:, column])
    return load


def total_of(feet: Mapping[str, Foot], forces: Mapping[str, Array]) -> TotalForce:
    """The sum of the feet's ``forces`` (n,), at those times of the first foot at which all feet were recorded."""
    first = next(iter(feet))
    time_s = feet[first].time_s
    begin = max(foot.time_s[0] for foot in feet.values())
    end = min(foot.time_s[-1] for foot in feet.values())
    keep = (time_s >= begin) & (time_s <= end)
    time_s = time_s[keep]
    total, missing = np.zeros(time_s.size), np.zeros(time_s.size, dtype=bool)
    for name, foot in feet.items():
        total += forces[name][keep] if name == first else np.interp(time_s, foot.time_s, forces[name])
        if foot.missing.any():
            missing |= np.interp(time_s, foot.time_s, foot.missing.astype(float)) > 0.0
    return TotalForce(time_s, total, missing)


def standing_spans(
    feet: Mapping[str, Foot], contacts: Mapping[str, Contacts], loaded: Mapping[str, bool]
) -> list[tuple[float, float]]:
    """Begin and end in s of the spells in which every foot stays down for `LEAST_STANDING_S` or more."""
    spans: list[tuple[float, float]] | None = None
    for name, foot in feet.items():
        own = [
            (
                float(strike if np.isfinite(strike) else foot.time_s[0]),
                float(off if np.isfinite(off) else foot.time_s[-1]),
            )
            for strike, off in zip(contacts[name].strike_s, contacts[name].toe_off_s, strict=True)
        ]
        if not own and not loaded[name]:
            continue  # an unloaded foot is ignored: the person stands on the other leg
        if not own:
            own = [(float(foot.time_s[0]), float(foot.time_s[-1]))]
        own = [span for span in own if span[1] - span[0] >= LEAST_STANDING_S]
        spans = own if spans is None else _shared(spans, own)
    return [span for span in spans or [] if span[1] - span[0] >= LEAST_STANDING_S]


def _shared(first: Sequence[tuple[float, float]], second: Sequence[tuple[float, float]]) -> list[tuple[float, float]]:
    """The intersection of each of ``first`` with each of ``second``; an empty one ends before it begins."""
    return sorted((max(a, c), min(b, d)) for a, b in first for c, d in second)


def whole_strides(total: TotalForce, strides: Sequence[Stride]) -> list[Stride]:
    """The strides without gaps within the time of ``total``, with at most `MOST_MISSING` of its samples missing.

    While one foot lacks a unit the total is too small, whichever foot steps. ``total`` has at least two samples.
    """
    time_s = total.time_s
    gone = np.concatenate([[0.0], np.cumsum(total.missing)])

    def lost(stride: Stride) -> float:
        first, last = gone[np.searchsorted(time_s, [stride.start_s, stride.end_s])]
        return float(last - first)

    step = (time_s[-1] - time_s[0]) / (time_s.size - 1)
    return [
        s
        for s in strides
        if s.start_s >= time_s[0]
        and s.end_s <= time_s[-1]
        and not s.gap
        and lost(s) * step <= MOST_MISSING * (s.end_s - s.start_s)
    ]
