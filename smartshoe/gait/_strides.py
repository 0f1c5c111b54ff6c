"""Strides: from one heel strike to the next of the same foot, with the quantities a gait laboratory reports."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from smartshoe.arrays import Array, Index, Mask
from smartshoe.gait._contact import Contacts
from smartshoe.signals.masks import runs_of

LONGEST_S = 3.5  # from strike to strike; if longer, the person stood in between
LONGEST_GAP_S = 0.1  # in one piece; linear interpolation bridges single samples well
MOST_MISSING = 0.3  # of a stride
RUNS_BELOW = 50.0  # percent of a stride during which the foot is down
RATE_FROM, RATE_TO = 0.2, 0.8  # of the first peak: between these the loading rate is measured


@dataclass(frozen=True, slots=True)
class Stride:
    """One stride of one foot. Forces, and what follows from them, are None if the loads are not in N.

    ``peak_n``, the vertical impulse ``impulse_n_s`` and ``loading_rate_n_per_s`` (mean slope from a fifth to four
    fifths of the first peak) are those of the whole foot, corrected for coverage. ``runs`` is true if the feet are down
    for less than half of it on average, so that a flight follows. ``gap`` is true if samples are missing; the stride
    then counts in no mean.
    """

    foot: str
    start_s: float
    end_s: float
    toe_off_s: float
    foot_flat_s: float | None
    heel_off_s: float | None
    stance_percent: float
    peak_n: float | None
    impulse_n_s: float | None
    loading_rate_n_per_s: float | None
    runs: bool
    gap: bool

    @property
    def time_s(self) -> float:
        """Duration in s."""
        return self.end_s - self.start_s

    def to_dict(self) -> dict[str, Any]:
        """All fields by name."""
        return {name: getattr(self, name) for name in self.__dataclass_fields__}


def strides_of(foot: str, contacts: Contacts, time_s: Array, force_n: Array | None, missing: Mask) -> list[Stride]:
    """The strides of one foot. ``force_n`` (n,) is its whole vertical force, None if unknown."""
    if len(contacts) < 2:
        return []
    start_s, end_s, toe_off_s = contacts.strike_s[:-1], contacts.strike_s[1:], contacts.toe_off_s[:-1]
    flat_s, heel_off_s = contacts.foot_flat_s, contacts.heel_off_s
    with np.errstate(invalid="ignore"):
        good = (end_s - start_s <= LONGEST_S) & np.isfinite(toe_off_s)
    rate_hz = (time_s.size - 1) / (time_s[-1] - time_s[0])
    gaps = runs_of(missing)
    gone = np.concatenate([[0], np.cumsum(missing)])
    found: list[Stride] = []
    for k in np.flatnonzero(good):
        first, last = np.searchsorted(time_s, [start_s[k], end_s[k]])
        off = int(np.searchsorted(time_s, toe_off_s[k]))
        peak = impulse = slope = None
        if force_n is not None and off > first:
            part = force_n[first:off]
            peak = float(part.max())
            impulse = float(part.sum() / rate_hz)
            slope = loading_rate(part, rate_hz)
        found.append(
            Stride(
                foot, float(start_s[k]), float(end_s[k]), float(toe_off_s[k]), _maybe(flat_s[k]), _maybe(heel_off_s[k]),
                float(100.0 * (toe_off_s[k] - start_s[k]) / (end_s[k] - start_s[k])), peak, impulse, slope, False,
                _loses(gaps, first, last, rate_hz) or bool(gone[last] - gone[first] > MOST_MISSING * (last - first)),
            )
        )  # fmt: skip
    return found


def _loses(gaps: tuple[Index, Index], first: int, last: int, rate_hz: float) -> bool:
    """Whether more than `LONGEST_GAP_S` of the samples [``first``, ``last``) is missing in one piece."""
    start, stop = gaps
    k = slice(int(np.searchsorted(stop, first, side="right")), int(np.searchsorted(start, last)))
    longest = np.minimum(stop[k], last) - np.maximum(start[k], first)
    return bool(longest.size and longest.max() / rate_hz > LONGEST_GAP_S)


def with_runs(strides: Sequence[Stride]) -> list[Stride]:
    """The strides of both feet in order of their start, each with ``runs`` set.

    A stride runs if its stance share, averaged with that of the other foot's stride that begins nearest, is below a
    half: in a limp one foot is down for less than half of its stride, and that is still walking.
    """
    ordered = sorted(strides, key=lambda stride: (stride.start_s, stride.foot))
    start_s = {foot: np.array([s.start_s for s in ordered if s.foot == foot]) for foot in {s.foot for s in ordered}}
    share = {foot: np.array([s.stance_percent for s in ordered if s.foot == foot]) for foot in start_s}
    found = []
    for stride in ordered:
        shares = [stride.stance_percent]
        for foot in start_s.keys() - {stride.foot}:
            nearest = int(np.abs(start_s[foot] - stride.start_s).argmin())
            if abs(start_s[foot][nearest] - stride.start_s) < stride.time_s:
                shares.append(float(share[foot][nearest]))
        found.append(replace(stride, runs=float(np.mean(shares)) < RUNS_BELOW))
    return found


def loading_rate(stance_n: Array, rate_hz: float) -> float | None:
    """Mean slope in N/s from a fifth to four fifths of the first peak of a stance (n,); None if there is no rise."""
    half = stance_n[: max(2, stance_n.size // 2)]
    peak = float(half.max())
    low, high = int(np.argmax(half >= RATE_FROM * peak)), int(np.argmax(half >= RATE_TO * peak))

    def place(at: int, level: float) -> float:
        return at if at == 0 else at - (half[at] - level) / (half[at] - half[at - 1])

    # A stance that begins above the first level, or bears no load, has no measurable rise.
    took = place(high, RATE_TO * peak) - place(low, RATE_FROM * peak)
    return float((RATE_TO - RATE_FROM) * peak * rate_hz / took) if took > 0 else None


def _maybe(value: float) -> float | None:
    """The value, or None if it is not finite."""
    return float(value) if np.isfinite(value) else None
