"""From recordings to a diagnosis: integrity, baseline, inference, what is left, what it is worth on held-out data."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from smartshoe.arrays import Array
from smartshoe.diagnosis._aligned import aligned, as_they_follow
from smartshoe.diagnosis._baseline import baseline_of, with_usual_arm
from smartshoe.diagnosis._characteristic import characteristic_of, conductance_of, friction_of
from smartshoe.diagnosis._excitation import Excitation, excitation_of
from smartshoe.diagnosis._force import force_error, force_of, undoes
from smartshoe.diagnosis._held_out import Errors, Gain, errors, gain, own_of, residual_of
from smartshoe.diagnosis._inference import Inference, infer
from smartshoe.diagnosis._naming import Name, confidence_of, names_of
from smartshoe.diagnosis._next_experiment import next_experiment
from smartshoe.diagnosis._noise_kinds import noise_kinds
from smartshoe.diagnosis._parameters import in_unit, joint_parameters, parameters_of
from smartshoe.diagnosis._ranges import beyond, ranges_of
from smartshoe.diagnosis._residual_structure import ResidualStructure, residual_structure
from smartshoe.diagnosis._result import Cause, Diagnosis, GoodnessOfFit, Rival, Statement, Trace, Verdict
from smartshoe.diagnosis._session import (
    Scale,
    Session,
    at_full_rate,
    full_scale,
    load_cycles,
    pastless,
    prepare,
    thinning,
)
from smartshoe.diagnosis._settling import Progress
from smartshoe.diagnosis._validation import fitted_rms
from smartshoe.diagnosis._verdict import (
    crept_of,
    departure_of,
    elsewhere_of,
    few_cycles_of,
    known_error,
    moved_of,
    not_shown_of,
    off_elsewhere,
    other_kind_of,
    own_gains_of,
    parted_clocks,
    past_of,
    refusals_of,
    sentence_of,
    unexplained_of,
    verdict_of,
    worse_of,
    zero_changes_said,
)
from smartshoe.diagnosis._zero import Zero, creeping, offsets, shift_of, zeros_of
from smartshoe.diagnosis.decay import decay_of
from smartshoe.errors import UsageError
from smartshoe.files.logs.accepted import RecordingLike, recordings_of
from smartshoe.integrity import Integrity, examine, twins
from smartshoe.integrity.thresholds import Thresholds, decided_by, largest_of_noise
from smartshoe.kernels.blas import on_one_thread
from smartshoe.models.effects import Effect
from smartshoe.models.effects.effect import CoreEffect
from smartshoe.models.extended import ExtendedModel
from smartshoe.recording import Recording
from smartshoe.signals.noise import NORMAL_95


def _silent(_: str) -> None:
    return None


def diagnose(
    recordings: RecordingLike | Sequence[RecordingLike],
    hold_out: RecordingLike | Sequence[RecordingLike] = (),
    *,
    material: float | None = None,
    thresholds: Thresholds | None = None,
    progress: Progress = _silent,
) -> Diagnosis:
    """What the baseline simulation of ``recordings`` gets wrong, why, and what mending it gains.

    Parameters
    ----------
    recordings
        Load and reading of one unit (recordings, paths or DataFrames), each a session of its own unless its metadata
        ``continues`` names another.
    hold_out
        Recordings to judge on. They select nothing and are never fitted; without them every third load cycle is.
    material
        Share of the full-scale reading below which nothing counts; that of ``thresholds`` where it is not given.
    thresholds
        Every number that decides.
    progress
        Called with a few words at each step.

    Raises
    ------
    UsageError
        Where no recording is given, and of numbers to decide by that are none. A diagnosis that the data cannot
        support comes back with the verdict "refused" and the reason in ``limits``.
    """
    fitted, kept_out = recordings_of(recordings), recordings_of(hold_out, "hold_out")
    if not fitted:
        raise UsageError("diagnose was given no recording: give one at least")
    decided = decided_by(thresholds, material)
    everything, count = [*fitted, *kept_out], len(fitted)
    integrity = examine(everything, decided)
    useless = [k for k, mask in enumerate(integrity.usable) if not mask.any()]
    left_out = dict(zip(useless, integrity.refusals, strict=True))
    pulled = {k: said for k, one in enumerate(everything) if k not in left_out and (said := _outside(one, decided))}
    if any(k < count for k in pulled):
        return _refused(everything, integrity, [said for k, said in pulled.items() if k < count], decided)
    left_out |= pulled
    if all(k in left_out for k in range(count)):
        return _refused(everything, integrity, list(left_out.values()), decided)
    usable = tuple(mask & (k not in left_out) for k, mask in enumerate(integrity.usable))
    found = _diagnosed(everything, count, replace(integrity, usable=usable), decided, progress)
    return replace(found, limits=(*_without(everything, count, left_out), *twins(everything), *found.limits))


def _outside(recording: Recording, thresholds: Thresholds) -> str | None:
    """Why a recording is none of a unit that is pressed, or None."""
    low, high = (float(value) for value in np.percentile(recording.force_n, [1, 99]))
    if not (low < 0 < high and min(-low, high) > thresholds.same * max(-low, high)):
        return None
    return (
        f"{recording.label}: the load runs from {low:.4g} to {high:.4g} N: the catalogue is of a unit that is pressed,"
        " which bears compression only (turn the sign of the load, or take its mean out, if that is what was meant)"
    )


def _without(recordings: Sequence[Recording], count: int, left_out: Mapping[int, str]) -> list[str]:
    """What is said of recordings that lack or are left out, by place; the first ``count`` were to be fitted."""
    said = [f"left out: {why}" for why in left_out.values()]
    names = {recordings[k].name for k in left_out}
    for one in pastless([one for k, one in enumerate(recordings) if k not in left_out]):
        earlier = one.metadata["continues"]
        said.append(
            f"{one.label} continues {earlier}, which is left out: it is taken as a session of its own"
            if earlier in names
            else f"{one.name} continues {earlier}, which is not among the recordings: it is taken as the unit's first"
            f" after a rest (give {earlier} too)"
        )
    if count < len(recordings) and all(k in left_out for k in range(count, len(recordings))):
        said.append("no recording to judge on is left: load cycles of those that are fitted are held out instead")
    return said


def _refused(
    recordings: Sequence[Recording], integrity: Integrity, refusals: Sequence[str], thresholds: Thresholds
) -> Diagnosis:
    sensors = recordings[0].sensors
    unit = sensors[0].unit.symbol if sensors else ""
    return Diagnosis(
        "refused",
        f"no diagnosis: {refusals[0]}",
        unit,
        0.0,
        0.0,
        data_faults=integrity.faults,
        limits=(*refusals, *(said for one in recordings if (said := _seen(one, thresholds)) is not None)),
        thresholds=thresholds,
    )


def _seen(recording: Recording, thresholds: Thresholds) -> str | None:
    """What is known of a recording without a model."""
    decay = decay_of(recording, thresholds)
    return decay.says if decay is not None else characteristic_of(recording, thresholds)


@dataclass(frozen=True, eq=False)
class _Prepared:
    sessions: list[Session]
    fine: list[Session]
    scale: Scale
    limits: list[str]
    start: ExtendedModel
    excitation: Excitation
    is_no_unit: bool
    clocks: Sequence[tuple[Effect, Array]]
    is_moved: bool


def _prepared(recordings: Sequence[Recording], count: int, integrity: Integrity, thresholds: Thresholds) -> _Prepared:
    clocks = aligned(recordings, integrity)
    held_out = [place >= count for place in clocks.places]
    count = held_out.count(False)
    scale = full_scale(clocks.recordings[:count], clocks.usable[:count], thresholds)
    held = held_out if any(held_out) else None
    factor = thinning(clocks.recordings[:count], scale, thresholds)
    sessions = [
        replace(one, index=clocks.places[one.index])
        for one in prepare(clocks.recordings, clocks.usable, held, scale, factor, thresholds)
    ]
    start = baseline_of(sessions, scale)
    if clocks.parts:  # against a load of another clock no relaxation is found
        start = with_usual_arm(start)
    for added, values in clocks.parts:
        start = start.with_part(added, values)
    excitation, ranges = excitation_of(sessions, thresholds), ranges_of(sessions, scale, thresholds)
    following = as_they_follow(clocks.recordings[:count], None if clocks.moved else integrity.one_clock)
    friction = [friction_of(recording, thresholds) for recording in following]  # what is late is not rubbed
    said_of_curve = (*friction, conductance_of(clocks.recordings[:count], thresholds))
    limits = [*clocks.says, *ranges.says, *(said for said in said_of_curve if said is not None), *excitation.limits()]
    fine = at_full_rate(sessions, clocks.usable, scale, thresholds)
    is_no_unit = ranges.is_trap or all(said is not None for said in friction)
    is_moved = not clocks.moved.isdisjoint(clocks.places[:count])
    return _Prepared(sessions, fine, scale, limits, start, excitation, is_no_unit, clocks.parts, is_moved)


@on_one_thread
def _diagnosed(
    recordings: Sequence[Recording], count: int, integrity: Integrity, thresholds: Thresholds, progress: Progress
) -> Diagnosis:
    given = _prepared(recordings, count, integrity, thresholds)
    sessions, fine, scale = given.sessions, given.fine, given.scale
    found = infer(given.start, sessions, thresholds, progress, not given.is_no_unit)
    progress("judging on held-out data")
    extended = found.fit.model
    plain, residuals = ([residual_of(one, model) for one in sessions] for model in (found.baseline.model, extended))
    before = residual_structure(sessions, plain, thresholds)
    after = residual_structure(sessions, residuals, thresholds)
    # What is held out decides over no name; it may be of loads that nothing was learnt of.
    learnt = [(replace(one, usable=one.fitted), left) for one, left in zip(sessions, residuals, strict=True)]
    learnt = [(one, left) for one, left in learnt if one.usable.any()]
    within = residual_structure([one for one, _ in learnt], [left for _, left in learnt], thresholds)
    everything = max(within.rms, within.size)
    silent = given.is_no_unit or not found.can_validate
    is_followed = fitted_rms(sessions, residuals) <= thresholds.departure * fitted_rms(sessions, plain)
    members = [one for one in found.members if one.name not in found.undone]
    names = names_of(
        members,
        everything,
        thresholds,
        is_followed=is_followed,
        is_clocked=given.excitation.goes_with_the_clock,
        is_unsteady=bool(found.zero_changes),
        alone=found.alone,
    )
    kinds = ((one, other_kind_of(one, extended, thresholds) or not_shown_of(one, given.excitation)) for one in names)
    unclear = [(one, said) for one, said in kinds if said is not None]
    unnamed = max((one.member.size for one, _ in unclear), default=0.0)
    unclear += [(one, moved_of(one)) for one in names if given.is_moved and one.effect.is_latency]
    names = _less(names, unclear)
    unclear += [(one, said) for one in names if (said := departure_of(one, names, thresholds))]
    names = _less(names, unclear)
    cycles = load_cycles(sessions, thresholds)
    surest = sorted(names, key=lambda one: -one.kind)[:cycles]
    unclear += [(one, few_cycles_of(one, cycles)) for one in names if one not in surest]
    names = _less(names, unclear)
    parted = parted_clocks(given.clocks, extended, sessions, thresholds)
    names = tuple(one for one in names if parted is None or one.effect not in [clock for clock, _ in given.clocks])
    remembered = sum(one.size for one in found.members if isinstance(one.effect, CoreEffect))
    zeros = () if silent else zeros_of(sessions, extended, scale, everything, remembered, thresholds, within.memory)
    zeros = tuple(one for one in zeros if one.size >= thresholds.material)
    past = [past_of(one, scale) for one in zeros if one.is_past]
    # A zero that jumps within recordings is no offset.
    zeros = tuple(
        one for one in zeros if not one.is_past and not (found.zero_changes and one.effect.shifts == "reading")
    )
    crept = [(one, tare) for one in names if (tare := creeping(zeros, one.effect, one.member.size, thresholds))]
    names = _less(names, crept)
    baseline, best = errors(fine, found.baseline.model), errors(fine, extended)
    causes = [_cause(name, found, fine, best, given, thresholds) for name in names]
    causes += [_zero_cause(zero, found, fine, best, given, thresholds) for zero in zeros]
    causes.sort(key=lambda one: -one.size)
    # What follows something else than the load is simulated by no unit, however well it fits.
    follows = all(name.is_sure and not name.kind_only for name in names)
    known = known_error(integrity.faults, sessions, scale)
    won = gain(baseline, best, scale, thresholds)
    elsewhere = off_elsewhere(sessions, residuals, within.size, thresholds)
    verdict: Verdict = "unexplained"
    if not given.is_no_unit:
        besides = elsewhere or (unnamed if unnamed > thresholds.tolerable else 0.0)
        verdict = verdict_of(causes, before, after, thresholds, follows, known, worse=won.is_loss, elsewhere=besides)
    rest = unexplained_of(causes, before, after)
    with_zero = _with_offset(extended, zeros, sessions, scale)
    noise_variance = max(best.rmse**2 - max(after.rms, elsewhere) ** 2, 0.0)
    explained = verdict in ("adequate", "explained") or after.is_noise
    noise = noise_kinds(fine, extended, integrity.faults, explained, thresholds.material, within.memory)
    named = {cause.name for cause in causes} | {name.member.name for name in names}
    parameters, covariance = joint_parameters(found.fit, scale)
    plain_force, force = (force_error(fine, model) for model in (found.baseline.model, extended))
    by_extended = undoes(force, plain_force)
    told_force = force_of(plain_force, force, thresholds)
    ways = beyond(fine, scale, thresholds) if won.is_loss or elsewhere else None
    return Diagnosis(
        verdict,
        sentence_of(verdict, causes, baseline, best, rest, thresholds, worse=won.is_loss, elsewhere=elsewhere),
        scale.unit.symbol,
        scale.load_n,
        abs(scale.reading),
        causes=tuple(causes),
        minor=tuple(part.name for part in extended.parts if part.name not in named),
        data_faults=(*integrity.faults, *noise),
        baseline=_goodness(baseline, plain_force.held_out_n, before, scale),
        extended=_goodness(best, (force if by_extended else plain_force).held_out_n, after, scale),
        gain=None if best.is_empty else won,
        explainable_percent=_percent_less(noise_variance, baseline.rmse**2),
        explained_percent=_percent_less(best.rmse**2, baseline.rmse**2),
        rivals=causes[0].rivals if causes else tuple(Rival(name, fall) for name, fall in found.screening[:4]),
        next_experiment=next_experiment(
            found, causes, sessions, given.excitation, open_=bool(rest.rms > thresholds.material), worse=won.is_loss
        ),
        limits=(
            *given.limits,
            *([worse_of(won, ways)] if won.is_loss else []),
            *([elsewhere_of(elsewhere, within.size, ways)] if elsewhere and not won.is_loss else []),
            *([told_force] if told_force else []),
            *([] if parted is None else [parted]),
            *(said for _, said in unclear),
            *past,
            *(crept_of(*one) for one in crept),
            *own_gains_of(found.own_gains),
            *zero_changes_said(found.zero_changes),
            *refusals_of(found),
        ),
        leftover=rest.says if verdict in ("unexplained", "partly_explained") else None,
        screening=found.screening,
        likeness=found.likeness,
        model=with_zero,
        baseline_model=found.baseline.model,
        force_model=None if by_extended else _with_offset(found.baseline.model, zeros, sessions, scale),
        parameters=parameters,
        covariance=covariance,
        traces=tuple(_trace(session, found.baseline.model, extended, scale) for session in fine),
        thresholds=thresholds,
    )


def _less(names: Sequence[Name], left_open: Sequence[tuple[Name, object]]) -> tuple[Name, ...]:
    """``names`` without those that are left open, for reasons that stand beside them."""
    return tuple(one for one in names if one not in [name for name, _ in left_open])


def _percent_less(after: float, before: float) -> float:
    """By how many percent a variance falls, 0 where it grows, NaN where nothing was judged."""
    if math.isnan(before):
        return before
    return 100.0 * max(0.0, 1.0 - after / before) if before > 0 else 0.0


def _cause(
    name: Name, found: Inference, fine: Sequence[Session], best: Errors, given: _Prepared, thresholds: Thresholds
) -> Cause:
    member = name.member
    won = gain(errors(fine, member.without.model), best, given.scale, thresholds)
    near = {a.effect: a.margin for a in member.alternatives}
    # Laws are weighed against the one that is named, which is not the best fit where a block stands for it.
    near |= {a.effect: a.margin - (name.by.margin if name.by is not None else 0.0) for a in member.laws}
    rivals = tuple(
        Rival(effect, margin)
        for effect, margin in sorted(near.items(), key=lambda one: one[1])
        if effect not in (None, name.effect.name)
    )
    nothing = next((a.margin for a in member.alternatives if a.effect is None), 0.0)
    evidence = [
        Statement(
            "fall of -2 log evidence",
            nothing,
            0.0,
            f"without it, all else fitted anew, the data is less likely by {nothing:,.0f} of -2 log, also where the"
            " others may depart towards any law of their kinds",
        ),
        *_held_out_evidence(member.size, won, thresholds.material),
    ]
    if rivals:
        evidence.append(
            Statement(
                "margin to the nearest rival",
                rivals[0].margin,
                0.0,
                f"{rivals[0].effect.replace('_', ' ')} in its place is worse by {rivals[0].margin:,.0f}",
            )
        )
    if not name.is_sure:
        does_most_alone = found.alone is not None and found.alone.kind == name.effect.kind
        why = (
            "by itself it foresees best what is left out"
            if does_most_alone
            else "it is named for its size, which is more than all that is left, or than small imperfections add up to"
        )
        evidence.append(
            Statement(
                "confidence of its kind",
                name.kind,
                thresholds.least_confidence,
                f"it is not sure, since others may do what it does: {why}",
            )
        )
    elif name.kind_only:
        is_certain = name.kind >= thresholds.least_confidence
        why = (
            "the kind is sure, the law is not: no equation of it follows better than others"
            if is_certain
            else "no equation of its kind follows it: it may be of a kind that the catalogue does not have"
        )
        evidence.append(Statement("kind", float(is_certain), 1.0, why))
    if name.by is not None:
        missed = max(name.by.margin, 0.0) / max(member.fall, 1.0)  # of -2 log likelihood
        evidence.append(
            Statement(
                "share of its kind that the law misses in percent",
                100 * missed,
                100 * thresholds.departure**2,
                f"the law misses {100 * missed:.2g} % of what {member.name.replace('_', ' ')} explains, no more than"
                " laws do: that stays in the extended model, the parameters are the law's in its place",
            )
        )
    lacking = name.effect.exposed_by - given.excitation.present
    if lacking:
        said = ", no ".join(sorted(word.replace("_", " ") for word in lacking))
        evidence.append(
            Statement("what would show it best is missing", float(len(lacking)), 0.0, f"the data holds no {said}")
        )
    by = None if name.by is None else name.by.fit
    values = parameters_of(by or found.fit, name.effect.name if by else member.name, given.scale)
    sure = confidence_of(name, thresholds), name.law
    return Cause(name.effect, *sure, name.equivalents, values, tuple(evidence), won, member.size, rivals, member.name)


def _held_out_evidence(size: float, won: Gain, material: float) -> list[Statement]:
    moves = Statement(
        "size in percent of full scale",
        100 * size,
        100 * material,
        f"it moves the reading by {100 * size:.3g} % of full scale",
    )
    if math.isnan(won.gain_percent):
        return [moves]
    way = "falls" if won.rmse_after <= won.rmse_before else "rises"
    return [
        moves,
        Statement(
            "gain on held-out data in percent",
            won.gain_percent,
            0.0,
            f"on data not fitted the error {way} from {won.rmse_before:.4g} to {won.rmse_after:.4g} {won.unit}",
        ),
    ]


def _zero_cause(
    zero: Zero, found: Inference, fine: Sequence[Session], best: Errors, given: _Prepared, thresholds: Thresholds
) -> Cause:
    """An offset or tare: removed, every reading is off by it."""
    scale = given.scale
    worse = Errors(best.squares + best.counts * zero.size**2, best.counts, best.spread)
    won = gain(worse, best, scale, thresholds)
    parameter = zero.effect.parameters[0]
    factor, unit = (scale.load_n, "N") if "FS_load" in parameter.unit else (scale.reading, scale.unit.symbol)
    interval = zero.value - NORMAL_95 * zero.sd, zero.value + NORMAL_95 * zero.sd
    values = {parameter.name: in_unit(zero.value, zero.sd, interval, factor, unit)}
    deviations = abs(zero.value) / zero.sd
    seen = Statement(
        "deviations from nothing",
        deviations,
        largest_of_noise(1, thresholds),
        f"it is {deviations:.3g} standard deviations from nothing",
    )
    sure = (
        thresholds.least_confidence
        if zero.alternatives
        else 1.0 - thresholds.false_name,  # by its model alone, or seen
        1.0 / (1.0 + len(zero.alternatives)),
    )
    evidence = (seen, *_held_out_evidence(zero.size, won, thresholds.material))
    return Cause(zero.effect, *sure, zero.alternatives, values, evidence, won, zero.size)


def _with_offset(
    model: ExtendedModel, zeros: Sequence[Zero], sessions: Sequence[Session], scale: Scale
) -> ExtendedModel:
    """``model`` with the recordings' mean offset, so that it gives readings as they are logged."""
    for zero in zeros:  # the chain's end multiplies what is added to the reading before it
        value = zero.value / model.gain if zero.effect.shifts == "reading" else zero.value
        model = model.with_part(zero.effect, np.array([value]))
    if not any(zero.effect.shifts == "reading" for zero in zeros):
        rest = float(np.mean(offsets(sessions, model))) + scale.zero / scale.reading
        if rest != 0.0:
            model = model.with_part(shift_of("reading"), np.array([rest / model.gain]))
    return model


def _goodness(found: Errors, force_n: float, left: ResidualStructure, scale: Scale) -> GoodnessOfFit | None:
    if found.is_empty:
        return None
    span = abs(scale.reading)
    return GoodnessOfFit(
        found.rmse * span,
        scale.unit.symbol,
        found.fit_percent,
        force_n,
        left.rms * span,
        found.variance_explained_percent,
    )


def _trace(session: Session, baseline: ExtendedModel, extended: ExtendedModel, scale: Scale) -> Trace:
    def told(shares: Array) -> Array:
        return np.asarray(scale.zero + shares * scale.reading)

    def simulated(model: ExtendedModel) -> Array:
        plain = model.simulate(session.conditions)
        return told(plain + own_of(session, model, session.reading - plain)[1])

    return Trace(
        session.recording.name,
        session.conditions.time_s + session.recording.time_s[0],
        session.conditions.load * scale.load_n,
        told(session.reading),
        simulated(baseline),
        simulated(extended),
        session.usable,
        session.held_out,
        session.cycle,
        session.index,
    )


__all__ = ["diagnose"]
