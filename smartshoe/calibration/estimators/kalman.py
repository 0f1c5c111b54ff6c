"""The Kalman filter (streaming) and the Rauch-Tung-Striebel smoother of a unit, by filterpy."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from smartshoe.calibration.estimators.estimate import Array, Estimator, Mask
from smartshoe.calibration.estimators.reading_noise import reading_noise_sd
from smartshoe.calibration.estimators.state_space import (
    LOAD,
    RATE,
    STRAIN,
    StateSpace,
    contact_model,
    likely_density,
)

if TYPE_CHECKING:
    from smartshoe.calibration.calibration import Calibration

UNKNOWN_N = 1e3  # sd of the first load
UNKNOWN_N_PER_S = 1e4
UNSETTLED = 0.1  # of the largest load: sd of what the solid has not yet followed of the first load
MOST_DELAY_S = 0.01  # of a sensor, its hose and its converter
LEAST_NOISE = 1e-6  # of the signal: without any noise a Kalman filter has no gain to compute


def filter_of(model: StateSpace, calibration: Calibration, values: Array) -> Any:
    """A filterpy ``KalmanFilter`` of ``model`` before the first of ``values`` (n,), which are less their offset.

    The solid is near rest under an unknown first load: its strain is that load within `UNSETTLED` of the largest.
    """
    from filterpy.kalman import KalmanFilter

    found = KalmanFilter(dim_x=3, dim_z=1)
    found.F, found.Q, found.H, found.R = model.transition, model.process, model.output, np.array([[model.noise]])
    gain = calibration.b1 / calibration.a1
    first_n, unsettled_n = gain * values[0], UNSETTLED * gain * float(np.max(np.abs(values)))
    found.x = np.array([[first_n], [0.0], [first_n]])
    found.P = np.zeros((3, 3))
    found.P[np.ix_((LOAD, STRAIN), (LOAD, STRAIN))] = UNKNOWN_N**2
    found.P[STRAIN, STRAIN] += unsettled_n**2
    found.P[RATE, RATE] = UNKNOWN_N_PER_S**2
    return found


class Kalman(Estimator):
    """Force and its variance from the past ("kalman"), or from past and future ("smoother").

    ``noise_sd`` in the reading's unit and ``density`` of the load's wandering in N²/s³ are found from the readings
    where they are None. A missing reading is a step without an update: the error bar grows. The delay that the
    calibration found between load and reading is undone (`ahead`), which the paper's filter leaves in.
    """

    def __init__(
        self,
        calibration: Calibration,
        sample_rate_hz: float,
        *,
        smooth: bool,
        noise_sd: float | None = None,
        density: float | None = None,
    ) -> None:
        super().__init__(calibration)
        self.name = "smoother" if smooth else "kalman"
        self.sample_rate_hz, self._smooth = sample_rate_hz, smooth
        self._noise_sd, self._density = noise_sd, density

    def _estimate(self, readings: Array, missing: Mask) -> tuple[Array, Array]:
        values, noise_sd, density = prepared(
            self.calibration, self.sample_rate_hz, readings, missing, self._noise_sd, self._density
        )
        model = contact_model(self.calibration, self.sample_rate_hz, density, noise_sd)
        found = filter_of(model, self.calibration, values)
        measured: list[float | None] = values.tolist()
        for at in np.flatnonzero(missing):
            measured[at] = None
        means, covariances, _, _ = found.batch_filter(measured, update_first=True)
        if self._smooth:
            # filterpy steps back with the transition of each sample: the same one everywhere.
            means, covariances, _, _ = found.rts_smoother(means, covariances)
        look = ahead(self.calibration)
        variance = np.einsum("i,nij,j->n", look, covariances, look)
        return means[:, :, 0] @ look, np.sqrt(np.maximum(variance, 0.0))


def ahead(calibration: Calibration) -> Array:
    """The row (3,) by which a state gives the load now, where the reading comes late by the calibration's delay.

    The state is the load that the reading shows; its rate tells what came since. A delay of more than `MOST_DELAY_S`
    is no sensor's but that of two clocks at the calibration, and is left alone.
    """
    look = np.zeros(3)
    look[LOAD] = 1.0
    look[RATE] = calibration.delay_s if abs(calibration.delay_s) <= MOST_DELAY_S else 0.0
    return look


def prepared(
    calibration: Calibration,
    sample_rate_hz: float,
    readings: Array,
    missing: Mask,
    noise_sd: float | None,
    density: float | None,
) -> tuple[Array, float, float]:
    """Readings (n,) less the offset, straight over what is missing; their noise; the load's spectral density."""
    at = np.arange(readings.size)
    values = np.interp(at, at[~missing], readings[~missing]) - calibration.offset
    least = LEAST_NOISE * float(np.max(np.abs(values))) or LEAST_NOISE
    sd = max(reading_noise_sd(readings, missing) if noise_sd is None else noise_sd, least)
    q = likely_density(calibration, sample_rate_hz, values, sd) if density is None else density
    return values, sd, q
