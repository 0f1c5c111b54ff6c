"""The pseudo-terminal itself: what the port of a shoe does that goes and comes back."""

from __future__ import annotations

import time
from pathlib import Path

import pytest

from simulators.wire.pty_line import PtyLine
from smartshoe.devices.serial_link._port import SerialPort
from smartshoe.errors import DeviceError, UsageError

pytestmark = pytest.mark.wire


def read_all(port: SerialPort, count: int) -> bytes:
    data, until_s = b"", time.monotonic() + 5.0
    while len(data) < count and time.monotonic() < until_s:
        data += port.read()
    return data


def test_bytes_go_both_ways_unchanged(tmp_path: Path) -> None:
    every_byte = bytes(range(256))
    with PtyLine(tmp_path / "shoe0") as line:
        port = SerialPort(str(tmp_path / "shoe0"))
        try:
            assert line.write(every_byte) == 256
            assert read_all(port, 256) == every_byte
            port.write(every_byte)
            assert line.read(1.0) == every_byte
            assert port.read() == b""
        finally:
            port.close()


def test_what_does_not_fit_is_refused_at_once(tmp_path: Path) -> None:
    with PtyLine(tmp_path / "shoe0") as line:
        port = SerialPort(str(tmp_path / "shoe0"))
        try:
            written = [line.write(bytes(1000)) for _ in range(200)]
            assert 4_000 < sum(written) < 100_000
            assert written[-1] == 0
            assert len(read_all(port, sum(written))) == sum(written)
        finally:
            port.close()


def test_a_port_is_held_by_one_reader_at_a_time_and_the_holder_is_named(tmp_path: Path) -> None:
    with PtyLine(tmp_path / "shoe0") as line:
        assert not line.peer_is_there
        port = SerialPort(str(line.link))
        assert line.peer_is_there
        with pytest.raises(DeviceError, match="held by another program"):
            SerialPort(str(line.link))
        port.close()
        assert not line.peer_is_there
        SerialPort(str(line.link)).close()


def test_a_port_that_goes_is_an_error_and_comes_back_under_its_name(tmp_path: Path) -> None:
    line = PtyLine(tmp_path / "shoe0")
    with line:
        port = SerialPort(str(line.link))
        line.write(b"unread")
        line.vanish()
        with pytest.raises(DeviceError, match="was lost"):
            read_all(port, 100)
        with pytest.raises(DeviceError, match="takes no bytes"):
            port.write(b"x")
        port.close()
        port.close()
        with pytest.raises(DeviceError, match="is not there"):
            SerialPort(str(line.link))
        line.appear()
        port = SerialPort(str(line.link))
        line.write(b"again")
        assert read_all(port, 5) == b"again"
        port.close()
    assert not line.link.is_symlink()


def test_nothing_that_is_there_is_written_over(tmp_path: Path) -> None:
    (tmp_path / "notes").write_text("mine", encoding="utf-8")
    with pytest.raises(UsageError, match="notes"):
        PtyLine(tmp_path / "notes").appear()
    (tmp_path / "file").write_text("no folder", encoding="utf-8")
    with pytest.raises(UsageError, match="cannot be made"):
        PtyLine(tmp_path / "file" / "shoe0").appear()
