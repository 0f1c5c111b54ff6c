"""How many frames a second the decoder takes on one core, by the size of the chunks; the plain way beside it.

``pytest -m benchmark tests/benchmarks/test_wire_speed.py -s``
"""

from __future__ import annotations

import binascii
import struct
import time

import numpy as np
import pytest
from cobs import cobs

from smartshoe.devices.wire.frames import FrameDecoder, encode_samples
from smartshoe.devices.wire.lines import LineDecoder, encode_lines

FRAME = 19
FRAMES = 300_000
RUNS = 5


def _stream(harmed_percent: float) -> bytes:
    rng = np.random.default_rng(1)
    count = np.arange(FRAMES)
    clock = count * 5000 + rng.integers(-300, 300, FRAMES)
    data = bytearray(encode_samples(count, clock, rng.integers(0, 4096, (FRAMES, 4))))
    for frame in np.flatnonzero(rng.random(FRAMES) < harmed_percent / 100.0):
        data[frame * FRAME + rng.integers(FRAME)] ^= 1 << int(rng.integers(8))
    return bytes(data)


def _rate(data: bytes, chunk: int, frames: int) -> float:
    """Frames a second, the best of `RUNS`."""
    best = np.inf
    for _ in range(RUNS):
        decoder = FrameDecoder()
        start = time.perf_counter()
        for at in range(0, len(data), chunk):
            decoder.feed(data[at : at + chunk])
        best = min(best, time.perf_counter() - start)
        assert decoder.counters.frames + decoder.counters.lost == frames
    return frames / best


def _plain_rate(data: bytes) -> float:
    start = time.perf_counter()
    whole = 0
    for gap in data.split(b"\0")[:-1]:
        payload = cobs.decode(gap)
        if binascii.crc_hqx(payload[:-2], 0xFFFF) == int.from_bytes(payload[-2:], "little"):
            struct.unpack("<BHI4H", payload[:-2])
            whole += 1
    return whole / (time.perf_counter() - start)


@pytest.mark.benchmark
def test_frames_a_second() -> None:
    clean, harmed = _stream(0.0), _stream(2.0)
    print("\n| chunk | clean | 2 % of frames with a flipped bit |\n| --- | --- | --- |")
    for chunk in (4096, 16384, 65536, 1 << 20):
        rates = [_rate(data, chunk, FRAMES) / 1e6 for data in (clean, harmed)]
        print(f"| {chunk} B | {rates[0]:.1f} M/s | {rates[1]:.1f} M/s |")
    few = 8000
    small = clean[: few * FRAME]
    for chunk in (FRAME, 200):
        print(f"| {chunk} B | {_rate(small, chunk, few) / 1e3:.0f} k/s | |")
    print(f"plain Python, cobs and binascii, checks of count and clock left out: {_plain_rate(clean) / 1e6:.2f} M/s")


@pytest.mark.benchmark
def test_lines_a_second() -> None:
    n = 50_000
    data = encode_lines(np.arange(n) * 5, np.random.default_rng(1).integers(0, 4096, (n, 4)))
    decoder = LineDecoder()
    start = time.perf_counter()
    for at in range(0, len(data), 4096):
        decoder.feed(data[at : at + 4096])
    assert decoder.counters.frames == n
    print(f"\ntext lines: {n / (time.perf_counter() - start) / 1e3:.0f} k/s")
