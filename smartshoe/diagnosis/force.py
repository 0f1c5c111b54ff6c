"""Error of the force that a model's compensator gives, on held-out data."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from smartshoe.compensation.extended import ExtendedCompensator
from smartshoe.diagnosis.session import Session
from smartshoe.models.extended import ExtendedModel


def force_rmse_n(fine: Sequence[Session], model: ExtendedModel) -> float:
    """Root mean square error in N of the compensated force against the measured load; NaN where nothing is held out."""
    total, count = 0.0, 0
    for session in fine:
        judged = session.judged
        if not judged.any():
            continue
        compensator = ExtendedCompensator(model, 1.0 / session.conditions.step_s)
        force_n = compensator.apply(session.reading * model.full_scale_reading)
        off = (force_n - session.conditions.load * model.full_scale_load_n)[judged]
        total += float(off @ off)
        count += off.size
    return float(np.sqrt(total / count)) if count else float("nan")
