"""From sound recordings to a diagnosis: baseline, inference, residual structure, held-out errors, verdict."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from smartshoe.arrays import Array
from smartshoe.diagnosis._causes import cause_of, zero_cause_of
from smartshoe.diagnosis._convergence import Progress
from smartshoe.diagnosis._force import (
    Compensation,
    compensation,
    limit_calibration_off,
    limit_clipped,
    limit_drift_held,
    limit_force,
    limit_latency_left,
    limit_not_undone,
    limit_unsound_readings,
)
from smartshoe.diagnosis._held_out import Errors, Gain, errors, gain
from smartshoe.diagnosis._inference import Inference, infer_with_gas_check
from smartshoe.diagnosis._lack_of_fit import repeating_structure
from smartshoe.diagnosis._likelihood import Fit
from smartshoe.diagnosis._limits import (
    SAID,
    limit_curve_range,
    limit_early,
    limit_held_out_excess,
    limit_nearest_law,
    limit_own_gains,
    limit_own_zeros,
    limit_refusals,
    limit_rejected,
    limit_relaxation_range,
    limit_wall_ratio,
    limit_zero_jumps,
)
from smartshoe.diagnosis._next_experiment import next_experiment
from smartshoe.diagnosis._noise_kinds import noise_with_memory, noise_without_memory
from smartshoe.diagnosis._own_lags import lags_of_judged, own_lags
from smartshoe.diagnosis._own_terms import own_terms_of, residual_of
from smartshoe.diagnosis._parameters import joint_parameters
from smartshoe.diagnosis._prepared import Prepared, prepared
from smartshoe.diagnosis._ranges import loads_beyond_fit
from smartshoe.diagnosis._reported_lines import as_thinned, lines_of, reported_tones
from smartshoe.diagnosis._residual_structure import ResidualStructure, beyond_noise, residual_structure
from smartshoe.diagnosis._result import Cause, Diagnosis, GoodnessOfFit, Rival, Trace, Verdict
from smartshoe.diagnosis._scale import Scale
from smartshoe.diagnosis._session import Session, fitted_of
from smartshoe.diagnosis._validation import error_of, fitted_rms
from smartshoe.diagnosis._verdict import (
    fault_rms,
    held_out_excess,
    held_out_rms,
    names_in,
    sentence_of,
    unexplained_of,
    unexplained_remark,
    untested_rms,
    verdict_of,
)
from smartshoe.diagnosis._withheld import NamedCauses, causes_among
from smartshoe.diagnosis._zero import OwnZeros, Zero, mean_offset, own_zeros, zeros_of
from smartshoe.integrity import DataFault, Integrity
from smartshoe.integrity.thresholds import Thresholds
from smartshoe.kernels.blas import on_one_thread
from smartshoe.models.effects import catalogue, shift_of
from smartshoe.models.effects.effect import CoreEffect
from smartshoe.models.extended import ExtendedModel
from smartshoe.recording import Recording


@on_one_thread
def diagnosed(
    recordings: Sequence[Recording], count: int, integrity: Integrity, thresholds: Thresholds, progress: Progress
) -> Diagnosis:
    """The diagnosis of ``recordings``; the first ``count`` are fitted, the others are held out."""
    given = prepared(recordings, count, integrity, thresholds)
    found = infer_with_gas_check(given.start, given.sessions, thresholds, progress, not given.is_no_unit)
    if (lags := own_lags(given.sessions, found.fit.model, thresholds)) is not None:
        progress("going through it again with each recording on one clock")
        on_one_clock = integrity.with_lags(lags.each_s, lags.are_about_mean, were_in_model=bool(given.clocks))
        again = prepared(recordings, count, on_one_clock, thresholds)
        other = infer_with_gas_check(again.start, again.sessions, thresholds, progress, not again.is_no_unit)
        left, before = error_of(again.sessions, other.fit.model), error_of(given.sessions, found.fit.model)
        if thresholds.clear * left**2 <= before**2:
            integrity, given, found = on_one_clock, again, other
    if late_s := lags_of_judged(given.sessions, found.fit.model, thresholds):
        integrity = integrity.with_judged_lags(late_s)
        given = prepared(recordings, count, integrity, thresholds)
    sessions, fine, scale = given.sessions, given.fine, given.scale
    progress("judging on held-out data")
    noise = noise_without_memory(given.fine, found.fit.model, integrity.faults, thresholds.material)
    structures = _structures_of(found, given, integrity.faults, noise)
    named = _named_causes(found, given, structures)
    with_drifts_held = _with_held_drifts(found.fit.model, named, sessions)
    if with_drifts_held is not found.fit.model:  # the fit, and what the names rest on, stay as they were
        found = replace(found, fit=replace(found.fit, model=with_drifts_held))
        after = _left_by(with_drifts_held, given, structures.told)
        structures = replace(structures, after=after.structure, residuals_after=after.fine, noise_after=after.noise)
    plain = replace(found.baseline.model, noise=structures.noise_before)
    extended = replace(found.fit.model, noise=structures.noise_after)
    baseline, best = errors(fine, plain), errors(fine, extended)
    causes = [cause_of(name, found, fine, best, scale, given.excitation, thresholds) for name in named.names]
    skips_own_zeros = found.zero_changes or found.own_gains or given.is_no_unit
    own_zero_offsets = None if skips_own_zeros else own_zeros(sessions, found.fit.model, thresholds)
    causes += [zero_cause_of(zero, best, scale, thresholds, own_zero_offsets is None) for zero in named.zeros]
    causes.sort(key=lambda one: -one.size)
    gained = gain(baseline, best, scale, thresholds)
    outcome = _outcome(found, given, structures, named, causes, gained)
    adopted = _Adopted(found.fit, extended, best, structures.after)
    # The only decision that held-out data makes: an extension that is worse there is not adopted.
    if gained.is_rejected:
        adopted = _Adopted(found.baseline, plain, baseline, structures.before)
    verdict, rest = outcome.verdict, unexplained_of(causes, structures.before, adopted.left)
    of_held_out = held_out_rms(fine, structures.residuals_after, thresholds)
    # Noise is at most what is not structure, and what fitted data holds besides its structure: what a model fails to
    # predict is not noise for that. What is white in held-out data is noise in any case.
    structure = of_held_out if outcome.unproven else min(max(structures.after.rms, outcome.elsewhere), of_held_out)
    no_more = min(best.rmse**2 - structure**2, extended.noise**2 - structures.within.rms**2)
    noise_variance = max(best.rmse**2 - of_held_out**2, no_more, 0.0)
    explained = verdict in ("adequate", "explained")
    noise += noise_with_memory(
        fine,
        extended,
        (*integrity.faults, *noise),
        explained or structures.after.is_noise,
        thresholds.material,
        structures.within.memory,
    )
    parts = {cause.name for cause in causes}
    parts |= {part for name in named.names for part in (name.member.name, *name.member.kin)}
    minor = tuple(part.name for part in extended.parts if part.name not in parts)
    parameters, covariance = joint_parameters(adopted.fit, scale)
    force = compensation(fine, adopted.model, plain, thresholds)
    # What no compensator undoes, for example the room's warmth, goes into its zero, averaged over recordings.
    zeros_apart = abs(force.zero - mean_offset(force.fine, force.model))
    has_own = bool(force.passed_over) or zeros_apart >= thresholds.material
    of_force = _limits_of_the_force(found, given, named, extended, force, outcome, structures, own_zero_offsets)
    says = sentence_of(
        verdict,
        names_in(causes, len(minor)),
        baseline,
        best,
        unexplained_remark(rest, 0.0 if gained.is_rejected else outcome.elsewhere, outcome.unproven, thresholds),
        thresholds,
        worse=gained.is_loss,
        withheld=_is_silent(found, given)
        or bool(named.limits or found.zero_changes or found.own_gains or found.nearest_law),
    )
    return Diagnosis(
        verdict,
        says,
        scale.unit.symbol,
        scale.load_n,
        abs(scale.reading),
        causes=tuple(causes),
        minor=minor,
        data_faults=(*integrity.faults, *noise),
        baseline=_goodness(baseline, force.before.held_out_n, structures.before, scale),
        extended=_goodness(adopted.errors, force.error.held_out_n, adopted.left, scale),
        gain=None if best.is_empty else gained,
        explainable_percent=_percent_less(noise_variance, baseline.rmse**2),
        explained_percent=_percent_less(adopted.errors.rmse**2, baseline.rmse**2),
        rivals=causes[0].rivals if causes else _strongest_single_effects(found),
        next_experiment=next_experiment(
            found, causes, sessions, given.excitation, open_=not explained, worse=gained.is_loss
        ),
        limits=(*given.limits, *of_force, *_limits_of_the_names(found, given, named, extended)),
        limits_of_the_force=of_force,
        clipped=force.clipped,
        leftover=rest.says if verdict in ("unexplained", "partly_explained") else None,
        screening=found.screening,
        likeness=found.likeness,
        model=_with_offset(adopted.model, sessions, scale),
        rejected=extended if gained.is_rejected else None,
        baseline_model=plain,
        force_model=_with_offset(force.model, force.fine, scale, force.undone) if has_own else None,
        parameters=parameters,
        covariance=covariance,
        traces=tuple(_trace(session, plain, extended, scale) for session in fine),
        thresholds=thresholds,
    )


@dataclass(frozen=True, eq=False)
class _Adopted:
    """The ``model`` that is offered, its ``fit``, its held-out ``errors``, and the structure it has ``left``."""

    fit: Fit
    model: ExtendedModel
    errors: Errors
    left: ResidualStructure


@dataclass(frozen=True, eq=False)
class _Structures:
    """The residual structure of the plain model, ``before`` effects, and of the extended one, ``after``.

    ``within`` is that of fitted data only. ``fault_error`` is the rms that data faults add, a share of full scale.
    ``residuals_before`` and ``residuals_after`` are the residuals (n,) of each recording at the full rate, since
    thinning correlates neighbouring noise. In all of them the tones of the faults ``told`` are taken out; in
    ``noise_before`` and ``noise_after``, the rms over fitted samples, they are not.
    """

    before: ResidualStructure
    after: ResidualStructure
    within: ResidualStructure
    fault_error: float
    residuals_before: Sequence[Array]
    residuals_after: Sequence[Array]
    noise_before: float
    noise_after: float
    told: Sequence[DataFault]


def _structures_of(
    found: Inference, given: Prepared, faults: Sequence[DataFault], noise: Sequence[DataFault]
) -> _Structures:
    """The residual structures of the baseline and of the extended model.

    ``faults`` were told of the recordings, ``noise`` of what the extended model leaves.
    """
    sessions = given.sessions
    of_faults, of_residuals = ([one for one in some if one.lines_hz] for some in (faults, noise))
    told = [*of_faults, *of_residuals]
    before, after = (_left_by(model, given, told) for model in (found.baseline.model, found.fit.model))
    # A line may be told of what is left for what is held out, which decides no name.
    partly_held = {one.index for one in sessions if one.fitted.any() and one.judged.any()}
    of_names = [*of_faults, *(one for one in of_residuals if one.recording not in partly_held)]
    thinned, fine = after.thinned, after.fine
    if len(of_names) < len(told):
        thinned, fine = _without_tones(given, *_residuals(found.fit.model, given), of_names)
    return _Structures(
        before.structure,
        after.structure,
        _structure_where_fitted(given, thinned, fine),
        fault_rms(faults, sessions, given.scale),
        before.fine,
        after.fine,
        before.noise,
        after.noise,
        told,
    )


@dataclass(frozen=True, eq=False)
class _Left:
    """What a model leaves, told tones apart: its ``structure``, and residuals (n,), ``thinned`` and ``fine``.

    ``noise``: rms over fitted samples at the full rate, with the tones.
    """

    structure: ResidualStructure
    thinned: list[Array]
    fine: list[Array]
    noise: float


def _left_by(model: ExtendedModel, given: Prepared, told: Sequence[DataFault]) -> _Left:
    """What a model leaves beside the tones that are ``told``."""
    thinned, fine = _residuals(model, given)
    noise = fitted_rms(given.fine, fine)
    thinned, fine = _without_tones(given, thinned, fine, told)
    quick = repeating_structure(given.fine, fine, given.thresholds)
    left = residual_structure(given.sessions, thinned, given.thresholds, quick, fine=(given.fine, fine))
    return _Left(left, thinned, fine, noise)


def _residuals(model: ExtendedModel, given: Prepared) -> tuple[list[Array], list[Array]]:
    """What a model leaves of each recording (n,), thinned and at the full rate."""
    thinned, fine = ([residual_of(one, model) for one in some] for some in (given.sessions, given.fine))
    return thinned, fine


def _without_tones(
    given: Prepared, thinned: Sequence[Array], fine: Sequence[Array], told: Sequence[DataFault]
) -> tuple[list[Array], list[Array]]:
    """Residuals (n,) of each recording, thinned and at the full rate, without the tones that are ``told``."""
    thinned, fine = [*thinned], [*fine]
    for k, session in enumerate(given.sessions):
        if lines_hz := lines_of(session, told):
            tones = reported_tones(given.fine[k], fine[k], lines_hz)
            thinned[k], fine[k] = thinned[k] - as_thinned(tones, session), fine[k] - tones
    return thinned, fine


def _is_silent(found: Inference, given: Prepared) -> bool:
    """Whether nothing may be named, whatever fits."""
    return given.is_no_unit or not found.can_validate


def _named_causes(found: Inference, given: Prepared, structures: _Structures) -> NamedCauses:
    """The causes among what was ``found``."""
    most = max(structures.within.rms, structures.within.size)
    residual_sd = structures.within.sd_of_mean(given.thresholds.hold_s)
    zeros = [] if _is_silent(found, given) else _material_zeros(found, given, most, residual_sd)
    return causes_among(found, given, zeros, most)


def _with_held_drifts(model: ExtendedModel, named: NamedCauses, sessions: Sequence[Session]) -> ExtendedModel:
    """``model`` with drifts held from the end of the fitted data on, unless a law is ``named`` for them.

    Nothing tells how such a drift goes on. A flexible block is held too, whatever its kind is named.
    """
    fitted = ((one.conditions, one.conditions.time_s[one.fitted]) for one in fitted_of(sessions))
    ends_s = max(at.before.get("time_s", 0.0) + float(time_s[-1]) for at, time_s in fitted)
    return model.held_after(ends_s, {name.effect.name for name in named.names})


@dataclass(frozen=True, slots=True)
class _Outcome:
    """The verdict and its grounds.

    ``gained``: on held-out data; ``elsewhere``: the `held_out_excess`; ``unproven``: the `untested_rms`.
    """

    verdict: Verdict
    gained: Gain
    elsewhere: float
    unproven: float


def _outcome(
    found: Inference,
    given: Prepared,
    structures: _Structures,
    named: NamedCauses,
    causes: Sequence[Cause],
    gained: Gain,
) -> _Outcome:
    """The verdict, from the structures ``structures`` and what is ``gained`` on held-out data."""
    fine, off, fault_error, thresholds = (
        given.fine,
        structures.residuals_after,
        structures.fault_error,
        given.thresholds,
    )
    within = max(structures.within.size, beyond_noise(fine, off, thresholds), fault_error)
    elsewhere = held_out_excess(fine, off, within, thresholds)
    unproven = 0.0
    if not (found.can_validate and structures.after.is_tested):
        # Beside causes the remainder is compared with what was wrong, tested or not.
        before = structures.residuals_before if found.can_validate and causes else None
        unproven = untested_rms(fine, off, structures.after, thresholds, fault_error, before)
    if given.is_no_unit:  # a reading that follows something other than the load is no unit's, however well it fits
        return _Outcome("unexplained", gained, elsewhere, unproven)
    # An unsure companion of a sure cause does not mean that there is no law.
    is_lawful = any(name.is_sure for name in named.names) and not any(name.kind_only for name in named.names)
    # What the model follows is real, even without a name, or with too little left to be tested.
    least = max(thresholds.tolerable, thresholds.material, fault_error)
    certain_gain = 0.0 if causes else gained.certain_gain(given.scale)
    besides = max(elsewhere, unproven, *(one for one in (named.unnamed_rms, certain_gain) if one > least))
    doubtful = gained.is_loss or gained.growth(given.scale) > thresholds.tolerable or given.is_integral
    left = structures.before, structures.after
    verdict = verdict_of(causes, *left, thresholds, is_lawful, fault_error, doubtful=doubtful, elsewhere=besides)
    return _Outcome(verdict, gained, elsewhere, unproven)


def _limits_of_the_force(
    found: Inference,
    given: Prepared,
    named: NamedCauses,
    extended: ExtendedModel,
    force: Compensation,
    outcome: _Outcome,
    structures: _Structures,
    own_zero_offsets: OwnZeros | None,
) -> tuple[str, ...]:
    """What limits a calibration's force: loads beyond the fitted ones, effects that are not undone, zeros, gains."""
    gained, thresholds = outcome.gained, given.thresholds
    elsewhere = 0.0 if gained.is_rejected else outcome.elsewhere  # one of the two sentences is enough
    ways = loads_beyond_fit(given.sessions, given.scale, thresholds) if gained.is_rejected or elsewhere else None
    undone = extended if force.is_plain else force.model
    return (
        *limit_rejected(gained, ways),
        *limit_held_out_excess(elsewhere, structures.within.size, ways),
        *limit_force(force),
        *limit_clipped(force),
        *limit_latency_left(force),
        *([] if gained.is_rejected else limit_not_undone(undone, given.fine[0].conditions.step_s)),
        *limit_drift_held(force, thresholds),
        *named.zero_limits,
        *limit_own_gains(found.own_gains),
        *limit_own_zeros(own_zero_offsets, given.scale),
        *limit_calibration_off(force, thresholds),
        *limit_unsound_readings(force, given.scale, thresholds),
        *limit_zero_jumps(found.zero_changes),
    )


