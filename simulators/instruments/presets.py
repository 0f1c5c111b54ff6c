"""The paper's units: Table 1 of Chinimilli 2016 (c = 1), with areas that put 800 N at 85 % of the sensor's range.

Table 1 has no metatarsal units; they borrow the heel's constants of their side, as stand-ins.
"""

from __future__ import annotations

from simulators.instruments.sensor import HdiParameters
from simulators.plant.bladder_parameters import X_OVER_NRT, BladderParameters

FULL_SCALE_N = 800.0
SHARE_OF_RANGE = 0.85

TABLE_1: dict[str, tuple[float, float]] = {  # k1, k2 in N/m
    "right_toe": (1.873, 0.119),
    "right_heel": (2.045, 0.159),
    "left_toe": (1.341, 0.215),
    "left_heel": (2.025, 0.316),
}
STAND_INS = {f"{side}_{meta}": f"{side}_heel" for side in ("left", "right") for meta in ("meta1", "meta4")}


def sensor_range_pa(unit: str) -> float:
    """The sensor's range in Pa: 100 mbar at the toe, 200 mbar elsewhere (Chinimilli 2016, Section II)."""
    return 10_000.0 if unit.endswith("toe") else 20_000.0


def effective_area_m2(k1: float, range_pa: float, x_over_nrt: float = X_OVER_NRT) -> float:
    """Area that puts a held 800 N at 85 % of ``range_pa``, from the static gain 1/(A (1 + k1 x0^2/(nRT)))."""
    return FULL_SCALE_N / (SHARE_OF_RANGE * range_pa * (1.0 + k1 * x_over_nrt))


def bladder(unit: str) -> BladderParameters:
    """A unit's bladder; names that the paper lacks get the left toe's constants."""
    k1, k2 = TABLE_1.get(STAND_INS.get(unit, unit), TABLE_1["left_toe"])
    return BladderParameters(k1, k2, effective_area_m2=effective_area_m2(k1, sensor_range_pa(unit)))


def sensor(unit: str) -> HdiParameters:
    """A unit's sensor, with the range of its place."""
    return HdiParameters(range_pa=sensor_range_pa(unit))
