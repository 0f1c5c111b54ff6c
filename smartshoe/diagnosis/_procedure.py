"""From sound recordings to a diagnosis: baseline, inference, what is left, what it is worth on held-out data."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from smartshoe.arrays import Array
from smartshoe.diagnosis._causes import cause_of, zero_cause_of
from smartshoe.diagnosis._force import (
    Compensation,
    as_calibrated,
    clipped_of,
    compensation,
    force_of,
    held_of,
    late_of,
    not_undone_of,
)
from smartshoe.diagnosis._held_out import Errors, Gain, errors, gain, own_of, residual_of
from smartshoe.diagnosis._inference import Inference, inferred
from smartshoe.diagnosis._lack_of_fit import repeating
from smartshoe.diagnosis._likelihood import Fit
from smartshoe.diagnosis._limits import (
    SAID,
    bent_to_the_end_of,
    elsewhere_of,
    end_of_range_of,
    nearest_of,
    own_gains_of,
    own_zeros_of,
    refusals_of,
    wall_ratio_of,
    worse_of,
    zero_changes_said,
)
from smartshoe.diagnosis._next_experiment import next_experiment
from smartshoe.diagnosis._noise_kinds import noise_kinds
from smartshoe.diagnosis._parameters import joint_parameters
from smartshoe.diagnosis._prepared import Prepared, prepared
from smartshoe.diagnosis._ranges import beyond
from smartshoe.diagnosis._residual_structure import ResidualStructure, beyond_noise, residual_structure
from smartshoe.diagnosis._result import Cause, Diagnosis, GoodnessOfFit, Rival, Trace, Verdict
from smartshoe.diagnosis._scale import Scale
from smartshoe.diagnosis._session import Session, fitted_of
from smartshoe.diagnosis._settling import Progress
from smartshoe.diagnosis._validation import fitted_rms
from smartshoe.diagnosis._verdict import (
    known_error,
    left_where_judged,
    names_in,
    not_explained_of,
    not_shown_to_be_noise,
    off_elsewhere,
    sentence_of,
    unexplained_of,
    verdict_of,
)
from smartshoe.diagnosis._withheld import Chosen, causes_among
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
    """What ``recordings`` say of their simulation; the first ``count`` are fitted, the others judge."""
    given = prepared(recordings, count, integrity, thresholds)
    sessions, fine, scale = given.sessions, given.fine, given.scale
    found = inferred(given.start, sessions, thresholds, progress, not given.is_no_unit)
    progress("judging on held-out data")
    left = _left_by(found, given, integrity.faults)
    named = _named(found, given, left)
    held = _held(found.fit.model, named, sessions)
    if held is not found.fit.model:  # what was fitted, and by what the names go, is as it was
        found = replace(found, fit=replace(found.fit, model=held))
        after, _, off_after = _left_of(held, given)
        left = replace(left, after=after, off_after=off_after)
    plain = replace(found.baseline.model, noise=fitted_rms(fine, left.off_before))
    extended = replace(found.fit.model, noise=fitted_rms(fine, left.off_after))
    baseline, best = errors(fine, plain), errors(fine, extended)
    causes = [cause_of(name, found, fine, best, scale, given.excitation, thresholds) for name in named.names]
    is_told = found.zero_changes or found.own_gains or given.is_no_unit
    apart = None if is_told else own_zeros(sessions, found.fit.model, thresholds)
    causes += [zero_cause_of(zero, best, scale, thresholds, apart is None) for zero in named.zeros]
    causes.sort(key=lambda one: -one.size)
    won = gain(baseline, best, scale, thresholds)
    outcome = _outcome(found, given, left, named, causes, won)
    adopted = _Adopted(found.fit, extended, best, left.after)
    if won.is_rejected:  # all that what is held out decides: no extension is adopted that is worse there
        adopted = _Adopted(found.baseline, plain, baseline, left.before)
    verdict, rest = outcome.verdict, unexplained_of(causes, left.before, adopted.left)
    of_held_out = left_where_judged(fine, left.off_after, thresholds)
    # No more is noise than is no structure, and than what was fitted holds beside its own: what a model does not
    # foresee elsewhere is none for that. What is white there is noise in any case.
    structure = of_held_out if outcome.unproven else min(max(left.after.rms, outcome.elsewhere), of_held_out)
    no_more = min(best.rmse**2 - structure**2, extended.noise**2 - left.within.rms**2)
    noise_variance = max(best.rmse**2 - of_held_out**2, no_more, 0.0)
    explained = verdict in ("adequate", "explained")
    noise = noise_kinds(
        fine, extended, integrity.faults, explained or left.after.is_noise, thresholds.material, left.within.memory
    )
    parts = {cause.name for cause in causes} | {name.member.name for name in named.names}
    minor = tuple(part.name for part in extended.parts if part.name not in parts)
    parameters, covariance = joint_parameters(adopted.fit, scale)
    force = compensation(fine, adopted.model, plain, thresholds)
    # What no compensator takes off, be it the room's warmth, is its zero's, on the mean of the recordings.
    zeros_apart = abs(force.zero - mean_offset(force.fine, force.model))
    has_own = bool(force.passed_over) or zeros_apart >= thresholds.material
    of_force = _limits_of_the_force(found, given, named, extended, force, outcome, left, apart)
    says = sentence_of(
        verdict,
        names_in(causes, len(minor)),
        baseline,
        best,
        not_explained_of(rest, 0.0 if won.is_rejected else outcome.elsewhere, outcome.unproven, thresholds),
        thresholds,
        worse=won.is_loss,
        withheld=_is_silent(found, given)
        or bool(named.limits or found.zero_changes or found.own_gains or found.nearest),
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
        baseline=_goodness(baseline, force.before.held_out_n, left.before, scale),
        extended=_goodness(adopted.errors, force.error.held_out_n, adopted.left, scale),
        gain=None if best.is_empty else won,
        explainable_percent=_percent_less(noise_variance, baseline.rmse**2),
        explained_percent=_percent_less(adopted.errors.rmse**2, baseline.rmse**2),
        rivals=causes[0].rivals if causes else _nearest(found),
        next_experiment=next_experiment(
            found, causes, sessions, given.excitation, open_=not explained, worse=won.is_loss
        ),
        limits=(*given.limits, *of_force, *_limits_of_the_names(found, given, named, extended)),
        limits_of_the_force=of_force,
        clipped=force.clipped,
        leftover=rest.says if verdict in ("unexplained", "partly_explained") else None,
        screening=found.screening,
        likeness=found.likeness,
        model=_with_offset(adopted.model, named.zeros, sessions, scale),
        rejected=extended if won.is_rejected else None,
        baseline_model=plain,
        force_model=_with_offset(force.model, named.zeros, force.fine, scale, force.undone) if has_own else None,
        parameters=parameters,
        covariance=covariance,
        traces=tuple(_trace(session, plain, extended, scale) for session in fine),
        thresholds=thresholds,
    )


@dataclass(frozen=True, eq=False)
class _Adopted:
    """The ``model`` that is offered, as it was ``fit``; its held-out ``errors``, and what it has ``left``."""

    fit: Fit
    model: ExtendedModel
    errors: Errors
    left: ResidualStructure


@dataclass(frozen=True, eq=False)
class _LeftOver:
    """What the plain model leaves ``before`` effects and the extended one ``after``; ``within`` what was fitted.

    ``known``: rms that faults of the data add to it, a share of full scale. ``off_before`` and ``off_after``: residuals
    (n,) of each recording at the full rate, since thinning makes noise of neighbours alike.
    """

    before: ResidualStructure
    after: ResidualStructure
    within: ResidualStructure
    known: float
    off_before: Sequence[Array]
    off_after: Sequence[Array]


def _left_by(found: Inference, given: Prepared, faults: Sequence[DataFault]) -> _LeftOver:
    sessions = given.sessions
    before, _, off_before = _left_of(found.baseline.model, given)
    after, residuals, off_after = _left_of(found.fit.model, given)
    within = _left_of_what_was_fitted(sessions, residuals, given.thresholds)
    return _LeftOver(before, after, within, known_error(faults, sessions, given.scale), off_before, off_after)


def _left_of(model: ExtendedModel, given: Prepared) -> tuple[ResidualStructure, list[Array], list[Array]]:
    """What a model leaves: the structure in it, residuals (n,) of each recording, and these at the full rate."""
    residuals, off = ([residual_of(one, model) for one in some] for some in (given.sessions, given.fine))
    quick = repeating(given.fine, off, given.thresholds)
    return residual_structure(given.sessions, residuals, given.thresholds, quick), residuals, off


def _is_silent(found: Inference, given: Prepared) -> bool:
    """Whether nothing may be named, whatever fits."""
    return given.is_no_unit or not found.can_validate


def _named(found: Inference, given: Prepared, left: _LeftOver) -> Chosen:
    """The causes in what was ``found``."""
    most = max(left.within.rms, left.within.size)
    wanders = left.within.wanders(given.thresholds.hold_s)
    zeros = [] if _is_silent(found, given) else _zeros(found, given, most, wanders)
    return causes_among(found, given, zeros, most)


def _held(model: ExtendedModel, named: Chosen, sessions: Sequence[Session]) -> ExtendedModel:
    """``model`` with drifts that are no ``named`` law held from the end of what was fitted on: beyond it nothing tells.

    A free form is none either, whatever its kind is named.
    """
    fitted = ((one.conditions, one.conditions.time_s[one.fitted]) for one in fitted_of(sessions))
    ends_s = max(at.before.get("time_s", 0.0) + float(time_s[-1]) for at, time_s in fitted)
    return model.held_after(ends_s, {name.effect.name for name in named.names})


@dataclass(frozen=True, slots=True)
class _Outcome:
    """The verdict, by what was ``won``, what is ``elsewhere`` (`off_elsewhere`) and ``unproven``.

    ``unproven`` is that of `not_shown_to_be_noise`.
    """

    verdict: Verdict
    won: Gain
    elsewhere: float
    unproven: float


def _outcome(
    found: Inference,
    given: Prepared,
    left: _LeftOver,
    named: Chosen,
    causes: Sequence[Cause],
    won: Gain,
) -> _Outcome:
    """The verdict, by what is ``left``, and ``won`` on what is held out."""
    fine, off, known, thresholds = given.fine, left.off_after, left.known, given.thresholds
    within = max(left.within.size, beyond_noise(fine, off, thresholds), known)
    elsewhere = off_elsewhere(fine, off, within, thresholds)
    unproven = 0.0
    if not (found.can_validate and left.after.is_tested):
        # Beside causes what is left is weighed against what was wrong, tested or not.
        before = left.off_before if found.can_validate and causes else None
        unproven = not_shown_to_be_noise(fine, off, left.after, thresholds, known, before)
    if given.is_no_unit:  # what follows something else than the load is simulated by no unit, however well it fits
        return _Outcome("unexplained", won, elsewhere, unproven)
    # An unsure companion of one that is sure does not say that laws are none.
    follows = any(name.is_sure for name in named.names) and not any(name.kind_only for name in named.names)
    # What the model follows is there, even if it is of no kind with a name, or too little is left to be tested.
    least = max(thresholds.tolerable, thresholds.material, known)
    gained = 0.0 if causes else won.certain_fall(given.scale)
    besides = max(elsewhere, unproven, *(one for one in (named.nameless, gained) if one > least))
    worse = won.is_loss or won.growth(given.scale) > thresholds.tolerable
    verdict = verdict_of(causes, left.before, left.after, thresholds, follows, known, worse=worse, elsewhere=besides)
    return _Outcome(verdict, won, elsewhere, unproven)


def _limits_of_the_force(
    found: Inference,
    given: Prepared,
    named: Chosen,
    extended: ExtendedModel,
    force: Compensation,
    outcome: _Outcome,
    left: _LeftOver,
    apart: OwnZeros | None,
) -> tuple[str, ...]:
    """What limits the force that a calibration gives: loads beyond those fitted, what is not undone, zeros, gains."""
    won, elsewhere, thresholds = outcome.won, outcome.elsewhere, given.thresholds
    ways = beyond(given.sessions, given.scale, thresholds) if won.is_rejected or elsewhere else None
    undone = extended if force.is_plain else force.model
    return (
        *([worse_of(won, ways)] if won.is_rejected else []),
        *([elsewhere_of(elsewhere, left.within.size, ways)] if elsewhere and not won.is_rejected else []),
        *force_of(force),
        *clipped_of(force),
        *late_of(force),
        *([] if won.is_rejected else not_undone_of(undone, given.fine[0].conditions.step_s)),
        *([] if force.is_plain else held_of(force, thresholds)),
        *named.of_zeros,
        *own_gains_of(found.own_gains),
        *own_zeros_of(apart, given.scale),
        *as_calibrated(force, thresholds),
        *zero_changes_said(found.zero_changes),
    )


def _limits_of_the_names(found: Inference, given: Prepared, named: Chosen, extended: ExtendedModel) -> tuple[str, ...]:
    """What limits the names: causes that are none, models at their ends, what was refused."""
    of_model = (
        end_of_range_of(extended, given.sessions, given.thresholds),
        bent_to_the_end_of(extended, named.names),
        wall_ratio_of(extended, given.sessions, given.thresholds),
    )
    near = nearest_of(found, given.thresholds)
    return (*named.limits, *(said for said in of_model if said is not None), *near, *refusals_of(found))


def _left_of_what_was_fitted(
    sessions: Sequence[Session], residuals: Sequence[Array], thresholds: Thresholds
) -> ResidualStructure:
    """What is left where a model was fitted: what is held out decides over no name, and may be of other loads."""
    learnt = [(replace(one, usable=one.fitted), left) for one, left in zip(sessions, residuals, strict=True)]
    learnt = [(one, left) for one, left in learnt if one.usable.any()]
    return residual_structure([one for one, _ in learnt], [left for _, left in learnt], thresholds)


def _nearest(found: Inference) -> tuple[Rival, ...]:
    """The few effects that take most off by themselves; flexible blocks are none."""
    return tuple([Rival(name, fall, "alone") for name, fall in found.screening if name in catalogue()][:SAID])


def _zeros(found: Inference, given: Prepared, left: float, wanders: float) -> list[Zero]:
    """The offsets and tares that are seen beside what was ``found``, and are material."""
    remembered = sum(one.size for one in found.members if isinstance(one.effect, CoreEffect))
    rubbed = math.hypot(*(one.size for one in found.members if one.effect.never_fades))
    zeros = zeros_of(given.sessions, found.fit.model, given.scale, left, remembered, given.thresholds, wanders, rubbed)
    return [one for one in zeros if one.size >= given.thresholds.material]


def _percent_less(after: float, before: float) -> float:
    """By how many percent a variance falls, 0 where it grows, NaN where nothing was judged."""
    if math.isnan(before):
        return before
    return 100.0 * max(0.0, 1.0 - after / before) if before > 0 else 0.0


def _with_offset(
    model: ExtendedModel,
    zeros: Sequence[Zero],
    sessions: Sequence[Session],
    scale: Scale,
    undone: ExtendedModel | None = None,
) -> ExtendedModel:
    """``model`` with the recordings' mean offset, so that it gives readings as they are logged.

    Also where one is named: at the rest that shows it the ``model`` may be off by some of what it misses elsewhere.
    Where it is to be ``undone`` in part, the offset beside that part.
    """
    tares = [(zero.effect, np.array([zero.value])) for zero in zeros if zero.effect.shifts == "load"]
    of = undone or model
    for tare in tares:
        model, of = model.with_part(*tare), of.with_part(*tare)
    offset = mean_offset(sessions, of) + scale.zero / scale.reading
    if offset == 0.0:
        return model
    return model.with_part(shift_of("reading"), np.array([offset / model.gain]))  # the chain's end multiplies it


def _goodness(found: Errors, force_n: float, left: ResidualStructure, scale: Scale) -> GoodnessOfFit | None:
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
