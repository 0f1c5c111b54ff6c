"""What the range of the load allows: a gain seen over a narrow range, or within files only, is a trap."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from smartshoe.diagnosis.session import Scale, Session

Array = NDArray[np.float64]

NARROW = 0.6  # of the largest load: a lowest load above it leaves a narrow range
FAR_FROM_ZERO = 2.0  # times that the gain within a narrow range and reading over load differ: a line far past zero
GAINS_DIFFER = 1.3  # times
APART = 0.2  # of the largest load, between the means of two files, for a gain between files
FOLLOWS = 0.5  # correlation within a file, below which it has no gain of its own


@dataclass(frozen=True, slots=True)
class Ranges:
    """Sentences, and whether the gain is a trap: no name can be trusted then."""

    says: tuple[str, ...] = ()
    is_trap: bool = False


def ranges_of(sessions: Sequence[Session], scale: Scale) -> Ranges:
    """A sentence for each thing that the loads' range does not allow to be said."""
    said: list[str] = []
    kept = [(s.conditions.load[s.usable], s.reading[s.usable]) for s in sessions if s.usable.sum() > 10]
    if not kept:
        return Ranges()
    trap = False
    unit = scale.unit.symbol
    to_physical = scale.reading / scale.load_n
    within = [_gain(load, reading) for load, reading in kept]
    narrow = [k for k, (load, _) in enumerate(kept) if float(np.quantile(load, 0.01)) > NARROW * float(load.max())]
    if len(narrow) == len(kept) and all(gain is not None for gain in within):
        gain = float(np.median([gain for gain in within if gain is not None]))
        load, reading = kept[narrow[0]]
        through_zero = float(reading.mean() / load.mean())
        low, high = np.quantile(load, [0.01, 0.99]) * scale.load_n
        trap = not 1.0 / FAR_FROM_ZERO < gain / through_zero < FAR_FROM_ZERO
        said.append(
            f"each file's load stays within a narrow range ({low:.4g} to {high:.4g} N in"
            f" {sessions[narrow[0]].recording.name}), in which the reading moves by {gain * to_physical:.3g} {unit}/N"
            f" ({1.0 / (gain * to_physical):.4g} N/{unit})"
            + (
                f", where reading over load is {through_zero * to_physical:.3g} {unit}/N"
                f" ({1.0 / (through_zero * to_physical):.4g} N/{unit}): load and reading may both follow a third thing"
                " (a reversal, a regulator), so that this gain is none to calibrate by, and no cause is named"
                if trap
                else ": what lies below is extrapolated"
            )
        )
    between = _between(kept)
    if between is not None and all(gain is not None for gain in within):
        gain = float(np.median([gain for gain in within if gain is not None]))
        if not 1.0 / GAINS_DIFFER < abs(gain / between) < GAINS_DIFFER:
            trap = trap or len(narrow) == len(kept)
            said.append(
                f"within a file the reading moves by {gain * to_physical:.3g} {unit}/N, between the files by"
                f" {between * to_physical:.3g} {unit}/N: the gain within a file is not that of the unit, or the"
                " files are not of one unit"
            )
    return Ranges(tuple(said), trap)


def _gain(load: Array, reading: Array) -> float | None:
    """Slope of reading on load within a file, None where they hardly correlate."""
    a, b = load - load.mean(), reading - reading.mean()
    size = float(np.sqrt((a @ a) * (b @ b)))
    return float(a @ b / (a @ a)) if size > 0 and abs(float(a @ b)) > FOLLOWS * size else None


def _between(kept: Sequence[tuple[Array, Array]]) -> float | None:
    """Slope of the files' mean readings on their mean loads, None where they are not far apart."""
    if len(kept) < 2:
        return None
    loads = np.array([load.mean() for load, _ in kept])
    readings = np.array([reading.mean() for _, reading in kept])
    if np.ptp(loads) < APART:
        return None
    a = loads - loads.mean()
    return float(a @ readings / (a @ a)) or None
