"""Binary frames: the specified bytes, any chunks, no flipped bit taken, the good frame behind a bad one kept."""

from __future__ import annotations

import binascii
from itertools import pairwise

import numpy as np
import pytest
from cobs import cobs
from hypothesis import given, settings
from hypothesis import strategies as st

from smartshoe.devices.wire._checksums import FEW, checksum, checksums
from smartshoe.devices.wire._framing import framed
from smartshoe.devices.wire._scanning import SAMPLE, FrameScanner
from smartshoe.devices.wire.counters import Counters
from smartshoe.devices.wire.frames import (
    ChannelInformation,
    FrameDecoder,
    Information,
    encode_information,
    encode_samples,
)
from smartshoe.devices.wire.samples import Samples, join_samples
from smartshoe.errors import FormatError, UsageError
from smartshoe.units import COUNTS, MILLIBAR

FRAME = 19
INFORMATION = Information(
    "shoe-1.2",
    "L-0042",
    200.0,
    (
        ChannelInformation("toe", "mbar", 0.0, 100.0),
        ChannelInformation("meta1", "mbar", 0.0, 200.0),
        ChannelInformation("meta4", "mbar", 0.0, 200.0),
        ChannelInformation("heel", "mbar", -20.0, 180.5),
    ),
    4095,
)


def _stream(n: int, seed: int = 3) -> tuple[list[bytes], np.ndarray]:
    rng = np.random.default_rng(seed)
    # Many zeros and small numbers, so that COBS has something to do.
    readings = rng.integers(0, 4096, (n, 4)) * rng.integers(0, 2, (n, 4))
    data = encode_samples(np.arange(n), np.arange(n) * 5000 + 70_000, readings)
    return [data[at : at + FRAME] for at in range(0, len(data), FRAME)], readings


def _feed(data: bytes, cuts: list[int] | None = None) -> tuple[Samples, FrameDecoder]:
    decoder = FrameDecoder()
    edges = [0, *sorted(cut % (len(data) + 1) for cut in cuts or []), len(data)]
    parts = [decoder.feed(data[start:stop]) for start, stop in pairwise(edges)]
    return join_samples(parts), decoder


def _same(one: Samples, other: Samples) -> bool:
    return all(
        np.array_equal(getattr(one, name), getattr(other, name))
        for name in ("sequence", "device_time_s", "readings", "missing", "boot", "end")
    )


def test_a_frame_is_byte_for_byte_as_specified() -> None:
    payload = bytes.fromhex("01 3412 78563412 0100 0200 ff0f 0000")
    frame = encode_samples([0x1234], [0x12345678], [[1, 2, 4095, 0]])
    crc = binascii.crc_hqx(payload, 0xFFFF).to_bytes(2, "little")
    assert frame == cobs.encode(payload + crc) + b"\0"
    assert len(frame) == FRAME


def test_65535_says_that_there_is_no_reading_and_any_other_count_is_one() -> None:
    counts = [[65534.0, 65533.0, 0.0, np.nan], [1.0, 32767.0, 32768.0, 65534.0], [65534.0, 0.0, 1.0, 65533.0]]
    frames = [encode_samples([k], [5000 * k], [row]) for k, row in enumerate(counts)]
    payload = cobs.decode(frames[0][:-1])
    assert payload[7:15] == bytes.fromhex("feff fdff 0000 ffff")
    got, _ = _feed(b"".join(frames))
    assert np.array_equal(got.missing, np.isnan(counts))
    assert got.readings[~got.missing].tolist() == [count for row in counts for count in row if not np.isnan(count)]
    for count in (-1.0, 65535.0, 1e9):
        with pytest.raises(UsageError, match="65534"):
            encode_samples([0], [0], [[0.0, count, 0.0, 0.0]])


def test_the_checksum_is_that_of_its_catalogue() -> None:
    assert checksum(b"123456789") == 0x29B1


