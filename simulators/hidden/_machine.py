"""A simulated machine whose unit has further laws of effects (`simulators.hidden.effects._law`) in its chain.

A law of the wall or of the air is solved in balance with the unit's standard linear solid, at a step of 2 ms, by
iterating on whole records: x = H(u), u = load - stress(x) - pressure(x, y)/(1 + k1 x0^2/nRT), y = x + pressure. The
result is a change of the load and of the pressure, interpolated to the machine's own step, so that it combines with the
effects that the machine's options switch on. *Left out*: it does not feel other effects in the wall, which is an error
of the order of the product of both.

A first law, which options switch on, departs by d(warp(load)), where d is the unit's output with the effect minus that
without it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from simulators.benches.instron import SimulatedInstron
from simulators.hidden.effects import Draws, Law, Options, Subject, Surroundings, Warp, merged
from simulators.hidden.effects.operators import lagged
from simulators.instruments.presets import FULL_SCALE_N
from simulators.instruments.sensing_unit import SensingUnit
from simulators.instruments.sensor import SimulatedHdiSensor
from simulators.plant.bladder import LOWEST_STEP_HZ, SimulatedBladder
from simulators.plant.bladder_parameters import AMBIENT_PA, X_OVER_NRT
from simulators.provider import provider
from smartshoe.arrays import Array
from smartshoe.devices import Bladder, ChannelDescription, Sensor
from smartshoe.errors import SmartShoeError
from smartshoe.protocol import Protocol
from smartshoe.recording import Channel, Recording

LAW_STEP_S = 2e-3
MOST_ITERATIONS = 2000
SETTLED = 1e-6  # of full scale


@dataclass(frozen=True, eq=False)
class Given:
    """A further law as applied to a unit, with its amount and parameters."""

    law: Law
    amount: float
    draws: Draws
    warp: Warp = field(default_factory=Warp)
    seed: int = 0

    def acts(self, signal: Array, at: Surroundings) -> Array:
        """The result of `Law.act`, with the departure applied to ``signal`` (n,) or to the time."""
        if self.amount == 0.0 and self.law.place in ("load", "reading", "log"):
            return signal
        if self.law.bends == "time":
            warped_s = at.span_s * self.warp.of(at.time_s / at.span_s)
            bent = replace(at, time_s=warped_s)
            fed = warped_s if self.law.place == "shift" else signal
            return self.law.act(self.amount, self.draws, fed, bent)
        fed = self.warp.of(signal)
        bent = replace(at, load=self.warp.of(at.load), deformation=fed, pressure=fed)
        found = self.law.act(self.amount, self.draws, fed, bent)
        return found + (signal - fed) if self.law.place in ("load", "reading") else found


@dataclass(frozen=True, eq=False)
class Departed:
    """A first law with a departure: the options that switch it on, and the warp of its input."""

    options: Options
    bends: str
    warp: Warp


@dataclass(frozen=True, eq=False)
class Chain:
    """The effects of a unit that the machine's own options do not switch on."""

    given: tuple[Given, ...] = ()
    departed: tuple[Departed, ...] = ()

    def at(self, *places: str) -> list[Given]:
        """The laws that act at the given places."""
        return [one for one in self.given if one.law.place in places]


class LawfulBladder(Bladder):
    """A bladder with further laws that act before and inside it."""

    def __init__(self, inner: SimulatedBladder, chain: Chain, subject: Subject, options: Options) -> None:
        self.inner, self.parameters, self._chain, self._subject = inner, inner.parameters, chain, subject
        plain = merged(subject.options(), {})["bladder"]
        self._side = [
            (_bladder(plain, one.options.get("bladder", {})), _bladder(plain, {}), one.warp)
            for one in chain.departed
            if one.bends == "load"
        ]
        self.session = 0
        self.deformation = np.zeros(0)

    def reset(self) -> None:
        self.inner.reset()
        self.session += 1
        for with_effect, without, _ in self._side:
            with_effect.reset()
            without.reset()

    def press(self, load_n: Array, sample_rate_hz: float) -> Array:
        """Gauge pressure (n,) in Pa; a law's memory starts anew with each call, since each is one recording."""
        acting_n, added_pa = np.asarray(load_n, dtype=float), np.zeros(load_n.size)
        if self._chain.at("load", "stress", "gas", "leak"):
            change, further = self._laws(acting_n / FULL_SCALE_N, sample_rate_hz)
            acting_n = acting_n + FULL_SCALE_N * change
            added_pa = added_pa + 100.0 * self._subject.full_scale_mbar * further
        pressure_pa = self.inner.press(acting_n, sample_rate_hz)
        self.deformation = self.inner.deformation
        for with_effect, without, warp in self._side:
            warped_n = FULL_SCALE_N * warp.of(np.asarray(load_n) / FULL_SCALE_N)
            added_pa += with_effect.press(warped_n, sample_rate_hz) - without.press(warped_n, sample_rate_hz)
        return np.asarray(pressure_pa + added_pa)

    def _laws(self, load: Array, rate_hz: float) -> tuple[Array, Array]:
        """The change of load and the additional pressure, both (n,) and as shares of full scale."""
        time_s = np.arange(load.size) / rate_hz
        coarse_s = np.arange(0.0, time_s[-1] + LAW_STEP_S, LAW_STEP_S)
        f = np.interp(coarse_s, time_s, load)
        at = Surroundings(
            coarse_s, LAW_STEP_S, f, f, f, float(time_s[-1]), self.session, self._subject.k1 * X_OVER_NRT,
            np.random.default_rng(0),
        )  # fmt: skip
        u = f
        for one in self._chain.at("load"):
            u = one.acts(u, at)
        further = np.zeros(f.size)
        inside = self._chain.at("stress", "gas", "leak")
        if inside:
            u, further = balanced(inside, u, at, self._subject)
        return np.interp(time_s, coarse_s, u - f), np.interp(time_s, coarse_s, further)


