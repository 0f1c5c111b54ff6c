"""The sentences that limit a diagnosis: why an effect is no cause, and what no model can predict.

A function ``reason_...`` says why one name is no cause, or returns None. A function ``limit_...`` says what holds for
the diagnosis as a whole, in a list that is empty where there is nothing to be said.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np

from smartshoe.arrays import Array
from smartshoe.diagnosis._arms import arms_of
from smartshoe.diagnosis._baseline import RATE, WALL_RATIOS, has_extreme_arm
from smartshoe.diagnosis._excitation import Excitation
from smartshoe.diagnosis._gains_and_zeros import OwnGain, ZeroChange, changes_of, time_of
from smartshoe.diagnosis._held_out import Gain
from smartshoe.diagnosis._inference import Inference
from smartshoe.diagnosis._naming import Name
from smartshoe.diagnosis._scale import Scale
from smartshoe.diagnosis._sensitivity import NON_PRESSURES, is_remembered_by_gas
from smartshoe.diagnosis._session import Session, fitted_of
from smartshoe.diagnosis._validation import rms_difference
from smartshoe.diagnosis._zero import OwnZeros, Zero
from smartshoe.display import counted, percent, rounded
from smartshoe.integrity.thresholds import Thresholds
from smartshoe.models.core import PAPER_WALL_RATIOS, USUAL_WALL_RATIO
from smartshoe.models.effects import Effect, in_words, listed
from smartshoe.models.effects.exposure import CHANNELS, LATER_CYCLES, SAYS
from smartshoe.models.extended import ExtendedModel
from smartshoe.units import Unit

ONE_CYCLE = "one load cycle of one recording: nothing in it is independent of the rest, so that no cause can be told"
SAID = 4  # of many changes of a gain, or other such items, how many are listed


def limit_clocks_disagree(
    clocks: Sequence[tuple[Effect, Array]], model: ExtendedModel, sessions: Sequence[Session], thresholds: Thresholds
) -> list[str]:
    """The sentence where the fit's lag between clocks differs from the one that the edges showed.

    The lag is that of all that makes the model late, in the middle of the fitted time. ``clocks`` are the effects, with
    values, by the edges.
    """
    if not {one.name for one, _ in clocks} & {*model.names}:
        return []
    middle_s = 0.5 * float(np.mean([one.conditions.time_s[-1] for one in fitted_of(sessions)]))
    lag_s = sum(one.late_s(values, middle_s) for one, values in clocks)
    fitted_s = sum(part.effect.late_s(part.values, middle_s) for part in model.parts)
    if abs(fitted_s - lag_s) <= max(thresholds.same * abs(lag_s), thresholds.echo_s):
        return []
    return [
        f"by the edges of load and reading, the reading is {_late(lag_s)}; fitted with the other effects, it is"
        f" {_late(fitted_s)}: another effect imitates the difference, so that no lag between the clocks is named"
        " (record both by one clock)"
    ]


def _late(lag_s: float) -> str:
    """A lag in words."""
    return f"{abs(lag_s):.3g} s {'late' if lag_s >= 0.0 else 'early'}"


def _unnamed(name: Name, why: str) -> str:
    """The sentence on a name that is no cause, with the reason ``why``."""
    return f"{in_words(name.effect.name)} fits, but is not named: {why}"


def reason_of_another_kind(name: Name, model: ExtendedModel, thresholds: Thresholds) -> str | None:
    """Why a name is none: its effect acts as another kind would, or as the wall's own arm.

    A flexible block of a behaviour without a law is one where it departs from every law by more than laws do.
    """
    part = model.part(name.member.name)
    if part.effect.why_unnamed and part.effect.departs_by(part.values) > thresholds.law_departure:
        return f"the reading {part.effect.why_unnamed}: no effect of the catalogue does this, so that it is not named"
    if name.effect is part.effect and part.kind_ends_at:
        parameter, value = part.kind_ends_at[0]
        at = f"{in_words(parameter.name)} at {value:g}" + ("" if parameter.unit == "1" else f" {parameter.unit}")
        return (
            f"{in_words(name.effect.name)} fits best with its {at}, the end of its range: beyond it, it acts like"
            " another effect, so that it is not named"
        )
    if model.relaxing_share < 0.0 and part.name in dict(arms_of(model)):
        return _unnamed(
            name,
            "it fits only beside a baseline that falls in holds, as from air that cools or leaves; it may be the wall's"
            " own relaxation",
        )
    if has_extreme_arm(model) and (part.name in dict(arms_of(model)) or part.effect.delay_s(part.values) < 0.0):
        return _unnamed(
            name,
            "it fits only with the wall's relaxation at the end of its range, where that of no real wall is; the two"
            " may imitate or cancel each other",
        )
    return None


def reason_not_shown(name: Name, excitation: Excitation) -> str | None:
    """Why a name is none: the recordings hold one load cycle, or one rate, in which nothing shows such an effect.

    For example, a permanent set and a slow arm end a single cycle alike, and a rate-dependent gain is another gain at
    one rate.
    """
    if excitation.hides(name.effect):
        few = "recordings of one loading rate without a hold, or of no rate that can be seen,"
    elif excitation.shows(name.effect):
        return None
    else:
        few = "recordings of one load cycle"
    ways = "; or ".join(SAYS[word] for word in sorted(name.effect.exposed_by - LATER_CYCLES - CHANNELS))
    return f"{_unnamed(name, f'{few} cannot show it')}; it needs {ways or 'more load cycles'}"


def reason_no_gas(name: Name, unit: Unit) -> str | None:
    """Why an effect of the gas is no cause where the reading is no gas pressure."""
    if unit.quantity not in NON_PRESSURES or not is_remembered_by_gas(name.effect):
        return None
    return _unnamed(
        name,
        f"a reading in {unit.symbol} is no gas pressure; something gives way in holds, or comes back, by a law that the"
        " catalogue does not have",
    )


def reason_clocks_aligned(name: Name) -> str:
    """Why a latency is no cause where readings were shifted to the load's clock before."""
    return _unnamed(
        name,
        "each reading was shifted to the load's clock before, by its own lag; this may be what is left of that lag",
    )


