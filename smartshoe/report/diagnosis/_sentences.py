"""A diagnosis in words: headings, intervals, gains and similar effects, for both the page and the terminal."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import PurePath

from smartshoe.diagnosis import Cause, Diagnosis, Gain, GoodnessOfFit, Rival
from smartshoe.display import sure
from smartshoe.integrity import DataFault
from smartshoe.models.effects import catalogue, effect, in_words, listed, told_apart_by
from smartshoe.models.effects.exposure import SAYS
from smartshoe.models.parameter import Parameter
from smartshoe.report.numbers import plain, with_unit
from smartshoe.report.wording import sentence, words
from smartshoe.signals.noise import NORMAL_95

HEADINGS = {
    "adequate": "The simulation is good enough",
    "explained": "The simulation is wrong, and it is known why",
    "partly_explained": "The simulation is wrong, and part of it is explained",
    "unexplained": "The simulation is wrong, and no cause can be named",
    "refused": "No diagnosis: this data does not allow one",
}
NOT_SURE = "The simulation is wrong, and it is known what follows it, though not each cause is sure"
REJECTED = "The simulation is wrong, and what would explain it is rejected: it is worse on data that was not fitted"
INTERVALS = (
    "A parameter's interval is of the noise alone: where its equation is not exact the value may be off by more."
)
TURNED_OVER = (
    "The reading falls as the load rises, and causes are described for one that rises: read lower for higher, and falls"
    " for rises."
)
OF_ZEROS = (
    "An offset or a tare takes its part off the error of a simulation that gives all recordings one zero; both"
    " simulations below have each recording's own."
)
LIKELIHOOD = (
    "“Less likely by” and “fits worse by” are differences of −2 log likelihood. “Less likely by 10” is strong evidence."
    " “Fits worse by” takes equations as exact, which they are not, so that it must be much more than 10."
)
NO_STRUCTURE, NOT_TESTED = "none beyond noise", "cannot be told"


def heading(diagnosis: Diagnosis) -> str:
    """The verdict as a heading, which also says if not every cause is sure.

    If all causes concern recordings, as a zero does, the plain model is good enough. An extension that was rejected is
    not said to explain anything.
    """
    if diagnosis.rejected is not None and any(cause.part is not None for cause in diagnosis.causes):
        return REJECTED
    if diagnosis.verdict != "explained":
        return HEADINGS[diagnosis.verdict]
    if is_of_recordings(diagnosis):
        return f"The simulation is good enough but for {_of_their_own(diagnosis)} of the recordings"
    is_sure = all(cause.confidence >= diagnosis.thresholds.least_confidence for cause in diagnosis.causes)
    return HEADINGS["explained"] if is_sure else NOT_SURE


def is_of_recordings(diagnosis: Diagnosis) -> bool:
    """Whether all causes concern single recordings, as a zero does, which the plain model allows for."""
    before, after = diagnosis.baseline, diagnosis.extended
    is_as_before = before and after and before.rmse == after.rmse
    return bool(diagnosis.causes and is_as_before and diagnosis.rejected is None)


def _of_their_own(diagnosis: Diagnosis) -> str:
    """What the causes of `is_of_recordings` are: the zero, the clock, or both."""
    clocks = [one.effect.is_latency for one in diagnosis.causes]
    return "the zero and the clock" if any(clocks) and not all(clocks) else "the clock" if all(clocks) else "the zero"


def how_sure(cause: Cause) -> str:
    """The confidence in a cause and, if equivalent effects are possible, the confidence that it is this one."""
    if not cause.equivalents:
        return f"{sure(cause.confidence)} sure"
    return (
        f"{sure(cause.confidence)} sure that it is this or {listed(cause.equivalents, 'or')}; if so,"
        f" {sure(cause.law_confidence)} that it is this one"
    )


def is_free_form(cause: Cause) -> bool:
    """Whether a cause's parameters are those of a free form, because no equation of its kind fits well enough."""
    return cause.part is not None and not {one.name for one in cause.effect.parameters}.issuperset(cause.parameters)


def not_in_the_model(cause: Cause) -> str:
    """A sentence if the extended model has another form in place of the parameters' equation; '' otherwise."""
    if not cause.parameters or cause.part in (None, cause.name) or is_free_form(cause):
        return ""
    without = ", which has no equation and" if effect(str(cause.part)).is_flexible else ", which"
    return (
        f"these parameters are of the equation of {in_words(cause.name)}, which is not in the extended model: the model"
        f" has {in_words(str(cause.part))} in its place{without} follows the data more closely"
    )


