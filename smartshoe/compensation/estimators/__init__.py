"""From readings to force with an error bar: static gain, phase lead, extended inverse, Kalman filter, smoother, IMM."""

from smartshoe.compensation.estimators.choice import NAMES, estimator
from smartshoe.compensation.estimators.estimate import Estimator, ForceEstimate

__all__ = ["NAMES", "Estimator", "ForceEstimate", "estimator"]
