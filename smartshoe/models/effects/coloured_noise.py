"""Noise that is correlated in time: first-order noise above a white floor."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from smartshoe.arrays import Array
from smartshoe.display import percent
from smartshoe.models.effects._sensor_evidence import NoiseEffect, SensorEvidence, Waveformless
from smartshoe.models.effects.effect import Conditions
from smartshoe.models.effects.exposure import by
from smartshoe.signals.noise import autocovariance

if TYPE_CHECKING:
    from smartshoe.signals.loading import Cycle

MEMORIES = (1.5, 4.0, 12.0, 40.0, 120.0, 400.0)  # correlation times in samples that are tested
QUANTILE = 3.588  # normal, of one false alarm in 1000 over the number of memories
LEAST_INDEPENDENT = 40  # segments of one memory's length, below which that memory is left out
SAME_LOAD = 0.05  # of the peak: loads that differ by less are equal
CORNER = 0.1  # of the noise: where a prediction bends by more from one sample to the next is a corner


class ColouredNoise(Waveformless, NoiseEffect):
    """Noise with a correlation time: the sensor's own, or what no effect explains and never repeats."""

    name, family, stage, place = "coloured_noise", "noise", "sensor", "sensor"
    says = "slow noise that differs from one equal load cycle to the next"
    has_memory = True
    exposed_by = by("repeats")
    separated_by = {
        "gain_drift": by("repeats"),
        "hum": by("idle"),
        "quantisation": by("holds"),
        "zero_drift": by("repeats"),
    }

    def evidence(self, residual: Array, conditions: Conditions, prediction: Array) -> SensorEvidence | None:
        """Whether the differences between equal load cycles are correlated in time; None if not, or without repeats.

        1. Differences between cycles hold neither a misfit that repeats nor, after a regression, drifts of zero, gain
           and clock.
        2. In them white noise is tested against first-order noise of several memories, by a score test.

        It is meant for the residual of a model that was chosen. A strong cause which has no place in that model, and
        remembers the past, leaves differences between cycles as well.
        """
        covariance, pairs, lengths = np.zeros(0), np.zeros(0), []
        for series, bias, counted in _differences(residual, conditions, prediction):
            n = series.size
            own = autocovariance(series) + bias
            size = max(n, covariance.size)
            covariance = np.pad(covariance, (0, size - covariance.size)) + np.pad(own, (0, size - n))
            pairs = np.pad(pairs, (0, size - pairs.size)) + np.pad(counted, (0, size - n))
            lengths.append(n)
        total = round(float(pairs[0])) if lengths else 0
        if total < LEAST_INDEPENDENT * 4 or covariance[0] <= 0.0:
            return None
        variance = float(covariance[0]) / total
        best: tuple[float, float, float, float] | None = None
        for memory in MEMORIES:
            if total < LEAST_INDEPENDENT * memory or max(lengths) < 2 * memory:
                continue
            lags = np.arange(1, min(int(6 * memory) + 2, covariance.size))
            weight = np.exp(-lags / memory)
            value = float(weight @ covariance[lags]) / (variance * math.sqrt(float(weight**2 @ pairs[lags])))
            threshold = QUANTILE + _skewness(memory, total) * (QUANTILE**2 - 1.0) / 6.0
            if best is None or value - threshold > best[0] - best[1]:
                power = float(weight @ covariance[lags]) / float(weight**2 @ pairs[lags])
                best = value, threshold, memory, power
        if best is None or best[0] <= best[1]:
            return None
        value, threshold, memory, power = best
        strength, tau_s = math.sqrt(power), memory * conditions.step_s
        says = (
            f"what differs between equal load cycles is correlated over about {tau_s:.2g} s: "
            f"coloured noise of {percent(strength)} of full scale"
        )
        return SensorEvidence("first_order_noise_score", value, threshold, says, strength)


def _skewness(memory: float, total: int) -> float:
    # The score is a sum of periodogram values, exponential each, weighted by the spectrum of the lags' weights.
    """Skewness of the score for a ``memory`` in samples, by which a normal quantile is corrected."""
    decay = math.exp(-1.0 / memory)
    turn = decay * np.exp(1j * np.pi * (np.arange(8192) + 0.5) / 8192)
    weight = 2.0 * (turn / (1.0 - turn)).real
    return float(2.0 * np.mean(weight**3) / np.mean(weight**2) ** 1.5 / math.sqrt(total / 2.0))


