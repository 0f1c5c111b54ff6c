"""The HTML page of a diagnosis: the size of the error, its causes, what was gained, what to do next, and details."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from smartshoe.diagnosis import Cause, Diagnosis, described
from smartshoe.models.effects import in_words
from smartshoe.report.charts import Chart
from smartshoe.report.diagnosis import _charts as charts
from smartshoe.report.diagnosis import _sentences as sentences
from smartshoe.report.diagnosis import grids
from smartshoe.report.diagnosis.views import EvidenceView, by_load_and_rate, by_place_and_cycle, evidence
from smartshoe.report.document import write_document
from smartshoe.report.numbers import plain
from smartshoe.report.wording import sentence, words

GRADES = {"adequate": "good", "explained": "look", "partly_explained": "look", "unexplained": "bad", "refused": "bad"}


@dataclass(frozen=True, slots=True)
class Card:
    """A cause as shown on the page."""

    title: str
    cause: Cause
    sure: str
    gain: str
    parameters: Sequence[tuple[str, str, str]]
    is_free_form: bool
    not_in_the_model: str
    why: str
    equivalents: Sequence[sentences.Neighbour]
    likelier: Sequence[sentences.Neighbour]
    rivals: Sequence[sentences.Neighbour]


def write_diagnosis_page(
    path: Path, diagnosis: Diagnosis, title: str, facts: Mapping[str, str], protocol_file: str | None = None
) -> Path:
    """Write the page to ``path``, completely or not at all, and return the path.

    ``facts`` is small print by name (files, version). ``protocol_file`` is the name of the file next to the page that
    holds the protocol of the next experiment.
    """
    said = sentences.heading(diagnosis), sentence(diagnosis.says)
    following, found = diagnosis.next_experiment, evidence(diagnosis.traces, diagnosis.full_scale_load_n)
    shown: dict[str, Any] = {
        "title": title,
        "facts": facts,
        "diagnosis": diagnosis,
        "grade": GRADES[diagnosis.verdict],
        "headline": sentences.how_much(diagnosis),
        "said": said,
        "numbers": _numbers(diagnosis),
        "gained": sentences.what_was_gained(diagnosis),
        "left_over": sentence(sentences.what_is_left(diagnosis)),
        "nothing_left": sentences.nothing_left(diagnosis),
        "why_no_name": sentences.why_no_name(diagnosis),
        "comparison": sentences.comparison(diagnosis),
        "shares": sentences.shares_text(diagnosis),
        "parts": _parts(diagnosis),
        "on_causes": " ".join(sentences.on_causes(diagnosis)),
        "likelihood": sentences.LIKELIHOOD,
        "cards": [_card(number, cause) for number, cause in enumerate(diagnosis.causes, 1)],
        "minor": diagnosis.minor_in_words,
        "bars": [(in_words(bar.name), bar, plain(bar.fall, 3)) for bar in grids.ranked(diagnosis)],
        "named": in_words,
        "is_changed": any(map(charts.differs, diagnosis.traces)),
        "likeness": grids.likeness(diagnosis),
        "protocol_file": protocol_file,
        "next_load": charts.protocol(following.steps) if following and following.steps else None,
        "fault_lines": [sentence(sentences.fault_text(fault)) + (" (Minor.)" if fault.severity == "minor" else "")
                        for fault in diagnosis.data_faults],
        "fault_charts": charts.faults(diagnosis),
        "thresholds": [(words(one["name"]), _value(one["value"]), one["unit"], one["meaning"], one["origin"])
                       for one in described(diagnosis.thresholds)],
    }  # fmt: skip
    return write_document(path, "diagnosis.html", {**shown, **_of_traces(diagnosis, found)})


def _of_traces(diagnosis: Diagnosis, found: EvidenceView | None) -> dict[str, Any]:
    """Charts and grids of the signals; empty if no sample can be used."""
    traces, unit = diagnosis.traces, diagnosis.unit
    if found is None:
        return {"before_after": [], "over": [], "loops": [], "left": []}
    over = [*charts.over_state(found, unit), charts.over_cycles(found, unit), charts.over_frequency(found, unit)]
    maps = by_load_and_rate(found, found.after, traces), by_place_and_cycle(found, found.after)
    return {
        "before_after": _without_none([charts.over_time(found, unit), charts.worst(traces, unit)]),
        "over": _without_none(over),
        "loops": charts.loops(traces, unit),
        "left": grids.left_grids(*maps, unit),
    }


def _without_none(given: Sequence[Chart | None]) -> list[Chart]:
    return [chart for chart in given if chart is not None]


def _value(value: Any) -> str:
    if isinstance(value, tuple):
        return ", ".join(_value(one) for one in value)
    return f"{value:g}" if isinstance(value, float) else str(value)


def _parts(diagnosis: Diagnosis) -> list[tuple[str, str, float]]:
    """The parts of the baseline's error variance, each with its label, colour and percent."""
    part = None if diagnosis.baseline is None else sentences.shares(diagnosis)
    if part is None:
        return []
    return [
        (sentences.followed(diagnosis), "corrected", part.explained),
        ("could be explained, and is left", "raw", part.left),
        ("noise", "soft", part.noise),
    ]


def _numbers(diagnosis: Diagnosis) -> list[tuple[str, str]]:
    """The few figures shown in large letters, as (number, what it is)."""
    before, after = diagnosis.baseline, diagnosis.extended
    if before is None or after is None:
        return []
    is_of_recordings = sentences.is_of_recordings(diagnosis)
    part = None if is_of_recordings else sentences.shares(diagnosis)
    said = [
        (
            f"{plain(sentences.share_of_full_scale(diagnosis, before.rmse), 2)} %",
            "of full scale: error of the simulation",
        )
    ]
    if diagnosis.causes and not is_of_recordings and diagnosis.rejected is None:
        said.append(
            (
                f"{plain(sentences.share_of_full_scale(diagnosis, after.rmse), 2)} %",
                "of full scale: error of the extended model",
            )
        )
    if part is not None and diagnosis.causes:
        said.append(
            (
                sentences.percent_of_whole(100 * part.explained / max(part.explained + part.left, 1e-9)),
                "of what could be explained is explained",
            )
        )
    elif part is not None:
        said.append((f"{plain(part.noise, 3)} %", "of the error's variance is noise"))
    count = len(diagnosis.causes)
    said.append((str(count), "cause named" if count == 1 else "causes named"))
    return said


def _card(number: int, cause: Cause) -> Card:
    says = sentences.meanings(cause)
    return Card(
        f"{number}. {in_words(cause.name).capitalize()}",
        cause,
        sentences.how_sure(cause),
        sentences.gain_sentence(cause.held_out),
        [
            (words(name), sentences.parameter_text(parameter), says[name])
            for name, parameter in cause.parameters.items()
        ],
        sentences.is_free_form(cause),
        sentence(sentences.not_in_the_model(cause)),
        sentence(sentences.why_this_one(cause)),
        sentences.neighbours(cause, cause.equivalents),
        sentences.likelier(cause),
        sentences.less_likely(cause),
    )
