"""`DataFault` and `Integrity`: what is wrong with the data itself, before any model is asked."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np

from smartshoe.arrays import Array, Mask
from smartshoe.display import moment
from smartshoe.recording import Recording

Severity = Literal["minor", "material", "fatal"]


@dataclass(frozen=True, slots=True)
class DataFault:
    """One fault of one recording.

    ``kind`` is an identifier of the catalogue of effects where it has one (``held_samples``, ``spikes``, ``hum``),
    else a word of its own (``gaps``, ``two_clocks``). ``recording`` is the index of the recording, ``label`` what it
    is called, ``start_s`` to ``stop_s`` the time from the first sample at fault to the last, ``share`` the fraction
    of samples at fault. ``severity``: *minor* asks for nothing, *material* would show in a fit that ignores it,
    *fatal* leaves this recording without use. ``error`` is the rms that a fault of all samples, which masks none, adds
    to the reading, in the reading's unit.
    """

    kind: str
    recording: int
    label: str
    start_s: float
    stop_s: float
    share: float
    says: str
    severity: Severity = "material"
    error: float = 0.0

    def to_dict(self) -> dict[str, Any]:
        """The object that ``diagnose --json`` lists under ``data_faults``."""
        where = f"{self.label}, {moment(self.start_s)}-{moment(self.stop_s)} s"
        return {"kind": self.kind, "where": where, "share": self.share, "says": self.says}


@dataclass(frozen=True, eq=False)
class Finding:
    """What a detector hands back: ``at`` (n,) marks the samples at fault, over all samples of the recording.

    Where ``masks`` is set no fit may use those samples.
    ``values`` (v,) are those that the reading takes exactly by this fault, as they were recorded; ``error`` that of
    `DataFault`. ``no_load`` (n,) marks samples of the load that are none. ``cut_off`` (n,) marks others than ``at``
    that no fit may use either, and that are as they must be: at rest beyond the end of the sensor. ``rail`` is the
    value, as recorded, at which the sensor ends.
    """

    kind: str
    at: Mask
    says: str
    severity: Severity = "material"
    masks: bool = False
    values: Array = field(default_factory=lambda: np.zeros(0))
    error: float = 0.0
    no_load: Mask | None = None
    cut_off: Mask | None = None
    rail: float | None = None

    @classmethod
    def fatal(cls, kind: str, at: Mask, says: str) -> Finding:
        """One for which no sample of the recording can be used; it is refused by what ``says``."""
        return cls(kind, at, says, "fatal", masks=True)


@dataclass(frozen=True)
class OneClock:
    """One pair of clocks for all recordings: the lag ``before_s`` at the beginning of each, its growth in s per s."""

    before_s: float
    rate: float

    def lag_s(self, at_s: Array) -> Array:
        """(w,) lags at moments ``at_s`` (w,) from the beginning of a recording."""
        return self.before_s + self.rate * at_s


@dataclass(frozen=True, eq=False)
class Integrity:
    """What `examine` found: one entry a recording in ``recordings``, ``usable``, ``clock_offset_s``, ``clock_rate``.

    ``recordings`` are those that were given, but for samples of load or reading that tell nothing: these are missing,
    or are left out of a channel that is held between its samples.
    ``usable`` holds (n,) masks of samples that a fit may use: load and reading present, neither spike nor dropout nor
    held nor at a rail. ``clock_offset_s`` is how much later the reading is than the load in the middle of the
    recording, 0 where the clocks agree; ``clock_rate`` how that lag grows in s per s. ``one_clock`` is what all of
    them share that are fitted, where one pair of clocks accounts for how late their readings follow; ``others`` are
    the places of recordings that only judge, and go by other clocks. ``refusals`` says in a sentence each, in their
    order, why the recordings without a usable sample are of no use.
    """

    recordings: tuple[Recording, ...]
    faults: tuple[DataFault, ...]
    usable: tuple[Mask, ...]
    clock_offset_s: tuple[float, ...]
    clock_rate: tuple[float, ...]
    one_clock: OneClock | None
    refusals: tuple[str, ...]
    others: frozenset[int] = frozenset()
