"""A counter that ran over: it steps by nearly all that its word holds, where the signal itself goes on."""

from __future__ import annotations

import numpy as np

from smartshoe.arrays import Array
from smartshoe.integrity._fault import Finding
from smartshoe.integrity.thresholds import Thresholds
from smartshoe.recording import Recording

WORDS = (8, 10, 12, 14, 16, 18, 20, 24, 32)  # bits of counters and converters


def unwrapped(recording: Recording, thresholds: Thresholds) -> tuple[Recording, list[Finding]]:
    """``recording`` with load and reading as they were before a counter ran over, and the findings that say so.

    Only whole numbers come from a counter. Its word is the shortest that holds all of them. The values are counted on
    over the step, and then shifted by whole words until the least is nearest to zero.
    """
    findings = []
    for channel in recording.loads_and_sensors:
        values = channel.values[channel.present]
        bits = _bits(values)
        if values.size < thresholds.least_samples or bits is None:
            continue
        word = 2.0**bits
        counted = np.unwrap(values, period=word)
        counted -= word * round(float(counted.min()) / word)
        if not _goes_on(values, counted, word, thresholds):
            continue
        at = np.zeros(channel.values.size, dtype=bool)
        at[channel.present] = counted != values
        values_with_nan = channel.with_nan().copy()
        values_with_nan[channel.present] = counted
        recording = recording.with_channel(channel.with_values(values_with_nan))
        says = (
            f"{channel.name} is a counter of {bits} bits that runs over: it is counted on, from {counted.min():.0f} to"
            f" {counted.max():.0f}; let the logger keep more bits"
        )
        findings.append(Finding("counter_overflow", at, says))
    return recording, findings


def _bits(values: Array) -> int | None:
    """Bits of the shortest word that holds ``values`` (n,), with or without a sign; None where some are not whole."""
    if not (values.size and np.all(values == np.rint(values))):
        return None
    low, high = float(values.min()), float(values.max())
    for bits in WORDS:
        word = 2.0**bits
        if (low >= 0.0 and high < word) or (low >= -0.5 * word and high < 0.5 * word):
            return bits
    return None


def _goes_on(values: Array, counted: Array, word: float, thresholds: Thresholds) -> bool:
    """Whether ``values`` (n,) leap by more than half a ``word``, and ``counted`` on (n,) take no step long for it.

    A reading that drops to nothing, or to the end of its range, does so from anywhere, and counting on leaves a long
    step.
    """
    leaps = np.abs(np.diff(values)) > 0.5 * word
    return bool(leaps.any()) and thresholds.extrapolates * float(np.abs(np.diff(counted)).max()) <= word