def meanings(cause: Cause) -> dict[str, str]:
    """The meaning of each parameter of a cause, by name; '' if the catalogue does not describe it."""
    valued = effect(cause.part) if cause.part is not None and is_free_form(cause) else cause.effect
    says = {parameter.name: parameter.says for parameter in valued.parameters}
    return {name: says.get(name, "") for name in cause.parameters}


def unit_of(symbol: str) -> str:
    """A unit as text after a number; '' for a pure number."""
    return "" if symbol in ("", "1") else f" {symbol}"


def interval(value: float, low: float, high: float) -> str:
    """``value [low, high]``, all rounded to two digits of half the interval's width."""
    half = 0.5 * (high - low)
    if not all(math.isfinite(number) for number in (value, low, high)) or half <= 0:
        return plain(value, 4)
    decimals = 1 - math.floor(math.log10(half))
    if decimals > 8 or abs(value) >= 1e7:
        return f"{value:.4g} [{low:.4g}, {high:.4g}]"
    shown = (_rounded(number, max(decimals, 0)) for number in (value, low, high))
    return "{} [{}, {}]".format(*shown)


def _rounded(value: float, places: int) -> str:
    """``value`` to ``places`` decimals, or to one significant digit if only zeros would be left."""
    said = f"{value:.{places}f}"
    return plain(value, 1) if value != 0 and float(said) == 0 else said.replace("-", "−")


def two_numbers(first: float, second: float) -> tuple[str, str]:
    """Two numbers with as many digits, three to five, as are needed to show that they differ."""
    for digits in (3, 4, 5):
        said = plain(first, digits), plain(second, digits)
        if said[0] != said[1]:
            break
    return said


def parameter_text(parameter: Parameter) -> str:
    """Value, 95 % interval and unit; a parameter without an interval was held fixed.

    A parameter whose interval is cut off at both ends by its bounds is not determined.
    """
    low, high = parameter.ci95
    if low == high:
        return f"held at {plain(parameter.value)}{unit_of(parameter.unit)}"
    within = (1.0 - 1e-9) * NORMAL_95 * parameter.sd
    if low > parameter.value - within and high < parameter.value + within:
        return "not determined"
    at_a_limit = ", at its limit" if parameter.value in (low, high) else ""
    return interval(parameter.value, low, high) + unit_of(parameter.unit) + at_a_limit


def gain_text(gain: Gain) -> str:
    """By how many percent the error falls, with its interval; negative if it rises."""
    return _percent_text(gain.gain_percent, *gain.ci95)


def _percent_text(percent: float, low: float, high: float) -> str:
    if not math.isfinite(percent):
        return "–"
    span = f" [{plain(low, 2)}, {plain(high, 2)}]" if high > low else ""
    return f"{plain(percent, 2)} %{span}".replace("-", "−")


def _way_of(gain: Gain) -> tuple[bool, float, float, float]:
    """Whether the error rises; then by how many percent it rises or falls, and the interval of that."""
    low, high = gain.ci95
    if gain.gain_percent < 0:
        return True, -gain.gain_percent, -high, -low
    return False, gain.gain_percent, low, high


def gain_sentence(gain: Gain) -> str:
    """The error without and with an addition, on data that was not fitted, as a sentence."""
    if not math.isfinite(gain.gain_percent):
        return "What it gains on data that was not fitted is not known."
    without, within = two_numbers(gain.rmse_before, gain.rmse_after)
    rises, *change = _way_of(gain)
    outcome = f"{'rises' if rises else 'falls'} by {_percent_text(*change)}"
    return (
        f"On data that was not fitted, the error is {with_unit(without, gain.unit)} without it and"
        f" {with_unit(within, gain.unit)} with it: it {outcome}."
    )


def share_of_full_scale(diagnosis: Diagnosis, value: float) -> float:
    """``value`` (in the reading's unit) in percent of the full-scale reading; NaN if that is unknown."""
    return 100.0 * value / diagnosis.full_scale_reading if diagnosis.full_scale_reading > 0 else math.nan