def _differences(residual: Array, conditions: Conditions, prediction: Array) -> Iterator[tuple[Array, Array, Array]]:
    """By group of equal cycles and contrast: series (n,), bias (n,) and pairs (n,).

    The series are orthonormal contrasts of the cycles' residuals. ``bias`` is what the regression took from their
    autocovariance, ``pairs`` how many pairs of samples count at each lag. Corners of the prediction count as zero:
    cycles are aligned to a sample, which is too coarse for them.
    """
    from smartshoe.signals.loading import by_rate, cycles

    load = conditions.load
    for group in by_rate(cycles(conditions.time_s, load)).values():
        starts, n = _equal(group, load)
        if len(starts) > 2:
            starts = starts[1:]  # the first comes after other loads, and a wrong memory of those would make it differ
        if len(starts) < 2 or n < 30:
            continue
        aligned = np.stack([residual[start : start + n] for start in starts])
        shape = np.mean([prediction[start : start + n] for start in starts], axis=0)
        counted = 1.0 - _corners(shape, float(np.median(np.abs(np.diff(aligned, axis=1)))))
        if np.count_nonzero(counted) < 30:
            continue
        regressors = np.stack([np.ones(n), np.linspace(-1.0, 1.0, n), shape, np.gradient(shape)], axis=1)
        regressors *= counted[:, None]
        basis = np.linalg.qr(regressors)[0]
        taken = np.sum([autocovariance(column) for column in basis.T], axis=0)
        pairs = autocovariance(counted)
        repeats = len(starts)
        # Helmert's contrasts: as many independent series as repeats less one, each as noisy as a repeat.
        for row in range(1, repeats):
            contrast = np.zeros(repeats)
            contrast[:row], contrast[row] = 1.0, -float(row)
            series = counted * (contrast @ aligned) / math.sqrt(row * (row + 1.0))
            series = series - basis @ (basis.T @ series)
            yield series, taken * float(series @ series) / (pairs[0] - basis.shape[1]), pairs


def _equal(group: Sequence[Cycle], load: Array) -> tuple[list[int], int]:
    """Where those cycles of a ``group`` begin that reach one peak along the same load, and for how many samples.

    Cycles of one rate and one peak need not have equal loads, as of weights that are put on by hand, or of random
    loads. They are laid over each other where they rise through half of their peak, since a cycle after a rest begins
    anywhere in it.
    """
    peaks = np.array([float(load[cycle.start : cycle.stop].max()) for cycle in group])
    within = SAME_LOAD * float(np.median(peaks))
    high = [(cycle, peak) for cycle, peak in zip(group, peaks, strict=True) if abs(peak - np.median(peaks)) <= within]
    if not high:
        return [], 0
    rises = [cycle.start + int(np.argmax(load[cycle.start : cycle.stop] >= 0.5 * peak)) for cycle, peak in high]
    before = min(rise - cycle.start for (cycle, _), rise in zip(high, rises, strict=True))
    n = before + min(cycle.stop - rise for (cycle, _), rise in zip(high, rises, strict=True))
    starts = sorted(rise - before for rise in rises)
    loads = np.stack([load[start : start + n] for start in starts])
    usual = loads[np.argmin(_rms(loads - np.median(loads, axis=0)))]
    return [start for start, difference in zip(starts, _rms(loads - usual), strict=True) if difference <= within], n


def _rms(rows: Array) -> Array:
    """(m,) root mean square of each of the rows (m, n)."""
    return np.asarray(np.sqrt(np.mean(rows**2, axis=1)))


def _corners(shape: Array, noise: float) -> Array:
    """(n,) 1.0 within three samples of where ``shape`` (n,) bends by more than it usually does and ``noise`` hides."""
    bend = np.abs(np.diff(shape, 2, prepend=shape[0], append=shape[-1]))
    corner = bend > max(CORNER * noise, 6.0 * float(np.median(bend)))
    return np.asarray(np.minimum(np.convolve(corner, np.ones(7), mode="same"), 1.0))
