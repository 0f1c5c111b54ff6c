"""A load in coarse steps: put back between them, as far as the moments tell at which it goes from one to the next."""

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
    """The recording with its load drawn through the edges of its steps, and kind ``quantisation``, where it is coarse.

    The load is known where it goes from step to step, and where it stands to half a step: an error of what goes in,
    which no model takes out. Where it is less than the load's noise, that takes the grid out in the mean; a load that
    jumps from step to step, as weights do, is no coarser than it is logged: the reading stands with it.
    """
    if len(recording.of_role("load")) != 1 or len(recording.sensors) != 1:
        return recording, []
    channel = recording.load
    there = np.flatnonzero(channel.present & recording.sensor.present)
    signal, span = (
        Signal(channel.values[there], thresholds),
        float(np.ptp(channel.values[there])) if there.size else 0.0,
    )
    error = UNIFORM_SD * signal.step
    if error <= thresholds.material * span or signal.quiet_noise**2 >= 2.0 * error**2:
        return recording, []
    logged = _one_value_a_level(signal.values, signal.step)
    if np.max(np.abs(logged - signal.values)) > ROUNDING * np.max(np.abs(logged)):
        return recording, []  # what lies between levels was not logged in steps, as of a slow ramp beside quick ones
    load = _through_edges(recording.time_s[there], logged, signal.step)
    gain = _gain(logged, load, recording.sensor.values[there])
    if gain is None:
        return recording, []
    values = channel.with_nan().copy()
    values[there] = load
    return recording.with_channel(channel.with_values(values)), [
        Finding(
            "quantisation",
            np.ones(len(recording), dtype=bool),
            f"the load is quantised in steps of {signal.step:.4g} {channel.unit.symbol},"
            f" {percent(signal.step / span)} of its span: it was drawn through the moments at which it goes from one"
            f" to the next, and is known to half a step where it stands, an rms error of {percent(error / span)}",
            error=gain * error,
        )
    ]


def _one_value_a_level(values: Array, step: float) -> Array:
    """(n,) values on a grid, all of one level equal: what differs by rounding is no change from one to the next."""
    _, first, place = np.unique(np.rint((values - values.min()) / step), return_index=True, return_inverse=True)
    return np.asarray(values[first][place])


def _through_edges(time_s: Array, logged: Array, step: float) -> Array:
    """(n,) a load that lies at a step's edge as it leaves for the next, half a ``step`` about the ``logged`` one.

    Between two edges on opposite sides it goes from one to the other; at either it goes on as it did beyond, up to the
    middle of the step, where nothing tells more: a load that stands lies there, and one that turns half-way, half-way.
    """
    changes = np.flatnonzero(np.diff(logged))
    if changes.size < 2:
        return logged
    edge, edge_s = (0.5 * (one[changes] + one[changes + 1]) for one in (logged, time_s))
    visit = np.searchsorted(changes, np.arange(logged.size))  # which of the stretches between edges
    rate = np.abs(np.diff(edge)) / np.diff(edge_s)
    out = logged.copy()
    for_left, for_right = _reach_s(logged, changes, edge, edge_s, rate)
    left, right = np.maximum(visit - 1, 0), np.minimum(visit, changes.size - 1)
    has_left, has_right = visit > 0, visit < changes.size
    from_left = np.where(has_left, 1.0 - (time_s - edge_s[left]) / for_left[left], 0.0)
    from_right = np.where(has_right, 1.0 - (edge_s[right] - time_s) / for_right[right], 0.0)
    below = (edge[left] - logged) * np.maximum(from_left, 0.0)
    above = (edge[right] - logged) * np.maximum(from_right, 0.0)
    same_side = has_left & has_right & ((edge[left] > logged) == (edge[right] > logged))
    out += np.where(same_side, np.where(np.abs(below) > np.abs(above), below, above), below + above)
    return np.clip(out, logged - 0.5 * step, logged + 0.5 * step)


def _reach_s(logged: Array, changes: Index, edge: Array, edge_s: Array, rate: Array) -> tuple[Array, Array]:
    """(c,) each: how long it takes from each edge to the middle of the step that follows, and of the one before.

    At the rate on the edge's other side. Where there is none, as of noise at an edge, it takes as long as at the other
    end of the stretch; a stretch that is too short for both is shared by them.
    """
    with np.errstate(divide="ignore"):
        after = np.abs(logged[changes + 1] - edge) / np.append(0.0, rate)
        before = np.abs(logged[changes] - edge) / np.append(rate, 0.0)
    goes_through, lasts = edge[1:] != edge[:-1], np.diff(edge_s)
    most = np.where(goes_through, lasts, np.inf)
    begin, end = after[:-1], before[1:]
    begin, end = (np.minimum(np.where(np.isinf(a), b, a), most) for a, b in ((begin, end), (end, begin)))
    share = np.where(goes_through, 1.0 / np.maximum((begin + end) / lasts, 1.0), 1.0)
    after[:-1], before[1:] = share * begin, share * end
    return after, before


def _gain(logged: Array, between: Array, reading: Array) -> float | None:
    """Reading per load, where the reading goes with the load ``between`` steps, (n,) each; None where it stands.

    By the steps that the load goes through, up or down: at others it may have stood. A load that is sampled once on
    each of them, as a commanded ramp, moves within none: what is left of it there is rounding.
    """
    gain = float(np.polyfit(logged, reading, 1)[0])
    is_new = np.diff(logged, prepend=np.nan) != 0.0
    way = np.sign(np.diff(logged[is_new]))
    through = np.concatenate([[False], way[1:] == way[:-1], [False]])
    visit = np.cumsum(is_new) - 1
    moved, read = (_within(one, visit) * through[visit] for one in (between - logged, reading))
    if np.max(np.abs(moved)) <= ROUNDING * np.max(np.abs(logged)):
        return None
    return abs(gain) if gain != 0.0 and 2.0 * float(moved @ read) / gain > float(moved @ moved) else None


def _within(values: Array, visit: Index) -> Array:
    """(n,) values about their mean over each visit of a step."""
    return np.asarray(values - (np.bincount(visit, values) / np.bincount(visit))[visit])
