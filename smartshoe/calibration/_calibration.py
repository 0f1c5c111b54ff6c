"""`Calibration`: a unit's identified model as a file, and the force it gives for a recording."""

from __future__ import annotations

import math
import numbers
import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from smartshoe.arrays import Array
from smartshoe.calibration._compensator import Compensator
from smartshoe.calibration._extended import ExtendedCompensator
from smartshoe.calibration._filter import ForceFilter
from smartshoe.calibration._reader import Reader, parsed
from smartshoe.errors import InputError, MissingChannelError, UnitError, UsageError
from smartshoe.files.atomic import json_text, write_text
from smartshoe.files.logs.accepted import RecordingLike, recording_of
from smartshoe.models.effects import shift_of
from smartshoe.models.extended import ExtendedModel
from smartshoe.models.first_order import simulate, steps
from smartshoe.models.parameter import Parameter, finite_or_none
from smartshoe.recording import Channel, Recording
from smartshoe.units import NEWTON, Unit, declared, find_unit

SCHEMA = "smartshoe.calibration/1"
ESTIMATE_NAME = "force_estimate"
USUAL_FULL_SCALE_N = 800.0  # peak load of the paper's protocols


@dataclass(frozen=True)
class Calibration:
    """A unit's identified model: force = (b0 s + b1)/(s + a1) (reading - offset), Chinimilli 2016 (13).

    ``offset`` is in ``reading_unit``; ``parameters`` and ``covariance`` (in their order) are as identified; ``scale``
    is in N per reading unit. ``load_range_n`` and ``rate_range_n_per_s`` are the ranges seen in the identification;
    ``sources`` holds name and sha256 of the files; ``created`` is an ISO date given by the caller, '' where not known.
    ``unit`` is the place of the unit ("left_toe"), ``serial_number`` identifies it, '' where not known. ``extended`` is
    the model with effects, with the coefficients as its linear part; where it is given, it gives the force. ``twin`` is
    the model that simulates the unit forward, where that is not the one whose inverse gives the force.
    """

    a1: float
    b0: float
    b1: float
    reading_unit: Unit
    offset: float = 0.0
    unit: str = ""
    parameters: Mapping[str, Parameter] = field(default_factory=dict)
    covariance: tuple[tuple[float, ...], ...] = ()
    scale: float = 1.0
    delay_s: float = 0.0
    load_range_n: tuple[float, float] | None = None
    rate_range_n_per_s: tuple[float, float] | None = None
    sample_rate_hz: float = 100.0
    sources: tuple[Mapping[str, str | None], ...] = ()
    created: str = ""
    smartshoe_version: str = ""
    serial_number: str = ""
    extended: ExtendedModel | None = None
    twin: ExtendedModel | None = None

    def __post_init__(self) -> None:
        if not isinstance(self.unit, str):
            raise InputError(f"the calibration's unit is {self.unit!r}: give the unit's name as text")
        for key in ("a1", "b0", "b1", "offset", "scale", "delay_s", "sample_rate_hz"):
            number = getattr(self, key)
            if not (isinstance(number, numbers.Real) and math.isfinite(number)):
                raise InputError(
                    f"calibration of {self.unit or 'a unit'}: {key} is no finite number: identify the unit anew"
                )
        if self.a1 <= 0 or self.sample_rate_hz <= 0:
            key = "a1" if self.a1 <= 0 else "sample_rate_hz"
            raise InputError(
                f"calibration of {self.unit or 'a unit'}: {key} is {getattr(self, key):g}, it must be above 0:"
                " identify the unit anew"
            )

    def compensator(self, sample_rate_hz: float | None = None) -> ForceFilter:
        """The filter at ``sample_rate_hz``, by default the calibration's own rate.

        A `Compensator`, or an `ExtendedCompensator` where there is an extended model.
        """
        rate_hz = self.sample_rate_hz if sample_rate_hz is None else sample_rate_hz
        if self.extended is not None:
            return ExtendedCompensator(self.extended, rate_hz, reading_unit=self.reading_unit)
        return Compensator(
            self.a1, self.b0, self.b1, offset=self.offset, sample_rate_hz=rate_hz, reading_unit=self.reading_unit
        )

    def model(self) -> ExtendedModel:
        """The model that simulates this unit forward: the twin, else the extended model, else the linear part.

        Raises `InputError` where the coefficients do not describe a passive solid.
        """
        forward = self.twin or self.extended
        if forward is not None:
            return forward
        if not (self.b1 > 0.0 and self.b0 * self.a1 > 0.0):
            raise InputError(
                f"calibration of {self.unit or 'a unit'}: b0 and b1 must be above 0 to simulate it: identify it anew"
            )
        load_n = (self.load_range_n or (0.0, 0.0))[1] or USUAL_FULL_SCALE_N
        reading = load_n * self.a1 / self.b1
        share = self.b0 * self.a1 / self.b1 - 1.0
        linear = ExtendedModel(1.0, share, self.a1, load_n, reading, self.reading_unit.symbol)
        if self.offset == 0.0:
            return linear
        return linear.with_part(shift_of("reading"), np.array([self.offset / reading]))

    def to_dict(self) -> dict[str, Any]:
        """The calibration as a JSON object, schema smartshoe.calibration/1; without NaN or infinity.

        The keys ``serial_number``, ``extended`` and ``twin`` are present only where the calibration has them.
        """
        found: dict[str, Any] = {
            "schema": SCHEMA,
            "unit": self.unit,
            "reading_unit": self.reading_unit.symbol,
            "model": {"kind": "first_order", "a1": self.a1, "b0": self.b0, "b1": self.b1},
            "offset": self.offset,
            "parameters": {name: parameter.to_dict() for name, parameter in self.parameters.items()},
            "covariance": [[finite_or_none(value) for value in row] for row in self.covariance],
            "scale": self.scale,
            "delay_s": self.delay_s,
            "load_range_n": None if self.load_range_n is None else list(self.load_range_n),
            "rate_range_n_per_s": None if self.rate_range_n_per_s is None else list(self.rate_range_n_per_s),
            "sample_rate_hz": self.sample_rate_hz,
            "sources": [dict(source) for source in self.sources],
            "created": self.created,
            "smartshoe_version": self.smartshoe_version,
        }
        if self.serial_number:
            found["serial_number"] = self.serial_number
        for key, model in (("extended", self.extended), ("twin", self.twin)):
            if model is not None:
                found[key] = model.to_dict()
        return found

    def save(self, path: Path | str) -> None:
        """Write the calibration as JSON, atomically."""
        write_text(path, json_text(self.to_dict()))

    @classmethod
    def load(cls, path: Path | str) -> Calibration:
        """Read a calibration; raises `InputError` naming file and key where the file is damaged or something else."""
        return cls._from_object(parsed(path), Reader(str(path)))

    @classmethod
    def _from_object(cls, found: Any, read: Reader) -> Calibration:
        if not isinstance(found, dict) or found.get("schema") != SCHEMA:
            said = found.get("schema") if isinstance(found, dict) else None
            raise InputError(
                f"{read.path}: key 'schema' is {said!r}, not {SCHEMA!r}: give a calibration that identify wrote"
            )
        model = read.mapping(found, "model")
        kind = model.get("kind")
        if kind != "first_order":
            raise read.fault("model.kind", f"is {kind!r}, only 'first_order' is known")
        symbol = read.text(found, "reading_unit")
        parameters = {
            name: read.parameter(found["parameters"], name, "parameters.") for name in read.mapping(found, "parameters")
        }
        covariance = found.get("covariance")
        if not isinstance(covariance, list) or not all(
            isinstance(row, list) and len(row) == len(parameters) for row in covariance
        ):
            raise read.fault("covariance", "is no table of one row a parameter")
        sources = found.get("sources")
        if not isinstance(sources, list) or not all(isinstance(item, dict) for item in sources):
            raise read.fault("sources", "is no list of objects")
        try:
            return cls(
                a1=read.number(model, "a1", "model."),
                b0=read.number(model, "b0", "model."),
                b1=read.number(model, "b1", "model."),
                reading_unit=find_unit(symbol) or declared(symbol),
                offset=read.number(found, "offset"),
                unit=read.text(found, "unit"),
                parameters=parameters,
                covariance=tuple(tuple(read.maybe(value, "covariance") for value in row) for row in covariance),
                scale=read.number(found, "scale"),
                delay_s=read.number(found, "delay_s"),
                load_range_n=read.pair(found, "load_range_n"),
                rate_range_n_per_s=read.pair(found, "rate_range_n_per_s"),
                sample_rate_hz=read.number(found, "sample_rate_hz"),
                sources=tuple(sources),
                created=read.text(found, "created"),
                smartshoe_version=read.text(found, "smartshoe_version"),
                serial_number=read.text(found, "serial_number") if "serial_number" in found else "",
                extended=read.extended(found, "extended"),
                twin=read.extended(found, "twin"),
            )
        except InputError as error:
            raise error if str(error).startswith(read.path) else InputError(f"{read.path}: {error}") from error


