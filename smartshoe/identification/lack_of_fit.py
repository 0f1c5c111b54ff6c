"""Tests whether a fit's residual is noise: the F test of lack of fit against the pure error of repeated cycles."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from smartshoe.arrays import Array
from smartshoe.errors import NotIdentifiableError, UsageError
from smartshoe.files.logs.accepted import RecordingLike, recordings_of
from smartshoe.identification._cycles import CycleGroup, repeated_cycles
from smartshoe.identification._identification import Identification
from smartshoe.models.parameter import finite_or_none
from smartshoe.recording import Recording

FEWEST_BLOCKS = 16  # in the shortest cycle
LEVEL = 0.01


@dataclass(frozen=True, slots=True)
class LackOfFitTest:
    """``statistic`` F with ``degrees`` (lack of fit, pure error), integers after correction for autocorrelation.

    ``repeatable_percent`` is the share of the residual's variance that repeats from cycle to cycle, of ``n_cycles``.
    """

    statistic: float
    p_value: float
    degrees: tuple[int, int]
    repeatable_percent: float
    n_cycles: int
    says: str

    def to_dict(self) -> dict[str, Any]:
        """The test as plain numbers for JSON."""
        return {
            "statistic": finite_or_none(self.statistic),
            "p_value": finite_or_none(self.p_value),
            "degrees": list(self.degrees),
            "repeatable_percent": finite_or_none(self.repeatable_percent),
            "n_cycles": self.n_cycles,
            "says": self.says,
        }


def lack_of_fit(
    found: Identification, recordings: RecordingLike | Sequence[RecordingLike], *, skip_first: int = 0
) -> LackOfFitTest:
    """The F test of a fit's residual over repeated cycles of the ``recordings`` that it was made from, in their order.

    Parameters
    ----------
    found
        The fit.
    recordings
        Recordings, paths or DataFrames.
    skip_first
        The number of cycles at the beginning of each recording that are left out.

    Raises
    ------
    NotIdentifiableError
        Where nothing repeats.
    """
    several = recordings_of(recordings)
    return lack_of_fit_of(found.residuals, several, unknowns=found.fit.problem.size, skip_first=skip_first)


def lack_of_fit_of(
    residuals: Mapping[str, Array], recordings: Sequence[Recording], *, unknowns: int, skip_first: int = 0
) -> LackOfFitTest:
    """The test for any model's residuals (n,) by recording, in the recordings' order.

    NaN where a sample is not counted. Draper and Smith 1998, *Applied Regression Analysis*, sec. 2.1: the mean square
    of the repeats' mean, with the model's ``unknowns`` subtracted from its degrees of freedom, against that of the
    deviations from the mean. It is computed on means over blocks of a cycle. The degrees of both are divided by 1 + 2
    sum (1 - k/m) rho_k^2, rho the deviations' autocorrelation, which makes a sum of m dependent squares a chi-square of
    the right spread (Satterthwaite 1946).
    """
    signals = list(residuals.values())
    if [signal.size for signal in signals] != [len(recording) for recording in recordings]:
        raise UsageError("the residuals are not those of these recordings: give the recordings of the fit, in order")
    groups = repeated_cycles(recordings, skip_first=skip_first)
    label = recordings[0].label if recordings else "no recording"
    if not groups:
        raise NotIdentifiableError(
            f"{label}: no load cycle is repeated, so that its noise is not known: record two of one rate at least"
        )
    block_s = min(group.last_s - group.first_s for group in groups) / FEWEST_BLOCKS
    lack = pure = power = 0.0
    blocks = pure_blocks = cycles = 0
    deviations: list[Array] = []
    for group in groups:
        means, counts, squares = _block_means(group, recordings, signals, block_s)
        if means.shape[0] < 2 or means.shape[1] < 2:
            continue
        mean = (counts * means).sum(axis=0) / counts.sum(axis=0)
        deviation = np.sqrt(counts) * (means - mean)
        lack += float((counts.sum(axis=0) * mean**2).sum())
        pure += float((deviation**2).sum())
        power += squares
        blocks += mean.size
        pure_blocks += mean.size * (means.shape[0] - 1)
        cycles += means.shape[0]
        deviations.append(deviation)
    if blocks <= unknowns:
        raise NotIdentifiableError(
            f"{label}: repeated cycles hold {blocks} counted places for {unknowns} unknowns: record more repeats"
        )
    if not power > 0.0:
        raise NotIdentifiableError(f"{label}: the residual is zero over all repeats: there is no error to test")
    from scipy.special import fdtrc

    shrink = _dependence(deviations)
    free = (max((blocks - unknowns) / shrink, 1.0), max(pure_blocks / shrink, 1.0))
    variance = max(pure / pure_blocks, np.finfo(float).eps * power / pure_blocks)
    statistic = lack / (blocks - unknowns) / variance
    p_value = float(fdtrc(free[0], free[1], statistic))
    percent = 100.0 * float(np.clip((lack - (blocks - unknowns) * variance) / power, 0.0, 1.0))
    if p_value < LEVEL:
        says = f"{percent:.2g} % of the residual's variance repeats over {cycles} cycles: the model lacks something"
    else:
        says = f"over {cycles} cycles the residual does not repeat beyond its noise: no lack of fit is seen"
    degrees = (max(round(free[0]), 1), max(round(free[1]), 1))
    return LackOfFitTest(float(statistic), p_value, degrees, percent, cycles, says)


def _block_means(
    group: CycleGroup, recordings: Sequence[Recording], signals: Sequence[Array], block_s: float
) -> tuple[Array, Array, float]:
    """(repeats, blocks) means and numbers of samples, and the sum of all squares of the samples.

    Means are used rather than resampling, which would smooth the noise of some repeats more than that of others.
    Repeats that are mostly not counted are left out, then blocks that any repeat lacks.
    """
    count = max(int((group.last_s - group.first_s) / block_s + 1e-6), 1)
    sums, counts, squares = (np.zeros((len(group.repeats), count)) for _ in range(3))
    full = np.zeros_like(counts)
    for row, repeat in enumerate(group.repeats):
        places_s = group.places_s(repeat, recordings)
        signal = signals[repeat.recording][repeat.start : repeat.stop]
        inside = group.covers(places_s)
        at = ((places_s - group.first_s) / block_s).astype(int)
        inside &= at < count
        full[row] = np.bincount(at[inside], minlength=count)
        inside &= np.isfinite(signal)
        counts[row] = np.bincount(at[inside], minlength=count)
        sums[row] = np.bincount(at[inside], signal[inside], minlength=count)
        squares[row] = np.bincount(at[inside], signal[inside] ** 2, minlength=count)
    rows = counts.sum(axis=1) > 0.5 * full.sum(axis=1)
    sums, counts, squares, full = (table[rows] for table in (sums, counts, squares, full))
    columns = ((counts > 0.5 * full) & (counts > 0)).all(axis=0)
    sums, counts, squares = (table[:, columns] for table in (sums, counts, squares))
    return sums / np.maximum(counts, 1.0), counts, float(squares.sum())


def _dependence(deviations: Sequence[Array]) -> float:
    """1 + 2 sum (1 - k/m) rho_k^2 over the lags up to the first whose correlation is not significant."""
    longest = max(table.shape[1] for table in deviations)
    free = sum((table.shape[0] - 1) * table.shape[1] for table in deviations)
    power = sum(float((table**2).sum()) for table in deviations)
    total = 1.0
    for lag in range(1, longest // 2):
        products = sum(float((table[:, lag:] * table[:, :-lag]).sum()) for table in deviations if table.shape[1] > lag)
        rho = products / power if power > 0 else 0.0
        if abs(rho) < 2.0 / np.sqrt(free):
            break
        total += 2.0 * rho**2  # the biased estimate already contains a factor (1 - k/m)
    return total
