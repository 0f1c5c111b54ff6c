"""Recordings of one unit whose readings follow by different lags, each too short to be told from the unit by itself.

Any unit may answer a tenth of a second late, but it does so in all of its recordings. What it makes of its load is
learnt from the others; a recording that it foretells far better at another moment was logged by other clocks.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from smartshoe.arrays import Array, Mask
from smartshoe.integrity._clocks import Lags, binned, made_of
from smartshoe.integrity._scales import five_point_median
from smartshoe.integrity.thresholds import Thresholds
from smartshoe.kernels.blas import on_one_thread
from smartshoe.recording import Recording

STEPS = 4  # of Gauss and Newton: a lag within what the smoothing spans is found in two


@on_one_thread
def apart_s(
    recordings: Sequence[Recording], usable: Sequence[Mask], lags: Sequence[Lags], thresholds: Thresholds
) -> dict[int, float]:
    """By place, how much later the reading of a recording follows than those of the others.

    The longest lag of its own comes first, since of two recordings either may be the late one: each is foretold by all
    others, on the clocks that are told by then.
    """
    of_use = [place for place, mask in enumerate(usable) if mask.sum() >= thresholds.least_samples]
    if len(of_use) < 2:
        return {}
    step_s = max(thresholds.echo_s / thresholds.clear, max(recordings[k].duration_s for k in of_use) / thresholds.bins)
    loads = [recordings[place].force_n[usable[place]] for place in of_use]
    ends_n = min(float(one.min()) for one in loads), max(float(one.max()) for one in loads)
    if ends_n[0] == ends_n[1]:
        return {}
    runs = {place: _run(recordings[place], usable[place], step_s, ends_n, thresholds) for place in of_use}
    foretelling = _of_others([*runs.values()])
    found = {place: _later_s(runs[place], one, thresholds) for place, one in zip(of_use, foretelling, strict=True)}
    own = {place: abs(lags[place].middle_s) if lags[place].at_s.size else 0.0 for place in of_use}
    told: dict[int, float] = {}
    for place in sorted((k for k in of_use if found[k]), key=lambda k: (-own[k], -abs(found[k]))):
        others = sum(one.products for other, one in runs.items() if other != place)
        lag_s = _later_s(runs[place], np.asarray(others), thresholds)
        if lag_s and len(told) + 1 < len(runs):
            told[place] = lag_s
            runs[place] = runs[place].earlier(lag_s)
    return told


@dataclass(frozen=True, eq=False)
class _Run:
    """A recording over even bins at ``grid`` (b,): increments of what a unit may make of its load, ``made`` (b, k).

    And of its reading, ``read`` (b,). ``least_s``: a shorter lag may be the delay of a logger.
    """

    grid: Array
    made: Array
    read: Array
    least_s: float

    @cached_property
    def products(self) -> Array:
        """(k, k + 1) inner products of what is made of the load, with itself and with the reading."""
        return np.asarray(self.made.T @ np.column_stack([self.made, self.read]))

    def earlier(self, by_s: float) -> _Run:
        """The same with its reading earlier."""
        return replace(self, read=np.interp(self.grid + by_s, self.grid, self.read))


def _run(
    recording: Recording, usable: Mask, step_s: float, ends_n: tuple[float, float], thresholds: Thresholds
) -> _Run:
    from scipy.ndimage import gaussian_filter1d

    time_s = recording.time_s[usable]
    grid = np.arange(time_s[0] + 0.5 * step_s, time_s[-1], step_s)
    load, reading = (
        binned(time_s, five_point_median(one[usable]), grid, step_s) for one in (recording.force_n, recording.sensor.si)
    )
    smooth = max(thresholds.echo_s / step_s, 1.0)
    made = made_of((load - ends_n[0]) / (ends_n[1] - ends_n[0]), step_s, smooth, thresholds)
    return _Run(grid, made, gaussian_filter1d(reading, smooth, order=1), thresholds.few * recording.sample_time_s)


def _of_others(runs: Sequence[_Run]) -> list[Array]:
    """For each of them the sum of all others' products: of those before it and of those after it."""
    products = np.array([one.products for one in runs])
    nothing = np.zeros_like(products[:1])
    before = np.concatenate([nothing, np.cumsum(products[:-1], axis=0)])
    after = np.concatenate([np.cumsum(products[:0:-1], axis=0)[::-1], nothing])
    return [*(before + after)]


def _later_s(run: _Run, others: Array, thresholds: Thresholds) -> float:
    """How much later one reading follows than the ``others``, by their products, foretell.

    0 where it is not foretold far better so, at rising and at falling edges alike: load that the unit remembers has a
    lag for each direction.
    """
    foretold = run.made @ _weights(others)
    rises = (run.made[:, 0] > 0.0).astype(float)
    lag_s, step_s = 0.0, float(run.grid[1] - run.grid[0])
    for _ in range(STEPS):
        shifted = np.interp(run.grid - lag_s, run.grid, foretold)
        slope = -np.gradient(shifted, step_s)
        lag_s += float(slope @ (run.read - shifted)) / max(float(slope @ slope), 1e-300)
        if abs(lag_s) > thresholds.settled_s:
            return 0.0

    def left(late_s: float) -> Array:
        off = run.read - np.interp(run.grid - late_s, run.grid, foretold)
        up = np.interp(run.grid - late_s, run.grid, rises)
        return np.array([np.sum(up * off**2), np.sum((1.0 - up) * off**2)])

    is_foretold = np.all(thresholds.clear * left(lag_s) <= left(0.0))
    return lag_s if is_foretold and abs(lag_s) > run.least_s else 0.0


def _weights(products: Array) -> Array:
    """(k,) of what a unit may make of its load, by least squares."""
    normal, pulled = products[:, :-1], products[:, -1]
    size = np.sqrt(np.diag(normal)) + 1e-300
    normal = normal / size / size[:, None]  # one by one: a play that never moves is all noughts
    normal[np.diag_indices_from(normal)] += 1e-6
    return np.asarray(np.linalg.solve(normal, pulled / size) / size)
