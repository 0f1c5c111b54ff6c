"""The estimator ``inverse``: the inverse of an extended model."""

from __future__ import annotations

from typing import Any

from smartshoe.calibration._filter import ForceFilter
from smartshoe.calibration.estimators._filtered import Filtered
from smartshoe.errors import UsageError


class ExtendedInverse(Filtered):
    """The calibration's own compensator; raises `UsageError` where the calibration has no extended model."""

    def __init__(self, *args: Any, **options: Any) -> None:
        super().__init__(*args, **options)
        if self.calibration.extended is None:
            raise UsageError(
                f"the calibration of {self.calibration.unit or 'this unit'} has no extended model to invert: make one"
                " with smartshoe diagnose --calibration, or use the estimator 'lead'"
            )

    def force_filter(self) -> ForceFilter:
        """The calibration's compensator in its initial state."""
        return self.calibration.compensator(self.sample_rate_hz)


ESTIMATOR = ExtendedInverse
