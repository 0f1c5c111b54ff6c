"""The trial in numbers: cadence, times, shares, symmetry, variability, order of contact."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from smartshoe.gait.contact import Contacts
from smartshoe.gait.strides import Stride

Array = NDArray[np.float64]
Activity = Literal["walking", "running", "standing", "mixed"]

MOSTLY = 0.85  # of the time in which anything is told, that makes an activity the trial's
LONGEST_STEP_S = 2.0
ROUNDING = 1e-9  # of a stride


def activity_of(strides: Sequence[Stride], standing_s: float) -> Activity:
    """What most of the trial is, by time: walking, running (the foot is down for less than half a stride), standing."""
    feet = {stride.foot for stride in strides}
    running_s = float(sum(s.time_s for s in strides if s.runs)) / max(len(feet), 1)
    walking_s = float(sum(s.time_s for s in strides if not s.runs)) / max(len(feet), 1)
    spent: dict[Activity, float] = {"walking": walking_s, "running": running_s, "standing": standing_s}
    whole = sum(spent.values())
    for activity, time_s in spent.items():
        if whole > 0.0 and time_s >= MOSTLY * whole:
            return activity
    return "mixed"


def of_main_activity(strides: Sequence[Stride]) -> list[Stride]:
    """The strides without gaps of what there is more of, walking or running."""
    whole = [stride for stride in strides if not stride.gap]
    runs = sum(stride.runs for stride in whole) > len(whole) / 2
    return [stride for stride in whole if stride.runs == runs]


def asymmetry(left: float, right: float) -> float:
    """Right less left over their mean, in percent (Robinson et al. 1987)."""
    mean = 0.5 * (left + right)
    return 100.0 * (right - left) / mean if mean else 0.0


def steps_of(contacts: Mapping[str, Contacts], strides: Sequence[Stride]) -> dict[str, Array]:
    """Step times in s by the foot that lands: from the other foot's heel strike, within the strides given."""
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
        step_s = own[there] - other[at[there]] if other.size else np.zeros(0)
        inside = other[at[there]] > begin[there] if other.size else np.zeros(0, dtype=bool)
        found[foot] = step_s[inside & (step_s < LONGEST_STEP_S)]
    return found


def both_down(contacts: Mapping[str, Contacts], strides: Sequence[Stride]) -> tuple[float, float] | None:
    """Double support and flight as percent of a stride, means over the strides; None with one shoe.

    In each stride the other foot's contacts are laid over this one's.
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
        for ahead in range(3):  # a stride meets two contacts of the other foot, three where one is short
            k = np.minimum(first + ahead, strike.size - 1)
            there = first + ahead < strike.size
            over += there * np.maximum(0.0, np.minimum(off[k], toe_off) - np.maximum(strike[k], start))
            down += there * np.maximum(0.0, np.minimum(off[k], end) - np.maximum(strike[k], start))
        double.append(over / (end - start))
        flight.append(1.0 - (toe_off - start + down - over) / (end - start))
    if not double or not np.concatenate(double).size:
        return None
    shares = (float(np.concatenate(double).mean()), float(np.concatenate(flight).mean()))
    both, neither = (100.0 * share if share > ROUNDING else 0.0 for share in shares)
    return both, neither


def order_of_contact(
    contacts: Mapping[str, Contacts], strides: Sequence[Stride]
) -> tuple[list[str], float | None, float | None]:
    """The commonest order of the units' onsets in strides, the share that has it, and that of meta4 before meta1.

    Shares in percent, None where no stance shows all units.
    """
    counted: Counter[tuple[str, ...]] = Counter()
    earlier = compared = 0
    for foot, own in contacts.items():
        walked = np.isin(own.strike_s, [stride.start_s for stride in strides if stride.foot == foot])
        whole = walked & np.isfinite(own.onset_s).all(axis=1)
        for row in np.argsort(own.onset_s[whole], axis=1, kind="stable"):
            counted[tuple(own.regions[index] for index in row)] += 1
        meta4, meta1 = own.of_region("meta4"), own.of_region("meta1")
        if meta4 is not None and meta1 is not None:
            both = walked & np.isfinite(own.onset_s[:, meta4]) & np.isfinite(own.onset_s[:, meta1])
            compared += int(both.sum())
            earlier += int(np.count_nonzero(own.onset_s[both, meta4] < own.onset_s[both, meta1]))
    if not counted:
        return [], None, None
    order, count = min(counted.items(), key=lambda item: (-item[1], item[0]))
    return (
        list(order),
        100.0 * count / sum(counted.values()),
        100.0 * earlier / compared if compared else None,
    )


def _spread(values: Array) -> dict[str, float | None]:
    if values.size == 0:
        return {"mean": None, "cv_percent": None}
    mean = float(values.mean())
    cv = 100.0 * float(values.std(ddof=1)) / mean if values.size > 1 and mean else None
    return {"mean": mean, "cv_percent": cv}


def summarise(contacts: Mapping[str, Contacts], strides: Sequence[Stride]) -> dict[str, Any]:
    """The contract's summary, with more beside it: numbers over the strides without gaps of the main activity."""
    main = of_main_activity(strides)
    by_foot = {foot: [stride for stride in main if stride.foot == foot] for foot in contacts}

    def over(name: str) -> dict[str, Array]:
        return {
            foot: np.array([getattr(s, name) for s in own if getattr(s, name) is not None])
            for foot, own in by_foot.items()
        }

    time_s, stance, peak = over("time_s"), over("stance_percent"), over("peak_n")
    impulse, rate = over("impulse_n_s"), over("loading_rate_n_per_s")
    step_s = steps_of(contacts, main)
    both = both_down(contacts, main)
    compared = {
        "stance_time": {foot: stance[foot] * time_s[foot] for foot in stance},
        "step_time": step_s,
        "peak": peak,
        "impulse": impulse,
        "loading_rate": rate,
    }
    asymmetries: dict[str, float | None] = {}
    for name, values in compared.items():
        there = len(values) == 2 and all(values[foot].size for foot in ("left", "right"))
        asymmetries[name] = asymmetry(*(float(values[foot].mean()) for foot in ("left", "right"))) if there else None
    leading = asymmetries["impulse"] if asymmetries["impulse"] is not None else asymmetries["stance_time"]
    every_s = np.concatenate(list(time_s.values())) if time_s else np.zeros(0)
    order, order_share, meta4_first = order_of_contact(contacts, main)
    return {
        "cadence_steps_per_min": float(120.0 / every_s.mean()) if every_s.size else None,
        "stride_time_s": {foot: _spread(values) for foot, values in time_s.items()},
        "stance_percent": {foot: float(values.mean()) if values.size else None for foot, values in stance.items()},
        "double_support_percent": both[0] if both else None,
        "asymmetry_percent": None if leading is None else abs(leading),
        "order_of_contact": order,
        "flight_percent": both[1] if both else None,
        "step_time_s": {foot: _spread(values) for foot, values in step_s.items()},
        "peak_n": {foot: _spread(values) for foot, values in peak.items()},
        "impulse_n_s": {foot: _spread(values) for foot, values in impulse.items()},
        "loading_rate_n_per_s": {foot: _spread(values) for foot, values in rate.items()},
        "right_over_left_percent": asymmetries,
        "strides": {foot: len(own) for foot, own in by_foot.items()},
        "order_of_contact_percent": order_share,
        "meta4_before_meta1_percent": meta4_first,
    }
