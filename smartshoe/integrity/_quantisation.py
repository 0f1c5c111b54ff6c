"""Quantisation: a grid of values that is coarse beside the signal and beside its noise."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from smartshoe.arrays import Array, Mask
from smartshoe.display import percent
from smartshoe.integrity._fault import Finding
from smartshoe.integrity._view import Signal, View
from smartshoe.integrity.thresholds import Thresholds
from smartshoe.signals.masks import runs_of
from smartshoe.signals.noise import UNIFORM_SD


def coarse_step(values: Array, thresholds: Thresholds) -> float:
    """The usual step of the grid that readings (n,) lie on; 0 where there is none, or noise takes it out in the mean.

    Whatever the load does: also where that stands still, and the reading's standing is no fault of its grid.
    """
    if not values.size:
        return 0.0
    reading = Signal(values, thresholds)
    usual = _usual(reading.local_step, thresholds)
    return 0.0 if _is_hidden(UNIFORM_SD * usual, reading) else usual


def _usual(step: Array, thresholds: Thresholds) -> float:
    """The median of steps (n,), 0 where too few readings lie on a grid.

    Beyond what is often read the distance between neighbours is no step.
    """
    on_grid = step > 0.0
    return float(np.median(step[on_grid])) if on_grid.mean() >= 1.0 - thresholds.same else 0.0


def quantisation(view: View, bad: Mask) -> Iterator[Finding]:
    """Kind ``quantisation``; nothing is masked, since every sample has it.

    A grid adds an error. It is a fault where that is material, and no noise hides it.
    """
    usual = _usual(view.reading.local_step, view.thresholds)
    if usual == 0.0 or view.span == 0.0 or not _stands_while_load_moves(view):
        return
    error = UNIFORM_SD * usual
    if error < view.thresholds.material * view.span or _is_hidden(error, view.reading):
        return
    yield Finding(
        "quantisation",
        np.ones(len(view.recording), dtype=bool),
        f"the reading is quantised in steps of {usual:.4g} {view.recording.sensor.unit.symbol},"
        f" {percent(usual / view.span)} of its span: an rms error of {percent(error / view.span)} that averaging"
        " does not remove",
        error=error,
    )


def _is_hidden(error: float, reading: Signal) -> bool:
    """Whether an ``error`` is less than the share of the noise by which two noises count as the same.

    More noise dithers the grid and hides it.
    """
    noise = float(np.sqrt(max(reading.quiet_noise**2 - error**2, 0.0)))
    return error < reading.thresholds.same * noise


def _stands_while_load_moves(view: View) -> bool:
    """Whether a reading stays on a level while the load goes on; a noiseless reading of a load in steps does not."""
    starts, stops = runs_of(np.diff(view.reading.values) == 0.0)
    moved = view.gain * np.abs(view.steady_load[stops] - view.steady_load[starts])
    is_beyond = moved > view.thresholds.same * view.reading.local_step[starts]
    return int(is_beyond.sum()) >= view.thresholds.clear * view.thresholds.few
