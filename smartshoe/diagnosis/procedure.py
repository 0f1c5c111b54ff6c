"""From recordings to a diagnosis: integrity, baseline, selection, what is left, what it is worth."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from smartshoe.blas import on_one_thread
from smartshoe.diagnosis.aligned import common_delay_s, common_drift, drift_rates, on_one_clock, put_right
from smartshoe.diagnosis.baseline import Timing, shared_timing, start_of
from smartshoe.diagnosis.confidence import SEPARATED, confidence, inseparable
from smartshoe.diagnosis.course import course_of
from smartshoe.diagnosis.decay import decay_of
from smartshoe.diagnosis.force import force_rmse_n
from smartshoe.diagnosis.integrity import Integrity, examine
from smartshoe.diagnosis.judgement import Errors, errors, gain
from smartshoe.diagnosis.leftover import Leftover, leftover_of
from smartshoe.diagnosis.margins import penalty
from smartshoe.diagnosis.naming import MATERIAL
from smartshoe.diagnosis.next_experiment import next_experiment
from smartshoe.diagnosis.noise_kinds import noise_kinds
from smartshoe.diagnosis.parameters import joint_parameters, parameters_of
from smartshoe.diagnosis.ranges import ranges_of
from smartshoe.diagnosis.result import Cause, Diagnosis, Rival, Standing, Statement, Trace, Verdict
from smartshoe.diagnosis.selection import Choice, Progress, choose
from smartshoe.diagnosis.session import REST_SHARE, Scale, Session, at_full_rate, full_scale, prepare, thinning
from smartshoe.diagnosis.traits import Traits, traits_of
from smartshoe.errors import UsageError
from smartshoe.models.effects import effect
from smartshoe.models.extended import ExtendedModel
from smartshoe.recording import Recording

Array = NDArray[np.float64]

REST_SD = 3e-4  # of full scale: how well an unloaded machine is trusted to read zero
COMMANDED_REST_SD = 1.2e-4  # the same where the machine was told to be at zero
PLAIN_GAIN_PERCENT = 5.0  # a gain that needs no interval to be seen
BOTH_WAYS = 0.25  # of the larger: a load that runs as far to the other side is no pressing
FIT_PERCENT_NEEDED = ((15.0, 35.0, 45.0), (97.0, 88.0, 70.0))  # of the best model, by the baseline's own fit
NAMED_OVER_LEFT = 3.0  # times what is left over: what a cause must move the reading by to keep its name
LEFT_OF_EXPLAINED = 0.12  # of the structure that was there: less than this left over is a matter of equations' shape


def _silent(_: str) -> None:
    return None


def diagnose(
    recordings: Sequence[Recording] | Recording,
    hold_out: Sequence[Recording] = (),
    *,
    material: float = MATERIAL,
    progress: Progress = _silent,
) -> Diagnosis:
    """What the baseline simulation of ``recordings`` gets wrong, why, and what mending it gains.

    Each recording is a session of its own: the unit rested and zeroed before, unless its metadata ``continues`` names
    another. ``hold_out`` recordings are judged on and never fitted; without them every third load cycle is kept for
    that. ``material`` is the share of the full-scale reading below which nothing counts.

    Raises `MissingChannelError` without a load or reading; a diagnosis that the data cannot support comes back with
    the verdict "refused" and the reason in ``limits``.
    """
    fitted = [recordings] if isinstance(recordings, Recording) else list(recordings)
    if not fitted:
        raise UsageError("diagnose was given no recording: give one at least")
    everything = [*fitted, *hold_out]
    integrity = examine(everything)
    refusals = integrity.refusals or _outside(everything)
    if refusals:
        return _refused(everything, integrity, refusals)
    return _diagnosed(everything, len(fitted), integrity, material, progress)


def _outside(recordings: Sequence[Recording]) -> tuple[str, ...]:
    """Why the recordings are none of a unit that is pressed."""
    for recording in recordings:
        low, high = (float(value) for value in np.percentile(recording.force_n, [1, 99]))
        if min(abs(low), abs(high)) > BOTH_WAYS * max(abs(low), abs(high)) and low < 0 < high:
            return (
                f"{recording.label}: the load runs from {low:.4g} to {high:.4g} N: the catalogue is of a unit that is"
                " pressed, which bears compression only (turn the sign of the load, or take its mean out, if that is"
                " what was meant)",
            )
    return ()


def _refused(recordings: Sequence[Recording], integrity: Integrity, refusals: Sequence[str]) -> Diagnosis:
    sensors = recordings[0].sensors
    unit = sensors[0].unit.symbol if sensors else ""
    return Diagnosis(
        "refused",
        f"no diagnosis: {refusals[0]}",
        unit,
        0.0,
        0.0,
        data_faults=integrity.faults,
        limits=(*refusals, *(said for said in map(_seen, recordings) if said is not None)),
    )


def _courses(recordings: Sequence[Recording]) -> list[str]:
    return [f"{one.label}: {said}" for one in recordings if (said := course_of(one)) is not None]


def _seen(recording: Recording) -> str | None:
    """What can be told of a recording without a model."""
    decay = decay_of(recording)
    return decay.says if decay is not None else course_of(recording)


@on_one_thread
def _diagnosed(
    recordings: Sequence[Recording], count: int, integrity: Integrity, material: float, progress: Progress
) -> Diagnosis:
    drift = common_drift(integrity, recordings)
    delay_s = 0.0 if drift else common_delay_s(integrity)
    known: Timing | None = ("clock_drift", (drift,)) if drift else ("delay", (delay_s,)) if delay_s else None
    given = recordings
    recordings, usable, put = put_right(given, integrity)
    scale = full_scale(recordings[:count], usable[:count])
    held = None if count == len(recordings) else [index >= count for index in range(len(recordings))]
    sessions = prepare(recordings, usable, held, scale, thinning(recordings, scale))
    moved = known is None and (any(integrity.clock_offset_s) or any(integrity.clock_rate))
    if moved:
        as_given, usable_as_given, put_as_given = put_right(given, on_one_clock(integrity))
        unmoved = prepare(as_given, usable_as_given, held, scale, thinning(as_given, scale))
        known = shared_timing(unmoved, sessions, scale, drift_rates(integrity, given))
        if known is not None:
            recordings, usable, put, sessions, moved = as_given, usable_as_given, put_as_given, unmoved, False
        if known is not None and known[0] == "sensor_lag":  # of a sensor or a wall: left to the search for effects
            integrity, known = on_one_clock(integrity), None
    traits, ranges = traits_of(sessions), ranges_of(sessions, scale)
    start = start_of(sessions, scale, known)
    kept = frozenset(start.names if known else ())
    choice = choose(start, sessions, rest_loads(sessions), kept, material, progress)
    before = leftover_of(sessions, choice.evidence.residuals(choice.baseline.model))
    after = leftover_of(sessions, choice.evidence.residuals(choice.fit.model))
    progress("judging on held-out data")
    fine = at_full_rate(sessions, usable, scale)
    baseline, best = errors(fine, choice.baseline.model), errors(fine, choice.fit.model)
    causes = [_cause(name, choice, fine, best, scale, traits) for name in choice.causes]
    # What is left of a delay after the clocks were put right is an error of the putting right.
    causes = [one for one in causes if _stands(one) and not (moved and one.effect.family == "timing")]
    causes, verdict = _judged(causes, before, after, material)
    # The less the baseline follows, the better must be what follows.
    needed = np.interp(baseline.fit_percent, *FIT_PERCENT_NEEDED)
    # Strong noise keeps every model from a good fit, and speaks against none.
    follows = best.fit_percent >= needed or after.is_noise
    if not follows or (ranges.is_trap and causes):
        causes, verdict = [], "unexplained"
    # What the best model leaves is noise but for the structure in it.
    noise_variance = max(best.rmse**2 - after.rms**2, 0.0)
    # Without a name nothing is added: the baseline stays.
    fitted, left, extended_errors = choice.fit, after, best
    if verdict == "unexplained":
        fitted, left, extended_errors = choice.baseline, before, baseline
    extended = fitted.model
    wrong = float(np.sqrt(max(baseline.rmse**2 - noise_variance, 0.0)))
    # Structure that no effect explains would be taken for coloured noise.
    explained = verdict in ("adequate", "explained") or after.is_noise
    noise = noise_kinds(fine, extended, integrity.faults, explained, material)
    named = [cause.name for cause in causes]
    parameters, covariance = joint_parameters(fitted, scale)
    return Diagnosis(
        verdict,
        _sentence(verdict, causes, wrong, left.rms),
        scale.unit.symbol,
        scale.load_n,
        scale.reading,
        causes=tuple(causes),
        minor=tuple(name for name in extended.names if name not in named),
        data_faults=(*integrity.faults, *noise),
        baseline=_standing(baseline, choice.baseline.model, before, fine, scale),
        extended=_standing(extended_errors, extended, left, fine, scale),
        gain=gain(baseline, extended_errors, scale),
        explainable_percent=_percent_less(noise_variance, baseline.rmse**2),
        explained_percent=_percent_less(extended_errors.rmse**2, baseline.rmse**2),
        rivals=causes[0].rivals if causes else _candidates(choice),
        next_experiment=next_experiment(choice, causes, sessions),
        limits=(
            *put,
            *ranges.says,
            *traits.limits(),
            *([] if follows else [_does_not_follow(baseline, best), *_courses(recordings)]),
        ),
        leftover=left.says if verdict in ("unexplained", "partly_explained") else None,
        screening=tuple((one.candidate.effect.name, float(one.fall)) for one in choice.screening.ranked),
        likeness=choice.screening.likeness,
        model=extended,
        baseline_model=choice.baseline.model,
        parameters=parameters,
        covariance=covariance,
        traces=tuple(_trace(session, choice.baseline.model, extended, scale) for session in fine),
    )


def rest_loads(sessions: Sequence[Session]) -> tuple[Array, float]:
    """Mean measured load of each session's rests, shares of full scale, and how well it should be zero."""
    means = []
    commanded = all(session.recording.command_n is not None for session in sessions)
    for session in sessions:
        command, load = session.recording.command_n, session.conditions.load
        resting = session.resting & ~session.held_out
        if command is not None:
            # Told by the command alone: a large tare lifts the load out of what looks like a rest.
            full = float(np.max(np.abs(command))) or 1.0
            nothing = np.abs(command[:: session.thinned][: resting.size]) < 1e-3 * full
            resting = nothing & (np.abs(load - np.quantile(load, 0.02)) < REST_SHARE) & ~session.held_out
        if resting.sum() > 10:
            means.append(float(np.mean(load[resting])))
    return np.array(means), COMMANDED_REST_SD if commanded else REST_SD


