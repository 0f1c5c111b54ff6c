"""Wild values: a logger's -9999, a load cell's glitch. They are taken out before anything else is asked of a signal."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from smartshoe.arrays import Mask
from smartshoe.integrity._fault import Finding
from smartshoe.integrity.thresholds import Thresholds
from smartshoe.recording import Channel, Recording
from smartshoe.signals.masks import runs_of


def without_wild(recording: Recording, thresholds: Thresholds) -> tuple[Recording, list[Finding]]:
    """Load and reading without samples that leap an order of magnitude beyond the span of nearly all others.

    A few of them would make up the span of the signal, and what follows from it: its sign, its full scale, its noise.
    What load and reading do together was a press; but where both are one number, it is a logger's for nothing.
    """
    channels = recording.loads_and_sensors
    wild = {channel.name: _wild(channel, thresholds) for channel in channels}
    pressed = _together(channels, wild)
    findings = []
    for channel in channels:
        at = wild[channel.name] & ~pressed
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
    """(n,) True where all channels are far beyond, each by a number of its own."""
    if len(channels) < 2:
        return np.zeros(channels[0].values.size if channels else 0, dtype=bool)
    values = np.stack([channel.values for channel in channels])
    return np.asarray(np.all([*wild.values()], axis=0) & (np.ptp(values, axis=0) > 0.0))


def _wild(channel: Channel, thresholds: Thresholds) -> Mask:
    """(n,) True at a few values that leap beyond nearly all others by ten times their span, and back.

    For a few samples at a time, or for longer where they are one number, which stands for nothing. Several with which
    the recording begins or ends leapt from nowhere: a ramp that it caught the end of, unless they are one number.
    """
    wild = np.zeros(channel.values.size, dtype=bool)
    values = channel.values[channel.present]
    if values.size < thresholds.least_samples:
        return wild
    low, high = np.quantile(values, [0.5 * thresholds.faulty_share, 1.0 - 0.5 * thresholds.faulty_share])
    beyond = channel.values - np.clip(channel.values, low, high)
    far = channel.present & (np.abs(beyond) > thresholds.extrapolates * (high - low))
    if not high > low or far.mean() > 0.5 * thresholds.faulty_share:
        return wild
    leap = np.abs(np.diff(beyond, prepend=0.0, append=0.0))  # into each sample, and out of the last
    for first, last in zip(*runs_of(far), strict=True):
        run = channel.values[first:last]
        if np.ptp(run) > 0.0 and (last - first > thresholds.few or first == 0 or last == far.size):
            continue
        leaps = (leap[first] > 0.5 * abs(beyond[first]), leap[last] > 0.5 * abs(beyond[last - 1]))
        wild[first:last] = all(leaps)
    return wild


def with_missing(recording: Recording, channel: Channel, at: Mask) -> Recording:
    """``recording`` whose ``channel`` lacks the samples ``at`` (n,)."""
    values = channel.with_nan().copy()
    values[at] = np.nan
    return recording.with_channel(channel.with_values(values))
