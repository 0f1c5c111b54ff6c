"""Wild values: a logger's -9999 for nothing, a load cell's glitch. They are taken out before all other detectors.

A few of them would make up the span of the signal, and with it all that is judged by the span: its sign, its full
scale, its noise.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from smartshoe.arrays import Mask
from smartshoe.integrity._fault import Finding
from smartshoe.integrity.thresholds import Thresholds
from smartshoe.recording import Channel, Recording
from smartshoe.signals.masks import runs_of


def without_wild(recording: Recording, thresholds: Thresholds) -> tuple[Recording, list[Finding]]:
    """Load and reading without samples that leap far beyond the span of nearly all others, and the findings of them.

    What load and reading do together was a press of the unit. But where both show the same number, it is one that a
    logger writes for a missing value.
    """
    channels = recording.loads_and_sensors
    wild = {channel.name: _wild(channel, thresholds) for channel in channels}
    is_press = _together(channels, wild)
    findings = []
    for channel in channels:
        at = wild[channel.name] & ~is_press
        if not at.any():
            continue
        recording = with_missing(recording, channel, at)
        farthest = channel.values[at][int(np.argmax(np.abs(channel.values[at])))]
        many = "a sample" if at.sum() == 1 else f"{int(at.sum())} samples, the farthest"
        findings.append(
            Finding(
                "spikes",
                at,
                f"{channel.name} holds {many} of {farthest:.6g} {channel.unit.symbol}, far beyond all others: left out",
                masks=True,
            )
        )
    return recording, findings


def _together(channels: Sequence[Channel], wild: Mapping[str, Mask]) -> Mask:
    """(n,) True where all ``channels`` are wild, each by a number of its own."""
    if len(channels) < 2:
        return np.zeros(channels[0].values.size if channels else 0, dtype=bool)
    values = np.stack([channel.values for channel in channels])
    return np.asarray(np.all([*wild.values()], axis=0) & (np.ptp(values, axis=0) > 0.0))


def _wild(channel: Channel, thresholds: Thresholds) -> Mask:
    """(n,) True at a few values of a ``channel`` that leap beyond nearly all others by ten times their span, and back.

    A run of them is ``few`` samples long at most, or longer where it is one number, which is no measurement. A run of
    several values at the beginning or the end of the recording leapt from nowhere: it may be a ramp that was caught in
    part.
    """
    is_wild = np.zeros(channel.values.size, dtype=bool)
    values = channel.values[channel.present]
    if values.size < thresholds.least_samples:
        return is_wild
    low, high = np.quantile(values, [0.5 * thresholds.faulty_share, 1.0 - 0.5 * thresholds.faulty_share])
    beyond = channel.values - np.clip(channel.values, low, high)
    is_far = channel.present & (np.abs(beyond) > thresholds.extrapolates * (high - low))
    if not high > low or is_far.mean() > 0.5 * thresholds.faulty_share:
        return is_wild
    leap = np.abs(np.diff(beyond, prepend=0.0, append=0.0))  # into each sample, and out of the last
    for first, last in zip(*runs_of(is_far), strict=True):
        run = channel.values[first:last]
        if np.ptp(run) > 0.0 and (last - first > thresholds.few or first == 0 or last == is_far.size):
            continue
        leaps = (leap[first] > 0.5 * abs(beyond[first]), leap[last] > 0.5 * abs(beyond[last - 1]))
        is_wild[first:last] = all(leaps)
    return is_wild


def with_missing(recording: Recording, channel: Channel, at: Mask) -> Recording:
    """``recording`` without the samples ``at`` (n,) of its ``channel``."""
    values = channel.with_nan().copy()
    values[at] = np.nan
    return recording.with_channel(channel.with_values(values))