def _stands(cause: Cause) -> bool:
    """Whether a cause gains on data it has not seen, and its strength is told from nothing."""
    won = cause.held_out
    if won.gain_percent <= 0 or (won.ci95[0] <= 0 and won.gain_percent < PLAIN_GAIN_PERCENT):
        return False
    strengths = [p for p in cause.effect.parameters if p.null is not None]
    intervals = [cause.parameters[p.name].ci95 for p in strengths]
    nulls = [p.null or 0.0 for p in strengths]
    return any(not low <= null <= high for null, (low, high) in zip(nulls, intervals, strict=True))


def _does_not_follow(baseline: Errors, best: Errors) -> str:
    return (
        f"the model of a pressed unit follows this reading by {max(baseline.fit_percent, 0.0):.0f} % only, and by"
        f" {max(best.fit_percent, 0.0):.0f} % at best: it is of another kind, or its columns are mistaken, and no cause"
        " can be named by it"
    )


def _percent_less(after: float, before: float) -> float:
    """By how many percent a variance falls, 0 where it grows."""
    return 100.0 * max(0.0, 1.0 - after / before) if before > 0 else 0.0


def _judged(causes: list[Cause], before: Leftover, after: Leftover, material: float) -> tuple[list[Cause], Verdict]:
    """The causes that keep their names, and the verdict.

    A name that explains little more than what is left over is withdrawn: the truth may be another thing altogether.
    """
    left = after.rms if after.significant and after.rms > material else 0.0
    if left <= LEFT_OF_EXPLAINED * before.rms:
        left = 0.0
    kept = [cause for cause in causes if cause.size >= NAMED_OVER_LEFT * left]
    if kept:
        return kept, "partly_explained" if left else "explained"
    if left or (before.significant and before.rms > material):
        return [], "unexplained"
    return [], "adequate"


