"""An Instron 5944 with a sensing unit on its anvil, logged by Bluehill and by a myRIO as in the paper.

*Left out:* the load controller's overshoot and tuning, the frame's vibration, friction in the grips, side loads. The
corners of the commanded load are rounded by a short average, which bounds the acceleration.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from simulators.effects.room import NeighbourUnit, Room
from simulators.instruments.daq import MyRioParameters, SimulatedMyRio, sampled
from simulators.instruments.sensing_unit import SensingUnit
from simulators.plant.bladder_parameters import TUBE_DIAMETER_M
from smartshoe.arrays import Array
from smartshoe.devices import ChannelDescription, Shoe, TestMachine
from smartshoe.errors import LimitError
from smartshoe.files.gate import limits
from smartshoe.protocol import MachineLimits, Protocol
from smartshoe.recording import Channel, Recording, Role
from smartshoe.units import MILLIBAR, NEWTON, VOLT, unit

if TYPE_CHECKING:
    from simulators.benches._bench import Bench


LOAD_LIMIT_N = 2000.0  # of the Instron 5944's frame
MILLIMETRE, CELSIUS = unit("mm"), unit("°C")


@dataclass(frozen=True, slots=True)
class InstronParameters:
    """The machine: noise is a standard deviation per sample; the rounding of corners spans ``corner_s`` (0: sharp).

    ``load_cell_tare_n`` is what the load cell shows without load, in both logs.
    """

    fine_rate_hz: float = 1000.0
    corner_s: float = 0.04
    load_noise_n: float = 0.3
    frame_stiffness_n_per_m: float = 5e6
    extension_noise_m: float = 2e-7
    bluehill_rate_hz: float = 100.0
    bluehill_clock_offset_s: float = 0.35
    load_cell_tare_n: float = 0.0
    room: Room = field(default_factory=Room)
    neighbour: NeighbourUnit = field(default_factory=NeighbourUnit)


@dataclass(frozen=True, eq=False)
class Truth:
    """Signals that no instrument records, at the fine step, all (n,); ``deformation`` is the air's compressed share."""

    time_s: Array
    command_n: Array
    load_n: Array
    pressure_pa: Array
    reading_v: Array
    deformation: Array
    neighbour_pa: Array | None = None


