"""The quantities tracked over a unit's life: its identified parameters, its static gain and its zero."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from smartshoe.arrays import Array
from smartshoe.calibration import Calibration
from smartshoe.errors import UsageError
from smartshoe.models.parameter import Parameter

STATIC_GAIN, ZERO = "static_gain", "zero"
COEFFICIENTS = ("a1", "b0", "b1")


def coefficient_covariance(calibration: Calibration) -> Array | None:
    """Covariance (3, 3) of a1, b0, b1; None where the calibration does not state it."""
    names = list(calibration.parameters)
    if any(name not in names for name in COEFFICIENTS) or len(calibration.covariance) != len(names):
        return None
    index = [names.index(name) for name in COEFFICIENTS]
    covariance = np.asarray(calibration.covariance, dtype=float)[np.ix_(index, index)]
    return covariance if np.isfinite(covariance).all() and (np.diag(covariance) > 0.0).all() else None


def quantities(calibration: Calibration) -> dict[str, Parameter]:
    """Every tracked quantity by name, the static gain b1/a1 (N per reading) first and the zero (a reading) last."""
    a1, b1 = calibration.a1, calibration.b1
    covariance = coefficient_covariance(calibration)
    gain, gain_sd = b1 / a1, math.nan
    if covariance is not None:
        slope = np.array([-b1 / a1**2, 0.0, 1.0 / a1])
        gain_sd = math.sqrt(max(float(slope @ covariance @ slope), 0.0))
    symbol = calibration.reading_unit.symbol
    named = calibration.parameters or {
        name: Parameter.from_sd(getattr(calibration, name), math.nan, unit)
        for name, unit in zip(COEFFICIENTS, ("1/s", f"N/{symbol}", f"N/({symbol} s)"), strict=True)
    }
    return {
        STATIC_GAIN: Parameter.from_sd(gain, gain_sd, f"N/{symbol}"),
        **named,
        ZERO: Parameter.from_sd(calibration.offset, math.nan, symbol),
    }


def require_one_reading_unit(calibrations: Sequence[Calibration]) -> None:
    """Raise `UsageError` where the calibrations' readings are in different units."""
    symbols = sorted({calibration.reading_unit.symbol for calibration in calibrations})
    if len(symbols) > 1:
        raise UsageError(
            f"the calibrations are of readings in {' and '.join(symbols)}, which do not compare: identify them from"
            " readings in one unit"
        )


def top_load_n(calibrations: Sequence[Calibration]) -> float:
    """The largest load that all calibrations have seen; the paper's 800 N where none states it."""
    from smartshoe.calibration._calibration import USUAL_FULL_SCALE_N

    tops = [c.load_range_n[1] for c in calibrations if c.load_range_n is not None and c.load_range_n[1] > 0.0]
    return min(tops, default=USUAL_FULL_SCALE_N)
