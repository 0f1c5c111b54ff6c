"""Compares two calibrations: which parameters differ, by how many sd, and what that means in newtons."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from smartshoe.arrays import Array
from smartshoe.calibration import Calibration
from smartshoe.calibration.store.quantities import (
    COEFFICIENTS,
    coefficient_covariance,
    quantities,
    require_one_reading_unit,
    top_load_n,
)
from smartshoe.errors import UsageError
from smartshoe.models.effects.effect import Conditions
from smartshoe.models.first_order import simulate
from smartshoe.models.parameter import Parameter, finite_or_none

RATES_N_PER_S = (50.0, 100.0, 200.0, 400.0, 600.0, 800.0)  # those of the paper's dynamic protocol
SAMPLES_OF_A_RAMP = 400
CHANGED = 0.01  # p-value below which two calibrations are called different
DERIVATIVE_STEP = 1e-5


@dataclass(frozen=True, slots=True)
class ParameterDifference:
    """``second`` minus ``first``: ``difference`` with ``sd``; ``in_sd`` is their ratio, NaN where no sd is known."""

    name: str
    first: Parameter
    second: Parameter
    difference: float
    sd: float

    @property
    def in_sd(self) -> float:
        """The difference divided by its sd."""
        return self.difference / self.sd if self.sd > 0.0 else math.nan

    @property
    def percent(self) -> float:
        """The difference as a percentage of the first value."""
        return 100.0 * self.difference / abs(self.first.value) if self.first.value else math.nan

    def to_dict(self) -> dict[str, Any]:
        """The difference for JSON."""
        return {
            "first": self.first.to_dict(),
            "second": self.second.to_dict(),
            "difference": self.difference,
            "sd": finite_or_none(self.sd),
            "in_sd": finite_or_none(self.in_sd),
            "percent": finite_or_none(self.percent),
        }


@dataclass(frozen=True, slots=True)
class ForceDifference:
    """The second's force minus the first's, in N, under a triangle to the top load and back at ``rate_n_per_s``.

    ``largest_n`` is signed and occurs at the load ``at_load_n``; ``sd_n`` is its standard deviation by both
    calibrations' covariances, NaN where they are not known.
    """

    rate_n_per_s: float
    rms_n: float
    largest_n: float
    at_load_n: float
    sd_n: float

    def to_dict(self) -> dict[str, Any]:
        """The difference for JSON."""
        return {
            "rate_n_per_s": self.rate_n_per_s,
            "rms_n": self.rms_n,
            "largest_n": self.largest_n,
            "at_load_n": self.at_load_n,
            "sd_n": finite_or_none(self.sd_n),
        }


@dataclass(frozen=True, slots=True)
class Comparison:
    """The result of `compare`; ``p_value`` tests a1, b0 and b1 together, NaN without covariances."""

    parameters: tuple[ParameterDifference, ...]
    forces: tuple[ForceDifference, ...]
    top_load_n: float
    zero_difference_n: float
    p_value: float
    says: str

    def to_dict(self) -> dict[str, Any]:
        """The comparison as a JSON object, schema smartshoe.comparison/1."""
        return {
            "schema": "smartshoe.comparison/1",
            "parameters": {item.name: item.to_dict() for item in self.parameters},
            "forces": [item.to_dict() for item in self.forces],
            "top_load_n": self.top_load_n,
            "zero_difference_n": self.zero_difference_n,
            "p_value": finite_or_none(self.p_value),
            "says": self.says,
        }


def compare(first: Calibration, second: Calibration, rates_n_per_s: Sequence[float] = RATES_N_PER_S) -> Comparison:
    """Differences of two calibrations' parameters, and of the forces that they give for the same reading.

    The reading is that of the first calibration's unit under a triangle from 0 to the largest load that both have seen,
    so that the first's force equals that load. Each is used with its own zero; the difference of the zeros is listed
    separately. The errors of the two are assumed independent. Raises `UsageError` for readings in different units.
    """
    require_one_reading_unit([first, second])
    ours, theirs = quantities(first), quantities(second)
    found = tuple(
        ParameterDifference(
            name, ours[name], theirs[name], theirs[name].value - ours[name].value,
            math.hypot(ours[name].sd, theirs[name].sd),
        )
        for name in ours
        if name in theirs
    )  # fmt: skip
    top_n = top_load_n([first, second])
    forces = tuple(_force_difference(first, second, top_n, rate) for rate in rates_n_per_s)
    p_value = _together(first, second)
    zero_n = (second.offset - first.offset) * first.b1 / first.a1
    return Comparison(found, forces, top_n, zero_n, p_value, _says(forces, p_value, top_n))


def _says(forces: Sequence[ForceDifference], p_value: float, top_n: float) -> str:
    if not forces:
        raise UsageError("no loading rate is given: give one at least, for example 200 N/s")
    worst = max(forces, key=lambda item: abs(item.largest_n))
    size = (
        f"forces differ by up to {abs(worst.largest_n):.3g} N of {top_n:.4g} N"
        f" ({100 * abs(worst.largest_n) / top_n:.2g} %), most at {worst.rate_n_per_s:g} N/s"
    )
    if not math.isfinite(p_value):
        return f"{size}; whether that is more than their errors cannot be told: one of them has no covariance"
    chance = "less than 1 in 10,000" if p_value < 1e-4 else f"{100 * p_value:.2g} %"
    if p_value < CHANGED:
        return f"the unit has changed between the two (chance of errors alone: {chance}): {size}"
    return f"the two agree within their errors (chance of a larger difference: {chance}): {size}"


def _together(first: Calibration, second: Calibration) -> float:
    """Probability that independent errors alone make a1, b0, b1 differ so much (chi-square, 3 degrees of freedom)."""
    ours, theirs = coefficient_covariance(first), coefficient_covariance(second)
    if ours is None or theirs is None:
        return math.nan
    from scipy.stats import chi2

    difference = np.array([getattr(second, name) - getattr(first, name) for name in COEFFICIENTS])
    both = ours + theirs
    # Scaled to a correlation before solving, since the coefficients differ widely in size.
    size = np.sqrt(np.diag(both))
    scaled = difference / size
    distance = float(scaled @ np.linalg.pinv(both / np.outer(size, size), rcond=1e-12, hermitian=True) @ scaled)
    return float(chi2.sf(distance, len(COEFFICIENTS)))


def _force_difference(first: Calibration, second: Calibration, top_n: float, rate_n_per_s: float) -> ForceDifference:
    if not (math.isfinite(rate_n_per_s) and rate_n_per_s > 0.0):
        raise UsageError(f"loading rate {rate_n_per_s:g} N/s: give a number above 0")
    ramp_s = top_n / rate_n_per_s
    time_s = np.linspace(0.0, 2.0 * ramp_s, 2 * SAMPLES_OF_A_RAMP + 1)
    load_n = top_n - np.abs(time_s - ramp_s) * rate_n_per_s
    if first.extended is None and second.extended is None:
        between = _linear(_coefficients(first), _coefficients(second), time_s, load_n)
        sd_n = _sd(first, second, time_s, load_n)
    else:
        between, sd_n = _extended(first, second, time_s, load_n), np.full(time_s.size, math.nan)
    worst = int(np.argmax(np.abs(between)))
    return ForceDifference(
        float(rate_n_per_s),
        float(np.sqrt(np.mean(between**2))),
        float(between[worst]),
        float(load_n[worst]),
        float(sd_n[worst]),
    )


def _coefficients(calibration: Calibration) -> Array:
    return np.array([getattr(calibration, name) for name in COEFFICIENTS])


def _linear(ours: Array, theirs: Array, time_s: Array, load_n: Array) -> Array:
    """(G2/G1 - 1) load (n,): the reading is (s + a1)/(b0 s + b1) load, the force (b0 s + b1)/(s + a1) reading."""
    a1, b0, b1 = ours
    if not b1 / b0 > 0.0:
        raise UsageError(f"b0 and b1 are {b0:g} and {b1:g}, no passive solid: identify the unit anew")
    reading = simulate(b1 / b0, 1.0 / b0, a1 / b0, load_n, time_s, "rest")
    return np.asarray(simulate(theirs[0], theirs[1], theirs[2], reading, time_s, "rest") - load_n)


def _sd(first: Calibration, second: Calibration, time_s: Array, load_n: Array) -> Array:
    """Standard deviation (n,) of the force difference, by the derivatives with respect to both sets of coefficients."""
    variance = np.zeros(time_s.size)
    pair = (_coefficients(first), _coefficients(second))
    start = _linear(*pair, time_s, load_n)
    for which, calibration in enumerate((first, second)):
        covariance = coefficient_covariance(calibration)
        if covariance is None:
            return np.full(time_s.size, math.nan)
        slopes = np.empty((len(COEFFICIENTS), time_s.size))
        for row in range(len(COEFFICIENTS)):
            moved = [pair[0].copy(), pair[1].copy()]
            step = DERIVATIVE_STEP * abs(moved[which][row])
            moved[which][row] += step
            slopes[row] = (_linear(moved[0], moved[1], time_s, load_n) - start) / step
        variance += np.einsum("in,ij,jn->n", slopes, covariance, slopes)
    return np.sqrt(np.maximum(variance, 0.0))


def _extended(first: Calibration, second: Calibration, time_s: Array, load_n: Array) -> Array:
    """The force difference (n,) where either has effects: the first's reading passed through both filters."""
    bare = [_without_zero(calibration) for calibration in (first, second)]
    model = bare[0].model()
    step_s = float(time_s[1])  # the first time is 0
    reading = model.reading(Conditions(time_s, load_n / model.full_scale_load_n, step_s))
    ours, theirs = (calibration.compensator(1.0 / step_s).apply(reading) for calibration in bare)
    return np.asarray(theirs - ours)


def _without_zero(calibration: Calibration) -> Calibration:
    if calibration.extended is None:
        return replace(calibration, offset=0.0)
    model = calibration.extended
    return replace(
        calibration, extended=model.without(*(one.name for one in model.parts if one.effect.shifts == "reading"))
    )