def how_much(diagnosis: Diagnosis) -> str | None:
    """One sentence: the error on held-out data before and after, in the reading's unit and in percent of full scale."""
    before, after = diagnosis.baseline, diagnosis.extended
    if before is None or after is None:
        return None
    said = (
        f"on data that was not fitted, the simulated reading is off by {with_unit(plain(before.rmse), before.unit)}"
        f" ({plain(share_of_full_scale(diagnosis, before.rmse), 2)} % of full scale, rms)"
    )
    if after.rmse < 0.98 * before.rmse:
        what = "what was found" if diagnosis.causes else "effects that are not named as causes"
        said += (
            f"; with {what} it is off by {with_unit(plain(after.rmse), after.unit)}"
            f" ({plain(share_of_full_scale(diagnosis, after.rmse), 2)} %)"
        )
    return sentence(said)


@dataclass(frozen=True, slots=True)
class Row:
    """A row of the comparison: the name of the figure, before, after, and the change in percent ('' if meaningless)."""

    name: str
    before: str
    after: str
    change: str


def comparison(diagnosis: Diagnosis) -> list[Row]:
    """The baseline and the extended simulation compared on held-out data."""
    before, after = diagnosis.baseline, diagnosis.extended
    if before is None or after is None:
        return []

    error = "error of the simulated reading, rms (of full scale)"
    if diagnosis.rejected is not None and diagnosis.gain is not None:
        tried = diagnosis.gain.rmse_after
        with_it = f"{_of_scale(diagnosis, before, tried)}, so it is rejected"
        return [Row(error, _of_scale(diagnosis, before, before.rmse), with_it, _change(before.rmse, tried))]
    rows = [
        Row(
            error,
            _of_scale(diagnosis, before, before.rmse),
            _of_scale(diagnosis, after, after.rmse),
            _change(before.rmse, after.rmse),
        ),
        Row("fit, 100 % for no error", f"{before.fit_percent:.2f} %", f"{after.fit_percent:.2f} %", ""),
    ]
    if math.isfinite(before.force_rmse_n) and math.isfinite(after.force_rmse_n):
        by_baseline = diagnosis.force_model is not None and all(
            part.effect.shifts for part in diagnosis.force_model.parts
        )  # a model that handles only some of the effects has an error of its own
        rows.append(
            Row(
                "error of the compensated force, rms" + _but_for_clipped(diagnosis),
                f"{plain(before.force_rmse_n)} N",
                "by the baseline, see below" if by_baseline else f"{plain(after.force_rmse_n)} N",
                "" if by_baseline else _change(before.force_rmse_n, after.force_rmse_n),
            )
        )

    def structure(standing: GoodnessOfFit) -> str:
        if not math.isfinite(standing.structure_rms):
            return NOT_TESTED
        found = standing.structure_rms
        return _of_scale(diagnosis, standing, found) if found > 0 else NO_STRUCTURE

    rows.append(
        Row(
            "structure beyond noise, over all recordings, fitted or not, rms (of full scale)",
            structure(before),
            structure(after),
            _change(before.structure_rms, after.structure_rms),
        )
    )
    return rows


def _but_for_clipped(diagnosis: Diagnosis) -> str:
    return f" ({100 * diagnosis.clipped:.2g} % of samples, clipped, left out)" if diagnosis.clipped else ""


def what_was_gained(diagnosis: Diagnosis) -> str:
    """What was added to the baseline, and by how much it lowers or raises the error on held-out data."""
    names, others = [in_words(cause.name) for cause in diagnosis.causes], diagnosis.minor_in_words
    if not (names or others):
        return "Nothing was added."
    without = [f"without a name: {others}"] if others else []
    did = "Added" if diagnosis.rejected is None else "Tried and rejected"
    added = f"{did}: {'; '.join([', '.join(names), *without] if names else without)}."
    if is_of_recordings(diagnosis):
        own = _of_their_own(diagnosis)
        return f"{added} The plain model allows for {own} of the recordings, so that the error stays as it is."
    won = diagnosis.gain
    if won is None or not math.isfinite(won.gain_percent):
        return added
    together = "Together they" if len(names) + len(diagnosis.minor) > 1 else "It"
    rises, percent, low, high = _way_of(won)
    way = ("raise" if rises else "lower") + ("" if together.endswith("they") else "s")
    span = f"{plain(low)} to {plain(high)} %".replace("-", "−")
    return (
        f"{added} {together} {way} the error on data that was not fitted by {plain(percent)} % (95 % interval {span})."
    )