def balanced(laws: Sequence[Given], acting: Array, at: Surroundings, subject: Subject) -> tuple[Array, Array]:
    """Load (n,) to apply to the plain unit, and pressure (n,) to add to its own, with ``laws`` in balance."""
    stiff = subject.k1 * X_OVER_NRT
    at_once = (1.0 + stiff) / (1.0 + stiff + subject.k2 * X_OVER_NRT)
    relaxes_s = subject.c / subject.k2 / at_once
    u, further = acting, np.zeros(acting.size)
    step, before = 1.0, np.inf
    for _ in range(MOST_ITERATIONS):
        x = at_once * u + (1.0 - at_once) * lagged(u, relaxes_s, at.step_s)
        stress, added = np.zeros(u.size), np.zeros(u.size)
        for one in laws:
            if one.law.place == "stress":
                stress += one.acts(x, at)
            else:
                added += one.acts(x if one.law.place == "gas" else x + further, at)
        off = acting - stress - added / (1.0 + stiff) - u
        worst = max(float(np.abs(off).max()), float(np.abs(added - further).max()))
        if worst < SETTLED:
            return u + off, np.asarray(added)
        if worst > 0.9 * before:
            step = max(0.5 * step, 0.05)
        before = worst
        u = u + step * off
        further = further + step * (added - further)
    raise SmartShoeError(
        f"the balance of {', '.join(one.law.name for one in laws)} does not settle (off by {worst:.2g} of full scale):"
        " ask for less of the effect"
    )


def _bladder(plain: Options, more: Options) -> SimulatedBladder:
    from pydantic import TypeAdapter

    from simulators.plant.bladder_parameters import BladderParameters

    return SimulatedBladder(TypeAdapter(BladderParameters).validate_python(merged(plain, more)))


class LawfulSensor(Sensor):
    """A sensor with further laws that act before its lag and noise."""

    def __init__(self, inner: SimulatedHdiSensor, chain: Chain, subject: Subject) -> None:
        self.inner, self.parameters, self._chain, self._subject = inner, inner.parameters, chain, subject
        self.session = 0
        self._side = [(one, *self._pair(one)) for one in chain.departed if one.bends == "pressure"]
        self.load = np.zeros(0)

    def _pair(self, one: Departed) -> tuple[SimulatedHdiSensor, SimulatedHdiSensor]:
        from simulators.instruments.options import SensorOptions

        made = []
        for more in (one.options.get("sensor", {}), {}):
            options = merged(self._subject.options()["sensor"], more, {"over_range_percent": 12.5})
            made.append(
                SimulatedHdiSensor(SensorOptions.model_validate(options).parameters(), np.random.default_rng(0))
            )
        return made[0], made[1]

    def describe(self) -> ChannelDescription:
        return self.inner.describe()

    @property
    def range_pa(self) -> tuple[float, float]:
        return self.inner.range_pa

    @property
    def proof_pressure_pa(self) -> float:
        return self.inner.proof_pressure_pa

    @property
    def white_v(self) -> Array:
        """The white noise (n,) in volt that the sensor added to the last reading."""
        return self.inner.white_v

    def reset(self) -> None:
        self.inner.reset()
        self.session += 1
        for _, with_effect, without in self._side:
            with_effect.reset()
            without.reset()

    def to_pressure_pa(self, reading_v: Array) -> Array:
        return self.inner.to_pressure_pa(reading_v)

    def read(self, pressure_pa: Array, sample_rate_hz: float, warmer_k: Array | float = 0.0) -> Array:
        """The reading (n,) in volt.

        ``load`` (n,) must hold the plate's load as a share of full scale, for laws that need it.
        """
        full_pa = 100.0 * self._subject.full_scale_mbar
        y = np.asarray(pressure_pa) / full_pa
        time_s = np.arange(y.size) / sample_rate_hz
        load = self.load if self.load.size == y.size else y
        for k, one in enumerate(self._chain.at("reading", "shift")):
            rng = np.random.default_rng([one.seed, self.session, k])
            at = Surroundings(
                time_s, 1.0 / sample_rate_hz, load, y, y, float(time_s[-1]), self.session,
                self._subject.k1 * X_OVER_NRT, rng,
            )  # fmt: skip
            is_late = one.law.place == "shift"
            y = np.interp(time_s - one.acts(time_s, at), time_s, y) if is_late else one.acts(y, at)
        for one, with_effect, without in self._side:
            warped_pa = full_pa * one.warp.of(np.asarray(pressure_pa) / full_pa)
            changed_v = with_effect.read(warped_pa, sample_rate_hz) - without.read(warped_pa, sample_rate_hz)
            y = y + changed_v * self._subject.range_mbar * 100.0 / with_effect.parameters.span_v / full_pa
        return self.inner.read(full_pa * y, sample_rate_hz, warmer_k)


