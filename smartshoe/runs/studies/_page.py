"""The page of a study: differences between conditions, figures by condition and by trial, and trials left out."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from smartshoe.report.charts import Chart, Line, Panel
from smartshoe.report.document import write_document
from smartshoe.report.numbers import plain
from smartshoe.runs.studies._norms import Compared
from smartshoe.runs.studies._statistics import Agreement, Mean
from smartshoe.runs.studies._trials import TrialFigures
from smartshoe.version import __version__

if TYPE_CHECKING:
    from smartshoe.runs.studies._running import Difference, StudyResult

COLOURS = ("reading", "raw", "corrected", "toe", "heel", "meta4")
SHOWN = {
    "cadence_steps_per_min": "cadence (steps/min)",
    "stride_time_s": "stride time (s)",
    "stride_time_s.cv_percent": "variation of stride time (%)",
    "stance_percent": "stance (% of stride)",
    "double_support_percent": "double support (% of stride)",
    "flight_percent": "flight (% of stride)",
    "asymmetry_percent": "asymmetry (%)",
    "peak_body_weight_percent": "peak force (% of body weight)",
    "impulse_body_weight_percent_s": "impulse (% of body weight × s)",
    "loading_rate_n_per_s": "loading rate (N/s)",
}  # labels on the page, by the figures' names in the files
NAMED = 3  # number of trials that a sentence names
AGREED = {
    "stance_time_s": ("stance time", "s"),
    "stance_percent": ("stance", "% of stride"),
    "peak_n": ("peak force", "N"),
    "impulse_n_s": ("impulse", "N s"),
}


def write_page(path: Path, result: StudyResult, source: Path) -> None:
    """Write the page to ``path``, completely or not at all."""
    figures = shown_figures(result)
    subjects = {trial.entry.subject for trial in result.trials}
    write_document(
        path,
        "study.html",
        {
            "title": result.plan.title,
            "about": result.plan.about,
            "grade": "look" if result.left_out or result.flags else "good",
            "headline": headline(result),
            "facts": {
                "study": source.name,
                "subjects": str(len(subjects)),
                "trials": str(len(result.trials)),
                "left out": str(len(result.left_out)),
                "smartshoe": __version__,
            },
            "left_out": [(trial.entry.file, trial.left_out) for trial in result.left_out],
            "flags": [*result.flags, *careful(result)],
            "conditions": list(result.conditions),
            "rows": [(SHOWN[name], [_mean(own.get(name)) for own in result.conditions.values()]) for name in figures],
            "differences": [_difference_row(each) for each in result.differences if each.figure in figures],
            "subjects": [(subject, _rows_of_subject(result, subject, figures[:6])) for subject in sorted(subjects)],
            "figures": [SHOWN[name] for name in figures],
            "trials": [_trial_row(trial, figures) for trial in result.trials],
            "bands": _band_chart(result),
            "norms": [_norm_row(each) for each in result.norms],
            "agreement": [_agreement_row(name, each) for name, each in result.agreement.items()],
            "bland_altman": [_bland_altman(name, result) for name in result.agreement],
            "command": f"smartshoe study {source} --out {path.parent}",
        },
    )  # fmt: skip


def shown_figures(result: StudyResult) -> list[str]:
    """The figures of `SHOWN` that at least one trial has; all others are only in the files."""
    return [name for name in SHOWN if any(name in trial.figures for trial in result.trials)]


def careful(result: StudyResult) -> list[tuple[str, str]]:
    """The flags of the trials, each sentence once, with the trials that it concerns."""
    by_flag: dict[str, list[str]] = {}
    for trial in result.trials:
        for flag in trial.flags:
            files = by_flag.setdefault(str(flag["says"]), [])
            if trial.entry.file not in files:
                files.append(trial.entry.file)
    return [(_some(files, len(result.trials)), says) for says, files in by_flag.items()]


def _some(files: list[str], of: int) -> str:
    """A few files by name, and the number of the others."""
    if len(files) == of > 1:
        return f"all {of} trials"
    return ", ".join(files[:NAMED]) + (f" and {len(files) - NAMED} more" if len(files) > NAMED else "")


def headline(result: StudyResult) -> str:
    """One sentence that says which figures clearly differ between conditions."""
    clear = [each for each in result.differences if each.figure in SHOWN and is_clear(each.change)]
    if len(result.conditions) < 2:
        return "one condition only: there is nothing to compare, and its figures stand below"
    if not result.differences:
        return "no subject did two conditions: differences within subjects cannot be estimated"
    if not clear:
        return "no figure differs clearly between conditions (each interval holds zero, or there is none)"
    sentences = []
    for each in clear[:3]:
        sign = "+" if each.change.mean > 0 else ""
        sentences.append(f"{SHOWN[each.figure]} {sign}{plain(each.change.mean, 2)} from {each.start} to {each.end}")
    return "; ".join(sentences) + (f"; {len(clear) - 3} more" if len(clear) > 3 else "")


def is_clear(mean: Mean) -> bool:
    """Whether the interval excludes zero."""
    return mean.ci95 is not None and (mean.ci95[0] > 0.0 or mean.ci95[1] < 0.0)


def _mean(mean: Mean | None) -> str:
    if mean is None:
        return "–"
    spread = "" if mean.sd is None else f" ± {plain(mean.sd, 2)}"
    interval = "" if mean.ci95 is None else f" ({plain(mean.ci95[0])} … {plain(mean.ci95[1])})"
    return f"{plain(mean.mean, 4)}{spread}{interval}"


def _difference_row(each: Difference) -> tuple[str, list[str], bool]:
    change = each.change
    interval = "–" if change.ci95 is None else f"{plain(change.ci95[0])} … {plain(change.ci95[1])}"
    cells = [SHOWN[each.figure], plain(change.mean), interval, str(change.subjects), change.method]
    return f"{each.start} to {each.end}", cells, is_clear(change)


def _rows_of_subject(result: StudyResult, subject: str, figures: list[str]) -> list[tuple[str, list[str]]]:
    return [
        (SHOWN[name], [_of_subject(result, subject, condition, name) for condition in result.conditions])
        for name in figures
    ]


def _of_subject(result: StudyResult, subject: str, condition: str, name: str) -> str:
    own = [
        trial.figures[name]
        for trial in result.trials
        if trial.entry.subject == subject and trial.entry.condition == condition and name in trial.figures
    ]
    return plain(float(np.mean(own)), 4) if own else "–"


def _trial_row(trial: TrialFigures, figures: list[str]) -> tuple[str, str, str, str, list[str]]:
    cells = [plain(trial.figures.get(name), 4) for name in figures]
    return trial.entry.file, trial.entry.subject, trial.entry.condition, trial.activity, cells


def _band_chart(result: StudyResult) -> Chart | None:
    if not result.bands:
        return None
    x = np.arange(next(iter(result.bands.values())).mean.size, dtype=float)
    lines = [
        Line(condition, band.mean, COLOURS[number % len(COLOURS)], low=band.low, high=band.high)
        for number, (condition, band) in enumerate(result.bands.items())
    ]
    sources = "; ".join(f"{condition}: {band.source}" for condition, band in result.bands.items())
    says = f"From {sources}. A band is where a further subject lies with 95 %, if subjects spread normally."
    return Chart("Force of a foot over a stride", says, "stride (%)", x, [Panel("force (% of body weight)", lines)])


def _norm_row(each: Compared) -> tuple[str, list[str]]:
    norm = each.norm
    within = f"{each.subjects - len(each.outside)} of {each.subjects}"
    outside = _some(list(each.outside), 0) or "–"
    cells = [each.condition, f"{plain(norm.low)} … {plain(norm.high)}", within, outside, norm.source]
    return SHOWN.get(norm.figure, norm.figure), cells


def _agreement_row(name: str, each: Agreement) -> tuple[str, list[str]]:
    bias = "–" if each.bias_ci95 is None else f"{plain(each.bias_ci95[0])} … {plain(each.bias_ci95[1])}"
    half = "" if each.limits_ci95_half is None else f" (± {plain(each.limits_ci95_half, 2)})"
    icc = "–"
    if each.icc is not None and each.icc_ci95 is not None:
        icc = f"{each.icc:.3f} ({each.icc_ci95[0]:.3f} … {each.icc_ci95[1]:.3f})"
    limits = f"{plain(each.limits[0])} … {plain(each.limits[1])}{half}"
    return "{} ({})".format(*AGREED[name]), [plain(each.bias), bias, limits, icc, str(each.strides), str(each.trials)]


def _bland_altman(name: str, result: StudyResult) -> Chart:
    pairs = np.concatenate([trial.pairs[name] for trial in result.trials if name in trial.pairs])
    middle, difference = pairs.mean(axis=1), pairs[:, 0] - pairs[:, 1]
    order = np.argsort(middle, kind="stable")
    found = result.agreement[name]
    flat = np.ones(middle.size)
    lines = [
        Line("strides", difference[order], "reading", "points"),
        Line("bias", found.bias * flat, "load"),
        Line("limits of agreement", found.limits[0] * flat, "raw", "dashed"),
        Line("upper limit", found.limits[1] * flat, "raw", "dashed"),
    ]
    limits = f"{plain(found.limits[0])} … {plain(found.limits[1])}"
    says = f"Ours less the reference: bias {plain(found.bias)}, 95 % of strides within {limits}."
    what, unit = AGREED[name]
    panels = [Panel(f"difference ({unit})", lines)]
    return Chart(f"Bland-Altman: {what}", says, f"mean of both ({unit})", middle[order], panels)
