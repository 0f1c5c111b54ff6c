"""Calibrations of a unit that ages as it is told, with errors drawn from their own covariance."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta

import numpy as np

from smartshoe.calibration import Calibration
from smartshoe.models.parameter import Parameter
from smartshoe.units import MILLIBAR

FIRST_DAY = datetime(2025, 1, 6, tzinfo=UTC)
LEFT_TOE = (0.215, 9.92, 2.022)  # a1 1/s, b0 N/mbar, b1 N/(mbar s): about what the simulated left toe has
SDS = (2e-4, 2e-3, 2e-3)
CORRELATION = np.array([[1.0, 0.3, 0.95], [0.3, 1.0, 0.3], [0.95, 0.3, 1.0]])


def covariance_of(share: float = 1.0) -> np.ndarray:
    sds = share * np.array(SDS)
    return CORRELATION * np.outer(sds, sds)


def calibration(
    theta: tuple[float, ...] = LEFT_TOE,
    *,
    rng: np.random.Generator | None = None,
    serial_number: str = "S1",
    unit: str = "left_toe",
    created: str = "2025-01-06",
    offset: float = 0.0,
    sd_share: float = 1.0,
    has_errors: bool = True,
) -> Calibration:
    """``theta`` a1, b0, b1 as identified: with errors by ``rng`` where one is given."""
    covariance = covariance_of(sd_share)
    drawn = np.array(theta) if rng is None else rng.multivariate_normal(theta, covariance)
    units = ("1/s", "N/mbar", "N/(mbar s)")
    return Calibration(
        *(float(value) for value in drawn),
        reading_unit=MILLIBAR,
        offset=offset,
        unit=unit,
        parameters={
            name: Parameter.from_sd(float(value), float(np.sqrt(covariance[k, k])), units[k])
            for k, (name, value) in enumerate(zip(("a1", "b0", "b1"), drawn, strict=True))
        }
        if has_errors
        else {},
        covariance=tuple(tuple(float(x) for x in row) for row in covariance) if has_errors else (),
        load_range_n=(0.0, 800.0),
        created=created,
        serial_number=serial_number,
    )


def day(number: float) -> str:
    return (FIRST_DAY + timedelta(days=number)).date().isoformat()


def aged(days: float, gain_per_year: float, gain_factor: float = 1.0) -> tuple[float, float, float]:
    """The left toe's a1, b0, b1 with both gains changed by the factor, and by a share of themselves a year."""
    a1, b0, b1 = LEFT_TOE
    factor = gain_factor * (1.0 + gain_per_year * days / 365.25)
    return a1, b0 * factor, b1 * factor
