"""`diagnose`: which recordings may be diagnosed, and the reasons for those that may not."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from smartshoe.diagnosis._characteristic import characteristic_of, has_two_signs
from smartshoe.diagnosis._continuation import content_of, without_predecessor
from smartshoe.diagnosis._convergence import Progress
from smartshoe.diagnosis._procedure import diagnosed
from smartshoe.diagnosis._result import Diagnosis
from smartshoe.diagnosis.decay import decay_of
from smartshoe.errors import UsageError
from smartshoe.files.logs.accepted import RecordingLike, recordings_of, unit_of
from smartshoe.integrity import Integrity, examine, twins, twins_by_noise
from smartshoe.integrity.thresholds import Thresholds, decided_by
from smartshoe.recording import Recording

MOST_RECORDINGS = 50  # to fit, and to judge on: a resolution, since each is a session of its own to compute


def _silent(_: str) -> None:
    return None


def diagnose(
    recordings: RecordingLike | Sequence[RecordingLike],
    hold_out: RecordingLike | Sequence[RecordingLike] | None = None,
    *,
    material: float | None = None,
    thresholds: Thresholds | None = None,
    progress: Progress = _silent,
) -> Diagnosis:
    """What the baseline simulation of ``recordings`` gets wrong, why, and what mending it gains.

    A diagnosis that the data cannot support comes back with the verdict "refused" and the reason in ``limits``.

    Parameters
    ----------
    recordings
        Load and reading of one unit (recordings, paths or DataFrames), each a session of its own unless its metadata
        ``continues`` names another.
    hold_out
        Recordings to judge on. They select nothing and are never fitted; without them every third load cycle is.
    material
        Share of the full-scale reading below which nothing counts; that of ``thresholds`` where it is not given. A
        share, not percent: ``material=0.0005`` is 0.05 % of full scale, ``--material 0.05`` on the command line.
    thresholds
        Every number that decides.
    progress
        Called with a few words at each step.

    Raises
    ------
    UsageError
        Where no recording is given, of recordings of several units, and of numbers to decide by that are none.
    InputError
        Of a file or a DataFrame that cannot be read, and of an ``effective_area_m2`` that is no positive number.
    UnitError
        Of readings of two quantities.
    NotIdentifiableError
        Where load or reading leaves zero in a few samples only, too few for a full scale.
    """
    fitted, kept_out = recordings_of(recordings), recordings_of(() if hold_out is None else hold_out, "hold_out")
    if not fitted:
        raise UsageError("diagnose was given no recording: give one at least")
    unit_of([*fitted, *kept_out], "diagnose")
    fitted, limits_of_fitted = _spread(fitted, "to fit")
    kept_out, limits_of_kept_out = _spread(kept_out, "to judge on")
    not_taken = limits_of_fitted + limits_of_kept_out
    everything, count = [*fitted, *kept_out], len(fitted)
    decided = decided_by(thresholds, material).lasting(max(one.duration_s for one in fitted))
    integrity = examine(everything, decided, count)
    everything = [*integrity.recordings]
    shared = twins_by_noise(everything, decided) | twins(everything, decided)
    useless = [k for k, mask in enumerate(integrity.usable) if not mask.any()]
    alone = [mask & ~shared[k].at if k in shared else mask for k, mask in enumerate(integrity.usable)]
    copies = {k: one.says for k, one in shared.items() if alone[k].sum() < decided.least_samples}
    left_out = copies | dict(zip(useless, integrity.refusals, strict=True))
    pulled = {
        k: said for k, one in enumerate(everything) if k not in left_out and (said := _pulled_reason(one, decided))
    }
    if any(k < count for k in pulled):
        return _refused(everything, integrity, [said for k, said in pulled.items() if k < count] + not_taken, decided)
    left_out |= pulled
    if all(k in left_out for k in range(count)):
        return _refused(everything, integrity, list(left_out.values()) + not_taken, decided)
    usable = tuple(mask & (k not in left_out) for k, mask in enumerate(alone))
    found = diagnosed(everything, count, replace(integrity, usable=usable), decided, progress)
    reasons = tuple(left_out.values())
    why_not = (*reasons, *(one.says for k, one in shared.items() if k not in left_out))
    limits = (
        *(f"left out: {why}" for why in why_not),
        *not_taken,
        *_limit_missing_predecessor(everything, count, left_out),
        *found.limits,
    )
    return replace(found, limits=limits, left_out=reasons)


def _spread(recordings: list[Recording], purpose: str) -> tuple[list[Recording], list[str]]:
    """At most `MOST_RECORDINGS` of the ``recordings``, evenly spread over their contents, and the sentence on the rest.

    Recordings stay in their order, which, like their names, does not decide which are taken.
    """
    if len(recordings) <= MOST_RECORDINGS:
        return recordings, []
    by_content = sorted(range(len(recordings)), key=lambda k: content_of(recordings[k]))
    places = np.linspace(0, len(recordings) - 1, MOST_RECORDINGS).round().astype(int)
    taken = sorted(by_content[place] for place in places)
    said = (
        f"of {len(recordings):,} recordings {purpose} {MOST_RECORDINGS} are used, evenly spread over their lengths and"
        " loads, since each is a session of its own (write short ones that follow each other as one recording)"
    )
    return [recordings[k] for k in taken], [said]


def _pulled_reason(recording: Recording, thresholds: Thresholds) -> str | None:
    """The reason where a recording's load has both signs, which no pressed unit has; else None."""
    low, high = ends = np.percentile(recording.force_n, [1, 99])
    if not has_two_signs(ends, thresholds):
        return None
    return (
        f"{recording.label}: the load runs from {low:.4g} to {high:.4g} N: the catalogue is of a unit that is pressed,"
        " which bears compression only (load it over its range; turn the sign of the load, or set it to zero at rest;"
        " where its mean was taken out, add in the file what makes all of it positive)"
    )


