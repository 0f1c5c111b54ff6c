"""A shoe of four sensing units, or a pair, on a virtual clock: feet press, a microcontroller samples and sends.

*Left out:* Bluetooth's delays, losses and bursts (the wire's emulator has those), the clock's drift, cross talk between
units.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from simulators.instruments.sensing_unit import SensingUnit
from simulators.people.events import TrueEvent, events_of
from simulators.people.plan import FEET
from simulators.people.profiles import PROFILES, Gait
from simulators.people.sensing import Sampler
from simulators.people.shape import COLUMNS
from smartshoe.arrays import Array
from smartshoe.devices import Block, ChannelDescription, Shoe
from smartshoe.errors import UsageError
from smartshoe.units import MILLIBAR

if TYPE_CHECKING:
    from simulators.benches._bench import Bench


FINEST_STEP_HZ = 1000.0
CHUNK_S = 10.0
LONGEST_TRUTH_S = 3600.0  # the truth of longer streams is not stored


@dataclass(frozen=True, slots=True)
class ShoeParameters:
    """The stream: ``block_samples`` per block; ``adc_bits`` over 0-5 V for each unit.

    On a bench (`simulators.benches._bench`) its clock deviates from true time by ``clock_skew_ppm`` and
    ``clock_offset_s``, which are drawn where they are None.
    """

    sample_rate_hz: float = 200.0
    duration_s: float = 60.0
    block_samples: int = 20
    adc_bits: int = 12
    clock_skew_ppm: float | None = None
    clock_offset_s: float | None = None


@dataclass(frozen=True, eq=False)
class ShoeTruth:
    """Signals that no instrument records, at the readings' times: ``load_n`` and ``pressure_pa`` (n, units).

    ``foot_n`` (n, feet) is the entire vertical force of each of ``feet``, including the part that passes beside the
    units; ``events`` are the true events in order of time.
    """

    time_s: Array
    load_n: Array
    pressure_pa: Array
    foot_n: Array
    feet: tuple[str, ...]
    events: tuple[TrueEvent, ...]
    body_weight_n: float


class SimulatedShoe(Shoe):
    """Units under one foot or two; ``profile`` is one of `PROFILES`. Each opening restarts the stream, from rest.

    ``truth`` is available once a stream of at most an hour has been read to its end.
    """

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
        self._sampler = Sampler(self.units, self.parameters.adc_bits, rng)
        self.bench: Bench | None = None

    def __str__(self) -> str:
        return f"simulated shoe ({self.profile})"

    @property
    def sample_rate_hz(self) -> float:
        """Rate of the readings."""
        return self.parameters.sample_rate_hz

    def describe(self) -> tuple[ChannelDescription, ...]:
        """One channel per unit, in mbar."""
        step_v = self._sampler.adc.parameters.step_v
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
        self._sampler.reset()
        if self.bench is not None:
            self.bench.restart()

    def converted_mbar(self, unit: SensingUnit, voltage_v: Array) -> Array:
        """A unit's reading (n,) in mbar from its sensor's voltage (n,), through the converter."""
        return self._sampler.converted_mbar(unit, voltage_v)

    def _blocks_internal(self) -> Iterator[Block]:
        if self.bench is not None:
            yield from self.bench.stream(FINEST_STEP_HZ)
            return
        p = self.parameters
        finer = max(1, int(np.ceil(FINEST_STEP_HZ / p.sample_rate_hz)))
        fine_hz = p.sample_rate_hz * finer
        count = max(1, round(p.duration_s * p.sample_rate_hz))
        plan = self.gait.plan(self.profile, count / p.sample_rate_hz, self._rng)
        names = tuple(unit.name for unit in self.units)
        places = [_place(name) for name in names]
        keeps = count <= LONGEST_TRUTH_S * p.sample_rate_hz
        truths: list[ShoeTruth] = []
        chunk = p.block_samples * max(1, round(CHUNK_S * p.sample_rate_hz / p.block_samples))
        for begin in range(0, count, chunk):
            end = min(begin + chunk, count)
            # Each sample is the last of its fine steps; before time 0 there is no load. One extra step is for events.
            fine_s = np.arange((begin - 1) * finer, (end - 1) * finer + 1) / fine_hz
            loads = plan.loads_n(fine_s)
            fine_n = np.column_stack([loads[1:, foot, column] for foot, column in places])
            readings, pressure_pa = self._sampler.read(fine_n, fine_hz, finer)
            time_s = fine_s[finer::finer]
            if keeps:
                truths.append(self._truth(time_s, fine_n[finer - 1 :: finer], pressure_pa, fine_s, loads, finer))
            for start in range(0, end - begin, p.block_samples):
                part = slice(start, start + p.block_samples)
                yield Block(time_s[part], readings[part], np.zeros(readings[part].shape, dtype=bool), names, MILLIBAR)
        self.truth = _joined(truths) if keeps else None

    def _truth(
        self, time_s: Array, load_n: Array, pressure_pa: Array, fine_s: Array, loads: Array, finer: int
    ) -> ShoeTruth:
        feet = tuple(foot for number, foot in enumerate(FEET) if number in {_place(u.name)[0] for u in self.units})
        weight_n = self.gait.body_weight_n
        events = [e for foot in feet for e in events_of(foot, fine_s, loads[:, FEET.index(foot)], weight_n)]
        foot_n = np.column_stack([loads[finer::finer, FEET.index(foot)].sum(axis=1) for foot in feet])
        in_order = tuple(sorted(events, key=lambda event: event.time_s))
        return ShoeTruth(time_s, load_n, pressure_pa, foot_n, feet, in_order, weight_n)


def _joined(truths: Sequence[ShoeTruth]) -> ShoeTruth:
    first = truths[0]
    return ShoeTruth(
        np.concatenate([t.time_s for t in truths]),
        np.concatenate([t.load_n for t in truths]),
        np.concatenate([t.pressure_pa for t in truths]),
        np.concatenate([t.foot_n for t in truths]),
        first.feet,
        tuple(event for t in truths for event in t.events),
        first.body_weight_n,
    )


def _place(name: str) -> tuple[int, int]:
    """Index of foot and column of a unit's load; 'left_toe' and 'toe' both mean the left toe."""
    side, _, region = name.rpartition("_")
    return FEET.index(side or "left"), COLUMNS.index(region)
