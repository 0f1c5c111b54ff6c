"""Force with error bars from readings: static gain, phase lead, extended inverse, Kalman filter, smoother, IMM."""

from smartshoe.calibration.estimators._estimate import Estimator, ForceEstimate, ForceRun, gain_sd
from smartshoe.calibration.estimators.methods import estimator, estimator_names, require_known

__all__ = ["Estimator", "ForceEstimate", "ForceRun", "estimator", "estimator_names", "gain_sd", "require_known"]
