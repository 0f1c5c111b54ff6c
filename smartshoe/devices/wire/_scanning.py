"""Splits bytes at their zeros into complete frames: undoes COBS, verifies checksums, counts garbage.

Only a frame's own bytes decide about it: anything between two zeros that precedes a complete frame (garbage, or a frame
whose end was lost) is cut off, so that a bad frame never destroys the good one behind it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from smartshoe.arrays import Index, Integers, Mask
from smartshoe.devices.wire._checksums import Bytes, checksums
from smartshoe.devices.wire._framing import is_intact, unframed
from smartshoe.devices.wire._single_flips import may_be_flipped
from smartshoe.devices.wire.counters import Counters
from smartshoe.devices.wire.information import LONGEST_TEXT, Information
from smartshoe.errors import FormatError

SAMPLE, INFORMATION = 0x01, 0x02
LONGEST_ENCODED = LONGEST_TEXT + 8  # plus type, checksum, and one byte of COBS for each 254
_INFORMATION_BEGINS = bytes([INFORMATION]) + b"protocol="
_PRINTABLE = frozenset(range(0x20, 0x7F))


@dataclass(frozen=True, eq=False)
class Scanned:
    """``payloads`` (length, n): n sample frames, type first, checksum last; ``information``: the newest, if any.

    ``end`` (n,) is the number of bytes of the stream up to the end of each frame.
    """

    payloads: Bytes
    end: Integers
    information: Information | None


class FrameScanner:
    """Finds sample frames of ``payload_length`` bytes (type to checksum) and information frames in any chunks."""

    def __init__(self, payload_length: int, counters: Counters) -> None:
        self._length = payload_length + 1  # bytes once encoded, without the final zero
        self._counters = counters
        self._rest = b""
        self._is_cut = False
        self._is_lost = False

    def reset(self) -> None:
        """Discard the partial frame, if any; the next complete frame then counts as a resynchronisation."""
        self._is_lost |= bool(self._rest)
        self._rest, self._is_cut = b"", False

    def feed(self, data: bytes) -> Scanned:
        """The frames that are completed by ``data``."""
        self._counters.bytes += len(data)
        data = self._rest + data
        if 0 not in data:
            self._is_cut |= len(data) > LONGEST_ENCODED
            self._rest = data[-LONGEST_ENCODED:]
            return Scanned(np.zeros((self._length - 1, 0), dtype=np.uint8), np.zeros(0, dtype=np.int64), None)
        buffer = np.frombuffer(data, dtype=np.uint8)
        ends = np.flatnonzero(buffer == 0)
        rest = data[int(ends[-1]) + 1 :]
        self._rest = rest[-LONGEST_ENCODED:]
        starts = np.concatenate([[0], ends[:-1] + 1])
        lengths = ends - starts
        # Bytes of the first gap that earlier calls discarded still count as garbage before its frame.
        lengths[0] += LONGEST_ENCODED if self._is_cut else 0
        self._is_cut = len(rest) > LONGEST_ENCODED
        there = lengths > 0
        return self._sort(data, buffer, ends[there], lengths[there])

    def _sort(self, data: bytes, buffer: Bytes, ends: Index, lengths: Index) -> Scanned:
        """Classify the gaps between zeros as sample frames, information frames or garbage."""
        may_be = np.flatnonzero(lengths >= self._length)
        payloads, is_whole = self._decode(buffer, ends[may_be])
        is_good = np.zeros(ends.size, dtype=bool)
        is_good[may_be[is_whole]] = True
        has_prefix = lengths > self._length
        information: Information | None = None
        for gap in np.flatnonzero(~is_good).tolist():
            end, length = int(ends[gap]), int(lengths[gap])
            bytes_of_gap = data[end - min(length, LONGEST_ENCODED, end) : end]
            found, begins = self._find_information(bytes_of_gap)
            if found is None:
                self._blame(bytes_of_gap, length)
                continue
            information = found
            self._counters.information += 1
            is_good[gap], has_prefix[gap] = True, length > len(bytes_of_gap) - begins
        self._counters.malformed += int((has_prefix & is_good).sum())
        was_lost = np.concatenate([[self._is_lost], ~is_good[:-1]]) | has_prefix if ends.size else has_prefix
        self._counters.resynchronisations += int((was_lost & is_good).sum())
        self._is_lost = not is_good[-1] if ends.size else self._is_lost
        before = self._counters.bytes - buffer.size  # the stream's bytes before the buffer's first
        return Scanned(payloads[:, is_whole], ends[may_be[is_whole]] + (before + 1), information)

    def _decode(self, buffer: Bytes, ends: Index) -> tuple[Bytes, Mask]:
        """Payloads (length, n) of the frames that would end at ``ends``, and which of them are sample frames."""
        length = self._length
        if not ends.size:
            return np.zeros((length - 1, 0), dtype=np.uint8), np.zeros(0, dtype=bool)
        columns = buffer.take(ends - np.arange(length, 0, -1)[:, None])
        # ``code`` is where the next zero was removed. A sum beyond 255 wraps to a place already passed, which is
        # not visited again.
        code = columns[0].copy()
        is_code = np.empty((length - 1, ends.size), dtype=bool)
        step = np.empty_like(code)
        for place in range(1, length):
            np.equal(code, place, out=is_code[place - 1])
            np.multiply(columns[place], is_code[place - 1], out=step)
            np.add(code, step, out=code)
        payload = columns[1:] * ~is_code
        sent = payload[-2].astype(np.uint16) | (payload[-1].astype(np.uint16) << 8)
        is_whole = (code == length) & (payload[0] == SAMPLE) & (checksums(payload[:-2]) == sent)
        is_whole[may_be_flipped(payload)] = False
        return payload, is_whole

    def _find_information(self, gap: bytes) -> tuple[Information | None, int]:
        """The information frame at the end of ``gap`` (or None), and the position in ``gap`` where it begins."""
        begins = gap.rfind(_INFORMATION_BEGINS) - 1
        payload = unframed(gap[begins:]) if begins >= 0 else None
        # A flipped bit in a COBS code leaves a zero or a code among the text's characters, which have neither value.
        if payload is None or not is_intact(payload) or not _PRINTABLE.issuperset(payload[1:-2]):
            return None, 0
        try:
            return Information.from_text(payload[1:-2].decode("ascii")), begins
        except FormatError:
            return None, 0

    def _blame(self, gap: bytes, length: int) -> None:
        """Count the kind of damage of a gap that contains no frame."""
        payload = unframed(gap) if length == len(gap) else None
        if payload is None or len(payload) < 3:
            self._counters.malformed += 1
        elif not is_intact(payload):
            self._counters.bad_crc += 1
        elif payload[0] not in (SAMPLE, INFORMATION):
            self._counters.unknown_type += 1
        else:
            self._counters.malformed += 1
