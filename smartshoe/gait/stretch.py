"""A stretch of a long trial, looked at with its neighbours in sight: the steps of `smartshoe.gait.analyse` on it."""

from __future__ import annotations

from collections.abc import Mapping, MutableSequence, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from smartshoe.gait import checks
from smartshoe.gait.contact import LEAST_LOAD_N, Contacts
from smartshoe.gait.course import course_of
from smartshoe.gait.coverage import Coverage
from smartshoe.gait.flag import Flag
from smartshoe.gait.result import FootCourse, Forces
from smartshoe.gait.strides import Stride, strides_of, with_runs
from smartshoe.gait.total import above_floor, standing_spans
from smartshoe.gait.trial import Foot

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class AnalysisWindow:
    """What was found from ``start_s`` on and before ``end_s``; ``feet``, ``courses`` and ``contacts`` reach beyond.

    ``strides`` begin in it; ``spans`` are of standing, whole ones.
    """

    start_s: float
    end_s: float
    feet: Mapping[str, Foot]
    courses: Mapping[str, FootCourse]
    strides: tuple[Stride, ...]
    spans: tuple[tuple[float, float], ...]
    loaded: Mapping[str, bool]
    flags: tuple[Flag, ...]

    def own(self, time_s: Array) -> Mask:
        """(n,) which times are the stretch's own."""
        return (time_s >= self.start_s - 1e-9) & (time_s < self.end_s - 1e-9)


def look(
    windows: Mapping[str, tuple[Foot, Contacts]],
    start_s: float,
    end_s: float,
    peaks: Mapping[str, MutableSequence[Array]],
    coverage: Coverage,
    body_weight_n: float | None,
) -> AnalysisWindow:
    """The stretch from ``start_s`` to ``end_s`` of feet seen through ``windows`` that reach some seconds beyond it.

    ``peaks`` are each foot's units' peaks (r,) in the stances so far, to which this stretch's are added.
    """
    feet = {name: foot for name, (foot, _) in windows.items()}
    contacts = {name: own for name, (_, own) in windows.items()}
    loads = {name: above_floor(foot, contacts[name]) for name, foot in feet.items()}
    for name, foot in feet.items():
        peaks[name].extend(peaks_of(foot.time_s, loads[name], contacts[name], start_s, end_s))
    least = max(LEAST_LOAD_N, 0.05 * (body_weight_n or 0.0))
    loaded = {n: foot.is_force and float(np.mean(loads[n].sum(axis=1))) > least for n, foot in feet.items()}
    courses = {
        n: course_of(foot, contacts[n], loads[n], coverage, usual_peak(peaks[n], loads[n])) for n, foot in feet.items()
    }
    near = [
        stride
        for name, course in courses.items()
        for stride in strides_of(name, course.contacts, course.time_s, course.force_n, course.missing)
    ]
    strides = tuple(stride for stride in with_runs(near) if start_s <= stride.start_s < end_s)
    spans = tuple(standing_spans(feet, contacts, loaded))
    flags = checks.all_of(
        feet, courses, strides, spans, Forces(None, None, None, None), loaded, coverage.share, body_weight_n
    )
    return AnalysisWindow(start_s, end_s, feet, courses, strides, spans, loaded, tuple(flags))


def peaks_of(time_s: Array, load: Array, contacts: Contacts, start_s: float, end_s: float) -> list[Array]:
    """Each unit's peak (r,) in the stances that end from ``start_s`` on and before ``end_s``."""
    with np.errstate(invalid="ignore"):
        known = np.isfinite(contacts.strike_s) & (contacts.toe_off_s >= start_s) & (contacts.toe_off_s < end_s)
    bounds = np.searchsorted(time_s, np.column_stack([contacts.strike_s[known], contacts.toe_off_s[known]]))
    return [load[first:last].max(axis=0) for first, last in np.minimum(bounds, time_s.size - 1) if last > first]


def usual_peak(peaks: Sequence[Array], load: Array) -> Array:
    """Each unit's median peak (r,), its largest load (n, r) where no stance is known."""
    found = np.median(np.array(peaks), axis=0) if len(peaks) else load.max(axis=0)
    return np.asarray(np.maximum(found, 0.0))
