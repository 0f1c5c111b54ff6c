"""The page of a calibration: the verdict first, then a card for each unit, worst first, and its details below."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from markupsafe import Markup

from smartshoe.report.calibration import _charts as charts
from smartshoe.report.calibration import _judgement as judgement
from smartshoe.report.calibration._judgement import Judgement
from smartshoe.report.calibration._unit_report import UnitReport
from smartshoe.report.charts import Chart
from smartshoe.report.document import polylines, write_document

if TYPE_CHECKING:
    from smartshoe.report.trial import TrialSection

CARD_WIDTH, CARD_HEIGHT = 120.0, 56.0


@dataclass(frozen=True, eq=False)
class UnitCard:
    """A unit as shown on the page; ``anchor`` is the id to link to."""

    unit: UnitReport
    judged: Judgement
    anchor: str
    loop: Markup | None
    shown: Sequence[Chart]
    folded: Sequence[Chart]

    @property
    def is_open(self) -> bool:
        """Whether the unit's details are unfolded from the start."""
        return self.judged.grade != "good"

    @property
    def says(self) -> tuple[str, ...]:
        """The reason of the grade and, unless it is the same, the comparison with the static line."""
        return tuple(dict.fromkeys((self.judged.says, judgement.against_static(self.unit.validation.overall))))

    @property
    def left_percent(self) -> float:
        """The rms error after correction, in percent of full scale."""
        return judgement.error_percent(self.unit.validation)


def _small_loop(loop: charts.ResidualLoop, most_n: float) -> Markup:
    """A small drawing of the loop without axes; all units share a scale of ± ``most_n`` newtons."""
    at_n, errors = loop.at_n, loop.errors_n
    x = CARD_WIDTH * (at_n - at_n[0]) / max(float(np.ptp(at_n)), 1e-12)
    curves = []
    for kind in ("raw", "corrected"):
        around = np.concatenate([errors[f"{kind} up"], errors[f"{kind} down"][::-1], errors[f"{kind} up"][:1]])
        y = CARD_HEIGHT / 2 * (1 + around / most_n)
        points = list(zip(np.concatenate([x, x[::-1], x[:1]])[::2].tolist(), y[::2].tolist(), strict=True))
        curves.append((kind, points))
    return polylines(
        [("axis", [(0, CARD_HEIGHT / 2), (CARD_WIDTH, CARD_HEIGHT / 2)]), *curves], CARD_WIDTH, CARD_HEIGHT
    )


def cards(units: Sequence[UnitReport]) -> list[UnitCard]:
    """A card for each unit, sorted by grade and then by remaining error, the worst first."""
    loops = [charts.residual_loops(unit.validation) for unit in units]
    widest, errors = charts.common_limits(units, [loop for own in loops for loop in own])
    made = []
    for number, (unit, own) in enumerate(zip(units, loops, strict=True), 1):
        by_rate = charts.error_by_rate(unit, errors)
        shown = [*([] if by_rate is None else [by_rate]), *(charts.loop_chart(unit, loop, widest) for loop in own)]
        folded = [charts.signals(unit, recording) for recording in unit.recordings] + [charts.response(unit)]
        made.append(
            UnitCard(
                unit, judgement.judge(unit), f"unit-{number}", _small_loop(own[-1], widest[1]) if own else None,
                shown, folded,
            )
        )  # fmt: skip
    return sorted(made, key=lambda card: (judgement.WORST_FIRST.index(card.judged.grade), -card.left_percent))


def write_page(
    path: Path,
    title: str,
    about: str,
    facts: Mapping[str, str],
    units: Sequence[UnitReport],
    trial: TrialSection | None = None,
    commands: Sequence[str] = (),
    session: Sequence[tuple[str, str]] = (),
) -> Path:
    """Write the report to ``path``, completely or not at all, and return the path.

    ``commands`` reproduce the report and its data; ``session`` are the rows of a session's card, as (topic, text).
    """
    made = cards(units)
    grade, says = judgement.headline([card.judged for card in made])
    return write_document(
        path,
        "calibration.html",
        {
            "title": title,
            "about": about,
            "facts": facts,
            "grade": grade,
            "headline": says,
            "cards": made,
            "trial": trial,
            "commands": commands,
            "session": session,
            "good_percent": judgement.GOOD_PERCENT,
            "bad_percent": judgement.BAD_PERCENT,
            "loop_percent": judgement.LOOP_PERCENT,
        },
    )