def _limit_missing_predecessor(recordings: Sequence[Recording], count: int, left_out: Mapping[int, str]) -> list[str]:
    """Sentences where recordings that others continue are ``left_out``, by place, or were not given.

    The first ``count`` were to be fitted. Also where no recording is left to judge on.
    """
    said = []
    names = {recordings[k].name for k in left_out}
    for one in without_predecessor([one for k, one in enumerate(recordings) if k not in left_out]):
        earlier = one.metadata["continues"]
        why = f"which is not among the recordings: it is taken as the unit's first after a rest (give {earlier} too)"
        if earlier in names:
            why = "which is left out: it is taken as a session of its own"
        elif earlier == one.name:
            why = "which is itself: it is taken as the unit's first after a rest (name the recording before it)"
        said.append(f"{one.label} continues {earlier}, {why}")
    if count < len(recordings) and all(k in left_out for k in range(count, len(recordings))):
        said.append("no recording to judge on is left: load cycles of those that are fitted are held out instead")
    return said


def _refused(
    recordings: Sequence[Recording], integrity: Integrity, refusals: Sequence[str], thresholds: Thresholds
) -> Diagnosis:
    """The diagnosis with the verdict "refused", for the reasons ``refusals``."""
    sensors = recordings[0].sensors
    unit = sensors[0].unit.symbol if sensors else ""
    return Diagnosis(
        "refused",
        f"no diagnosis: {refusals[0]}",
        unit,
        0.0,
        0.0,
        data_faults=integrity.faults,
        limits=(
            *refusals,
            *(said for one in recordings if (said := _known_without_model(one, thresholds)) is not None),
        ),
        thresholds=thresholds,
    )


def _known_without_model(recording: Recording, thresholds: Thresholds) -> str | None:
    """What can be said of a recording without a model: a decay, or a static characteristic."""
    decay = decay_of(recording, thresholds)
    return decay.says if decay is not None else characteristic_of(recording, thresholds)
