"""What limits a diagnosis, in sentences: causes that are withheld, and what no model foresees."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from smartshoe.arrays import Array
from smartshoe.diagnosis._arms import arms_of, is_stretched
from smartshoe.diagnosis._excitation import Excitation
from smartshoe.diagnosis._gains_and_zeros import OwnGain, ZeroChange, changes_of
from smartshoe.diagnosis._held_out import Gain
from smartshoe.diagnosis._inference import Inference
from smartshoe.diagnosis._naming import Name
from smartshoe.diagnosis._session import Scale, Session
from smartshoe.diagnosis._settling import listed
from smartshoe.diagnosis._zero import Zero
from smartshoe.integrity.thresholds import Thresholds
from smartshoe.models.effects import Effect
from smartshoe.models.effects.exposure import CHANNELS, LATER_CYCLES, SAYS
from smartshoe.models.extended import ExtendedModel

SAID = 4  # changes of a gain, or a zero, that are said one by one


def parted_clocks(
    told: Sequence[tuple[Effect, Array]], model: ExtendedModel, sessions: Sequence[Session], thresholds: Thresholds
) -> str | None:
    """What is said of a lag between clocks that the fit sees otherwise than the edges of load and reading did.

    By all that makes the model late in the middle of what is fitted.
    """
    if not {one.name for one, _ in told} & {*model.names}:
        return None
    middle_s = 0.5 * float(np.mean([one.conditions.time_s[-1] for one in sessions if one.fitted.any()]))
    lag_s = sum(one.late_s(values, middle_s) for one, values in told)
    fitted_s = sum(part.effect.late_s(part.values, middle_s) for part in model.parts)
    if abs(fitted_s - lag_s) <= max(thresholds.same * abs(lag_s), thresholds.echo_s):
        return None
    return (
        f"the reading is {lag_s:.3g} s late by the edges of load and reading, {fitted_s:.3g} s beside the other"
        " effects: one of them imitates the rest (record both by one clock)"
    )


def other_kind_of(name: Name, model: ExtendedModel, thresholds: Thresholds) -> str | None:
    """What is said of an effect that follows best where it is of another kind, or is the wall's own arm.

    A block of what no law does is one where it differs from a law by more than laws do.
    """
    told = name.effect.name.replace("_", " ")
    part = model.part(name.member.name)
    if part.effect.why_unnamed and name.by is None and part.effect.departs_by(part.values) > thresholds.law_departure:
        return f"the reading {part.effect.why_unnamed}, which no effect of the catalogue does, so that it is not named"
    if name.effect is part.effect and part.kind_ends_at:
        parameter, value = part.kind_ends_at[0]
        unit = "" if parameter.unit == "1" else f" {parameter.unit}"
        return (
            f"what follows best as {told} has its {parameter.name.replace('_', ' ')} at {value:g}{unit}, where it"
            " turns into an effect of another kind, so that it is not named"
        )
    if is_stretched(model) and (part.name in dict(arms_of(model)) or part.effect.delay_s(part.values) < 0.0):
        return (
            f"beside {told} the wall's own relaxation has come to the end of its range, where no wall's is: either may"
            " be the other's, or undo it, so that it is not named"
        )
    return None


def not_shown_of(name: Name, excitation: Excitation) -> str | None:
    """What is said of a memory of which recordings of one load cycle hold nothing that shows it.

    A set that stays and an arm that relaxes slowly end such a cycle alike.
    """
    if excitation.shows(name.effect):
        return None
    ways = " or ".join(SAYS[word] for word in sorted(name.effect.exposed_by - LATER_CYCLES - CHANNELS))
    return (
        f"{name.effect.name.replace('_', ' ')} fits, but recordings of one load cycle show it only with {ways}, so that"
        " it is not named"
    )


def moved_of(name: Name) -> str:
    """What is said of a latency that is left where readings were moved to the load's clock before."""
    return (
        f"{name.effect.name.replace('_', ' ')} fits, but readings were moved to the load's clock before, each by its"
        " own lag, of which it may be a rest, so that it is not named"
    )


def few_cycles_of(name: Name, cycles: int) -> str:
    """What is said of an effect beside as many surer ones as there are load cycles to tell them by."""
    return (
        f"{name.effect.name.replace('_', ' ')} fits, but {cycles} load cycles show no more than {cycles} causes, so"
        " that it is not named (repeat the cycles)"
    )


