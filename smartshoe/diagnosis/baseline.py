"""The baseline model of a set of sessions: found over a grid of poles, so that no local optimum is taken for it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from smartshoe.diagnosis.session import Scale, Session
from smartshoe.models.core import USUAL_WALL_RATIO, Core
from smartshoe.models.effects import effect
from smartshoe.models.effects.effect import Arm
from smartshoe.models.extended import ExtendedModel

Array = NDArray[np.float64]

POLES_PER_S = np.geomspace(0.01, 20.0, 31)
LATE_S = (0.01, 0.02, 0.04, 0.08, 0.16, 0.32, 0.64, 1.28)
TIMINGS = (*(("delay", (late,)) for late in LATE_S), *(("sensor_lag", (late, 0.1)) for late in LATE_S))
ABOUT = (0.8, 1.0, 1.25)  # times a rate of two clocks that was seen without a model
EARNED = 0.9  # of the error, for a delay that nobody asked for
PLAINLY = 0.5  # the same where one is known: what looked like two clocks is a slow sensor
LARGEST_SHARE = 5.0  # no wall relaxes by more: what looks like it is a lag or a permanent set
LEAST_SHARE = 1e-3  # of the load that relaxes: below it the pole means nothing


Timing = tuple[str, tuple[float, ...]]


def start_of(sessions: Sequence[Session], scale: Scale, known: Timing | None = None) -> ExtendedModel:
    """The baseline from which effects are looked for; with a delay or lag where its arm would else play one.

    An arm that relaxes by several times the wall, or within milliseconds, is none: it has eaten a delay or a lag,
    which no screen would find again. ``known`` is an effect of timing that is known from elsewhere.
    """
    error, model = searched(sessions, scale, known)
    if known:
        model = model.with_part(effect(known[0]), np.array(known[1]))
    elif not has_idle_arm(model):
        return model
    others = [(*searched(sessions, scale, timing), timing) for timing in TIMINGS]
    lower, late, (name, values) = min(others, key=lambda one: one[0])
    return late.with_part(effect(name), np.array(values)) if lower < (PLAINLY if known else EARNED) * error else model


def shared_timing(
    sessions: Sequence[Session], moved: Sequence[Session], scale: Scale, rates: Sequence[float]
) -> Timing | None:
    """A delay, lag or drift of clocks (tried at and about ``rates``) that all ``sessions`` share; None where none does.

    It must explain them as well as the baseline does those that were ``moved`` each by a clock of its own: one cause
    comes before several.
    """
    drifts = [("clock_drift", (rate * part,)) for rate in {*rates} - {0.0} for part in ABOUT]
    limit, _ = searched(moved, scale, None)
    error, best = min((searched(sessions, scale, timing)[0], timing) for timing in (*TIMINGS, *drifts))
    return best if error <= limit else None


def has_idle_arm(model: ExtendedModel) -> bool:
    """Whether the baseline's arm is at an end of its range, where it is no relaxation of a wall."""
    share, rate = model.relaxing_share, model.relaxation_rate_per_s
    return not (LEAST_SHARE < share < 0.9 * LARGEST_SHARE and 0.011 < rate < 40.0)


def searched(sessions: Sequence[Session], scale: Scale, timing: Timing | None) -> tuple[float, ExtendedModel]:
    """The least mean squared error, and gain, relaxing share and rate there, for readings that are late by ``timing``.

    Linear in two numbers for each pole of a grid: y = c (f - w) + d w with w = pole/(s + pole) f; the wall is passive
    where d >= c > 0 (the pressure creeps up).
    """
    kept = [session.fitted for session in sessions]
    reading = np.concatenate([s.reading[k] for s, k in zip(sessions, kept, strict=True)])
    loads = [s.conditions.load for s in sessions]
    if timing is not None:  # linear like all the rest, so that it may as well act on the load
        late, values = effect(timing[0]), np.array(timing[1])
        loads = [late.apply(f, s.conditions, values) for f, s in zip(loads, sessions, strict=True)]
    load = np.concatenate([f[k] for f, k in zip(loads, kept, strict=True)])
    best: tuple[float, float, float, float] | None = None
    for pole in POLES_PER_S:
        lags = [_lag(f, s.conditions.step_s, float(pole)) for f, s in zip(loads, sessions, strict=True)]
        lag = np.concatenate([w[k] for w, k in zip(lags, kept, strict=True)])
        columns = np.column_stack([load - lag, lag, np.ones(load.size)])
        (fast, slow, _), *_ = np.linalg.lstsq(columns, reading, rcond=None)
        if slow <= 0:
            continue
        fast = min(max(float(fast), slow / (1.0 + LARGEST_SHARE)), slow / (1.0 + LEAST_SHARE))
        offset_free = columns[:, :2] @ np.array([fast, slow])
        error = float(np.var(reading - offset_free))
        if best is None or error < best[0]:
            best = error, fast, float(slow), float(pole)
    if best is None:
        gain = float(load @ reading / (load @ load))
        best = float(np.var(reading - gain * load)), gain / (1.0 + LEAST_SHARE), gain, 0.2
    error, fast, slow, pole = best
    share = slow / fast - 1.0
    return error, ExtendedModel(
        slow,
        share,
        pole * (1.0 + share),
        scale.load_n,
        scale.reading,
        scale.unit.symbol,
        (),
        _wall_ratio(sessions, slow, scale),
    )


def _lag(load: Array, step_s: float, pole: float) -> Array:
    """pole/(s + pole) of the load, from what an arm of share one adds: f/2 + lag/2."""
    return 2.0 * Core([Arm(1.0, 2.0 * pole)]).simulate(load, step_s) - load


def _wall_ratio(sessions: Sequence[Session], gain: float, scale: Scale) -> float:
    """1 + k1 x0^2/(nRT) where an effective area is declared, from the static gain; else what units usually have."""
    declared = sessions[0].recording.metadata.get("effective_area_m2")
    if declared is None or scale.unit.quantity != "pressure":
        return USUAL_WALL_RATIO
    pascal_per_newton = gain * float(scale.unit.to_si(np.array([scale.reading]))[0]) / scale.load_n
    ratio = 1.0 / (float(declared) * pascal_per_newton)
    return ratio if 1.02 < ratio < 50.0 else USUAL_WALL_RATIO
