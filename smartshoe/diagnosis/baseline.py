"""The baseline model of a set of sessions: found over a grid of poles, so that no local optimum is taken for it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from smartshoe.diagnosis.session import Scale, Session
from smartshoe.models.core import USUAL_WALL_RATIO, Core
from smartshoe.models.effects.effect import Arm
from smartshoe.models.extended import ExtendedModel

Array = NDArray[np.float64]

POLES_PER_S = np.geomspace(0.01, 20.0, 31)
LARGEST_SHARE = 5.0  # no wall relaxes by more: what looks like it is a lag or a permanent set
LEAST_SHARE = 1e-3  # of the load that relaxes: below it the pole means nothing


def global_baseline(sessions: Sequence[Session], scale: Scale, delay_s: float = 0.0) -> ExtendedModel:
    """Gain, relaxing share and rate with the least squared error: linear in two numbers for each pole of a grid.

    ``delay_s`` is by how much the readings are late.
    y = c (f - w) + d w with w = pole/(s + pole) f; the wall is passive where d >= c > 0 (the pressure creeps up).
    """
    kept = [session.fitted for session in sessions]
    reading = np.concatenate([s.reading[k] for s, k in zip(sessions, kept, strict=True)])
    loads = [_late(s.conditions.load, delay_s / s.conditions.step_s) for s in sessions]
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
        best = 0.0, gain / (1.0 + LEAST_SHARE), gain, 0.2
    _, fast, slow, pole = best
    share = slow / fast - 1.0
    return ExtendedModel(
        slow,
        share,
        pole * (1.0 + share),
        scale.load_n,
        scale.reading,
        scale.unit.symbol,
        (),
        _wall_ratio(sessions, slow, scale),
    )


def _late(load: Array, steps: float) -> Array:
    """The load as it was ``steps`` before; the first one lasted for ever."""
    if steps == 0.0:
        return load
    place = np.arange(load.size)
    return np.asarray(np.interp(place - steps, place, load), dtype=np.float64)


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
