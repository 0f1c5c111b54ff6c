"""Recordings that hold the same samples: one experiment given twice, which tells nothing by itself."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence

import numpy as np

from smartshoe.arrays import Array
from smartshoe.recording import Channel, Recording


def twins(recordings: Sequence[Recording]) -> dict[int, str]:
    """By place, one sentence for each recording whose time, load and readings are all those of an earlier one."""
    said, alike = {}, defaultdict[tuple[int, float], list[Recording]](list)
    for place, recording in enumerate(recordings):
        known = alike[recording.time_s.size, float(sum(np.nansum(_si(one)) for one in recording.sensors))]
        first = next((one for one in known if _are_alike(one, recording)), None)
        known.append(recording)
        if first is not None:
            said[place] = (
                f"{recording.label} holds the same samples as {first.label}: it is one experiment, given twice"
            )
    return said


def _are_alike(one: Recording, other: Recording) -> bool:
    if not np.array_equal(one.time_s, other.time_s):
        return False
    for role in ("load", "sensor"):
        ours, theirs = one.of_role(role), other.of_role(role)
        if len(ours) != len(theirs):
            return False
        if not all(np.array_equal(_si(a), _si(b), equal_nan=True) for a, b in zip(ours, theirs, strict=True)):
            return False
    return True


def _si(channel: Channel) -> Array:
    """(n,) in SI, NaN where the sample is missing."""
    return channel.unit.to_si(channel.with_nan())
