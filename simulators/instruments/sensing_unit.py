"""One unit of a shoe, as pressed by a foot or a testing machine."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from simulators.instruments.sensor import SimulatedHdiSensor
from simulators.plant.bladder import SimulatedBladder

if TYPE_CHECKING:
    from simulators.instruments.twin import SimulatedTwin


@dataclass(frozen=True)
class SensingUnit:
    """A bladder, or a twin in its place, together with its sensor."""

    name: str
    bladder: SimulatedBladder | SimulatedTwin
    sensor: SimulatedHdiSensor
