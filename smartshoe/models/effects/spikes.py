"""Readings that are far off for a sample or two."""

from __future__ import annotations

from smartshoe.models.effects._sensor_evidence import Waveformless
from smartshoe.models.effects.effect import Effect
from smartshoe.models.effects.exposure import by


class Spikes(Waveformless, Effect):
    """A rare large error of one or two samples (interference, a bad frame).

    A second difference that stands alone shows it. One spike spoils a reference that is taken from a single sample.
    """

    name, family, stage, place = "spikes", "noise", "logger", "logger"
    says = "single readings far off their neighbours, rarely and at no fixed load"
    separated_by = {
        "dropouts": by("holds"),
        "hum": by("repeats"),
    }
