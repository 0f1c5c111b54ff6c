"""A load in coarse steps: drawn between its levels through the moments at which it goes from one level to the next.

A load that was logged on a coarse grid is known exactly at one kind of moment: when it leaves a level for the next, it
lies half-way between both.
"""

from __future__ import annotations

import numpy as np

from smartshoe.arrays import Array, Index
from smartshoe.display import percent
from smartshoe.integrity._fault import Finding
from smartshoe.integrity._scales import ROUNDING
from smartshoe.integrity._view import Signal
from smartshoe.integrity.thresholds import Thresholds
from smartshoe.recording import Recording
from smartshoe.signals.noise import UNIFORM_SD


def between_steps(recording: Recording, thresholds: Thresholds) -> tuple[Recording, list[Finding]]:
    """The recording with its load drawn through the edges of its steps, and kind ``quantisation``, if these are coarse.

    Left as it was logged is a load whose rounding error is not material or is hidden by its own noise, which takes the
    grid out in the mean; and one that jumps from level to level, as weights do, since the reading then stands with it.
    Where the load stands it is known to half a step only, an error of the input that no model takes out.
    """
    if len(recording.of_role("load")) != 1 or len(recording.sensors) != 1:
        return recording, []
    channel = recording.load
    present = np.flatnonzero(channel.present & recording.sensor.present)
    signal, span = (
        Signal(channel.values[present], thresholds),
        float(np.ptp(channel.values[present])) if present.size else 0.0,
    )
    error = UNIFORM_SD * signal.step
    if error <= thresholds.material * span or signal.quiet_noise**2 >= 2.0 * error**2:
        return recording, []
    logged = _one_value_a_level(signal.values, signal.step)
    if np.max(np.abs(logged - signal.values)) > ROUNDING * np.max(np.abs(logged)):
        return recording, []  # values between the levels were not logged in steps, as on a slow ramp beside quick ones
    load = _through_edges(recording.time_s[present], logged, signal.step)
    gain = _gain(logged, load, recording.sensor.values[present])
    if gain is None:
        return recording, []
    values = channel.with_nan().copy()
    values[present] = load
    return recording.with_channel(channel.with_values(values)), [
        Finding(
            "quantisation",
            np.ones(len(recording), dtype=bool),
            f"the load is quantised in steps of {signal.step:.4g} {channel.unit.symbol},"
            f" {percent(signal.step / span)} of its span: between the moments at which it changes step it was"
            f" interpolated; where it stands it is known to half a step only, an rms error of {percent(error / span)}",
            error=gain * error,
        )
    ]


def _one_value_a_level(values: Array, step: float) -> Array:
    """(n,) ``values`` on a grid, all of one level equal: a difference by rounding is no change of the level."""
    _, first, level = np.unique(np.rint((values - values.min()) / step), return_index=True, return_inverse=True)
    return np.asarray(values[first][level])


def _through_edges(time_s: Array, logged: Array, step: float) -> Array:
    """(n,) a load that lies on the edge between two steps when it changes, within half a ``step`` of that ``logged``.

    1. An edge lies half-way between two levels, and half-way in time between the samples on either side of it.
    2. Between edges on opposite sides of a level the load goes from one edge to the other.
    3. From an edge it goes on at its rate beyond that edge, up to the middle of the step (`_reach_s`). There it stays,
       since nothing tells more of a load that stands or turns within a step.
    """
    changes = np.flatnonzero(np.diff(logged))
    if changes.size < 2:
        return logged
    edge, edge_s = (0.5 * (one[changes] + one[changes + 1]) for one in (logged, time_s))
    visits = np.searchsorted(changes, np.arange(logged.size))  # by sample, the number of edges before it
    rate = np.abs(np.diff(edge)) / np.diff(edge_s)
    drawn = logged.copy()
    for_left, for_right = _reach_s(logged, changes, edge, edge_s, rate)
    left, right = np.maximum(visits - 1, 0), np.minimum(visits, changes.size - 1)
    has_left, has_right = visits > 0, visits < changes.size
    from_left = np.where(has_left, 1.0 - (time_s - edge_s[left]) / for_left[left], 0.0)
    from_right = np.where(has_right, 1.0 - (edge_s[right] - time_s) / for_right[right], 0.0)
    by_left = (edge[left] - logged) * np.maximum(from_left, 0.0)
    by_right = (edge[right] - logged) * np.maximum(from_right, 0.0)
    is_same_side = has_left & has_right & ((edge[left] > logged) == (edge[right] > logged))
    drawn += np.where(is_same_side, np.where(np.abs(by_left) > np.abs(by_right), by_left, by_right), by_left + by_right)
    return np.clip(drawn, logged - 0.5 * step, logged + 0.5 * step)


def _reach_s(logged: Array, changes: Index, edge: Array, edge_s: Array, rate: Array) -> tuple[Array, Array]:
    """(c,) each, in s: how long the load takes from each edge to the middle of the step after it, and that before it.

    It goes at its rate on the other side of the edge. Where there is no rate, as where noise toggles at an edge, it
    takes as long as from the edge at the other end of the step. A step that is too short for both shares its time
    between them.
    """
    with np.errstate(divide="ignore"):
        after = np.abs(logged[changes + 1] - edge) / np.append(0.0, rate)
        before = np.abs(logged[changes] - edge) / np.append(rate, 0.0)
    goes_through, duration_s = edge[1:] != edge[:-1], np.diff(edge_s)
    most = np.where(goes_through, duration_s, np.inf)
    from_begin, from_end = after[:-1], before[1:]
    from_begin, from_end = (
        np.minimum(np.where(np.isinf(a), b, a), most) for a, b in ((from_begin, from_end), (from_end, from_begin))
    )
    share = np.where(goes_through, 1.0 / np.maximum((from_begin + from_end) / duration_s, 1.0), 1.0)
    after[:-1], before[1:] = share * from_begin, share * from_end
    return after, before


def _gain(logged: Array, between: Array, reading: Array) -> float | None:
    """Size of the reading's gain per load, where the reading moves with the load within steps; None where it stands.

    ``logged``, ``between``, ``reading`` (n,): the load as logged, as drawn between its steps, and the reading. Only
    steps that the load goes through count, up or down: in others it may have stood. A load that was sampled once on
    each level moves within none of them, as a commanded ramp.
    """
    gain = float(np.polyfit(logged, reading, 1)[0])
    is_new = np.diff(logged, prepend=np.nan) != 0.0
    direction = np.sign(np.diff(logged[is_new]))
    goes_through = np.concatenate([[False], direction[1:] == direction[:-1], [False]])
    visits = np.cumsum(is_new) - 1
    moved, read_moved = (_within(one, visits) * goes_through[visits] for one in (between - logged, reading))
    if np.max(np.abs(moved)) <= ROUNDING * np.max(np.abs(logged)):
        return None
    return abs(gain) if gain != 0.0 and 2.0 * float(moved @ read_moved) / gain > float(moved @ moved) else None


def _within(values: Array, visits: Index) -> Array:
    """(n,) ``values`` (n,) less their mean over each of the ``visits`` (n,) to a level."""
    return np.asarray(values - (np.bincount(visits, values) / np.bincount(visits))[visits])
