"""Interacting multiple models: a loaded unit and an unloaded one, weighted by their likelihood (filterpy)."""

from __future__ import annotations

from typing import Any

import numpy as np

from smartshoe.arrays import Array, Mask
from smartshoe.calibration.estimators._estimate import ForceEstimate, ForceRun
from smartshoe.calibration.estimators._kalman import KalmanEstimator, ahead, filter_of, straight
from smartshoe.calibration.estimators._state_space import contact_model, swing_model

STANCE_S, SWING_S = 0.6, 0.4  # average durations when walking
FALL_S = 0.02  # within which the load vanishes when the foot is lifted
RESIDUAL = 0.002  # of the largest load: pressure of lace and sock in the air
LEAST_CHANCE = 1e-12  # of a model: less could never recover


class InteractingModels(KalmanEstimator):
    """Two Kalman filters, contact and swing, with probabilities from the readings (Bar-Shalom 2001, section 11.6)."""

    def _run(self, density: float, noise_sd: float, largest: float) -> InteractingRun:
        return InteractingRun(self, density, noise_sd, largest)


class InteractingRun(ForceRun):
    """The two filters while running.

    ``contact`` (n,) is the probability of contact at each sample of the last block.
    """

    def __init__(self, kind: InteractingModels, density: float, noise_sd: float, largest: float) -> None:
        c, rate_hz = kind.calibration, kind.sample_rate_hz
        self._calibration, self._rate_hz, self._largest = c, rate_hz, largest
        self._models = (
            contact_model(c, rate_hz, density, noise_sd),
            swing_model(c, rate_hz, RESIDUAL * (c.b1 / c.a1 * largest), FALL_S, noise_sd),
        )
        self._mixed: Any = None
        self.contact: Array = np.zeros(0)

    def _begun(self, first: float) -> Any:
        from filterpy.kalman import IMMEstimator

        filters = [filter_of(model, self._calibration, first, self._largest) for model in self._models]
        leave, land = 1.0 / (STANCE_S * self._rate_hz), 1.0 / (SWING_S * self._rate_hz)
        return IMMEstimator(filters, [0.5, 0.5], np.array([[1.0 - leave, leave], [land, 1.0 - land]]))

    def push(self, readings: Array, missing: Mask) -> ForceEstimate:
        """The forces of the next readings."""
        values = straight(readings, missing) - self._calibration.offset
        look = ahead(self._calibration)
        force_n, sd_n, self.contact = np.empty(values.size), np.empty(values.size), np.empty(values.size)
        for k, value in enumerate(values):
            if self._mixed is None:
                self._mixed = self._begun(value)
            else:
                self._mixed.predict()
            mixed = self._mixed
            if not missing[k]:
                mixed.update(value)
                # A model whose probability has become exactly zero could never recover.
                mixed.mu = np.maximum(mixed.mu, LEAST_CHANCE)
                mixed.mu /= mixed.mu.sum()
            force_n[k], sd_n[k] = look @ mixed.x[:, 0], np.sqrt(max(look @ mixed.P @ look, 0.0))
            self.contact[k] = mixed.mu[0]
        return ForceEstimate(force_n, sd_n)


ESTIMATOR = InteractingModels
