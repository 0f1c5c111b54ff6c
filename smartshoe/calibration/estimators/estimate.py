"""What every estimator gives: force with its standard deviation; and what the calibration alone contributes to it."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from smartshoe.errors import InputError

if TYPE_CHECKING:
    from smartshoe.calibration.calibration import Calibration

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class ForceEstimate:
    """``force_n`` (n,) in N, compression positive, and its standard deviation ``sd_n`` (n,) in N.

    The standard deviation has the reading's noise in it and the calibration's own uncertainty; it knows nothing of
    what the model leaves out (friction, leaks, drift).
    """

    force_n: Array
    sd_n: Array


class Estimator(ABC):
    """Readings of one unit, evenly sampled, to force with an error bar. Missing readings are a mask, never NaN."""

    name: str

    def __init__(self, calibration: Calibration) -> None:
        self.calibration = calibration
        self._gain_sd = gain_sd(calibration)

    def estimate(self, readings: ArrayLike, missing: Mask | None = None) -> ForceEstimate:
        """Force of the whole signal ``readings`` (n,) in the calibration's reading unit; ``missing`` (n,) is bool.

        Raises `InputError` for another shape, for a mask of another length and for readings that are not finite
        where the mask says they are there.
        """
        values = np.asarray(readings, dtype=float)
        if values.ndim != 1 or values.size == 0:
            raise InputError(f"readings have shape {values.shape}: give one number per sample, at least one")
        absent = np.zeros(values.size, dtype=bool) if missing is None else np.asarray(missing, dtype=bool)
        if absent.shape != values.shape:
            raise InputError(f"the mask of missing readings has shape {absent.shape}, they have {values.shape}")
        if not np.isfinite(values[~absent]).all():
            at = int(np.argmax(~np.isfinite(values) & ~absent))
            raise InputError(f"reading {at} is not finite: mask it as missing")
        if absent.all():
            raise InputError("every reading is missing: there is no force to estimate")
        force_n, sd_n = self._estimate(values, absent)
        return ForceEstimate(force_n, np.hypot(sd_n, self._gain_sd * force_n))

    @abstractmethod
    def _estimate(self, readings: Array, missing: Mask) -> tuple[Array, Array]:
        """Force (n,) and its standard deviation (n,) by the reading's noise alone, in N."""


def gain_sd(calibration: Calibration) -> float:
    """The standard deviation of the static gain b1/a1 over the gain; 0 where the covariance is not known."""
    names = list(calibration.parameters)
    if not calibration.covariance or not {"a1", "b1"} <= set(names) or calibration.b1 == 0.0:
        return 0.0
    slope = np.zeros(len(names))
    slope[names.index("b1")], slope[names.index("a1")] = 1.0 / calibration.b1, -1.0 / calibration.a1
    variance = float(slope @ np.asarray(calibration.covariance, dtype=float) @ slope)
    return float(np.sqrt(variance)) if np.isfinite(variance) and variance > 0.0 else 0.0
