"""The force that a model's inverse gives, and which effects of a unit's model are undone for it."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from smartshoe.arrays import Array, Mask
from smartshoe.calibration import ExtendedCompensator
from smartshoe.diagnosis._own_terms import own_terms_of
from smartshoe.diagnosis._scale import Scale, reading_in
from smartshoe.diagnosis._session import Session, fitted_of
from smartshoe.diagnosis._validation import rms_of
from smartshoe.diagnosis._zero import mean_offset
from smartshoe.display import percent, rounded
from smartshoe.integrity.thresholds import Thresholds
from smartshoe.models.effects import in_words, listed
from smartshoe.models.extended import ExtendedModel


@dataclass(frozen=True, slots=True)
class ForceError:
    """Root mean square errors in N of the compensated force against the load; NaN without samples."""

    fitted_n: float
    held_out_n: float


def force_error(fine: Sequence[Session], model: ExtendedModel) -> ForceError:
    """The errors of ``model`` inverted, over fitted and over held-out samples."""
    off = [_force_error_n(one, model) for one in fine]
    return ForceError(_rms(off, [one.fitted for one in fine]), _rms(off, [one.judged for one in fine]))


@dataclass(frozen=True, eq=False)
class Compensation:
    """The ``model`` that a calibration inverts, and its errors.

    ``model`` is the extended one without the effects ``passed_over``, whose inversion does more harm than good, or the
    plain one (``is_plain``); ``filter`` inverts it at the recordings' rate. ``error`` is its error, ``before`` that of
    the plain model, ``whole`` that of the extended one with all effects. ``rejected`` is the error of a model that was
    not taken since it is worse on held-out data. All are over the recordings ``fine``, which lack the share ``clipped``
    of their samples.
    """

    fine: Sequence[Session]
    model: ExtendedModel
    error: ForceError
    before: ForceError
    whole: ForceError
    filter: ExtendedCompensator
    passed_over: tuple[str, ...] = ()
    is_plain: bool = False
    rejected: ForceError | None = None
    clipped: float = 0.0

    @cached_property
    def undone(self) -> ExtendedModel:
        """The part of ``model`` that a filter of readings inverts, and what clips: beside these a zero is taken."""
        return _beside_zero(self.model, self.filter)

    @cached_property
    def zero(self) -> float:
        """The recordings' mean offset with only that part simulated, a share of full scale."""
        return mean_offset(self.fine, self.undone)


def compensation(
    fine: Sequence[Session], extended: ExtendedModel, plain: ExtendedModel, thresholds: Thresholds
) -> Compensation:
    """The model whose inverse gives the load of fitted data best.

    Inverting a lag, a rate-dependent gain or a flat curve amplifies ``noise`` and every other residual. Where that
    happens, effects are dropped one by one while the force improves clearly. The plain model is taken where its force
    is better all the same, there or on held-out data. Clipped samples do not count, since they give no force.
    """
    count = sum(int(one.usable.sum()) for one in fine)
    fine = [_without_clipped(one, extended, thresholds) for one in fine]
    clipped = 1.0 - sum(int(one.usable.sum()) for one in fine) / max(count, 1)
    before, whole = force_error(fine, plain), force_error(fine, extended)

    def by_plain(rejected: ForceError | None = None) -> Compensation:
        return Compensation(
            fine,
            plain,
            before,
            before,
            whole,
            _compensator(plain, fine[0]),
            passed_over=extended.names,
            is_plain=True,
            rejected=rejected,
            clipped=clipped,
        )

    fitted, alike = fitted_of(fine), 1.0 + thresholds.same
    model, least = extended, whole.fitted_n
    noise_force_n = extended.noise / extended.gain * extended.full_scale_load_n
    while model.parts and least > alike * noise_force_n:
        others = [model.without(name) for name in model.names]
        off_n = [force_error(fitted, other).fitted_n for other in others]
        best = min(range(len(off_n)), key=off_n.__getitem__)
        if not alike * off_n[best] < least:
            break
        model, least = others[best], off_n[best]
    is_nearer = bool(model.parts) and least <= (1.0 + thresholds.standing) * before.fitted_n
    if extended.parts and not is_nearer:
        return by_plain()
    error = whole if model is extended else force_error(fine, model)
    if error.held_out_n > (1.0 + thresholds.standing) * before.held_out_n:
        return by_plain(error)
    passed_over = tuple(name for name in extended.names if name not in model.names)
    return Compensation(fine, model, error, before, whole, _compensator(model, fine[0]), passed_over, clipped=clipped)


