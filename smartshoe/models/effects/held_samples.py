"""Readings that stand still while the load moves."""

from __future__ import annotations

from smartshoe.models.effects._sensor_evidence import Waveformless
from smartshoe.models.effects.effect import Effect
from smartshoe.models.effects.exposure import by


class HeldSamples(Waveformless, Effect):
    """A logger that repeats its last value when it misses a sample.

    Exact repeats under a moving load show it, with jumps after them. A coarse grid repeats values on slow ramps only.
    """

    name, family, stage, place = "held_samples", "data", "logger", "logger"
    says = "a reading repeats exactly while the load moves"
    exposed_by = by("rates")
    separated_by = {
        "dropouts": by("rates"),
        "quantisation": by("rates"),
    }
