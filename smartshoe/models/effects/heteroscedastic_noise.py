"""Noise that grows with the reading."""

from __future__ import annotations

import numpy as np

from smartshoe.arrays import Array
from smartshoe.display import percent
from smartshoe.models.effects._sensor_evidence import (
    ONE_SIDED,
    PRESSURE,
    NoiseEffect,
    SensorEvidence,
    Waveformless,
    growing_noise,
)
from smartshoe.models.effects.effect import Conditions
from smartshoe.models.effects.exposure import by


class HeteroscedasticNoise(Waveformless, NoiseEffect):
    """Noise whose variance has a part in proportion to the pressure's square (a noisy supply, a noisy gain)."""

    name, family, stage, place = "heteroscedastic_noise", "noise", "sensor", "sensor"
    says = "the noise grows with the reading, at rest of the load as on ramps"
    exposed_by = by("holds")
    separated_by = {
        "timing_jitter": by("holds"),
    }
    imitated_by = frozenset({"quantisation"})  # an error on ramps and none on holds, as uneven as the grid's steps

    def evidence(self, residual: Array, conditions: Conditions, prediction: Array) -> SensorEvidence | None:
        """Whether the variance of ``residual`` grows with ``prediction``; growth with its slope is fitted apart.

        So is noise of the load, where what grows is no louder than that: it is left in the steep and bent parts of the
        load, where a walk's reading is high.
        """
        found = growing_noise(residual, prediction, conditions.step_s, PRESSURE)
        if found is not None and found[1] <= _brought_by_load(conditions, prediction):
            found = growing_noise(residual, prediction, conditions.step_s, PRESSURE, conditions.load_noise_left)
        if found is None:
            return None
        value, strength, _ = found
        says = f"the noise grows with the reading: {percent(strength)} of full scale are added where it is largest"
        return SensorEvidence("log_variance_on_pressure", value, ONE_SIDED, says, strength)


def _brought_by_load(conditions: Conditions, prediction: Array) -> float:
    """Standard deviation of the load's own noise in a ``prediction`` (n,), where all of it is left; 0 if not known."""
    left, span = conditions.load_noise_left, float(np.ptp(conditions.load))
    if left is None or span == 0.0:
        return 0.0
    return conditions.load_noise / float(np.sqrt(left.mean())) * float(np.ptp(prediction)) / span
