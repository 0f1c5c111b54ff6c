"""Offset and tare: which recordings' zeros may be named as causes, by evidence of their own.

Every recording's offset is free in every fit, so that no effect depends on it. It is named only where it is seen: a
gauge's reading of an unloaded unit is its zero, the load of an unloaded machine is its cell's tare. Where the unit is
never unloaded, or may be loaded without the log saying so, either may cause the same offset.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import stdtrit

from smartshoe.arrays import Array
from smartshoe.diagnosis._baseline import has_extreme_arm
from smartshoe.diagnosis._own_terms import initial_memory_of, own_terms_of, residual_of
from smartshoe.diagnosis._rest import begins_unloaded
from smartshoe.diagnosis._scale import Scale
from smartshoe.diagnosis._session import Session, all_fitted, fitted_of
from smartshoe.integrity.thresholds import Thresholds, largest_of_noise
from smartshoe.models.effects import Effect, shift_of
from smartshoe.models.extended import ExtendedModel
from smartshoe.signals.noise import NORMAL_95


@dataclass(frozen=True, eq=False)
class Zero:
    """An offset or tare: the ``value`` of the ``effect``'s parameter, a share of full scale, with its ``sd``.

    ``size`` is how far it moves the reading, ``alternatives`` are effects that this data cannot distinguish from it.
    ``may_have_drifted``: the model's drift of the zero may have produced it before the recordings began, so that no
    offset is seen (nor a tare, where the unit bears the load shown and the rest of its reading may have drifted).
    ``extrapolated_from``: the load from which the zero is extrapolated, where behaviour below it, or memory, may
    explain as much. ``is_seen``: a rest shows it, whatever the model.
    """

    effect: Effect
    value: float
    sd: float
    size: float
    alternatives: tuple[str, ...] = ()
    may_have_drifted: bool = False
    extrapolated_from: float = 0.0
    is_seen: bool = True


def offsets(sessions: Sequence[Session], model: ExtendedModel) -> Array:
    """(fitted sessions,) each recording's offset under ``model``, shares of full scale."""
    return np.array(
        [own_terms_of(one, model, one.reading - model.simulate(one.conditions))[0][0] for one in fitted_of(sessions)]
    )


def mean_offset(sessions: Sequence[Session], model: ExtendedModel) -> float:
    """The mean of the fitted recordings' offsets under ``model``, a share of full scale."""
    return float(np.mean(offsets(sessions, model)))


@dataclass(frozen=True)
class OwnZeros:
    """Differing ``offsets`` (shares of full scale) of the recordings with these ``names``."""

    names: tuple[str, ...]
    offsets: Array


def own_zeros(sessions: Sequence[Session], model: ExtendedModel, thresholds: Thresholds) -> OwnZeros | None:
    """The zeros of all usable recordings, or None where they differ by no more than what the model leaves.

    Recordings that continue another are left out, since the unit keeps what it lost or gained. None also with an arm
    that no wall has, since a slow arm may replace a zero.
    """
    if has_extreme_arm(model):
        return None
    there = all_fitted(one for one in _fresh(sessions) if one.usable.any())
    if not there:
        return None
    each = offsets(there, model)
    structure_rms = max(float(np.sqrt(np.mean(residual_of(one, model)[one.usable] ** 2))) for one in there)
    if np.ptp(each) <= thresholds.clear * max(thresholds.tolerable, structure_rms):
        return None
    return OwnZeros(tuple(one.recording.name for one in there), each)


def _fresh(sessions: Iterable[Session]) -> Iterator[Session]:
    """The sessions that do not continue another."""
    return (one for one in sessions if "continues" not in one.recording.metadata)


