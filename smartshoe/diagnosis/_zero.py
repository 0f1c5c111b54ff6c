"""Offset and tare: what a recording's own zero may be called a cause for, by evidence of its own.

Every recording's offset is free in every fit, so that no effect depends on it. It is named where it is seen: a gauge
sensor's reading of an unloaded unit is its zero; an unloaded machine's load is its cell's tare. Where the unit is
never unloaded, or may be loaded where the log says nothing, either may make the same offset.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import stdtrit

from smartshoe.arrays import Array
from smartshoe.diagnosis._baseline import is_stretched
from smartshoe.diagnosis._held_out import own_of, past_of, residual_of
from smartshoe.diagnosis._scale import Scale
from smartshoe.diagnosis._session import Session, all_fitted, begins_unloaded, fitted_of
from smartshoe.integrity.thresholds import Thresholds, largest_of_noise
from smartshoe.models.effects import Effect, shift_of
from smartshoe.models.extended import ExtendedModel
from smartshoe.signals.noise import NORMAL_95


@dataclass(frozen=True, eq=False)
class Zero:
    """``value`` of the effect's one parameter (share of full scale) with its standard deviation.

    ``size`` it moves the reading by; ``alternatives`` that this data cannot tell from it. ``is_past``: the model's own
    drift of the zero may have brought it there before the recordings began, so that no offset beside it is seen (nor a
    tare, where the unit bears the load that is shown, and the zero may have drifted to what it reads beyond that).
    ``led_from``: the load from which on it is led back to none, where what the unit does below, or remembers, may make
    as much of it. ``is_seen``: a rest shows that there is one or the other of these, whatever the model.
    """

    effect: Effect
    value: float
    sd: float
    size: float
    alternatives: tuple[str, ...] = ()
    is_past: bool = False
    led_from: float = 0.0
    is_seen: bool = True


def offsets(sessions: Sequence[Session], model: ExtendedModel) -> Array:
    """(fitted sessions,) each recording's own offset under ``model``, shares of full scale."""
    return np.array(
        [own_of(one, model, one.reading - model.simulate(one.conditions))[0][0] for one in fitted_of(sessions)]
    )


def mean_offset(sessions: Sequence[Session], model: ExtendedModel) -> float:
    """The fitted recordings' mean offset under ``model``, a share of full scale."""
    return float(np.mean(offsets(sessions, model)))


@dataclass(frozen=True)
class OwnZeros:
    """Offsets (shares of full scale) of the recordings by their ``names``, which differ."""

    names: tuple[str, ...]
    offsets: Array


def own_zeros(sessions: Sequence[Session], model: ExtendedModel, thresholds: Thresholds) -> OwnZeros | None:
    """The zeros of all that can be used, None where they are alike but for what the model leaves of any recording.

    What continues another has none: the unit brings along what it has lost or gained in that. Nor can any be told
    beside an arm as no wall has: a slow one may stand for a zero.
    """
    if is_stretched(model):
        return None
    there = all_fitted(one for one in _begun(sessions) if one.usable.any())
    if not there:
        return None
    each = offsets(there, model)
    left = max(float(np.sqrt(np.mean(residual_of(one, model)[one.usable] ** 2))) for one in there)
    if np.ptp(each) <= thresholds.clear * max(thresholds.tolerable, left):
        return None
    return OwnZeros(tuple(one.recording.name for one in there), each)


def _begun(sessions: Iterable[Session]) -> Iterator[Session]:
    """Those that do not continue another."""
    return (one for one in sessions if "continues" not in one.recording.metadata)


