"""Warnings about using a calibration on given recordings, before its forces are used."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from smartshoe.cli._output import warn

if TYPE_CHECKING:
    from smartshoe.arrays import Array
    from smartshoe.calibration import Calibration
    from smartshoe.recording import Recording

BEYOND = 1.1  # times the largest load that a calibration has seen
FASTER = 2.0  # times the fastest loading that it has seen
OFF_SHARE, OFF_TIMES = 0.05, 2.0  # of the largest load, and times the fit's error: more causes a warning


def warn_of_a_past(recordings: Sequence[Recording], calibration: Calibration) -> None:
    """Warn on stderr for each recording that continues another one, where the calibration has effects."""
    for recording in recordings:
        earlier = recording.metadata.get("continues")
        if earlier is not None and calibration.extended is not None:
            warn(
                f"{recording.label} continues {earlier}: the filter begins as after a rest, without what"
                " drift, set, softening and leak had done by then (join the two files to carry it over)"
            )


def warn_of_another_unit(recordings: Sequence[Recording], calibration: Calibration) -> None:
    """Warn on stderr for each recording that names another unit, or whose load exceeds the calibrated range."""
    for recording in recordings:
        if recording.unit and calibration.unit and recording.unit != calibration.unit:
            warn(
                f"{recording.label} is of unit {recording.unit}, the calibration of {calibration.unit}: its"
                " forces mean nothing; give that unit's own calibration"
            )
    seen = calibration.load_range_n
    for recording in recordings:
        loads = recording.of_role("load")
        if seen is None or not loads:
            continue
        top_n = float(loads[0].si.max())
        if top_n > BEYOND * seen[1]:
            warn(
                f"{recording.label} is loaded to {top_n:.0f} N, the calibration has seen {seen[1]:.0f} N:"
                " the rest is extrapolated"
            )


def warn_of_forces_beyond(label: str, time_s: Array, force_n: Array, calibration: Calibration) -> None:
    """Warn on stderr where the calibration's forces (n,) exceed the loads or loading rates that it has seen."""
    from smartshoe.signals.loading import rate_range

    seen, top_n = calibration.load_range_n, float(force_n.max(initial=0.0))
    if seen is not None and top_n > BEYOND * seen[1]:
        warn(
            f"{label} comes to {top_n:.0f} N, the calibration has seen {seen[1]:.0f} N: the rest is"
            " extrapolated, or the calibration is another unit's"
        )
    rates, fastest = calibration.rate_range_n_per_s, rate_range([(time_s, force_n)])[1]
    if rates is not None and fastest > FASTER * rates[1] > 0.0:
        warn(
            f"{label} rises by {fastest:.0f} N/s, the calibration has seen {rates[1]:.0f} N/s: what the unit does at"
            " such rates is extrapolated (calibrate with triangles as fast)"
        )


def warn_of_unused_hold_outs(others: Sequence[Recording], judges: Sequence[Recording], left_out: Sequence[str]) -> None:
    """Warn on stderr for each of ``others`` that was to be held out and is none of ``judges``.

    ``left_out`` are the reasons, each of which begins with its recording's label.
    """
    for one in others:
        if any(judge is one for judge in judges):
            continue
        begins = (f"{one.label}: ", f"{one.label} ")
        why = next((why.removeprefix(one.label).lstrip(": ") for why in left_out if why.startswith(begins)), "no use")
        instead = "the other files held out" if judges else "load cycles of the fitted files"
        warn(f"--hold-out {one.label} judges nothing, {instead} do: {why}")


def warn_of_use_from_rest(recordings: Sequence[Recording], calibration: Calibration, told_n: float) -> None:
    """Warn on stderr where a calibration is far off on the very recordings that it was fitted to.

    In use each recording begins in a steady state, and all share one zero; in a fit they do not. Where a unit leaks or
    drifts, the best fit may have a distant zero and a past that compensates for it. ``told_n``: rms error in N by the
    fit, NaN where unknown.
    """
    import numpy as np

    from smartshoe.calibration import compensated

    def off(recording: Recording) -> float:
        left_n = compensated(recording, calibration)["force_estimate"].si - recording.force_n
        return float(np.sqrt(np.mean(left_n[recording.load.present] ** 2)))

    off_n = [off(one) for one in recordings]
    worst = max(range(len(recordings)), key=off_n.__getitem__)
    load = recordings[worst].load
    least_n = OFF_SHARE * float(np.max(np.abs(load.si[load.present])))
    if off_n[worst] > max(least_n, 0.0 if np.isnan(told_n) else OFF_TIMES * told_n):
        warn(
            f"from rest and with one zero, as it is used, the calibration is off by {off_n[worst]:.0f} N (rms) on"
            f" {recordings[worst].label}: the unit does what no standard linear solid does, such as a leak or a drift"
            " (smartshoe diagnose says what, and makes a calibration of it)"
        )
