"""The result of a statistical test on a residual, and the arithmetic that such tests share."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass
from math import pi, sqrt
from typing import ClassVar

import numpy as np

from smartshoe.arrays import Array
from smartshoe.models.effects.effect import Conditions, Effect, EffectParameter

FALSE_ALARMS = 1e-3
"""Rate at which each test finds something in white Gaussian noise."""
ONE_SIDED = 3.0902  # normal quantile of 1 - FALSE_ALARMS
LEAST_SAMPLES = 600
RHYTHM_LAGS = range(3, 13)
LEAST_RHYTHM = 0.1  # sum of squared correlations, above what chance gives


@dataclass(frozen=True)
class SensorEvidence:
    """A test that found something: ``value`` of its ``statistic`` is above ``threshold``; ``says`` is its sentence.

    ``strength`` is the standard deviation of what was found, as a share of full scale, where it is largest.
    ``lines_hz`` are the frequencies, as logged, of the lines of the spectrum that it is about.
    """

    statistic: str
    value: float
    threshold: float
    says: str
    strength: float

    @property
    def lines_hz(self) -> tuple[float, ...]:
        """None: noise has no lines."""
        return ()


class NoiseEffect(Effect):
    """Noise that a test finds in the residual of a model; never named as a cause by its waveform.

    ``has_memory``: True for noise that is correlated in time, as structure is that no effect has explained.
    ``imitated_by``: kinds of data faults beside which it is not sought, since they look like it.
    """

    is_physical: ClassVar[bool] = False
    has_memory: ClassVar[bool] = False
    imitated_by: ClassVar[frozenset[str]] = frozenset()

    @abstractmethod
    def evidence(self, residual: Array, conditions: Conditions, prediction: Array) -> SensorEvidence | None:
        """What a model's ``residual`` (n,) beside its ``prediction`` (n,), in shares of full scale, shows of it.

        None where it shows nothing. The test has one false alarm in 1000.
        """


class Waveformless:
    """For effects that are noise: there is nothing to add to a prediction."""

    parameters: ClassVar[tuple[EffectParameter, ...]] = ()
    is_physical: ClassVar[bool] = False

    def apply(self, signal: Array, conditions: Conditions, values: Array) -> Array:
        """The signal as it is: noise has no waveform that could be predicted."""
        return signal.copy()


@dataclass(frozen=True, eq=False)
class LocalVariance:
    """Variance (m,) of the residual's fast part in blocks, and what it may follow.

    That is squares of pressure and slope (m,), and the share (m,) of the load's noise that is in the prediction.
    """

    variance: Array
    pressure_squared: Array
    slope_squared: Array
    load_noise: Array


TRIPLETS = 4  # in a block, which stays short: the log of its variance has the variance psi'(2)
LOG_SD = sqrt(pi**2 / 6.0 - 1.0)
PRESSURE, SLOPE, LOAD = 1, 2, 3


def local_variance(
    residual: Array, prediction: Array, sample_time_s: float, load_noise_left: Array | None = None
) -> LocalVariance | None:
    """`LocalVariance` from second differences of separate triplets of samples.

    ``load_noise_left`` (n,): the share of the variance of the load's noise that is in the prediction.

    Second differences hold neither a smooth misfit nor slow noise. Triplets at a corner of the prediction are left out,
    since a model that is late leaves its corners in the residual. None where too few samples are left, or where the
    grid of the readings is coarser than the noise.
    """
    if residual.size < LEAST_SAMPLES:
        return None
    n = residual.size // 3 * 3
    fast = _second_difference(residual[:n].reshape(-1, 3))
    spread = float(np.median(np.abs(fast))) / 0.6745
    readings = np.unique((prediction + residual).round(12))
    grid_step = float(np.min(np.diff(readings))) if readings.size > 1 else 0.0
    if spread <= 0.0 or (readings.size < residual.size // 4 and grid_step > 1.5 * spread):
        return None
    slope = np.gradient(prediction, sample_time_s)[1:n:3]
    corner = np.abs(_second_difference(prediction[:n].reshape(-1, 3)))
    smooth = corner <= max(0.5 * spread, 6.0 * float(np.median(corner)))  # the load's noise is no corner
    whole = int(np.count_nonzero(smooth)) // TRIPLETS * TRIPLETS
    if whole < LEAST_SAMPLES // 6:
        return None

    def means(values: Array) -> Array:
        return np.asarray(values[smooth][:whole].reshape(-1, TRIPLETS).mean(axis=1))

    left = np.zeros(n) if load_noise_left is None else load_noise_left[:n]
    noise = left.reshape(-1, 3) @ np.array([1.0, 4.0, 1.0]) / 6.0  # of a second difference: the squares of its weights
    return LocalVariance(means(fast**2), means(prediction[1:n:3] ** 2), means(slope**2), means(noise))


def growing_noise(
    residual: Array, prediction: Array, sample_time_s: float, asked: int, load_noise_left: Array | None = None
) -> tuple[float, float, LocalVariance] | None:
    """Score, strength and `LocalVariance` where the residual's variance grows with the ``asked`` part; None elsewhere.

    ``asked`` is `PRESSURE` or `SLOPE`; growth with the other part is fitted apart, and so is what noise of the load
    brings (``load_noise_left``, see `local_variance`). The test has one false alarm in 1000.
    """
    local = local_variance(residual, prediction, sample_time_s, load_noise_left)
    if local is None:
        return None
    value, growth = variance_score(local, asked)
    weight = np.abs(prediction if asked == PRESSURE else np.gradient(prediction))
    if value <= ONE_SIDED or growth <= 0.0 or keeps_rhythm(residual, weight):
        return None
    return value, sqrt(growth), local


def keeps_rhythm(residual: Array, weight: Array) -> bool:
    """Whether the part of the residual (n,) that is large where ``weight`` (n,) is large is a tone and no noise.

    Ringing after corners (a resonance) is strongest on steep ramps, as jitter is; but it repeats itself. A tone that is
    there all the time (hum) is not counted.
    """
    fast = residual[1:-1] - 0.5 * (residual[:-2] + residual[2:])
    share = (weight[1:-1] / max(float(np.max(np.abs(weight))), 1e-300)) ** 2
    loud, quiet = (
        fast * np.sqrt(share / share.sum()),
        fast * np.sqrt((1.0 - share) / max(float(np.sum(1.0 - share)), 1.0)),
    )

    def excess(lag: int) -> float:
        n = fast.size
        return float(np.sum(loud[lag:] * loud[: n - lag]) - np.sum(quiet[lag:] * quiet[: n - lag]))

    power = excess(0)
    if power <= 0.0:
        return False
    by_chance = len(RHYTHM_LAGS) * float(np.sum(loud**4) + np.sum(quiet**4)) / power**2
    # White noise has no correlation left at these lags of its second differences.
    return sum((excess(lag) / power) ** 2 for lag in RHYTHM_LAGS) > LEAST_RHYTHM + 3.0 * by_chance


def _second_difference(triplets: Array) -> Array:
    """(m,) second differences of ``triplets`` (m, 3), scaled so that white noise keeps its variance."""
    return (triplets[:, 1] - 0.5 * (triplets[:, 0] + triplets[:, 2])) * sqrt(2.0 / 3.0)


def variance_score(local: LocalVariance, asked: int) -> tuple[float, float]:
    """Score statistic (standard normal without the effect) and coefficient of the ``asked`` part of the variance.

    The variance is modelled as a constant, a part with the square of pressure (`PRESSURE`), one with that of the slope
    (`SLOPE`), and one where the load's noise is left (`LOAD`). The other parts are fitted first, so that none stands in
    for another. The score is of logarithms: few blocks are steep, and their squares are too skewed for a normal law at
    one in a thousand.
    """
    parts = np.ones(local.variance.size), local.pressure_squared, local.slope_squared, local.load_noise
    columns = np.stack(parts, axis=1)
    columns = columns / np.maximum(columns.max(axis=0), 1e-300)
    other = [0, SLOPE if asked == PRESSURE else PRESSURE, LOAD]
    without = columns @ _variances(columns, local.variance, other)
    scores = columns / without[:, None]
    standard = np.log(np.maximum(local.variance, 1e-9 * without) / without)
    standard = standard - standard.mean()  # its mean is psi(2) - log(2) and not 0
    direction = scores[:, asked]
    others = np.column_stack([scores[:, other], np.ones(direction.size)])
    direction = direction - others @ np.linalg.lstsq(others, direction, rcond=None)[0]
    length = float(np.sqrt(direction @ direction))
    if length <= 1e-9 * float(np.sqrt(scores[:, asked] @ scores[:, asked])):
        return 0.0, 0.0
    spread = max(float(np.std(standard)), LOG_SD)
    found = _variances(columns, local.variance, [0, PRESSURE, SLOPE, LOAD])
    return float(direction @ standard) / (spread * length), float(found[asked])


def _variances(columns: Array, variance: Array, used: list[int]) -> Array:
    """Coefficients (k,), none below 0, of the ``used`` ``columns`` (m, k) in ``variance`` (m,): weighted least squares.

    The weights are those of squares of noise, whose standard deviation is in proportion to their mean.
    """
    coefficients = np.zeros(columns.shape[1])
    coefficients[0] = float(variance.mean())
    for _ in range(8):
        weight = 1.0 / np.maximum(columns @ coefficients, 1e-3 * float(variance.mean()))
        active = list(used)
        while True:
            left = columns[:, active] * weight[:, None]
            solution = np.linalg.lstsq(left.T @ left, left.T @ (variance * weight), rcond=None)[0]
            negative = [column for column, value in zip(active, solution, strict=True) if value < 0.0 and column]
            if not negative:
                break
            active = [column for column in active if column not in negative]
        coefficients[:] = 0.0
        coefficients[active] = solution
        coefficients[0] = max(coefficients[0], 1e-3 * float(variance.mean()))
    return coefficients
