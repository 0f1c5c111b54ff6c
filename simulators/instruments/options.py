"""A scenario's options of a sensing unit and its logger; unknown keys and values out of bounds are errors.

The bladder's options are `simulators.plant.bladder_parameters.BladderParameters` themselves; the instruments' are in
practical units (mbar, percent) and are converted to SI here.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, PlainValidator, WithJsonSchema

from simulators.effects.bounds import Finite, NotNegative, Positive
from simulators.effects.logging import ReadingChannel
from simulators.effects.outside import SensorOddities
from simulators.effects.sensing import Curve, Limit, Noise, OutputDrift
from simulators.instruments import presets
from simulators.instruments.daq import LARGEST_ERROR_V, MyRioParameters
from simulators.instruments.sensor import HdiParameters
from simulators.plant.bladder_parameters import X_OVER_NRT, BladderParameters

MBAR_PA = 100.0


def _absolute_error(value: object) -> float | str:
    """A number or "drawn", checked here instead of by a union, so that pydantic's error names only the key."""
    if value == "drawn":
        return "drawn"
    if isinstance(value, int | float) and not isinstance(value, bool) and abs(value) <= LARGEST_ERROR_V:
        return float(value)
    raise ValueError(f"give 'drawn' or a number from -{LARGEST_ERROR_V} to {LARGEST_ERROR_V} V")


AbsoluteError = Annotated[
    float | Literal["drawn"],
    PlainValidator(_absolute_error),
    WithJsonSchema({"anyOf": [{"type": "number"}, {"const": "drawn"}]}),
]


class Options(BaseModel):
    """A table of a scenario; an unknown key is an error."""

    model_config = ConfigDict(extra="forbid")


class SensorOptions(Options):
    """Options of an HDI sensor; percentages are of the range."""

    range_mbar: Positive = 200.0
    noise_percent: NotNegative = 0.05
    lag_s: NotNegative = 0.001
    zero_offset_mbar: Finite = 0.0
    zero_drift_mbar_per_s: Finite = 0.0
    gain_error_percent: Annotated[float, Field(gt=-50, lt=50)] = 0.0
    over_range_percent: Annotated[float, Field(ge=0, le=12.5)] = 1.0
    bidirectional: bool = False
    second_lag_s: NotNegative = 0.0
    curve: Curve = Curve()
    drift: OutputDrift = OutputDrift()
    limit: Limit = Limit()
    noise: Noise = Noise()
    wander: SensorOddities = SensorOddities()

    def parameters(self) -> HdiParameters:
        """These options in SI units."""
        return HdiParameters(
            range_pa=self.range_mbar * MBAR_PA,
            noise_fraction=self.noise_percent / 100.0,
            lag_s=self.lag_s,
            zero_offset_pa=self.zero_offset_mbar * MBAR_PA,
            zero_drift_pa_per_s=self.zero_drift_mbar_per_s * MBAR_PA,
            gain_error_fraction=self.gain_error_percent / 100.0,
            over_range_fraction=self.over_range_percent / 100.0,
            bidirectional=self.bidirectional,
            second_lag_s=self.second_lag_s,
            curve=self.curve,
            drift=self.drift,
            limit=self.limit,
            noise=self.noise,
            wander=self.wander,
        )


class DaqOptions(Options):
    """Options of a myRIO; see `simulators.instruments.daq.MyRioParameters`."""

    sample_rate_hz: Annotated[float, Field(gt=0, le=100_000)] = 100.0
    bits: Annotated[int, Field(ge=4, le=24)] = 12
    absolute_error_v: AbsoluteError = 0.0
    load_absolute_error_v: AbsoluteError = 0.0
    load_full_scale_n: Positive = 1000.0
    load_zero_v: Annotated[float, Field(ge=0, lt=5)] = 0.1
    clock_offset_s: NotNegative = 0.0
    clock_skew: Annotated[float, Field(gt=-0.1, lt=0.1)] = 0.0
    jitter_s: NotNegative = 0.0
    reading: ReadingChannel = ReadingChannel()

    def parameters(self) -> MyRioParameters:
        """These options as the simulator's parameters."""
        return MyRioParameters(**dict(self))


class TwinOptions(Options):
    """A unit's own calibration in place of the bladder; see `simulators.instruments.twin`."""

    twin: str


class UnitOptions(Options):
    """Options of one unit of a shoe: the changes to its preset."""

    bladder: BladderParameters
    sensor: SensorOptions


def is_twin(options: Any) -> bool:
    """Whether a unit's options select its twin: ``bladder = {twin = "unit.json"}``."""
    bladder = options.get("bladder") if isinstance(options, dict) else None
    return isinstance(bladder, dict) and "twin" in bladder


def with_preset(unit: Any, options: Any) -> Any:
    """A unit's ``options`` laid over its preset's bladder and sensor; anything that is not a table is left to pydantic.

    Without ``effective_area_m2``, the area follows from the final k1 and range: 800 N at 85 % of the range.
    """
    if not isinstance(options, dict):
        return options
    unit = str(unit)
    base, sensor = presets.bladder(unit), options.get("sensor", {})
    if is_twin(options) and isinstance(sensor, dict):
        # Lag, membrane and offset are part of the fitted model.
        sensor = {"lag_s": 0.0, "bidirectional": True, **sensor}
        return {**options, "sensor": {"range_mbar": presets.sensor_range_pa(unit) / MBAR_PA, **sensor}}
    if isinstance(sensor, dict):
        sensor = {"range_mbar": presets.sensor_range_pa(unit) / MBAR_PA, **sensor}
    bladder = options.get("bladder", {})
    if isinstance(bladder, dict):
        bladder = {"k1": base.k1, "k2": base.k2, "c": base.c, **bladder}
        if "effective_area_m2" not in bladder:
            area = _area_of(bladder, sensor)
            if area is not None:
                bladder["effective_area_m2"] = area
    return {**options, "bladder": bladder, "sensor": sensor}


def _area_of(bladder: dict[str, Any], sensor: Any) -> float | None:
    """The preset's rule for the area; None where the values it needs are wrong, which pydantic then reports."""
    try:
        k1, range_mbar = float(bladder["k1"]), float(sensor["range_mbar"])
        x_over_nrt = float(bladder.get("x_over_nrt", X_OVER_NRT))
        area = presets.effective_area_m2(k1, range_mbar * MBAR_PA, x_over_nrt)
    except (TypeError, ValueError, KeyError, ZeroDivisionError):
        return None
    return area if area > 0 else None
