"""What every estimator gives: force with its standard deviation; and what the calibration alone contributes to it."""

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

    The standard deviation has the reading's noise in it and the calibration's own uncertainty; it knows nothing of
    what the model leaves out (friction, leaks, drift).
    """

    force_n: Array
    sd_n: Array


class ForceRun(ABC):
    """An estimator under way: readings (n,) in, block after block, forces out, those of the last ones maybe later."""

    @abstractmethod
    def push(self, readings: Array, missing: Mask) -> ForceEstimate:
        """The forces that the next readings make known; by the reading's noise alone their error bars."""

    def finish(self) -> ForceEstimate:
        """The forces that the end of the readings makes known: none, where none wait."""
        return ForceEstimate(np.zeros(0), np.zeros(0))


class Estimator(ABC):
    """Readings of one unit, evenly sampled, to force with an error bar. Missing readings are a mask, never NaN.

    A kind of estimator writes `begin` and the run that it gives; a whole signal and a stream are the same run.
    ``noise_sd`` in the reading's unit is found from the readings where it is None.
    """

    def __init__(self, calibration: Calibration, sample_rate_hz: float, *, noise_sd: float | None = None) -> None:
        self.calibration, self.sample_rate_hz, self.noise_sd = calibration, sample_rate_hz, noise_sd

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
        run = self.begin(values, absent)
        found = (run.push(values, absent), run.finish())
        force_n = np.concatenate([one.force_n for one in found])
        sd_n = np.concatenate([one.sd_n for one in found])
        return ForceEstimate(force_n, np.hypot(sd_n, gain_sd(self.calibration) * force_n))

    @abstractmethod
    def begin(self, readings: Array, missing: Mask) -> ForceRun:
        """A run from a fresh start; what it must know of noise and load is found from these readings (n,)."""


def gain_sd(calibration: Calibration) -> float:
    """The standard deviation of the static gain b1/a1 over the gain; 0 where the covariance is not known."""
    names = list(calibration.parameters)
    if not calibration.covariance or not {"a1", "b1"} <= set(names) or calibration.b1 == 0.0:
        return 0.0
    slope = np.zeros(len(names))
    slope[names.index("b1")], slope[names.index("a1")] = 1.0 / calibration.b1, -1.0 / calibration.a1
    variance = float(slope @ np.asarray(calibration.covariance, dtype=float) @ slope)
    return float(np.sqrt(variance)) if np.isfinite(variance) and variance > 0.0 else 0.0
