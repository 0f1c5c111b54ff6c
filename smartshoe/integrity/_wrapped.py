"""A counter that has run over: a step of nearly all that its word holds, where the signal itself goes on."""

from __future__ import annotations

import numpy as np

from smartshoe.arrays import Array
from smartshoe.integrity._fault import Finding
from smartshoe.integrity.thresholds import Thresholds
from smartshoe.recording import Recording

WORDS = (8, 10, 12, 14, 16, 18, 20, 24, 32)  # bits of counters and converters


def unwrapped(recording: Recording, thresholds: Thresholds) -> tuple[Recording, list[Finding]]:
    """``recording`` with load and reading as they were before a counter ran over, and what is said of it.

    Only whole numbers come from a counter. Its word is the shortest that holds them all. What is counted on is shifted
    by whole words, until its least value is nearest to zero.
    """
    findings = []
    for channel in recording.loads_and_sensors:
        values = channel.values[channel.present]
        told = _bits(values)
        if values.size < thresholds.least_samples or told is None:
            continue
        word = 2.0**told
        whole = np.unwrap(values, period=word)
        whole -= word * round(float(whole.min()) / word)
        if not _goes_on(values, whole, word, thresholds):
            continue
        at = np.zeros(channel.values.size, dtype=bool)
        at[channel.present] = whole != values
        moved = channel.with_nan().copy()
        moved[channel.present] = whole
        recording = recording.with_channel(channel.with_values(moved))
        says = (
            f"{channel.name} is a counter of {told} bits that runs over: it is counted on, from {whole.min():.0f} to"
            f" {whole.max():.0f}; let the logger keep more bits"
        )
        findings.append(Finding("counter_overflow", at, says))
    return recording, findings


def _bits(values: Array) -> int | None:
    """Of the shortest word that holds ``values`` (n,), with a sign or without; None where they are no whole numbers."""
    if not (values.size and np.all(values == np.rint(values))):
        return None
    low, high = float(values.min()), float(values.max())
    for bits in WORDS:
        word = 2.0**bits
        if (low >= 0.0 and high < word) or (low >= -0.5 * word and high < 0.5 * word):
            return bits
    return None


def _goes_on(values: Array, whole: Array, word: float, thresholds: Thresholds) -> bool:
    """Whether ``values`` (n,) leap by more than half a ``word`` where ``whole`` takes no step that is long for it.

    A reading that drops to nothing, or to the end of its range, does so from anywhere: no counting on makes that short.
    """
    leaps = np.abs(np.diff(values)) > 0.5 * word
    return bool(leaps.any()) and thresholds.extrapolates * float(np.abs(np.diff(whole)).max()) <= word
