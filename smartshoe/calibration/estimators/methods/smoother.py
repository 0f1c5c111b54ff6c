"""The estimator ``smoother`` (Rauch-Tung-Striebel): force from past and future readings."""

from __future__ import annotations

from smartshoe.calibration.estimators._kalman import KalmanEstimator, KalmanRun
from smartshoe.calibration.estimators._state_space import contact_model

LAG_S = 2.0  # how long a stream waits: later readings carry no information about a load


class Smoother(KalmanEstimator):
    """The Kalman filter's states, corrected by later readings."""

    def _run(self, density: float, noise_sd: float, largest: float) -> KalmanRun:
        model = contact_model(self.calibration, self.sample_rate_hz, density, noise_sd)
        return KalmanRun(model, self.calibration, largest, round(LAG_S * self.sample_rate_hz))


ESTIMATOR = Smoother
