"""Noise that grows with the pressure."""

from __future__ import annotations

from math import sqrt

import numpy as np

from smartshoe.models.effects._sensor_evidence import (
    ONE_SIDED,
    PRESSURE,
    Evidence,
    Waveformless,
    keeps_rhythm,
    local_variance,
    variance_score,
)
from smartshoe.models.effects.effect import Array, Conditions, Effect


class HeteroscedasticNoise(Waveformless, Effect):
    """Noise whose variance has a part in proportion to the pressure's square (a noisy supply, a noisy gain)."""

    name, family, stage, place = "heteroscedastic_noise", "noise", "sensor", "sensor"
    says = "the noise grows with the pressure, at rest of the load as on ramps"
    exposed_by = frozenset({"holds"})
    separated_by = {"timing_jitter": "holds at several loads"}


def evidence(residual: Array, conditions: Conditions, prediction: Array, sample_time_s: float) -> Evidence | None:
    """Whether the variance of ``residual`` (n,) grows with ``prediction`` (n,), its growth with the slope apart.

    Both in shares of full scale, ``sample_time_s`` apart. None where it does not, at one false alarm in 1000.
    """
    local = local_variance(residual, prediction, sample_time_s)
    if local is None:
        return None
    value, growth = variance_score(local, PRESSURE)
    if value <= ONE_SIDED or growth <= 0.0 or keeps_rhythm(residual, np.abs(prediction)):
        return None
    strength = sqrt(growth)
    says = f"the noise grows with pressure: {100 * strength:.2g} % of full scale are added at the largest pressure"
    return Evidence("log_variance_on_pressure", value, ONE_SIDED, says, strength)
