"""Whether a reading is what the load adds up to: a position that a force moves against a damper, a tank that fills."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from smartshoe.diagnosis._session import Session, fitted_of
from smartshoe.display import percent
from smartshoe.integrity.thresholds import Thresholds
from smartshoe.signals.lags import left_by


def limit_integral(sessions: Sequence[Session], thresholds: Thresholds) -> list[str]:
    """The sentence on fitted readings that move with the load's integral far more (``clear``) than with the load.

    Both are fitted together, by one gain each, beside a line in time for each session, and explain most of the
    readings' variance. What creeps, leaks or warms moves far less with the integral, and of what is late by a quarter
    of a period the two explain little, unless the load is all but one sine. Most of the load must be no line itself: a
    single ramp, whose integral is a bow, tells no integral from a curve.
    """
    if thresholds.clear * _share_beyond_lines(sessions) < 1.0:
        return []
    of_load, of_integral, explained = _shares(sessions)
    if of_integral <= thresholds.clear * of_load or thresholds.clear * explained < 1.0:
        return []
    return [
        f"the reading goes with what the load adds up to (its integral) by {percent(of_integral)} of full scale, rms,"
        f" and with the load by {percent(of_load)} (the two explain {percent(explained)} of its variance), as a"
        " position does that a force moves against a damper, or a sensor far slower than its load; no effect of a"
        " pressed unit does, so that none is more than half sure (diagnose the reading's rate of change, or hold each"
        " load until the reading stands)"
    ]


def _share_beyond_lines(sessions: Sequence[Session]) -> float:
    """The share of the load's variance that a line in time of each session leaves."""
    left = total = 0.0
    for one in fitted_of(sessions):
        load, time_s = one.conditions.load[one.fitted], one.conditions.time_s[one.fitted]
        total += float(np.sum((load - load.mean()) ** 2))
        left += float(np.sum(left_by(np.column_stack([np.ones(load.size), time_s]), load[:, None]) ** 2))
    return left / max(total, 1e-300)


def _shares(sessions: Sequence[Session]) -> tuple[float, float, float]:
    """Rms by which the readings move with load and with integral, shares of full scale, and the variance explained."""
    products, target, total, count = np.zeros((2, 2)), np.zeros(2), 0.0, 0
    for one in fitted_of(sessions):
        load, mask = one.conditions.load, one.fitted
        integral = np.cumsum(load - np.mean(load)) * one.conditions.step_s
        lines = np.column_stack([np.ones(load.size), one.conditions.time_s])[mask]
        columns = left_by(lines, np.column_stack([load, integral, one.reading])[mask])
        inner = columns.T @ columns
        products, target, total = products + inner[:2, :2], target + inner[:2, 2], total + float(inner[2, 2])
        count += int(np.count_nonzero(mask))
    gains = np.linalg.lstsq(products, target, rcond=None)[0]
    of_load, of_integral = np.abs(gains) * np.sqrt(np.diag(products) / max(count, 1))
    return float(of_load), float(of_integral), float(gains @ target) / max(total, 1e-300)
