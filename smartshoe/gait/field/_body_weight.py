"""Checks the whole system by body weight: the mean total force over whole strides must equal it.

Momentum is the same at both ends of a stride, so the mean vertical ground force balances gravity. Only the share
``coverage`` of it passes through the units.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike

from smartshoe.arrays import Array
from smartshoe.errors import UsageError
from smartshoe.gait.field._finding import CheckResult, Verdict
from smartshoe.gait.field._swing_zero import WINDOW_S
from smartshoe.gait.field._swings import swings
from smartshoe.signals.masks import runs_of

TOLERANCE = 0.05
FEWEST_STRIDES = 3
SHORTEST_STRIDE_S, LONGEST_STRIDE_S = 0.4, 2.5
LEAST_RISE = 0.2  # of body weight: a smaller variation is sway
STANDING_BLOCK_S = 5.0  # sway has periods of seconds, so means over 5 s are nearly independent
FEWEST_BLOCKS = 3


def heel_strikes(foot_n: Array, sample_rate_hz: float, least_rise: float) -> list[int]:
    """The ends of one foot's swings, as indices of samples, to within the rise time of the heel's load."""
    window = round(WINDOW_S * sample_rate_hz)
    hop = max(1, window // 2)  # no swing is longer than half a window, so each lies completely in one of them
    found: list[int] = []
    for first in range(0, max(foot_n.size - window, 0) + hop, hop):
        for swing in swings(foot_n[first : first + window], sample_rate_hz, least_rise):
            at = first + swing.stop
            # Windows overlap: a swing found again ends within a few samples of the first time.
            if not found or at - found[-1] > 0.5 * SHORTEST_STRIDE_S * sample_rate_hz:
                found.append(at)
    return found


def check_body_weight(
    time_s: ArrayLike,
    feet_n: Mapping[str, ArrayLike],
    body_weight_n: float,
    *,
    coverage: float = 1.0,
    tolerance: float = TOLERANCE,
) -> CheckResult:
    """Check that the mean total force over whole strides (or standing) is ``coverage`` times ``body_weight_n``.

    ``time_s`` (n,) is evenly spaced; ``feet_n`` holds for each foot the sum over its units (n,) in N. The verdict is
    "ok" if the 95 % interval lies within ``tolerance`` of the expected force, "fault" if it lies outside, "warning" if
    it overlaps the limit, and "unknown" if there are neither strides nor standing, or only one foot. ``numbers``:
    mean_n, low_n, high_n, expected_n, ratio, strides.
    """
    if not (math.isfinite(body_weight_n) and body_weight_n > 0.0):
        raise UsageError(f"body weight is {body_weight_n:g} N: give a number above 0, for example 700")
    if not 0.0 < coverage <= 1.0:
        raise UsageError(f"coverage is {coverage:g}: give a share above 0, up to 1")
    time = np.asarray(time_s, dtype=float)
    feet = {name: np.asarray(values, dtype=float) for name, values in feet_n.items()}
    if not feet or any(values.shape != time.shape for values in feet.values()) or time.size < 2:
        raise UsageError("give the force of each foot, one number a sample, two samples at least")
    rate_hz = (time.size - 1) / float(time[-1] - time[0])
    total: Array = np.sum(list(feet.values()), axis=0)
    expected = coverage * body_weight_n
    span, samples, how = _whole_strides(feet, total, rate_hz, body_weight_n)
    if samples is None:
        samples, span, how = _standing(total, rate_hz, body_weight_n)
    if samples is None:
        return CheckResult(
            "body_weight", "unknown", "neither three whole strides nor 15 s of standing: body weight cannot be checked"
        )
    from scipy.stats import t

    mean = float(total[span].mean())
    half = float(t.ppf(0.975, samples.size - 1) * samples.std(ddof=1) / math.sqrt(samples.size))
    low, high = mean - half, mean + half
    numbers = {
        "mean_n": mean, "low_n": low, "high_n": high, "expected_n": expected, "ratio": mean / expected,
        "strides": float(samples.size) if how.endswith("strides") else 0.0,
    }  # fmt: skip
    where = (float(time[span.start]), float(time[min(span.stop, time.size) - 1]))
    seen = f"mean total force over {how} is {mean:.4g} N ({low:.4g} to {high:.4g})"
    if len(feet) == 1:
        (foot,) = feet
        says = f"{seen} under the {foot} foot alone, {100 * mean / expected:.3g} % of what both bear: give both shoes"
        return CheckResult("body_weight", "unknown", says, "", where, numbers)
    seen += f", {100 * mean / expected:.4g} % of the {expected:.4g} N expected"
    near, far = (1.0 - tolerance) * expected, (1.0 + tolerance) * expected
    verdict: Verdict = "ok" if near <= low and high <= far else "fault" if high < near or low > far else "warning"
    ends = {
        "ok": "",
        "warning": f": whether it keeps within {100 * tolerance:g} % is not sure yet, walk on",
        "fault": ": look for a unit that does not answer, a calibration of another unit, or another coverage",
    }
    return CheckResult("body_weight", verdict, seen + ends[verdict], "", where, numbers)


def _whole_strides(
    feet: Mapping[str, Array], total: Array, rate_hz: float, body_weight_n: float
) -> tuple[slice, Array | None, str]:
    """The longest chain of strides of one foot: its span, the mean total (strides,) of each, and a text for it."""
    best: list[int] = []
    for foot in feet.values():
        chain: list[int] = []
        for at in heel_strikes(foot, rate_hz, LEAST_RISE * body_weight_n):
            if chain and not SHORTEST_STRIDE_S <= (at - chain[-1]) / rate_hz <= LONGEST_STRIDE_S:
                chain = []
            chain.append(at)
            if len(chain) > len(best):
                best = list(chain)
    if len(best) - 1 < FEWEST_STRIDES:
        return slice(0, 0), None, ""
    means = np.add.reduceat(total[: best[-1]], best[:-1]) / np.diff(best)
    return slice(best[0], best[-1]), means, f"{len(best) - 1} strides"


def _standing(total: Array, rate_hz: float, body_weight_n: float) -> tuple[Array | None, slice, str]:
    """The longest spell of standing still, in blocks: the blocks' mean forces, its span, and a text for it."""
    from scipy.ndimage import uniform_filter1d

    second = max(1, round(rate_hz))
    level = uniform_filter1d(total, second)
    spread = np.sqrt(np.maximum(uniform_filter1d((total - level) ** 2, second), 0.0))
    still = (spread < LEAST_RISE / 4 * body_weight_n) & (level > LEAST_RISE * body_weight_n)
    # For a second at either end the force still shows the step on or off.
    runs = [(int(a) + second, int(b) - second) for a, b in zip(*runs_of(still), strict=True)]
    first, stop = max(runs, key=lambda run: run[1] - run[0], default=(0, 0))
    count = int((stop - first) / rate_hz / STANDING_BLOCK_S)
    if count < FEWEST_BLOCKS:
        return None, slice(0, 0), ""
    means = np.array([part.mean() for part in np.array_split(total[first:stop], count)])
    return means, slice(first, stop), f"{(stop - first) / rate_hz:.0f} s of standing"