def _of_scale(diagnosis: Diagnosis, standing: GoodnessOfFit, value: float) -> str:
    """A value of ``standing`` in the reading's unit, and in percent of full scale."""
    return f"{with_unit(plain(value), standing.unit)} ({plain(share_of_full_scale(diagnosis, value), 2)} %)"


def _change(before: float, after: float) -> str:
    if not before > 0 or not math.isfinite(after):
        return "–"
    percent = 100.0 * (after / before - 1.0)
    return "none" if abs(percent) < 0.5 else f"{percent:+.0f} %".replace("-", "−")


def on_causes(diagnosis: Diagnosis) -> list[str]:
    """Sentences on how to read the causes' numbers and words."""
    model, said = diagnosis.model, [INTERVALS]
    if model is not None and model.full_scale_reading * model.gain <= 0.0:
        said.append(TURNED_OVER)
    if any(cause.effect.shifts for cause in diagnosis.causes):
        said.append(OF_ZEROS)
    return said


@dataclass(frozen=True, slots=True)
class Neighbour:
    """Another effect that a cause might be: meaning, likelihood relative to the cause, and how to distinguish them."""

    name: str
    says: str
    margin: str
    told_apart_by: str


def neighbours(cause: Cause, names: Sequence[str]) -> list[Neighbour]:
    """The effects ``names`` compared with ``cause``."""
    rivals = {rival.effect: rival for rival in cause.rivals}
    known = catalogue()
    found = []
    for name in names:
        other = known.get(name)
        apart = sorted(SAYS[word] for word in told_apart_by(cause.effect, other)) if other else []
        found.append(
            Neighbour(
                in_words(name),
                other.says if other else "",
                rivals[name].says if name in rivals else "–",
                "; ".join(apart),
            )
        )
    return found


def less_likely(cause: Cause) -> list[Neighbour]:
    """The rivals that came near and are less likely, or fit worse, than the cause."""
    return neighbours(cause, [rival.effect for rival in _others(cause) if not rival.may_be_likelier])


def likelier(cause: Cause) -> list[Neighbour]:
    """The effects that alone, in the place of a cause, would be as likely or likelier, without other support."""
    return neighbours(cause, [rival.effect for rival in cause.as_likely])


def _others(cause: Cause) -> list[Rival]:
    return [rival for rival in cause.rivals if rival.effect not in cause.equivalents]


def nearest_told(cause: Cause) -> Rival | None:
    """The rival that `why_this_one` mentions; if there are equivalents, only one that may be likelier."""
    nearest = next(iter(_others(cause)), None)
    return None if nearest is None or (cause.equivalents and not nearest.may_be_likelier) else nearest


def why_this_one(cause: Cause) -> str:
    """One sentence on how far the name can be trusted against similar effects."""
    nearest = nearest_told(cause)
    if nearest is None:
        told = "no other effect of the catalogue comes near"
    elif nearest.may_be_likelier:
        told = f"{in_words(nearest.effect)} alone in its place {nearest.says}"
    else:
        near = in_words(nearest.effect)
        told = f"no other effect of the catalogue does as well; the nearest, {near}, {nearest.says}"
    if not cause.equivalents:
        return told
    among = (
        f"{listed(cause.equivalents, 'and')} cannot be ruled out, since no equation is exact: take the name as one of"
        f" {len(cause.equivalents) + 1}"
    )
    return among if nearest is None else f"{among}; {told}"


@dataclass(frozen=True, slots=True)
class Shares:
    """Parts of the baseline's held-out error variance, in percent."""

    explained: float
    left: float
    noise: float


def shares(diagnosis: Diagnosis) -> Shares | None:
    """The baseline's error divided into what was explained, what could be, and noise; the sum is 100.

    None if no test could distinguish structure from noise.
    """
    if diagnosis.extended is not None and not math.isfinite(diagnosis.extended.structure_rms):
        return None
    explained = min(max(diagnosis.explained_percent, 0.0), 100.0)
    explainable = min(max(diagnosis.explainable_percent, explained), 100.0)
    return Shares(explained, explainable - explained, 100.0 - explainable)


