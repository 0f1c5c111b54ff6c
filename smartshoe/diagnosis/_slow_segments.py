"""Stretches logged at a lower rate than the rest of a recording, and which samples of them fits can follow."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from smartshoe.arrays import Array, Index, Mask
from smartshoe.display import moment, percent
from smartshoe.integrity.thresholds import Thresholds
from smartshoe.recording import Recording
from smartshoe.signals.masks import bridged, runs_of


@dataclass(frozen=True, eq=False)
class Spacing:
    """For moments (m,): the next sample ``after`` each, and the distance of the two samples around it.

    ``is_close``: close enough for fits to follow, or under a load that stands still between them. ``is_even``: as far
    apart as those nearby, so that there is no gap.
    """

    after: Index
    is_even: Mask
    is_close: Mask

    def followed(self, good: Mask) -> Mask:
        """(m,) moments between two ``good`` samples (n,) that fits can follow."""
        return self._between(good) & self.is_close

    def too_slow(self, good: Mask) -> Mask:
        """(m,) moments between two ``good`` samples (n,) that are too far apart."""
        return self._between(good) & ~self.is_close

    def _between(self, good: Mask) -> Mask:
        """(m,) moments between two ``good`` samples (n,) that are not in a gap."""
        return self.is_even & good[self.after] & good[self.after - 1]


def spacing_of(time_s: Array, load: Array, at_s: Array, longest_s: float, thresholds: Thresholds) -> Spacing:
    """The spacing of samples of a ``load`` at ``time_s`` (n,) around moments ``at_s`` (m,).

    Close is up to ``longest_s`` apart, and any distance in a hold, which is often logged more slowly the longer it
    lasts.
    """
    from scipy.ndimage import maximum_filter1d, median_filter

    step_s = np.diff(time_s)
    # Up to where a rate changes, the slower rate counts.
    usual_s = maximum_filter1d(median_filter(step_s, thresholds.local, mode="nearest"), thresholds.local + 1)
    is_even = step_s <= (1.0 + thresholds.same) * usual_s
    after = np.clip(np.searchsorted(time_s, at_s), 1, time_s.size - 1)
    stands = np.abs(np.diff(load)) <= thresholds.standing * float(np.ptp(load))
    is_even[1:] |= stands[1:] & (step_s[1:] <= thresholds.clear * step_s[:-1])  # a gap comes at once
    is_close = (step_s <= longest_s) | stands
    return Spacing(after, is_even[after - 1] & (at_s <= time_s[-1]), is_close[after - 1])


def limit_slow_segments(recording: Recording, usable: Mask, longest_s: float, thresholds: Thresholds) -> list[str]:
    """The sentence on stretches whose samples are more than ``longest_s`` apart."""
    if recording.is_uniform:
        return []
    time_s, step_s = recording.time_s, recording.sample_time_s
    at_s = np.arange(time_s[0], time_s[-1], step_s)
    good = usable & recording.sensor.present & recording.load.present
    load = bridged(time_s, recording.force_n, recording.load.present)
    spacing = spacing_of(time_s, load, at_s, longest_s, thresholds)
    slow = spacing.too_slow(good)
    if not slow.any():
        return []
    first, last = (ends[place] for ends, place in zip(runs_of(slow), (0, -1), strict=True))
    after = spacing.after[slow]
    apart_s = float(np.median(time_s[after] - time_s[after - 1]))
    return [
        f"{recording.label}: {percent(float(slow.mean()))} of it is not used, between {moment(float(at_s[first]))} and"
        f" {moment(float(at_s[last - 1]))} s: samples are {apart_s:.3g} s apart there; to follow this load, fits need"
        f" one every {longest_s:.3g} s (log at one rate, or give that stretch as a file of its own)"
    ]