def first_rests(sessions: Sequence[Session], model: ExtendedModel, thresholds: Thresholds) -> Array:
    """(m, 6) for each fitted recording that begins with a rest: means over it, shares of full scale.

    The columns are load and reading; the drift and memory taken out of the reading, with the memory on average and as
    it began; and the standard deviations that white noise leaves to both means. Before the first load the reading is
    the unit's zero whatever its model, except for drift and memory, as where a walk was cut. No rest is: a load that
    begins to rise at once, a reading that rises first on an early clock, and the start of a recording that continues
    another.
    """
    found = []
    for session in _fresh(sessions):
        load = session.conditions.load
        at_rest = _without_what_rests_show(model).simulate(session.conditions)
        resting = session.resting.copy()
        command = session.recording.command_n
        if command is not None:
            # By the command alone, since a large tare hides a rest in the load.
            full = float(np.max(np.abs(command))) or 1.0
            since_s = session.recording.time_s - session.recording.time_s[0]
            asked = np.interp(session.conditions.time_s, since_s, np.abs(command))
            resting = (asked < 1e-3 * full) & (np.abs(load - load[0]) < thresholds.standing)
        elif begins_unloaded(load, session.reading, session.conditions.step_s, thresholds):
            resting = np.abs(load - load[0]) < thresholds.standing
        resting = resting & (np.abs(at_rest - at_rest[0]) < thresholds.standing * model.gain)
        moved = np.flatnonzero(~resting)
        most = max(1, round(thresholds.hold_s / session.conditions.step_s))  # before anything has crept
        lasts = int(moved[0]) if moved.size else resting.size
        first = slice(0, min(lasts, most))
        kept = session.fitted[first]
        lasts_s = kept.sum() * session.conditions.step_s
        # A single sample of a slow log shows no rest, however long it is: the load may be on its way.
        is_rest = lasts > 1 and abs(_rise(load[first][kept])) < thresholds.still_per_s * lasts_s
        if is_rest and lasts_s >= thresholds.settled_s:
            whole = model.simulate(session.conditions)
            still = (session.reading - (whole - at_rest))[first][kept]
            past = _initial_memory(session, model, session.reading - whole, still, first, thresholds)[first][kept]
            drifted = float(np.mean((whole - at_rest)[first][kept]))
            drift_and_memory = np.array([drifted + np.mean(past), drifted + past[0]]) / model.gain
            reading = float(np.mean(still - past)) / model.gain
            noise = np.array([session.denoised.raw_sd, session.white_sd / model.gain])
            noise /= np.sqrt(kept.sum() * session.thinned)  # by the number of samples at the full rate
            found.append((float(np.mean(load[first][kept])), reading, *drift_and_memory, *noise))
    return np.array(found).reshape(-1, 6)


def _initial_memory(
    session: Session, model: ExtendedModel, residual: Array, rest: Array, first: slice, thresholds: Thresholds
) -> Array:
    """(n,) the memory of loads before the recording that is seen in it; zeros where its ``rest`` (k,) denies it.

    The ``residual`` (n,) of the whole recording gives its size. At rest it fades, and the fading seen there decides
    whether a memory or none is more probable, at any noise.
    """
    past, past_sd = initial_memory_of(session, model, residual)
    fading = np.exp(-model.pole_per_s * session.conditions.time_s)
    own = past * fading[first][session.fitted[first]]
    own -= own.mean()
    is_seen = abs(past) >= largest_of_noise(1, thresholds) * past_sd and 2.0 * float(own @ rest) > float(own @ own)
    return np.asarray(is_seen * past * fading)


def _rise(load: Array) -> float:
    """By how much a load (n,) rises, on the line through the means of its halves."""
    half = load.size // 2
    return 2.0 * float(np.mean(load[half:]) - np.mean(load[:half])) if half else 0.0


def _drift_at_rest(session: Session, model: ExtendedModel) -> Array:
    """(n,) by how much effects that move the reading at rest have moved it."""
    return model.simulate(session.conditions) - _without_what_rests_show(model).simulate(session.conditions)


def _without_what_rests_show(model: ExtendedModel, *, but_for_drifts: bool = False) -> ExtendedModel:
    """``model`` without what a rest shows but a shift; ``but_for_drifts`` keeps effects that go with time."""
    at_rest = (part for part in model.parts if part.effect.is_seen_at_rest and part.effect.shifts is None)
    return model.without(*(one.name for one in at_rest if not (but_for_drifts and one.effect.goes_with_the_clock)))


