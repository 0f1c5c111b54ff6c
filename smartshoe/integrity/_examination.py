"""`examine`: all detectors over all recordings, in an order in which none takes another's fault for its own.

1. Each recording is cleaned: samples that are no measurements of their own (blanks, held or interpolated rows) are left
   out, counters that ran over are counted on, and wild values are taken out (`_cleaned`).
2. The detectors look at each recording, first at its time base, then at load and reading together (`_examined`).
3. What one recording shows of the sensor's ends and of the clocks is used for the others (`_examined_together`).
4. The load is mended where it is not known, and the clocks of all recordings are compared (`examine`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace

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
from smartshoe.integrity._still_load import still_load
from smartshoe.integrity._view import UNKNOWN_ENDS, Ends, Signal, View
from smartshoe.integrity._wild import with_missing, without_wild
from smartshoe.integrity._wrapped import unwrapped
from smartshoe.integrity.thresholds import Thresholds, decided_by
from smartshoe.recording import SENSOR_NAME, Recording

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
    still_load,
    low_rail,
    held_samples,
    spikes,
    quantisation,
    hum,
)


@dataclass(frozen=True, eq=False)
class _Cleaned:
    """A recording that detectors may look at.

    ``logged``: each channel at its own rate, counters counted on. ``recording``: the same without wild values.
    ``findings``: the faults found so far. ``is_thinned``: samples that are no measurements of their own were left out.
    """

    logged: Recording
    recording: Recording
    findings: tuple[Finding, ...]
    is_thinned: bool


@dataclass(frozen=True, eq=False)
class _Examined:
    """What was found in one recording, its ``usable`` samples (n,), and what it shows of its clocks ``alone``."""

    findings: list[Finding]
    usable: Mask
    alone: Alone = field(default_factory=Alone)

    @property
    def is_against(self) -> bool:
        """Whether its reading moves against the load, or does not move with it."""
        return any(finding.kind in ("wrong_sign", "does_not_follow_load") for finding in self.findings)


def examine(
    recordings: Sequence[Recording], thresholds: Thresholds | None = None, count: int | None = None
) -> Integrity:
    """What is wrong with the data of ``recordings``, before any model is fitted; deterministic.

    The first ``count`` recordings are fitted, or all; the others are only judged on, and what they show of the clocks
    changes nothing of the fitted ones. Each recording must have one reference load and one reading; one that has not is
    refused, whatever the others are. Raises `InputError` where there is no recording at all, `UsageError` for
    ``thresholds`` that are none.
    """
    if not recordings:
        raise InputError("there is no recording to examine: give at least one file")
    decided = decided_by(thresholds)
    cleaned = _cleaned(recordings, decided)
    count = len(cleaned) if count is None else count
    examined = _examined_together(cleaned, decided, count)
    refused = [_refusal(clean.recording, one, decided) for clean, one in zip(cleaned, examined, strict=True)]
    usable = [one.usable & (refusal is None) for one, refusal in zip(examined, refused, strict=True)]
    mended = [_mended(*one, decided) for one in zip(cleaned, examined, usable, strict=True)]
    clocks = clocks_of([one for one, _ in mended], usable, [one.alone for one in examined], count, decided)
    for place, clock in clocks.own.items():
        recording, findings = mended[place]
        findings[:] = [one for one in findings if one.kind != "two_clocks"]
        findings.append(from_two_clocks(recording, clock, "than in the other recordings"))
    for place, (_, findings) in enumerate(mended):
        if not (clocks.offsets_s[place] or clocks.rates[place]):  # a lag of the unit, as the fitted recordings show
            findings[:] = [one for one in findings if one.kind != "two_clocks"]
    return Integrity(
        tuple(recording for recording, _ in mended),
        tuple(
            _fault(number, recording, finding)
            for number, (recording, findings) in enumerate(mended)
            for finding in findings
        ),
        tuple(usable),
        clocks.offsets_s,
        clocks.rates,
        clocks.shared,
        tuple(refusal for refusal in refused if refusal is not None),
        clocks.others,
    )


def _examined_together(cleaned: Sequence[_Cleaned], thresholds: Thresholds, count: int) -> list[_Examined]:
    """What was found in each recording, with what the others show of the sensor's ends and of the clocks.

    Only the first ``count``, which are fitted, tell of the clocks.
    """
    examined = [_examined(one, thresholds) for one in cleaned]
    ends = _ends_seen_in([finding for one in examined for finding in one.findings])
    if ends.dropouts.size + ends.rails.size + ends.loads.size and len(cleaned) > 1:
        examined = [_examined(one, thresholds, ends) for one in cleaned]
    with_load = [one.alone.lags for one in examined[:count] if not one.is_against]
    if not any(one.is_against for one in examined) or (clock := one_clock(with_load, thresholds)) is None:
        return examined
    return [
        _turned_where_as_others(clean, one, clock, thresholds, ends) if one.is_against else one
        for clean, one in zip(cleaned, examined, strict=True)
    ]


def _refusal(recording: Recording, found: _Examined, thresholds: Thresholds) -> str | None:
    """Why a recording is of no use, or None: it has a fatal fault, or hardly any sample without one."""
    says = next((one.says for one in found.findings if one.severity == "fatal"), None)
    masking = [one for one in found.findings if one.masks]
    faulty = float(np.any([one.at for one in masking], axis=0).mean()) if masking else 0.0
    if says is None and (thresholds.clear * (1.0 - faulty) < 1.0 or not found.usable.any()):
        kinds = ", ".join(sorted({one.kind for one in masking}))
        says = f"{100 * faulty:.0f} % of the samples are faulty ({kinds}): record it again"
    return None if says is None else f"{recording.label}: {says}"


def _ends_seen_in(findings: Sequence[Finding]) -> Ends:
    """The ends of the unit's sensor and of its load cell that ``findings`` of any recording show."""
    dropouts = np.unique(np.concatenate([np.zeros(0), *(one.values for one in findings)]))
    rails = [one.rail for one in findings if one.rail is not None]
    loads = [one.load_end for one in findings if one.load_end is not None]
    return Ends(dropouts, np.unique(rails), np.unique(loads))