def limit_remembered(names: Sequence[Name]) -> list[str]:
    """Sentences on drifts of the zero that the arms of effects may remember (`may_be_remembered`)."""
    return [
        "recordings begin loaded: what the unit remembers of earlier loads would look like"
        f" {in_words(one.effect.name)}, which is therefore half sure at most (record a rest before the first load)"
        for one in names
    ]


def limit_noisy_load(sessions: Sequence[Session], scale: Scale, thresholds: Thresholds) -> list[str]:
    """The sentence on a load of which, where it was fitted, averaging leaves more noise than is ``tolerable``."""
    fitted = fitted_of(sessions)
    worst = max(fitted, key=lambda one: one.conditions.load_noise, default=None)
    if worst is None or worst.conditions.load_noise <= thresholds.tolerable:
        return []
    logged, left = worst.denoised.raw_sd, worst.conditions.load_noise
    return [
        f"the load of {worst.recording.name} is noisy: by {logged * scale.load_n:.2g} N rms ({percent(logged)} of full"
        f" scale), of which {left * scale.load_n:.2g} N are left after averaging: errors of that size are the load's,"
        " hide smaller effects and may look like others (mend the load cell's wiring, or log it through a filter, and"
        " the reading through the same)"
    ]


def limit_load_cell_moves(names: Sequence[Name]) -> list[str]:
    """Sentences on effects that may be a zero of the load cell that moves (`may_be_of_the_load_cell`)."""
    return [
        f"at rest the logged load moves as {in_words(one.effect.name)} has it, and the reading stays: the load cell's"
        f" zero may move and not the unit's, so that {in_words(one.effect.name)} is half sure at most (let the load"
        " cell warm up, and zero it before each recording)"
        for one in names
    ]


def reason_few_cycles(name: Name, cycles: int) -> str:
    """Why an effect is no cause where there are as many surer ones as load cycles."""
    most = f"{counted(cycles, 'load cycle')} cannot show more than {counted(cycles, 'cause')}, and others are surer"
    return f"{_unnamed(name, most)} (repeat the cycles)"


def reason_departure(name: Name, names: Sequence[Name], thresholds: Thresholds) -> str | None:
    """Why an effect is no cause beside a surer one of its mechanism: it may be the error of that one's equation.

    A curve beside a curve that no law follows is treated alike. Not where the effect is larger than laws depart.
    """
    alike = [one for one in names if one.effect.mechanism == name.effect.mechanism != ""]
    if name.effect.is_memoryless and not name.kind_only:
        alike += [one for one in names if one.effect.is_memoryless and one.kind_only]
    surest = max(alike, key=lambda one: one.kind_probability, default=name)
    if surest is name or name.member.size > thresholds.law_departure * surest.member.size:
        return None
    return _unnamed(
        name,
        f"it may be no more than the error of the equation of {in_words(surest.effect.name)} (both are"
        f" {name.effect.mechanism or 'curves of the load'})",
    )


