"""The trial in numbers: activity, step times, double support, flight and asymmetry."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Literal

import numpy as np

from smartshoe.arrays import Array
from smartshoe.gait._contact import Contacts
from smartshoe.gait._strides import Stride

Activity = Literal["walking", "running", "standing", "mixed"]

MOSTLY = 0.85  # of the time with a known activity: share that makes an activity the trial's
LONGEST_STEP_S = 2.0
ROUNDING = 1e-9  # of a stride


def activity_by_time(spent: Mapping[Activity, float]) -> Activity:
    """The activity that takes at least `MOSTLY` of the time in s, "mixed" if none does."""
    whole = sum(spent.values())
    for activity, time_s in spent.items():
        if whole > 0.0 and time_s >= MOSTLY * whole:
            return activity
    return "mixed"


def of_main_activity(strides: Sequence[Stride]) -> list[Stride]:
    """The strides without gaps of the more frequent kind, walking or running."""
    whole = [stride for stride in strides if not stride.gap]
    runs = sum(stride.runs for stride in whole) > len(whole) / 2
    return [stride for stride in whole if stride.runs == runs]


def asymmetry(left: float, right: float) -> float:
    """Right minus left, divided by their mean, in percent (Robinson et al. 1987); 0 if the mean is 0."""
    mean = 0.5 * (left + right)
    return 100.0 * (right - left) / mean if mean else 0.0


def steps_of(contacts: Mapping[str, Contacts], strides: Sequence[Stride]) -> dict[str, Array]:
    """Step times in s by the foot that lands, from the other foot's heel strike, within the strides given."""
    feet = list(contacts)
    if len(feet) < 2:
        return {}
    found: dict[str, Array] = {}
    for foot in feet:
        other = contacts[feet[1 - feet.index(foot)]].strike_s
        other = other[np.isfinite(other)]
        own = np.array([stride.end_s for stride in strides if stride.foot == foot])
        begin = np.array([stride.start_s for stride in strides if stride.foot == foot])
        at = np.searchsorted(other, own) - 1
        there = at >= 0
        step_s, inside = own[there] - other[at[there]], other[at[there]] > begin[there]
        found[foot] = step_s[inside & (step_s < LONGEST_STEP_S)]
    return found


def both_down(contacts: Mapping[str, Contacts], strides: Sequence[Stride]) -> tuple[float, float] | None:
    """Double support and flight in percent of a stride, as means over the strides; None with one shoe.

    Each stride is compared with the other foot's contacts during it.
    """
    feet = list(contacts)
    if len(feet) < 2 or not strides:
        return None
    double, flight = [], []
    for foot in feet:
        other = contacts[feet[1 - feet.index(foot)]]
        strike = np.where(np.isfinite(other.strike_s), other.strike_s, -np.inf)
        off = np.where(np.isfinite(other.toe_off_s), other.toe_off_s, np.inf)
        own = [stride for stride in strides if stride.foot == foot]
        if not strike.size or not own:
            continue
        start, end = np.array([s.start_s for s in own]), np.array([s.end_s for s in own])
        toe_off = np.array([s.toe_off_s for s in own])
        first = np.searchsorted(off, start, side="right")
        over, down = np.zeros(start.size), np.zeros(start.size)
        for ahead in range(3):  # a stride overlaps two contacts of the other foot, or three if one is short
            k = np.minimum(first + ahead, strike.size - 1)
            there = first + ahead < strike.size
            over += there * np.maximum(0.0, np.minimum(off[k], toe_off) - np.maximum(strike[k], start))
            down += there * np.maximum(0.0, np.minimum(off[k], end) - np.maximum(strike[k], start))
        double.append(over / (end - start))
        flight.append(1.0 - (toe_off - start + down - over) / (end - start))
    if not double:
        return None
    shares = (float(np.concatenate(double).mean()), float(np.concatenate(flight).mean()))
    both, neither = (100.0 * share if share > ROUNDING else 0.0 for share in shares)
    return both, neither