def followed(diagnosis: Diagnosis) -> str:
    """The word for the part of the error that the extended model removes: explained, if any effect in it has a name.

    If only unnamed effects remove it, nothing is explained.
    """
    is_named = diagnosis.causes or not diagnosis.minor
    return "explained" if is_named else "followed by effects that are not named as causes"


def percent_of_whole(percent: float) -> str:
    """A share as text, which says "over 99 %" for a share just below the whole."""
    return "over 99 %" if 99.0 < percent < 100.0 else f"{percent:.0f} %"


def shares_text(diagnosis: Diagnosis) -> str:
    """The shares of the error's variance in a sentence."""
    part = shares(diagnosis)
    if part is None:
        said = _share_explained(diagnosis, diagnosis.explained_percent)
        return f"Of the error's variance {said}; how much of the rest is noise cannot be told."
    explainable = part.explained + part.left
    if explainable < 0.5:
        return "Nearly all of the error's variance is noise, which no model explains."
    noise = "under 1 %" if part.noise < 1.0 else f"{part.noise:.0f} %"
    of_it = _share_explained(diagnosis, 100.0 * part.explained / explainable)
    return f"{sentence(noise)[:-1]} of the error's variance is noise; of the rest {of_it}."


def _share_explained(diagnosis: Diagnosis, percent: float) -> str:
    return f"{percent_of_whole(percent)} is {followed(diagnosis)}" if percent >= 0.5 else "none is explained"


def what_is_left(diagnosis: Diagnosis) -> str:
    """Where the remaining structure lies, and which model leaves it; '' if nothing is known.

    If no cause is named and unnamed effects leave less than the baseline, it is the baseline's.
    """
    before, after = diagnosis.baseline, diagnosis.extended
    if not diagnosis.leftover:
        return ""
    if diagnosis.causes or diagnosis.rejected is not None or before is None or after is None:
        return f"what is left: {diagnosis.leftover}"
    plain_rms, rms = (one.structure_rms if math.isfinite(one.structure_rms) else 0.0 for one in (before, after))
    if plain_rms <= rms:
        return f"what is left: {diagnosis.leftover}"
    rest = "nothing beyond noise" if after.structure_rms == 0.0 else "less"
    return f"what the baseline leaves: {diagnosis.leftover}; the extended model leaves {rest}"


def nothing_left(diagnosis: Diagnosis) -> str:
    """A sentence on the remaining structure if the verdict does not require more: none, or how much there is."""
    after = diagnosis.extended
    if after is None or not math.isfinite(after.structure_rms):
        return "There is too little data to tell structure from noise in what is left."
    of_scale = share_of_full_scale(diagnosis, after.structure_rms)
    if of_scale <= 100.0 * diagnosis.thresholds.material:
        return "Over the whole record the extended model leaves no structure that matters."
    return (
        f"Beside noise {with_unit(plain(after.structure_rms), after.unit)} ({plain(of_scale, 2)} % of full scale, rms)"
        " is left over the whole record: no more than small imperfections of a good unit, faults of the data, or"
        " equations that are not exact, account for."
    )


def why_no_name(diagnosis: Diagnosis) -> str:
    """Why an adequate simulation needs no cause: its error is within a unit's usual imperfections or the tolerance."""
    decided = diagnosis.thresholds
    most = "small imperfections of a good unit, or faults of the data, add up to"
    if decided.material > decided.tolerable:
        most = f"was asked to be borne, {100.0 * decided.material:g} % of full scale"
    return f"What the simulation leaves is no more than {most}, so that no effect needs a name."


def fault_text(fault: DataFault) -> str:
    """A fault as text: its kind, place and share of the samples, and its meaning."""
    span = (
        f"{fault.start_s:.1f}–{fault.stop_s:.1f} s" if fault.stop_s - fault.start_s >= 0.1 else f"{fault.start_s:.2f} s"
    )
    where = f"{file_name(fault.label)}, {span}"
    return f"{words(fault.kind)}, {where} ({share_text(fault.share)} of the samples): {fault.says}"


def file_name(label: str) -> str:
    """A recording's label without its folders."""
    return PurePath(label).name or label


def share_text(share: float) -> str:
    """A fraction as text in percent."""
    if share >= 0.9995:
        return "all"
    return f"{plain(100 * share, 2)} %" if share >= 5e-5 else "under 0.01 %"