def limit_relaxation_range(
    model: ExtendedModel, sessions: Sequence[Session], thresholds: Thresholds, *, beside_names: bool
) -> list[str]:
    """The sentence on a unit that relaxes more slowly, or faster, than the baseline can follow."""
    slow, fast = model.relaxation_rate_per_s <= model.slowest_per_s, model.relaxation_rate_per_s >= RATE.upper
    if (
        not (slow or fast)
        or rms_difference(sessions, model, replace(model, relaxing_share=0.0)) <= thresholds.tolerable
    ):
        return []
    end_s = 1.0 / (model.slowest_per_s if slow else RATE.upper)
    return [
        f"the baseline's relaxation is at the end of its range, {rounded(end_s, 3)} s:"
        f" a unit that relaxes {'more slowly' if slow else 'faster'} cannot be followed"
        + (", and what is named may stand for this" if beside_names else "")
    ]


def limit_early(model: ExtendedModel, names: Sequence[Name]) -> list[str]:
    """Sentences on named latencies by which the reading is early."""
    latencies = [one.effect.name for one in names if one.effect.is_latency]
    early_s = ((one.name, -one.effect.late_s(one.values, 0.0)) for one in model.parts if one.name in latencies)
    return [
        f"the reading comes {1e3 * by_s:.3g} ms before the load ({in_words(name)}): no unit answers a load before it is"
        " there, so that the load is late, by a filter of its cell or by its clock (filter both alike, or log both by"
        " one device)"
        for name, by_s in early_s
        if by_s > 0.0
    ]


def limit_curve_range(model: ExtendedModel, names: Sequence[Name] = ()) -> list[str]:
    """The sentence on a curve at the end of its range, in the model or as the law that names a block."""
    if ended := [part.name for part in model.parts if part.bends_too_little]:
        return _at_end_of_range(ended, "the rest may be named as other effects, which are half sure at most")
    by = [
        (one.effect.name, one.law_in_place.fit.model)
        for one in names
        if one.law_in_place is not None and one.law_in_place.fit is not None
    ]
    if followed := [name for name, fitted in by if fitted.part(name).bends_too_little]:
        return _at_end_of_range(followed, "its parameters are bounds (the extended model keeps the free form)")
    return []


def _at_end_of_range(curves: Sequence[str], follows: str) -> list[str]:
    """The sentence on ``curves`` at the end of their range, and what ``follows`` from it."""
    return [
        f"{listed(curves, 'and')} {'is' if len(curves) == 1 else 'are'} at the end of the range: the unit's curve bends"
        f" more than this equation can; {follows}"
    ]


def limit_wall_ratio(model: ExtendedModel, sessions: Sequence[Session], thresholds: Thresholds) -> list[str]:
    """The sentence on a leak, or heat, where the stiffness of the wall relative to the gas is not known."""
    units = {one.recording.sensor.unit.quantity for one in sessions}
    is_of_gas = any(part.effect.stage == "gas" for part in model.parts) and units.isdisjoint(NON_PRESSURES)
    if not is_of_gas or model.wall_ratio != USUAL_WALL_RATIO:  # the ratio is known
        return []
    softest, stiffest = PAPER_WALL_RATIOS
    gauges = [one.recording for one in sessions if one.recording.sensor.unit.quantity == "pressure"]
    if any("effective_area_m2" in one.metadata for one in gauges):
        least, most = WALL_RATIOS
        mend = (
            f"correct effective_area_m2: the declared one gives an N outside {least:g} to {most:g}, which no tube has"
        )
    elif rms_difference(sessions, model, replace(model, wall_ratio=stiffest)) > thresholds.material:
        mend = "declare the tube's effective area, in a file by a line '# effective_area_m2: ...' above the table"
    else:
        return []
    return [
        f"the wall's stiffness relative to the gas is not known (N = {model.wall_ratio:g} is assumed, units of the"
        f" paper have {softest:g} to {stiffest:g}): rates of leaks and times of heat depend on it, and may lie outside"
        f" their intervals ({mend})"
    ]


