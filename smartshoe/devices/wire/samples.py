"""What a decoder gives: samples with their place in the device's count and on the device's clock."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from smartshoe.arrays import Array, Integers, Mask
from smartshoe.units import COUNTS, Unit

CHANNELS = ("toe", "meta1", "meta4", "heel")


@dataclass(frozen=True, eq=False)
class Samples:
    """Samples in order, none twice.

    ``sequence`` (n,) counts samples and ``device_time_s`` (n,) is the device's clock, both unwrapped over the wire's
    16 and 32 bits and over loss; ``boot`` (n,) counts how often the device had restarted by then: sequence and time
    start anew with each. ``readings`` (n, channels) in ``unit``; where ``missing`` (n, channels), the last reading
    that was there, or 0. ``end`` (n,) is how many bytes of the stream had come when each was whole: whoever knows when
    bytes came knows by it when each sample did, however many were decoded together.
    """

    sequence: Integers
    device_time_s: Array
    readings: Array
    missing: Mask
    names: tuple[str, ...]
    unit: Unit
    boot: Integers
    end: Integers

    def __len__(self) -> int:
        return int(self.sequence.size)

    @classmethod
    def empty(cls, names: tuple[str, ...] = CHANNELS, unit: Unit = COUNTS) -> Samples:
        """No samples."""
        none = np.zeros(0, dtype=np.int64)
        shape = (0, len(names))
        return cls(none, np.zeros(0), np.zeros(shape), np.zeros(shape, dtype=bool), names, unit, none, none)


def join_samples(parts: Sequence[Samples]) -> Samples:
    """Consecutive samples of one decoder as one; at least one part."""
    if len(parts) == 1:
        return parts[0]
    return replace(
        parts[0],
        sequence=np.concatenate([part.sequence for part in parts]),
        device_time_s=np.concatenate([part.device_time_s for part in parts]),
        readings=np.concatenate([part.readings for part in parts]),
        missing=np.concatenate([part.missing for part in parts]),
        boot=np.concatenate([part.boot for part in parts]),
        end=np.concatenate([part.end for part in parts]),
    )
