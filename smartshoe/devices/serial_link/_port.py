"""A serial port with one-sentence errors: opened exclusively, read with short waits, closed fully.

Works on Linux, macOS and Windows; Bluetooth's RFCOMM devices and USB are ports like any other. pyserial raises its own
`SerialException`, plain `OSError` (``in_waiting`` of a port whose peer is gone) and, on POSIX, `termios.error`, which
is neither: all three become `DeviceError` here.
"""

from __future__ import annotations

import errno
import select
import sys
from pathlib import Path
from typing import Any, Protocol

from smartshoe.errors import DeviceError

READ_WAIT_S = 0.05
WRITE_WAIT_S = 0.5


class Port(Protocol):
    """What `SerialShoe` needs from a port; every method raises `DeviceError` once the peer is gone."""

    def read(self, wait_s: float = READ_WAIT_S) -> bytes:
        """The bytes received, waiting at most ``wait_s`` for the first one; empty where none arrived."""

    def write(self, data: bytes) -> None:
        """Send ``data`` within `WRITE_WAIT_S`."""

    def close(self) -> None:
        """Close the port; never raises."""


def _port_errors() -> tuple[type[Exception], ...]:
    try:
        from termios import error as termios_error
    except ImportError:  # Windows
        return (OSError,)
    return (OSError, termios_error)


class SerialPort:
    """pyserial's port at ``path``, opened with an exclusive lock; raises `DeviceError` where that fails."""

    def __init__(self, path: str, baud: int = 115200) -> None:
        import serial

        self._path = path
        self._errors = _port_errors()
        try:
            self._serial: Any = serial.Serial(
                path, baud, timeout=READ_WAIT_S, write_timeout=WRITE_WAIT_S, exclusive=True
            )
        except ValueError as error:
            raise DeviceError(f"port {path} does not take baud={baud}: give one that the device knows") from error
        except self._errors as error:
            raise DeviceError(why_not_open(path, error)) from error

    def read(self, wait_s: float = READ_WAIT_S) -> bytes:
        """See `Port.read`."""
        try:
            if not self._is_ready(wait_s):
                return b""
            data: bytes = self._serial.read(max(1, self._serial.in_waiting))
        except self._errors as error:
            raise DeviceError(f"port {self._path} was lost ({_short(error)})") from error
        return data

    def _is_ready(self, wait_s: float) -> bool:
        """Whether there is something to read within ``wait_s``; always true on Windows, where reading itself waits."""
        if sys.platform == "win32":
            self._serial.timeout = wait_s
            return True
        # pyserial would reconfigure the whole port for each change of the waiting time.
        return bool(select.select([self._serial.fileno()], [], [], wait_s)[0])

    def write(self, data: bytes) -> None:
        """See `Port.write`."""
        try:
            self._serial.write(data)
        except self._errors as error:
            raise DeviceError(f"port {self._path} takes no bytes ({_short(error)})") from error

    def close(self) -> None:
        """See `Port.close`."""
        try:
            self._serial.close()
        except self._errors:
            return  # the peer is gone, so nothing is left to close


def _short(error: BaseException) -> str:
    """The operating system's message, without pyserial's repetition of it."""
    number = getattr(error, "errno", None)
    if isinstance(number, int):
        return errno.errorcode.get(number, str(number)) + ": " + _strerror(number)
    return str(error).split("(")[0].strip() or type(error).__name__


def _strerror(number: int) -> str:
    import os

    return os.strerror(number)


def _number(error: BaseException) -> int | None:
    """The error's errno, including where pyserial only puts it in the text (Windows)."""
    number = getattr(error, "errno", None)
    if isinstance(number, int):
        return number
    text = str(error)
    if "FileNotFoundError" in text:
        return errno.ENOENT
    if "PermissionError" in text:  # Windows reports this where another program holds the port
        return errno.EBUSY
    return None


def why_not_open(path: str, error: BaseException) -> str:
    """One sentence for the user: why port ``path`` does not open and what would fix it."""
    number = _number(error)
    if number in (errno.ENOENT, errno.ENODEV, errno.ENXIO):
        return f"port {path} is not there: {_mend_absent(path)}"
    if number in (errno.EAGAIN, errno.EBUSY):
        return f"port {path} is held by {_holder(path)}: end that program and open again"
    if number in (errno.EACCES, errno.EPERM):
        return f"port {path} may not be opened by this user: {_mend_permission(path)}"
    if number in (errno.EHOSTDOWN, errno.EHOSTUNREACH, errno.ETIMEDOUT, errno.ECONNREFUSED, errno.ECONNRESET):
        return f"port {path} finds no shoe ({_short(error)}): switch the shoe on, bring it near, pair it anew"
    if number == errno.EISDIR or "Inappropriate ioctl" in str(error):
        return f"{path} is no serial port: give one of {_ports()}"
    return f"port {path} cannot be opened ({_short(error)}): there are {_ports()}"


def _mend_absent(path: str) -> str:
    if "rfcomm" in path:
        channel = "".join(c for c in path if c.isdigit()) or "0"
        return f"pair the shoe, then bind it (sudo rfcomm bind {channel} ADDRESS)"
    return f"plug the shoe in or switch it on; there are {_ports()}"


def _mend_permission(path: str) -> str:
    if sys.platform.startswith("linux"):
        return "join the group that owns it (sudo usermod -a -G dialout $USER; uucp on Arch), log in again"
    return f"open it with the rights that {path} asks for"


def _ports() -> str:
    """The serial ports of this computer, as part of a sentence."""
    try:
        from serial.tools.list_ports import comports

        found = sorted(str(port.device) for port in comports())
    except (OSError, ImportError, TypeError, ValueError):
        found = []
    if sys.platform.startswith("linux"):
        found += sorted(str(path) for path in Path("/dev").glob("rfcomm*"))
    return ", ".join(found) if found else "no serial ports on this machine"


def _holder(path: str) -> str:
    """The process that has the port open, where this user may see it (Linux)."""
    try:
        target = Path(path).resolve()
        for link in Path("/proc").glob("[0-9]*/fd/*"):
            try:
                if link.resolve() == target:
                    process = link.parts[2]
                    name = (Path("/proc") / process / "comm").read_text(encoding="utf-8").strip()
                    return f"another program ({name}, process {process})"
            except OSError:
                continue  # the process has ended, or belongs to another user
    except OSError:
        pass
    return "another program (a terminal, the Arduino monitor, ModemManager)"
