"""Quantisation: readings lie on a grid that is coarse beside the signal and beside its noise."""

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
    """The usual step of the grid on which readings ``values`` (n,) lie; 0 without a grid, or if noise averages it out.

    The load does not matter: readings that stand with their load count as well.
    """
    if not values.size:
        return 0.0
    reading = Signal(values, thresholds)
    usual = _usual(reading.local_step, thresholds)
    return 0.0 if _is_hidden(UNIFORM_SD * usual, reading) else usual


def _usual(step: Array, thresholds: Thresholds) -> float:
    """The median of local grid steps ``step`` (n,); 0 where too few readings lie on a grid.

    Of values that are seldom read the distance between neighbours is no step.
    """
    on_grid = step > 0.0
    return float(np.median(step[on_grid])) if on_grid.mean() >= 1.0 - thresholds.same else 0.0


def quantisation(view: View, bad: Mask) -> Iterator[Finding]:
    """Kind ``quantisation``. None is masked, since every sample has it.

    It is a fault where the grid's rounding error is material and no noise averages it out.
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
    """Whether a rounding ``error`` is less than a share (`same`) of the reading noise, which averages a grid out."""
    noise = float(np.sqrt(max(reading.quiet_noise**2 - error**2, 0.0)))
    return error < reading.thresholds.same * noise


def _stands_while_load_moves(view: View) -> bool:
    """Whether the reading stays on levels of the grid while the load goes on.

    The reading of a load in steps, without noise, stands as well, but with its load.
    """
    starts, stops = runs_of(np.diff(view.reading.values) == 0.0)
    moved = view.gain * np.abs(view.steady_load[stops] - view.steady_load[starts])
    is_beyond = moved > view.thresholds.same * view.reading.local_step[starts]
    return int(is_beyond.sum()) >= view.thresholds.clear * view.thresholds.few