def _without_clipped(session: Session, model: ExtendedModel, thresholds: Thresholds) -> Session:
    """``session`` without samples that ``model`` clips, since their reading tells no load.

    There it moves the reading by more than is tolerable, and more than half of the slope is lost. What is moved where
    most of the slope is left is a bend: it tells a load, and its error counts.
    """
    usable = session.usable
    whole, entering = model.trace(session.conditions)
    for part, signal in zip(model.chain, entering, strict=False):  # the last is what leaves the chain
        if part is not None and part.effect.clips:
            moved = np.abs(whole - model.without(part.name).simulate(session.conditions)) >= thresholds.tolerable
            is_flat = thresholds.clear * part.effect.slope_left(signal, part.values) < 1.0
            usable = usable & ~(moved & is_flat)
    return replace(session, usable=usable)


def limit_clipped(found: Compensation) -> list[str]:
    """The sentence on clipped samples, for which no force is judged."""
    if not found.clipped:
        return []
    return [
        f"errors of the force leave out {percent(found.clipped)} of the samples: there the extended model clips, which"
        " takes more than half of its slope; such a reading tells no load"
    ]


def limit_force(found: Compensation) -> list[str]:
    """The sentence on an extended model that gives a worse force than the plain one, or than a part of itself."""
    if found.rejected is not None:
        return [
            "on held-out data the force by the extended model is worse than by the baseline (error"
            f" {found.rejected.held_out_n:.3g} N instead of {found.before.held_out_n:.3g} N): the calibration corrects"
            " by the baseline; its twin simulates with the effects"
        ]
    if found.is_plain:
        return [
            "the extended model fits the reading but gives a worse force (error on the fitted data"
            f" {found.whole.fitted_n:.3g} N instead of {found.before.fitted_n:.3g} N by the baseline): the calibration"
            " corrects by the baseline; its twin simulates with the effects"
        ]
    if found.passed_over:
        return [
            f"the calibration does not correct {listed(found.passed_over)}: that would amplify noise and other errors"
            f" by more than it removes (error of the force on the fitted data: {found.error.fitted_n:.3g} N without"
            f" this correction, {found.whole.fitted_n:.3g} N with it, {found.before.fitted_n:.3g} N by the baseline);"
            " its twin simulates with all effects"
        ]
    return []


def limit_not_undone(model: ExtendedModel, step_s: float) -> list[str]:
    """Sentences on effects that no compensator can remove from a stream of readings."""
    passed_over = ExtendedCompensator(model, 1.0 / step_s).not_inverted
    return [
        f"no compensator can correct the {in_words(name)} in the extended model: {why}"
        for name, why in passed_over.items()
    ]


def limit_latency_left(found: Compensation) -> list[str]:
    """Sentences on latencies that are undone in part only, to limit the noise."""
    return [
        f"the calibration leaves {1e3 * left_s:.3g} ms of the {in_words(name)}: correcting all of it would amplify fast"
        " noise too much; under loads faster than those judged here, the force is late by as much"
        for name, left_s in found.filter.lags_left_s.items()
    ]


def limit_drift_held(found: Compensation, thresholds: Thresholds) -> list[str]:
    """The sentence on drifts that a calibration holds at their value at the end of the fitted data."""
    if found.is_plain:
        return []
    moved = found.filter.moved_by_the_clock
    held = [part for part in found.model.parts if math.isfinite(part.until_s)]
    held = [part for part in held if abs(moved.get(part.name, 0.0)) > thresholds.standing]
    if not held:
        return []
    said = ", ".join(f"{in_words(part.name)} by {percent(moved[part.name], signed=True)}" for part in held)
    return [
        "the calibration corrects a drift that has no named law, by the clock and up to the end of the fitted data at"
        f" {held[0].until_s:.4g} s: there it moves a full-scale force ({said}); after that the correction stays"
        " constant, since nothing shows how the drift goes on; reset it where a session begins, and fit a recording as"
        " long as the sessions are to be"
    ]


def limit_calibration_off(found: Compensation, thresholds: Thresholds) -> list[str]:
    """The sentence where a calibration is clearly worse on a recording than the stated errors.

    A calibration has one zero for all recordings, and assumes a rested unit. The stated errors allow each recording its
    own zero and past, and are of held-out loads, which may be less demanding.
    """
    model, there = found.model, [one for one in found.fine if one.usable.any()]
    off_n = (_error_without_own_n(one, model, _compensator(model, one), found.zero) for one in there)
    name, worst_n, stated_n = _farthest_off(there, off_n, model)
    least_n = thresholds.tolerable * model.full_scale_load_n
    if worst_n <= thresholds.clear * max(stated_n, least_n):
        held_n = found.error.held_out_n
        if math.isnan(held_n) or worst_n <= thresholds.clear * max(held_n, least_n):
            return []
        return [
            f"the force of {name} is off by {rounded(worst_n)} N (rms): the {rounded(held_n)} N that are stated for"
            " held-out data do not apply to loads like those of this recording"
        ]
    return [
        "a calibration has one zero for all recordings and assumes a long rest before each: so the force of"
        f" {name} is off by {rounded(worst_n)} N (rms); with its own zero and its earlier loads allowed for, it would"
        f" be off by {rounded(stated_n)} N (zero the load cell and the sensor before each recording, and begin with a"
        " rest)"
    ]


