"""Writes a diagnosis' figures for papers as files."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from matplotlib.figure import Figure

from smartshoe.diagnosis import Diagnosis
from smartshoe.report.diagnosis.views import by_load_and_rate, by_place_and_cycle, evidence
from smartshoe.report.paper import _diagnosis_reasoning as diagnosis_reasoning
from smartshoe.report.paper import _diagnosis_signals as diagnosis_signals
from smartshoe.report.paper.drawing import save


def figures_of(diagnosis: Diagnosis) -> Iterator[tuple[str, Figure]]:
    """Yield the figures with their names; those with nothing to show are left out."""
    traces, unit = diagnosis.traces, diagnosis.unit
    found = evidence(traces, diagnosis.full_scale_load_n)
    drawn = {
        "worst_cycle": diagnosis_signals.beside_measurement(traces, unit),
        "loops": diagnosis_signals.loops(traces, unit),
        "screening": diagnosis_reasoning.screening(diagnosis),
        "likeness": diagnosis_reasoning.likeness(diagnosis),
    }
    if found is not None:
        drawn["error_by_course"] = diagnosis_signals.residual_by_course(found, unit)
        drawn["error_by_state"] = diagnosis_signals.residual_by_state(found, unit)
        drawn["what_is_left"] = diagnosis_reasoning.what_is_left(
            by_load_and_rate(found, found.after, traces), by_place_and_cycle(found, found.after), unit
        )
    for name, figure in drawn.items():
        if figure is not None:
            yield name, figure


def write_figures(folder: Path, diagnosis: Diagnosis, endings: Sequence[str]) -> list[Path]:
    """Write the figures as ``diagnosis_WHAT`` with each of ``endings`` below ``folder``; returns the paths."""
    return [
        path for name, figure in figures_of(diagnosis) for path in save(figure, folder, f"diagnosis_{name}", endings)
    ]
