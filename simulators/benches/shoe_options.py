"""A scenario's options of a worn shoe; unknown keys and values out of bounds are errors."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import AfterValidator, Field

from simulators.benches.shoe import ShoeParameters
from simulators.effects.bounds import NotNegative, Positive
from simulators.instruments.options import Options, UnitOptions
from simulators.people.person import BODY_WEIGHT_N
from simulators.people.profiles import Gait
from smartshoe.files.gate import limits


def _within_limits(duration_s: float) -> float:
    if duration_s > limits().duration_s:
        raise ValueError(f"give {limits().duration_s} s at most, or raise the limit with --limit duration_s=...")
    return duration_s


class ShoeOptions(Options):
    """Options of a shoe of four units, or both shoes.

    ``units`` maps a unit's name (``left_toe``) to changes of its preset.
    """

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
        """The parameters of the stream."""
        return ShoeParameters(**self.model_dump(include=set(ShoeParameters.__dataclass_fields__)))

    def gait(self) -> Gait:
        """The gait of the person in the shoe."""
        return Gait(**self.model_dump(include=set(Gait.__dataclass_fields__)))
