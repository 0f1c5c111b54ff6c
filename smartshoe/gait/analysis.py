"""`analyse`: a trial's recordings to events, phases, strides, forces and flags."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from smartshoe.errors import RefusedError, UsageError
from smartshoe.files.logs.accepted import RecordingLike, recordings_of
from smartshoe.gait import checks
from smartshoe.gait.contact import LEAST_LOAD_N, ContactDetector, Contacts
from smartshoe.gait.course import course_of
from smartshoe.gait.coverage import Coverage
from smartshoe.gait.indices import indices_of, pattern
from smartshoe.gait.result import Event, FootCourse, Forces, GaitResult
from smartshoe.gait.strides import Stride, strides_of, with_runs
from smartshoe.gait.summary import activity_of, of_main_activity
from smartshoe.gait.sums import StrideSums
from smartshoe.gait.total import (
    above_floor,
    body_weight_of,
    rmse_of,
    standing_mean,
    standing_spans,
    stride_means,
    total_of,
)
from smartshoe.gait.trial import Foot, feet_of

if TYPE_CHECKING:
    from smartshoe.calibration import Calibration

Array = NDArray[np.float64]


def analyse(
    recordings: RecordingLike | Sequence[RecordingLike],
    calibrations: Calibration | Sequence[Calibration] = (),
    body_weight_n: float | None = None,
    coverage: float | Coverage = 1.0,
    reference: GaitResult | None = None,
    estimator: str | None = None,
) -> GaitResult:
    """The trial in ``recordings``: one that holds both shoes, or one for each shoe.

    Columns are those of a plain table: ``left_heel_n`` is a force already, ``left_heel_mbar`` becomes one by the
    calibration of that unit; without any calibration events and times are told, and no force. ``body_weight_n`` in N
    is estimated where it is not given. ``coverage`` is the share of the load that passes through the units, by which
    forces of feet are divided, or a `Coverage` with its course over a stance. ``reference`` is a trial whose mean
    strides are the pattern that strides are compared with. ``estimator`` is a name of
    `smartshoe.calibration.estimators` that gives forces with error bars; None is the calibrations' own filter.

    Raises `InputError` and its kin for recordings that are no trial, `UsageError` for arguments out of range,
    `RefusedError` where neither a stance nor a standing load is found.
    """
    covered = coverage if isinstance(coverage, Coverage) else Coverage(coverage)
    if body_weight_n is not None and not (math.isfinite(body_weight_n) and body_weight_n > 0.0):
        raise UsageError(f"body_weight_n is {body_weight_n:g}: give newtons above 0")
    if estimator is not None:
        from smartshoe.calibration.estimators import NAMES

        if estimator not in NAMES:
            raise UsageError(f"estimator {estimator!r} is not known: use one of {', '.join(NAMES)}")
    given = recordings_of(recordings)
    calibrations = list(calibrations) if isinstance(calibrations, Sequence) else [calibrations]
    feet, flags = feet_of(given, calibrations, estimator)
    contacts = {name: _detector(foot, LEAST_LOAD_N).apply(foot.load) for name, foot in feet.items()}
    if not any(len(own) for own in contacts.values()) and not any(_is_loaded(f, f.load, None) for f in feet.values()):
        # Nothing of a person's weight: perhaps another unit, in which steps are steps all the same.
        contacts = {name: _detector(foot, 0.0).apply(foot.load) for name, foot in feet.items()}
    loads = {name: above_floor(foot, contacts[name]) for name, foot in feet.items()}
    loaded = {name: _is_loaded(foot, loads[name], body_weight_n) for name, foot in feet.items()}
    if not any(loaded.values()) and not any(len(own) for own in contacts.values()):
        raise RefusedError(
            f"{given[0].label}: no stance is found and no foot is loaded: check that the shoes were worn, and the"
            " columns' units"
        )
    courses = {
        name: course_of(foot, contacts[name], loads[name], covered, _usual_peaks(foot, contacts[name], loads[name]))
        for name, foot in feet.items()
    }
    strides = with_runs(
        [
            stride
            for name, course in courses.items()
            for stride in strides_of(name, course.contacts, course.time_s, course.force_n, course.missing)
        ]
    )
    spans = standing_spans(feet, contacts, loaded)
    forces, time_s, total_n = _forces(feet, courses, strides, spans, body_weight_n, covered.share)
    flags += checks.all_of(feet, courses, strides, spans, forces, loaded, covered.share, body_weight_n)
    activity = activity_of(strides, sum(end - start for start, end in spans))
    return GaitResult(
        activity=activity,
        events=tuple(_events(contacts)),
        strides=tuple(strides),
        summary=_summary(contacts, strides),
        indices=indices_of(
            contacts,
            of_main_activity(strides),
            {name: course.time_s for name, course in courses.items()},
            {name: course.load for name, course in courses.items()},
            {name: course.abnormality for name, course in courses.items()},
            None if reference is None else _patterns(reference),
        ),
        forces=forces,
        flags=tuple(flags),
        feet=courses,
        total_time_s=time_s,
        total_n=total_n,
        coverage=covered.share,
        covering=covered,
        standing_s=tuple(spans),
    )


def _detector(foot: Foot, least_n: float) -> ContactDetector:
    least = least_n if foot.is_force else 0.0
    return ContactDetector(foot.rate_hz, foot.regions, start_s=float(foot.time_s[0]), least_load=least)


def _is_loaded(foot: Foot, load: Array, body_weight_n: float | None) -> bool:
    """Whether the foot bears at all; of readings without a calibration only steps can tell."""
    if not foot.is_force:
        return False
    least = LEAST_LOAD_N if body_weight_n is None else max(LEAST_LOAD_N, 0.05 * body_weight_n)
    return float(np.mean(load.sum(axis=1))) > least


def _summary(contacts: Mapping[str, Contacts], strides: Sequence[Stride]) -> dict[str, Any]:
    """Over the strides without gaps of the main activity."""
    sums = StrideSums(tuple(contacts))
    sums.add(contacts, of_main_activity(strides))
    return sums.summary()


def _usual_peaks(foot: Foot, contacts: Contacts, load: Array) -> Array:
    """Each unit's median peak (r,) over the stances; over the whole record where none is closed."""
    known = np.isfinite(contacts.strike_s) & np.isfinite(contacts.toe_off_s)
    if not known.any():
        return np.asarray(np.maximum(load.max(axis=0), 0.0))
    bounds = np.searchsorted(foot.time_s, np.column_stack([contacts.strike_s[known], contacts.toe_off_s[known]]))
    bounds = np.minimum(bounds, foot.time_s.size - 1)
    bounds = bounds[bounds[:, 1] > bounds[:, 0]]
    peaks = np.maximum.reduceat(load, bounds.ravel(), axis=0)[::2]
    return np.asarray(np.maximum(np.median(peaks, axis=0), 0.0))


