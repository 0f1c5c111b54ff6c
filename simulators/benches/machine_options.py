"""A scenario's options of a testing machine; unknown keys and values out of bounds are errors."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from simulators.benches.instron import InstronParameters
from simulators.effects.bounds import Finite, NotNegative, Positive
from simulators.effects.room import NeighbourUnit, Room
from simulators.instruments.options import DaqOptions, Options, SensorOptions, TwinOptions
from simulators.plant.bladder_parameters import BladderParameters


class MachineOptions(Options):
    """Options of an Instron with one unit on its anvil."""

    unit: str
    bladder: BladderParameters
    sensor: SensorOptions
    daq: DaqOptions = DaqOptions()
    load_noise_n: NotNegative = 0.3
    corner_s: Annotated[float, Field(ge=0, le=1)] = 0.04
    fine_rate_hz: Annotated[float, Field(ge=1000, le=100_000)] = 1000.0
    frame_stiffness_n_per_m: Positive = 5e6
    extension_noise_m: NotNegative = 2e-7
    bluehill_rate_hz: Annotated[float, Field(gt=0, le=1000)] = 100.0
    bluehill_clock_offset_s: NotNegative = 0.35
    load_cell_tare_n: Finite = 0.0
    room: Room = Room()
    neighbour: NeighbourUnit = NeighbourUnit()

    def parameters(self) -> InstronParameters:
        """The parameters of the machine itself."""
        return InstronParameters(**{k: v for k, v in self if k not in ("unit", "bladder", "sensor", "daq")})


class TwinMachineOptions(MachineOptions):
    """Options of an Instron with a twin on its anvil."""

    bladder: TwinOptions  # type: ignore[assignment]
