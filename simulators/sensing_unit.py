"""One unit of a shoe: what a foot or a testing machine presses."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from simulators.bladder import SimulatedBladder
from simulators.sensor import SimulatedHdiSensor

if TYPE_CHECKING:
    from simulators.twin import SimulatedTwin


@dataclass(frozen=True)
class SensingUnit:
    """A bladder, or a twin in its place, with its sensor: what the machine presses."""

    name: str
    bladder: SimulatedBladder | SimulatedTwin
    sensor: SimulatedHdiSensor
