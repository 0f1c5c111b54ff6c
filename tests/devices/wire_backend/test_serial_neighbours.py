"""What stands around the serial shoe: its address, its queue, its waits, its sentences."""

from __future__ import annotations

import errno
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from smartshoe.devices import Block, Dropped, Gap, open_shoe
from smartshoe.devices._events import EventLog, Silence
from smartshoe.devices.serial_link._port import SerialPort, why_not_open
from smartshoe.devices.serial_link._settings import SerialSettings, settings_from
from smartshoe.devices.serial_link.inbox import Inbox, joined
from smartshoe.devices.serial_link.reconnect import Backoff
from smartshoe.errors import DeviceError, DeviceTimeoutError, UsageError
from smartshoe.units import MILLIBAR


def block_of(first: int, count: int) -> Block:
    time_s = np.arange(first, first + count) / 200.0
    return Block(time_s, np.zeros((count, 2)), np.zeros((count, 2), dtype=bool), ("toe", "heel"), MILLIBAR)


def test_an_address_says_how_the_shoe_talks() -> None:
    found = settings_from("/dev/rfcomm0", {"baud": "9600", "columns": "t, toe,heel", "unit": "mbar", "rate": "100"})
    assert found == SerialSettings(baud=9600, columns=("t", "toe", "heel"), unit="mbar", rate=100.0)


@pytest.mark.parametrize(
    ("option", "named"),
    [
        ("baud=fast", "baud"),
        ("baud=-1", "baud"),
        ("format=json", "format"),
        ("columns=t", "columns"),
        ("columns=t,toe,toe", "columns"),
        ("columns=toe,meta1", "columns"),
        ("unit=furlong", "unit"),
        ("side=both", "side"),
        ("rate=0", "rate"),
        ("give_up_s=9999", "give_up_s"),
        ("wait_s=nan", "wait_s"),
        ("speed=2", "speed"),
    ],
)
def test_a_wrong_option_is_named(option: str, named: str) -> None:
    with pytest.raises(UsageError, match=named):
        open_shoe(f"serial:///dev/rfcomm0?{option}")


def test_an_address_without_a_port_is_refused() -> None:
    with pytest.raises(UsageError, match="no port"):
        open_shoe("serial://")


def test_a_shoe_describes_itself_before_it_is_opened() -> None:
    shoe = open_shoe("serial://COM5?side=left")
    assert [c.name for c in shoe.describe()] == ["left_toe", "left_meta1", "left_meta4", "left_heel"]
    assert [c.name for c in open_shoe("serial://COM5?format=lines&columns=a,millis,b").describe()] == ["a", "b"]


@pytest.mark.parametrize(
    ("number", "path", "says"),
    [
        (errno.ENOENT, "/dev/rfcomm3", "rfcomm bind 3"),
        (errno.ENOENT, "/dev/ttyUSB9", "plug the shoe in"),
        (errno.EACCES, "/dev/ttyUSB0", "group"),
        (errno.EAGAIN, "/dev/ttyUSB0", "held by"),
        (errno.EBUSY, "/dev/ttyUSB0", "held by"),
        (errno.EHOSTDOWN, "/dev/rfcomm0", "switch the shoe on"),
        (errno.EIO, "/dev/ttyUSB0", "cannot be opened"),
    ],
)
def test_a_port_that_cannot_be_opened_says_what_mends_it(number: int, path: str, says: str) -> None:
    sentence = why_not_open(path, OSError(number, "said pyserial"))
    assert says in sentence
    assert path in sentence
    assert "\n" not in sentence


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("could not open port 'COM5': FileNotFoundError(2, 'The system cannot find the file')", "is not there"),
        ("could not open port 'COM5': PermissionError(13, 'Access is denied.')", "held by"),
    ],
)
def test_windows_hides_the_number_in_the_text(text: str, says: str) -> None:
    assert says in why_not_open("COM5", OSError(text))


def test_what_is_no_port_is_refused(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("no port", encoding="utf-8")
    for path in (tmp_path / "absent", tmp_path, tmp_path / "file"):
        with pytest.raises(DeviceError, match=path.name):
            SerialPort(str(path))


@given(sizes=st.lists(st.integers(1, 30), max_size=30), limit=st.integers(10, 100))
def test_the_inbox_keeps_the_newest_and_counts_what_it_dropped(sizes: list[int], limit: int) -> None:
    inbox = Inbox(limit)
    sent = 0
    for size in sizes:
        inbox.put(block_of(sent, size))
        sent += size
    taken = inbox.take(0.0)
    kept = joined(taken) if taken else block_of(0, 0)
    dropped = inbox.take_dropped()
    count = dropped[0] if dropped else 0
    assert count + len(kept) == sent
    assert len(kept) <= max(limit, max(sizes, default=0))
    np.testing.assert_array_equal(kept.time_s, np.arange(count, sent) / 200.0)
    if dropped:
        assert dropped[1:] == (0.0, (count - 1) / 200.0)


def test_an_ended_inbox_gives_what_waits_and_then_its_error() -> None:
    inbox = Inbox(100)
    inbox.put(block_of(0, 3))
    inbox.end(DeviceTimeoutError("gone"))
    inbox.put(block_of(3, 3))
    taken = inbox.take(0.0)
    assert taken is not None
    assert sum(len(b) for b in taken) == 3
    for _ in range(2):
        with pytest.raises(DeviceTimeoutError, match="gone"):
            inbox.take(10.0)
    inbox.end(discard=True)
    assert inbox.take(10.0) is None


def test_waits_double_up_to_their_bound_and_start_over() -> None:
    backoff = Backoff(0.1, 2.0)
    waits = [backoff.next_wait_s() for _ in range(2000)]
    assert waits[:5] == pytest.approx([0.1, 0.2, 0.4, 0.8, 1.6])
    assert set(waits[5:]) == {2.0}
    backoff.reset()
    assert backoff.next_wait_s() == 0.1


def test_events_are_told_in_a_sentence_and_kept_within_a_bound() -> None:
    log = EventLog(limit=3)
    log.add(Gap(1.0, 1, 0.1, 0.2), Silence(2.0, 0.5))
    log.add(Dropped(3.0, 40, 1.0, 2.0), Silence(4.0, 0.7))
    assert [event.kind for event in log.all()] == ["gap", "silence", "dropped"]
    assert log.surplus == 1
    for event in log.all():
        told = event.to_dict()
        assert told["kind"] == event.kind
        assert told["says"] == event.says
        assert "\n" not in event.says