def first_rests(sessions: Sequence[Session], model: ExtendedModel, thresholds: Thresholds) -> Array:
    """(m, 6) mean load and reading of each fitted recording's rest before its first load, shares of full scale.

    Nothing has happened to the unit yet, so that the reading is its zero whatever its model; but for what has drifted
    by then, and what the unit is seen to remember from before the recording, as where a walk was cut: these are taken
    out. The third column is how much they are, the fourth how much with what is remembered as it was at first. The last
    two are the standard deviations that white noise leaves to the means of load and reading. A load that begins to rise
    at once is no rest, nor is one whose reading, on a clock that is early, has begun to rise before it; nor is any of
    a recording that continues another, in which something has happened.
    """
    found = []
    for session in _begun(sessions):
        load = session.conditions.load
        borne = _without_what_rests_show(model).simulate(session.conditions)
        resting = session.resting.copy()
        command = session.recording.command_n
        if command is not None:
            # By the command alone: a large tare lifts the load out of what looks like a rest.
            full = float(np.max(np.abs(command))) or 1.0
            nothing = np.abs(command[:: session.thinned][: resting.size]) < 1e-3 * full
            resting = np.pad(nothing, (0, resting.size - nothing.size)) & (np.abs(load - load[0]) < thresholds.standing)
        elif begins_unloaded(load, session.reading, session.conditions.step_s, thresholds):
            resting = np.abs(load - load[0]) < thresholds.standing
        resting = resting & (np.abs(borne - borne[0]) < thresholds.standing * model.gain)
        moved = np.flatnonzero(~resting)
        most = max(1, round(thresholds.hold_s / session.conditions.step_s))  # nothing has crept yet
        lasts = int(moved[0]) if moved.size else resting.size
        first = slice(0, min(lasts, most))
        kept = session.fitted[first]
        lasts_s = kept.sum() * session.conditions.step_s
        # A single sample of a slow log shows no rest, however long it lasts: the load may be on its way.
        is_rest = lasts > 1 and abs(_risen(load[first][kept])) < thresholds.still_per_s * lasts_s
        if is_rest and lasts_s >= thresholds.settled_s:
            whole = model.simulate(session.conditions)
            still = (session.reading - (whole - borne))[first][kept]
            past = _remembered(session, model, session.reading - whole, still, first, thresholds)[first][kept]
            drifted = float(np.mean((whole - borne)[first][kept]))
            moved_by = np.array([drifted + np.mean(past), drifted + past[0]]) / model.gain
            reading = float(np.mean(still - past)) / model.gain
            noise = np.array([session.quiet.raw, session.white_sd / model.gain])
            noise /= np.sqrt(kept.sum() * session.thinned)  # as many were taken of it, whatever is left of them
            found.append((float(np.mean(load[first][kept])), reading, *moved_by, *noise))
    return np.array(found).reshape(-1, 6)


def _remembered(
    session: Session, model: ExtendedModel, residual: Array, rest: Array, first: slice, thresholds: Thresholds
) -> Array:
    """(n,) what the unit is seen to remember from before the recording; nothing where its ``rest`` (k,) denies it.

    All of the recording tells it, by what the model leaves of it, ``residual`` (n,). At rest it fades, and by how much
    the reading does so there one of the two, it or nothing, is the likelier, whatever the noise is.
    """
    past, past_sd = past_of(session, model, residual)
    fading = np.exp(-model.pole_per_s * session.conditions.time_s)
    own = past * fading[first][session.fitted[first]]
    own -= own.mean()
    is_seen = abs(past) >= largest_of_noise(1, thresholds) * past_sd and 2.0 * float(own @ rest) > float(own @ own)
    return np.asarray(is_seen * past * fading)


def _risen(load: Array) -> float:
    """By how much a load (n,) rises from its first half to its second, on the line through the means of both."""
    half = load.size // 2
    return 2.0 * float(np.mean(load[half:]) - np.mean(load[:half])) if half else 0.0


def _drifted(session: Session, model: ExtendedModel) -> Array:
    """(n,) by how much the model's effects that move the reading at rest have moved it."""
    return model.simulate(session.conditions) - _without_what_rests_show(model).simulate(session.conditions)


def _without_what_rests_show(model: ExtendedModel, *, but_for_drifts: bool = False) -> ExtendedModel:
    at_rest = (part for part in model.parts if part.effect.is_seen_at_rest)
    return model.without(*(one.name for one in at_rest if not (but_for_drifts and one.effect.goes_with_the_clock)))


