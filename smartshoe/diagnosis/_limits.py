"""What limits a diagnosis, in sentences: causes that are withheld, and what no model foresees."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from smartshoe.arrays import Array
from smartshoe.diagnosis._arms import arms_of
from smartshoe.diagnosis._baseline import RATE, WALL_RATIOS, is_stretched
from smartshoe.diagnosis._excitation import Excitation
from smartshoe.diagnosis._gains_and_zeros import OwnGain, ZeroChange, changes_of, time_of
from smartshoe.diagnosis._held_out import Gain
from smartshoe.diagnosis._inference import Inference
from smartshoe.diagnosis._naming import Name
from smartshoe.diagnosis._scale import Scale
from smartshoe.diagnosis._sensitivity import NO_PRESSURES, is_remembered_by_gas
from smartshoe.diagnosis._session import Session, fitted_of
from smartshoe.diagnosis._validation import apart
from smartshoe.diagnosis._zero import OwnZeros, Zero
from smartshoe.display import percent
from smartshoe.integrity.thresholds import Thresholds
from smartshoe.models.core import PAPER_WALL_RATIOS, USUAL_WALL_RATIO
from smartshoe.models.effects import Effect, in_words, listed
from smartshoe.models.effects.exposure import CHANNELS, LATER_CYCLES, SAYS
from smartshoe.models.extended import ExtendedModel
from smartshoe.units import Unit

ONE_CYCLE = "one load cycle of one recording: nothing in it is independent of the rest, so that no cause can be told"
SAID = 4  # of many of a kind, as changes of a gain, that are told one by one


def parted_clocks(
    told: Sequence[tuple[Effect, Array]], model: ExtendedModel, sessions: Sequence[Session], thresholds: Thresholds
) -> str | None:
    """What is said of a lag between clocks that the fit sees otherwise than the edges of load and reading did.

    By all that makes the model late in the middle of what is fitted.
    """
    if not {one.name for one, _ in told} & {*model.names}:
        return None
    middle_s = 0.5 * float(np.mean([one.conditions.time_s[-1] for one in fitted_of(sessions)]))
    lag_s = sum(one.late_s(values, middle_s) for one, values in told)
    fitted_s = sum(part.effect.late_s(part.values, middle_s) for part in model.parts)
    if abs(fitted_s - lag_s) <= max(thresholds.same * abs(lag_s), thresholds.echo_s):
        return None
    return (
        f"the reading is {_late(lag_s)} by the edges of load and reading, {_late(fitted_s)} beside the other"
        " effects: one of them imitates the rest (record both by one clock)"
    )


def _late(lag_s: float) -> str:
    return f"{abs(lag_s):.3g} s {'late' if lag_s >= 0.0 else 'early'}"


def _unnamed(name: Name, but: str) -> str:
    """What is said of a name that is no cause."""
    return f"{in_words(name.effect.name)} fits, but {but}, so that it is not named"


def other_kind_of(name: Name, model: ExtendedModel, thresholds: Thresholds) -> str | None:
    """What is said of an effect that follows best where it is of another kind, or is the wall's own arm.

    A block of what no law does is one where it differs from a law by more than laws do.
    """
    part = model.part(name.member.name)
    if part.effect.why_unnamed and name.by is None and part.effect.departs_by(part.values) > thresholds.law_departure:
        return f"the reading {part.effect.why_unnamed}, which no effect of the catalogue does, so that it is not named"
    if name.effect is part.effect and part.kind_ends_at:
        parameter, value = part.kind_ends_at[0]
        at = f"{in_words(parameter.name)} at {value:g}" + ("" if parameter.unit == "1" else f" {parameter.unit}")
        return (
            f"{in_words(name.effect.name)} fits best with its {at}, the end of its range, beyond which it acts like"
            " another effect, so that it is not named"
        )
    if model.relaxing_share < 0.0 and part.name in dict(arms_of(model)):
        return _unnamed(
            name,
            "only beside a baseline that falls in holds, as air that cools or leaves does: it may be the wall's own"
            " relaxation",
        )
    if is_stretched(model) and (part.name in dict(arms_of(model)) or part.effect.delay_s(part.values) < 0.0):
        return _unnamed(
            name,
            "only with the wall's relaxation at the end of its range, where no wall's is: one may imitate the other, or"
            " undo it",
        )
    return None


def not_shown_of(name: Name, excitation: Excitation) -> str | None:
    """What is said of an effect of which recordings of one load cycle, or of one rate, hold nothing that shows it.

    A set that stays and an arm that relaxes slowly end such a cycle alike; a gain that goes with the rate is another
    gain at one rate.
    """
    if excitation.hides(name.effect):
        few = "recordings of one loading rate, without a hold, or of none that is seen,"
    elif excitation.shows(name.effect):
        return None
    else:
        few = "recordings of one load cycle"
    ways = "; or ".join(SAYS[word] for word in sorted(name.effect.exposed_by - LATER_CYCLES - CHANNELS))
    return f"{_unnamed(name, f'{few} cannot show it')}; it needs {ways or 'more load cycles'}"


def of_no_gas(name: Name, unit: Unit) -> str | None:
    """What is said of what a gas remembers, where the reading is none of a gas's pressure."""
    if unit.quantity not in NO_PRESSURES or not is_remembered_by_gas(name.effect):
        return None
    return _unnamed(
        name,
        f"a reading in {unit.symbol} is no gas's pressure: something gives way in holds, or comes back, as no law of"
        " the catalogue does",
    )


