"""Text lines: what sketches print, in any chunks; what is no sample is counted and left out."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from smartshoe.devices.wire.lines import LONGEST_LINE, LineDecoder, encode_header, encode_lines, line_checksum
from smartshoe.devices.wire.samples import Samples, join_samples
from smartshoe.errors import UsageError
from smartshoe.units import COUNTS, MILLIBAR, VOLT


def _feed(data: bytes, cuts: list[int] | None = None, **options) -> tuple[Samples, LineDecoder]:  # type: ignore[no-untyped-def]
    decoder = LineDecoder(**options)
    edges = [0, *sorted(cut % (len(data) + 1) for cut in cuts or []), len(data)]
    return join_samples([decoder.feed(data[start:stop]) for start, stop in pairwise(edges)]), decoder


def _lines(n: int, step_ms: int = 5) -> tuple[bytes, np.ndarray]:
    readings = np.random.default_rng(2).integers(0, 4096, (n, 4)) / 8.0
    return encode_lines(1000 + np.arange(n) * step_ms, readings), readings


def test_what_is_printed_is_read() -> None:
    data, readings = _lines(500)
    got, decoder = _feed(data, unit="mbar")
    assert np.array_equal(got.readings, readings)
    assert np.allclose(got.device_time_s, 1.0 + np.arange(500) * 5e-3, rtol=0, atol=1e-12)
    assert got.sequence.tolist() == list(range(500))
    assert got.unit == MILLIBAR
    assert decoder.counters.frames == 500
    assert decoder.counters.bad == 0


@settings(max_examples=60)
@given(st.randoms(use_true_random=False), st.lists(st.integers(0, 100_000), max_size=30))
def test_chunks_make_no_difference_whatever_comes(random, cuts) -> None:  # type: ignore[no-untyped-def]
    harmed = bytearray(encode_header() + _lines(80)[0])
    for _ in range(random.randrange(20)):
        at = random.randrange(len(harmed))
        match random.randrange(4):
            case 0:
                harmed[at] ^= 1 << random.randrange(8)
            case 1:
                del harmed[at : at + random.randrange(40)]
            case 2:
                harmed[at:at] = random.randbytes(random.randrange(60))
            case _:
                harmed[at:at] = b"x" * random.randrange(3000)
    one, one_decoder = _feed(bytes(harmed))
    many, many_decoder = _feed(bytes(harmed), cuts)
    assert np.array_equal(one.device_time_s, many.device_time_s)
    assert np.array_equal(one.readings, many.readings)
    assert np.array_equal(one.boot, many.boot)
    assert one_decoder.counters == many_decoder.counters
    for boot in set(one.boot.tolist()):
        assert (np.diff(one.device_time_s[one.boot == boot]) > 0).all()


@pytest.mark.parametrize(
    ("text", "times"),
    [
        ("0,1,2,3,4\n5,1,2,3,4\n10,1,2,3,4\n15,1,2,3,4\n20,1,2,3,4\n25,1,2,3,4\n", [0.0, 0.005, 0.01]),
        ("1000,1,2,3,4\n6000,1,2,3,4\n11000,1,2,3,4\n16000,1,2,3,4\n21000,1,2,3,4\n26000,1,2,3,4\n", [1e-3, 6e-3]),
        ("0.5,1,2,3,4\n0.51,1,2,3,4\n0.52,1,2,3,4\n0.53,1,2,3,4\n0.54,1,2,3,4\n0.55,1,2,3,4\n", [0.5, 0.51]),
        (
            "0.5 1 2 3 4\r\n5.5 1 2 3 4\r\n10.5 1 2 3 4\r\n15.5 1 2 3 4\r\n20.5 1 2 3 4\r\n25.5 1 2 3 4\r\n",
            [5e-4, 55e-4],
        ),
        (
            "0\t1,5\t2\t3\t4\n5\t1,5\t2\t3\t4\n10\t1,5\t2\t3\t4\n15\t1\t2\t3\t4\n20\t1\t2\t3\t4\n25\t1\t2\t3\t4\n",
            [0, 5e-3],
        ),
        ("0;1,5;2;3;4\n5;1;2;3;4\n10;1;2;3;4\n15;1;2;3;4\n20;1;2;3;4\n25;1;2;3;4\n", [0.0, 5e-3]),
    ],
)
def test_units_of_time_and_separators_are_told(text: str, times: list[float]) -> None:
    got, decoder = _feed(text.encode())
    assert got.device_time_s[: len(times)].tolist() == pytest.approx(times)
    assert len(got) == 6
    assert decoder.counters.bad == 0


def test_a_header_names_columns_in_any_order_with_units() -> None:
    data = b"time_us,heel_v,toe_v,extra,meta1_v,meta4_v\n" + b"".join(b"%d,4,1,9,2,3\n" % (k * 1000) for k in range(5))
    got, _ = _feed(data)
    assert got.readings.tolist() == [[1.0, 2.0, 3.0, 4.0]] * 5
    assert got.names == ("toe", "meta1", "meta4", "heel")
    assert got.unit == VOLT
    assert got.device_time_s.tolist() == pytest.approx([0.0, 1e-3, 2e-3, 3e-3, 4e-3])


def test_columns_of_ones_own() -> None:
    got, _ = _feed(b"1.5,7,0\n2.5,7,5\n3.5,7,10\n", columns=("a", "b", "millis"), unit="V")
    assert got.names == ("a", "b")
    assert got.readings.tolist() == [[1.5, 7.0], [2.5, 7.0], [3.5, 7.0]]
    assert got.device_time_s.tolist() == [0.0, 0.005, 0.01]


def test_comments_garbage_and_half_lines_are_left_out() -> None:
    data, readings = _lines(40)
    lines = data.splitlines(keepends=True)
    lines[0] = lines[0][3:]
    lines[10:10] = [b"# battery low\r\n", b"\xff\xfe\x00garbage\n", b"E (1234) wifi: oops\n", b"1,2,3\n", b"\n"]
    got, decoder = _feed(b"".join(lines))
    assert got.readings.tolist()[-39:] == readings[1:].tolist()
    counters = decoder.counters
    assert (counters.information, counters.malformed, counters.implausible, counters.resynchronisations) == (1, 3, 1, 1)


def test_a_line_without_an_end_takes_no_memory_and_is_one_that_is_left_out() -> None:
    data, readings = _lines(20)
    decoder = LineDecoder()
    got = [decoder.feed(data)]
    for _ in range(50):
        got.append(decoder.feed(b"1," * 2000))
        assert len(decoder._rest) <= LONGEST_LINE
    later, _ = _lines(40)
    got.append(decoder.feed(b"2\n" + later[len(data) :]))
    assert decoder.counters.malformed == 1
    assert join_samples(got).readings.tolist()[:19] == readings[:19].tolist()


def test_the_serial_plotters_labels_are_read() -> None:
    got, _ = _feed(b"".join(b"t:%d,toe:1.5,meta1:2,meta4:3,heel:4\n" % (5 * k) for k in range(6)))
    assert got.readings[0].tolist() == [1.5, 2.0, 3.0, 4.0]


def test_an_empty_field_is_a_missing_reading() -> None:
    readings = np.ones((6, 4))
    readings[3, 2] = np.nan
    got, _ = _feed(encode_lines(np.arange(6) * 5, readings))
    assert np.array_equal(got.missing, np.isnan(readings))
    assert got.readings[3, 2] == 1.0


def test_a_line_that_leaps_in_time_is_dropped_and_those_about_it_stay() -> None:
    lines = _lines(100)[0].splitlines(keepends=True)
    lines[50] = b"91250,1,2,3,4\n"
    got, decoder = _feed(b"".join(lines))
    assert len(got) == 99
    assert decoder.counters.implausible == 1
    assert (np.diff(got.device_time_s) > 0).all()


def test_counters_that_turn_go_on() -> None:
    times = (2**32 - 25_000 + np.arange(20) * 5000) % 2**32
    got, _ = _feed(encode_lines(times, np.ones((20, 4))), time="us")
    assert np.diff(got.device_time_s) == pytest.approx(np.full(19, 5e-3))
    assert not got.boot.any()


def test_a_restart_is_another_boot_and_a_pause_is_not() -> None:
    def stretch(start: int) -> bytes:
        return encode_lines(start + np.arange(100) * 5, np.ones((100, 4)))

    got, decoder = _feed(stretch(0) + stretch(600_000) + stretch(120))
    assert got.boot.tolist() == [0] * 200 + [1] * 100
    assert got.device_time_s[[100, 200]].tolist() == [600.0, 0.12]
    assert decoder.counters.restarts == 1


def test_repeated_and_late_lines_are_left_out() -> None:
    lines = _lines(100)[0].splitlines(keepends=True)
    lines[51:51] = [lines[50]]
    lines.insert(80, lines.pop(75))
    got, decoder = _feed(b"".join(lines))
    assert (decoder.counters.duplicated, decoder.counters.late, len(got)) == (1, 1, 99)


@settings(max_examples=100)
@given(st.integers(0, 50 * 30))
def test_with_checksums_no_flipped_bit_is_taken(bit: int) -> None:
    readings = np.random.default_rng(2).integers(0, 4096, (50, 4))
    data = bytearray(encode_lines(np.arange(50) * 5, readings, is_checksummed=True))
    at = len(data) // 3 + bit // 8
    data[at] ^= 1 << (bit % 8)
    got, decoder = _feed(bytes(data), time="ms")
    place = np.rint(got.device_time_s / 5e-3).astype(int)
    assert np.array_equal(got.readings, readings[place])
    assert len(got) >= 48
    assert decoder.counters.bad >= 1


def test_the_checksum_is_nmeas() -> None:
    assert line_checksum("GPGLL,5300.97914,N,00259.98174,E,125926,A") == 0x28


@pytest.mark.parametrize("mark", [b"# ", b"#"])
def test_comments_may_say_who_speaks(mark: bytes) -> None:
    data = b"".join(mark + said + b"\n" for said in (b"firmware: walk-3", b"serial: R-7", b"rate: 100 Hz"))
    data += _lines(10, 10)[0]
    _, decoder = _feed(data)
    assert decoder.information is not None
    assert decoder.information.serial_number == "R-7"
    assert decoder.information.firmware == "walk-3"
    assert decoder.information.rate_hz == 100.0


def test_columns_that_cannot_be_are_refused() -> None:
    for columns in (("toe", "heel"), ("t",), ("t", "toe", "toe"), ("t", "")):
        with pytest.raises(UsageError, match="give one time"):
            LineDecoder(columns)
    assert LineDecoder(("t", "toe")).feed(b"").unit == COUNTS


def test_a_line_with_a_wrong_checksum_is_refused() -> None:
    good = encode_lines(np.arange(20) * 5, np.arange(80).reshape(20, 4), is_checksummed=True).splitlines(keepends=True)
    good[10] = good[10].replace(b",41,", b",47,")
    got, decoder = _feed(b"".join(good), time="ms")
    assert got.readings[:, 0].tolist() == [4.0 * k for k in range(20) if k != 10]
    assert (decoder.counters.bad_crc, decoder.counters.malformed) == (1, 0)


def test_once_a_line_had_a_checksum_one_without_is_refused() -> None:
    lines = encode_lines(np.arange(20) * 5, np.arange(80).reshape(20, 4), is_checksummed=True).splitlines(keepends=True)
    lines[10] = lines[10].partition(b"*")[0].replace(b",41,", b",47,") + b"\n"
    got, decoder = _feed(b"".join(lines), time="ms")
    assert got.readings[:, 0].tolist() == [4.0 * k for k in range(20) if k != 10]
    assert (decoder.counters.bad_crc, decoder.counters.malformed) == (0, 1)


@settings(max_examples=60)
@given(st.lists(st.integers(0, 1000), max_size=12), st.sampled_from([b"\n", b"\r\n"]))
def test_each_sample_says_with_which_byte_its_line_was_whole(cuts: list[int], ends: bytes) -> None:
    data = b"t,toe,meta1,meta4,heel\n" + _lines(30)[0]
    data = data.replace(b"\n", ends)
    got, _ = _feed(data, cuts, unit="mbar")
    first_of_end = [at + 1 for at in range(len(data)) if data[at : at + 1] == ends[:1]]
    assert got.end.tolist() == first_of_end[1:]
