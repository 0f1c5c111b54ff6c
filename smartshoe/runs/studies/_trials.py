"""Reads and analyses one trial of a study, and reduces it to the figures that the study keeps."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from smartshoe.arrays import Array
from smartshoe.errors import SmartShoeError
from smartshoe.kernels.blas import on_one_thread
from smartshoe.runs.studies._plan import TrialEntry

if TYPE_CHECKING:
    from smartshoe.calibration import Calibration
    from smartshoe.gait import GaitResult
    from smartshoe.recording import Recording


COMPARED = ("stance_time_s", "stance_percent", "peak_n", "impulse_n_s")  # compared with a reference, stride by stride
SAME_STRIDE_S = 0.15  # heel strikes further apart than this belong to different strides
COUNTS = ("strides", "order_of_contact", "order_of_contact_percent")  # not figures of the gait itself


@dataclass(frozen=True, eq=False)
class TrialFigures:
    """What a study keeps of a trial; without signals, so that memory holds only one trial at a time.

    ``curve`` (101,) is the mean force of a foot over a stride in percent of body weight, None if forces or body weight
    are unknown. ``pairs`` maps a figure to (strides, 2): our value and the reference's. ``left_out`` is the reason if
    the trial could not be used.
    """

    entry: TrialEntry
    summary: Mapping[str, Any] = field(default_factory=dict)
    figures: Mapping[str, float] = field(default_factory=dict)
    flags: Sequence[Mapping[str, Any]] = ()
    activity: str = ""
    curve: Array | None = None
    pairs: Mapping[str, Array] = field(default_factory=dict)
    left_out: str | None = None


@on_one_thread
def figures_of_trial(entry: TrialEntry, folder: str, calibrations: str | None, c3d: str | None) -> TrialFigures:
    """Read and analyse one trial; if that fails, ``left_out`` says why. ``c3d`` is the path of a C3D file to write."""
    from smartshoe.files.logs import read
    from smartshoe.gait import analyse

    base = Path(folder)
    try:
        recording = read(base / entry.file)
        fitting = calibrations_for(recording, None if calibrations is None else base / calibrations, entry)
        found = analyse([recording], fitting, entry.body_weight_n, entry.coverage)
        flags = [flag.to_dict() for flag in found.flags]
        pairs: Mapping[str, Array] = {}
        if entry.reference is not None:
            pairs = pairs_of(found, analyse([read(base / entry.reference)], (), entry.body_weight_n))
            if not pairs:
                flags.append(_nothing_in_common(entry))
        if c3d is not None:
            from smartshoe.gait import write_c3d

            write_c3d(c3d, found)
        return TrialFigures(
            entry,
            dict(found.summary),
            flat_figures(found),
            flags,
            found.activity,
            mean_curve(found),
            pairs,
        )
    except SmartShoeError as error:
        # Name files relative to the study's folder, so that the result is the same on any machine.
        said = str(error).replace(f"{base}{os.sep}", "")
        return TrialFigures(entry, left_out=" ".join(said.split()))


def _nothing_in_common(entry: TrialEntry) -> dict[str, Any]:
    from smartshoe.gait import Flag

    says = (
        f"no stride of reference {entry.reference} begins within {SAME_STRIDE_S:g} s of one of this trial's on the"
        " same foot: nothing is compared; check that both are the same trial, on one clock"
    )
    return Flag("reference_differs", says).to_dict()


def calibrations_for(recording: Recording, place: Path | None, entry: TrialEntry) -> list[Calibration]:
    """The calibrations of a trial's units, from a folder of files or a store; none if ``place`` is None."""
    if place is None:
        return []
    from smartshoe.calibration import Calibration
    from smartshoe.calibration.folder import load_calibrations
    from smartshoe.calibration.store import CalibrationStore, find, is_store
    from smartshoe.errors import InputError

    if not is_store(place):
        return load_calibrations(place)
    store = CalibrationStore(place)
    entries = store.entries()
    if not entries:
        raise InputError(f"{place} holds no calibration: give a folder of calibrations, or a store")
    when = entry.date or max(each.date for each in entries)
    found = []
    for channel in recording.sensors:
        stored = Calibration.load(find(store, channel.name, when).entry.path)
        found.append(replace(stored, unit=channel.name))
    return found


