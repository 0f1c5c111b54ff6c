"""Text lines as sketches print them: their rate, their habits, and what is said of bad ones."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import pytest
from puppet import STEP_S, within

from smartshoe.devices._events import Gap, Silence, ToldLate
from smartshoe.devices.serial_link._settings import SerialSettings
from smartshoe.devices.serial_link.shoe import SerialShoe
from smartshoe.devices.wire.frames import encode_information, encode_samples
from smartshoe.devices.wire.information import ChannelInformation, Information
from smartshoe.devices.wire.samples import CHANNELS
from smartshoe.errors import DeviceError, DeviceTimeoutError
from smartshoe.units import COUNTS, MILLIBAR

DEVICE = Information("f", "L-0042", 100.0, tuple(ChannelInformation(name, "mbar", 0.0, 200.0) for name in CHANNELS))
pytestmark = pytest.mark.wire


LINES = 10_000  # fewer than wait in a shoe's buffer


class Board:
    """A port behind which a board says ``said`` of 0, 1, 2, ..., ``rate_hz`` times a second, and hears nothing.

    Time goes on only as the port is read, so that no machine is too slow for it; after `LINES` it stands still.
    """

    def __init__(self, said: Callable[[int], bytes], rate_hz: float) -> None:
        self.now_s = 0.0
        self.said, self._rate_hz = said, rate_hz
        self._count = 0

    def read(self, wait_s: float = 0.05) -> bytes:
        """See `Port.read`."""
        if self._count == LINES:
            time.sleep(0.002)
            return b""
        due_s = self._count / self._rate_hz
        if due_s > self.now_s + wait_s:
            self.now_s += wait_s
            return b""
        self.now_s = max(self.now_s, due_s)
        self._count += 1
        return self.said(self._count - 1)

    def write(self, data: bytes) -> None:
        """See `Port.write`."""

    def close(self) -> None:
        """See `Port.close`."""

    def shoe(self, **settings: Any) -> SerialShoe:
        """A shoe at this port, on its clock."""
        return SerialShoe("board", SerialSettings(**settings), open_port=lambda *_: self, clock=lambda: self.now_s)


def sketch(line_of: Callable[[float], str], rate_hz: float, lost: range = range(0)) -> Board:
    """A board that prints ``line_of`` the seconds since its boot; of the lines ``lost`` nothing comes."""
    return Board(lambda k: b"" if k in lost else f"{line_of(1.0 + k / rate_hz)}\r\n".encode(), rate_hz)


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


@pytest.mark.parametrize("rate_hz", [20.0, 300.0, 700.0, 800.0, 950.0, 1000.0])
def test_the_rate_of_lines_is_known_once_the_shoe_is_open(rate_hz: float) -> None:
    """Though ``millis()`` goes on by 1 and by 2 from line to line, of which none is lost."""
    with sketch(_millis, rate_hz).shoe(format="lines") as shoe:
        # Times rounded to a millisecond, at both ends of a second.
        assert shoe.sample_rate_hz == pytest.approx(rate_hz, rel=2e-3)
        _take(shoe, int(2.5 * rate_hz))
        assert shoe.events == ()


@pytest.mark.parametrize("rate_hz", [100.0, 700.0, 800.0])
@pytest.mark.parametrize("first", range(2, 9))
def test_lines_lost_at_the_very_first_are_told_and_leave_the_rate(rate_hz: float, first: int) -> None:
    """A line's buffer may hold what was sent before the port was opened, and lack what followed."""
    with sketch(_millis, rate_hz, lost=range(first, first + 30)).shoe(format="lines") as shoe:
        assert shoe.sample_rate_hz == pytest.approx(rate_hz, rel=2e-3)
        _take(shoe, int(2.5 * rate_hz))
        (gap,) = shoe.events
        assert isinstance(gap, Gap)
        assert gap.lost == pytest.approx(30, abs=1)


@pytest.mark.parametrize("pause_s", [0.4, 1.5])
def test_lines_that_come_in_bursts_have_their_rate(pause_s: float) -> None:
    """A radio holds lines back and hands them over together: it is their own times that tell."""
    rate_hz = 700.0
    burst = int(pause_s * rate_hz)
    whole = sketch(_millis, rate_hz)

    def held_back(k: int) -> bytes:
        return b"" if k % burst else b"".join(whole.said(k - earlier) for earlier in range(min(k, burst - 1), -1, -1))

    with Board(held_back, rate_hz).shoe(format="lines") as shoe:
        assert shoe.sample_rate_hz == pytest.approx(rate_hz, rel=2e-3)
        _take(shoe, 4 * burst)
        assert not [event for event in shoe.events if isinstance(event, Gap)]


@pytest.mark.parametrize("wait_s", [0.1, 1.0, 2.0])
def test_a_short_wait_is_for_the_first_line_or_frame_alone(wait_s: float) -> None:
    with sketch(_millis, 200.0).shoe(wait_s=wait_s) as shoe:
        assert shoe.sample_rate_hz == pytest.approx(200.0, rel=2e-3)
    with Board(lambda count: _frame(count, 180), 100.0).shoe(wait_s=wait_s) as shoe:
        assert {channel.unit for channel in shoe.describe()} == {MILLIBAR}


def test_a_shoe_that_sends_seldom_is_not_silent() -> None:
    with sketch(_millis, 4.0).shoe(format="lines", time="ms", silence_s=0.1, reopen_s=0.3) as shoe:
        _take(shoe, 40)
        assert not [event for event in shoe.events if isinstance(event, Silence)]


def test_a_separator_behind_the_last_reading_is_no_reading() -> None:
    with sketch(lambda t: f"{_millis(t)},", 200.0).shoe() as shoe:
        assert _take(shoe, 50) >= 50


def test_a_time_in_another_unit_is_told_not_taken() -> None:
    """Minutes with fractions look like seconds."""
    with (
        sketch(lambda t: f"{t / 60:.6f},1,2,3,4", 200.0).shoe() as shoe,
        pytest.raises(DeviceError, match="time=s, time=ms or time=us"),
    ):
        _take(shoe, LINES)


@pytest.mark.parametrize(
    ("line_of", "says"),
    [
        (lambda t: f"{t:.2f},1,2,3,4", "print it finer"),
        (lambda t: "512,300,200,100", "where is the time"),
    ],
)
def test_lines_without_a_usable_time_are_told_how_to_mend_it(line_of: Callable[[float], str], says: str) -> None:
    shoe = sketch(line_of, 400.0).shoe(wait_s=1.0)
    with pytest.raises(DeviceTimeoutError, match=says):
        within(STEP_S, shoe.open)


def _frame(count: int, told_at: int) -> bytes:
    sample = encode_samples([count], [10_000 * count], [[1, 2, 3, 4]])
    return encode_information(DEVICE) + sample if count == told_at else sample


def test_information_that_comes_once_in_two_seconds_is_waited_for() -> None:
    """One telling a second, of which one is lost."""
    with Board(lambda count: _frame(count, 180), 100.0).shoe() as shoe:
        assert {channel.unit for channel in shoe.describe()} == {MILLIBAR}


def test_information_that_comes_too_late_is_told_and_readings_stay_counts() -> None:
    with Board(lambda count: _frame(count, 320), 100.0).shoe() as shoe:
        _take(shoe, 400)
        assert {channel.unit for channel in shoe.describe()} == {COUNTS}
        assert [event.serial_number for event in shoe.events if isinstance(event, ToldLate)] == ["L-0042"]
