"""Interacting multiple models: a unit under load and a unit in the air, mixed by how likely each is (filterpy)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from smartshoe.calibration.estimators.estimate import Array, Estimator, Mask
from smartshoe.calibration.estimators.kalman import ahead, filter_of, prepared
from smartshoe.calibration.estimators.state_space import contact_model, swing_model

if TYPE_CHECKING:
    from smartshoe.calibration.calibration import Calibration

STANCE_S, SWING_S = 0.6, 0.4  # how long either lasts on average, at a walk
FALL_S = 0.02  # within which a load is gone that the foot takes off
RESIDUAL = 0.002  # of the largest load: what a lace and a sock press in the air
LEAST_CHANCE = 1e-12  # of a model: below it neither would come back


class InteractingModels(Estimator):
    """Two Kalman filters, contact and swing, whose probabilities the readings tell (Bar-Shalom 2001, section 11.6)."""

    name = "imm"

    def __init__(
        self,
        calibration: Calibration,
        sample_rate_hz: float,
        *,
        noise_sd: float | None = None,
        density: float | None = None,
    ) -> None:
        super().__init__(calibration)
        self.sample_rate_hz, self._noise_sd, self._density = sample_rate_hz, noise_sd, density
        self.contact: Array = np.zeros(0)
        """(n,) probability of contact at each sample of the last estimate."""

    def _estimate(self, readings: Array, missing: Mask) -> tuple[Array, Array]:
        from filterpy.kalman import IMMEstimator

        c, rate_hz = self.calibration, self.sample_rate_hz
        values, noise_sd, density = prepared(c, rate_hz, readings, missing, self._noise_sd, self._density)
        largest_n = c.b1 / c.a1 * float(np.max(np.abs(values)))
        filters = [
            filter_of(contact_model(c, rate_hz, density, noise_sd), c, values),
            filter_of(swing_model(c, rate_hz, RESIDUAL * largest_n, FALL_S, noise_sd), c, values),
        ]
        leave, land = 1.0 / (STANCE_S * rate_hz), 1.0 / (SWING_S * rate_hz)
        mixed = IMMEstimator(filters, [0.5, 0.5], np.array([[1.0 - leave, leave], [land, 1.0 - land]]))
        look = ahead(c)
        force_n, sd_n, contact = np.empty(values.size), np.empty(values.size), np.empty(values.size)
        for k, value in enumerate(values):
            if k > 0:
                mixed.predict()
            if not missing[k]:
                mixed.update(value)
                # A model that is ruled out to the last bit has no likelihood left to come back with.
                mixed.mu = np.maximum(mixed.mu, LEAST_CHANCE)
                mixed.mu /= mixed.mu.sum()
            force_n[k], sd_n[k] = look @ mixed.x[:, 0], np.sqrt(max(look @ mixed.P @ look, 0.0))
            contact[k] = mixed.mu[0]
        self.contact = contact
        return force_n, sd_n