def _limits_of_the_names(
    found: Inference, given: Prepared, named: NamedCauses, extended: ExtendedModel
) -> tuple[str, ...]:
    """What limits the names: effects that are no causes, models at the end of their range, refused effects."""
    return (
        *named.limits,
        *limit_early(extended, named.names),
        *limit_relaxation_range(extended, given.sessions, given.thresholds, beside_names=bool(named.names)),
        *limit_curve_range(extended, named.names),
        *limit_wall_ratio(extended, given.sessions, given.thresholds),
        *limit_nearest_law(found, given.thresholds),
        *limit_refusals(found, {one.effect.name for one in named.names} | {one.effect.name for one in named.zeros}),
    )


def _structure_where_fitted(given: Prepared, thinned: Sequence[Array], fine: Sequence[Array]) -> ResidualStructure:
    """The structure left in fitted samples: held-out data decides no name, and may hold other loads."""
    at_full_rate = _where_fitted(given.fine, fine)
    return residual_structure(*_where_fitted(given.sessions, thinned), given.thresholds, fine=at_full_rate)


def _where_fitted(sessions: Sequence[Session], residuals: Sequence[Array]) -> tuple[list[Session], list[Array]]:
    """The sessions of which only fitted samples are usable, and their residuals; without those of which none is."""
    learnt = [
        (replace(one, usable=one.fitted), left)
        for one, left in zip(sessions, residuals, strict=True)
        if one.fitted.any()
    ]
    return [one for one, _ in learnt], [left for _, left in learnt]