def _may_have_drifted(value: float, sessions: Sequence[Session], model: ExtendedModel, thresholds: Thresholds) -> bool:
    """Whether an offset may be a drift of the zero before the recordings began.

    The zero drifts in its direction, by an amount of its order of magnitude in a recording: a settling drift may have
    been under way for several time constants. An effect that follows another channel is no such drift, since the
    recording holds all of it.
    """
    model = _without_what_rests_show(model, but_for_drifts=True)
    moves = [_drift_at_rest(one, model) for one in fitted_of(sessions)]
    moved = sum(float(one[-1] - one[0]) for one in moves) / max(len(moves), 1)
    return value * moved > 0.0 and abs(value) <= thresholds.extrapolates * abs(moved)


def zeros_of(
    sessions: Sequence[Session],
    model: ExtendedModel,
    scale: Scale,
    structure_rms: float,
    memory_size: float,
    thresholds: Thresholds,
    residual_sd: float = 0.0,
    lasting_memory: float = 0.0,
) -> tuple[Zero, ...]:
    """The zeros that may be named, largest first.

    ``structure_rms``: structure without an effect, which may lie at rest as elsewhere. ``memory_size``: size of effects
    by which the wall remembers; ``lasting_memory`` of those that never fade, within which a unit that begins loaded may
    stand anywhere. ``residual_sd``: standard deviation of the mean residual over a rest.
    """
    is_gauge = scale.unit.quantity == "pressure"
    commanded = any(one.recording.command_n is not None for one in fitted_of(sessions))
    rests = first_rests(sessions, model, thresholds)
    sensor, machine = shift_of("reading"), shift_of("load")
    if not rests.size:
        return (
            _zero_by_model(sessions, model, structure_rms, memory_size, thresholds, lasting_memory) if is_gauge else ()
        )
    loads, readings, drifted, as_begun, *white = rests.T
    load_sd, reading_sd = (
        sd_of_a_mean(one, sds, thresholds) for one, sds in zip((loads, readings), white, strict=True)
    )
    as_read_sd = float(np.hypot(reading_sd, residual_sd / np.sqrt(len(rests))))
    drift_sd = thresholds.departure * float(np.mean(np.abs(drifted)))
    # Whether the reading agrees with the load is known from the scatter where there are several rests.
    borne_sd = float(np.linalg.norm([load_sd, drift_sd, reading_sd if len(rests) > 1 else as_read_sd]))
    reading_sd = float(np.hypot(as_read_sd, drift_sd))
    load, reading = (float(np.mean(one)) for one in (loads, readings))
    as_read = [float(np.mean(readings + one)) for one in (drifted, as_begun)]
    z_limit = largest_of_noise(1, thresholds)
    is_clear = np.abs([load, reading]) >= z_limit * np.array([load_sd, reading_sd])
    # Where the reading's zero is a convention a load may be borne; but no pressed unit bears less than nothing.
    is_clear[0] &= is_gauge or commanded or load < 0.0
    if is_gauge and abs(reading - load) < z_limit * borne_sd:
        return ()  # the reading agrees with the load, so that the unit bears it
    if is_gauge and is_clear.all() and not commanded and thresholds.clear * reading > load > 0.0:
        # Nearer to the load that is shown than to nothing: the unit may bear it, and is never seen unloaded.
        return _zero_by_model(sessions, model, structure_rms, memory_size, thresholds, lasting_memory)
    is_clear[1] &= is_gauge and abs(reading) <= thresholds.foreign_zero  # for other sensors zero is a convention
    # A zero that only cancels a drift is that drift's error; one that cancels a memory began with it.
    is_clear[1] &= as_read[0] * as_read[1] > 0.0 and min(map(abs, as_read)) >= z_limit * as_read_sd
    beyond_load = (reading - load) * model.gain
    if load > 0.0 and not commanded and is_clear.all() and _may_have_drifted(beyond_load, sessions, model, thresholds):
        # A drift that began before explains the zero, and no further cause is needed.
        return (Zero(sensor, beyond_load, reading_sd, abs(beyond_load), (machine.name,), True),)
    named = []
    if is_clear[0]:
        named.append(Zero(machine, -load, load_sd, abs(load * model.gain)))
    if is_clear[1]:
        value = reading * model.gain
        # A unit is only pressed: a positive zero may be load that it bears, with the cell zeroed under it.
        bears = () if commanded or is_clear[0] or value < 0.0 else (machine.name,)
        named.append(
            Zero(sensor, value, reading_sd, abs(value), bears, _may_have_drifted(value, sessions, model, thresholds))
        )
    return tuple(sorted(named, key=lambda one: -one.size))


