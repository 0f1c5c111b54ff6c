"""Prints a diagnosis on a terminal: size of the error, verdict, causes, faults, limits, and what to do next."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence

from rich.console import Console
from rich.table import Table

from smartshoe.diagnosis import Cause, Diagnosis
from smartshoe.diagnosis.design import Design
from smartshoe.display import sure
from smartshoe.models.effects import in_words, listed
from smartshoe.models.effects.exposure import SAYS
from smartshoe.report.diagnosis._sentences import (
    LIKELIHOOD,
    comparison,
    fault_text,
    gain_text,
    heading,
    how_much,
    is_free_form,
    meanings,
    nearest_told,
    not_in_the_model,
    on_causes,
    parameter_text,
    shares_text,
    what_is_left,
    why_this_one,
)
from smartshoe.report.tables import USUAL, new_console, table_of
from smartshoe.report.wording import sentence, words

MOST_FAULTS = 12


def print_diagnosis(diagnosis: Diagnosis, title: str = "") -> None:
    """Print the whole diagnosis; the page written with ``--out`` has more details."""
    console = new_console()
    # The size of the error comes before the verdict: what is bad for one purpose is good for another.
    said = [text for text in (how_much(diagnosis), f"{heading(diagnosis)}.") if text is not None]
    console.print(f"{title}: {said[0]}" if title else said[0], style="bold", soft_wrap=True)
    for text in (*said[1:], sentence(diagnosis.says)):
        _line(console, text)
    if diagnosis.causes:
        _causes(console, diagnosis)
    if said_of_minor := diagnosis.says_of_minor:
        _line(console, said_of_minor)
    if diagnosis.leftover:
        _line(console, what_is_left(diagnosis))
    rows = comparison(diagnosis)
    if rows:
        table = _wrapping("before and after, on data that was not fitted", ["", "baseline", "extended", "change"])
        for row in rows:
            table.add_row(row.name, row.before, row.after, row.change)
        console.print()
        console.print(table)
        _line(console, shares_text(diagnosis))
    _several(console, "faults of the data", [fault_text(fault) for fault in diagnosis.data_faults])
    # Recordings left out may be many, a line each, so the limits come first.
    of_the_force = diagnosis.limits_of_the_force
    others = [one for one in diagnosis.limits_of_the_rest if one not in of_the_force]
    _several(console, "where the calibration's force may be off", of_the_force, most=None)
    _several(console, "limits of this data", others, most=None)
    _several(console, "recordings that were left out", diagnosis.left_out)
    if diagnosis.next_experiment is not None:
        _several(console, "what to do next", [diagnosis.next_experiment.says])


def print_design(design: Design) -> None:
    """Print which effects protocols show and distinguish, before anything is measured."""
    console = new_console()
    table = _wrapping(
        f"what these protocols tell of an effect of {100 * design.strength:g} % of full scale",
        ["effect", "shows from (% of full scale)", "cannot be told from"],
    )
    for name, least in zip(design.names, design.least, strict=True):
        shows = f"{100 * least:.2g}" if math.isfinite(least) else "never"
        table.add_row(in_words(name), shows, listed(design.cannot_be_told(name), "or") or "–")
    console.print(table)
    _line(
        console,
        "the last column names what would follow an effect as well in its place; where the row of one that is named"
        " does not name it back, it cannot follow all that the other does",
    )
    if design.left_out:
        said = "; ".join(f"{in_words(name)} needs {_channels(words)}" for name, words in design.left_out.items())
        _line(console, f"left out, since load and reading are all that is taken to be logged: {said}")
    _several(console, "limits of these protocols", design.limits, most=None)


def _channels(words: Collection[str]) -> str:
    """What must be logged, in words of the catalogue; requirements of other packages are shown as they are."""
    said = {str(word): text for word, text in SAYS.items()}
    return " and ".join(said.get(word, word) for word in sorted(words))


def _causes(console: Console, diagnosis: Diagnosis) -> None:
    table = _wrapping(
        "causes, the largest first; errors on data that was not fitted; 95 % intervals in brackets",
        ["cause", "parameter", "value", "error falls by", "sure", "or it is"],
    )
    table.columns[2].no_wrap = console.width >= USUAL  # a number and its interval on one line, if there is room
    for cause in diagnosis.causes:
        shown = [(words(name), parameter_text(value)) for name, value in cause.parameters.items()] or [("–", "–")]
        if is_free_form(cause):
            shown = [("free form", "no equation fits well enough")]
        for k, (name, value) in enumerate(shown):
            of_cause = (
                (gain_text(cause.held_out), _sure(cause), listed(cause.equivalents, "or") or "–")
                if k == 0
                else ("", "", "")
            )
            table.add_row(in_words(cause.name) if k == 0 else "", name, value, *of_cause)
    console.print()
    console.print(table)
    for said in on_causes(diagnosis):
        _line(console, said)
    for cause in diagnosis.causes:
        _line(console, _about(cause))
        for text in (_parameters(cause), not_in_the_model(cause)):
            if text:
                _line(console, f"  {text}")
    if any(nearest_told(cause) for cause in diagnosis.causes):
        _line(console, LIKELIHOOD)


def _wrapping(title: str, columns: Sequence[str]) -> Table:
    """A table that is folded, not cut, on a narrow terminal."""
    table = table_of(title, columns)
    for column in table.columns:
        column.no_wrap, column.overflow, column.min_width = False, "fold", None
    return table


def _sure(cause: Cause) -> str:
    said = sure(cause.confidence)
    return f"{said} one of these; if so, {sure(cause.law_confidence)} this one" if cause.equivalents else said


def _about(cause: Cause) -> str:
    said = f"{in_words(cause.name)}: {cause.says}; {why_this_one(cause)}"
    return f"{said}; {cause.doubt}" if cause.doubt else said


def _parameters(cause: Cause) -> str:
    """The meaning of each parameter; '' for a free form, whose numbers are not shown."""
    if is_free_form(cause):
        return ""
    said = ", ".join(f"{words(name)} ({says})" for name, says in meanings(cause).items() if says)
    return f"parameters: {said}" if said else ""


def _several(console: Console, heading: str, lines: Sequence[str], most: int | None = MOST_FAULTS) -> None:
    if not lines:
        return
    console.print(f"\n{heading}", style="bold")
    shown = lines[:most]
    for line in shown:
        _line(console, f"- {line}")
    if len(lines) > len(shown):
        _line(console, f"- and {len(lines) - len(shown)} more")


def _line(console: Console, text: str) -> None:
    console.print(text, soft_wrap=True)
