"""What the wire's decoders take, refuse and say at their edges: commands, words in lines, information, clocks."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from smartshoe.devices.wire._commands import Command, CommandDecoder, encode_command
from smartshoe.devices.wire._framing import framed, is_intact, unframed
from smartshoe.devices.wire._line_clock import told_unit
from smartshoe.devices.wire._ordering import MOST_DOUBTS, REMEMBERED, Ordering
from smartshoe.devices.wire.clock import DeviceClock
from smartshoe.devices.wire.counters import Counters
from smartshoe.devices.wire.delay_law import DelayLaw
from smartshoe.devices.wire.delay_line import of_few, robust_line
from smartshoe.devices.wire.frames import FrameDecoder
from smartshoe.devices.wire.information import ChannelInformation, Information
from smartshoe.devices.wire.lines import LineDecoder, encode_header, encode_lines, number, split_fields, without_label
from smartshoe.devices.wire.samples import Samples, join_samples
from smartshoe.devices.wire.sniff import guess, looks_like
from smartshoe.errors import FormatError, UsageError
from smartshoe.units import COUNTS, MILLIBAR, unit

PERIOD_US = 5000


# -- commands and frames -----------------------------------------------------------------------------------------
@pytest.mark.parametrize(
    "payload",
    [b"\x85", b"\x01", b"\x85\0\0\0\0", b"\x81\0", b"\x83", b"\x83\1\2\3", b"\x83\1\2\3\4\5", b"\x83\0\0\0\0", b""],
)
def test_a_whole_frame_that_is_no_command_is_left_out(payload: bytes) -> None:
    data = b"\0" + framed(payload) + encode_command(Command("stop"))
    assert CommandDecoder().feed(data) == [Command("stop")]


def test_a_rate_goes_over_the_wire_to_the_millihertz() -> None:
    most = (2**32 - 1) / 1000.0
    for rate_hz in (0.001, 33.333, most):
        assert CommandDecoder().feed(encode_command(Command("rate", rate_hz))) == [Command("rate", rate_hz)]
    with pytest.raises(UsageError, match=r"give 0\.001 to"):
        Command("rate", most + 0.001)


def test_a_frame_without_content_is_not_intact() -> None:
    assert not is_intact(b"\xff\xff")  # the checksum of nothing
    assert is_intact(unframed(framed(b"\x81")[:-1]) or b"")
    assert unframed(b"\x05ab") is None


HARMED = bytearray(framed(b"\x55abc")[:-1])
HARMED[-1] ^= 1


@pytest.mark.parametrize(
    ("gap", "counted"),
    [
        (framed(b"\x55abc")[:-1], "unknown_type"),
        (framed(b"\x01abc")[:-1], "malformed"),  # a sample of no possible length
        (framed(b"\x02protocol=1")[:-1], "malformed"),
        (framed(b"")[:-1], "malformed"),
        (b"\x05ab", "malformed"),
        (bytes(HARMED), "bad_crc"),
    ],
)
def test_what_stands_between_two_zeros_and_is_no_frame_is_counted_by_what_is_wrong(gap: bytes, counted: str) -> None:
    decoder = FrameDecoder()
    assert len(decoder.feed(b"\0" + gap + b"\0" + gap + b"\0")) == 0
    counters = decoder.counters.as_dict()
    assert {name: number for name, number in counters.items() if number} == {counted: 2, "bytes": 2 * len(gap) + 3}
    assert decoder.counters.bad == 2


# -- lines -------------------------------------------------------------------------------------------------------
def fed(text: str, **settings: Any) -> tuple[Samples, LineDecoder]:
    decoder = LineDecoder(**settings)
    return decoder.feed(text.encode()), decoder


def lines(count: int, first: int = 0, row: str = "1,2,3,4") -> str:
    return "".join(f"{5 * k},{row}\n" for k in range(first, first + count))


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("7.5", 7.5), ("toe:7.5", 7.5), ("toe: 7.5", 7.5), ("", None), ("nan", None), ("NA", None), ("-", None),
        ("ovf", None), ("toe:nan", None),
    ],
)  # fmt: skip
def test_a_field_is_a_number_with_or_without_a_label_or_no_reading(field: str, value: float | None) -> None:
    samples, decoder = fed(lines(10, row=f"1,{field},3,4"))
    assert len(samples) == 10
    assert decoder.counters.malformed == 0
    assert samples.missing[:, 1].all() == (value is None)
    assert samples.readings[0, 1] == (value or 0.0)


@pytest.mark.parametrize("field", ["abc", "1_0", "inf", "0x10", "1e999", "toe:abc", "7:5", "1 2"])
def test_a_line_with_a_word_for_a_number_is_none(field: str) -> None:
    samples, decoder = fed(lines(10) + f"50,1,{field},3,4\n" + lines(10, first=11))
    assert len(samples) == 20
    assert decoder.counters.malformed == 1


@pytest.mark.parametrize(
    ("text", "value"), [("1", 1.0), (" -1.5e3 ", -1500.0), ("", None), ("1_0", None), ("e", None), ("+", None)]
)
def test_a_number_is_what_is_written_out(text: str, value: float | None) -> None:
    assert number(text) == value


def test_a_label_is_a_name_before_a_colon() -> None:
    assert [without_label(field) for field in ("toe:1", "toe", "1:2", ":1", "a b:1", "12")] == [
        "1", "toe", "1:2", ":1", "a b:1", "12",
    ]  # fmt: skip
    assert split_fields("1,5;2;") == ["1.5", "2", ""]
    assert split_fields("1,2,") == ["1", "2", ""]
    assert split_fields(" 1  2 ") == ["1", "2"]


def test_a_header_that_comes_later_may_repeat_and_not_change_the_unit() -> None:
    header = "time_ms,toe_mbar,meta1_mbar,meta4_mbar,heel_mbar\n"
    samples, decoder = fed(header + lines(10) + header + lines(10, first=10))
    assert (len(samples), samples.unit, decoder.counters.information, decoder.counters.bad) == (20, MILLIBAR, 2, 0)
    samples, decoder = fed(header + lines(10) + header.replace("mbar", "kpa") + lines(10, first=10))
    assert (len(samples), samples.unit, decoder.counters.information, decoder.counters.bad) == (20, MILLIBAR, 1, 1)
    assert decoder.counters.resynchronisations == 1
    samples, _ = fed(header.replace("mbar", "kpa") + lines(10))
    assert samples.unit == unit("kPa")


def test_a_line_with_a_field_too_many_or_too_few_is_none() -> None:
    samples, decoder = fed(lines(6) + "30,1,2,3\n35,1,2,3,4,5\n40,1,2,3,4,\n" + lines(6, first=9))
    assert samples.device_time_s.tolist() == pytest.approx([0.005 * k for k in (*range(6), *range(8, 15))])
    assert decoder.counters.malformed == 2


@pytest.mark.parametrize("chunk", [1, 700, 5000])
def test_the_end_of_a_line_that_is_too_long_is_no_line_of_its_own(chunk: int) -> None:
    """Nor is a line that is too long with blanks alone."""
    for long in ("7" * 2000 + "\n", "30,1,2,3,4" + " " * 2000 + "\n"):
        text = (lines(6) + long + lines(6, first=7)).encode()
        decoder = LineDecoder()
        got = [decoder.feed(text[start : start + chunk]) for start in range(0, len(text), chunk)]
        assert sum(map(len, got)) == 12
        assert decoder.counters.malformed == 1
    decoder = LineDecoder()
    decoder.feed(lines(6).encode() + b"x" * 2000)
    assert len(decoder.feed(b"\n" + lines(3, first=6).encode())) == 3
    decoder.feed(b"x" * 2000)
    assert len(decoder.feed(b"45,1,2,3,4\n" + lines(3, first=10).encode())) == 3


def test_what_is_printed_has_its_header_its_checksum_and_its_decimals() -> None:
    assert encode_header() == b"t,toe,meta1,meta4,heel\n"
    assert encode_header(["a", "b"], ";") == b"a;b\n"
    assert encode_lines(0.25, [[1.0, np.nan, 2.34567]], decimals=2) == b"0.250000,1,,2.35\n"
    assert encode_lines([1.0], [[2.0]], is_checksummed=True) == b"1,2*2F\n"  # 0x31 ^ 0x2C ^ 0x32


@pytest.mark.parametrize(
    ("times", "told"),
    [
        ([0, 1000, 2000], "us"), ([0, 999, 1998], "ms"), ([0, 5, 10], "ms"), ([0.0, 0.5, 1.0], "s"),
        ([0.5, 1.5, 2.5], "ms"), ([0.5, 1.4, 2.3], "s"), ([7, 7, 7], "ms"), ([4294960000, 2000, 4000, 6000], "us"),
    ],
)  # fmt: skip
def test_the_unit_of_times_is_told_from_their_steps(times: list[float], told: str) -> None:
    assert told_unit([float(time) for time in times]) == told


# -- information -------------------------------------------------------------------------------------------------
def information(**changes: Any) -> Information:
    channels = (ChannelInformation("toe", "mbar", 0.0, 100.0), ChannelInformation("heel", "mbar", -20.0, 180.0))
    return Information(**{"firmware": "1.0", "serial_number": "L-1", "rate_hz": 200.0, "channels": channels, **changes})


LONGEST = 480 - len(information(firmware="f").to_text()) + 1


@pytest.mark.parametrize(
    "changes", [{"rate_hz": 0.5}, {"full_scale_counts": 1}, {"full_scale_counts": 65534}, {"firmware": "f" * LONGEST}]
)
def test_information_at_its_bounds_comes_back(changes: dict[str, Any]) -> None:
    made = information(**changes)
    assert Information.from_text(made.to_text()) == made


@pytest.mark.parametrize(
    "changes",
    [
        {"rate_hz": 0.0}, {"rate_hz": float("inf")}, {"full_scale_counts": 0}, {"full_scale_counts": 65535},
        {"channels": ()}, {"firmware": ""}, {"firmware": "a;b"}, {"serial_number": "ü"}, {"serial_number": "\t"},
        {"firmware": "f" * (LONGEST + 1)}, {"channels": (ChannelInformation("toe", "mbar", 1.0, 1.0),)},
    ],
)  # fmt: skip
def test_information_beyond_its_bounds_is_refused(changes: dict[str, Any]) -> None:
    with pytest.raises(FormatError, match="information of device"):
        information(**changes)


def counts(readings: list[list[float]], **changes: Any) -> Samples:
    n = len(readings)
    none, shape = np.arange(n), (n, len(readings[0]))
    made = Samples(none, 0.005 * none, np.array(readings), np.zeros(shape, bool), ("c0", "c1"), COUNTS, 0 * none, none)
    return replace(made, **changes)


def test_counts_become_readings_in_the_first_channels_unit() -> None:
    readings = [[0.0, 0.0], [4095.0, 4095.0], [2047.5, 2047.5]]
    scaled = information().scale(counts(readings))
    assert (scaled.unit, scaled.names) == (MILLIBAR, ("toe", "heel"))
    assert scaled.readings == pytest.approx(np.array([[0.0, -20.0], [100.0, 180.0], [50.0, 80.0]]))
    mixed = information(
        channels=(ChannelInformation("toe", "mbar", 0.0, 100.0), ChannelInformation("heel", "kPa", -2.0, 18.0))
    ).scale(counts(readings))
    assert mixed.readings == pytest.approx(scaled.readings)
    for other in ("V", "counts"):  # of no one quantity: counts stay
        two = information(
            channels=(ChannelInformation("toe", "mbar", 0.0, 100.0), ChannelInformation("heel", other, 0.0, 5.0))
        ).scale(counts(readings))
        assert (two.unit, two.names) == (COUNTS, ("toe", "heel"))
        assert two.readings.tolist() == readings
    strange = tuple(ChannelInformation(name, unit, 0.0, 1.0) for name, unit in (("toe", "blobs"), ("heel", "blebs")))
    assert information(channels=strange).scale(counts(readings)).unit == COUNTS
    alike = tuple(replace(channel, unit="blobs") for channel in strange)
    assert information(channels=alike).scale(counts(readings)).unit.symbol == "blobs"
    assert information(channels=strange[:1]).scale(counts(readings)).names == ("c0", "c1")


def test_parts_of_a_stream_joined_are_the_stream() -> None:
    whole = counts([[float(k), -float(k)] for k in range(9)])
    fields = ("sequence", "device_time_s", "readings", "missing", "boot", "end")
    parts = [
        replace(whole, **{name: getattr(whole, name)[part] for name in fields})
        for part in (slice(0, 4), slice(4, 5), slice(5, 9))
    ]
    again = join_samples(parts)
    for name in fields:
        np.testing.assert_array_equal(getattr(again, name), getattr(whole, name))
    assert join_samples(parts[:1]) is parts[0]
    none = Samples.empty(("a",), MILLIBAR)
    assert (len(none), none.readings.shape, none.missing.shape, none.unit) == (0, (0, 1), (0, 1), MILLIBAR)


@pytest.mark.parametrize(("numbers", "words", "is_lines"), [(4, 3, True), (3, 3, False), (1, 0, False), (2, 0, True)])
def test_lines_are_told_where_more_than_half_hold_numbers(numbers: int, words: int, is_lines: bool) -> None:
    data = b"begun\n" + b"5,1,2\n" * numbers + b"hello\n" * words + b"ends"
    assert guess(data) == ("lines" if is_lines else None)


def test_empty_lines_and_lines_without_an_end_are_told() -> None:
    assert looks_like(b"\n \n \n") == "empty text lines"
    assert looks_like(b"1,2,3") == "text without an end of line in 5 bytes"
    assert "such as 'hello'" in looks_like(b"x\nhello\nhello\n")
    assert looks_like(b"0,1,2,3\n" * 9).endswith("(where is the time? print millis() first)")
    assert "where is the time" not in looks_like(b"0,1,2\n" * 9)


# -- frames in their place ---------------------------------------------------------------------------------------
def placed(ordering: Ordering, frames: list[tuple[int, int]]) -> list[int]:
    block = np.array(frames, dtype=np.int64).reshape(-1, 2)
    return ordering.place(block[:, 0] & 0xFFFF, block[:, 1] & 0xFFFFFFFF).sequence.tolist()


@pytest.mark.parametrize(("behind", "is_late"), [(2, True), (REMEMBERED, True), (REMEMBERED + 1, False)])
def test_a_frame_is_late_within_those_that_are_remembered(behind: int, is_late: bool) -> None:
    regular = [(1000 + k, PERIOD_US * (1000 + k)) for k in range(400)]
    lost = regular.pop(200)
    regular.insert(200 + behind, lost)
    counters = Counters()
    placed(Ordering(counters), regular)
    assert (counters.late, counters.implausible) == ((1, 0) if is_late else (0, 1))


@pytest.mark.parametrize("apart", [3, 300])
def test_a_pace_is_doubted_by_many_frames_together_alone(apart: int) -> None:
    """Pairs of frames that stray, far between, leave the period as it was; as many at once are another rate."""
    counters, times, time_us = Counters(), [], PERIOD_US * 1000.0
    for k in range(20 * apart + 400):
        in_pair = k > 300 and k % apart in (0, 1)
        time_us += PERIOD_US * (1.9 if in_pair else 1.0)
        times.append((1000 + k, round(time_us)))
    ordering = Ordering(counters)
    periods = []
    for frame in times:
        placed(ordering, [frame])
        periods.append(ordering._period_us or PERIOD_US)
    strayed = float(np.abs(np.array(periods[300:]) / PERIOD_US - 1.0).max())
    assert (strayed > 0.2) is (apart == 3)
    assert counters.lost == counters.implausible == counters.restarts == 0
    assert MOST_DOUBTS == 8


@pytest.mark.parametrize(("apart", "waits"), [(2, False), (200, False), (201, True)])
def test_of_a_streams_first_two_frames_the_second_waits_where_much_is_lost_between(apart: int, waits: bool) -> None:
    ordering = Ordering(Counters())
    counts, clocks = np.array([1000, 1000 + apart]), PERIOD_US * np.array([1000, 1000 + apart])
    found = ordering.place(counts, clocks)
    assert found.sequence.tolist() == ([1000] if waits else [1000, 1000 + apart])
    assert (found.held is not None) is waits
    assert placed(ordering, [(1001 + apart, PERIOD_US * (1001 + apart))])[-1] == 1001 + apart


# -- the clock ---------------------------------------------------------------------------------------------------
def test_a_fit_says_of_how_many_samples_and_bins_it_is() -> None:
    clock = DeviceClock()
    for _ in range(2):
        for start in (0.0, 0.24, 0.5, 0.8):  # the first bin begins with the first sample
            device_s = 100.1 + start + np.array([0.0, 0.004])
            clock.update(device_s, device_s + 3.0)
        assert clock.fit is not None
        assert (clock.fit.samples, clock.fit.bins) == (8, 2)
        clock.reset()


BIN = 50  # samples, of a quarter of a second


def delays_about(level: str, rng: np.random.Generator) -> np.ndarray:
    """Of a bin, with one of its levels at 10 ms exactly and the others scattered."""
    below, at = {"least": (0, 3), "tenth": (3, 6), "median": (15, 20)}[level]
    scattered = (rng.uniform(0.0, 0.008, below), np.full(at, 0.01), rng.uniform(0.012, 0.06, BIN - below - at))
    return rng.permutation(np.concatenate(scattered))


@pytest.mark.parametrize("level", ["least", "tenth", "median"])
def test_the_line_runs_through_the_level_that_scatters_least(level: str) -> None:
    clock, rng = DeviceClock(), np.random.default_rng(1)
    for k in range(16):
        device_s = 0.25 * k + 0.005 * np.arange(BIN)
        clock.update(device_s, device_s + 40.0 + delays_about(level, rng))
    assert clock.fit is not None
    assert clock.fit.level == level
    assert clock.fit.offset_sd_s < 2e-5
    if level == "least":
        assert clock.host_time(5.0) == pytest.approx(45.01, abs=1e-4)


def test_where_the_level_changes_the_line_goes_on_where_it_was() -> None:
    clock, rng = DeviceClock(), np.random.default_rng(2)
    errors, levels = [], []
    for k in range(18):
        device_s = 0.25 * k + 0.005 * np.arange(BIN)
        clock.update(device_s, device_s + 40.0 + np.clip(rng.normal(0.1, 0.01, BIN), 0.05, 0.15))
        assert clock.fit is not None
        errors.append(float(clock.host_time(device_s[-1]) - device_s[-1]))
        levels.append(clock.fit.level)
    assert levels[0] == "least"
    assert levels[-1] == "median"
    # The medians lie twenty milliseconds above the least delays.
    assert np.ptp(errors[4:]) < 0.01


def test_the_errors_of_a_line_through_few_bins_hold() -> None:
    time_s, inside, count = 0.25 * np.arange(8), 0, 400
    rng = np.random.default_rng(3)
    for _ in range(count):
        line = robust_line(time_s, 0.02 + rng.normal(0.0, 1e-3, 8))
        inside += abs(line.delay_s(line.about_s) - 0.02) < 1.96 * line.offset_sd_s
    assert 0.9 < inside / count < 0.975


def test_few_degrees_of_freedom_widen_an_error() -> None:
    from scipy.stats import t as student

    for free in (10, 30, 100):
        assert of_few(free) == pytest.approx(student.ppf(0.975, free) / student.ppf(0.975, 1e9), rel=0.02)


def test_a_laws_tables_hold_every_delay_that_is_not_among_the_longest() -> None:
    rng = np.random.default_rng(4)
    delay_s = rng.exponential(0.02, 3000)
    law = DelayLaw.of(delay_s, np.zeros(3000, dtype=bool))
    last_s = law._first_s + law._width_s * (law._score.size // 2 - 2)
    assert law._first_s < delay_s.min()
    assert last_s == pytest.approx(np.quantile(delay_s, 0.995), rel=0.01)
