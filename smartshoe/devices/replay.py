"""Plays recordings back through the same calls as live devices, with the recorded time stamps."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from smartshoe.devices._base import Block, ChannelDescription, Shoe
from smartshoe.errors import MissingChannelError, UnitError, UsageError
from smartshoe.files.logs import read
from smartshoe.recording import SENSOR_NAME, UNITS_OF_A_SHOE, Channel, Recording


class ReplayedShoe(Shoe):
    """A shoe's recording played back as a stream of blocks, without waiting between them.

    If the recording names the place of the unit under test, that channel is named by it, as in a shoe and in the unit's
    calibration.
    """

    def __init__(self, recording: Recording, block_samples: int = 20) -> None:
        super().__init__()
        if not recording.sensors:
            raise MissingChannelError(f"{recording.label} has no readings of a shoe: name them with --sensor")
        units = {channel.unit for channel in recording.sensors}
        if len(units) > 1:
            raise UnitError(
                f"{recording.label}: readings are in {', '.join(sorted(u.symbol for u in units))}; convert them to one"
            )
        if block_samples < 1:
            raise UsageError(f"block_samples is {block_samples}: give 1 or more")
        self.recording = recording
        self.block_samples = block_samples

    def __str__(self) -> str:
        return f"replay {self.recording.label}"

    @property
    def sample_rate_hz(self) -> float:
        """The reciprocal of the recording's median sampling step."""
        return self.recording.sample_rate_hz

    def describe(self) -> tuple[ChannelDescription, ...]:
        """The recording's sensor channels."""
        return tuple(
            ChannelDescription(self._name_of(c), c.unit.quantity, c.unit, c.range_, c.resolution, self.sample_rate_hz)
            for c in self.recording.sensors
        )

    def _name_of(self, sensor: Channel) -> str:
        place = self.recording.unit
        return place if place in UNITS_OF_A_SHOE and sensor.name == SENSOR_NAME else sensor.name

    def _blocks_internal(self) -> Iterator[Block]:
        sensors = self.recording.sensors
        readings = np.column_stack([channel.values for channel in sensors])
        missing = np.column_stack([~channel.present for channel in sensors])
        names = tuple(self._name_of(channel) for channel in sensors)
        for start in range(0, len(self.recording), self.block_samples):
            span = slice(start, start + self.block_samples)
            yield Block(self.recording.time_s[span], readings[span], missing[span], names, sensors[0].unit)


class _ReplayProvider:
    """Provider of ``replay:FILE?block_samples=20&time=...``."""

    def open_shoe(
        self, target: str, options: Mapping[str, Any] | None = None, rng: np.random.Generator | None = None
    ) -> ReplayedShoe:
        """The recording at ``target`` as a shoe; ``rng`` is not used."""
        given = dict(options or {})
        samples = given.pop("block_samples", 20)
        columns = {key: given.pop(key) for key in ("time", "unit") if key in given}
        if given:
            raise UsageError(f"replay:{target} has no option {sorted(given)[0]!r}; use block_samples, time and unit")
        try:
            count = int(samples)
        except (TypeError, ValueError) as error:
            raise UsageError(f"replay:{target}: block_samples is {samples!r}; give a whole number") from error
        return ReplayedShoe(read(Path(target), **columns), count)


provider = _ReplayProvider()
