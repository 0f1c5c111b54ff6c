"""Simulated trials, and the calibrations that their units would have on a perfect machine."""

from __future__ import annotations

from functools import cache

import numpy as np

from simulators.instruments import presets
from simulators.people import Person, Run, Stand, Tiptoe, Trial, Walk, trial
from simulators.plant.bladder_parameters import X_OVER_NRT
from smartshoe.calibration import Calibration
from smartshoe.recording import REGIONS
from smartshoe.units import MILLIBAR

BODY_WEIGHT_N = 519.4
RATE_HZ = 200.0
ACTIVITIES = {
    "slow walk": Walk(speed_m_per_s=0.6),
    "walk": Walk(speed_m_per_s=1.3),
    "fast walk": Walk(speed_m_per_s=2.0),
    "run": Run(),
    "stand": Stand(),
    "tiptoe": Tiptoe(),
}


@cache
def made(
    activity: str = "walk",
    duration_s: float = 60.0,
    *,
    seed: int = 1,
    sensors: bool = False,
    body_weight_n: float = BODY_WEIGHT_N,
    coverage: float = 0.8,
    first_contact_s: float = 3.0,
) -> Trial:
    """A trial; ``first_contact_s`` of rest before it."""
    return trial(
        Person(body_weight_n=body_weight_n), ACTIVITIES[activity], duration_s, np.random.default_rng(seed),
        sensors=sensors, coverage=coverage, first_contact_s=first_contact_s,
    )  # fmt: skip


def foot_n(found: Trial, side: str) -> np.ndarray:
    """True loads (n, 4) of one foot's units."""
    return np.column_stack([found.unit_n[f"{side}_{region}"] for region in REGIONS])


def feet_n(found: Trial) -> dict[str, np.ndarray]:
    """True load (n,) of each foot's units together."""
    return {side: foot_n(found, side).sum(axis=1) for side in ("left", "right")}


def calibration(unit: str) -> Calibration:
    """What the unit's bladder is made as: Chinimilli 2016, (4) and (13), with its area."""
    bladder = presets.bladder(unit)
    area = bladder.effective_area_m2 * MILLIBAR.scale
    k1, k2 = bladder.k1, bladder.k2
    return Calibration(
        a1=k2,
        b0=area * (1.0 + (k1 + k2) * X_OVER_NRT),
        b1=area * k2 * (1.0 + k1 * X_OVER_NRT),
        reading_unit=MILLIBAR,
        unit=unit,
        load_range_n=(0.0, 800.0),
        created="2026-01-05",
    )


def calibrations() -> list[Calibration]:
    return [calibration(f"{side}_{region}") for side in ("left", "right") for region in REGIONS]
