"""Recordings whose readings lag behind their loads by times of their own, too short to be seen before any model.

Where load and reading are logged by two devices, started by hand and joined file by file, their clocks differ by some
tens of milliseconds, and in each file by others. One delay for all files cannot follow that, and other effects would.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import chdtri, stdtrit

from smartshoe.arrays import Array
from smartshoe.diagnosis._noise import effective_noise_sd
from smartshoe.diagnosis._sensitivity import nuisances
from smartshoe.diagnosis._session import Session
from smartshoe.integrity.thresholds import Thresholds
from smartshoe.models.extended import ExtendedModel


@dataclass(frozen=True)
class OwnLags:
    """By how much the reading of each recording is later than its load, in s, by the recordings' places.

    ``are_about_mean``: the fitted recordings share a delay, which is left to a model; the lags are about it.
    """

    each_s: Mapping[int, float]
    are_about_mean: bool


def own_lags(sessions: Sequence[Session], model: ExtendedModel, thresholds: Thresholds) -> OwnLags | None:
    """The recordings' own lags beside ``model``, or None where one delay serves all.

    Those of the fitted recordings must differ for certain (chi-square of their distances from the mean, at
    ``false_alarm``), and by what moves the reading by more than ``tolerable``. A delay that all share is the unit's
    where their mean differs from zero (Student's t, 95 %); else it may be the clocks' as well, and is in the lags.
    """
    usable = [one for one in sessions if one.usable.any()]
    is_fitted = np.array([bool(one.fitted.any()) for one in usable])
    count = int(is_fitted.sum())
    if count < 2 or any("continues" in one.recording.metadata for one in usable):
        return None
    lags_s, squares, sds, _ = np.transpose([_lag_of(one, model) for one in usable])
    fitted_s, weights = lags_s[is_fitted], sds[is_fitted] ** -2
    off_s = fitted_s - weights @ fitted_s / weights.sum()
    samples = sum(int(one.fitted.sum()) for one in usable)
    moved_rms = np.sqrt(squares[is_fitted] @ off_s**2 / samples)
    if weights @ off_s**2 <= chdtri(count - 1, thresholds.false_alarm) or moved_rms <= thresholds.tolerable:
        return None
    lags_s += sum(part.effect.delay_s(part.values) for part in model.parts)
    mean_s = float(np.mean(lags_s[is_fitted]))
    mean_sd_s = float(np.std(lags_s[is_fitted], ddof=1)) / math.sqrt(count)
    are_about_mean = abs(mean_s) > float(stdtrit(count - 1, 0.975)) * mean_sd_s
    lags_s -= are_about_mean * mean_s
    return OwnLags({one.index: float(lag_s) for one, lag_s in zip(usable, lags_s, strict=True)}, are_about_mean)


def lags_of_judged(sessions: Sequence[Session], model: ExtendedModel, thresholds: Thresholds) -> dict[int, float]:
    """By how much each held-out recording is later in s than the fitted ones, by its place; only those that are.

    It must differ from the fitted recordings' mean for certain (chi-square, `false_alarm`), and without it the reading
    would be off by more than ``tolerable`` and by more than half of the squares (`clear`): a recording that judges is
    judged on its own clock, as with its own offset.
    """
    judged = [one for one in sessions if one.judged.any() and not one.fitted.any()]
    fitted = [one for one in sessions if one.fitted.any()]
    if not (judged and fitted):
        return {}
    lags_s, _, sds, _ = np.transpose([_lag_of(one, model) for one in fitted])
    weights = sds**-2
    mean_s, variance = weights @ lags_s / weights.sum(), 1.0 / weights.sum()
    found = {}
    for one in judged:
        lag_s, squares, sd_s, left = _lag_of(one, model)
        off_s = float(lag_s - mean_s)
        moved = squares * off_s**2
        is_certain = off_s**2 > chdtri(1, thresholds.false_alarm) * (sd_s**2 + variance)
        is_most = moved > (thresholds.clear - 1.0) * left
        if is_certain and is_most and moved > thresholds.tolerable**2 * int(one.judged.sum()):
            found[one.index] = off_s
    return found


def _lag_of(session: Session, model: ExtendedModel) -> Array:
    """(4,) by how much the reading is later than the model's in s, the sum of squared slopes, the lag's deviation.

    The last is the sum of the squares that are left.

    By least squares beside the recording's own nuisances, with noise counted once per correlation time. Four steps of
    Gauss and Newton, since the slopes of a late reading are late too.
    """
    mask = session.fitted if session.fitted.any() else session.usable
    time_s, simulated = session.conditions.time_s, model.simulate(session.conditions)
    own = np.linalg.qr(nuisances(session, model.pole_per_s, simulated)[mask])[0]
    lag_s, rest = 0.0, np.zeros(session.reading.size)
    for _ in range(4):
        late = np.interp(time_s - lag_s, time_s, simulated)
        falls, left = -np.gradient(late, time_s)[mask], (session.reading - late)[mask]
        falls, left = (one - own @ (own.T @ one) for one in (falls, left))
        squares = max(float(falls @ falls), 1e-300)
        step_s = float(falls @ left) / squares
        lag_s += step_s
    rest[mask] = left - step_s * falls
    return np.array([lag_s, squares, effective_noise_sd([rest], [mask]) / np.sqrt(squares), rest @ rest])
