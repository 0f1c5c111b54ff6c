"""Spikes: one or two samples far from their neighbours on both sides, on the reading or on the load."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from smartshoe.diagnosis.integrity.fault import Array, Finding, Mask
from smartshoe.diagnosis.integrity.scales import local_scale, own_corner
from smartshoe.diagnosis.integrity.view import Signal, View

NOISES = 6.5  # the largest of 1e6 normal deviates reaches 5.1 of this scale
STEPS = 2.0  # of a lattice
CORNERS = 4.0  # of what the other channel's corner explains
LEAST_SHARE = 0.0005  # of the span


def isolated(signal: Signal, corner: Array, scale: float, span: float, near: int) -> Mask:
    """(m,) samples off their five-point median by more than noise, lattice, own corners and the other channel's.

    ``corner`` (m,) is the other channel's `View.load_corner`; ``scale`` turns its unit into this signal's.
    A step, a ramp and the foot of a ramp leave their median alone; the tip of a triangle has its corner in both.
    """
    # Noise that a filter has smoothed has small second differences: then the residual's own scale is the larger.
    noise = np.maximum(signal.noise, local_scale(signal.outlying, signal.step))
    allowed = NOISES * noise + STEPS * signal.step + CORNERS * scale * corner + LEAST_SHARE * span
    allowed += own_corner(signal.values, near)
    out: Mask = np.abs(signal.outlying) > allowed
    return out


def isolated_beside(view: View, bad: Mask) -> Mask:
    """(m,) isolated readings of what is left when ``bad`` ones are cut out: a good one between two of them is none."""
    good = ~bad
    reading = Signal(view.reading.values[good]) if bad.any() else view.reading
    found = np.zeros(bad.size, dtype=bool)
    if good.any():
        found[good] = isolated(reading, view.load_corner[good], view.gain, view.span, view.near)
    return found


def spikes(view: View, bad: Mask) -> Iterator[Finding]:
    """Kind ``spikes``; masked. One finding for the reading, one for the reference load."""
    if view.span == 0.0 or view.gain == 0.0:
        return
    found = isolated_beside(view, bad)
    if found.any():
        yield _finding(view, found, view.reading, view.span, "reading")
    load_gain = view.load_span / view.span
    on_load = isolated(view.load, view.reading_corner, 2.0 * load_gain, view.load_span, view.near)
    if on_load.any():
        yield _finding(view, on_load, view.load, view.load_span, "reference load")


def _finding(view: View, at: Mask, signal: Signal, span: float, what: str) -> Finding:
    size = np.abs(signal.outlying[at])
    return Finding(
        "spikes",
        view.whole(at),
        f"the {what} has {int(at.sum())} isolated spikes of {100 * float(np.median(size)) / span:.2g} % of its span"
        f" (the largest {100 * float(size.max()) / span:.2g} %): they are left out",
        masks=True,
    )
