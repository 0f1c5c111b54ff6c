"""`study`: analyses every trial of a study and compares the conditions within subjects."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from smartshoe.arrays import Array
from smartshoe.display import counted
from smartshoe.errors import RefusedError, UsageError
from smartshoe.files.atomic import json_text, results_folder, write_text
from smartshoe.runs.studies._norms import Compared, Norm, compared, read_norms
from smartshoe.runs.studies._plan import StudyPlan, read_study
from smartshoe.runs.studies._statistics import (
    Agreement,
    Mean,
    agreement_of,
    by_subject,
    difference_of,
    mean_of,
    prediction_interval,
)
from smartshoe.runs.studies._swapped import swapped_trials
from smartshoe.runs.studies._trials import TrialFigures, figures_of_trial

if TYPE_CHECKING:
    import pandas as pd

Progress = Callable[[int, int], None]

SCHEMA = "smartshoe.study/1"


@dataclass(frozen=True, slots=True)
class Band:
    """The mean force of a foot over a stride (101,) in percent of body weight, with a prediction interval.

    ``low`` and ``high`` (101,) enclose a further subject's mean with 95 % probability; None with fewer than three
    subjects.
    """

    mean: Array
    low: Array | None
    high: Array | None
    subjects: int

    @property
    def source(self) -> str:
        """The subjects that the band is based on, and how it was computed, as text."""
        whom = f"this study's {counted(self.subjects, 'subject')}"
        return f"{whom}: mean" if self.low is None else f"{whom}: mean and 95 % prediction interval"

    def to_dict(self) -> dict[str, Any]:
        """The band as an object for JSON."""
        return {
            "unit": "percent of body weight",
            "percent_of_stride": list(range(self.mean.size)),
            "mean": self.mean.tolist(),
            "low": None if self.low is None else self.low.tolist(),
            "high": None if self.high is None else self.high.tolist(),
            "subjects": self.subjects,
            "source": self.source,
        }


@dataclass(frozen=True, slots=True)
class Difference:
    """A figure's change from one condition to another, within the subjects that did both."""

    start: str
    end: str
    figure: str
    change: Mean

    def to_dict(self) -> dict[str, Any]:
        """The difference as an object for JSON."""
        return {"from": self.start, "to": self.end, "figure": self.figure, **self.change.to_dict()}


@dataclass(frozen=True, eq=False)
class StudyResult:
    """The result of a study: ``trials`` used and ``left_out``, means by condition and figure, and ``differences``.

    ``agreement`` with the trials' references is by figure. ``bands`` maps a condition to the usual force over a stride.
    ``norms`` are the norms of the study, with the subjects outside them. ``flags`` are warnings that need the whole
    study, as pairs of file and sentence.
    """

    plan: StudyPlan
    trials: Sequence[TrialFigures]
    conditions: Mapping[str, Mapping[str, Mean]]
    differences: Sequence[Difference]
    agreement: Mapping[str, Agreement]
    bands: Mapping[str, Band]
    norms: Sequence[Compared]
    left_out: Sequence[TrialFigures]
    flags: Sequence[tuple[str, str]]
    report: Path | None = None

    def to_dict(self) -> dict[str, Any]:
        """The result in schema smartshoe.study/1, without NaN or infinity."""
        return {
            "schema": SCHEMA,
            "title": self.plan.title,
            "trials": [
                {
                    "file": trial.entry.file,
                    "subject": trial.entry.subject,
                    "condition": trial.entry.condition,
                    "activity": trial.activity,
                    "summary": dict(trial.summary),
                    "figures": dict(trial.figures),
                    "flags": list(trial.flags),
                }
                for trial in self.trials
            ],
            "conditions": {
                condition: {name: mean.to_dict() for name, mean in figures.items()}
                for condition, figures in self.conditions.items()
            },
            "differences": [difference.to_dict() for difference in self.differences],
            "agreement": {name: agreement.to_dict() for name, agreement in self.agreement.items()},
            "bands": {condition: band.to_dict() for condition, band in self.bands.items()},
            "norms": [each.to_dict() for each in self.norms],
            "left_out": [{"file": trial.entry.file, "says": trial.left_out} for trial in self.left_out],
            "flags": [{"file": file, "says": says} for file, says in self.flags],
        }

    def to_frame(self) -> pd.DataFrame:
        """A DataFrame with one row for each trial: file, subject, condition, activity, and its figures."""
        import pandas as pd

        return pd.DataFrame(
            [
                {
                    "file": trial.entry.file,
                    "subject": trial.entry.subject,
                    "condition": trial.entry.condition,
                    "activity": trial.activity,
                    **trial.figures,
                }
                for trial in self.trials
            ]
        )


def study(
    path: Path | str,
    out: Path | str | None = None,
    *,
    jobs: int | None = None,
    c3d: bool = False,
    progress: Progress | None = None,
) -> StudyResult:
    """Analyse every trial of a study, and compare conditions within subjects.

    Parameters
    ----------
    path
        The study's file: ``title``, ``calibrations``, and for each trial a ``[[trial]]`` with file, subject, condition.
    out
        Folder for ``study.html``, ``study.json``, ``trials.csv`` and ``differences.csv``; None writes nothing.
    jobs
        Number of processes on this machine; None means one for each core. Each holds one trial at a time.
    c3d
        Also write each trial with its events as C3D, below ``out/c3d`` (needs the extra ``c3d``).
    progress
        Called with the number of trials done and to do.

    Raises
    ------
    ScenarioError
        The study's file is wrong.
    InputError
        A table of norms cannot be read, or names a condition that no trial has.
    RefusedError
        No trial could be used. If only some cannot, they are left out.
    """
    plan, source = read_study(path)
    if c3d and out is None:
        raise UsageError("C3D files need a folder: give out as well")
    with ExitStack() as stack:
        folder = None if out is None else stack.enter_context(results_folder(out))
        c3d_folder = stack.enter_context(results_folder(folder / "c3d")) if folder is not None and c3d else None
        base = source.path.resolve().parent
        norms = [] if plan.norms is None else read_norms(base / plan.norms, plan.conditions)
        analysed = _analysed(plan, base, c3d_folder, jobs, progress)
        if all(trial.left_out is not None for trial in analysed):
            raise RefusedError(
                f"{source.path}: none of {len(analysed)} trials can be used; the first: {analysed[0].left_out}"
            )
        result = _concluded(plan, analysed, norms)
        return result if folder is None else _written(result, folder, source.path)