def limit_rejected(gained: Gain, beyond: str | None) -> list[str]:
    """The sentence on an extension that is rejected; ``beyond``: how held-out loads exceed the fitted ones."""
    if not gained.is_rejected:
        return []
    low, high = gained.ci95
    least, most = (percent(-0.01 * bound) for bound in (high, low))
    more = f"{least.removesuffix(' %')} to {most} more" if gained.is_certain else "which may be chance"
    why = beyond or "the held-out loads are like the fitted ones, so that the session or the model is wrong"
    return [
        f"on held-out data the extended model is worse than the baseline (error {gained.rmse_after:.4g} instead of"
        f" {gained.rmse_before:.4g} {gained.unit}, {more}): {why}; it is rejected, so that model and calibration are"
        " the baseline's (fit a recording like the held-out ones, too)"
    ]


def limit_held_out_excess(off: float, within: float, beyond: str | None) -> list[str]:
    """The sentence on recordings that were not fitted and are ``off`` by far more than fitted ones (``within``)."""
    if not off:
        return []
    why = beyond or (
        "their loads are no faster, higher or longer, so that they are of another unit or a changed one, or the model"
        " fits for a wrong reason"
    )
    return [f"held-out recordings are off by {percent(off)} of full scale, fitted ones by {percent(within)}: {why}"]


def limit_zero_drifted(zeros: Sequence[Zero], scale: Scale) -> list[str]:
    """The sentence on an offset that may be a drift which began before the recordings."""
    return [
        f"the zero is at {zero.value * scale.reading:.3g} {scale.unit.symbol} where the recordings begin, and drifts in"
        " that direction: the drift may have begun before, or there is an offset as well (record from the moment at"
        " which the unit is switched on)"
        for zero in zeros
        if zero.may_have_drifted
    ]


def limit_zero_extrapolated(zeros: Sequence[Zero], scale: Scale, thresholds: Thresholds) -> list[str]:
    """The sentence on a zero that is extrapolated from loads at which the unit was never seen unloaded."""
    told = (one for one in zeros if one.extrapolated_from and not one.may_have_drifted)
    return [_extrapolated(one, scale, thresholds) for one in told]


def _extrapolated(zero: Zero, scale: Scale, thresholds: Thresholds) -> str:
    """The sentence on one extrapolated ``zero``.

    If the unit is unloaded at some time, but not at the start, only its memory of earlier loads is unknown.
    """
    value = f"{zero.value * scale.reading:.3g} {scale.unit.symbol} ({percent(zero.size)} of full scale)"
    if zero.extrapolated_from <= thresholds.standing:
        return (
            f"without load the reading is {value}: an offset, a tare, or what the unit remembers of loads before the"
            " recordings; this data cannot tell which (record a rest before the first load)"
        )
    return (
        f"extrapolated to no load from {percent(zero.extrapolated_from)} of full load, the reading is {value}: an"
        " offset, a tare, what the unit does below such loads, or what it remembers of earlier loads; this data cannot"
        " tell which (record a rest without load that the sensor can read)"
    )


def limit_curves_in_tare(
    zeros: Sequence[Zero], effects: Sequence[Effect], scale: Scale, thresholds: Thresholds
) -> list[str]:
    """The sentence on curves among ``effects`` whose full scale includes a tare.

    Over another range the same curve has other parameters: a parabola's distance from its chord goes with the square.
    """
    curves = [effect.name for effect in effects if effect.is_memoryless]
    return [
        f"full scale is {scale.load_n:.4g} N of the load as logged, {(1.0 + tare.value) * scale.load_n:.4g} N without"
        f" the tare: the parameters of the {listed(curves)} are those of a curve over {scale.load_n:.4g} N (take the"
        f" tare off the loads for those over {(1.0 + tare.value) * scale.load_n:.4g} N)"
        for tare in zeros
        if curves and tare.effect.shifts == "load" and not tare.alternatives and abs(tare.value) > thresholds.standing
    ]


def limit_force_as_logged(zeros: Sequence[Zero], scale: Scale) -> list[str]:
    """The sentence on the force of a calibration that was made with a load cell that has a tare."""
    return [
        "a calibration gives the force as the load cell shows it,"
        f" {abs(tare.value) * scale.load_n:.3g} N {'more' if tare.value < 0.0 else 'less'} than what presses on the"
        + (
            f" unit if that is a tare, and no load that the {listed(tare.alternatives)} keeps from the reading (log the"
            " machine's command, or press less)"
            if tare.alternatives
            else " unit (take the tare off the loads to calibrate by the latter)"
        )
        for tare in zeros
        if tare.effect.shifts == "load"
    ]


