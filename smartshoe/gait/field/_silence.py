"""Finds units that do not respond: stuck, on a rail, without samples, or dead while their neighbours move."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from smartshoe.arrays import Array, Index, Mask
from smartshoe.errors import UsageError
from smartshoe.gait.field._finding import CheckResult
from smartshoe.signals.masks import runs_of
from smartshoe.signals.noise import white_noise_sd

UP, DOWN = 0.6, 0.4  # of a unit's own rise: a press begins when the reading goes above UP after having been below DOWN
MOVES = 10.0  # times the noise: a unit with a smaller rise is not pressed
CYCLES = 3  # presses of the neighbours that a unit may miss; a toe does not bear load in every shuffling step
DEAD = 0.03  # of the neighbours' rise, each relative to its own full scale
GAP_S = 0.5  # shorter gaps are losses of the radio; three presses take longer as well
RAIL_RUN = 3  # samples in a row at the largest value
RAIL_SHARE = 0.001


def check_units(
    time_s: ArrayLike,
    readings: ArrayLike,
    names: Sequence[str],
    *,
    full_scale: ArrayLike,
    range_high: ArrayLike | None = None,
) -> tuple[CheckResult, ...]:
    """Faults of units in ``readings`` (n, units), NaN where a sample is missing; an empty tuple if all units respond.

    Kinds: ``no_samples`` (a gap of half a second or more), ``stuck`` (one constant value while the neighbours are
    pressed three times), ``dead`` (noise, but no response to the same), ``saturated`` (at ``range_high``, or repeatedly
    at its largest value). ``full_scale`` (a number or (units,)) makes units of different ranges comparable. ``stuck``
    and ``dead`` can only be found if a neighbour moves.
    """
    time, values = np.asarray(time_s, dtype=float), np.asarray(readings, dtype=float)
    if values.ndim != 2 or values.shape != (time.size, len(names)):
        raise UsageError(f"readings are of shape {values.shape}: give ({time.size}, {len(names)})")
    scale = np.broadcast_to(np.asarray(full_scale, dtype=float), (len(names),))
    high = None if range_high is None else np.broadcast_to(np.asarray(range_high, dtype=float), (len(names),))
    there = np.isfinite(values)
    filled = _held(values, there)
    rises = np.array([_rise(filled[:, k]) for k in range(len(names))])
    moves = np.array([rises[k] > MOVES * white_noise_sd(filled[:, k]) and rises[k] > 0.0 for k in range(len(names))])
    presses = [_presses(filled[:, k], rises[k]) if moves[k] else np.empty(0, dtype=np.intp) for k in range(len(names))]
    found: list[CheckResult] = []
    for k, name in enumerate(names):
        found += _gaps(time, there[:, k], name)
        others = [j for j in range(len(names)) if j != k and moves[j] and presses[j].size >= CYCLES]
        if there[:, k].any() and others:
            found += _stuck_or_dead(time, filled[:, k], name, rises, scale, k, others, presses)
        if there[:, k].any():
            found += _saturated(time, filled[:, k], name, None if high is None else float(high[k]), rises[k])
    return tuple(found)


def _held(values: Array, there: Mask) -> Array:
    """The values with missing samples replaced by the last present one, or the first at the start."""
    index = np.maximum.accumulate(np.where(there, np.arange(values.shape[0])[:, None], -1), axis=0)
    first = np.argmax(there, axis=0)
    held = np.take_along_axis(values, np.where(index < 0, first[None, :], index), axis=0)
    return np.where(np.isfinite(held), held, 0.0)


def _rise(values: Array) -> float:
    """The range of a unit's readings, from the 2nd to the 98th percentile."""
    low, high = np.quantile(values, (0.02, 0.98))
    return float(high - low)


def _presses(values: Array, rise: float) -> Index:
    """The samples at which a new press of the unit begins."""
    low = float(np.quantile(values, 0.02))
    index = np.arange(values.size)
    up = np.maximum.accumulate(np.where(values > low + UP * rise, index, -1))
    down = np.maximum.accumulate(np.where(values < low + DOWN * rise, index, -1))
    return np.flatnonzero(np.diff((up > down).astype(np.int8)) == 1) + 1


def _runs(at: Mask) -> list[tuple[int, int]]:
    """First and last index of each run of True."""
    first, after = runs_of(at)
    return list(zip(first.tolist(), (after - 1).tolist(), strict=True))


def _gaps(time: Array, there: Mask, name: str) -> list[CheckResult]:
    """A finding if samples are missing for `GAP_S` or longer."""
    long = [(a, b) for a, b in _runs(~there) if time[min(b + 1, time.size - 1)] - time[a] >= GAP_S]
    if not long:
        return []
    total = sum(float(time[min(b + 1, time.size - 1)] - time[a]) for a, b in long)
    says = f"{name} sent nothing for {total:.3g} s in {len(long)} gaps: look at its cable and the radio"
    return [
        CheckResult(
            "no_samples", "fault", says, name, (float(time[long[0][0]]), float(time[long[-1][1]])), {"gap_s": total}
        )
    ]


def _stuck_or_dead(
    time: Array, values: Array, name: str, rises: Array, scale: Array, k: int, others: list[int],
    presses: list[Index],
) -> list[CheckResult]:  # fmt: skip
    """A finding if unit ``k`` is constant, or hardly responds, while ``others`` are pressed repeatedly."""

    def sat_out(first: int, last: int) -> int:
        return int(np.median([np.count_nonzero((presses[j] > first) & (presses[j] <= last)) for j in others]))

    held = [(a, b + 1) for a, b in _runs(np.diff(values) == 0.0) if time[b + 1] - time[a] >= GAP_S]
    stuck = [(a, b) for a, b in held if sat_out(a, b) >= CYCLES]
    if stuck:
        a, b = max(stuck, key=lambda run: run[1] - run[0])
        missed = sat_out(a, b)
        says = (
            f"{name} is stuck at {values[a]:.4g} from {time[a]:.3g} to {time[b]:.3g} s while its neighbours are pressed"
            f" {missed} times: look at its sensor"
        )
        return [
            CheckResult("stuck", "fault", says, name, (float(time[a]), float(time[b])), {"value": float(values[a])})
        ]
    usual = float(np.median([rises[j] / scale[j] for j in others]))
    if rises[k] / scale[k] < DEAD * usual:
        missed = sat_out(0, values.size - 1)
        says = (
            f"{name} answers with {100 * rises[k] / scale[k] / usual:.2g} % of what its neighbours do, over {missed}"
            " presses: look for a leak or a tube that came off"
        )
        return [CheckResult("dead", "fault", says, name, (float(time[0]), float(time[-1])), {"rise": float(rises[k])})]
    return []


def _saturated(time: Array, values: Array, name: str, high: float | None, rise: float) -> list[CheckResult]:
    """A finding if the readings reach their largest value again and again, or for long."""
    top = float(values.max())
    if rise <= 0.0 or (high is not None and top < 0.995 * high):
        return []
    runs = [(a, b) for a, b in _runs(values == top) if b - a + 1 >= RAIL_RUN]
    share = sum(b - a + 1 for a, b in runs) / values.size
    # One flat top may be chance or quantisation; a rail is reached repeatedly, or for long.
    if share < RAIL_SHARE or (high is None and len(runs) < CYCLES):
        return []
    says = (
        f"{name} stands on its largest reading {top:.4g} in {100 * share:.2g} % of the samples: what is above is not"
        " measured"
    )
    return [
        CheckResult(
            "saturated", "warning", says, name, (float(time[runs[0][0]]), float(time[runs[-1][1]])), {"share": share}
        )
    ]
