"""The output of a decoder: samples with their place in the device's count and on the device's clock."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from smartshoe.arrays import Array, Integers, Mask
from smartshoe.units import COUNTS, Unit

CHANNELS = ("toe", "meta1", "meta4", "heel")


@dataclass(frozen=True, eq=False)
class Samples:
    """Samples in order, without repetitions.

    ``sequence`` (n,) counts samples and ``device_time_s`` (n,) is the device's clock, both unwrapped beyond the wire's
    16 and 32 bits and continued over losses. ``boot`` (n,) counts the device's restarts so far; sequence and time begin
    again with each. ``readings`` (n, channels) are in ``unit``; where ``missing`` (n, channels), the last reading
    present, or 0. ``end`` (n,) is the number of bytes of the stream up to the end of each sample: from the arrival
    times of bytes it gives those of samples, however many are decoded together.
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
        """Zero samples with these channels and unit."""
        none = np.zeros(0, dtype=np.int64)
        shape = (0, len(names))
        return cls(none, np.zeros(0), np.zeros(shape), np.zeros(shape, dtype=bool), names, unit, none, none)


def join_samples(parts: Sequence[Samples]) -> Samples:
    """Consecutive samples of one decoder joined; at least one part."""
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