def _sentence(verdict: Verdict, causes: Sequence[Cause], wrong: float, left: float) -> str:
    names = [cause.name.replace("_", " ") for cause in causes]
    named = " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)
    verb = "account" if len(names) > 1 else "accounts"
    wrong_by = f"the baseline simulation is wrong by {100 * wrong:.2g} % of full scale"
    if verdict == "adequate":
        return "the baseline simulation leaves nothing that repeats and matters"
    if verdict == "explained":
        return f"{wrong_by}: {named} {verb} for it"
    if verdict == "partly_explained":
        return f"{wrong_by}: {named} {verb} for part of it, and {100 * left:.2g} % of full scale is still unexplained"
    return f"{wrong_by}, and no effect of the catalogue accounts for it"


def _candidates(choice: Choice) -> tuple[Rival, ...]:
    ranked = choice.screening.ranked[:4]
    return tuple(Rival(one.candidate.effect.name, float(ranked[0].fall - one.fall)) for one in ranked)


def _cause(name: str, choice: Choice, fine: Sequence[Session], best: Errors, scale: Scale, traits: Traits) -> Cause:
    less = choice.without[name]
    won = gain(errors(fine, less.model), best, scale)
    rivals = tuple(Rival(one.effect, one.margin) for one in choice.rivals[name])
    one = effect(name)
    fall, size = choice.fall(name), choice.sizes[name]
    evidence = [
        Statement(
            "fall of -2 log likelihood",
            fall,
            penalty(name),
            f"without it, and all else fitted anew, the fit is worse by {fall:,.0f} where {penalty(name):.0f} would do",
        ),
        Statement(
            "size in percent of full scale",
            100 * size,
            100 * MATERIAL,
            f"it moves the reading by {100 * size:.3g} % of full scale (rms)",
        ),
        Statement(
            "gain on held-out data in percent",
            won.gain_percent,
            0.0,
            f"on data not fitted the error falls from {won.rmse_before:.4g} to {won.rmse_after:.4g} {won.unit}",
        ),
    ]
    if rivals:
        nearest = rivals[0]
        evidence.append(
            Statement(
                "margin to the nearest rival",
                nearest.margin,
                SEPARATED,
                f"{nearest.effect.replace('_', ' ')} in its place is worse by {nearest.margin:,.0f}",
            )
        )
    lacking = one.exposed_by - traits.present
    if lacking:
        evidence.append(
            Statement(
                "what would show it best is missing",
                float(len(lacking)),
                0.0,
                f"the data holds no {', no '.join(sorted(word.replace('_', ' ') for word in lacking))}",
            )
        )
    return Cause(
        one,
        confidence(rivals, fall),
        inseparable(rivals),
        parameters_of(choice.fit, name, scale),
        tuple(evidence),
        won,
        size,
        rivals,
    )


def _standing(found: Errors, model: ExtendedModel, left: Leftover, fine: Sequence[Session], scale: Scale) -> Standing:
    return Standing(
        found.rmse * scale.reading,
        scale.unit.symbol,
        found.fit_percent,
        force_rmse_n(fine, model),
        left.rms * scale.reading,
    )


def _trace(session: Session, baseline: ExtendedModel, extended: ExtendedModel, scale: Scale) -> Trace:
    return Trace(
        session.recording.name,
        session.conditions.time_s + session.recording.time_s[0],
        session.conditions.load * scale.load_n,
        session.reading * scale.reading,
        baseline.simulate(session.conditions) * scale.reading,
        extended.simulate(session.conditions) * scale.reading,
        session.usable,
        session.held_out,
        session.cycle,
    )
