"""The common base of a unit's Kalman filters, streaming and smoothed; the filters themselves are filterpy's."""

from __future__ import annotations

from abc import abstractmethod
from typing import TYPE_CHECKING, Any

import numpy as np

from smartshoe.arrays import Array, Mask
from smartshoe.calibration.estimators._estimate import Estimator, ForceEstimate, ForceRun
from smartshoe.calibration.estimators._reading_noise import reading_noise_sd
from smartshoe.calibration.estimators._state_space import (
    LOAD,
    RATE,
    STRAIN,
    StateSpace,
    likely_density,
)

if TYPE_CHECKING:
    from smartshoe.calibration._calibration import Calibration

UNKNOWN_N = 1e3  # sd of the first load
UNKNOWN_N_PER_S = 1e4
UNSETTLED = 0.1  # of the largest load: sd of the solid's initial distance from equilibrium
MOST_DELAY_S = 0.01  # that a sensor, its hose and its converter may cause
LEAST_NOISE = 1e-6  # of the signal: without any noise a Kalman filter has no gain to compute


def filter_of(model: StateSpace, calibration: Calibration, first: float, largest: float) -> Any:
    """A filterpy ``KalmanFilter`` of ``model`` in its initial state.

    ``first`` and ``largest`` reading are less the offset. The solid starts near equilibrium under an unknown first
    load: its strain equals that load within `UNSETTLED` of the largest load.
    """
    from filterpy.kalman import KalmanFilter

    found = KalmanFilter(dim_x=3, dim_z=1)
    found.F, found.Q, found.H, found.R = model.transition, model.process, model.output, np.array([[model.noise]])
    gain = calibration.b1 / calibration.a1
    first_n, unsettled_n = gain * first, UNSETTLED * gain * largest
    found.x = np.array([[first_n], [0.0], [first_n]])
    found.P = np.zeros((3, 3))
    found.P[np.ix_((LOAD, STRAIN), (LOAD, STRAIN))] = UNKNOWN_N**2
    found.P[STRAIN, STRAIN] += unsettled_n**2
    found.P[RATE, RATE] = UNKNOWN_N_PER_S**2
    return found


class KalmanEstimator(Estimator):
    """The common base of estimators over the state of `smartshoe.calibration.estimators._state_space`.

    The reading's noise and the spectral ``density`` of the load's random walk in N²/s³ are estimated from the readings
    where they are None. A missing reading is a step without an update, so the error bar grows. Unlike in the paper's
    filter, the delay that the calibration found between load and reading is compensated (`ahead`).
    """

    def __init__(
        self,
        calibration: Calibration,
        sample_rate_hz: float,
        *,
        noise_sd: float | None = None,
        density: float | None = None,
    ) -> None:
        super().__init__(calibration, sample_rate_hz, noise_sd=noise_sd)
        self._density = density

    def begin(self, readings: Array, missing: Mask) -> ForceRun:
        """A run of the filters; noise, density and largest reading are estimated from these readings."""
        values = straight(readings, missing) - self.calibration.offset
        largest = float(np.max(np.abs(values)))
        least = LEAST_NOISE * largest or LEAST_NOISE
        noise_sd = max(reading_noise_sd(readings, missing) if self.noise_sd is None else self.noise_sd, least)
        density = self._density
        if density is None:
            density = likely_density(self.calibration, self.sample_rate_hz, values, noise_sd)
        return self._run(density, noise_sd, largest)

    @abstractmethod
    def _run(self, density: float, noise_sd: float, largest: float) -> ForceRun: ...


class KalmanRun(ForceRun):
    """A running Kalman filter of ``model``; with ``lag`` samples, also its smoother.

    The smoother runs backwards over the stored samples (Rauch, Tung and Striebel 1965); a force is given out once
    ``lag`` later readings are known.
    """

    def __init__(self, model: StateSpace, calibration: Calibration, largest: float, lag: int | None = None) -> None:
        self._model, self._calibration, self._largest, self._lag = model, calibration, largest, lag
        self._filter: Any = None
        self._held = (np.zeros((0, 3, 1)), np.zeros((0, 3, 3)))

    def push(self, readings: Array, missing: Mask) -> ForceEstimate:
        """The forces that become known with these readings."""
        if readings.size:
            values = straight(readings, missing) - self._calibration.offset
            if self._filter is None:
                self._filter = filter_of(self._model, self._calibration, values[0], self._largest)
            measured: list[float | None] = values.tolist()
            for at in np.flatnonzero(missing):
                measured[at] = None
            found = self._filter.batch_filter(measured, update_first=True)
            self._held = (np.concatenate([self._held[0], found[0]]), np.concatenate([self._held[1], found[1]]))
        return self._estimated(0 if self._lag is None else self._lag)

    def finish(self) -> ForceEstimate:
        """The forces that are still waiting for later readings."""
        return self._estimated(0)

    def _estimated(self, waiting: int) -> ForceEstimate:
        means, covariances = self._held
        count = max(len(means) - waiting, 0)
        if self._lag is not None and count:
            # filterpy's smoother takes the transition of each sample, which is the same for all.
            means, covariances, _, _ = self._filter.rts_smoother(means, covariances)
        self._held = (self._held[0][count:], self._held[1][count:])
        look = ahead(self._calibration)
        variance = np.einsum("i,nij,j->n", look, covariances[:count], look)
        return ForceEstimate(means[:count, :, 0] @ look, np.sqrt(np.maximum(variance, 0.0)))


def straight(readings: Array, missing: Mask) -> Array:
    """Readings (n,) with missing samples interpolated linearly; zeros where all are missing."""
    at = np.arange(readings.size)
    return np.interp(at, at[~missing], readings[~missing]) if not missing.all() else np.zeros(readings.size)


def ahead(calibration: Calibration) -> Array:
    """The row (3,) that gives the present load from a state, where the reading lags by the calibration's delay.

    The state is the load that the reading shows; its rate extrapolates to the present. A delay of more than
    `MOST_DELAY_S` is not the sensor's but that of two clocks during the calibration, and is ignored.
    """
    look = np.zeros(3)
    look[LOAD] = 1.0
    look[RATE] = calibration.delay_s if abs(calibration.delay_s) <= MOST_DELAY_S else 0.0
    return look
