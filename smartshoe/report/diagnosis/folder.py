"""Writes a diagnosis as files: the page, the result as JSON, and the protocol of the next experiment."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from smartshoe.diagnosis import Diagnosis
from smartshoe.files.atomic import json_text, make_folder, write_text
from smartshoe.report.diagnosis._page import write_diagnosis_page
from smartshoe.report.diagnosis._protocol_file import protocol_text, table_name


def publish_diagnosis(
    folder: Path, found: Diagnosis, title: str, facts: Mapping[str, str], figures: str | None = None
) -> dict[str, Path]:
    """Write ``diagnosis.html``, ``diagnosis.json`` and the next protocol below ``folder``.

    ``figures`` is the format (svg, pdf, png) of figures for papers, None for none. Returns the paths to report, by what
    they are.
    """
    page = folder / "diagnosis.html"
    written = {"report": page}
    protocol_file = None
    following = found.next_experiment
    if following is not None and following.steps is not None:
        protocol_file = f"{table_name(following.steps.name)}.toml"
        written["next protocol"] = folder / protocol_file
        write_text(folder / protocol_file, protocol_text(following.steps, [following.says]))
    write_text(folder / "diagnosis.json", json_text(found.to_dict()))
    write_diagnosis_page(page, found, f"Diagnosis of {title}", facts, protocol_file)
    if figures is not None:
        from smartshoe.report.paper.diagnosis import write_figures

        written["figures"] = make_folder(folder / "figures")
        write_figures(written["figures"], found, figures)
    return written
