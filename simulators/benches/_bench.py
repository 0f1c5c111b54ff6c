"""A shoe's unit under a testing machine: one true time, and two instruments with their own clocks.

The machine's trajectory presses the unit while the shoe streams; the shoe's other units lie beside the anvil. The
shoe's clock runs too fast or too slow and began before the machine's. *Left out:* the clock's drift with temperature,
the machine's compliance acting back on the unit, load that reaches the neighbours through the insole.
"""

from __future__ import annotations

import copy
from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from simulators.instruments.sensing_unit import SensingUnit
from smartshoe.arrays import Array
from smartshoe.devices import Block
from smartshoe.errors import DeviceError, UsageError
from smartshoe.units import MILLIBAR

if TYPE_CHECKING:
    from simulators.benches.instron import Truth
    from simulators.benches.shoe import SimulatedShoe


LARGEST_SKEW_PPM = 100.0  # between two free-running crystals
LARGEST_OFFSET_S = 5.0


class Bench:
    """The anvil with one unit of a shoe on it; ``now_s`` is the true time, advanced by the shoe's samples.

    The shoe takes sample k at k / rate (1 + skew) and labels it offset + k / rate. A skew or offset that is not given
    is drawn from ``rng``: within 100 ppm, and up to 5 s.
    """

    def __init__(
        self,
        shoe: SimulatedShoe,
        unit: str,
        rng: np.random.Generator,
        *,
        skew_ppm: float | None = None,
        offset_s: float | None = None,
    ) -> None:
        names = [u.name for u in shoe.units]
        if unit not in names:
            raise UsageError(f"{unit} is no unit of this shoe: use one of {', '.join(names)}")
        drawn_ppm, drawn_s = rng.uniform(-LARGEST_SKEW_PPM, LARGEST_SKEW_PPM), rng.uniform(0.0, LARGEST_OFFSET_S)
        self.shoe, self.unit = shoe, unit
        self.skew = 1e-6 * (drawn_ppm if skew_ppm is None else skew_ppm)
        self.offset_s = drawn_s if offset_s is None else offset_s
        self.restart()

    def restart(self) -> None:
        """Switch the shoe on: its clock starts, and nothing presses it."""
        self.now_s = 0.0
        self.began_s: list[float] = []
        self._presses: list[tuple[float, Array, Array]] = []
        self._taken = 0

    @property
    def specimen(self) -> SensingUnit:
        """The unit that the machine presses, with its own bladder and sensor, at rest."""
        on_anvil = next(u for u in self.shoe.units if u.name == self.unit)
        specimen = copy.deepcopy(on_anvil)
        specimen.bladder.reset()
        specimen.sensor.reset()
        return specimen

    def press(self, truth: Truth) -> None:
        """Start the machine's run now: its load acts on the unit from here on."""
        if self._presses and self.now_s < self._presses[-1][0] + self._presses[-1][1][-1]:
            raise DeviceError("the machine is still pressing: let the stream run to the end of the test first")
        self.began_s.append(self.now_s)
        self._presses.append((self.now_s, truth.time_s, truth.load_n))

    def load_n(self, time_s: Array) -> Array:
        """The load (n,) in N on the unit at the true times ``time_s`` (n,), 0 between tests."""
        load = np.zeros(time_s.size)
        for begin_s, since_s, load_n in self._presses[-2:]:
            load += np.interp(time_s - begin_s, since_s, load_n, left=0.0, right=0.0)
        return load

    def stream(self, finest_step_hz: float) -> Iterator[Block]:
        """Endless blocks of the shoe, with times of its own clock."""
        p, shoe = self.shoe.parameters, self.shoe
        finer = max(1, int(np.ceil(finest_step_hz / p.sample_rate_hz)))
        fine_hz = p.sample_rate_hz * finer
        names = tuple(u.name for u in shoe.units)
        while True:
            first = self._taken
            # Fine steps that end at this block's samples; the unit's memory continues from block to block.
            fine = np.arange((first - 1) * finer + 1, (first + p.block_samples - 1) * finer + 1) / fine_hz
            loads = self.load_n(fine * (1.0 + self.skew))
            readings = np.empty((p.block_samples, len(names)))
            for column, u in enumerate(shoe.units):
                fine_pa = u.bladder.press(loads if u.name == self.unit else np.zeros(fine.size), fine_hz)
                readings[:, column] = shoe.converted_mbar(u, u.sensor.read(fine_pa, fine_hz)[finer - 1 :: finer])
            time_s = self.offset_s + np.arange(first, first + p.block_samples) / p.sample_rate_hz
            self._taken += p.block_samples
            self.now_s = self._taken / p.sample_rate_hz * (1.0 + self.skew)
            yield Block(time_s, readings, np.zeros(readings.shape, dtype=bool), names, MILLIBAR)
