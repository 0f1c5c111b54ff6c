"""A pseudo-terminal that acts as a shoe's serial port; its path reappears after a disconnection.

Linux and macOS; the modules for it are imported when one is opened. Properties of a pseudo-terminal that matter here:
control lines (dtr, rts) do not exist (OSError). When this end closes, the reader's ``read`` raises `SerialException`,
but its ``in_waiting`` a plain OSError. Unread bytes accumulate up to some 20 kB, then writes would block: here they
never do, and what does not fit is refused, as a radio does.
"""

from __future__ import annotations

import os
import time
from pathlib import Path
from typing import Self

from smartshoe.errors import DeviceError, UsageError


class PtyLine:
    """The device's end of a serial line; the other end is the port ``link``, a symbolic link to the pseudo-terminal."""

    def __init__(self, link: Path | str) -> None:
        self.link = Path(link)
        self._master: int | None = None
        self._slave_path = ""

    @property
    def is_up(self) -> bool:
        """Whether the port exists and can be opened."""
        return self._master is not None

    def __enter__(self) -> Self:
        self.appear()
        return self

    def __exit__(self, *_: object) -> None:
        self.vanish()

    def appear(self) -> None:
        """Create the port: a new pseudo-terminal under the same link; raises where the link cannot be created."""
        if self._master is not None:
            return
        try:
            import pty
            import tty
        except ImportError as error:
            raise DeviceError(
                "this system has no pseudo-terminals: emulate on Linux or macOS, or join two ports with com0com"
            ) from error
        if self.link.exists() and not self.link.is_symlink():
            raise UsageError(f"{self.link} is there already and is no link: give another place with --link")
        master, slave = pty.openpty()
        try:
            # Echo would return our frames to us as commands, until the reader has set its end to raw mode.
            tty.setraw(slave)
            self._slave_path = os.ttyname(slave)
        finally:
            # This process keeps no second end open, so the line hangs up when the reader closes: see `peer_is_there`.
            os.close(slave)
        os.set_blocking(master, False)
        self._master = master
        fresh = self.link.with_name(f".{self.link.name}.{os.getpid()}")
        try:
            self.link.parent.mkdir(parents=True, exist_ok=True)
            fresh.unlink(missing_ok=True)
            fresh.symlink_to(self._slave_path)
            fresh.replace(self.link)
        except OSError as error:
            self.vanish()
            raise UsageError(f"link {self.link} cannot be made ({error.strerror}): give another place") from error

    def vanish(self) -> None:
        """Remove the port and its link: a reader gets an error, and unread bytes are lost."""
        if self._master is None:
            return
        if self.link.is_symlink() and str(self.link.readlink()) == self._slave_path:
            self.link.unlink(missing_ok=True)
        os.close(self._master)
        self._master = None

    @property
    def peer_is_there(self) -> bool:
        """Whether a reader has the port open."""
        import select

        if self._master is None:
            return False
        poll = select.poll()
        poll.register(self._master, select.POLLIN)
        return not any(flags & select.POLLHUP for _, flags in poll.poll(0))

    def write(self, data: bytes) -> int:
        """The number of leading bytes of ``data`` that were accepted: all, some or none; never waits."""
        if self._master is None or not data:
            return 0
        try:
            return os.write(self._master, data)
        except BlockingIOError:
            return 0

    def read(self, wait_s: float = 0.0) -> bytes:
        """The bytes that the reader wrote (commands), within ``wait_s``; empty where it wrote none or is not there."""
        import select

        if self._master is not None:
            ready, _, _ = select.select([self._master], [], [], max(wait_s, 0.0) if self.peer_is_there else 0.0)
            if not ready:
                return b""
            try:
                return os.read(self._master, 4096)
            except OSError:  # EIO: the reader has closed its end, and everything it wrote has been read
                pass
        time.sleep(max(wait_s, 0.0))
        return b""

    def wait_writable(self, wait_s: float) -> bool:
        """Whether bytes can be written within ``wait_s``."""
        import select

        if self._master is None:
            return False
        return bool(select.select([], [self._master], [], wait_s)[1])
