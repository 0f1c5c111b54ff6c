"""`DataFault` and `Integrity`, the results of `examine`: what is wrong with the data before any model is fitted."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np

from smartshoe.arrays import Array, Mask
from smartshoe.display import moment
from smartshoe.recording import Recording

Severity = Literal["minor", "material", "fatal"]


@dataclass(frozen=True, slots=True)
class DataFault:
    """One fault of one recording.

    ``kind`` is an identifier of the catalogue of effects where it has one (``held_samples``, ``spikes``, ``hum``), else
    a word of its own (``gaps``, ``two_clocks``). ``recording`` is the index of the recording, ``label`` its name.
    ``start_s`` to ``stop_s`` is the time from the first sample at fault to the last, ``share`` the fraction of samples
    at fault. ``severity``: *minor* asks for nothing, *material* would show in a fit that ignores it, *fatal* makes the
    recording useless. ``error`` is the rms, in the reading's unit, that a fault which masks no sample adds to the
    reading. ``lines_hz`` are the frequencies, as logged, of the lines that it puts into the reading's spectrum, the
    strongest first.
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
    lines_hz: tuple[float, ...] = ()

    def __str__(self) -> str:
        """What is wrong, and where."""
        where = self.to_dict()["where"]
        return f"{self.kind.replace('_', ' ')}, {where}: {self.says}"

    def to_dict(self) -> dict[str, Any]:
        """The object that ``diagnose --json`` lists under ``data_faults``."""
        where = f"{self.label}, {moment(self.start_s)}-{moment(self.stop_s)} s"
        return {"kind": self.kind, "where": where, "share": self.share, "says": self.says}


@dataclass(frozen=True, eq=False)
class Finding:
    """What a detector returns: a fault of ``kind`` at the samples ``at`` (n,) of the recording.

    ``masks``: no fit may use those samples. ``cut_off`` (n,): other samples that no fit may use, though they are no
    fault: at rest beyond the end of the sensor. ``no_load`` (n,): samples of the load that are not the load. ``values``
    (v,): the values, as recorded, that the reading takes exactly by this fault; ``rail``: the value at which the sensor
    ends; ``load_end``: the load in N at which the load cell ends. ``error`` and ``lines_hz``: as in `DataFault`.
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
    load_end: float | None = None
    lines_hz: tuple[float, ...] = ()

    @classmethod
    def fatal(cls, kind: str, at: Mask, says: str) -> Finding:
        """A fault that makes all samples of the recording useless; it is refused with the sentence ``says``."""
        return cls(kind, at, says, "fatal", masks=True)


@dataclass(frozen=True)
class OneClock:
    """Lag of the readings behind their loads: ``before_s`` at a recording's beginning, growing by ``rate`` in s per s.

    It is of one pair of clocks, that of the load and that of the reading.
    """

    before_s: float
    rate: float

    def lag_s(self, at_s: Array) -> Array:
        """(w,) lags in s at times ``at_s`` (w,) from the beginning of a recording."""
        return self.before_s + self.rate * at_s


@dataclass(frozen=True, eq=False)
class Integrity:
    """What `examine` found: one entry a recording in ``recordings``, ``usable``, ``clock_offset_s`` and ``clock_rate``.

    ``recordings`` are those that were given, without samples of load or reading that tell nothing: these are missing,
    or whole rows are left out where a channel was held, blank or interpolated. ``usable`` holds (n,) masks of samples
    that a fit may use: load and reading are present, and the sample is no spike, dropout or held value nor at a rail.
    ``clock_offset_s`` is how much later the reading is than the load in the middle of the recording, 0 where the clocks
    agree; ``clock_rate`` is how that lag grows in s per s. ``one_clock`` is the lag that all fitted recordings share,
    where one pair of clocks explains it. ``others`` are the places of recordings that are only judged on and go by
    other clocks. ``are_about_mean``: the offsets are about a lag that the recordings share, which is left to a model.
    ``judged_lags_s``: how much later, by places, recordings that only judge are than the fitted ones, beside these.
    ``refusals`` says why each recording without a usable sample is useless, in a sentence each, in their order.
    """

    recordings: tuple[Recording, ...]
    faults: tuple[DataFault, ...]
    usable: tuple[Mask, ...]
    clock_offset_s: tuple[float, ...]
    clock_rate: tuple[float, ...]
    one_clock: OneClock | None
    refusals: tuple[str, ...]
    others: frozenset[int] = frozenset()
    are_about_mean: bool = False
    judged_lags_s: Mapping[int, float] = field(default_factory=dict)

    def with_lags(self, lags_s: Mapping[int, float], are_about_mean: bool, *, were_in_model: bool) -> Integrity:
        """The same with readings that lag by ``lags_s`` more, by the recordings' places, and no clock that all share.

        ``were_in_model``: the lags found before were left to a model, and are in those given.
        """
        before_s = (0.0,) * len(self.clock_offset_s) if were_in_model else self.clock_offset_s
        offsets_s = tuple(offset_s + lags_s.get(place, 0.0) for place, offset_s in enumerate(before_s))
        return replace(self, clock_offset_s=offsets_s, one_clock=None, are_about_mean=are_about_mean)

    def with_judged_lags(self, lags_s: Mapping[int, float]) -> Integrity:
        """The same where recordings that only judge lag by ``lags_s`` more than the fitted ones, by their places."""
        more_s = {place: self.judged_lags_s.get(place, 0.0) + lag_s for place, lag_s in lags_s.items()}
        return replace(self, judged_lags_s={**self.judged_lags_s, **more_s})