def moved_of(name: Name) -> str:
    """What is said of a latency that is left where readings were moved to the load's clock before."""
    return _unnamed(
        name, "readings were moved to the load's clock before, each by its own lag, of which it may be a rest"
    )


def remembered_of(name: Name) -> str:
    """What is said of a drift of the zero that may be what effects' arms still remember (`may_be_remembered`)."""
    return (
        "recordings begin loaded, and what the unit remembers of loads before them would read as"
        f" {in_words(name.effect.name)} does, which is half sure at most (record a rest before the first load)"
    )


def few_cycles_of(name: Name, cycles: int) -> str:
    """What is said of an effect beside as many surer ones as there are load cycles to tell them by."""
    said = _unnamed(name, f"so few load cycles ({cycles}) show no more than as many causes")
    return f"{said} (repeat the cycles)"


def departure_of(name: Name, names: Sequence[Name], thresholds: Thresholds) -> str | None:
    """What is said of an effect beside a surer one of its mechanism, of whose law it may be the departure.

    So may a curve be beside a curve that no law follows: what its free form misses is of the load alone. It is none
    where it is larger than laws depart by.
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


def end_of_range_of(model: ExtendedModel, sessions: Sequence[Session], thresholds: Thresholds) -> str | None:
    """What is said of a unit that relaxes more slowly, or faster, than the ``model`` can follow, effects and all."""
    slow, fast = model.relaxation_rate_per_s <= RATE.lower, model.relaxation_rate_per_s >= RATE.upper
    if not (slow or fast) or apart(sessions, model, replace(model, relaxing_share=0.0)) <= thresholds.tolerable:
        return None
    return (
        f"the baseline's relaxation has come to the end of its range, {1.0 / (RATE.lower if slow else RATE.upper):g} s:"
        f" a unit that relaxes {'more slowly' if slow else 'faster'} is beyond it, and what is named may be that"
    )


def bent_to_the_end_of(model: ExtendedModel, names: Sequence[Name] = ()) -> str | None:
    """What is said of a curve that would bend farther than its equation can, in a model or by which one is named."""
    if ended := [part.name for part in model.parts if part.bends_too_little]:
        return (
            f"{listed(ended, 'and')} has come to the end of its range: the unit bends farther"
            " than that equation can, and what it misses may stand in the names of other effects, which are half sure"
            " at most"
        )
    by = [(one.effect.name, one.by.fit.model) for one in names if one.by is not None and one.by.fit is not None]
    if followed := [name for name, fitted in by if fitted.part(name).bends_too_little]:
        return (
            f"{listed(followed, 'and')} has come to the end of its range: the unit bends farther than that equation"
            " can, so that its parameters are bounds (the extended model keeps the free form)"
        )
    return None


def wall_ratio_of(model: ExtendedModel, sessions: Sequence[Session], thresholds: Thresholds) -> str | None:
    """What is said of a leak, or of heat, beside a wall and a gas of which nothing says how stiff each is."""
    units = {one.recording.sensor.unit.quantity for one in sessions}
    is_of_gas = any(part.effect.stage == "gas" for part in model.parts) and units.isdisjoint(NO_PRESSURES)
    if not is_of_gas or model.wall_ratio != USUAL_WALL_RATIO:  # one is known
        return None
    softest, stiffest = PAPER_WALL_RATIOS
    gauges = [one.recording for one in sessions if one.recording.sensor.unit.quantity == "pressure"]
    if any("effective_area_m2" in one.metadata for one in gauges):
        least, most = WALL_RATIOS
        mend = f"mend effective_area_m2: the declared one makes an N beyond {least:g} to {most:g}, which no tube has"
    elif apart(sessions, model, replace(model, wall_ratio=stiffest)) > thresholds.material:
        mend = "declare effective_area_m2"
    else:
        return None
    return (
        f"how stiff the wall is beside the gas is not known (N = {model.wall_ratio:g} is taken, units of the paper have"
        f" {softest:g} to {stiffest:g}): rates of leaks and times of heat go with it, beyond their intervals"
        f" ({mend})"
    )


def worse_of(won: Gain, beyond: str | None) -> str:
    """What is said of an extension whose gain `is_rejected`; ``beyond``: how loads there go beyond the fitted ones."""
    low, high = won.ci95
    least, most = (percent(-0.01 * bound) for bound in (high, low))
    by = f"by {least.removesuffix(' %')} to {most}" if won.is_certain else "which may be chance"
    why = beyond or "the held-out loads are like the fitted ones, so that the session or the model is wrong"
    return (
        f"on held-out data the extended model is worse than the baseline ({won.rmse_before:.4g} to"
        f" {won.rmse_after:.4g} {won.unit}, {by}): {why}; it is rejected, so that model and calibration are the"
        " baseline's until such a recording is among those that are fitted"
    )


def elsewhere_of(off: float, within: float, beyond: str | None) -> str:
    """What is said where recordings that were not fitted are ``off`` by far more than those that were."""
    why = beyond or (
        "their loads are neither faster, higher nor longer, so that they are of another unit, or of one that was"
        " changed, or the model follows the fitted ones for a wrong reason"
    )
    return f"held-out recordings are off by {percent(off)} of full scale, fitted ones by {percent(within)}: {why}"


def past_of(zero: Zero, scale: Scale) -> str:
    """What is said of a zero that may have drifted to where it stands."""
    value = zero.value * scale.reading
    return (
        f"the zero stands at {value:.3g} {scale.unit.symbol} where the recordings begin: it drifts that way, so that it"
        " may have begun before, or there is an offset beside (record from where the unit is switched on)"
    )


def led_back_of(zero: Zero, scale: Scale, thresholds: Thresholds) -> str:
    """What is said of a zero that is led back from loads so high that the unit may do anything below, or from a past.

    Of a unit that is unloaded in the recordings, though never as they begin, nothing but its past is unknown.
    """
    stands = (
        f"the reading stands at {zero.value * scale.reading:.3g} {scale.unit.symbol} ({percent(zero.size)} of full"
        " scale): an offset, a tare, or what the unit"
    )
    if zero.led_from <= thresholds.standing:
        return (
            f"without load {stands} remembers of loads before the recordings, of which this data shows nothing (record"
            " a rest before the first load)"
        )
    return (
        f"led back to no load from {percent(zero.led_from)} of it, {stands} does below such loads, or remembers of"
        " those before, of which this data shows nothing (record a rest without load that the sensor can read)"
    )


def in_a_tare_of(
    zeros: Sequence[Zero], effects: Sequence[Effect], scale: Scale, thresholds: Thresholds
) -> tuple[str, ...]:
    """What is said of ``effects`` that are curves, where the full scale that they are told over holds a tare.

    The same curve over another range has other parameters: a parabola's distance from its chord goes by the square.
    """
    curves = [effect.name for effect in effects if effect.is_memoryless]
    return tuple(
        f"full scale is {scale.load_n:.4g} N of the load as logged, {(1.0 + tare.value) * scale.load_n:.4g} N without"
        f" the tare: the parameters of the {listed(curves)} are of a curve over all of the former (take the tare off"
        " the loads for those of the latter)"
        for tare in zeros
        if curves and tare.effect.shifts == "load" and abs(tare.value) > thresholds.standing
    )


def as_the_cell_shows_of(zeros: Sequence[Zero], scale: Scale) -> tuple[str, ...]:
    """What is said of the force that a calibration gives, where the load cell that it was made by has a tare."""
    return tuple(
        "a calibration gives the force as the load cell shows it,"
        f" {abs(tare.value) * scale.load_n:.3g} N {'more' if tare.value < 0.0 else 'less'} than what presses (take the"
        " tare off the loads for one that does not)"
        for tare in zeros
        if tare.effect.shifts == "load"
    )


def crept_of(drift: Name, tare: Zero | None) -> str | None:
    """What is said of a drift of the zero that a tare may make by creeping, where there is one."""
    if tare is None:
        return None
    return (
        f"{in_words(drift.effect.name)} moves the reading by {percent(drift.member.size)} of full scale,"
        f" which a tare of {percent(tare.size)} may do by creeping, so that it is not named (zero the load cell, and"
        " log a rest)"
    )


def own_gains_of(gains: Sequence[OwnGain]) -> list[str]:
    """What is said of recordings of which each has a gain of its own, or several."""
    if not gains:
        return []
    told = "all else is told with this allowed for, and no model foresees the gain of another recording"
    if changes := changes_of(gains):
        return [f"the gain changes {_when(changes)}, as where a unit slips: {told}"]
    low, high = (of(gains, key=lambda one: one.share) for of in (min, max))
    return [
        f"each recording has a gain of its own, from {percent(low.share, signed=True)} in {low.recording} to"
        f" {percent(high.share, signed=True)} in {high.recording} beside that of all, as where a unit is taken out and"
        f" put back: {told} (leave the unit in place, or calibrate it each time)"
    ]


def own_zeros_of(zeros: OwnZeros | None, scale: Scale) -> list[str]:
    """What is said of recordings of which each has a zero of its own."""
    if zeros is None:
        return []
    low, high = (int(of(zeros.offsets)) for of in (np.argmin, np.argmax))

    def told(at: int) -> str:
        share = float(zeros.offsets[at])
        of_scale = f"{percent(share, signed=True)} of full scale"
        return f"{scale.zero + share * scale.reading:.3g} {scale.unit.symbol} ({of_scale}) in {zeros.names[at]}"

    return [
        f"by the extended model each recording has a zero of its own, from {told(low)} to {told(high)}: that is allowed"
        " for here (zero the load cell and the sensor before each)"
    ]


def zero_changes_said(changes: Sequence[ZeroChange]) -> list[str]:
    """What is said of recordings in which the reading without load changes at moments."""
    if not changes:
        return []
    return [
        f"the zero jumps, in shares of full scale, {_when(changes)}, as where a unit slips, water moves in a line or"
        " the room warms:"
        " jumps that are not seen may imitate any effect of the unit, so that none is more than half sure, and no model"
        " foresees those of another recording"
    ]


def _when(changes: Sequence[OwnGain | ZeroChange]) -> str:
    few = [f"by {percent(one.share, signed=True)} {time_of(one)} in {one.recording}" for one in changes[:SAID]]
    return f"{', '.join(few)}{f' and {len(changes) - SAID} more' if len(changes) > SAID else ''}"


def nearest_of(found: Inference, thresholds: Thresholds) -> list[str]:
    """What is said of a law that follows most of what no cause accounts for, and is not named."""
    if found.nearest is None:
        return []
    effect, left, beside = found.nearest
    return [
        f"{in_words(effect.name)} alone follows most of what the baseline misses ({percent(left)} of full scale"
        f" where it was fitted, {percent(beside)} with it), and so may small imperfections of many kinds,"
        f" {percent(thresholds.imperfection)} each, so that it is not named: if this unit is better than that, ask"
        f" for less than {percent(thresholds.material)} as material"
    ]


def refusals_of(found: Inference) -> list[str]:
    """What is said of effects that are not named for what others do: taken out again, or undone by one another."""
    if not found.can_validate:
        return [ONE_CYCLE]
    said = []
    if found.undone:
        said.append(f"these effects largely cancel one another, so that none is named: {listed(found.undone)}")
    if found.refused:
        said.append(
            f"tried and left out again: {listed(dict.fromkeys(found.refused))}: of no help in foreseeing recordings or"
            " load cycles that were left out in turn, or too small there for what the held-out loads ask of them"
        )
    return said
