"""The machine as a session sees it: a test is started, then its log is polled for.

A machine that moves on its own runs in a thread next to the stream; one with a virtual clock is done at once; one that
a person starts (Bluehill has no programming interface) is done when its complete log lies in the folder.
"""

from __future__ import annotations

import time
from abc import ABC, abstractmethod
from pathlib import Path
from threading import Thread
from typing import Any

import numpy as np

from smartshoe.devices import Shoe, TestMachine, open_machine, split_url
from smartshoe.devices.logged import INSTRON_5944
from smartshoe.devices.serial_link.shoe import SerialShoe
from smartshoe.errors import DeviceError, DeviceTimeoutError, InputError, SmartShoeError, UsageError
from smartshoe.files.logs import read
from smartshoe.protocol import Protocol
from smartshoe.recording import Recording

SETTLED_S = 2.0
LOOK_EVERY_S = 0.25
REACHED = 0.95


class MachineSide(ABC):
    """The machine of a session. ``columns`` names the columns of its log."""

    by_hand = False
    columns: dict[str, Any]

    @abstractmethod
    def check(self, protocol: Protocol) -> None:
        """Raise `LimitError` if the protocol exceeds the limits of the machine or the sensor."""

    @abstractmethod
    def start(self, protocol: Protocol) -> None:
        """Start the test, or note that a person starts it now."""

    @abstractmethod
    def log(self) -> Recording | Path | None:
        """The test's log once it is done, None before; raises the error if the test failed."""

    def close(self) -> None:  # noqa: B027
        """Release the machine."""


class RunMachine(MachineSide):
    """A machine that smartshoe controls."""

    def __init__(self, machine: TestMachine) -> None:
        self.machine = machine
        self.columns = {}
        self._thread: Thread | None = None
        self._failure: Exception | None = None
        self._recording: Recording | None = None

    def check(self, protocol: Protocol) -> None:
        """Check the protocol by the machine's own limits."""
        self.machine.check(protocol)

    def start(self, protocol: Protocol) -> None:
        """Run the test, in a thread if it takes time."""
        self._recording = self._failure = self._thread = None
        if self.machine.is_instant:
            self._recording = self.machine.run(protocol)
            return

        def run() -> None:
            try:
                self._recording = self.machine.run(protocol)
            except Exception as error:  # `log` raises it in the session's thread
                self._failure = error

        self._thread = Thread(target=run, name=f"{self.machine} runs {protocol.name}", daemon=True)
        self._thread.start()

    def log(self) -> Recording | None:
        """The machine's log: one with the load and no reading if there is one, otherwise the recording."""
        if self._thread is not None and self._thread.is_alive():
            return None
        if self._failure is not None:
            if isinstance(self._failure, SmartShoeError):
                raise self._failure
            raise DeviceError(f"{self.machine} failed ({self._failure!r})") from self._failure
        if self._recording is None:
            raise DeviceError(f"{self.machine} gave no log")
        own = [log for log in self.machine.logs if log.of_role("load") and not log.sensors]
        return (own or [self._recording])[0]

    def close(self) -> None:
        """Close the machine."""
        self.machine.close()


class LogByHand(MachineSide):
    """A machine run by hand, whose log arrives as a file and may be read while it still grows.

    ``target`` is the file, or a folder in which each test's log is a new file that matches ``pattern``. A log is
    complete once it has not changed for `SETTLED_S`, can be read, and has reached the protocol's peak load.
    """

    by_hand = True

    def __init__(self, target: Path, pattern: str, columns: dict[str, Any]) -> None:
        self.target, self.pattern, self.columns = target, pattern, columns
        self.is_folder = target.is_dir()
        self.fresh_only = False
        self.reason = ""
        self._used: set[Path] = set()
        self._is_unread = False
        self._started_s = 0.0
        self._looked_s = -np.inf
        self._protocol: Protocol | None = None
        if not self.is_folder and not target.parent.is_dir():
            raise UsageError(f"{target.parent} does not exist: give the folder into which the machine writes its log")

    def __str__(self) -> str:
        return f"{self.target}/{self.pattern}" if self.is_folder else str(self.target)

    def check(self, protocol: Protocol) -> None:
        """Check the protocol by the limits of the Instron 5944."""
        protocol.check(INSTRON_5944)

    def start(self, protocol: Protocol) -> None:
        """Start looking for the log."""
        self._protocol = protocol
        self._started_s = time.time()
        self.reason = f"{self} is not there"

    def log(self) -> Path | None:
        """The path of the log once it is complete, None before; ``reason`` then says what is missing."""
        if time.monotonic() - self._looked_s < LOOK_EVERY_S or self._protocol is None:
            return None
        self._looked_s = time.monotonic()
        for path in self._candidates():
            if self._is_whole(path, self._protocol):
                self._used.add(path)
                return path
        return None

    def _candidates(self) -> list[Path]:
        if not self.is_folder:
            return [self.target] if self.target.exists() else []
        return sorted(path for path in self.target.glob(self.pattern) if path.is_file() and path not in self._used)

    def _is_whole(self, path: Path, protocol: Protocol) -> bool:
        self._is_unread = False
        try:
            state = path.stat()
        except OSError:
            return False
        if self.fresh_only and state.st_mtime < self._started_s - 1.0:
            self.reason = f"{path} is older than this test"
            return False
        if time.time() - state.st_mtime < SETTLED_S:
            self.reason = f"{path} still grows"
            return False
        try:
            found = read(path, partly=True, **self.columns)
            peak = float(found.force_n.max())
        except InputError as error:
            self.reason, self._is_unread = str(error), True
            return False
        if peak < REACHED * protocol.peak_load_n and self.fresh_only:
            self.reason = f"{path} has reached {peak:.0f} N of {protocol.peak_load_n:.0f} N so far"
            return False
        return True

    def late(self, wait_s: float) -> SmartShoeError:
        """The error for a log that did not come within ``wait_s``."""
        said = f"the machine's log did not come within {wait_s:.0f} s ({self.reason})"
        if self._is_unread:
            return InputError(
                f"{said}: here columns are named in the address, log:{self.target}?force=NAME&time=NAME, or export the"
                " test again"
            )
        if self.target.exists():
            return InputError(f"{said}: export the whole test from the machine again")
        return DeviceTimeoutError(f"{said}: export the test to {self}, then go on with --resume")


def machine_at(url: str, shoe: Shoe, unit: str) -> MachineSide:
    """The opened machine at ``url``, with ``unit`` of ``shoe`` under it."""
    scheme, target, options = split_url(url)
    if scheme != "log":
        machine = open_machine(url)
        if machine.is_instant and isinstance(shoe, SerialShoe):
            raise UsageError(
                f"{url} is simulated and presses no {shoe}: give --machine log:FILE, the log of the machine that does"
            )
        machine.under(shoe, unit)
        return RunMachine(machine.open())
    pattern = options.pop("pattern", "*.csv")
    columns: dict[str, Any] = {key: options.pop(key) for key in ("time", "force") if key in options}
    if options:
        raise UsageError(f"log:{target} has no option {min(options)!r}; use pattern, time and force")
    return LogByHand(Path(target), pattern, columns)
