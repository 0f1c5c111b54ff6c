"""Recordings whose readings lag behind their loads by times of their own, too short to be seen before any model.

Where load and reading are logged by two devices, started by hand and joined file by file, their clocks differ by some
tens of milliseconds, and in each file by others. One delay for all files cannot follow that, and other effects would.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from scipy.stats import chi2

from smartshoe.arrays import Array
from smartshoe.diagnosis._noise import effective_noise_sd
from smartshoe.diagnosis._sensitivity import nuisances
from smartshoe.diagnosis._session import Session
from smartshoe.integrity.thresholds import Thresholds
from smartshoe.models.extended import ExtendedModel


def own_lags(sessions: Sequence[Session], model: ExtendedModel, thresholds: Thresholds) -> Mapping[int, float]:
    """By how much the reading of each recording is later than the load, in s; empty where one delay serves all.

    The fitted recordings' lags must differ for certain (chi-square of their distances from the mean, at
    ``false_alarm``), and by what moves the reading more than an ``imperfection``. Then the clocks may also be late in
    all recordings, so that the lags include the delay of the ``model``. The keys are the recordings' places.
    """
    usable = [one for one in sessions if one.usable.any()]
    is_fitted = np.array([bool(one.fitted.any()) for one in usable])
    count = int(is_fitted.sum())
    if count < 2 or any("continues" in one.recording.metadata for one in usable):
        return {}
    lags_s, squares, sds = np.transpose([_lag_of(one, model) for one in usable])
    fitted_s, weights = lags_s[is_fitted], sds[is_fitted] ** -2
    off_s = fitted_s - weights @ fitted_s / weights.sum()
    samples = sum(int(one.fitted.sum()) for one in usable)
    moved_rms = np.sqrt(squares[is_fitted] @ off_s**2 / samples)
    if weights @ off_s**2 <= chi2.isf(thresholds.false_alarm, count - 1) or moved_rms <= thresholds.imperfection:
        return {}
    delay_s = sum(part.effect.delay_s(part.values) for part in model.parts)
    return {one.index: float(lag_s) + delay_s for one, lag_s in zip(usable, lags_s, strict=True)}


def _lag_of(session: Session, model: ExtendedModel) -> Array:
    """(3,) by how much the reading is later than the model's in s, the sum of squared slopes, and the lag's deviation.

    By least squares beside the recording's own nuisances, with noise counted once per correlation time; by two steps of
    Gauss and Newton, since the slopes of a late reading are late too.
    """
    mask = session.fitted if session.fitted.any() else session.usable
    time_s, simulated = session.conditions.time_s, model.simulate(session.conditions)
    own = np.linalg.qr(nuisances(session, model.pole_per_s, simulated)[mask])[0]
    lag_s, rest = 0.0, np.zeros(session.reading.size)
    for _ in range(2):
        late = np.interp(time_s - lag_s, time_s, simulated)
        falls, left = -np.gradient(late, time_s)[mask], (session.reading - late)[mask]
        falls, left = (one - own @ (own.T @ one) for one in (falls, left))
        squares = max(float(falls @ falls), 1e-300)
        step_s = float(falls @ left) / squares
        lag_s += step_s
    rest[mask] = left - step_s * falls
    return np.array([lag_s, squares, effective_noise_sd([rest], [mask]) / np.sqrt(squares)])
