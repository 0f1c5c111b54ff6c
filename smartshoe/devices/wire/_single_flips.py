"""Recognises sample frames that one flipped bit can make from others without its checksum noticing.

A flipped bit in a data byte changes one byte, which CRC-16 always detects. A flipped bit in one of COBS's own bytes
sends the decoder along another chain of zeros: where only the old chain passed, a zero becomes the old chain's step,
and the other way round. The changes therefore do not depend on the data, and all chains can be followed. Of the 103
million changes that one bit can make to a frame of four readings, 1498 leave the checksum right (the tests follow them
all). 694 of these make the type zero; 790 change the count, or the clock by 65 ms and more, which is inconsistent with
the frames before and behind. The other 14 end in one of the four forms below, which are refused. This also refuses
undamaged frames with these nine bytes, such as every 256th of those that read 0, 0, 4, 0 counts.
"""

from __future__ import annotations

import numpy as np

from smartshoe.arrays import Index
from smartshoe.devices.wire._checksums import Bytes

FOUR_READINGS = 17  # bytes, from type to checksum
# Each form: positions in the payload and the values there.
FORMS: tuple[tuple[tuple[int, int], ...], ...] = (
    ((3, 0), (7, 2), (8, 0), (9, 1), (10, 2), (12, 5), (13, 0), (14, 0), (16, 0)),
    ((3, 5), (7, 0), (8, 5), (9, 0), (10, 0), (12, 0), (13, 1), (14, 2), (16, 1)),
    ((7, 0), (8, 0), (9, 0), (10, 0), (11, 4), (12, 0), (13, 0), (14, 0), (15, 2)),
    ((7, 1), (8, 1), (9, 1), (10, 2), (11, 0), (12, 1), (13, 1), (14, 3), (15, 0)),
)


def may_be_flipped(payloads: Bytes) -> Index:
    """Indices of the ``payloads`` (length, n) that have one of the forms."""
    if len(payloads) != FOUR_READINGS:
        return np.zeros(0, dtype=np.intp)
    # Every form has small values at these two positions, which few frames have.
    few = np.flatnonzero((payloads[7] | payloads[13]) < 8)
    found = [few[:0]]
    for form in FORMS:
        frames = few
        for place, value in form:
            if not frames.size:
                break
            frames = frames[payloads[place][frames] == value]
        found.append(frames)
    return np.concatenate(found)