def _cleaned(recordings: Sequence[Recording], thresholds: Thresholds) -> list[_Cleaned]:
    """Each recording as `_Cleaned`; held channels are looked for in all of them together."""
    cleaned = []
    filled = [without_blanks(one, thresholds) for one in recordings]
    for (_, blank), (at_own_rate, held) in zip(
        filled, without_held([one for one, _ in filled], thresholds), strict=True
    ):
        measured, interpolated = without_interpolated(at_own_rate, thresholds)
        logged, wrapped = unwrapped(measured, thresholds)
        recording, wild = without_wild(logged, thresholds)
        thinned = [  # samples that are no measurements of their own; each is of all that remain in the end
            replace(one, at=np.ones(len(recording), dtype=bool)) for one in (*blank, *held, *interpolated)
        ]
        cleaned.append(_Cleaned(logged, recording, (*thinned, *wrapped, *wild), bool(thinned)))
    return cleaned


def _mended(clean: _Cleaned, found: _Examined, usable: Mask, thresholds: Thresholds) -> tuple[Recording, list[Finding]]:
    """A recording with its load mended as far as it is known, and all findings in it."""
    recording = _with_known_load(clean.recording, found.findings)
    mended, stepped = between_steps(recording, thresholds) if usable.any() else (recording, [])
    return mended, [*found.findings, *stepped]


def _with_known_load(recording: Recording, findings: Sequence[Finding]) -> Recording:
    """``recording`` without the samples of the load at which findings say that it was not the load."""
    not_load = [finding.no_load for finding in findings if finding.no_load is not None and finding.no_load.any()]
    return with_missing(recording, recording.load, np.any(not_load, axis=0)) if not_load else recording