def flat_figures(found: GaitResult) -> dict[str, float]:
    """The summary's figures by name: of each foot (``NAME.left``, ``NAME.right``), and as the mean of both (``NAME``).

    Forces are added in percent of body weight, so that subjects can be compared.
    """
    figures: dict[str, float] = {}
    for name, value in found.summary.items():
        if name not in COUNTS:
            figures.update(_flat(name, value))
    weight = found.forces.body_weight
    if weight is not None:
        figures["body_weight_n"] = weight.value
        for name in [name for name in figures if name.split(".")[0] in ("peak_n", "impulse_n_s")]:
            if "cv_percent" not in name:
                stem = name.replace("peak_n", "peak_body_weight_percent").replace(
                    "impulse_n_s", "impulse_body_weight_percent_s"
                )
                figures[stem] = 100.0 * figures[name] / weight.value
    return {name: float(value) for name, value in figures.items() if np.isfinite(value)}


def _flat(name: str, value: Any) -> dict[str, float]:
    if isinstance(value, bool) or value is None or isinstance(value, str):
        return {}
    if isinstance(value, int | float):
        return {name: float(value)}
    if not isinstance(value, Mapping):
        return {}
    if set(value) <= {"left", "right"}:
        found: dict[str, float] = {}
        sides = {side: _flat(name, own) for side, own in value.items()}
        for key in dict.fromkeys(key for own in sides.values() for key in own):
            there = {side: own[key] for side, own in sides.items() if key in own}
            found[key] = float(np.mean(list(there.values())))
            if "cv_percent" not in key:
                found.update({f"{key}.{side}": number for side, number in there.items()})
        return found
    if "mean" in value:
        spread = {} if value.get("cv_percent") is None else {f"{name}.cv_percent": float(value["cv_percent"])}
        return {} if value["mean"] is None else {name: float(value["mean"]), **spread}
    return {k: v for key, own in value.items() for k, v in _flat(f"{name}.{key}", own).items()}


def mean_curve(found: GaitResult) -> Array | None:
    """The mean force of a foot over its strides (101,), averaged over both feet, in percent of body weight."""
    from smartshoe.gait.indices import overlaid
    from smartshoe.gait.summary import of_main_activity

    weight = found.forces.body_weight
    if weight is None:
        return None
    strides = of_main_activity(found.strides)
    curves = []
    for name, foot in found.feet.items():
        own = [stride for stride in strides if stride.foot == name]
        if own and foot.force_n is not None:
            curves.append(overlaid(own, foot.time_s, foot.force_n).mean(axis=0))
    return np.asarray(100.0 * np.mean(curves, axis=0) / weight.value) if curves else None


def pairs_of(ours: GaitResult, theirs: GaitResult) -> dict[str, Array]:
    """For each figure of `COMPARED` the pairs (m, 2) of strides found by both: our value and the reference's."""
    found: dict[str, list[tuple[float, float]]] = {name: [] for name in COMPARED}
    for stride in ours.strides:
        same = [other for other in theirs.strides if other.foot == stride.foot]
        other = min(same, key=lambda each: abs(each.start_s - stride.start_s), default=None)
        if other is None or abs(other.start_s - stride.start_s) > SAME_STRIDE_S or stride.gap or other.gap:
            continue
        for name in COMPARED:
            pair = [
                each.toe_off_s - each.start_s if name == "stance_time_s" else getattr(each, name)
                for each in (stride, other)
            ]
            if None not in pair:
                found[name].append((float(pair[0]), float(pair[1])))
    return {name: np.array(pairs) for name, pairs in found.items() if pairs}
