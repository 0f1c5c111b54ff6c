"""The quantities of a unit's drift that are drawn, their titles, and their smallest scale."""

from __future__ import annotations

from smartshoe.calibration.store.drift import Drift

SHOWN = ("static_gain", "a1", "b0", "b1", "k1", "k2", "zero")
TITLES = {
    "static_gain": "static gain",
    "a1": "relaxation rate a1",
    "b0": "fast gain b0",
    "zero": "zero (reading at no load)",
}
LEAST_SPAN = 0.004  # of a parameter's size: smallest span of its axis, so that a constant parameter looks constant


def shown_names(drift: Drift) -> list[str]:
    """The names of the quantities that are drawn, in their order."""
    return [name for name in SHOWN if name in drift.trends] + [n for n in drift.trends if n not in SHOWN and n != "c"]
