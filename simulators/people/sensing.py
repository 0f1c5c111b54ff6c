"""The eight units under two feet: bladder, HDI sensor and 12-bit converter, sampled like the microcontroller does.

*Left out:* cross talk between units, the clock's drift, samples lost on the way (the wire's emulator has those).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from simulators.instruments.daq import MyRioParameters, SimulatedMyRio
from simulators.instruments.sensing_unit import SensingUnit
from smartshoe.arrays import Array
from smartshoe.units import MILLIBAR


class Sampler:
    """Reads units block by block; bladders and sensors keep their memory from one block to the next."""

    def __init__(self, units: Sequence[SensingUnit], bits: int, rng: np.random.Generator) -> None:
        self.units = tuple(units)
        self.adc = SimulatedMyRio(MyRioParameters(bits=bits), rng)

    def converted_mbar(self, unit: SensingUnit, voltage_v: Array) -> Array:
        """A unit's reading (n,) in mbar from its sensor's voltage (n,), through the converter."""
        return np.asarray(MILLIBAR.from_si(unit.sensor.to_pressure_pa(self.adc.convert(voltage_v))))

    def reset(self) -> None:
        """Return to rest: unloaded, in steady state."""
        for unit in self.units:
            unit.bladder.reset()
            unit.sensor.reset()

    def read(self, loads_n: Array, rate_hz: float, finer: int = 1) -> tuple[Array, Array]:
        """Readings (m, units) in mbar and pressures (m, units) in Pa for loads (m finer, units) in N at ``rate_hz``.

        Each reading is the last of its ``finer`` samples of load.
        """
        count = loads_n.shape[0] // finer
        readings, pressure_pa = np.empty((count, len(self.units))), np.empty((count, len(self.units)))
        for column, unit in enumerate(self.units):
            fine_pa = unit.bladder.press(np.ascontiguousarray(loads_n[:, column]), rate_hz)
            readings[:, column] = self.converted_mbar(unit, unit.sensor.read(fine_pa, rate_hz)[finer - 1 :: finer])
            pressure_pa[:, column] = fine_pa[finer - 1 :: finer]
        return readings, pressure_pa