def _is_past(value: float, sessions: Sequence[Session], model: ExtendedModel, thresholds: Thresholds) -> bool:
    """Whether an offset may be how far the zero had drifted before the recordings began.

    It drifts the same way, and what it drifts by in a recording is of the offset's order of magnitude: what settles
    may have been under way for a few of its time constants. What follows another channel, as a neighbour's pressure, is
    no drift: the recording holds all of it.
    """
    model = _without_what_rests_show(model, but_for_drifts=True)
    moves = [_drifted(one, model) for one in fitted_of(sessions)]
    moved = sum(float(one[-1] - one[0]) for one in moves) / max(len(moves), 1)
    return value * moved > 0.0 and abs(value) <= thresholds.extrapolates * abs(moved)


def zeros_of(
    sessions: Sequence[Session],
    model: ExtendedModel,
    scale: Scale,
    left: float,
    remembered: float,
    thresholds: Thresholds,
    wanders: float = 0.0,
    rubbed: float = 0.0,
) -> tuple[Zero, ...]:
    """What is named of the zeros, largest first; ``left``: rms of the structure that the model does not explain.

    Such structure may lie at rest as anywhere. ``remembered``: size of the effects with a memory of the wall.
    ``rubbed``: of those whose memory does not fade, so that a unit that begins loaded may stand anywhere within it.
    ``wanders``: standard deviation of the mean of what is left over a rest, which holds it as any other stretch does.
    """
    is_gauge = scale.unit.quantity == "pressure"
    commanded = any(one.recording.command_n is not None for one in fitted_of(sessions))
    if not (is_gauge or commanded):
        return ()
    rests = first_rests(sessions, model, thresholds)
    sensor, machine = shift_of("reading"), shift_of("load")
    if not rests.size:
        return _unseen(sessions, model, left, remembered, thresholds, rubbed) if is_gauge else ()
    loads, readings, drifted, begun, *white = rests.T
    load_sd, reading_sd = (
        sd_of_a_mean(one, sds, thresholds) for one, sds in zip((loads, readings), white, strict=True)
    )
    as_read_sd = float(np.hypot(reading_sd, wanders / np.sqrt(len(rests))))
    drift_sd = thresholds.departure * float(np.mean(np.abs(drifted)))
    # Whether the reading agrees with the load several rests tell by how they scatter.
    borne_sd = float(np.linalg.norm([load_sd, drift_sd, reading_sd if len(rests) > 1 else as_read_sd]))
    reading_sd = float(np.hypot(as_read_sd, drift_sd))
    load, reading = (float(np.mean(one)) for one in (loads, readings))
    as_read = [float(np.mean(readings + one)) for one in (drifted, begun)]
    many = largest_of_noise(1, thresholds)
    is_clear = np.abs([load, reading]) >= many * np.array([load_sd, reading_sd])
    if is_gauge and abs(reading - load) < many * borne_sd:
        return ()  # the reading agrees with the load, and the unit bears it
    if is_clear.all() and not commanded and abs(reading - load) < thresholds.same * load:
        return ()  # a tare and an offset of one size would be a coincidence: it bears the load, by a curve of its own
    is_clear[1] &= is_gauge and abs(reading) <= thresholds.foreign_zero  # else it is a convention of the sensor's
    # One that only undoes a drift is that drift's error; one that undoes a past, where what fades began: a drift began.
    is_clear[1] &= as_read[0] * as_read[1] > 0.0 and min(map(abs, as_read)) >= many * as_read_sd
    borne = (reading - load) * model.gain
    if load > 0.0 and not commanded and is_clear.all() and _is_past(borne, sessions, model, thresholds):
        return (Zero(sensor, borne, reading_sd, abs(borne), (machine.name,), True),)  # no cause more is needed
    named = []
    if is_clear[0]:
        named.append(Zero(machine, -load, load_sd, abs(load * model.gain)))
    if is_clear[1]:
        value = reading * model.gain
        # A unit is pressed only: what it reads beyond nothing it may bear, where the load was set to zero under it.
        bears = () if commanded or is_clear[0] or value < 0.0 else (machine.name,)
        named.append(Zero(sensor, value, reading_sd, abs(value), bears, _is_past(value, sessions, model, thresholds)))
    return tuple(sorted(named, key=lambda one: -one.size))


