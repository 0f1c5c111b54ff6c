"""The force that a model's inverse gives back, and which effects of a unit's model are undone for it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from smartshoe.arrays import Array, Mask
from smartshoe.calibration import ExtendedCompensator
from smartshoe.diagnosis._held_out import own_of
from smartshoe.diagnosis._session import Session, fitted_of
from smartshoe.diagnosis._zero import mean_offset
from smartshoe.display import percent
from smartshoe.integrity.thresholds import Thresholds
from smartshoe.models.effects import in_words, listed
from smartshoe.models.extended import ExtendedModel


@dataclass(frozen=True, slots=True)
class ForceError:
    """Root mean square errors in N of the compensated force against the load; NaN where there is nothing."""

    fitted_n: float
    held_out_n: float


def force_error(fine: Sequence[Session], model: ExtendedModel) -> ForceError:
    """Of ``model`` run backwards over what was fitted, and over what is held out."""
    off = [_off_n(one, model) for one in fine]
    return ForceError(_rms(off, [one.fitted for one in fine]), _rms(off, [one.judged for one in fine]))


@dataclass(frozen=True, eq=False)
class Compensation:
    """What a unit is compensated by: ``model``, run backwards, with its ``error``.

    ``model`` is the extended one, but for effects (``passed_over``) whose undoing does more harm than good, or the
    plain one; ``filter`` undoes it, at the recordings' rate. ``before`` is the plain one's error, ``whole`` that of the
    extended one with all its effects. ``rejected``: the error of the one that would be ``model``, where it is worse on
    what is held out. All errors are of the recordings ``fine``, which lack the share ``clipped`` of their samples.
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
        """What of ``model`` a filter of readings undoes."""
        return self.model.without(*self.filter.not_inverted)

    @cached_property
    def zero(self) -> float:
        """The recordings' mean offset beside what is undone, a share of full scale."""
        return mean_offset(self.fine, self.undone)


