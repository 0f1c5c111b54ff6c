"""Where the cases come from: own truths, a second laboratory in a folder of its own, measured sensors.

A row is one JSON object: ``world``, ``kind``, ``index``, ``truth``, ``found`` (`Diagnosis.to_dict()`, or ``error``),
``cpu_s``, ``seconds`` and, where it is known, ``noise_rmse`` of the held-out recordings in the reading's unit.
"""

from __future__ import annotations

import importlib
import json
import sys
import tempfile
import time
import traceback
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

import smartshoe
from smartshoe.recording import Recording

WORLDS = ("own", "second_lab", "measured")
# How the second laboratory calls the kinds of the own bank.
THERE = {"none": "clean", "outside": "unknown"}


@dataclass(frozen=True)
class Job:
    """One case to run; ``folder`` is the second laboratory's, or that of the measured sets."""

    world: str
    kind: str
    index: int
    folder: str = ""

    @property
    def key(self) -> tuple[str, str, int]:
        """What a row is found again by."""
        return self.world, self.kind, self.index


@cache
def warm_up() -> None:
    """A process's first diagnosis compiles: it is not counted."""
    from simulators.hidden.recordings import hide

    case = hide({}, protocol="step", seed=1, recordings=1, nuisances=0)
    diagnosed(case.recordings, case.hold_out)


def run(job: Job) -> dict[str, Any]:
    """Make the case, diagnose it; a crash of the diagnosis is an answer: a wrong one."""
    warm_up()
    row = {"world": job.world, "kind": job.kind, "index": job.index}
    if job.world == "own":
        return {**row, **_own(job)}
    if job.world == "second_lab":
        return {**row, **_second(job)}
    from bank_measured import measured

    return {**row, **measured(job.kind, Path(job.folder))}


def diagnosed(recordings: Sequence[Recording], hold_out: Sequence[Recording]) -> dict[str, Any]:
    """``found``, ``cpu_s`` and ``seconds`` of one diagnosis."""
    began, cpu = time.perf_counter(), time.process_time()
    try:
        found: dict[str, Any] = smartshoe.diagnose(list(recordings), hold_out=list(hold_out)).to_dict()
    except Exception as error:  # kept in the row, and counted
        found = {"error": f"{type(error).__name__}: {error}", "traceback": traceback.format_exc()}
    spent = {"cpu_s": time.process_time() - cpu, "seconds": time.perf_counter() - began}
    found.pop("model", None)
    return {"found": json.loads(json.dumps(found)), **spent}


def _own(job: Job) -> dict[str, Any]:
    from cannot_be_told import with_what_cannot_be_told

    from simulators.hidden.cases import case

    made = case(job.kind, job.index)
    truth = with_what_cannot_be_told(made)
    answer = diagnosed(made.recordings, made.hold_out)
    squares, count = 0.0, 0
    for noisy, quiet in zip(made.hold_out, made.noise_free_hold_out, strict=True):
        gain = made.subject.full_scale_mbar / 800.0  # of a load's noise
        off = noisy["pressure"].with_nan() - quiet["pressure"].with_nan()
        cell = gain * (noisy.force_n - quiet.force_n)
        cell -= cell.mean()  # a tare is no noise
        kept = np.isfinite(off)
        squares += float(np.sum(off[kept] ** 2) + np.sum(cell[kept] ** 2))
        count += int(kept.sum())
    return {"truth": truth, **answer, "noise_rmse": float(np.sqrt(squares / max(count, 1)))}


def _second(job: Job) -> dict[str, Any]:
    folder = str(Path(job.folder).resolve())
    if folder not in sys.path:
        sys.path.insert(0, folder)
    lab = importlib.import_module("lab")
    with tempfile.TemporaryDirectory() as temporary:
        truth = lab.write(job.kind, job.index, temporary)
        read = [
            [smartshoe.read(Path(temporary) / name, sensors="pressure_mbar") for name in truth[key]]
            for key in ("fit", "hold_out")
        ]
    held = [truth["files"][Path(name).stem] for name in truth["hold_out"]]
    noise = float(np.sqrt(np.mean([one["noise_percent"] ** 2 for one in held])))
    answer = diagnosed(*read)
    return {"truth": truth, **answer, "noise_rmse": 0.01 * noise * truth["full_scale_mbar"]}