def _forces(
    feet: Mapping[str, Foot],
    courses: Mapping[str, FootCourse],
    strides: Sequence[Stride],
    spans: Sequence[tuple[float, float]],
    body_weight_n: float | None,
    coverage: float,
) -> tuple[Forces, Array, Array | None]:
    known = {name: course.force_n for name, course in courses.items() if course.force_n is not None}
    first = next(iter(feet.values()))
    if len(known) < len(courses):
        return Forces(None, None, None, None), first.time_s, None
    time_s, total_n = total_of(feet, known)
    missing = np.zeros(time_s.size, dtype=bool)
    for foot in feet.values():
        missing |= np.interp(time_s, foot.time_s, foot.missing.astype(float)) > 0.0
    own = [stride for stride in strides if stride.foot == first.name] or list(strides)
    means, durations = stride_means(time_s, total_n, missing, own)
    standing = standing_mean(time_s, total_n, missing, spans)
    rmse_n = rmse_of(feet, courses, coverage)
    both = len(feet) == 2
    moving = (float(np.average(means, weights=durations)), float(durations.sum())) if means.size else None
    still = (standing.mean_n, standing.length_s) if standing is not None else None
    parts = [part for part in (moving, still) if part is not None]
    mean_n = sum(m * t for m, t in parts) / sum(t for _, t in parts) if parts else None
    weight = body_weight_of(feet, courses, means, durations, standing, body_weight_n, coverage)
    if not both:
        return Forces(weight, None, None, rmse_n), time_s, None
    return Forces(weight, mean_n, standing.mean_n if standing is not None else None, rmse_n), time_s, total_n


def _events(contacts: Mapping[str, Contacts]) -> list[Event]:
    found = [
        Event(float(at), foot, name)
        for foot, own in contacts.items()
        for name, times in (
            ("heel_strike", own.strike_s),
            ("foot_flat", own.foot_flat_s),
            ("heel_off", own.heel_off_s),
            ("toe_off", own.toe_off_s),
        )
        for at in times[np.isfinite(times)]
    ]
    return sorted(found, key=lambda event: (event.time_s, event.foot, event.event))


def _patterns(reference: GaitResult) -> dict[str, Array]:
    found = {}
    for name, course in reference.feet.items():
        own = [stride for stride in of_main_activity(reference.strides) if stride.foot == name]
        mean = pattern(own, course.time_s, course.load)
        if mean is not None:
            found[name] = mean
    return found
