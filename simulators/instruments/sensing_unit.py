"""One unit of a shoe: what a foot or a testing machine presses."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from simulators.instruments.sensor import SimulatedHdiSensor
from simulators.plant.bladder import SimulatedBladder

if TYPE_CHECKING:
    from simulators.instruments.twin import SimulatedTwin


@dataclass(frozen=True)
class SensingUnit:
    """A bladder, or a twin in its place, with its sensor: what the machine presses."""

    name: str
    bladder: SimulatedBladder | SimulatedTwin
    sensor: SimulatedHdiSensor
