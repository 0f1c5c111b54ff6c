"""What bytes look like: the right decoder is chosen, and an error says what is there."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from smartshoe.devices.wire._framing import framed
from smartshoe.devices.wire.frames import encode_samples
from smartshoe.devices.wire.lines import encode_lines
from smartshoe.devices.wire.sniff import guess, looks_like

RNG = np.random.default_rng(1)
READINGS = RNG.integers(0, 4096, (60, 4))
FRAMES = encode_samples(np.arange(60), np.arange(60) * 5000, READINGS)
LINES = encode_lines(np.arange(60) * 5, READINGS)


@pytest.mark.parametrize(
    ("data", "format_", "says"),
    [
        (b"", None, "no bytes at all"),
        (bytes(300), None, "wrong baud rate"),
        (b"\xff" * 200 + bytes(100), None, "wrong baud rate"),
        (FRAMES[7:], "frames", "frames, 59 whole and 1 damaged"),
        (LINES[3:], "lines", "text lines of 5 numbers"),
        (encode_lines(np.arange(60) * 5, READINGS[:, :3]), "lines", "text lines of 4 numbers, not 5"),
        (encode_lines(np.arange(60) * 5, READINGS[:, :1]), "lines", "text lines of 2 numbers, not 5"),
        (b"".join(b"%d\n" % k for k in range(60)), None, "text lines of 1 number, not 5"),
        (encode_samples(np.arange(9), np.arange(9), READINGS[:9, :2]), "frames", "frames of 2 readings, not 4"),
        (framed(b"\x55hello, it is me") * 5, "frames", "type 0x55"),
        (b"rst:0x1 (POWERON_RESET),boot:0x13\r\nets Jun  8 2016\r\nload\r\n", None, "without numbers"),
        (b"hello " * 50, None, "text without an end of line"),
        (bytes(RNG.integers(128, 256, 512).tolist()), None, "binary without a zero byte in 512"),
        (b"\x7f\x81\x93\xaa\x00\xf1" * 80, None, "another protocol or baud rate"),
    ],
)
def test_bytes_are_told(data: bytes, format_: str | None, says: str) -> None:
    assert guess(data) == format_
    assert says in looks_like(data)


@pytest.mark.parametrize("whole", [2, 3, 10, 40])
def test_a_time_that_repeats_in_a_tenth_of_the_lines_is_told(whole: int) -> None:
    """However few came; the first line may be a half and the last unfinished, and neither is asked."""

    def told(times: list[int]) -> str:
        lines = b"".join(b"%d,1,2,3,4\n" % time for time in times)
        return looks_like(b"0,7,7\n" + lines + b"9,8")

    steady = list(range(0, 5 * whole, 5))
    assert "repeats" not in told(steady)
    often = [time - 5 * (k % 10 == 1) for k, time in enumerate(steady)]
    assert "print it finer" in told(often)
    seldom = [time - 5 * (k % 20 == 1) for k, time in enumerate(steady)]
    assert ("repeats" in told(seldom)) is (whole < 20)


def test_frames_with_another_checksum_are_told() -> None:
    harmed = bytearray(FRAMES)
    harmed[16::19] = bytes(max(byte ^ 0x55, 1) for byte in harmed[16::19])
    assert guess(bytes(harmed)) is None
    assert "checksum" in looks_like(bytes(harmed))


@settings(max_examples=200)
@given(st.binary(max_size=300))
def test_any_bytes_look_like_something(data: bytes) -> None:
    clause = looks_like(data)
    assert clause
    assert "\n" not in clause
    guess(data)
