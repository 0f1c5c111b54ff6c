"""The estimator ``lead``: the paper's phase lead, Chinimilli 2016 (13)."""

from smartshoe.calibration.estimators._filtered import Filtered

ESTIMATOR = Filtered