def reason_tare_creeps(drift: Name, tare: Zero | None) -> str | None:
    """Why a drift of the zero is no cause where a tare of that size may creep; None without such a tare."""
    if tare is None:
        return None
    return (
        f"{in_words(drift.effect.name)} moves the reading by {percent(drift.member.size)} of full scale, but is not"
        f" named: a tare of {percent(tare.size)} may creep by as much (zero the load cell, and log a rest)"
    )


def limit_own_gains(gains: Sequence[OwnGain]) -> list[str]:
    """The sentence on recordings with gains of their own."""
    if not gains:
        return []
    told = (
        "causes are judged with this allowed for, what is left over is not; no model can predict the gain of another"
        " recording"
    )
    if changes := changes_of(gains):
        return [f"the gain changes {_when(changes)}, for example because the unit slips: {told}"]
    low, high = (of(gains, key=lambda one: one.share) for of in (min, max))
    return [
        f"each recording has a gain of its own, from {percent(low.share, signed=True)} in {low.recording} to"
        f" {percent(high.share, signed=True)} in {high.recording} relative to that of all, for example because the unit"
        f" was taken out and put back: {told} (leave the unit in place, or calibrate it each time)"
    ]


def limit_own_zeros(zeros: OwnZeros | None, scale: Scale) -> list[str]:
    """The sentence on recordings with zeros of their own."""
    if zeros is None:
        return []
    low, high = (int(of(zeros.offsets)) for of in (np.argmin, np.argmax))

    def told(at: int) -> str:
        value = scale.zero + float(zeros.offsets[at]) * scale.reading
        return f"{rounded(value, 4)} {scale.unit.symbol} in {zeros.names[at]}"

    apart = percent(float(np.ptp(zeros.offsets)))
    return [
        f"by the extended model, each recording has a zero of its own, from {told(low)} to {told(high)}, {apart} of"
        " full scale apart: this is allowed for here, and may be what the model misses of a recording (zero the load"
        " cell and the sensor before each, to tell)"
    ]


def limit_zero_jumps(changes: Sequence[ZeroChange]) -> list[str]:
    """The sentence on recordings whose zero jumps."""
    if not changes:
        return []
    return [
        f"the zero jumps, in shares of full scale, {_when(changes)}, for example because the unit slips, water moves in"
        " a line, or the load cell jumps: jumps that are not seen may imitate any effect of the unit, so that none is"
        " more than half sure; no model can predict the jumps of another recording"
    ]


def _when(changes: Sequence[OwnGain | ZeroChange]) -> str:
    """The first few changes in words, and the number of the others."""
    few = [f"by {percent(one.share, signed=True)} {time_of(one)} in {one.recording}" for one in changes[:SAID]]
    return f"{', '.join(few)}{f' and {len(changes) - SAID} more' if len(changes) > SAID else ''}"


def limit_nearest_law(found: Inference, thresholds: Thresholds) -> list[str]:
    """The sentence on a law that follows most of what the baseline misses and is not named.

    Small imperfections of many kinds may do so as well, but add up to no more than is ``tolerable``.
    """
    if found.nearest_law is None:
        return []
    effect, left, beside = found.nearest_law
    said = (
        f"{in_words(effect.name)} alone explains most of what the baseline misses on the fitted data"
        f" ({percent(left)} of full scale without it, {percent(beside)} with it), but is not named"
    )
    if effect.name in found.refused:
        return [
            f"{said}: no other recording or load cycle of this data confirms it (repeat the loads that show it, in a"
            " recording of its own)"
        ]
    if left > thresholds.clear * thresholds.tolerable:
        return [f"{said}: too little in this data speaks for it against no effect at all"]
    return [
        f"{said}: small imperfections of many kinds, {percent(thresholds.imperfection)} each, may do the same (if this"
        f" unit is better than that, set `material` to less than {percent(thresholds.material)})"
    ]


def limit_refusals(found: Inference, named: Collection[str] = ()) -> list[str]:
    """The sentences on effects that cross-validation removed or that cancel one another, but for those ``named``."""
    if not found.can_validate:
        return [ONE_CYCLE]
    said = []
    cancelling, refused = (
        [name for name in dict.fromkeys(names) if name not in named]
        for names in (found.cancelling_names, found.refused)
    )
    if cancelling:
        said.append(f"these effects largely cancel one another, so that none is named: {listed(cancelling)}")
    if refused:
        said.append(
            f"tried and not kept: {listed(refused)} (of no help in predicting recordings or load"
            " cycles left out in turn, or too small there to be trusted at the held-out loads)"
        )
    return said