@settings(max_examples=15)
@given(st.integers(1, 40), st.sampled_from([1, 7, FEW + 1]), st.randoms(use_true_random=False))
def test_checksums_of_many_are_those_of_each(length: int, n: int, random) -> None:  # type: ignore[no-untyped-def]
    rows = [random.randbytes(length) for _ in range(n)]
    columns = np.frombuffer(b"".join(rows), dtype=np.uint8).reshape(n, length).T
    assert checksums(np.ascontiguousarray(columns)).tolist() == [checksum(row) for row in rows]


ROW = st.tuples(st.integers(0, 2**40), st.integers(0, 2**40), st.lists(st.integers(0, 65534), min_size=4, max_size=4))


@settings(max_examples=60)
@given(st.lists(ROW, min_size=1, max_size=5))
def test_encoded_frames_are_cobs_of_the_payload(rows) -> None:  # type: ignore[no-untyped-def]
    data = encode_samples([r[0] for r in rows], [r[1] for r in rows], [r[2] for r in rows])
    for row, gap in zip(rows, data.split(b"\0")[:-1], strict=True):
        payload = cobs.decode(gap)
        assert int.from_bytes(payload[-2:], "little") == checksum(payload[:-2])
        assert payload[0] == SAMPLE
        assert int.from_bytes(payload[1:3], "little") == row[0] % 2**16
        assert int.from_bytes(payload[3:7], "little") == row[1] % 2**32
        assert [int.from_bytes(payload[k : k + 2], "little") for k in range(7, 15, 2)] == row[2]


def test_what_is_encoded_is_decoded() -> None:
    frames, readings = _stream(3000)
    got, decoder = _feed(b"".join(frames))
    assert np.array_equal(got.sequence, np.arange(3000))
    assert np.allclose(got.device_time_s, np.arange(3000) * 5e-3 + 0.07, rtol=0, atol=1e-12)
    assert np.array_equal(got.readings, readings)
    assert not got.missing.any()
    assert got.unit == COUNTS
    assert decoder.counters == Counters(frames=3000, bytes=3000 * FRAME)


@pytest.mark.parametrize("channels", [1, 8, 100])
def test_any_number_of_channels(channels: int) -> None:
    readings = np.random.default_rng(1).integers(0, 65535, (50, channels))
    decoder = FrameDecoder([f"c{k}" for k in range(channels)])
    got = decoder.feed(encode_samples(np.arange(50), np.arange(50) * 1000, readings))
    assert np.array_equal(got.readings, readings)


def _plain_payloads(data: bytes) -> list[bytes]:
    """The slow twin of the scanner: gap by gap, with `cobs` and `binascii`."""
    found = []
    for gap in data.split(b"\0")[:-1]:
        try:
            payload = cobs.decode(gap[-FRAME + 1 :])
        except cobs.DecodeError:
            continue
        if len(payload) == 17 and payload[0] == 1 and checksum(payload[:-2]) == int.from_bytes(payload[-2:], "little"):
            found.append(payload)
    return found


@settings(max_examples=60)
@given(st.randoms(use_true_random=False), st.lists(st.integers(0, 10_000), max_size=30))
def test_the_scanner_does_as_its_plain_twin_whatever_comes(random, cuts) -> None:  # type: ignore[no-untyped-def]
    frames, _ = _stream(60, random.randrange(100))
    harmed = bytearray(b"".join(frames))
    for _ in range(random.randrange(40)):
        at = random.randrange(len(harmed))
        match random.randrange(4):
            case 0:
                harmed[at] ^= 1 << random.randrange(8)
            case 1:
                del harmed[at : at + random.randrange(30)]
            case 2:
                harmed[at:at] = random.randbytes(random.randrange(60))
            case _:
                harmed[at:at] = bytes(random.randrange(5))
    data = bytes(harmed)
    scanner = FrameScanner(17, Counters())
    edges = [0, *sorted(cut % (len(data) + 1) for cut in cuts), len(data)]
    got = [scanner.feed(data[start:stop]).payloads for start, stop in pairwise(edges)]
    assert [column.tobytes() for column in np.concatenate(got, axis=1).T] == _plain_payloads(data)
    one, one_decoder = _feed(data)
    many, many_decoder = _feed(data, cuts)
    assert _same(one, many)
    assert one_decoder.counters == many_decoder.counters


