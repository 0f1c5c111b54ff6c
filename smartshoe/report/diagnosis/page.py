"""The HTML page of a diagnosis: what is wrong, why, what was added, what it gained, what to do next."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from smartshoe.atomic import write_text
from smartshoe.diagnosis.result import Cause, Diagnosis
from smartshoe.report.diagnosis import charts, figures, sentences
from smartshoe.report.diagnosis.views import Map, by_load_and_rate, by_place_and_cycle, evidence
from smartshoe.report.numbers import plain
from smartshoe.report.wording import sentence


@dataclass(frozen=True, slots=True)
class Picture:
    """A figure: what to see in it, how to read it, and its SVG."""

    title: str
    reading: str
    svg: Markup


@dataclass(frozen=True, slots=True)
class Card:
    """A cause as the page shows it."""

    title: str
    cause: Cause
    sure: str
    gain: str
    parameters: Sequence[tuple[str, str, str]]
    why: str
    equivalents: Sequence[sentences.Neighbour]
    rivals: Sequence[sentences.Neighbour]


def write_diagnosis_page(
    path: Path, diagnosis: Diagnosis, title: str, facts: Mapping[str, str], protocol_file: str | None = None
) -> Path:
    """Write the page to ``path``, whole or not at all, and return it.

    ``facts``: small print by name (files, version). ``protocol_file``: name of the file beside the page that holds
    the next experiment's protocol.
    """
    environment = Environment(
        loader=PackageLoader("smartshoe.report"), autoescape=True, undefined=StrictUndefined, trim_blocks=True
    )
    environment.filters.update(plain=plain, words=sentences.words, sentence=sentence, fault=sentences.fault_text)
    page = environment.get_template("diagnosis.html").render(
        title=title,
        facts=facts,
        diagnosis=diagnosis,
        heading=sentences.HEADINGS[diagnosis.verdict],
        how_much=sentences.how_much(diagnosis),
        numbers=_numbers(diagnosis),
        comparison=sentences.comparison(diagnosis),
        shares=sentences.shares_text(diagnosis),
        cards=[_card(number, cause) for number, cause in enumerate(diagnosis.causes, 1)],
        pictures=_pictures(diagnosis),
        minor=sentences.listed(sorted(diagnosis.minor), "and"),
        separates=sentences.listed(diagnosis.next_experiment.separates, "and") if diagnosis.next_experiment else "",
        protocol_file=protocol_file,
    )
    write_text(path, page)
    return path


def _numbers(diagnosis: Diagnosis) -> list[tuple[str, str]]:
    """The few numbers that stand in large letters: (number, what it is)."""
    before, after = diagnosis.baseline, diagnosis.extended
    if before is None or after is None:
        return []
    said = [
        (
            f"{plain(sentences.share_of_full_scale(diagnosis, before.rmse), 2)} %",
            "of full scale: error of the simulation",
        )
    ]
    if diagnosis.causes:
        said.append(
            (
                f"{plain(sentences.share_of_full_scale(diagnosis, after.rmse), 2)} %",
                "of full scale: error with the causes added",
            )
        )
        part = sentences.shares(diagnosis)
        said.append(
            (
                f"{100 * part.explained / max(part.explained + part.left, 1e-9):.0f} %",
                "of what could be explained is explained",
            )
        )
    else:
        said.append((f"{plain(sentences.shares(diagnosis).noise, 3)} %", "of the error's variance is noise"))
    count = len(diagnosis.causes)
    said.append((str(count), "cause named" if count == 1 else "causes named"))
    return said


def _card(number: int, cause: Cause) -> Card:
    says = {parameter.name: parameter.says for parameter in cause.effect.parameters}
    return Card(
        f"{number}. {sentences.words(cause.name).capitalize()}",
        cause,
        sentences.sure(cause.confidence),
        sentences.gain_sentence(cause.held_out),
        [
            (sentences.words(name), sentences.parameter_text(parameter), says.get(name, ""))
            for name, parameter in cause.parameters.items()
        ],
        sentence(sentences.why_this_one(cause)),
        sentences.neighbours(cause, cause.equivalents),
        sentences.other_rivals(cause),
    )


def _pictures(diagnosis: Diagnosis) -> dict[str, list[Picture]]:
    """Figures by section; those that have nothing to show are left out."""
    unit = diagnosis.unit
    found = evidence(diagnosis.traces, diagnosis.full_scale_load_n)
    maps: tuple[Map | None, Map | None] = (None, None)
    if found is not None:
        maps = (by_load_and_rate(found, found.after, diagnosis.traces), by_place_and_cycle(found, found.after))
    scale = f" One percent of full scale is {plain(diagnosis.full_scale_reading / 100)} {unit}."
    band = "Lines are means, bands one standard deviation; a line that leaves zero is structure, a band alone is noise."
    before_after = " before and after, on the same axes" if found and found.is_changed else ""
    steps = diagnosis.next_experiment.steps if diagnosis.next_experiment else None
    given: dict[str, list[tuple[str, str, str | None]]] = {
        "beside": [
            (
                "Where the simulation leaves the measurement",
                "Left the load cycle on which the baseline is furthest off, among those that were not fitted; right the"
                " recording that it is from (the cycle is shaded). Above the signals, below the error." + scale,
                figures.beside_measurement(diagnosis.traces, unit),
            ),
            (
                "The loop of reading against load",
                "A slow and a fast cycle. Below, a straight line is taken off, so that the loop can be seen: the"
                " simulation is right where it lies on the grey line.",
                figures.loops(diagnosis.traces, unit),
            ),
            (
                f"The error{before_after}, over time, cycles and frequency",
                f"{band} Shaded: not fitted. Where all is explained, the density keeps no rise at low frequencies.",
                figures.residual_by_course(found, unit) if found else None,
            ),
            (
                f"The error{before_after}, over load, reading and rate",
                f"Two lines that part between loading and unloading are a loop. {band}",
                figures.residual_by_state(found, unit) if found else None,
            ),
        ],
        "screening": [
            (
                "What each effect alone could take off the error",
                "Effects of the catalogue, the strongest first. A long bar is a candidate, no proof: effects that look"
                " alike share their bars, and causes are chosen together.",
                charts.screening(diagnosis),
            ),
            (
                "How alike the effects look in this data",
                "1 is alike in every sample, 0 is unlike. Where it is above 0.95 (bold), small effects of the two kinds"
                " cannot be told apart; what full fits make of them is said above, cause by cause.",
                charts.likeness(diagnosis),
            ),
        ],
        "gained": [("How the error divides", "", charts.error_shares(diagnosis))],
        "left": [
            (
                "Where the remaining error sits",
                "Means of the error that the extended simulation leaves; red is read higher than simulated, blue lower."
                " Columns, rows or corners of one colour are structure, a mixture is noise." + scale,
                charts.what_is_left(*maps, unit),
            )
        ],
        "faults": [
            (
                "When the faults are there",
                "Grey is the recording, orange reaches from the first sample at fault to the last (with the share of"
                " samples at fault), black is what was left out of every fit.",
                charts.data_faults(diagnosis),
            )
        ],
        "next": [("The load to run next", "", charts.protocol(steps) if steps else None)],
    }
    # The SVG comes from matplotlib, which escapes the texts it draws.
    return {
        section: [Picture(title, reading, Markup(svg)) for title, reading, svg in pictures if svg is not None]
        for section, pictures in given.items()
    }
