"""One vocabulary for what shows an effect and what tells two apart: of effects, protocols and the next experiment."""

from __future__ import annotations

from types import MappingProxyType
from typing import Literal, get_args

Exposure = Literal[
    "holds", "rests", "rates", "repeats", "peaks", "pauses", "idle", "steps", "minor_loops", "low_loads",
    "shuffled_loads", "long_hold", "multisine",
    "temperature", "temperatures", "displacement", "neighbour", "command", "pressure_reference",
]  # fmt: skip

SAYS = MappingProxyType({
    "holds": "loads held for some seconds, at several levels",
    "rests": "rests without load between loads",
    "rates": "several loading rates",
    "repeats": "load cycles that are repeated",
    "peaks": "several peak loads",
    "pauses": "pauses of different length between groups of cycles",
    "idle": "minutes without any load",
    "steps": "steps of load",
    "minor_loops": "small cycles within large ones",
    "low_loads": "loads of a few percent of full scale",
    "shuffled_loads": "peak loads in shuffled order",
    "long_hold": "a load held for minutes",
    "multisine": "a sum of sines over two decades of frequency",
    "temperature": "the unit's temperature, logged",
    "temperatures": "recordings that begin at several temperatures, logged",
    "displacement": "the machine's displacement, logged",
    "neighbour": "the neighbouring unit's reading, logged",
    "command": "the machine's commanded load, logged",
    "pressure_reference": "a pressure that is known: the tube vented, or pressure applied directly to the sensor",
})  # fmt: skip
"""What a protocol or a log must hold for each word, as half a sentence."""

CHANNELS: frozenset[Exposure] = frozenset(
    {"temperature", "temperatures", "displacement", "neighbour", "command", "pressure_reference"}
)
"""Words that ask for a channel and not for a load history."""
CLOCK: frozenset[Exposure] = frozenset({"idle", "pauses", "shuffled_loads"})
"""Words for what tells an effect of time, or of what was borne so far, from an effect of the present load."""
LATER_CYCLES: frozenset[Exposure] = frozenset({"peaks", "pauses", "repeats", "shuffled_loads"})
"""Words for what a recording of a single load cycle cannot hold."""
WORDS: frozenset[str] = frozenset(get_args(Exposure))


def by(*words: Exposure) -> frozenset[Exposure]:
    """The set of these words."""
    return frozenset(words)
