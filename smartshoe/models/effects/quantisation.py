"""Readings on a grid of evenly spaced values."""

from __future__ import annotations

from smartshoe.models.effects._sensor_evidence import Waveformless
from smartshoe.models.effects.effect import Effect
from smartshoe.models.effects.exposure import by


class Quantisation(Waveformless, Effect):
    """A converter with few bits, or a file written with few digits.

    Equal steps between the values that occur show it. With noise below half a step its error is no longer random.
    """

    name, family, stage, place = "quantisation", "data", "logger", "logger"
    says = "readings lie on a grid of evenly spaced values"
    exposed_by = by("holds")
    separated_by = {
        "coloured_noise": by("holds"),
        "held_samples": by("rates"),
    }
