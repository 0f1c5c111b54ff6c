"""Offset and tare: what a recording's own zero may be called a cause for, by evidence of its own.

Every recording's offset is free in every fit, so that no effect depends on it. It is named where it is seen: a gauge
sensor's reading of an unloaded unit is its zero; an unloaded machine's load is its cell's tare. Where the unit is
never unloaded, either may make the same offset.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from smartshoe.diagnosis.held_out import own_of
from smartshoe.diagnosis.session import REST_SHARE, Scale, Session
from smartshoe.diagnosis.thresholds import Thresholds
from smartshoe.models.effects import Effect, catalogue
from smartshoe.models.extended import ExtendedModel

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Zero:
    """``value`` of the effect's one parameter (share of full scale) with its standard deviation; ``size`` it moves the
    reading by; ``alternatives`` that this data cannot tell from it."""

    effect: Effect
    value: float
    sd: float
    size: float
    alternatives: tuple[str, ...] = ()


def shift_of(signal: str) -> Effect:
    """The catalogue's effect that adds one value to the "load" or to the "reading"."""
    return next(e for e in catalogue().values() if e.shifts == signal)


def offsets(sessions: Sequence[Session], model: ExtendedModel) -> Array:
    """(fitted sessions,) each recording's own offset under ``model``, shares of full scale."""
    return np.array(
        [own_of(one, model, one.reading - model.simulate(one.conditions))[0][0] for one in sessions if one.fitted.any()]
    )


def rest_loads(sessions: Sequence[Session]) -> Array:
    """(sessions with rests,) mean measured load of each, where the unit carries nothing, shares of full scale."""
    means = []
    for session in sessions:
        command, load = session.recording.command_n, session.conditions.load
        resting = session.resting & session.fitted
        if command is not None:
            # By the command alone: a large tare lifts the load out of what looks like a rest.
            full = float(np.max(np.abs(command))) or 1.0
            nothing = np.abs(command[:: session.thinned][: resting.size]) < 1e-3 * full
            nothing = np.pad(nothing, (0, resting.size - nothing.size))
            resting = nothing & (np.abs(load - np.quantile(load, 0.02)) < REST_SHARE) & session.fitted
        if resting.sum() * session.conditions.step_s >= 1.0:
            means.append(float(np.mean(load[resting])))
    return np.array(means)


def zeros_of(
    sessions: Sequence[Session],
    model: ExtendedModel,
    scale: Scale,
    left: float,
    remembered: float,
    thresholds: Thresholds,
) -> tuple[Zero, ...]:
    """What is named of the zeros, largest first; ``left``: rms of the structure that the model does not explain.

    Such structure may lie at rest as anywhere. ``remembered``: size of the effects with a memory of the wall.
    """
    if scale.unit.quantity != "pressure":
        return ()
    found = offsets(sessions, model)
    mean = float(np.mean(found))
    if abs(mean) > thresholds.foreign_zero:
        return ()
    sensor, machine = shift_of("reading"), shift_of("load")
    scatter = float(np.std(found, ddof=1) / np.sqrt(found.size)) if found.size > 1 else 0.0
    begun = float(np.mean([abs(s.conditions.load[0]) for s in sessions if s.fitted.any()]))
    # What the unit remembers of an unknown past, beyond what its one arm does.
    past = begun * (thresholds.departure * abs(model.relaxing_share) + remembered)
    sd = float(np.linalg.norm([scatter, thresholds.zero_sd, 0.5 * left, past]))
    if abs(mean) < thresholds.zero_deviations * sd:
        return ()  # the reading agrees with the load wherever both are seen
    rests = rest_loads(sessions)
    if not rests.size:
        lowest = min(float(np.quantile(np.abs(s.conditions.load[s.fitted]), 0.01)) for s in sessions if s.fitted.any())
        # Below the lowest load the curve is extrapolated.
        sd = float(np.hypot(sd, thresholds.departure * lowest))
        if abs(mean) < thresholds.zero_deviations * sd:
            return ()
        return (Zero(sensor, mean, sd, abs(mean), (machine.name,)),)
    tare = -float(np.mean(rests))
    tare_sd = float(
        np.hypot(np.std(rests, ddof=1) / np.sqrt(rests.size) if rests.size > 1 else 0.0, thresholds.zero_sd)
    )
    named = []
    if abs(tare) < thresholds.zero_deviations * tare_sd:
        tare = 0.0
    else:
        named.append(Zero(machine, tare, tare_sd, abs(tare * model.gain)))
    zero = mean - tare * model.gain
    sd = float(np.hypot(sd, model.gain * tare_sd))
    if abs(zero) >= thresholds.zero_deviations * sd:
        named.append(Zero(sensor, zero, sd, abs(zero)))
    return tuple(sorted(named, key=lambda one: -one.size))
