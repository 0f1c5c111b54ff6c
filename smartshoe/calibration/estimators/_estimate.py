"""The interface of all estimators: force with its standard deviation, including the calibration's own uncertainty."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from smartshoe.arrays import Array, Mask
from smartshoe.errors import InputError

if TYPE_CHECKING:
    from smartshoe.calibration._calibration import Calibration


@dataclass(frozen=True, eq=False)
class ForceEstimate:
    """``force_n`` (n,) in N, compression positive, and its standard deviation ``sd_n`` (n,) in N.

    The standard deviation covers the reading's noise and the calibration's own uncertainty, but not what the model
    leaves out (friction, leaks, drift).
    """

    force_n: Array
    sd_n: Array


class ForceRun(ABC):
    """A running estimator: takes readings block by block, returns forces, possibly with a delay."""

    @abstractmethod
    def push(self, readings: Array, missing: Mask) -> ForceEstimate:
        """The forces that these readings complete; their error bars cover the reading's noise only."""

    def finish(self) -> ForceEstimate:
        """The remaining forces at the end of the readings; empty where none are pending."""
        return ForceEstimate(np.zeros(0), np.zeros(0))


class Estimator(ABC):
    """Force with an error bar from evenly sampled readings of one unit. Missing readings are a mask, never NaN.

    Subclasses write `begin` and the run it returns; whole signals and streams use the same run. ``noise_sd``, in the
    reading's unit, is estimated from the readings where it is None.
    """

    def __init__(self, calibration: Calibration, sample_rate_hz: float, *, noise_sd: float | None = None) -> None:
        self.calibration, self.sample_rate_hz, self.noise_sd = calibration, sample_rate_hz, noise_sd

    def estimate(self, readings: ArrayLike, missing: Mask | None = None) -> ForceEstimate:
        """Force of the whole signal ``readings`` (n,) in the calibration's reading unit; ``missing`` (n,) is bool.

        Raises `InputError` for another shape, for a mask of another length, and for readings that are not finite
        although the mask does not mark them as missing.
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
        run = self.begin(values, absent)
        found = (run.push(values, absent), run.finish())
        force_n = np.concatenate([one.force_n for one in found])
        sd_n = np.concatenate([one.sd_n for one in found])
        return ForceEstimate(force_n, np.hypot(sd_n, gain_sd(self.calibration) * force_n))

    @abstractmethod
    def begin(self, readings: Array, missing: Mask) -> ForceRun:
        """A run in its initial state.

        Noise and load statistics that it needs are estimated from these readings (n,).
        """


def gain_sd(calibration: Calibration) -> float:
    """Relative standard deviation of the static gain b1/a1; 0 where the covariance is not known."""
    names = list(calibration.parameters)
    if not calibration.covariance or not {"a1", "b1"} <= set(names) or calibration.b1 == 0.0:
        return 0.0
    slope = np.zeros(len(names))
    slope[names.index("b1")], slope[names.index("a1")] = 1.0 / calibration.b1, -1.0 / calibration.a1
    variance = float(slope @ np.asarray(calibration.covariance, dtype=float) @ slope)
    return float(np.sqrt(variance)) if np.isfinite(variance) and variance > 0.0 else 0.0
