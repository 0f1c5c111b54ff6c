"""Text lines as sketches print them, over a pseudo-terminal: their rate, their habits, and what is said of bad ones."""

from __future__ import annotations

import os
import threading
import time
import tty
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress

import pytest
from puppet import STEP_S, within

from smartshoe.devices._events import Silence, ToldLate
from smartshoe.devices.serial_link._settings import SerialSettings
from smartshoe.devices.serial_link.shoe import SerialShoe
from smartshoe.devices.wire.frames import encode_information, encode_samples
from smartshoe.devices.wire.information import ChannelInformation, Information
from smartshoe.devices.wire.samples import CHANNELS
from smartshoe.errors import DeviceError, DeviceTimeoutError
from smartshoe.units import COUNTS, MILLIBAR

DEVICE = Information("f", "L-0042", 100.0, tuple(ChannelInformation(name, "mbar", 0.0, 200.0) for name in CHANNELS))
pytestmark = pytest.mark.wire


@contextmanager
def board(said: Callable[[int], bytes], rate_hz: float) -> Iterator[str]:
    """The port of a board that says ``said`` of 0, 1, 2, ..., ``rate_hz`` times a second, and hears nothing."""
    here, there = os.openpty()
    tty.setraw(there)
    os.set_blocking(here, False)
    stop = threading.Event()

    def loop() -> None:
        begin_s, count = time.perf_counter(), 0
        while not stop.wait(max(begin_s + count / rate_hz - time.perf_counter(), 0.0)):
            with suppress(BlockingIOError):  # nobody listens yet, as before a board's port is opened
                os.write(here, said(count))
            count += 1

    thread = threading.Thread(target=loop, daemon=True)
    thread.start()
    try:
        yield os.ttyname(there)
    finally:
        stop.set()
        thread.join()
        os.close(here)
        os.close(there)


@contextmanager
def sketch(line_of: Callable[[float], str], rate_hz: float) -> Iterator[str]:
    """The port of a sketch that prints ``line_of`` the seconds since its boot, ``rate_hz`` times a second."""
    with board(lambda count: f"{line_of(1.0 + count / rate_hz)}\r\n".encode(), rate_hz) as port:
        yield port


def _millis(time_s: float) -> str:
    return f"{round(time_s * 1000)},512,300,200,100"


def _take(shoe: SerialShoe, samples: int) -> int:
    def take() -> int:
        count = 0
        for block in shoe.blocks():
            count += len(block)
            if count >= samples:
                break
        return count

    return within(STEP_S, take)


@pytest.mark.parametrize("rate_hz", [20.0, 300.0, 700.0])
def test_the_rate_of_lines_is_known_once_the_shoe_is_open(rate_hz: float) -> None:
    with sketch(_millis, rate_hz) as port, SerialShoe(port, SerialSettings(format="lines")) as shoe:
        # Times rounded to a millisecond, at both ends of a second.
        assert shoe.sample_rate_hz == pytest.approx(rate_hz, rel=2e-3)
        _take(shoe, int(0.5 * rate_hz))
        assert shoe.events == ()


def test_a_shoe_that_sends_seldom_is_not_silent() -> None:
    settings = SerialSettings(format="lines", time="ms", silence_s=0.1, reopen_s=0.3)
    with sketch(_millis, 4.0) as port, SerialShoe(port, settings) as shoe:
        _take(shoe, 8)
        assert not [event for event in shoe.events if isinstance(event, Silence)]


def test_a_separator_behind_the_last_reading_is_no_reading() -> None:
    with sketch(lambda t: f"{_millis(t)},", 200.0) as port, SerialShoe(port) as shoe:
        assert _take(shoe, 50) >= 50


def test_a_time_in_another_unit_is_told_not_taken() -> None:
    """Minutes with fractions look like seconds."""
    with (
        sketch(lambda t: f"{t / 60:.6f},1,2,3,4", 200.0) as port,
        SerialShoe(port) as shoe,
        pytest.raises(DeviceError, match="time=s, time=ms or time=us"),
    ):
        _take(shoe, 10_000)


@pytest.mark.parametrize(
    ("line_of", "says"),
    [
        (lambda t: f"{t:.2f},1,2,3,4", "print it finer"),
        (lambda t: "512,300,200,100", "where is the time"),
    ],
)
def test_lines_without_a_usable_time_are_told_how_to_mend_it(line_of: Callable[[float], str], says: str) -> None:
    with sketch(line_of, 400.0) as port:
        shoe = SerialShoe(port, SerialSettings(wait_s=1.0))
        with pytest.raises(DeviceTimeoutError, match=says):
            within(STEP_S, shoe.open)


def _frame(count: int, told_at: int) -> bytes:
    sample = encode_samples([count], [10_000 * count], [[1, 2, 3, 4]])
    return encode_information(DEVICE) + sample if count == told_at else sample


def test_information_that_comes_once_in_two_seconds_is_waited_for() -> None:
    """One telling a second, of which one is lost."""
    with board(lambda count: _frame(count, 180), 100.0) as port, SerialShoe(port) as shoe:
        assert {channel.unit for channel in shoe.describe()} == {MILLIBAR}


def test_information_that_comes_too_late_is_told_and_readings_stay_counts() -> None:
    with board(lambda count: _frame(count, 320), 100.0) as port, SerialShoe(port) as shoe:
        _take(shoe, 400)
        assert {channel.unit for channel in shoe.describe()} == {COUNTS}
        assert [event.serial_number for event in shoe.events if isinstance(event, ToldLate)] == ["L-0042"]
