"""The estimator ``kalman``: force from past readings, with an error bar that follows the load."""

from __future__ import annotations

from smartshoe.calibration.estimators._kalman import KalmanEstimator, KalmanRun
from smartshoe.calibration.estimators._state_space import contact_model


class Kalman(KalmanEstimator):
    """A Kalman filter of a load whose rate is a random walk, observed through the solid."""

    def _run(self, density: float, noise_sd: float, largest: float) -> KalmanRun:
        model = contact_model(self.calibration, self.sample_rate_hz, density, noise_sd)
        return KalmanRun(model, self.calibration, largest)


ESTIMATOR = Kalman