def departure_of(name: Name, names: Sequence[Name], thresholds: Thresholds) -> str | None:
    """What is said of an effect beside a surer one of its mechanism, of whose law it may be the departure.

    It is none where it is larger than laws depart by.
    """
    alike = (one for one in names if one.effect.mechanism == name.effect.mechanism != "")
    surest = max(alike, key=lambda one: one.kind, default=name)
    if surest is name or name.member.size > thresholds.law_departure * surest.member.size:
        return None
    said, other = (one.effect.name.replace("_", " ") for one in (name, surest))
    return (
        f"{said} fits beside {other}, but both are {name.effect.mechanism}, of which no law is exact: it may be how the"
        " other's law departs, so that it is not named"
    )


def worse_of(won: Gain, beyond: str | None) -> str:
    """What is said of an extension whose gain `is_loss`; ``beyond``: how the loads there go beyond the fitted ones."""
    low, high = won.ci95
    why = beyond or "its loads are as those that were fitted, so that what is wrong is the session's or the model's"
    return (
        f"on what was held out the extended model is worse than the plain one ({won.rmse_before:.3g} to"
        f" {won.rmse_after:.3g} {won.unit}, by {-high:.2g} to {-low:.2g} %): {why}; do not correct such recordings by"
        " it before one of them is among those that are fitted"
    )


def elsewhere_of(off: float, within: float, beyond: str | None) -> str:
    """What is said where recordings that were not fitted are ``off`` by far more than those that were."""
    why = beyond or "its loads are as those that were fitted, so that it is of another unit, or the unit was changed"
    return f"what is held out is off by {100 * off:.2g} % of full scale, what was fitted by {100 * within:.2g} %: {why}"


def past_of(zero: Zero, scale: Scale) -> str:
    """What is said of a zero that may have drifted to where it stands."""
    value = zero.value * scale.reading
    return (
        f"the zero stands at {value:.3g} {scale.unit.symbol} where the recordings begin: it drifts that way, so that it"
        " may have begun before, or there is an offset beside (record from where the unit is switched on)"
    )


def crept_of(drift: Name, tare: Zero) -> str:
    """What is said of a drift of the zero that a tare may make by creeping."""
    return (
        f"{drift.effect.name.replace('_', ' ')} moves the reading by {100 * drift.member.size:.2g} % of full scale,"
        f" which a tare of {100 * tare.size:.2g} % may do by creeping, so that it is not named (zero the load cell, and"
        " log a rest)"
    )


def own_gains_of(gains: Sequence[OwnGain]) -> list[str]:
    """What is said of recordings of which each has a gain of its own, or several."""
    if not gains:
        return []
    told = "what is named is told beside these gains, and no model foresees that of another recording"
    if changes := changes_of(gains):
        return [f"the gain changes {_when(changes)}, as where a unit slips or is set anew: {told}"]
    low, high = (of(gains, key=lambda one: one.share) for of in (min, max))
    return [
        f"each recording has a gain of its own, from {100 * low.share:+.2g} % in {low.recording} to"
        f" {100 * high.share:+.2g} % in {high.recording} beside that of all, as where a unit is taken out and put back:"
        f" {told} (leave the unit in place, or calibrate it each time)"
    ]


def zero_changes_said(changes: Sequence[ZeroChange]) -> list[str]:
    """What is said of recordings in which the reading without load changes at moments."""
    if not changes:
        return []
    return [
        f"the zero changes, in shares of full scale, {_when(changes)}, as where a unit slips or water moves in a line:"
        " other such changes may do what any effect does, so that none is more than half sure, and no model foresees"
        " those of another recording"
    ]


def _when(changes: Sequence[OwnGain | ZeroChange]) -> str:
    few = [f"by {100 * one.share:+.2g} % at {one.begins_s:.4g} s in {one.recording}" for one in changes[:SAID]]
    return f"{', '.join(few)}{f' and {len(changes) - SAID} more' if len(changes) > SAID else ''}"


def refusals_of(found: Inference) -> list[str]:
    """What is said of effects that are not named for what others do: taken out again, or undone by one another."""
    if not found.can_validate:
        return [
            "one load cycle of one recording: nothing in it is independent of the rest, so that no cause can be told"
        ]
    said = []
    if found.undone:
        said.append(f"undo one another, so that none of them is named: {listed(found.undone)}")
    if found.refused:
        said.append(
            "fitted well but made recordings left out worse, and so were taken out again:"
            f" {listed(dict.fromkeys(found.refused))}"
        )
    return said