class SimulatedInstron(TestMachine):
    """A test machine on a virtual clock: a run takes only its computing time.

    Each run starts from a unit at rest. ``truth`` holds the last run at the fine step.
    """

    def __init__(
        self,
        specimen: SensingUnit,
        rng: np.random.Generator,
        parameters: InstronParameters | None = None,
        daq: MyRioParameters | None = None,
        seed: str = "",
    ) -> None:
        super().__init__()
        self.specimen = specimen
        self.parameters = parameters or InstronParameters()
        self.daq = SimulatedMyRio(daq or MyRioParameters(), rng)
        self.truth: Truth | None = None
        self._rng = rng
        self._channel_rng, self._room_rng = rng.spawn(2)
        self._seed = seed
        self._logs: tuple[Recording, ...] = ()
        self._bench: Bench | None = None

    def __str__(self) -> str:
        return f"simulated Instron 5944 with {self.specimen.name}"

    @property
    def limits(self) -> MachineLimits:
        """The frame's limit of 2 kN, and the sensor's proof pressure."""
        return MachineLimits(load_n=LOAD_LIMIT_N, pressure_pa=self.specimen.sensor.proof_pressure_pa)

    @property
    def logs(self) -> tuple[Recording, ...]:
        """Bluehill's log (with its own clock) and the myRIO's (voltages) of the last run."""
        return self._logs

    @property
    def is_instant(self) -> bool:
        """True: a run takes only its computing time."""
        return True

    def under(self, shoe: Shoe, unit: str) -> None:
        """Press this unit of a simulated shoe from now on, while the shoe streams (`simulators.benches._bench`)."""
        from simulators.benches._bench import Bench
        from simulators.benches.shoe import SimulatedShoe

        if isinstance(shoe, SimulatedShoe):
            p = shoe.parameters
            bench = Bench(shoe, unit, self._rng, skew_ppm=p.clock_skew_ppm, offset_s=p.clock_offset_s)
            shoe.bench = self._bench = bench
            self.specimen = bench.specimen

    def describe(self) -> tuple[ChannelDescription, ...]:
        """The joined recording's channels."""
        daq = self.daq.parameters
        span_pa = self.specimen.sensor.range_pa
        span_mbar = (float(MILLIBAR.from_si(span_pa[0])), float(MILLIBAR.from_si(span_pa[1])))
        step_pa = np.diff(self.specimen.sensor.to_pressure_pa(np.array([0.0, daq.step_v])))[0]
        span_n = self.daq.to_load_n(np.array([0.0, daq.full_scale_v]))
        rate = daq.sample_rate_hz
        described = [
            ChannelDescription(
                "force", "force", NEWTON, (float(span_n[0]), float(span_n[1])), daq.step_v * daq.newton_per_volt, rate
            ),
            ChannelDescription("pressure", "pressure", MILLIBAR, span_mbar, float(MILLIBAR.from_si(step_pa)), rate),
            ChannelDescription("command", "force", NEWTON, (0.0, LOAD_LIMIT_N), None, rate),
            ChannelDescription("displacement", "length", MILLIMETRE, None, None, rate),
        ]
        if self.parameters.room.logged:
            described.append(ChannelDescription("temperature", "temperature", CELSIUS, None, None, rate))
        if self.parameters.neighbour.logged:
            described.append(ChannelDescription("neighbour", "pressure", MILLIBAR, None, None, rate))
        return tuple(described)

    def _check_internal(self, protocol: Protocol) -> None:
        p, most = self.parameters, limits().samples
        rate_hz = max(p.fine_rate_hz, p.bluehill_rate_hz, self.daq.parameters.sample_rate_hz)
        if protocol.duration_s * rate_hz > most:
            raise LimitError(
                f"protocol {protocol.name} lasts {protocol.duration_s:g} s, at {rate_hz:g} Hz more than {most} samples:"
                f" shorten it, or raise the limit with --limit samples={protocol.duration_s * rate_hz:.0f}"
            )
        expected_pa = self.specimen.bladder.parameters.nominal_pressure_pa(protocol.peak_load_n)
        proof_pa = self.specimen.sensor.proof_pressure_pa
        if expected_pa > proof_pa:
            raise LimitError(
                f"protocol {protocol.name} asks for {protocol.peak_load_n:g} N, about {expected_pa / 1e5:.2f} bar in"
                f" {self.specimen.name}, above the sensor's proof pressure of {proof_pa / 1e5:g} bar: lower the load"
                " or enlarge the effective area"
            )

    def _trajectory(self, protocol: Protocol, time_s: Array) -> tuple[Array, Array]:
        """Commanded and actual load (n,) in N: a centred average keeps ramps where they are and rounds corners."""
        command_n = protocol.load_at(time_s)
        width = round(self.parameters.corner_s * self.parameters.fine_rate_hz) | 1
        if width <= 1:
            return command_n, command_n.copy()
        half = width // 2
        padded = np.concatenate([np.zeros(half + 1), command_n, np.full(half, command_n[-1])])
        cumulated = np.cumsum(padded)
        # Only rounding of the running sum could give negative values.
        return command_n, np.maximum((cumulated[width:] - cumulated[:-width]) / width, 0.0)

    def _run_internal(self, protocol: Protocol) -> Recording:
        rate = self.parameters.fine_rate_hz
        time_s = np.arange(round(protocol.duration_s * rate) + 1) / rate
        command_n, load_n = self._trajectory(protocol, time_s)
        bladder, sensor = self.specimen.bladder, self.specimen.sensor
        bladder.reset()
        sensor.reset()
        pressure_pa = bladder.press(load_n, rate)
        felt_pa, neighbour_pa = pressure_pa, None
        neighbour = self.parameters.neighbour
        if neighbour.logged or neighbour.cross_talk != 0:
            neighbour_pa = neighbour.pressure_pa(time_s, self._room_rng)
            felt_pa = pressure_pa + neighbour.added_pa(neighbour_pa, rate)
        reading_v = sensor.read(felt_pa, rate, self.parameters.room.warmer_k(time_s))
        truth = Truth(time_s, command_n, load_n, pressure_pa, reading_v, bladder.deformation, neighbour_pa)
        self.truth = truth
        metadata = {
            "machine": str(self),
            "protocol": protocol.name,
            "effective_area_m2": repr(bladder.parameters.effective_area_m2),
            "seed": self._seed,
            **getattr(bladder, "metadata", {}),
        }
        # One load cell, one amplifier: both logs have the same electrical noise only where they sample simultaneously,
        # which two free-running clocks do not.
        if self._bench is not None:
            self._bench.press(truth)
        machine = self._bluehill(truth, protocol, metadata)
        voltages = self._myrio(truth, protocol, metadata)
        self._logs = (machine, voltages)
        return self._joined(protocol, machine, voltages, metadata)

    def _bluehill(self, truth: Truth, protocol: Protocol, metadata: dict[str, str]) -> Recording:
        p = self.parameters
        ticks_s = np.arange(int(protocol.duration_s * p.bluehill_rate_hz + 1e-9) + 1) / p.bluehill_rate_hz
        load_n = sampled(ticks_s, p.fine_rate_hz, truth.load_n)
        extension_m = TUBE_DIAMETER_M * sampled(ticks_s, p.fine_rate_hz, truth.deformation)
        extension_m += load_n / p.frame_stiffness_n_per_m
        extension_m += p.extension_noise_m * self._rng.standard_normal(ticks_s.size)
        load_n = load_n + p.load_cell_tare_n + p.load_noise_n * self._rng.standard_normal(ticks_s.size)
        channels = {
            "extension": Channel.from_values("extension", MILLIMETRE.from_si(extension_m), MILLIMETRE),
            "force": Channel.from_values("force", load_n, NEWTON, "load"),
        }
        return Recording(
            ticks_s + p.bluehill_clock_offset_s, channels, f"{protocol.name}_bluehill", self.specimen.name, metadata
        )

    def _myrio(self, truth: Truth, protocol: Protocol, metadata: dict[str, str]) -> Recording:
        p = self.parameters
        logged_s, true_s = self.daq.ticks(protocol.duration_s)
        load_n = sampled(true_s, p.fine_rate_hz, truth.load_n)
        load_n = load_n + p.load_cell_tare_n + p.load_noise_n * self._rng.standard_normal(logged_s.size)
        reading, sensor = self.daq.parameters.reading, self.specimen.sensor.parameters
        read_s = reading.times(true_s, self._channel_rng)
        if read_s is true_s:
            voltage_v = sampled(true_s, p.fine_rate_hz, truth.reading_v)
        else:
            white_v = self.specimen.sensor.white_v
            nearest = np.clip(np.rint(read_s * p.fine_rate_hz), 0, white_v.size - 1).astype(np.intp)
            voltage_v = sampled(read_s, p.fine_rate_hz, truth.reading_v - white_v) + white_v[nearest]
        if reading.hum_percent > 0:
            voltage_v = voltage_v + reading.hum(true_s, sensor.span_v, self._channel_rng)
        pressure_v = reading.logged(self.daq.convert(voltage_v), sensor.unloaded_v, sensor.span_v, self._channel_rng)
        channels = {
            "pressure": Channel.from_values("pressure", pressure_v, VOLT, "sensor"),
            "load": Channel.from_values("load", self.daq.convert_load(load_n), VOLT),
        }
        return Recording(logged_s, channels, f"{protocol.name}_myrio", self.specimen.name, metadata)

    def _joined(
        self, protocol: Protocol, machine: Recording, voltages: Recording, metadata: dict[str, str]
    ) -> Recording:
        """Load and reading as the myRIO sampled them, and Bluehill's crosshead, shifted to the same start."""
        time_s = voltages.time_s
        pressure_pa = self.specimen.sensor.to_pressure_pa(voltages["pressure"].with_nan())
        extension = machine["extension"]
        start_s = self.parameters.bluehill_clock_offset_s
        values: dict[str, tuple[Array, Role]] = {
            "force": (self.daq.to_load_n(voltages["load"].values), "load"),
            "pressure": (MILLIBAR.from_si(pressure_pa), "sensor"),
            "command": (protocol.load_at(time_s), "command"),
            "displacement": (np.interp(time_s, machine.time_s - start_s, extension.values), "auxiliary"),
        }
        values.update(self._around(time_s))
        channels = {
            d.name: replace(
                Channel.from_values(d.name, values[d.name][0], d.unit, values[d.name][1]),
                range_=d.range_,
                resolution=d.resolution,
            )
            for d in self.describe()
        }
        notes = []
        largest_n = float(self.daq.to_load_n(np.array([self.daq.parameters.full_scale_v]))[0])
        if protocol.peak_load_n > largest_n:
            notes.append(
                f"the load reaches {protocol.peak_load_n:g} N, beyond the {largest_n:g} N that the"
                " myRIO's load channel logs: it is clipped there"
            )
        return Recording(
            time_s, channels, protocol.name, self.specimen.name, metadata, source=str(self), notes=tuple(notes)
        )

    def _around(self, time_s: Array) -> dict[str, tuple[Array, Role]]:
        """The room's temperature and the neighbour's reading, where they are logged."""
        p = self.parameters
        found: dict[str, tuple[Array, Role]] = {}
        if p.room.logged:
            noise_k = p.room.thermometer_noise_k * self._room_rng.standard_normal(time_s.size)
            found["temperature"] = (p.room.start_c + p.room.warmer_k(time_s) + noise_k, "auxiliary")
        if p.neighbour.logged and self.truth is not None and self.truth.neighbour_pa is not None:
            noise_mbar = p.neighbour.noise_mbar * self._room_rng.standard_normal(time_s.size)
            heard_pa = sampled(time_s, p.fine_rate_hz, self.truth.neighbour_pa)
            found["neighbour"] = (MILLIBAR.from_si(heard_pa) + noise_mbar, "auxiliary")
        return found