def sensor_for(recording: Recording, calibration: Calibration) -> Channel:
    """The recording's only sensor channel, or among several the one named like the calibrated unit."""
    sensors = recording.sensors
    if len(sensors) <= 1:
        return recording.sensor
    named = [channel for channel in sensors if channel.name == calibration.unit]
    if not named:
        raise MissingChannelError(
            f"{recording.label} has no reading of the calibrated unit {calibration.unit or '(unnamed)'!r};"
            f" it has {', '.join(channel.name for channel in sensors)}: name one with --sensor"
        )
    return named[0]


def calibration_from(given: Any, argument: str = "calibration") -> Calibration:
    """``given`` if it is a `Calibration`, or the one in the file at that path.

    Raises `UsageError` for anything else.
    """
    if isinstance(given, Calibration):
        return given
    if isinstance(given, (str, os.PathLike)):
        return Calibration.load(Path(given))
    raise UsageError(f"{argument} is of type {type(given).__name__}: give a Calibration, or the path of one's file")


def compensate(recording: RecordingLike, calibration: Calibration | str | os.PathLike[str]) -> Array:
    """Force of a unit from its reading: ``smartshoe compensate`` as a function.

    Parameters
    ----------
    recording
        A `Recording`, the path of a readable file, or a DataFrame with a plain table's columns.
    calibration
        The unit's, or the path of its file.

    Returns
    -------
    numpy.ndarray
        (n,) force in N, compression positive, finite at every sample: the numbers of `compensated`, which keeps them
        beside the other channels.

    Raises
    ------
    MissingChannelError
        Where the recording has no reading of the unit.
    UnitError
        Where the reading is of another quantity than the calibration's.

    Examples
    --------
    >>> import smartshoe
    >>> from smartshoe.units import MILLIBAR
    >>> toe = smartshoe.Calibration(a1=0.2, b0=5.0, b1=1.1, reading_unit=MILLIBAR, unit="left_toe")
    >>> still = smartshoe.Recording.from_arrays(time_s=[0.0, 0.01, 0.02], pressure_mbar=[20.0, 20.0, 20.0])
    >>> smartshoe.compensate(still, toe).round(6).tolist()  # a load that lasts: b1/a1 times its reading
    [110.0, 110.0, 110.0]
    """
    return compensated(recording, calibration)[ESTIMATE_NAME].si


