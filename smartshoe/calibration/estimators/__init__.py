"""From readings to force with an error bar: static gain, phase lead, extended inverse, Kalman filter, smoother, IMM."""

from smartshoe.calibration.estimators.choice import NAMES, estimator
from smartshoe.calibration.estimators.estimate import Estimator, ForceEstimate

__all__ = ["NAMES", "Estimator", "ForceEstimate", "estimator"]
