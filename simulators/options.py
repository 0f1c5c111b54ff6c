"""What a scenario may say of simulated devices, checked by pydantic: unknown keys and values out of bounds are errors.

The bladder's options are `simulators.bladder_parameters.BladderParameters` themselves; the instruments' are in the
units that a person writes (mbar, percent) and become SI here.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, PlainValidator, WithJsonSchema

from simulators import presets
from simulators.bladder_parameters import X_OVER_NRT, BladderParameters
from simulators.bounds import Finite, NotNegative, Positive
from simulators.daq import LARGEST_ERROR_V, MyRioParameters
from simulators.effects.logging import ReadingChannel
from simulators.effects.outside import SensorOddities
from simulators.effects.room import NeighbourUnit, Room
from simulators.effects.sensing import Curve, Limit, Noise, OutputDrift
from simulators.gait.person import BODY_WEIGHT_N
from simulators.instron import InstronParameters
from simulators.profiles import Gait
from simulators.sensor import HdiParameters
from simulators.shoe import ShoeParameters
from smartshoe.gate import limits

MBAR_PA = 100.0


def _absolute_error(value: object) -> float | str:
    """A plain check instead of a union, so that pydantic's error names the key and nothing of its own."""
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


def _within_limits(duration_s: float) -> float:
    if duration_s > limits().duration_s:
        raise ValueError(f"give {limits().duration_s} s at most, or raise the limit with --limit duration_s=...")
    return duration_s


class _Options(BaseModel):
    model_config = ConfigDict(extra="forbid")


class SensorOptions(_Options):
    """An HDI sensor; percentages are of the range."""

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
        """The same in SI."""
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


class DaqOptions(_Options):
    """A myRIO; see `simulators.daq.MyRioParameters`."""

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
        """The same as the simulator takes it."""
        return MyRioParameters(**dict(self))


class MachineOptions(_Options):
    """An Instron with one unit on its anvil."""

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
        """The machine's own part."""
        return InstronParameters(**{k: v for k, v in self if k not in ("unit", "bladder", "sensor", "daq")})


class TwinOptions(_Options):
    """A unit's own calibration in the bladder's place; see `simulators.twin`."""

    twin: str


class TwinMachineOptions(MachineOptions):
    """An Instron with a twin on its anvil."""

    bladder: TwinOptions  # type: ignore[assignment]


class UnitOptions(_Options):
    """One unit of a shoe: what differs from its preset."""

    bladder: BladderParameters
    sensor: SensorOptions


class ShoeOptions(_Options):
    """A shoe of four units, or both; ``units`` maps a unit's name (``left_toe``) to what differs from its preset."""

    side: Literal["left", "right", "both"] = "left"
    units: dict[str, UnitOptions] = Field(default_factory=dict)
    sample_rate_hz: Annotated[float, Field(ge=1, le=2000)] = 200.0
    duration_s: Annotated[Positive, AfterValidator(_within_limits)] = 60.0
    block_samples: Annotated[int, Field(ge=1, le=100_000)] = 20
    adc_bits: Annotated[int, Field(ge=4, le=24)] = 12
    clock_skew_ppm: Annotated[float, Field(ge=-1000, le=1000)] | None = None
    clock_offset_s: NotNegative | None = None
    body_weight_n: Positive = BODY_WEIGHT_N
    coverage: Annotated[float, Field(gt=0, le=1)] = 1.0
    outside: Literal["midfoot", "even"] = "midfoot"
    speed_m_per_s: Annotated[float, Field(ge=0.3, le=8)] | None = None
    cadence_steps_per_min: Annotated[float, Field(ge=20, le=250)] | None = None
    stance_share: Annotated[float, Field(gt=0.1, lt=0.95)] | None = None
    stride_time_cv: Annotated[float, Field(ge=0, le=0.2)] | None = None
    load_cv: Annotated[float, Field(ge=0, le=0.5)] | None = None
    load_asymmetry: Annotated[float, Field(ge=-0.5, le=0.5)] = 0.0
    time_asymmetry: Annotated[float, Field(ge=-0.5, le=0.5)] = 0.0
    turning: Annotated[float, Field(ge=-1, le=1)] = 0.0
    sway_cv: Annotated[float, Field(ge=0, le=0.2)] = 0.03
    first_contact_s: NotNegative = 0.5

    def parameters(self) -> ShoeParameters:
        """The stream."""
        return ShoeParameters(**self.model_dump(include=set(ShoeParameters.__dataclass_fields__)))

    def gait(self) -> Gait:
        """The foot."""
        return Gait(**self.model_dump(include=set(Gait.__dataclass_fields__)))


def is_twin(options: Any) -> bool:
    """Whether a unit's options ask for its twin: ``bladder = {twin = "unit.json"}``."""
    bladder = options.get("bladder") if isinstance(options, dict) else None
    return isinstance(bladder, dict) and "twin" in bladder


def with_preset(unit: Any, options: Any) -> Any:
    """A unit's ``options`` with its preset's bladder and sensor under them; what is no table is left to pydantic.

    Without ``effective_area_m2``, the area follows from the final k1 and range: 800 N at 85 % of the range.
    """
    if not isinstance(options, dict):
        return options
    unit = str(unit)
    base, sensor = presets.bladder(unit), options.get("sensor", {})
    if is_twin(options) and isinstance(sensor, dict):
        # Lag, membrane and offset are in what was fitted.
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
    """The preset's rule for the area; None where the values it needs are wrong, which pydantic then says."""
    try:
        k1, range_mbar = float(bladder["k1"]), float(sensor["range_mbar"])
        x_over_nrt = float(bladder.get("x_over_nrt", X_OVER_NRT))
        area = presets.effective_area_m2(k1, range_mbar * MBAR_PA, x_over_nrt)
    except (TypeError, ValueError, KeyError, ZeroDivisionError):
        return None
    return area if area > 0 else None
