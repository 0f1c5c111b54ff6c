"""Noise that grows with the reading."""

from __future__ import annotations

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
        """Whether the variance of ``residual`` grows with ``prediction``; growth with its slope is fitted apart."""
        found = growing_noise(residual, prediction, conditions.step_s, PRESSURE, conditions.load_noise_left)
        if found is None:
            return None
        value, strength, _ = found
        says = f"the noise grows with the reading: {percent(strength)} of full scale are added where it is largest"
        return SensorEvidence("log_variance_on_pressure", value, ONE_SIDED, says, strength)
