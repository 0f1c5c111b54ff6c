"""`examine`: every detector over every recording, in an order in which none takes another's fault for its own."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from smartshoe.arrays import Mask
from smartshoe.display import first_names
from smartshoe.errors import InputError
from smartshoe.integrity._blanks import without_blanks
from smartshoe.integrity._clocks import align, from_two_clocks, one_clock, two_clocks
from smartshoe.integrity._dropouts import dropouts, load_dropouts
from smartshoe.integrity._fault import DataFault, Finding, Integrity, OneClock
from smartshoe.integrity._following import does_not_follow_load, wrong_sign
from smartshoe.integrity._held import held_samples
from smartshoe.integrity._held_rate import without_held
from smartshoe.integrity._hum import hum
from smartshoe.integrity._interpolated import without_interpolated
from smartshoe.integrity._own_clocks import Alone, clocks_of
from smartshoe.integrity._quantisation import quantisation
from smartshoe.integrity._rails import low_rail, saturation
from smartshoe.integrity._sampling import gaps, missing_samples, short_recording, uneven_sampling
from smartshoe.integrity._spikes import spikes
from smartshoe.integrity._stepped_load import between_steps
from smartshoe.integrity._view import UNKNOWN_ENDS, Ends, Signal, View
from smartshoe.integrity._wild import with_missing, without_wild
from smartshoe.integrity._wrapped import unwrapped
from smartshoe.integrity.thresholds import Thresholds, decided_by
from smartshoe.recording import Recording

OF_RECORDING: tuple[Callable[[Recording, Thresholds], Iterator[Finding]], ...] = (
    missing_samples,
    gaps,
    uneven_sampling,
)
# A saturated reading may follow too little: both are said. Dropouts and rails before held samples and spikes, which
# they also look like; spikes where readings are not held.
OF_VIEW: tuple[Callable[[View, Mask], Iterator[Finding]], ...] = (
    saturation,
    does_not_follow_load,
    two_clocks,
    wrong_sign,
    dropouts,
    load_dropouts,
    low_rail,
    held_samples,
    spikes,
    quantisation,
    hum,
)


@dataclass(frozen=True, eq=False)
class _Tamed:
    """A recording as ``logged``, but each channel at its own rate, and counted on; ``recording``: without wild values.

    ``findings``: what was found on the way. ``is_rest``: samples that are no measurements of their own were left out.
    """

    logged: Recording
    recording: Recording
    findings: tuple[Finding, ...]
    is_rest: bool


@dataclass(frozen=True, eq=False)
class _Examined:
    """What was found in one recording, its ``usable`` samples (n,), and what it tells of its clocks ``alone``."""

    findings: list[Finding]
    usable: Mask
    alone: Alone = field(default_factory=Alone)

    @property
    def is_against(self) -> bool:
        """Whether its reading goes against the load, or not with it."""
        return any(finding.kind in ("wrong_sign", "does_not_follow_load") for finding in self.findings)


def examine(
    recordings: Sequence[Recording], thresholds: Thresholds | None = None, count: int | None = None
) -> Integrity:
    """What is wrong with the data of ``recordings``, before any model; deterministic.

    The first ``count`` are fitted, or all; what the others show of the clocks changes nothing of these.
    Each recording has one reference load and one reading; where it has not, that is its refusal, whatever the others
    are. Raises `InputError` where there is no recording at all, `UsageError` for ``thresholds`` that are none.
    """
    if not recordings:
        raise InputError("there is no recording to examine: give at least one file")
    decided = decided_by(thresholds)
    tamed = _tamed(recordings, decided)
    count = len(tamed) if count is None else count
    examined = _examined_together(tamed, decided, count)
    refused = [_refusal(tame.recording, one, decided) for tame, one in zip(tamed, examined, strict=True)]
    usable = [one.usable & (why is None) for one, why in zip(examined, refused, strict=True)]
    put_right = [_put_right(*one, decided) for one in zip(tamed, examined, usable, strict=True)]
    clocks = clocks_of([one for one, _ in put_right], usable, [one.alone for one in examined], count, decided)
    for place, clock in clocks.own.items():
        recording, findings = put_right[place]
        findings[:] = [one for one in findings if one.kind != "two_clocks"]
        findings.append(from_two_clocks(recording, clock, "than in the other recordings"))
    return Integrity(
        tuple(recording for recording, _ in put_right),
        tuple(
            _fault(number, recording, finding)
            for number, (recording, findings) in enumerate(put_right)
            for finding in findings
        ),
        tuple(usable),
        clocks.offsets_s,
        clocks.rates,
        clocks.shared,
        tuple(why for why in refused if why is not None),
        clocks.others,
    )


def _examined_together(tamed: Sequence[_Tamed], thresholds: Thresholds, count: int) -> list[_Examined]:
    """What was found in each recording, by all that the others tell of the sensor's ends and of the clocks.

    Of the clocks only the first ``count`` tell, which are fitted.
    """
    examined = [_examined(one, thresholds) for one in tamed]
    ends = _ends_told_by([finding for one in examined for finding in one.findings])
    if ends.dropouts.size + ends.rails.size and len(tamed) > 1:
        examined = [_examined(one, thresholds, ends) for one in tamed]
    with_load = [one.alone.lags for one in examined[:count] if not one.is_against]
    if not any(one.is_against for one in examined) or (theirs := one_clock(with_load, thresholds)) is None:
        return examined
    return [
        _as_others_follow(tame, one, theirs, thresholds, ends) if one.is_against else one
        for tame, one in zip(tamed, examined, strict=True)
    ]


def _refusal(recording: Recording, found: _Examined, thresholds: Thresholds) -> str | None:
    """Why a recording is of no use, or None: a fatal fault, or hardly any sample that is not at fault."""
    says = next((one.says for one in found.findings if one.severity == "fatal"), None)
    masking = [one for one in found.findings if one.masks]
    faulty = float(np.any([one.at for one in masking], axis=0).mean()) if masking else 0.0
    if says is None and (thresholds.clear * (1.0 - faulty) < 1.0 or not found.usable.any()):
        kinds = ", ".join(sorted({one.kind for one in masking}))
        says = f"{100 * faulty:.0f} % of the samples are faulty ({kinds}): record it again"
    return None if says is None else f"{recording.label}: {says}"


def _ends_told_by(findings: Sequence[Finding]) -> Ends:
    rails = [one.rail for one in findings if one.rail is not None]
    return Ends(np.unique(np.concatenate([np.zeros(0), *(one.values for one in findings)])), np.unique(rails))


def _tamed(recordings: Sequence[Recording], thresholds: Thresholds) -> list[_Tamed]:
    made = []
    filled = [without_blanks(one, thresholds) for one in recordings]
    for (_, blank), (read, held) in zip(filled, without_held([one for one, _ in filled], thresholds), strict=True):
        measured, between = without_interpolated(read, thresholds)
        logged, wrapped = unwrapped(measured, thresholds)
        recording, wild = without_wild(logged, thresholds)
        own = (*blank, *held, *between)  # samples that are no measurements of their own
        made.append(_Tamed(logged, recording, (*own, *wrapped, *wild), bool(own)))
    return made


def _put_right(tame: _Tamed, found: _Examined, usable: Mask, thresholds: Thresholds) -> tuple[Recording, list[Finding]]:
    """A recording with its load as far as it is known, and all findings in it."""
    recording = _with_known_load(tame.recording, found.findings)
    between, stepped = between_steps(recording, thresholds) if usable.any() else (recording, [])
    return between, [*found.findings, *stepped]


def _with_known_load(recording: Recording, findings: Sequence[Finding]) -> Recording:
    """Without the samples of the load at which it was not the load."""
    none = [finding.no_load for finding in findings if finding.no_load is not None and finding.no_load.any()]
    return with_missing(recording, recording.load, np.any(none, axis=0)) if none else recording


def _examined(tame: _Tamed, thresholds: Thresholds, ends: Ends = UNKNOWN_ENDS, *, turned: bool = False) -> _Examined:
    """What was found in one recording; ``turned``: its reading rises where it seems to fall."""
    recording = tame.logged
    usable = np.ones(len(recording), dtype=bool)
    short = list(short_recording(recording, thresholds, tame.is_rest))
    if short:
        return _Examined([*tame.findings, *short], ~usable)
    findings = [*tame.findings, *(finding for detect in OF_RECORDING for finding in detect(recording, thresholds))]
    for finding in findings:
        if finding.masks:
            usable &= ~finding.at
    whole = np.ones(len(recording), dtype=bool)
    if (lacking := _lacking(recording)) is not None:
        return _Examined([*findings, Finding.fatal("no_reference", whole, lacking)], usable)
    if (too_large := _beyond_squares(recording)) is not None:
        return _Examined([*findings, Finding.fatal("does_not_follow_load", whole, too_large)], usable)
    view = _view(tame.recording, thresholds, ends)
    if view is None:
        says = "load and reading are hardly ever there at the same time: record them together"
        return _Examined([*findings, Finding.fatal("missing_samples", ~usable, says)], usable)
    view, seen = align(view.turned() if turned else view)
    for detect in OF_VIEW:
        bad = ~usable[view.index]
        for finding in detect(view, bad):
            findings.append(finding)
            if finding.masks:
                usable &= ~finding.at
            if finding.cut_off is not None:
                usable &= ~finding.cut_off
        if any(finding.severity == "fatal" for finding in findings):
            break
    return _Examined(findings, usable, Alone(view.offset_s, view.rate, seen))


def _as_others_follow(tame: _Tamed, mine: _Examined, theirs: OneClock, thresholds: Thresholds, ends: Ends) -> _Examined:
    """A recording whose reading goes against the load, turned over if it then lags as the others do by their clocks.

    A reading that is late by half a period of its load seems to fall as the load rises.
    """
    over = _examined(tame, thresholds, ends, turned=True)
    turned, as_it_was = over.alone.lags, mine.alone.lags
    is_theirs = turned.are_of(theirs, thresholds) and turned.off_from_s(theirs) < as_it_was.off_from_s(theirs)
    return over if is_theirs and not over.is_against else mine


def _lacking(recording: Recording) -> str | None:
    """Why there is no pair of load and reading, or None."""
    others = first_names([one.name for one in recording.of_role("auxiliary")])
    among = f" (columns: {others})" if others else ""
    if not recording.of_role("load"):
        commanded = recording.of_role("command")
        taken = [one.name for one in recording.sensors if one.unit.quantity == "force"]
        said = f" ({first_names(taken)} is taken as the sensor)" if taken else ""
        said = f" ({commanded[0].name} is what was asked for, not what was measured)" if commanded else said
        return (
            f"there is no reference load{said}: without it an error of the unit cannot be told from the load; name its"
            f" column with --force{among}"
        )
    readings = [one.name for one in recording.sensors]
    if len(readings) > 1:
        return f"there are {len(readings)} readings ({first_names(readings)}): name one with --sensor"
    return None if readings else f"there is no reading: name its column with --sensor{among}"


def _beyond_squares(recording: Recording) -> str | None:
    """Why nothing can be computed of numbers so large that squares of their sums of squares are none, or None."""
    most = (np.finfo(float).max / len(recording) ** 2) ** 0.25
    for channel in (recording.load, recording.sensor):
        largest = float(np.max(np.abs(channel.values), initial=0.0))
        if not largest * max(channel.unit.scale, 1.0) < most:
            return f"{channel.name} holds numbers up to {largest:.2g}, which are no measurements: give another unit"
    return None


def _view(recording: Recording, thresholds: Thresholds, ends: Ends) -> View | None:
    """The recording where load and reading are both present, the reading rising with load; None where hardly ever."""
    load, sensor = recording.load, recording.sensor
    index = np.flatnonzero(load.present & sensor.present)
    if index.size < thresholds.least_samples:
        return None
    time_s, load_n, reading = recording.time_s[index], load.si[index], sensor.values[index]
    signals = Signal(load_n, thresholds), Signal(reading, thresholds)
    view = View(recording, index, time_s, *signals, 1, thresholds, ends=ends)
    at, middle = view.curve
    falls = at.size > 1 and float(np.dot(at - at.mean(), middle - middle.mean())) < 0.0
    return view.turned() if falls else view


def _fault(number: int, recording: Recording, finding: Finding) -> DataFault:
    at = np.flatnonzero(finding.at)
    first, last = (int(at[0]), int(at[-1])) if at.size else (0, len(recording) - 1)
    return DataFault(
        finding.kind,
        number,
        recording.label,
        float(recording.time_s[first]),
        float(recording.time_s[last]),
        float(finding.at.mean()),
        finding.says,
        finding.severity,
        finding.error,
    )
