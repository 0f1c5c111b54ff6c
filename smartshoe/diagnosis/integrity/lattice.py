"""Quantisation: a lattice of values that is coarse beside the signal and beside its noise."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from smartshoe.diagnosis.integrity.fault import Finding, Mask
from smartshoe.diagnosis.integrity.view import View

# A lattice of step q adds an error of q/sqrt(12). It is a fault where that is at least 0.03 % of the reading's span
# (beside a diagnosis's materiality of 0.02 %) and at least a quarter of the noise that is there without it: below, the
# noise dithers the lattice and hides it.
MATERIAL_SHARE = 0.0003
BESIDE_NOISE = 0.25
LEAST_MOVES, LEAST_SHARE = 20, 0.02  # of moves by a single step


def quantisation(view: View, bad: Mask) -> Iterator[Finding]:
    """Kind ``quantisation``; nothing is masked, since every sample has it."""
    step = view.reading.step
    if step == 0.0 or view.span == 0.0:
        return
    moves = np.rint(np.abs(np.diff(view.reading.values)) / step)
    if int((moves == 1.0).sum()) < max(LEAST_MOVES, LEAST_SHARE * int((moves > 0.0).sum())):
        return  # a noiseless reading of a load in steps has a few levels, and leaps between them
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
