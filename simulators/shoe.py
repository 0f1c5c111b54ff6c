"""A shoe of four sensing units on a virtual clock: a profile presses, a microcontroller samples and sends blocks.

*Left out:* Bluetooth's delays, losses and bursts (the wire's emulator has those), the clock's drift, cross talk
between units.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simulators.daq import MyRioParameters, SimulatedMyRio
from simulators.instron import SensingUnit
from simulators.profiles import PROFILES, Gait
from smartshoe.devices.base import Block, ChannelDescription, Shoe
from smartshoe.errors import UsageError
from smartshoe.units import MILLIBAR

Array = NDArray[np.float64]

FINEST_STEP_HZ = 1000.0


@dataclass(frozen=True, slots=True)
class ShoeParameters:
    """The stream: ``block_samples`` a block; ``adc_bits`` over 0-5 V for each unit."""

    sample_rate_hz: float = 200.0
    duration_s: float = 60.0
    block_samples: int = 20
    adc_bits: int = 12


@dataclass(frozen=True, eq=False)
class ShoeTruth:
    """What no instrument sees, at the readings' times: ``load_n`` and ``pressure_pa`` (n, units)."""

    time_s: Array
    load_n: Array
    pressure_pa: Array


class SimulatedShoe(Shoe):
    """Four units under a foot; ``profile`` is 'stand' or 'walk'. Each opening starts the stream afresh, from rest."""

    def __init__(
        self,
        units: Sequence[SensingUnit],
        profile: str,
        rng: np.random.Generator,
        gait: Gait | None = None,
        parameters: ShoeParameters | None = None,
    ) -> None:
        super().__init__()
        if profile not in PROFILES:
            raise UsageError(f"profile {profile!r} is not known: use one of {', '.join(PROFILES)}")
        self.units = tuple(units)
        self.profile = profile
        self.gait = gait or Gait()
        self.parameters = parameters or ShoeParameters()
        self.truth: ShoeTruth | None = None
        self._rng = rng
        self._adc = SimulatedMyRio(MyRioParameters(bits=self.parameters.adc_bits), rng)

    def __str__(self) -> str:
        return f"simulated shoe ({self.profile})"

    @property
    def sample_rate_hz(self) -> float:
        """Rate of the readings."""
        return self.parameters.sample_rate_hz

    def describe(self) -> tuple[ChannelDescription, ...]:
        """One channel a unit, in mbar."""
        step_v = self._adc.parameters.step_v
        return tuple(
            ChannelDescription(
                u.name,
                "pressure",
                MILLIBAR,
                (0.0, float(MILLIBAR.from_si(u.sensor.range_pa[1]))),
                float(MILLIBAR.from_si(np.diff(u.sensor.to_pressure_pa(np.array([0.0, step_v])))[0])),
                self.sample_rate_hz,
            )
            for u in self.units
        )

    def _open_internal(self) -> None:
        for unit in self.units:
            unit.bladder.reset()
            unit.sensor.reset()

    def _blocks_internal(self) -> Iterator[Block]:
        p = self.parameters
        finer = max(1, int(np.ceil(FINEST_STEP_HZ / p.sample_rate_hz)))
        fine_hz = p.sample_rate_hz * finer
        count = max(1, round(p.duration_s * p.sample_rate_hz))
        fine_s = np.arange((count - 1) * finer + 1) / fine_hz
        loads = PROFILES[self.profile](self.gait, fine_s, self._rng)
        load_n = np.empty((count, len(self.units)))
        pressure_pa, readings = np.empty_like(load_n), np.empty_like(load_n)
        for column, unit in enumerate(self.units):
            # 'left_toe' and 'toe' are both the toe.
            fine_n = loads[unit.name.rsplit("_", 1)[-1]]
            fine_pa = unit.bladder.press(fine_n, fine_hz)
            voltage = self._adc.convert(unit.sensor.read(fine_pa, fine_hz)[::finer])
            load_n[:, column], pressure_pa[:, column] = fine_n[::finer], fine_pa[::finer]
            readings[:, column] = MILLIBAR.from_si(unit.sensor.to_pressure_pa(voltage))
        time_s = fine_s[::finer]
        self.truth = ShoeTruth(time_s, load_n, pressure_pa)
        names = tuple(unit.name for unit in self.units)
        for start in range(0, count, p.block_samples):
            part = slice(start, start + p.block_samples)
            yield Block(time_s[part], readings[part], np.zeros(readings[part].shape, dtype=bool), names, MILLIBAR)
