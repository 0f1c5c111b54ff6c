"""Quantisation: a grid of values that is coarse beside the signal and beside its noise."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from smartshoe.arrays import Mask
from smartshoe.integrity._fault import Finding
from smartshoe.integrity._view import View
from smartshoe.signals.masks import runs_of

# A grid of step q adds an error of q/sqrt(12). It is a fault where that is at least 0.03 % of the reading's span
# (beside a diagnosis's materiality of 0.02 %) and at least a quarter of the noise that is there without it: below, the
# noise dithers the grid and hides it.
MATERIAL_SHARE = 0.0003
BESIDE_NOISE = 0.25
LEAST_RUNS = 10
MOVED = 0.4  # of a step


def quantisation(view: View, bad: Mask) -> Iterator[Finding]:
    """Kind ``quantisation``; nothing is masked, since every sample has it."""
    step = view.reading.step
    if step == 0.0 or view.span == 0.0:
        return
    if not _stands_while_load_moves(view, step):
        return
    error = step / np.sqrt(12.0)
    noise = float(np.sqrt(max(view.reading.quiet_noise**2 - error**2, 0.0)))
    if error < MATERIAL_SHARE * view.span or error < BESIDE_NOISE * noise:
        return
    yield Finding(
        "quantisation",
        np.ones(len(view.recording), dtype=bool),
        f"the reading lies on a lattice of {step:.4g} {view.recording.sensor.unit.symbol},"
        f" {100 * step / view.span:.2g} % of its span: an error of {100 * error / view.span:.2g} % that noise does not"
        " smooth away",
    )


def _stands_while_load_moves(view: View, step: float) -> bool:
    """Whether a reading stays on a level while the load goes on; a noiseless reading of a load in steps does not."""
    starts, stops = runs_of(np.diff(view.reading.values) == 0.0)
    moved = view.gain * np.abs(view.steady_load[stops] - view.steady_load[starts])
    return int((moved > MOVED * step).sum()) >= LEAST_RUNS
