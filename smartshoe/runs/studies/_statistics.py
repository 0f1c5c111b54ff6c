"""Statistics of a study: means with intervals, differences within subjects, and agreement with a reference."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from smartshoe.arrays import Array
from smartshoe.signals.noise import NORMAL_95

CONFIDENCE = 0.95
BOOTSTRAP_FROM = 10  # number of subjects; fewer cannot show their spread by resampling, and Student's t is used
PREDICTED_FROM = 3  # number of subjects; from two, an interval for a third would be wider than any real difference
RESAMPLES = 5000
SEED = 20160920  # of the resampling, so that a study always gives the same numbers


@dataclass(frozen=True, slots=True)
class Mean:
    """A mean over subjects with standard deviation and 95 % interval, both None for a single subject."""

    mean: float
    sd: float | None
    ci95: tuple[float, float] | None
    subjects: int
    method: str

    def to_dict(self) -> dict[str, Any]:
        """The mean as an object for JSON."""
        return {
            "mean": self.mean,
            "sd": self.sd,
            "ci95": None if self.ci95 is None else list(self.ci95),
            "subjects": self.subjects,
            "interval": self.method,
        }


def mean_of(values: Array) -> Mean:
    """The mean over subjects (n,), with Student's t interval."""
    sd = float(values.std(ddof=1)) if values.size > 1 else None
    return Mean(float(values.mean()), sd, _t_interval(values), values.size, "t")


def difference_of(differences: Array) -> Mean:
    """The mean of the differences of subjects (n,).

    Its interval is the paired t interval or, from `BOOTSTRAP_FROM` subjects on, the bias-corrected and accelerated
    bootstrap over subjects (Efron 1987).
    """
    plain = mean_of(differences)
    if differences.size < BOOTSTRAP_FROM or float(np.ptp(differences)) == 0.0:
        return plain
    from scipy.stats import bootstrap

    drawn = bootstrap(
        (differences,), np.mean, confidence_level=CONFIDENCE, n_resamples=RESAMPLES, method="BCa",
        rng=np.random.default_rng(SEED),
    ).confidence_interval  # fmt: skip
    return Mean(plain.mean, plain.sd, (float(drawn.low), float(drawn.high)), plain.subjects, "bootstrap")


def _t_interval(values: Array) -> tuple[float, float] | None:
    from scipy.stats import t

    if values.size < 2:
        return None
    half = float(t.ppf(0.5 + CONFIDENCE / 2, values.size - 1) * values.std(ddof=1) / np.sqrt(values.size))
    return float(values.mean()) - half, float(values.mean()) + half


def prediction_interval(values: Array) -> tuple[Array, Array] | None:
    """The interval (m,) that contains a further subject's values with 95 %, from those of n subjects (n, m).

    Assumes that subjects are normally distributed. None with fewer than `PREDICTED_FROM` subjects.
    """
    from scipy.stats import t

    count = len(values)
    if count < PREDICTED_FROM:
        return None
    half = t.ppf(0.5 + CONFIDENCE / 2, count - 1) * np.sqrt(1.0 + 1.0 / count) * values.std(axis=0, ddof=1)
    return values.mean(axis=0) - half, values.mean(axis=0) + half


@dataclass(frozen=True, slots=True)
class Agreement:
    """Our values minus the reference's: bias and limits of agreement with intervals, and the intraclass correlation.

    ``sd`` is that of a single stride's difference, within and between trials together (Bland and Altman 2007, section
    3: the true value varies). ``icc`` is ICC(A,1), the absolute agreement of single measurements, computed from trial
    means (McGraw and Wong 1996); None with fewer than three trials.
    """

    bias: float
    bias_ci95: tuple[float, float] | None
    sd: float
    limits: tuple[float, float]
    limits_ci95_half: float | None
    icc: float | None
    icc_ci95: tuple[float, float] | None
    strides: int
    trials: int

    def to_dict(self) -> dict[str, Any]:
        """The agreement as an object for JSON."""
        return {
            "bias": self.bias,
            "bias_ci95": None if self.bias_ci95 is None else list(self.bias_ci95),
            "sd": self.sd,
            "limits_of_agreement": list(self.limits),
            "limits_ci95_half_width": self.limits_ci95_half,
            "icc": None if self.icc is None else {"value": self.icc, "ci95": list(self.icc_ci95 or ())},
            "strides": self.strides,
            "trials": self.trials,
        }


