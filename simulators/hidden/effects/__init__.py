"""The effects that can be hidden in a simulated unit: all of the catalogue under several laws, and some others.

One file per family lists its effects: to add a truth, add an entry there. `simulators.hidden.effects._registry`
describes an entry, `simulators.hidden.effects._law` how a further law acts.
"""

from __future__ import annotations

from simulators.hidden.effects import (
    asymmetry,
    cross_talk,
    data,
    dead_band,
    gain_drift,
    gas_heat,
    hysteresis,
    leak,
    noise,
    outside,
    rate,
    relaxation,
    saturation,
    softening,
    static_curve,
    tare,
    timing,
    zero,
)
from simulators.hidden.effects._law import Law, Surroundings, Warp
from simulators.hidden.effects._registry import SHARE_OF_RANGE, Draws, Hideable, Options, Subject, merged

_FAMILIES = (
    relaxation, leak, gas_heat, static_curve, dead_band, hysteresis, asymmetry, rate, softening, gain_drift, timing,
    zero, saturation, cross_talk, tare, noise, data, outside,
)  # fmt: skip

EFFECTS: dict[str, Hideable] = {effect.name: effect for family in _FAMILIES for effect in family.EFFECTS}
# The machine has no options for these; only a law produces them.
BY_LAW_ALONE: dict[str, Hideable] = {effect.name: effect for effect in outside.BY_LAW_ALONE}

__all__ = [
    "BY_LAW_ALONE", "EFFECTS", "SHARE_OF_RANGE", "Draws", "Hideable", "Law", "Options", "Subject", "Surroundings",
    "Warp", "merged",
]  # fmt: skip
