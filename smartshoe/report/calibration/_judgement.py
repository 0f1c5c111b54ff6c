"""Judges whether a unit's calibration can be trusted, as a grade and a sentence."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from smartshoe.calibration.validation import RateResult, Validation
from smartshoe.report.calibration._unit_report import UnitReport
from smartshoe.report.numbers import plain

Grade = Literal["good", "look", "bad"]

# Limits of the error (rms) in percent of full scale: 0.5 is the class of a good industrial load cell; 2 is what a table
# of weights reaches with these units without any model.
GOOD_PERCENT, BAD_PERCENT = 0.5, 2.0
LOOP_PERCENT = 1.0  # of full scale, between loading and unloading after correction: widest acceptable loop
WORTH_PERCENT = 5.0  # a smaller gain over the static line is not worth a filter
FRICTION_SHARE = 0.5  # of the widest remaining loop: at the slowest rate the loop of a lag is narrower than this

WORST_FIRST: tuple[Grade, ...] = ("bad", "look", "good")


@dataclass(frozen=True, slots=True)
class Judgement:
    """A unit's grade, its reason in a few words, and advice; ``does`` is empty if nothing needs to be done."""

    unit: str
    grade: Grade
    says: str
    does: str = ""

    @property
    def whole(self) -> str:
        """Reason and advice as one clause."""
        return f"{self.says}: {self.does}" if self.does else self.says


def error_percent(validation: Validation) -> float:
    """The rms error after correction, in percent of full scale."""
    return 100.0 * validation.overall.rmse_compensated_n / validation.full_scale_n


def looks_like_friction(rates: Sequence[RateResult]) -> bool:
    """Whether a wide loop remains at every rate, including the slowest."""
    widths = [rate.hysteresis_compensated_percent for rate in rates]
    known = [width for width in widths if width is not None]
    if len(known) < 2 or widths[0] is None:
        return False
    return max(known) > LOOP_PERCENT and widths[0] >= FRICTION_SHARE * max(known)


def against_static(overall: RateResult) -> str:
    """A text that compares the corrected error with that of the best static line."""
    gain = overall.improvement_over_static_percent
    static, left = plain(overall.rmse_static_n), plain(overall.rmse_compensated_n)
    if gain is None:
        return "a static line leaves no error here"
    if gain <= -0.5:
        more = plain(-gain, 2)
        return f"the filter is worse than a static line: it leaves {left} N, the line {static} N ({more} % more)"
    if gain < WORTH_PERCENT:
        return f"the filter gains hardly anything: it leaves {left} N, a static line {static} N"
    return f"the filter leaves {left} N where the best static line leaves {static} N: {plain(gain, 2)} % less"


def judge(unit: UnitReport) -> Judgement:
    """The unit's grade: "bad" is not to be used, "look" needs to be understood first."""
    overall, share = unit.validation.overall, error_percent(unit.validation)
    gain = overall.improvement_over_static_percent
    loop = max((rate.hysteresis_compensated_percent or 0.0 for rate in unit.validation.rates), default=0.0)
    left = f"{plain(overall.rmse_compensated_n)} N left ({plain(share, 2)} % of full scale)"
    if set(unit.judged) <= set(unit.fitted):
        left += " on the very data that was fitted"
    look_into = _look_into(unit)
    if not unit.identification["converged"]:
        return Judgement(
            unit.name, "bad", "the fit did not converge", "record more rates and loads, then identify again"
        )
    if gain is not None and gain <= -0.5:
        return Judgement(
            unit.name, "bad", against_static(overall), _look_into(unit, "use a static gain meanwhile, and ")
        )
    if share > BAD_PERCENT:
        return Judgement(unit.name, "bad", left, look_into)
    if looks_like_friction(unit.validation.rates):
        says = f"a loop of up to {plain(loop, 2)} % stays at every rate, as friction leaves it"
        return Judgement(unit.name, "look", says, look_into)
    if loop > LOOP_PERCENT:
        return Judgement(unit.name, "look", f"a loop of {plain(loop, 2)} % of full scale stays", look_into)
    if share > GOOD_PERCENT:
        return Judgement(unit.name, "look", left, look_into)
    if gain is not None and gain < WORTH_PERCENT:
        return Judgement(unit.name, "good", f"{left}; {against_static(overall)}", "a static gain would do as well")
    return Judgement(unit.name, "good", left)


def _look_into(unit: UnitReport, meanwhile: str = "") -> str:
    """Advice to diagnose the unit, with what to do ``meanwhile``; if it was diagnosed, advice to use the diagnosis."""
    if unit.diagnosis is None:
        return f"{meanwhile}diagnose it"
    overall, left_n = unit.validation.overall, unit.diagnosis.extended_force_rmse_n
    if left_n is not None and left_n < min(overall.rmse_compensated_n, overall.rmse_static_n):
        meanwhile = f"use its extended calibration, which leaves {plain(left_n)} N, and "
    return f"{meanwhile}see its diagnosis"


def headline(judgements: Sequence[Judgement]) -> tuple[Grade, str]:
    """The whole calibration's grade and one sentence: how many units are good, and what to do about the others."""
    worst = min((one.grade for one in judgements), key=WORST_FIRST.index)
    good = sum(one.grade == "good" for one in judgements)
    if len(judgements) == 1:
        one = judgements[0]
        return worst, f"{one.unit} is {grade_word(one.grade)}: {one.says}{'; ' + one.does if one.does else ''}"
    said = f"{good} of {len(judgements)} units good" if good < len(judgements) else f"All {good} units good"
    rest = sorted((one for one in judgements if one.grade != "good"), key=lambda one: WORST_FIRST.index(one.grade))
    others = "; ".join(f"{one.unit}: {one.whole}" for one in rest)
    return worst, f"{said}; {others}" if others else said


def grade_word(grade: Grade) -> str:
    """The grade in words that fit into a sentence."""
    return {"good": "good", "look": "to be looked at", "bad": "not to be used"}[grade]