def _strongest_single_effects(found: Inference) -> tuple[Rival, ...]:
    """The few single effects that explain most, without flexible blocks, where no cause is named."""
    return tuple([Rival(name, fall, "alone") for name, fall in found.screening if name in catalogue()][:SAID])


def _material_zeros(found: Inference, given: Prepared, left: float, residual_sd: float) -> list[Zero]:
    """The material offsets and tares that are seen together with what was ``found``."""
    remembered = sum(one.size for one in found.members if isinstance(one.effect, CoreEffect))
    lasting_memory = math.hypot(*(one.size for one in found.members if one.effect.never_fades))
    zeros = zeros_of(
        given.sessions, found.fit.model, given.scale, left, remembered, given.thresholds, residual_sd, lasting_memory
    )
    return [one for one in zeros if one.size >= given.thresholds.material]


def _percent_less(after: float, before: float) -> float:
    """By how many percent a variance falls; 0 where it grows, NaN where nothing was judged."""
    if math.isnan(before):
        return before
    return 100.0 * max(0.0, 1.0 - after / before) if before > 0 else 0.0


def _with_offset(
    model: ExtendedModel, sessions: Sequence[Session], scale: Scale, undone: ExtendedModel | None = None
) -> ExtendedModel:
    """``model`` with the recordings' mean offset, so that it gives readings as logged for loads as logged.

    Also where an offset is named, since the model may be off at the rest that shows it. A tare that is named is in it
    as well: curves were fitted to the load as logged, so that a tare before them would move them. With ``undone``, the
    part of the model that is undone, the offset is that with this part only.
    """
    offset = mean_offset(sessions, undone or model) + scale.zero / scale.reading
    if offset == 0.0:
        return model
    return model.with_part(shift_of("reading"), np.array([offset / model.gain]))  # the gain is applied last


def _goodness(found: Errors, force_n: float, left: ResidualStructure, scale: Scale) -> GoodnessOfFit | None:
    """A model's goodness of fit in the reading's unit; None where nothing was judged."""
    if found.is_empty:
        return None
    span = abs(scale.reading)
    return GoodnessOfFit(
        found.rmse * span,
        scale.unit.symbol,
        found.fit_percent,
        force_n,
        left.rms * span if left.rms > 0.0 or left.is_tested else math.nan,
        found.variance_explained_percent,
    )


def _trace(session: Session, baseline: ExtendedModel, extended: ExtendedModel, scale: Scale) -> Trace:
    """A recording with both simulations, own terms included, in the reading's unit and N."""

    def told(shares: Array) -> Array:
        return np.asarray(scale.zero + shares * scale.reading)

    def simulated(model: ExtendedModel) -> Array:
        plain = model.simulate(session.conditions)
        return told(plain + own_terms_of(session, model, session.reading - plain)[1])

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
