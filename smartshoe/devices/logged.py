"""`LoggedMachine`: a finished test, read from its log files through the same calls as a machine that runs."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from smartshoe.devices._base import ChannelDescription, TestMachine
from smartshoe.devices.joining import join
from smartshoe.errors import DeviceError, UsageError
from smartshoe.files.logs import read
from smartshoe.protocol import MachineLimits, Protocol
from smartshoe.recording import Recording

# Instron 5944: a 2 kN frame (Chinimilli 2016, Section III).
INSTRON_5944 = MachineLimits(load_n=2000.0)
PEAK_TOLERANCE = 0.05


class LoggedMachine(TestMachine):
    """A machine's log (Bluehill or any readable file) and, for a reading in its own file, the data logger's.

    ``run`` refuses a protocol whose peak load differs from the logged one: a log cannot be run differently.
    """

    def __init__(self, machine_log: Path, logger_log: Path | None = None, **columns: Any) -> None:
        super().__init__()
        self._paths = (machine_log, logger_log)
        self._columns = columns
        self._logs: tuple[Recording, ...] = ()
        self._recording: Recording | None = None

    def __str__(self) -> str:
        return f"log {self._paths[0]}"

    @property
    def limits(self) -> MachineLimits:
        """The limits of the Instron 5944."""
        return INSTRON_5944

    @property
    def recording(self) -> Recording:
        """The logged experiment on one time base; raises `InputError` where the logs do not belong together."""
        if self._recording is None:
            machine, logger = self._paths
            if logger is None:
                self._recording = read(machine, **self._columns)
                self._logs = (self._recording,)
            else:
                unit = self._columns.get("unit")
                own = {key: self._columns[key] for key in ("time", "force") if key in self._columns}
                theirs = {key: self._columns[key] for key in ("sensors",) if key in self._columns}
                self._logs = (read(machine, unit=unit, **own), read(logger, unit=unit, **theirs))
                self._recording = join(*self._logs)
        return self._recording

    @property
    def logs(self) -> tuple[Recording, ...]:
        """The recordings of the files, before they were joined."""
        _ = self.recording
        return self._logs

    def _open_internal(self) -> None:
        _ = self.recording

    def describe(self) -> tuple[ChannelDescription, ...]:
        """The logged channels; a channel's range is that of its logged values."""
        rate = self.recording.sample_rate_hz
        return tuple(
            ChannelDescription(
                c.name, c.unit.quantity, c.unit, (float(c.values.min()), float(c.values.max())), c.resolution, rate
            )
            for c in self.recording.channels.values()
        )

    def _run_internal(self, protocol: Protocol) -> Recording:
        peak = float(np.max(self.recording.force_n))
        if abs(peak - protocol.peak_load_n) > PEAK_TOLERANCE * max(peak, protocol.peak_load_n):
            raise DeviceError(
                f"{self} reached {peak:.0f} N, protocol {protocol.name} asks for {protocol.peak_load_n:.0f} N:"
                " give the log of this protocol"
            )
        return self.recording


class _LogProvider:
    """Provider of ``log:FILE?daq=FILE&time=...&force=...&sensor=...``."""

    def open_machine(
        self, target: str, options: Mapping[str, Any] | None = None, rng: np.random.Generator | None = None
    ) -> LoggedMachine:
        """The log at ``target``; ``rng`` is not used, since nothing is random."""
        given = dict(options or {})
        logger = given.pop("daq", None)
        columns: dict[str, Any] = {key: given.pop(key) for key in ("time", "force", "unit") if key in given}
        if "sensor" in given:
            columns["sensors"] = [given.pop("sensor")]
        if given:
            raise UsageError(f"log:{target} has no option {sorted(given)[0]!r}; use daq, time, force, sensor and unit")
        return LoggedMachine(Path(target), Path(logger) if logger else None, **columns)


provider = _LogProvider()
