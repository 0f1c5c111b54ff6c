"""Found forces against true ones."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from simulators.people import Trial
from smartshoe.gait import GaitResult

Array = NDArray[np.float64]


def total_error(found: GaitResult, made: Trial) -> float:
    """RMS error of the total as a share of body weight."""
    assert found.total_n is not None
    error_n = found.total_n - (made.total_n["left"] + made.total_n["right"])
    return float(np.sqrt(np.mean(error_n**2))) / made.person.body_weight_n


def peak_errors(found: GaitResult, made: Trial) -> Array:
    """Errors of the humps of each stride as shares of the true ones: two in walking, one in running."""
    errors = []
    for stride in found.strides:
        course = found.feet[stride.foot]
        assert course.force_n is not None
        first, last = np.searchsorted(course.time_s, [stride.start_s, stride.toe_off_s])
        middle = (first + last) // 2
        for a, b in ((first, last),) if stride.runs else ((first, middle), (middle, last)):
            errors.append(course.force_n[a:b].max() / made.total_n[stride.foot][a:b].max() - 1.0)
    return np.array(errors)