def agreement_of(pairs: Sequence[Array]) -> Agreement:
    """The agreement of pairs (strides, 2) of each trial: our value and the value of the reference."""
    differences = [own[:, 0] - own[:, 1] for own in pairs]
    means = np.array([own.mean() for own in differences])
    counts = np.array([own.size for own in differences], dtype=float)
    every = np.concatenate(differences)
    bias = float(means.mean())
    inside = sum(float(((own - own.mean()) ** 2).sum()) for own in differences)
    freedom = every.size - means.size
    within = inside / freedom if freedom > 0 else 0.0
    # The part of the variance of trial means that the spread of their strides does not explain.
    between = max(float(means.var(ddof=1)) - within * float(np.mean(1.0 / counts)), 0.0) if means.size > 1 else 0.0
    sd = float(np.sqrt(within + between))
    half = None
    if means.size > 1:
        from scipy.stats import t

        # Bland and Altman 1999: the standard error of a limit is about sqrt(3/n) sd; here n counts trials.
        half = float(t.ppf(0.5 + CONFIDENCE / 2, means.size - 1) * np.sqrt(3.0 / means.size) * sd)
    icc = _icc(np.array([own.mean(axis=0) for own in pairs])) if means.size > 2 else None
    return Agreement(
        bias, _t_interval(means), sd, (bias - NORMAL_95 * sd, bias + NORMAL_95 * sd), half,
        None if icc is None else icc[0], None if icc is None else icc[1], every.size, means.size,
    )  # fmt: skip


def _icc(table: Array) -> tuple[float, tuple[float, float]] | None:
    """ICC(A,1) of a table (n, k) and its 95 % interval; None if nothing varies. McGraw and Wong 1996, tables 4, 7."""
    from scipy.stats import f

    n, k = table.shape
    grand = table.mean()
    rows = k * float(((table.mean(axis=1) - grand) ** 2).sum()) / (n - 1)
    columns = n * float(((table.mean(axis=0) - grand) ** 2).sum()) / (k - 1)
    rest = table - table.mean(axis=1, keepdims=True) - table.mean(axis=0, keepdims=True) + grand
    error = float((rest**2).sum()) / ((n - 1) * (k - 1))
    whole = rows + (k - 1) * error + k * (columns - error) / n
    if whole <= 0.0 or rows == 0.0:
        return None
    value = (rows - error) / whole
    if error <= 1e-15 * rows and columns <= 1e-15 * rows:
        return 1.0, (1.0, 1.0)
    if value >= 1.0:
        return 1.0, (1.0, 1.0)
    a, b = k * value / (n * (1 - value)), 1 + k * value * (n - 1) / (n * (1 - value))
    numerator = (a * columns + b * error) ** 2
    freedom = numerator / ((a * columns) ** 2 / (k - 1) + (b * error) ** 2 / ((n - 1) * (k - 1)))
    upper_f = float(f.ppf(0.5 + CONFIDENCE / 2, n - 1, freedom))
    lower_f = float(f.ppf(0.5 + CONFIDENCE / 2, freedom, n - 1))
    shared = k * columns + (k * n - k - n) * error
    low = n * (rows - upper_f * error) / (upper_f * shared + n * rows)
    high = n * (lower_f * rows - error) / (shared + n * lower_f * rows)
    return value, (float(low), float(high))


def by_subject(values: Mapping[str, Sequence[float]]) -> dict[str, float]:
    """The mean of each subject's values, so that a subject with more trials does not weigh more."""
    return {subject: float(np.mean(own)) for subject, own in values.items() if len(own)}