def compensated(recording: RecordingLike, calibration: Calibration | str | os.PathLike[str]) -> Recording:
    """``recording`` with the channel ``force_estimate`` in N (column ``force_estimate_n``), finite at every sample.

    On an even time base the bilinear filter runs at the recording's rate; on an uneven one the exact response to
    straight lines between samples is used. A missing reading repeats the last one; ``notes`` count them. Raises
    `MissingChannelError` without a reading of the unit, `UnitError` where its quantity is not the calibration's.
    """
    recording, calibration = recording_of(recording), calibration_from(calibration)
    channel = sensor_for(recording, calibration)
    if channel.unit != calibration.reading_unit and channel.unit.quantity != calibration.reading_unit.quantity:
        raise UnitError(
            f"{recording.label}: {channel.name} is in {channel.unit.symbol}, the calibration is for"
            f" {calibration.reading_unit.symbol}: use a calibration of this kind of reading"
        )
    readings = channel.in_unit(calibration.reading_unit)
    step = steps(recording.time_s)
    notes: list[str] = []
    if isinstance(step, float):
        rate_hz = 1.0 / step if len(recording) > 1 else calibration.sample_rate_hz
        force_n = calibration.compensator(rate_hz).apply(readings)
    elif calibration.extended is not None:
        force_n, rate_hz = _on_even_steps(recording.time_s, readings, calibration)
        notes.append(
            f"the steps are uneven: readings were set on an even grid of {rate_hz:.6g} Hz, and forces back from it"
        )
    else:
        force_n = simulate(
            calibration.a1, calibration.b0, calibration.b1, readings - calibration.offset, recording.time_s
        )
        notes.append("the steps are uneven: compensated with the exact response for straight lines between samples")
    missing = int(np.count_nonzero(~channel.present))
    if missing:
        notes.append(f"{missing} missing readings of {channel.name} were held at the last value for {ESTIMATE_NAME}")
    if calibration.extended is not None:
        notes += _limits(calibration, rate_hz)
    estimate = Channel.from_values(ESTIMATE_NAME, force_n, NEWTON, "auxiliary")
    return recording.with_channel(estimate).noted(*notes)


