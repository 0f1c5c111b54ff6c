"""Readings that are lost for a while."""

from __future__ import annotations

from smartshoe.models.effects._sensor_evidence import Waveformless
from smartshoe.models.effects.effect import Effect
from smartshoe.models.effects.exposure import by


class Dropouts(Waveformless, Effect):
    """A contact or packet that is lost for a while.

    Runs that fall to the unloaded unit's value show it, with edges of one sample.
    """

    name, family, stage, place = "dropouts", "data", "logger", "logger"
    says = "the reading falls to its unloaded value, or to nothing, while the load stays"
    exposed_by = by("repeats")
    separated_by = {
        "dead_band": by("repeats"),
        "held_samples": by("rates"),
        "spikes": by("holds"),
    }