def sd_of_a_mean(zeros: Array, white_sds: Array, thresholds: Thresholds) -> float:
    """Standard deviation of the mean of ``zeros`` (m,), each with white noise of ``white_sds`` (m,).

    It combines the noise, how well a rest is known to be zero, and the scatter beyond noise. The scatter is estimated
    from few values, so that all is widened to hold 95 % under Student's t, with the degrees of freedom of the estimated
    part (Satterthwaite 1946).
    """
    known = thresholds.zero_sd**2 + float(np.mean(white_sds**2)) / zeros.size
    if zeros.size < 2:
        return math.sqrt(known)
    scatter = max(float(np.var(zeros, ddof=1) - np.mean(white_sds**2)), 0.0) / zeros.size
    if scatter == 0.0:
        return math.sqrt(known)
    freedom = (zeros.size - 1) * ((known + scatter) / scatter) ** 2
    return math.sqrt(known + scatter) * float(stdtrit(freedom, 0.975)) / NORMAL_95


def creeping_tare(zeros: Sequence[Zero], drift: Effect, size: float, thresholds: Thresholds) -> Zero | None:
    """The tare among ``zeros`` that a ``drift`` of the zero by ``size`` may belong to, or None.

    A constant tare is an equation like others: the zero of a load cell that warms or creeps departs from it by up to a
    tenth of its size.
    """
    if drift.family != shift_of("reading").family:
        return None
    tares = (one for one in zeros if one.effect.shifts == "load")
    return next((one for one in tares if thresholds.extrapolates * size <= one.size), None)


def _zero_by_model(
    sessions: Sequence[Session],
    model: ExtendedModel,
    structure_rms: float,
    memory_size: float,
    thresholds: Thresholds,
    lasting_memory: float = 0.0,
) -> tuple[Zero, ...]:
    """The zero by the model, of a unit that never begins unloaded; it may be an offset or a tare."""
    found = offsets(sessions, model)
    fitted = fitted_of(sessions)
    # Memory of an unknown past beyond that of the baseline's arm; drifts; the curve below the lowest load.
    begun = np.array([abs(one.conditions.load[0]) for one in fitted])
    past = begun * (thresholds.departure * abs(model.relaxing_share) + memory_size) + lasting_memory
    drifted = thresholds.departure * np.array([np.ptp(_drift_at_rest(one, model)) for one in fitted])
    lowest = np.array([np.quantile(np.abs(one.conditions.load[one.fitted]), 0.01) for one in fitted])
    own = np.hypot(thresholds.zero_sd, drifted)
    sds = np.sqrt(own**2 + past**2 + (thresholds.departure * lowest) ** 2)
    weights = sds**-2 / np.sum(sds**-2)
    mean = float(weights @ found)
    scatter = float(np.sqrt(weights @ (found - mean) ** 2 / (found.size - 1))) if found.size > 1 else 0.0
    # Errors of the model have one sign in all recordings, and do not average out.
    near, sd = (float(np.linalg.norm([scatter, structure_rms, weights @ one])) for one in (own, sds))
    z_limit = largest_of_noise(1, thresholds)
    if abs(mean) > thresholds.foreign_zero or abs(mean) < z_limit * near:
        return ()
    extrapolated_from = float(weights @ lowest) if abs(mean) < z_limit * sd else 0.0
    may_have_drifted = _may_have_drifted(mean, sessions, model, thresholds)
    return (
        Zero(
            shift_of("reading"),
            mean,
            sd,
            abs(mean),
            (shift_of("load").name,),
            may_have_drifted,
            extrapolated_from,
            False,
        ),
    )