def test_no_flipped_bit_of_a_frame_or_of_the_zeros_about_it_is_taken() -> None:
    frames, readings = _stream(40)
    clean = b"".join(frames)
    for bit in range(8 * FRAME * 18, 8 * FRAME * 22):  # four frames with their zeros
        harmed = bytearray(clean)
        harmed[bit // 8] ^= 1 << (bit % 8)
        got, decoder = _feed(bytes(harmed))
        hit = bit // (8 * FRAME)
        assert got.sequence.tolist() == [k for k in range(40) if k != hit], bit
        assert np.array_equal(got.readings, readings[got.sequence])
        assert decoder.counters.bad >= 1
        assert decoder.counters.resynchronisations == 1
        assert decoder.counters.lost == 1


@settings(max_examples=60)
@given(st.binary(min_size=1, max_size=1500))
def test_the_first_whole_frame_after_garbage_is_found(garbage: bytes) -> None:
    frames, _ = _stream(30)
    got, _ = _feed(garbage + b"".join(frames))
    assert got.sequence[-30:].tolist() == list(range(30))


def test_a_frame_without_its_end_does_not_take_the_next_along() -> None:
    frames, _ = _stream(30)
    frames[10] = frames[10][:7]
    got, decoder = _feed(b"".join(frames))
    assert got.sequence.tolist() == [k for k in range(30) if k != 10]
    assert (decoder.counters.malformed, decoder.counters.lost) == (1, 1)


@settings(max_examples=20)
@given(st.integers(0, 3), st.lists(st.integers(0, 10_000), max_size=10))
def test_garbage_beyond_any_frames_length_is_forgotten_the_same_in_any_chunks(zeros: int, cuts: list[int]) -> None:
    frames, _ = _stream(30)
    data = b"\x55" * 2000 + bytes(zeros) + b"".join(frames[:15]) + b"\xaa" * 700 + b"".join(frames[15:])
    one, one_decoder = _feed(data)
    many, many_decoder = _feed(data, cuts)
    assert _same(one, many)
    assert one_decoder.counters == many_decoder.counters
    assert one.sequence.tolist() == list(range(30))


def test_a_reading_that_is_not_there_is_a_mask_over_the_last_one() -> None:
    readings = np.array([[1.0, 2.0, 3.0, 4.0]] * 6)
    readings[2:4, 1] = np.nan
    readings[0, 0] = np.nan
    data = encode_samples(np.arange(6), np.arange(6) * 5000, readings)
    for cuts in ([], list(range(0, len(data), 7))):
        got, _ = _feed(data, cuts)
        assert np.array_equal(got.missing, np.isnan(readings))
        assert got.readings[2:4, 1].tolist() == [2.0, 2.0]
        assert got.readings[0, 0] == 0.0


def test_a_reconnection_forgets_the_begun_frame_only() -> None:
    frames, _ = _stream(100)
    decoder = FrameDecoder()
    first = decoder.feed(b"".join(frames[:50]) + frames[50][:9])
    decoder.reset()
    second = decoder.feed(frames[60][5:] + b"".join(frames[61:]))
    assert join_samples([first, second]).sequence.tolist() == [*range(50), *range(61, 100)]
    assert decoder.counters.lost == 11
    assert decoder.counters.resynchronisations == 1


def test_a_restarted_device_begins_a_new_boot() -> None:
    frames, _ = _stream(300)
    got, decoder = _feed(b"".join(frames) + b"".join(frames[:80]))
    assert got.boot.tolist() == [0] * 300 + [1] * 80
    assert got.sequence[300:].tolist() == list(range(80))
    assert got.device_time_s[300] == pytest.approx(0.07)
    assert decoder.counters.restarts == 1


def test_an_unknown_type_is_counted_and_left_out() -> None:
    frames, _ = _stream(20)
    other = framed(bytes([0x33]) + b"other")
    got, decoder = _feed(b"".join(frames[:10]) + other + b"".join(frames[10:]))
    assert len(got) == 20
    assert decoder.counters.unknown_type == 1


def test_information_comes_through_and_scales_the_counts() -> None:
    frames, readings = _stream(20)
    got, decoder = _feed(b"".join(frames[:7]) + encode_information(INFORMATION) + b"".join(frames[7:]))
    assert decoder.information == INFORMATION
    assert decoder.counters.information == 1
    scaled = INFORMATION.scale(got)
    assert scaled.unit == MILLIBAR
    assert np.allclose(scaled.readings[:, 0], readings[:, 0] / 4095 * 100)
    assert np.allclose(scaled.readings[:, 3], readings[:, 3] / 4095 * 200.5 - 20)
    assert INFORMATION.scale(scaled) is scaled


def test_information_is_found_behind_garbage_and_never_with_a_flipped_bit() -> None:
    frame = encode_information(INFORMATION)
    decoder = FrameDecoder()
    decoder.feed(b"garbage \xff\x02protocol=9" + frame[1:])
    assert decoder.information == INFORMATION
    for bit in range(8, 8 * len(frame)):
        harmed = bytearray(frame + b"\0")
        harmed[bit // 8] ^= 1 << (bit % 8)
        decoder = FrameDecoder()
        decoder.feed(bytes(harmed))
        assert decoder.information in (None, INFORMATION), bit
        assert decoder.information is None or bit // 8 == len(frame) - 1  # the zero behind, and there is another


def test_a_long_information_passes_too() -> None:
    long = Information("f" * 90, "s" * 90, 12.5, INFORMATION.channels, 65534)
    assert len(long.to_text()) > 254  # more than one block of COBS
    decoder = FrameDecoder()
    decoder.feed(encode_information(long))
    assert decoder.information == long


def test_information_with_keys_of_the_future_is_read() -> None:
    assert Information.from_text("battery=82;" + INFORMATION.to_text() + ";colour=red") == INFORMATION


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("protocol=2;x=1", "protocol 2"),
        ("protocol=1;firmware=f", "channels"),
        (INFORMATION.to_text().replace("rate_hz=200", "rate_hz=often"), "often"),
        (INFORMATION.to_text().replace("rate_hz=200", "rate_hz=0"), "rate"),
        (INFORMATION.to_text().replace("=4095", "=65535"), "full scale"),
        (INFORMATION.to_text().replace("meta1", "toe"), "different names"),
        (INFORMATION.to_text().replace(":0:100", ":100:0"), "does not rise"),
    ],
)
def test_wrong_information_says_what_is_wrong(text: str, says: str) -> None:
    with pytest.raises(FormatError, match=says):
        Information.from_text(text)


def test_readings_beyond_the_wire_are_refused() -> None:
    with pytest.raises(UsageError, match="65534"):
        encode_samples([0], [0], [[0, 0, 0, 65535]])
    with pytest.raises(UsageError, match="different names"):
        FrameDecoder(["toe", "toe"])


@given(st.lists(st.integers(0, 5000), max_size=12), st.integers(0, 30))
def test_each_sample_says_with_which_byte_it_was_whole(cuts: list[int], garbage: int) -> None:
    frames, _ = _stream(60)
    data = b"\xaa" * garbage + b"\0" + b"".join(frames)
    got, _ = _feed(data, cuts)
    assert got.end.tolist() == [garbage + 1 + FRAME * (k + 1) for k in range(60)]