def machine_of(options: Options, seed: int) -> SimulatedInstron:
    """The machine with these options, with noise that ``seed`` determines."""
    return provider.open_machine("instron", options, np.random.default_rng([seed, 2]))


def lawful_machine(options: Options, seed: int, chain: Chain, subject: Subject) -> SimulatedInstron:
    """The machine whose unit has the laws of ``chain``, except those of the log, which `recorded` applies."""
    machine = machine_of(options, seed)
    unit = machine.specimen
    if not isinstance(unit.bladder, SimulatedBladder):
        raise SmartShoeError("a twin has no further laws")
    if chain.given or chain.departed:
        sensor = LawfulSensor(unit.sensor, chain, subject)
        inside = LawfulBladder(unit.bladder, chain, subject, options)
        machine.specimen = SensingUnit(unit.name, _Felt(inside, sensor), sensor)  # type: ignore[arg-type]
    return machine


class _Felt:
    """The bladder; passes the acting load on to the sensor's laws."""

    def __init__(self, bladder: LawfulBladder, sensor: LawfulSensor) -> None:
        self._bladder, self._sensor = bladder, sensor
        self.parameters = bladder.parameters
        self.metadata: Mapping[str, str] = {}

    @property
    def deformation(self) -> Array:
        return self._bladder.deformation

    def reset(self) -> None:
        self._bladder.reset()

    def press(self, load_n: Array, sample_rate_hz: float) -> Array:
        self._sensor.load = np.asarray(load_n) / FULL_SCALE_N
        return self._bladder.press(load_n, sample_rate_hz)


def recorded(
    options: Options, protocols: Sequence[Protocol], seed: int, chain: Chain, subject: Subject
) -> tuple[Recording, ...]:
    """One recording per protocol, each a session of its own."""
    with lawful_machine(options, seed, chain, subject) as machine:
        return tuple(
            logged(machine.run(protocol), chain, subject, number) for number, protocol in enumerate(protocols, start=1)
        )


def logged(recording: Recording, chain: Chain, subject: Subject, number: int) -> Recording:
    """The recording with the laws of load cell and log applied."""
    laws = chain.at("tare", "log")
    if not laws:
        return recording
    load, reading = recording["force"], recording["pressure"]
    f, y = load.values / FULL_SCALE_N, reading.with_nan() / subject.full_scale_mbar
    tare = np.zeros(f.size)
    for k, one in enumerate(laws):
        rng = np.random.default_rng([one.seed, number, k, 7])
        at = Surroundings(
            recording.time_s, recording.sample_time_s, f, y, y, recording.duration_s, number,
            subject.k1 * X_OVER_NRT, rng,
        )  # fmt: skip
        if one.law.place == "tare":
            tare = tare + one.acts(f, at)
        else:
            y = one.acts(y, at)
    changed = Channel.from_values("pressure", subject.full_scale_mbar * y, reading.unit, "sensor")
    shown = Channel.from_values("force", FULL_SCALE_N * (f + tare), load.unit, "load")
    recording = recording.with_channel(replace(changed, range_=reading.range_, resolution=reading.resolution))
    return recording.with_channel(replace(shown, range_=load.range_, resolution=load.resolution))


__all__ = ["AMBIENT_PA", "LOWEST_STEP_HZ", "Chain", "Departed", "Given", "lawful_machine", "machine_of", "recorded"]