def _examined(clean: _Cleaned, thresholds: Thresholds, ends: Ends = UNKNOWN_ENDS, *, turned: bool = False) -> _Examined:
    """What was found in one recording; ``turned``: with its reading turned over, as a lag may make it seem to fall.

    A fault that makes a recording useless ends the search, since later detectors would be misled by it.
    """
    recording = clean.logged
    usable = np.ones(len(recording), dtype=bool)
    short = list(short_recording(recording, thresholds, clean.is_thinned))
    if short:
        return _Examined([*clean.findings, *short], ~usable)
    findings = [*clean.findings, *(finding for detect in OF_RECORDING for finding in detect(recording, thresholds))]
    for finding in findings:
        if finding.masks:
            usable &= ~finding.at
    all_samples = np.ones(len(recording), dtype=bool)
    if (lack := _lack_of_channels(recording)) is not None:
        return _Examined([*findings, Finding.fatal("no_reference", all_samples, lack)], usable)
    if (too_large := _too_large(recording)) is not None:
        return _Examined([*findings, Finding.fatal("does_not_follow_load", all_samples, too_large)], usable)
    view = _view(clean.recording, thresholds, ends)
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


def _turned_where_as_others(
    clean: _Cleaned, as_is: _Examined, clock: OneClock, thresholds: Thresholds, ends: Ends
) -> _Examined:
    """A recording whose reading goes against the load, turned over where it then lags by the others' ``clock``.

    A reading that is late by half a period of its load seems to fall as the load rises. Turned over, it must lie on
    that clock, and nearer to it than as it was.
    """
    turned_over = _examined(clean, thresholds, ends, turned=True)
    turned_lags, lags = turned_over.alone.lags, as_is.alone.lags
    is_by_clock = turned_lags.are_of(clock, thresholds) and turned_lags.off_from_s(clock) < lags.off_from_s(clock)
    return turned_over if is_by_clock and not turned_over.is_against else as_is


def _lack_of_channels(recording: Recording) -> str | None:
    """Why a recording does not have one load and one reading, with what would mend it; or None."""
    others = first_names([one.name for one in recording.of_role("auxiliary")])
    among = f" (columns: {others})" if others else ""
    if not recording.of_role("load"):
        commanded = recording.of_role("command")
        taken = [one.name for one in recording.sensors if one.unit.quantity == "force"]
        said = f" ({first_names(taken)} {'is' if len(taken) == 1 else 'are'} taken as the sensor)" if taken else ""
        said = f" ({commanded[0].name} is what was asked for, not what was measured)" if commanded else said
        return (
            f"there is no reference load{said}: without it an error of the unit cannot be told from the load; name its"
            f" column with --force{among}"
        )
    readings = [one.name for one in recording.sensors]
    if len(readings) > 1:
        return f"there are {len(readings)} readings ({first_names(readings)}): name one with --sensor"
    if readings:
        return None
    # A recording of arrays has no columns to choose from: there the array's name tells.
    like = next((one.unit.suffix for one in recording.of_role("auxiliary")), "v")
    of_arrays = f"; an array is named {SENSOR_NAME} and its unit, as in {SENSOR_NAME}_{like}="
    return f"there is no reading: name its column with --sensor{among}" + (of_arrays if not recording.source else "")


def _too_large(recording: Recording) -> str | None:
    """Why nothing can be computed of a recording's numbers, or None.

    They are so large that the square of a sum of their squares overflows.
    """
    limit = (np.finfo(float).max / len(recording) ** 2) ** 0.25
    for channel in (recording.load, recording.sensor):
        largest = float(np.max(np.abs(channel.values), initial=0.0))
        if not largest * max(channel.unit.scale, 1.0) < limit:
            return f"{channel.name} holds numbers up to {largest:.2g}, which are no measurements: give another unit"
    return None


def _view(recording: Recording, thresholds: Thresholds, ends: Ends) -> View | None:
    """The recording where load and reading are both present, its reading turned to rise with load.

    None where both are present at too few samples.
    """
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
    """The ``finding`` in recording ``number`` as the result lists it."""
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
        finding.lines_hz,
    )
