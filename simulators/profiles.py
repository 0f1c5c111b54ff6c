"""What a foot does to its shoe: loads of the four regions against time, for standing and for walking.

Simple on purpose: the order of contact (heel, meta4, meta1, toe) and the share of body weight are right, the
waveforms are raised cosines. *Left out:* running, shear, the swing's residual pressure, fatigue.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from smartshoe.recording import REGIONS

Array = NDArray[np.float64]

BODY_WEIGHT_N = 519.4  # 53 kg, Chinimilli 2016, Section VI
STEP_ON_S = 0.5
STANDING_SHARE = {"toe": 0.10, "meta1": 0.17, "meta4": 0.18, "heel": 0.55}
# Begin, peak and end of each region's load as shares of stance, and its largest load as a share of body weight.
WALKING = {
    "heel": (0.00, 0.20, 0.62, 0.95),
    "meta4": (0.08, 0.55, 0.92, 0.45),
    "meta1": (0.16, 0.68, 0.96, 0.50),
    "toe": (0.40, 0.80, 1.00, 0.40),
}


@dataclass(frozen=True, slots=True)
class Gait:
    """A foot's gait: ``coverage`` is the share of the load that passes through the units."""

    body_weight_n: float = BODY_WEIGHT_N
    coverage: float = 1.0
    cadence_steps_per_min: float = 110.0
    stance_share: float = 0.62
    stride_time_cv: float = 0.018
    load_cv: float = 0.03
    sway_cv: float = 0.02
    first_contact_s: float = 0.5


def stand(gait: Gait, time_s: Array, rng: np.random.Generator) -> Mapping[str, Array]:
    """Load (n,) in N of each region of one foot, half of body weight, with slow sway between forefoot and heel.

    The foot steps on within half a second from ``first_contact_s``, so that the unloaded reading is seen first.
    """
    phase = rng.uniform(0.0, 2.0 * np.pi, size=3)
    frequency_hz = np.array([0.11, 0.27, 0.53])
    sway = gait.sway_cv * np.sum(np.sin(2.0 * np.pi * np.outer(time_s, frequency_hz) + phase), axis=1)
    stepped_on = np.clip((time_s - gait.first_contact_s) / STEP_ON_S, 0.0, 1.0)
    half_n = 0.5 * gait.body_weight_n * gait.coverage * stepped_on
    heel = STANDING_SHARE["heel"] * (1.0 + sway)
    forefoot = (1.0 - heel) / (1.0 - STANDING_SHARE["heel"])
    return {r: half_n * (heel if r == "heel" else STANDING_SHARE[r] * forefoot) for r in REGIONS}


def strikes(gait: Gait, duration_s: float, rng: np.random.Generator) -> Array:
    """Times (m,) in s of the foot's heel strikes, the last one at or after ``duration_s``."""
    mean_s = 120.0 / gait.cadence_steps_per_min
    count = int(duration_s / mean_s * 1.2) + 4
    strides_s = mean_s * np.maximum(1.0 + gait.stride_time_cv * rng.standard_normal(count), 0.5)
    times_s = gait.first_contact_s + np.concatenate([[0.0], np.cumsum(strides_s)])
    return times_s[: int(np.searchsorted(times_s, duration_s)) + 1]


def walk(gait: Gait, time_s: Array, rng: np.random.Generator) -> Mapping[str, Array]:
    """Load (n,) in N of each region of one foot that walks; zero before the first contact and in swing."""
    begins_s = strikes(gait, float(time_s[-1]) if time_s.size else 0.0, rng)
    stride_s = np.diff(begins_s, append=begins_s[-1] + 120.0 / gait.cadence_steps_per_min)
    stride = np.searchsorted(begins_s, time_s, side="right") - 1
    moving = stride >= 0
    stride = np.maximum(stride, 0)
    stance = (time_s - begins_s[stride]) / (gait.stance_share * stride_s[stride])
    loads: dict[str, Array] = {}
    for region in REGIONS:
        begin, peak, end, share = WALKING[region]
        height_n = np.maximum(1.0 + gait.load_cv * rng.standard_normal(begins_s.size), 0.0)
        height_n *= share * gait.body_weight_n * gait.coverage
        side = np.where(stance < peak, (stance - begin) / (peak - begin), (end - stance) / (end - peak))
        pulse = 0.5 - 0.5 * np.cos(np.pi * np.clip(side, 0.0, 1.0))
        loads[region] = np.where(moving, height_n[stride] * pulse, 0.0)
    return loads


PROFILES = {"stand": stand, "walk": walk}