def compensation(
    fine: Sequence[Session], extended: ExtendedModel, plain: ExtendedModel, thresholds: Thresholds
) -> Compensation:
    """The model whose inverse gives back the load of what was fitted best.

    To undo a lag, a gain that goes by the rate or a curve that hardly rises makes more of the reading's ``noise``, and
    of all else that is left of it. Where that is so, an effect is undone only if the force is not nearer to the load
    without. Where the plain model's is nearer all the same, it is the one, and where it is on what is held out. No
    force is asked of samples that are clipped.
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
    made_of_it = extended.noise / extended.gain * extended.full_scale_load_n
    while model.parts and least > alike * made_of_it:
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
    """``session`` but for samples that ``model`` clips by more than is tolerable: what they read tells no load."""
    whole, usable = model.simulate(session.conditions), session.usable
    for part in model.parts:
        if part.effect.clips:
            lost = whole - model.without(part.name).simulate(session.conditions)
            usable = usable & (np.abs(lost) < thresholds.tolerable)
    return replace(session, usable=usable)


def clipped_of(found: Compensation) -> list[str]:
    """What is said of samples of which no force is asked."""
    if not found.clipped:
        return []
    return [f"errors of the force leave out {percent(found.clipped)} of samples, which are clipped and tell no load"]


def force_of(found: Compensation) -> list[str]:
    """What is said of an extended model that gives the load back worse than the plain one does, or than a part does."""
    if found.rejected is not None:
        return [
            "the force that the extended model gives back is worse than the baseline's on held-out data"
            f" ({found.before.held_out_n:.3g} to {found.rejected.held_out_n:.3g} N): the calibration compensates by the"
            " baseline, and its twin simulates with the effects"
        ]
    if found.is_plain:
        return [
            "the extended model fits the reading but gives a worse force: on what was fitted it is off by"
            f" {found.whole.fitted_n:.3g} N, the baseline by {found.before.fitted_n:.3g} N; so the calibration"
            " compensates by the baseline, and its twin simulates with the effects"
        ]
    if found.passed_over:
        return [
            f"the calibration does not undo {listed(found.passed_over)}, which would make more of the noise than it"
            f" takes off: on what was fitted the force is off by {found.error.fitted_n:.3g} N without, by"
            f" {found.whole.fitted_n:.3g} N with, by {found.before.fitted_n:.3g} N by the baseline; its twin simulates"
            " with all effects"
        ]
    return []


def not_undone_of(model: ExtendedModel, step_s: float) -> list[str]:
    """What is said of effects that no compensator can take off a stream of readings."""
    passed_over = ExtendedCompensator(model, 1.0 / step_s).not_inverted
    return [f"no compensator takes off the {name.replace('_', ' ')}, since {why}" for name, why in passed_over.items()]


def late_of(found: Compensation) -> list[str]:
    """What is said of latencies that are undone in part, since the rest would make too much of the noise."""
    return [
        f"the calibration leaves {1e3 * left_s:.3g} ms of the {in_words(name)}: undoing all of it would raise"
        " fast noise too much, and where loads are quicker than those judged here the force is that late"
        for name, left_s in found.filter.lags_left_s.items()
    ]


def held_of(found: Compensation, thresholds: Thresholds) -> list[str]:
    """What is said of drifts that a calibration holds as they are at the end of what was fitted."""
    moved = found.filter.moved_by_the_clock
    held = [part for part in found.model.parts if math.isfinite(part.until_s)]
    held = [part for part in held if abs(moved.get(part.name, 0.0)) > thresholds.standing]
    if not held:
        return []
    said = ", ".join(f"{in_words(part.name)} by {percent(moved[part.name], signed=True)}" for part in held)
    return [
        f"the calibration takes off by the clock what no law is named for, up to {held[0].until_s:.4g} s, the end of"
        f" what was fitted, and holds it from then on, since nothing tells how it goes on: there it moves a full-scale"
        f" force ({said}); reset it where a session begins, and fit a recording as long as its sessions are to be"
    ]


def as_calibrated(found: Compensation, thresholds: Thresholds) -> list[str]:
    """What is said where a calibration is clearly farther off on a recording than the errors that are told.

    It takes one zero for all recordings, that of what it undoes, and begins each as a unit that bore nothing before;
    these errors allow each its own, and are of what is held out, whose loads may ask less of it than others do.
    """
    model, there = found.model, [one for one in found.fine if one.usable.any()]
    scale_n = model.full_scale_load_n
    off_n = [_rms([_off_by_n(one, model, _compensator(model, one), found.zero)], [one.usable]) for one in there]
    worst = max(range(len(there)), key=off_n.__getitem__)
    worst_n, name = off_n[worst], there[worst].recording.name
    told_n, least_n = _rms([_off_n(there[worst], model)], [there[worst].usable]), thresholds.tolerable * scale_n
    if worst_n <= thresholds.clear * max(told_n, least_n):
        held_n = found.error.held_out_n
        if math.isnan(held_n) or worst_n <= thresholds.clear * max(held_n, least_n):
            return []
        return [
            f"the force of {name} is off by {worst_n:.2g} N (rms): the {held_n:.2g} N of what is held out do not hold"
            " for loads as it has"
        ]
    return [
        "a calibration takes one zero for all recordings, and each to begin after a long rest: so the force of"
        f" {name} is off by {worst_n:.2g} N (rms); with its own zero, and what it bore before, allowed for it would be"
        f" {told_n:.2g} N (zero the load cell and the sensor before each recording, and begin it with a rest)"
    ]


def _off_n(session: Session, model: ExtendedModel) -> Array:
    """(n,) compensated force less load in N; the recording's own offset and past are no part of the reading.

    Its past is also what the recordings that it continues did to the unit; their clock goes on, for which a compensator
    can be told when it starts.
    """
    started_s = session.conditions.before.get("time_s", 0.0)
    compensator = _compensator(model, session, started_s)
    undone = model.without(*compensator.not_inverted)  # what is not taken off is the offset's as far as it is one
    read = undone.simulate(session.conditions)
    _, own = own_of(session, undone, session.reading - read)
    if session.conditions.before:
        rested = replace(session.conditions, before={"time_s": started_s}, earlier=np.zeros(0), cache={})
        own = own + read - undone.simulate(rested)
    return _off_by_n(session, model, compensator, own)


def _compensator(model: ExtendedModel, session: Session, started_s: float = 0.0) -> ExtendedCompensator:
    return ExtendedCompensator(model, 1.0 / session.conditions.step_s, started_s=started_s)


def _off_by_n(session: Session, model: ExtendedModel, compensator: ExtendedCompensator, own: Array | float) -> Array:
    """(n,) compensated force less load in N of a reading without what is ``own`` to it, shares of full scale."""
    force_n = compensator.apply((session.reading - own) * model.full_scale_reading)
    return np.asarray(force_n - session.conditions.load * model.full_scale_load_n)


def _rms(signals: Sequence[Array], seen: Sequence[Mask]) -> float:
    """Root mean square of ``signals``, (n,) each, where ``seen``; NaN where nothing is."""
    parts = [signal[mask] for signal, mask in zip(signals, seen, strict=True)]
    count = sum(one.size for one in parts)
    return math.sqrt(sum(float(one @ one) for one in parts) / count) if count else math.nan
