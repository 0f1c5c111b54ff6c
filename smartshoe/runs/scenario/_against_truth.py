"""Compares a simulated trial's forces, events and order of contact with the true ones."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from smartshoe.arrays import Array, Mask
from smartshoe.recording import Recording

if TYPE_CHECKING:
    from smartshoe.gait import GaitResult
    from smartshoe.runs.scenario._trial import TrialEvent, TrialTruth


CONTACT = 0.02  # of body weight: level above which a unit bears load
SAME_EVENT_S = 0.1  # events further apart than this are not the same
EDGE_S = 0.3  # end of a trial that is ignored, since an event may be cut off there
ORDER = ("heel", "meta4", "meta1", "toe")
EVENTS = ("heel_strike", "foot_flat", "heel_off", "toe_off")


def compare(
    recording: Recording, truth: TrialTruth, found: GaitResult, raw_foot_n: Mapping[str, Array]
) -> dict[str, Any]:
    """Truth, raw (static gains) and corrected side by side; all forces in N, at the recording's times.

    ``standing_...`` and ``strides_...`` are mean forces over the spells that the analysis found (None if there are
    none), ``peaks_n`` means over the stances of each foot, ``rmse_total_n`` the rms error of the total over the trial
    and ``rmse_coils_n`` that of the load on the coils, ``events`` errors in ms, ``order`` the share of stances in which
    the units are loaded in the order heel, meta4, meta1, toe, and of those with meta4 before meta1.
    """
    time_s = recording.time_s
    true_foot = {foot: truth.foot_n[:, column] for column, foot in enumerate(truth.feet)}
    courses = {
        "truth": true_foot,
        "raw": {foot: raw_foot_n[foot] for foot in truth.feet},
        "corrected": {foot: _on(time_s, found, foot) for foot in truth.feet},
    }
    totals = {name: np.sum(list(feet.values()), axis=0) for name, feet in courses.items()}
    standing = np.zeros(time_s.size, dtype=bool)
    for start, end in found.standing_s:
        standing |= (time_s >= start) & (time_s <= end)
    moving = np.zeros(time_s.size, dtype=bool)
    for stride in found.strides:
        if stride.foot == truth.feet[0]:
            moving |= (time_s >= stride.start_s) & (time_s < stride.end_s)
    stances = {foot: _stances(truth.events, foot) for foot in truth.feet}
    weight_n = truth.body_weight_n
    rmse = {name: float(np.sqrt(np.mean((totals[name] - totals["truth"]) ** 2))) for name in ("raw", "corrected")}
    return {
        "body_weight_n": weight_n,
        "standing_total_n": _means(totals, standing),
        "standing_feet_n": {
            foot: _means({name: feet[foot] for name, feet in courses.items()}, standing) for foot in truth.feet
        }
        if standing.any()
        else None,
        "strides_total_n": _means(totals, moving),
        "peaks_n": {
            foot: {name: _mean_peak(time_s, feet[foot], stances[foot]) for name, feet in courses.items()}
            for foot in truth.feet
        },
        "rmse_total_n": rmse,
        "rmse_total_percent_of_body_weight": {name: 100.0 * value / weight_n for name, value in rmse.items()},
        "rmse_coils_n": _rmse_coils(time_s, truth, found, raw_foot_n),
        "events": {kind: _event_errors(truth, found, kind) for kind in EVENTS},
        "order": _orders(recording, truth, found, stances),
    }


def _on(time_s: Array, found: GaitResult, foot: str) -> Array:
    course = found.feet[foot]
    values = course.force_n if course.force_n is not None else course.load.sum(axis=1)
    return np.asarray(np.interp(time_s, course.time_s, values))


def _rmse_coils(
    time_s: Array, truth: TrialTruth, found: GaitResult, raw_foot_n: Mapping[str, Array]
) -> dict[str, float]:
    """Rms errors in N of the total load on all coils, without regard to what passes beside them."""
    borne_n = truth.load_n.sum(axis=1)
    raw_n = found.coverage * np.sum([raw_foot_n[foot] for foot in truth.feet], axis=0)
    corrected_n = np.zeros(time_s.size)
    for foot in truth.feet:
        course = found.feet[foot]
        corrected_n += np.interp(time_s, course.time_s, course.load.sum(axis=1))
    return {
        "raw": float(np.sqrt(np.mean((raw_n - borne_n) ** 2))),
        "corrected": float(np.sqrt(np.mean((corrected_n - borne_n) ** 2))),
    }


def _means(totals: Mapping[str, Array], where: Mask) -> dict[str, float] | None:
    if not where.any():
        return None
    return {name: float(values[where].mean()) for name, values in totals.items()}


def _stances(events: Sequence[TrialEvent], foot: str) -> list[tuple[float, float]]:
    """Begin and end in s of the foot's complete stances."""
    begun: float | None = None
    spans: list[tuple[float, float]] = []
    for event in events:
        if event.foot != foot:
            continue
        if event.event == "heel_strike":
            begun = event.time_s
        elif event.event == "toe_off" and begun is not None:
            spans.append((begun, event.time_s))
            begun = None
    return spans


