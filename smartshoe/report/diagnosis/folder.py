"""Writes a diagnosis as files: the page, the result as JSON, and the protocol of the next experiment."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

from smartshoe.diagnosis import Diagnosis
from smartshoe.files.atomic import json_text, make_folder, write_text
from smartshoe.report.diagnosis._page import write_diagnosis_page
from smartshoe.report.diagnosis._protocol_file import earlier_protocols, protocol_text, table_name

FIGURES = (
    "worst_cycle", "loops", "screening", "likeness", "error_by_course", "error_by_state", "what_is_left",
)  # fmt: skip
ENDINGS = ("svg", "pdf", "png")


class Published(NamedTuple):
    """What `publish_diagnosis` did: paths to report, by what they are, and files of an earlier diagnosis taken away."""

    paths: dict[str, Path]
    taken_away: list[Path]


def publish_diagnosis(
    folder: Path, found: Diagnosis, title: str, facts: Mapping[str, str], figures: Sequence[str] = ()
) -> Published:
    """Write ``diagnosis.html``, ``diagnosis.json`` and the next protocol below ``folder``.

    ``figures`` are the `ENDINGS` of figures for papers. What an earlier diagnosis wrote there and this one does not, a
    protocol or figures, is taken away last: beside the new page it would be taken for its own.
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
    kept = set(written.values())
    if figures:
        from smartshoe.report.paper.diagnosis import write_figures

        written["figures"] = make_folder(folder / "figures")
        kept |= set(write_figures(written["figures"], found, figures))
    earlier = [path for path in _earlier_files(folder) if path not in kept]
    for path in earlier:
        path.unlink(missing_ok=True)
        with suppress(OSError):  # a folder that is not empty is kept
            path.parent.rmdir()
    return Published(written, earlier)


def _earlier_files(folder: Path) -> list[Path]:
    """The protocols and figures in ``folder`` that a diagnosis wrote there, and another one may not write again."""
    names = (f"diagnosis_{name}.{ending}" for name in FIGURES for ending in ENDINGS)
    figures = [path for name in names if (path := folder / "figures" / name).is_file()]
    return [*earlier_protocols(folder), *figures]