def limit_unsound_readings(found: Compensation, scale: Scale, thresholds: Thresholds) -> list[str]:
    """The sentence where a filter that remembers takes readings that were left out, such as spikes, for loads.

    The stated errors are of readings without them. A stream has them, and what they leave behind is in sound samples.
    """
    model, there = found.model, [one for one in found.fine if one.usable.any() and not one.usable.all()]
    if not there:
        return []
    off_n = (_force_error_n(one, model, _as_logged(one, scale)) for one in there)
    name, with_n, without_n = _farthest_off(there, off_n, model)
    if with_n <= thresholds.clear * max(without_n, thresholds.tolerable * model.full_scale_load_n):
        return []
    return [
        "a filter takes faulty samples, such as spikes, for loads and remembers them: with these samples left in, the"
        f" force of {name} is off by {rounded(with_n)} N (rms) in its good samples; without them, as here, by"
        f" {rounded(without_n)} N (remove them before the filter; a median of three samples is enough for single ones)"
    ]


def _farthest_off(there: Sequence[Session], off_n: Iterable[Array], model: ExtendedModel) -> tuple[str, float, float]:
    """The recording of ``there`` with the largest errors ``off_n`` (n,), their rms in N, and that which is stated."""
    rms_n = [_rms([error_n], [one.usable]) for one, error_n in zip(there, off_n, strict=True)]
    worst = max(range(len(there)), key=rms_n.__getitem__)
    stated_n = _rms([_force_error_n(there[worst], model)], [there[worst].usable])
    return there[worst].recording.name, rms_n[worst], stated_n


def _as_logged(session: Session, scale: Scale) -> Array:
    """(n,) the reading with its samples that are not usable as they were logged, a share of full scale.

    Where the load is not known the reading is not at fault: there it stays as it is.
    """
    recording, at_s = session.recording, session.conditions.time_s
    time_s, present = recording.time_s - recording.time_s[0], recording.sensor.present
    logged = np.interp(at_s, time_s[present], scale.share(reading_in(recording, scale.unit)[present]))
    has_load = np.interp(at_s, time_s, recording.load.present) == 1.0
    return np.where(session.usable | ~has_load, session.reading, logged)


def _force_error_n(session: Session, model: ExtendedModel, reading: Array | None = None) -> Array:
    """(n,) compensated force less load in N, with the recording's own offset and past removed from the reading.

    ``reading`` (n,): another one to compensate, with the same offset and past.

    The past includes what earlier recordings, which it continues, did to the unit; their clock runs on, and a
    compensator can be told its start.
    """
    started_s = session.conditions.before.get("time_s", 0.0)
    compensator = _compensator(model, session, started_s)
    undone = _beside_zero(model, compensator)
    read = undone.simulate(session.conditions)
    _, own = own_terms_of(session, undone, session.reading - read)
    if session.conditions.before:
        rested = replace(session.conditions, before={"time_s": started_s}, earlier=np.zeros(0), cache={})
        own = own + read - undone.simulate(rested)
    compensated = session if reading is None else replace(session, reading=reading)
    return _error_without_own_n(compensated, model, compensator, own)


def _beside_zero(model: ExtendedModel, compensator: ExtendedCompensator) -> ExtendedModel:
    """The part of ``model`` beside which a zero is taken: what the compensator undoes, and what clips.

    So the zero takes the constant part of what else is not undone. What bends at one end of the range has none.
    """
    left = (part for part in model.parts if part.name in compensator.not_inverted)
    return model.without(*(part.name for part in left if not part.effect.clips))


def _compensator(model: ExtendedModel, session: Session, started_s: float = 0.0) -> ExtendedCompensator:
    """The compensator of ``model`` at a session's rate; ``started_s`` is its clock at the start."""
    return ExtendedCompensator(model, 1.0 / session.conditions.step_s, started_s=started_s)


def _error_without_own_n(
    session: Session, model: ExtendedModel, compensator: ExtendedCompensator, own: Array | float
) -> Array:
    """(n,) compensated force less load in N, for a reading without its ``own`` terms, shares of full scale."""
    force_n = compensator.apply((session.reading - own) * model.full_scale_reading)
    return np.asarray(force_n - session.conditions.load * model.full_scale_load_n)


def _rms(signals: Sequence[Array], seen: Sequence[Mask]) -> float:
    """Root mean square of ``signals`` (n,) over the samples ``seen``; NaN where there are none."""
    return rms_of([signal[mask] for signal, mask in zip(signals, seen, strict=True)], math.nan)