def sd_of_a_mean(zeros: Array, white_sds: Array, thresholds: Thresholds) -> float:
    """Standard deviation of the mean of ``zeros`` (m,), each with white noise of ``white_sds`` (m,).

    Of the noise, of how well a rest is known to be zero, and of what the recordings scatter by beyond their noise. That
    is estimated from few: so all of it is widened as Student's t is beside the normal law, where each holds 95 %, with
    as many degrees of freedom as the part that is estimated leaves (Satterthwaite 1946).
    """
    known = thresholds.zero_sd**2 + float(np.mean(white_sds**2)) / zeros.size
    if zeros.size < 2:
        return math.sqrt(known)
    scatter = max(float(np.var(zeros, ddof=1) - np.mean(white_sds**2)), 0.0) / zeros.size
    if scatter == 0.0:
        return math.sqrt(known)
    freedom = (zeros.size - 1) * ((known + scatter) / scatter) ** 2
    return math.sqrt(known + scatter) * float(stdtrit(freedom, 0.975)) / NORMAL_95


def creeping(zeros: Sequence[Zero], drift: Effect, size: float, thresholds: Thresholds) -> Zero | None:
    """The tare among ``zeros`` that a ``drift`` of the reading's zero by ``size`` may belong to.

    That a tare is one value is an equation as any other: a load cell's zero that warms or creeps departs from it, by
    up to an order of magnitude less than it is.
    """
    if drift.family != shift_of("reading").family:
        return None
    tares = (one for one in zeros if one.effect.shifts == "load")
    return next((one for one in tares if thresholds.extrapolates * size <= one.size), None)


def _unseen(
    sessions: Sequence[Session],
    model: ExtendedModel,
    left: float,
    remembered: float,
    thresholds: Thresholds,
    rubbed: float = 0.0,
) -> tuple[Zero, ...]:
    """The zero of a unit that is never seen unloaded at first: by its model, and an offset or a tare may be it."""
    found = offsets(sessions, model)
    fitted = fitted_of(sessions)
    # What each remembers of an unknown past, beyond what its one arm does; drifts; the curve below its lowest load.
    begun = np.array([abs(one.conditions.load[0]) for one in fitted])
    past = begun * (thresholds.departure * abs(model.relaxing_share) + remembered) + rubbed
    drifted = thresholds.departure * np.array([np.ptp(_drifted(one, model)) for one in fitted])
    lowest = np.array([np.quantile(np.abs(one.conditions.load[one.fitted]), 0.01) for one in fitted])
    own = np.hypot(thresholds.zero_sd, drifted)
    sds = np.sqrt(own**2 + past**2 + (thresholds.departure * lowest) ** 2)
    weights = sds**-2 / np.sum(sds**-2)
    mean = float(weights @ found)
    scatter = float(np.sqrt(weights @ (found - mean) ** 2 / (found.size - 1))) if found.size > 1 else 0.0
    # Errors of the model are of one sign in all of them, and no number of recordings takes them out.
    near, sd = (float(np.linalg.norm([scatter, left, weights @ one])) for one in (own, sds))
    many = largest_of_noise(1, thresholds)
    if abs(mean) > thresholds.foreign_zero or abs(mean) < many * near:
        return ()
    led_from = float(weights @ lowest) if abs(mean) < many * sd else 0.0
    is_past = _is_past(mean, sessions, model, thresholds)
    return (Zero(shift_of("reading"), mean, sd, abs(mean), (shift_of("load").name,), is_past, led_from, False),)
