"""How results are shown to users: one line, a table as text, the same table in a notebook, a figure."""

from __future__ import annotations

import html
import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MOST_NAMES, MOST_LETTERS = 10, 90  # column names in a sentence, and their letters, so that it keeps its end
LONGEST_NAME = 60  # letters of a name in a sentence; of a longer one, half of them from each end
SUREST = 0.99  # largest probability given in percent


def first_names(names: Sequence[str]) -> str:
    """The first of the names as text, at most `MOST_NAMES` and about `MOST_LETTERS`, and how many more there are."""
    shown: list[str] = []
    for name in names[:MOST_NAMES]:
        short = name if len(name) <= LONGEST_NAME else f"{name[: LONGEST_NAME // 2]}...{name[-LONGEST_NAME // 2 :]}"
        if shown and len(", ".join([*shown, short])) > MOST_LETTERS:
            break
        shown.append(short)
    more = f" and {len(names) - len(shown)} more" if len(names) > len(shown) else ""
    return ", ".join(shown) + more


def counted(count: int, what: str) -> str:
    """``count`` and ``what``, with the s of a plural unless it is one."""
    return f"{count} {what}{'' if count == 1 else 's'}"


@dataclass(frozen=True, slots=True)
class SummaryTable:
    """A ``title``, rows of cells under ``columns``, and remarks below them, one sentence each."""

    title: str
    columns: Sequence[str]
    rows: Sequence[Sequence[str]]
    remarks: Sequence[str] = ()

    def to_text(self) -> str:
        """Aligned columns: the first to the left, the others to the right."""
        lines = [self.title]
        if self.rows:
            table = [self.columns, *self.rows]
            widths = [max(len(row[index]) for row in table) for index in range(len(self.columns))]
            for row in table:
                first, *rest = (
                    cell.rjust(width) if index else cell.ljust(width)
                    for index, (cell, width) in enumerate(zip(row, widths, strict=True))
                )
                lines.append("  ".join([first, *rest]).rstrip())
        return "\n".join([*lines, *self.remarks])

    def to_html(self) -> str:
        """The table for a notebook; every text is escaped."""
        head = "".join(f"<th>{html.escape(cell)}</th>" for cell in self.columns)
        body = "".join("<tr>" + "".join(f"<td>{html.escape(cell)}</td>" for cell in row) + "</tr>" for row in self.rows)
        table = f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>" if self.rows else ""
        below = "".join(f"<p>{html.escape(remark)}</p>" for remark in self.remarks)
        return f"<div><p><b>{html.escape(self.title)}</b></p>{table}{below}</div>"


class Shown(ABC):
    """A result with a one-line ``repr`` and an HTML table in notebooks, both from one `SummaryTable`."""

    @abstractmethod
    def _summary_table(self) -> SummaryTable: ...

    @abstractmethod
    def plot(self) -> Figure:
        """A matplotlib figure; matplotlib is imported on the first call."""

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {' '.join(self._summary_table().title.split())}>"

    def _repr_html_(self) -> str:
        return self._summary_table().to_html()


class Summarised(Shown):
    """A `Shown` result whose table is also available as text."""

    def summary(self) -> str:
        """The table as text of several lines."""
        return self._summary_table().to_text()


def significant(value: float | None, digits: int = 4) -> str:
    """``value`` to ``digits`` significant digits; a dash where there is none."""
    return "–" if value is None or value != value else f"{value:.{digits}g}"


def rounded(value: float, digits: int = 2) -> str:
    """``value`` to ``digits`` significant digits, without an exponent up to a million."""
    return f"{float(f'{value:.{digits}g}'):,g}"


def percent(share: float, *, signed: bool = False) -> str:
    """A share in percent to two digits; of a hundred and more, to whole numbers."""
    value = 100.0 * share
    sign = "+" if signed else ""
    return f"{value:{sign}.0f} %" if abs(value) >= 99.5 else f"{value:{sign}.2g} %"


def sure(probability: float) -> str:
    """A probability in percent for the user; never a hundred percent."""
    if not math.isfinite(probability):
        return "–"
    return f"over {100 * SUREST:.0f} %" if probability > SUREST else f"{100 * probability:.0f} %"


def moment(time_s: float, digits: int = 6) -> str:
    """A time of a recording in seconds with ``digits`` digits; later times keep the decimals that 100 s would have.

    A clock that counts from 1970 has ten digits before its decimal point, so that six digits could not distinguish
    times.
    """
    late = abs(time_s) >= 10.0 ** (digits - 1)
    if not late:
        return f"{time_s:.{digits}g}"
    fixed = f"{time_s:.{digits - 3}f}"
    return fixed.rstrip("0").rstrip(".") if "." in fixed else fixed


def duration(time_s: float, seconds_below_s: float = 120.0, hour_digits: int = 3) -> str:
    """A duration to three digits, in s below ``seconds_below_s``, in min below two hours, else in h."""
    for limit_s, unit_s, name in ((seconds_below_s, 1.0, "s"), (7200.0, 60.0, "min")):
        if time_s < limit_s:
            return f"{time_s / unit_s:.3g} {name}"
    return f"{time_s / 3600.0:.{hour_digits}g} h"


def panels(count: int, *, height: float = 2.6) -> tuple[Figure, list[Axes]]:
    """A figure with ``count`` axes below each other, created without pyplot, so that no figure stays open."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8.0, height * count + 0.4), layout="constrained")
    return figure, list(figure.subplots(count, 1, squeeze=False)[:, 0])
