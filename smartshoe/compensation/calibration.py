"""`Calibration`: what was identified of a unit, as a file; and the force that it gives for a recording."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from smartshoe.atomic import write_text
from smartshoe.compensation.compensator import Compensator
from smartshoe.errors import InputError, MissingChannelError, UnitError
from smartshoe.models.first_order import simulate, steps
from smartshoe.models.parameter import Parameter, finite_or_none
from smartshoe.recording import Channel, Recording
from smartshoe.units import NEWTON, Unit, declared, find_unit

SCHEMA = "smartshoe.calibration/1"
ESTIMATE_NAME = "force_estimate"


@dataclass(frozen=True)
class Calibration:
    """A unit's identified model: force = (b0 s + b1)/(s + a1) (reading - offset), Chinimilli 2016 (13).

    ``offset`` in ``reading_unit``; ``parameters`` and ``covariance`` (in their order) as identified; ``scale`` in N
    per reading unit; ``load_range_n`` and ``rate_range_n_per_s`` what was seen; ``sources`` name and sha256 of the
    files; ``created`` an ISO date that the caller gives, '' where not known.
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

    def __post_init__(self) -> None:
        for key in ("a1", "b0", "b1", "offset", "scale", "delay_s", "sample_rate_hz"):
            if not math.isfinite(getattr(self, key)):
                raise InputError(f"calibration of {self.unit or 'a unit'}: {key} is not finite: identify the unit anew")
        if self.a1 <= 0 or self.sample_rate_hz <= 0:
            key = "a1" if self.a1 <= 0 else "sample_rate_hz"
            raise InputError(
                f"calibration of {self.unit or 'a unit'}: {key} is {getattr(self, key):g}, it must be above 0:"
                " identify the unit anew"
            )

    def compensator(self, sample_rate_hz: float | None = None) -> Compensator:
        """The filter at ``sample_rate_hz``; the calibration's own rate where none is given."""
        return Compensator(
            self.a1,
            self.b0,
            self.b1,
            offset=self.offset,
            sample_rate_hz=self.sample_rate_hz if sample_rate_hz is None else sample_rate_hz,
            reading_unit=self.reading_unit,
        )

    def to_dict(self) -> dict[str, Any]:
        """The file's object, schema smartshoe.calibration/1; no NaN, no infinity."""
        return {
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

    def save(self, path: Path | str) -> None:
        """Write the calibration as JSON, whole or not at all."""
        write_text(path, json.dumps(self.to_dict(), indent=1, allow_nan=False, ensure_ascii=False) + "\n")

    @classmethod
    def load(cls, path: Path | str) -> Calibration:
        """Read a calibration; raises `InputError` naming file and key where it is none or is damaged."""
        try:
            text = Path(path).read_text(encoding="utf-8")
        except UnicodeDecodeError as error:
            raise InputError(f"{path} is no calibration (not text): give a file that identify wrote") from error
        except OSError as error:
            raise InputError(f"{path} cannot be read ({error.strerror}): give a calibration file") from error
        try:
            found = json.loads(text, parse_constant=_refuse_constant)
        except (ValueError, RecursionError) as error:
            raise InputError(
                f"{path} is truncated or no JSON ({error}): write it anew with identify --calibration"
            ) from error
        return cls._from_object(found, _Reader(str(path)))

    @classmethod
    def _from_object(cls, found: Any, read: _Reader) -> Calibration:
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
            )
        except InputError as error:
            raise error if str(error).startswith(read.path) else InputError(f"{read.path}: {error}") from error


@dataclass(frozen=True)
class _Reader:
    """Takes typed values out of a JSON object; a fault names file and key."""

    path: str

    def fault(self, key: str, what: str) -> InputError:
        return InputError(f"{self.path}: key '{key}' {what}: write the file anew with identify --calibration")

    def _get(self, found: Mapping[str, Any], key: str, above: str) -> Any:
        if key not in found:
            raise self.fault(above + key, "is missing")
        return found[key]

    def number(self, found: Mapping[str, Any], key: str, above: str = "") -> float:
        value = self._get(found, key, above)
        if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
            raise self.fault(above + key, f"is {value!r}, not a finite number")
        return float(value)

    def maybe(self, value: Any, key: str) -> float:
        if value is None:
            return math.nan
        return self.number({key: value}, key)

    def text(self, found: Mapping[str, Any], key: str) -> str:
        value = self._get(found, key, "")
        if not isinstance(value, str):
            raise self.fault(key, f"is {value!r}, not a text")
        return value

    def mapping(self, found: Mapping[str, Any], key: str, above: str = "") -> Mapping[str, Any]:
        value = self._get(found, key, above)
        if not isinstance(value, dict):
            raise self.fault(above + key, f"is {value!r}, not an object")
        return value

    def pair(self, found: Mapping[str, Any], key: str) -> tuple[float, float] | None:
        value = found.get(key)
        if value is None:
            return None
        if not isinstance(value, list) or len(value) != 2:
            raise self.fault(key, f"is {value!r}, not two numbers")
        return self.number({key: value[0]}, key), self.number({key: value[1]}, key)

    def parameter(self, found: Mapping[str, Any], name: str, above: str) -> Parameter:
        item = self.mapping(found, name, above)
        key = f"{above}{name}."
        interval = item.get("ci95")
        if not isinstance(interval, list) or len(interval) != 2:
            raise self.fault(key + "ci95", f"is {interval!r}, not two numbers")
        unit = item.get("unit")
        if not isinstance(unit, str):
            raise self.fault(key + "unit", f"is {unit!r}, not a text")
        low, high = (self.maybe(bound, key + "ci95") for bound in interval)
        return Parameter(self.number(item, "value", key), self.maybe(item.get("sd"), key + "sd"), (low, high), unit)


def _refuse_constant(text: str) -> float:
    raise ValueError(f"it holds {text}")


def _sensor_for(recording: Recording, calibration: Calibration) -> Channel:
    """The recording's one sensor, or of several the one that carries the calibrated unit's name."""
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


def compensate(recording: Recording, calibration: Calibration) -> Recording:
    """``recording`` with the channel ``force_estimate`` in N (column ``force_estimate_n``), finite at every sample.

    An even time base runs the bilinear filter at its own rate, an uneven one the exact response for straight lines
    between samples. Missing readings hold the last one; ``notes`` count them. Raises `MissingChannelError` without a
    reading of the unit, `UnitError` where its quantity is not the calibration's.
    """
    channel = _sensor_for(recording, calibration)
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
    else:
        force_n = simulate(
            calibration.a1, calibration.b0, calibration.b1, readings - calibration.offset, recording.time_s
        )
        notes.append("the steps are uneven: compensated with the exact response for straight lines between samples")
    missing = int(np.count_nonzero(~channel.present))
    if missing:
        notes.append(f"{missing} missing readings of {channel.name} were held at the last value for {ESTIMATE_NAME}")
    estimate = Channel.from_values(ESTIMATE_NAME, force_n, NEWTON, "auxiliary")
    return recording.with_channel(estimate).noted(*notes)
