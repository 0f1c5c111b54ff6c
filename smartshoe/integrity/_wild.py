"""Wild values: a logger's -9999, a load cell's glitch. They are taken out before anything else is asked of a signal."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from smartshoe.arrays import Mask
from smartshoe.integrity._fault import Finding
from smartshoe.integrity.thresholds import Thresholds
from smartshoe.recording import Channel, Recording


def without_wild(recording: Recording, thresholds: Thresholds) -> tuple[Recording, list[Finding]]:
    """Load and reading without samples an order of magnitude beyond the span of nearly all others; what is said of it.

    A few of them would make up the span of the signal, and what follows from it: its sign, its full scale, its noise.
    """
    findings = []
    for channel in (*recording.of_role("load"), *recording.of_role("sensor")):
        at = _wild(channel, thresholds)
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


def _wild(channel: Channel, thresholds: Thresholds) -> Mask:
    """(n,) True at a few values that are beyond nearly all others by ten times their span."""
    values = channel.values[channel.present]
    if values.size < thresholds.least_samples:
        return np.zeros(channel.values.size, dtype=bool)
    low, high = np.quantile(values, [0.5 * thresholds.faulty_share, 1.0 - 0.5 * thresholds.faulty_share])
    beyond = np.abs(channel.values - np.clip(channel.values, low, high))
    at = np.asarray(channel.present & (beyond > thresholds.extrapolates * (high - low)))
    return at if high > low and at.mean() <= 0.5 * thresholds.faulty_share else np.zeros_like(at)


def with_missing(recording: Recording, channel: Channel, at: Mask) -> Recording:
    """``recording`` whose ``channel`` lacks the samples ``at`` (n,)."""
    values = channel.with_nan().copy()
    values[at] = np.nan
    fewer = Channel.from_values(channel.name, values, channel.unit, channel.role)
    return recording.with_channel(replace(fewer, range_=channel.range_, resolution=channel.resolution))