def _analysed(
    plan: StudyPlan, base: Path, c3d_folder: Path | None, jobs: int | None, progress: Progress | None
) -> list[TrialFigures]:
    """Each trial's figures, in the plan's order, computed in several processes."""
    from joblib import Parallel, cpu_count, delayed

    wanted = min(int(cpu_count()) if jobs is None else jobs, len(plan.trial))
    tasks = []
    for number, entry in enumerate(plan.trial, start=1):
        c3d = None if c3d_folder is None else str(c3d_folder / f"{number:04d}_{Path(entry.file).stem}.c3d")
        tasks.append((entry, str(base), plan.calibrations, c3d))
    parallel = Parallel(n_jobs=wanted, return_as="generator", batch_size=1)
    found: list[TrialFigures] = []
    for figures in parallel(delayed(figures_of_trial)(*task) for task in tasks):
        found.append(figures)
        if progress is not None:
            progress(len(found), len(tasks))
    return found


def _concluded(plan: StudyPlan, analysed: Sequence[TrialFigures], norms: Sequence[Norm]) -> StudyResult:
    used = [trial for trial in analysed if trial.left_out is None]
    means: dict[str, dict[str, dict[str, float]]] = {}  # condition, figure, subject
    for condition in plan.conditions:
        own = [trial for trial in used if trial.entry.condition == condition]
        names = dict.fromkeys(name for trial in own for name in trial.figures)
        means[condition] = {name: _subject_means(own, name) for name in names}
    conditions = {
        condition: {name: mean_of(np.array(list(own.values()))) for name, own in figures.items()}
        for condition, figures in means.items()
        if figures
    }
    agreement = {}
    for name in dict.fromkeys(name for trial in used for name in trial.pairs):
        agreement[name] = agreement_of([trial.pairs[name] for trial in used if name in trial.pairs])
    swapped = [
        (
            trial.entry.file,
            f"left and right look swapped: {trial.entry.subject}'s other trials have the mirrored asymmetries;"
            " check which shoe is which",
        )
        for trial in swapped_trials(used)
    ]
    beside = compared(norms, means)
    unmet = [
        (str(plan.norms), f"no trial has figure {each.norm.figure!r}: use the names of trials.csv")
        for each in beside
        if not each.subjects
    ]
    return StudyResult(
        plan,
        used,
        conditions,
        _differences(plan, means),
        agreement,
        _bands(plan, used),
        beside,
        [trial for trial in analysed if trial.left_out is not None],
        [*swapped, *unmet],
    )


def _subject_means(trials: Sequence[TrialFigures], name: str) -> dict[str, float]:
    values: dict[str, list[float]] = {}
    for trial in trials:
        if name in trial.figures:
            values.setdefault(trial.entry.subject, []).append(trial.figures[name])
    return by_subject(values)


def _differences(plan: StudyPlan, means: Mapping[str, Mapping[str, Mapping[str, float]]]) -> list[Difference]:
    found: list[Difference] = []
    for start, end in combinations(plan.conditions, 2):
        for name, before in means[start].items():
            after = means[end].get(name, {})
            both = [subject for subject in before if subject in after]
            if both:
                changes = np.array([after[subject] - before[subject] for subject in both])
                found.append(Difference(start, end, name, difference_of(changes)))
    return found


def _bands(plan: StudyPlan, trials: Sequence[TrialFigures]) -> dict[str, Band]:
    """The usual force over a stride under each condition: mean over subjects, and prediction interval."""
    found: dict[str, Band] = {}
    for condition in plan.conditions:
        curves: dict[str, list[Array]] = {}
        for trial in trials:
            if trial.entry.condition == condition and trial.curve is not None:
                curves.setdefault(trial.entry.subject, []).append(trial.curve)
        if curves:
            own = np.array([np.mean(each, axis=0) for each in curves.values()])
            low, high = prediction_interval(own) or (None, None)
            found[condition] = Band(own.mean(axis=0), low, high, len(own))
    return found


def _written(result: StudyResult, folder: Path, source: Path) -> StudyResult:
    from dataclasses import replace

    from smartshoe.runs.studies._page import write_page

    result = replace(result, report=folder / "study.html")
    write_text(folder / "study.json", json_text(result.to_dict()))
    write_text(folder / "trials.csv", result.to_frame().to_csv(index=False, lineterminator="\n"))
    write_text(folder / "differences.csv", differences_text(result))
    write_page(folder / "study.html", result, source)
    return result


def differences_text(result: StudyResult) -> str:
    """The differences as CSV text, with one row for each pair of conditions and figure."""
    import pandas as pd

    columns = ["from", "to", "figure", "mean", "sd", "ci95_low", "ci95_high", "subjects", "interval"]
    rows = []
    for difference in result.differences:
        row = difference.to_dict()
        row["ci95_low"], row["ci95_high"] = row["ci95"] or (None, None)
        rows.append(row)
    return str(pd.DataFrame(rows, columns=columns).to_csv(index=False, lineterminator="\n"))