def _mean_peak(time_s: Array, force_n: Array, stances: Sequence[tuple[float, float]]) -> float | None:
    peaks = [
        float(force_n[first:last].max())
        for first, last in np.searchsorted(time_s, stances or np.zeros((0, 2)))
        if last > first
    ]
    return float(np.mean(peaks)) if peaks else None


def _event_errors(truth: TrialTruth, found: GaitResult, kind: str) -> dict[str, Any]:
    """Errors of both feet's events of one kind: count, missed and false ones, median and 95th percentile in ms."""
    end_s = float(truth.time_s[-1]) - EDGE_S
    errors: list[Array] = []
    true_count = missed = false = 0
    for foot in truth.feet:
        true_s = np.array([e.time_s for e in truth.events if e.foot == foot and e.event == kind])
        found_s = np.array([e.time_s for e in found.events if e.foot == foot and e.event == kind])
        near = np.abs(true_s[:, None] - found_s[None, :]) < SAME_EVENT_S
        in_time = true_s < end_s
        true_count += int(in_time.sum())
        missed += int(np.count_nonzero(in_time & ~near.any(axis=1)))
        false += int(np.count_nonzero((found_s < end_s) & ~near.any(axis=0)))
        if near.any():
            distance = np.where(near, np.abs(true_s[:, None] - found_s[None, :]), np.inf)[near.any(axis=1)]
            errors.append(distance.min(axis=1))
    sizes_ms = 1e3 * np.concatenate(errors) if errors else np.zeros(0)
    return {
        "true": true_count,
        "missed": missed,
        "false": false,
        "median_ms": float(np.median(sizes_ms)) if sizes_ms.size else None,
        "p95_ms": float(np.quantile(sizes_ms, 0.95)) if sizes_ms.size else None,
    }


def onsets(time_s: Array, load_n: Array, level_n: float, stances: Sequence[tuple[float, float]]) -> Array:
    """Times (m,) in s at which the load (n,) first exceeds the level in each stance; infinite where it does not."""
    times = np.full(len(stances), np.inf)
    for number, (first, last) in enumerate(np.searchsorted(time_s, stances or np.zeros((0, 2)))):
        own = load_n[max(first - 1, 0) : last]
        above = np.flatnonzero(own > level_n)
        if above.size == 0:
            continue
        at = max(first - 1, 0) + int(above[0])
        times[number] = time_s[at]
        if above[0] > 0:
            step = load_n[at] - load_n[at - 1]
            times[number] -= (load_n[at] - level_n) / step * (time_s[at] - time_s[at - 1])
    return times


def _orders(
    recording: Recording, truth: TrialTruth, found: GaitResult, stances: Mapping[str, Sequence[tuple[float, float]]]
) -> dict[str, Any] | None:
    names = [channel.name for channel in recording.sensors]
    level_n = CONTACT * truth.body_weight_n
    shares: dict[str, dict[str, float]] = {}
    count = sum(len(own) for own in stances.values())
    if count == 0:
        return None
    for what in ("truth", "observed"):
        whole = meta = 0
        for foot in truth.feet:
            course = found.feet[foot]
            if set(ORDER) - set(course.regions):
                return None
            rows = []
            for region in ORDER:
                if what == "truth":
                    load_n, at_s = truth.load_n[:, names.index(f"{foot}_{region}")], truth.time_s
                else:
                    load_n, at_s = course.load[:, course.regions.index(region)], course.time_s
                rows.append(onsets(at_s, np.asarray(load_n), level_n, stances[foot]))
            when = np.array(rows)
            whole += int(np.count_nonzero(np.all(np.diff(np.where(np.isfinite(when), when, 1e12), axis=0) > 0, axis=0)))
            meta += int(np.count_nonzero(when[1] < when[2]))
        shares[what] = {
            "heel_meta4_meta1_toe_percent": 100.0 * whole / count,
            "meta4_before_meta1_percent": 100.0 * meta / count,
        }
    return {"stances": count, "order_of_contact": found.summary.get("order_of_contact"), **shares}
