"""`analyse`: from a trial's recordings to events, phases, strides, forces and flags."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

from smartshoe.arrays import Array
from smartshoe.errors import RefusedError, UsageError
from smartshoe.files.logs.accepted import RecordingLike, recordings_of
from smartshoe.gait._checks import trial_flags
from smartshoe.gait._contact import LEAST_LOAD_N, ContactDetector
from smartshoe.gait._coverage import Coverage
from smartshoe.gait._events import events_of
from smartshoe.gait._result import GaitResult
from smartshoe.gait._trial import Foot, feet_of
from smartshoe.gait._trial_sums import TrialSums
from smartshoe.gait._window import analyse_window, is_loaded
from smartshoe.gait.indices import overlaid, pattern
from smartshoe.gait.summary import of_main_activity

if TYPE_CHECKING:
    from smartshoe.calibration import Calibration
    from smartshoe.calibration.folder import CalibrationsLike


def analyse(
    recordings: RecordingLike | Sequence[RecordingLike],
    calibrations: CalibrationsLike | Iterable[CalibrationsLike] = (),
    body_weight_n: float | None = None,
    coverage: float | Coverage = 1.0,
    reference: GaitResult | None = None,
    estimator: str | None = None,
) -> GaitResult:
    """Events, phases, strides and forces of a trial: ``smartshoe gait`` as a function.

    Parameters
    ----------
    recordings
        One recording that holds both shoes, or one for each shoe; or their paths or DataFrames. Columns are those of a
        plain table: ``left_heel_n`` is a force already, ``left_heel_mbar`` becomes one by the calibration of that unit;
        without any calibration there are events and times, and no force.
    calibrations
        Calibrations of the units, the paths of their files, or a folder of them.
    body_weight_n
        Body weight in N; estimated from the forces if it is not given.
    coverage
        The share of the load that passes through the units, by which forces of feet are divided, or a `Coverage` with
        a course over the stance.
    reference
        A trial whose mean strides are the pattern with which strides are compared; without it, each foot's own mean.
    estimator
        A name of `smartshoe.calibration.estimators.estimator_names`, for forces with error bars; None means the
        calibrations' own filter.

    Raises
    ------
    InputError
        If the recordings cannot be analysed as a trial (also `MissingChannelError`, `UnitError`).
    UsageError
        If an argument is out of range.
    RefusedError
        If neither a stance nor a standing load is found.

    Examples
    --------
    >>> import numpy as np
    >>> import smartshoe
    >>> time_s = np.arange(0.0, 20.0, 0.01)
    >>> down = np.clip(np.sin(2.0 * np.pi * time_s) + 0.3, 0.0, None)  # 60 % of each second
    >>> walk = smartshoe.Recording.from_arrays(time_s=time_s, left_heel_n=600.0 * down**0.3)
    >>> found = smartshoe.gait.analyse(walk)
    >>> found.activity, round(found.summary["stride_time_s"]["left"]["mean"], 3)
    ('walking', 1.0)
    """
    covered = checked(body_weight_n, coverage, estimator)
    given = recordings_of(recordings)
    feet, flags = feet_of(given, given_calibrations(calibrations), estimator)
    contacts = {name: _detector(foot, LEAST_LOAD_N).apply(foot.load) for name, foot in feet.items()}
    if not any(len(own) for own in contacts.values()) and not any(is_loaded(f, f.load, None) for f in feet.values()):
        # Nothing is as heavy as a person. The loads may be in another unit; steps can be found in them all the same.
        contacts = {name: _detector(foot, 0.0).apply(foot.load) for name, foot in feet.items()}
    window = analyse_window(feet, contacts, covered, body_weight_n)
    sums = TrialSums(feet, covered.share, None if reference is None else _patterns(reference))
    for name, own in contacts.items():
        sums.add_contacts(name, own)
    sums.add(window)
    require_steps(sums, given[0].label)
    forces = sums.forces(body_weight_n)
    flags += window.flags
    flags += trial_flags(forces, covered.share, body_weight_n, sums.strides[False], sums.strides[True])
    total = window.total
    return GaitResult(
        activity=sums.activity(),
        events=tuple(events_of(contacts)),
        strides=window.strides,
        figures=sums.summary(),
        indices=sums.indices(),
        forces=forces,
        flags=tuple(flags),
        coverage=covered.share,
        covering=covered,
        feet=window.series,
        total_time_s=next(iter(feet.values())).time_s if total is None else total.time_s,
        total_n=total.force_n if total is not None and len(feet) == 2 else None,
        standing_s=window.spans,
    )


def checked(body_weight_n: float | None, coverage: float | Coverage, estimator: str | None) -> Coverage:
    """Return the coverage as a `Coverage`; raise `UsageError` for an argument out of range."""
    if body_weight_n is not None and not (math.isfinite(body_weight_n) and body_weight_n > 0.0):
        raise UsageError(f"body_weight_n is {body_weight_n:g}: give newtons above 0")
    if estimator is not None:
        from smartshoe.calibration.estimators import require_known

        require_known(estimator)
    return coverage if isinstance(coverage, Coverage) else Coverage(coverage)


def given_calibrations(given: CalibrationsLike | Iterable[CalibrationsLike]) -> list[Calibration]:
    """Load all of ``given``. The calibration package is imported only if there is something to load."""
    if isinstance(given, Sequence) and not given:
        return []
    from smartshoe.calibration.folder import load_calibrations

    return load_calibrations(given)


def require_steps(sums: TrialSums, label: str) -> None:
    """Raise `RefusedError` if neither a stance nor a standing load was found."""
    if not any(sums.contacts.values()) and not sums.was_loaded:
        raise RefusedError(
            f"{label}: no stance is found and no foot is loaded: check that the shoes were worn, and the columns' units"
        )


def _detector(foot: Foot, least_n: float) -> ContactDetector:
    least = least_n if foot.is_force else 0.0
    return ContactDetector(foot.rate_hz, foot.regions, start_s=float(foot.time_s[0]), least_load=least)


def _patterns(reference: GaitResult) -> dict[str, Array]:
    """Return the reference pattern (`POINTS`, r) of each foot that has strides."""
    found = {}
    for name, series in reference.feet.items():
        own = [stride for stride in of_main_activity(reference.strides) if stride.foot == name]
        wanted = pattern(overlaid(own, series.time_s, series.load).mean(axis=0)) if own else None
        if wanted is not None:
            found[name] = wanted
    return found
