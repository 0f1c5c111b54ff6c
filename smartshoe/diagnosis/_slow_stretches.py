"""Stretches that a recording was logged at a lower rate than the rest of it: what of them fits can follow."""

from __future__ import annotations

import numpy as np

from smartshoe.arrays import Array, Mask
from smartshoe.display import moment
from smartshoe.integrity.thresholds import Thresholds
from smartshoe.recording import Recording
from smartshoe.signals.masks import runs_of


def between_samples(
    time_s: Array, at_s: Array, good: Mask, longest_s: float, thresholds: Thresholds
) -> tuple[Mask, Mask]:
    """(m,) each: moments ``at_s`` (m,) between two ``good`` samples (n,) as evenly apart as those about them.

    Those of which these are no more than ``longest_s`` apart, and those of which they are farther apart. One that
    stands between samples farther apart than those about them is in a gap, and neither.
    """
    from scipy.ndimage import maximum_filter1d, median_filter

    step_s = np.diff(time_s)
    # To where a rate changes it is that of the slower side.
    usual_s = maximum_filter1d(median_filter(step_s, thresholds.local, mode="nearest"), thresholds.local + 1)
    is_even = step_s <= (1.0 + thresholds.same) * usual_s
    after = np.clip(np.searchsorted(time_s, at_s), 1, time_s.size - 1)
    is_even = (is_even & good[1:] & good[:-1])[after - 1] & (at_s <= time_s[-1])
    is_close = step_s[after - 1] <= longest_s
    return is_even & is_close, is_even & ~is_close


def too_slow_of(recording: Recording, usable: Mask, longest_s: float, thresholds: Thresholds) -> str | None:
    """What is said of stretches of a recording whose samples are farther apart than ``longest_s``, or None."""
    if recording.is_uniform:
        return None
    time_s, step_s = recording.time_s, recording.sample_time_s
    at_s = np.arange(time_s[0], time_s[-1], step_s)
    good = usable & recording.sensor.present & recording.load.present
    slow = between_samples(time_s, at_s, good, longest_s, thresholds)[1]
    if not slow.any():
        return None
    first, last = (ends[place] for ends, place in zip(runs_of(slow), (0, -1), strict=True))
    within = (time_s >= at_s[first]) & (time_s <= at_s[last - 1] + step_s)
    apart_s = float(np.median(np.diff(time_s[within]))) if within.sum() > 1 else longest_s
    return (
        f"{recording.label}: from {moment(float(at_s[first]))} to {moment(float(at_s[last - 1]))} s"
        f" {100 * float(slow.mean()):.2g} % of it is not used: samples are {apart_s:.3g} s apart there, and fits that"
        f" follow its load need one in {longest_s:.3g} s (log at one rate, or give that stretch as a file of its own)"
    )
