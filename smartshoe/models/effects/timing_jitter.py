"""Samples taken a little early or late, each by its own error."""

from __future__ import annotations

from dataclasses import replace
from math import sqrt

import numpy as np

from smartshoe.arrays import Array
from smartshoe.display import rounded
from smartshoe.models.effects._sensor_evidence import (
    ONE_SIDED,
    SLOPE,
    NoiseEffect,
    SensorEvidence,
    Waveformless,
    growing_noise,
    variance_score,
)
from smartshoe.models.effects.effect import Conditions
from smartshoe.models.effects.exposure import by
from smartshoe.signals.noise import UNIFORM_SD


class TimingJitter(Waveformless, NoiseEffect):
    """A random error of each sample's time: noise of the size abs(P') times the jitter."""

    name, family, stage, place = "timing_jitter", "noise", "logger", "logger"
    says = "the noise grows with the reading's slope: fast ramps are noisy, holds are not"
    exposed_by = by("rates")
    separated_by = {
        "heteroscedastic_noise": by("holds"),
    }
    imitated_by = frozenset({"quantisation"})  # an error on ramps and none on holds, as uneven as the grid's steps

    def evidence(self, residual: Array, conditions: Conditions, prediction: Array) -> SensorEvidence | None:
        """Whether the variance of ``residual`` grows with the slope of ``prediction``; growth with size fitted apart.

        None also where another noise may be why (`_found`).
        """
        found = _found(residual, prediction, conditions.step_s)
        if found is None:
            return None
        value, strength, sd_s = found
        says = (
            f"the noise grows with the slope of the reading, as from {rounded(1e3 * sd_s)} ms of jitter in the sampling"
        )
        return SensorEvidence("log_variance_on_slope", value, ONE_SIDED, says, strength)


def jitter_s(residual: Array, prediction: Array, sample_time_s: float) -> float:
    """Standard deviation of the sampling time in s by the same test; 0 where it finds nothing."""
    found = _found(residual, prediction, sample_time_s)
    return found[2] if found is not None else 0.0


def _found(residual: Array, prediction: Array, sample_time_s: float) -> tuple[float, float, float] | None:
    """Score, strength, and the jitter's standard deviation in s; None where something else may be why.

    1. A time stamp leaves as much open: a sample may lie anywhere within its interval.
    2. The variance grows with the size itself, and not with its square: beside that the slope explains nothing more.
    """
    found = growing_noise(residual, prediction, sample_time_s, SLOPE)
    if found is None:
        return None
    value, strength, local = found
    sd_s = strength / sqrt(float(local.slope_squared.max()))
    beside_size, growth = variance_score(replace(local, pressure_squared=np.sqrt(local.pressure_squared)), SLOPE)
    is_else = sd_s < UNIFORM_SD * sample_time_s or beside_size <= ONE_SIDED or growth <= 0.0
    return None if is_else else (value, strength, sd_s)
