"""Writes a trial as a Motion-BIDS folder (Brain Imaging Data Structure 1.9, motion), a format for shared gait data."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from smartshoe.errors import UsageError
from smartshoe.files.atomic import json_text, make_folder, write_text
from smartshoe.gait._c3d import analog_signals

if TYPE_CHECKING:
    from smartshoe.gait._result import GaitResult

BIDS_VERSION = "1.9.0"
MISSING = "n/a"
TRACKSYS = "shoe"


def write_motion_bids(
    folder: Path | str, found: GaitResult, *, subject: str, task: str = "walk", title: str = "Smart shoe trials"
) -> list[Path]:
    """Write the trial of ``subject`` doing ``task`` into the data set ``folder``, which is created if missing.

    The first column is the trial's own time in s (type LATENCY), the others are the table of forces (type MISC): units,
    feet, total, centre of pressure; ``n/a`` where unknown. Event times count from the first sample, as BIDS requires.
    Returns the paths of the trial's files. Raises `UsageError` for a label with other characters than letters and
    digits, and if the trial is already in the data set.
    """
    for key, label in (("subject", subject), ("task", task)):
        if not re.fullmatch(r"[A-Za-z0-9]+", label):
            raise UsageError(f"{key} {label!r} is no BIDS label: use letters and digits only")
    root = Path(folder)
    place = root / f"sub-{subject}" / "motion"
    stem = f"sub-{subject}_task-{task}"
    paths = [
        place / f"{stem}_{ending}"
        for ending in (
            f"tracksys-{TRACKSYS}_motion.tsv", f"tracksys-{TRACKSYS}_motion.json", f"tracksys-{TRACKSYS}_channels.tsv",
            "events.tsv",
        )
    ]  # fmt: skip
    if any(path.exists() for path in paths):
        raise UsageError(f"{place} holds task {task} of this subject already: choose another subject, task or folder")
    time_s, signals = analog_signals(found)
    rate_hz = next(iter(found.feet.values())).rate_hz
    table = pd.DataFrame({"time": time_s} | {signal.label: signal.values for signal in signals})
    channels = pd.DataFrame(
        [("time", MISSING, "LATENCY", MISSING, "s")] + [(s.label, MISSING, "MISC", MISSING, s.unit) for s in signals],
        columns=["name", "component", "type", "tracked_point", "units"],
    )
    span_s = float(time_s[-1] - time_s[0])
    about: dict[str, Any] = {
        "TaskName": task,
        "SamplingFrequency": rate_hz,
        "SamplingFrequencyEffective": (time_s.size - 1) / span_s if span_s > 0.0 else rate_hz,
        "TrackingSystemName": TRACKSYS,
        "MISCChannelCount": len(signals),
        "MotionChannelCount": len(channels),
        "MissingValues": MISSING,
    }
    events = pd.DataFrame(
        [(event.time_s - float(time_s[0]), MISSING, f"{event.foot}_{event.event}") for event in found.events],
        columns=["onset", "duration", "trial_type"],
    )
    texts = (_tsv(table, header=False), json_text(about), _tsv(channels), _tsv(events))
    make_folder(place)
    _describe(root, subject, title)
    for path, text in zip(paths, texts, strict=True):
        write_text(path, text)
    return paths


def _describe(root: Path, subject: str, title: str) -> None:
    """Write the files that a data set has once, and add the subject to the list of participants if it is not there."""
    from smartshoe.version import __version__

    description = root / "dataset_description.json"
    if not description.exists():
        tool = {"Name": "smartshoe", "Version": __version__}
        write_text(
            description,
            json_text({"Name": title, "BIDSVersion": BIDS_VERSION, "DatasetType": "raw", "GeneratedBy": [tool]}),
        )
        write_text(root / "README", f"{title}\n\nForces under the foot by smart shoes, written by smartshoe.\n")
    participants = root / "participants.tsv"
    known = participants.read_text(encoding="utf-8") if participants.exists() else "participant_id\n"
    if f"sub-{subject}" not in [line.split("\t")[0] for line in known.splitlines()]:
        # The list may have further columns, which are unknown for this subject.
        more = f"\t{MISSING}" * known.splitlines()[0].count("\t")
        write_text(participants, f"{known.rstrip()}\nsub-{subject}{more}\n")


def _tsv(table: pd.DataFrame, *, header: bool = True) -> str:
    """Tab-separated text with numbers in full precision."""
    cells = table.replace([np.inf, -np.inf], np.nan)
    return str(cells.to_csv(sep="\t", index=False, header=header, na_rep=MISSING, lineterminator="\n"))