def _limits(calibration: Calibration, rate_hz: float) -> list[str]:
    """What the extended filter cannot remove from the force, one sentence per effect."""
    filter_ = calibration.compensator(rate_hz)
    if not isinstance(filter_, ExtendedCompensator):
        return []
    return [f"{name} is not compensated: {says}" for name, says in filter_.not_inverted.items()] + [
        f"{name}: {says}" for name, says in filter_.cautions.items()
    ]


def _on_even_steps(time_s: Array, readings: Array, calibration: Calibration) -> tuple[Array, float]:
    """Force (n,) at uneven ``time_s`` (n,), computed on an even grid of the median step.

    Also returns the grid's rate.
    """
    step_s = float(np.median(np.diff(time_s)))
    even_s = time_s[0] + step_s * np.arange(int(np.ceil((time_s[-1] - time_s[0]) / step_s)) + 1)
    present = np.isfinite(readings)
    if not present.any():
        return np.zeros(readings.size), 1.0 / step_s
    held = np.interp(even_s, time_s[present], readings[present])
    force_n = calibration.compensator(1.0 / step_s).apply(held)
    return np.interp(time_s, even_s, force_n), 1.0 / step_s


def extended_calibration(
    model: ExtendedModel,
    *,
    unit: str = "",
    serial_number: str = "",
    parameters: Mapping[str, Parameter] | None = None,
    covariance: tuple[tuple[float, ...], ...] = (),
    load_range_n: tuple[float, float] | None = None,
    sample_rate_hz: float = 100.0,
    created: str = "",
) -> Calibration:
    """The calibration that holds ``model``, with its linear part as a1, b0, b1, offset and delay.

    From p/f = (s + a)/((1 + kappa) s + a) of the model and reading = gain p: a1 = a, b0 = (1 + kappa) F/(G R) and b1 =
    a F/(G R). F/(G R), the full-scale load over gain times full-scale reading, is in N per reading unit and is also the
    calibration's ``scale``. ``parameters`` and ``covariance`` belong together, as in `Calibration`.
    """
    from smartshoe.version import __version__

    newton_per_reading = model.full_scale_load_n / (model.gain * model.full_scale_reading)
    shift = sum(float(part.values[0]) for part in model.parts if part.effect.shifts == "reading")
    return Calibration(
        a1=model.relaxation_rate_per_s,
        b0=(1.0 + model.relaxing_share) * newton_per_reading,
        b1=model.relaxation_rate_per_s * newton_per_reading,
        reading_unit=find_unit(model.reading_unit) or declared(model.reading_unit),
        offset=shift * model.gain * model.full_scale_reading,
        unit=unit,
        parameters=dict(parameters or {}),
        covariance=covariance,
        scale=newton_per_reading,
        delay_s=sum(part.effect.delay_s(part.values) for part in model.parts),
        load_range_n=load_range_n or (0.0, model.full_scale_load_n),
        sample_rate_hz=sample_rate_hz,
        created=created,
        smartshoe_version=__version__,
        serial_number=serial_number,
        extended=model,
    )
