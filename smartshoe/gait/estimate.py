"""From a unit's reading to its load: the one seam by which forces come into a trial.

Behind `estimate` stands the calibration's own compensator, or an estimator of `smartshoe.calibration.estimators`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from smartshoe.errors import UnitError
from smartshoe.recording import Channel
from smartshoe.signals.masks import bridged, runs_of

if TYPE_CHECKING:
    from smartshoe.calibration import Calibration

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

BEYOND = 1.02  # times the largest calibrated load: noise at its edge is no extrapolation
RAIL_RUN, RAIL_LONG = 4, 100  # ties in a row; so many that no hump is as flat
MOST_TIED = 0.5
RAIL_STEEP = 4.0  # resolutions, by which a load still rises as it meets the rail


@dataclass(frozen=True, eq=False)
class UnitLoad:
    """A unit's load (n,): in N where ``is_force``, else in the reading's own unit ``symbol``.

    ``missing``, ``saturated`` and ``beyond`` (n,): no sample, a reading on its rail, a load beyond the calibration.
    ``sd_n`` (n,) is the estimator's error bar, None without one. ``gain_sd`` is the sd of the calibration's static gain
    as a share, 0 where it is not known. ``range_n`` and
    ``rate_n_per_s`` are the largest load and loading rate that the calibration saw, None where it does not say.
    """

    name: str
    load: Array
    is_force: bool
    symbol: str
    missing: Mask
    saturated: Mask
    beyond: Mask
    gain_sd: float = 0.0
    range_n: float | None = None
    rate_n_per_s: float | None = None
    sd_n: Array | None = None


def estimate(
    name: str, channel: Channel, rate_hz: float, calibration: Calibration | None, estimator: str | None = None
) -> UnitLoad:
    """The load of unit ``name`` from its ``channel`` (n,) on an even time base of ``rate_hz``.

    A channel in a unit of force is the load already. ``estimator`` is a name of `smartshoe.calibration.estimators`,
    None the calibration's own compensator. Raises `UnitError` where the calibration is for another quantity.
    """
    present = channel.present
    missing, at = ~present, np.arange(present.size, dtype=float)
    saturated = on_the_rail(channel)
    nothing = np.zeros(channel.values.size, dtype=bool)
    if channel.unit.quantity == "force":
        return UnitLoad(name, bridged(at, channel.si, present), True, "N", missing, saturated, nothing)
    if calibration is None:
        return UnitLoad(
            name, bridged(at, channel.values, present), False, channel.unit.symbol, missing, saturated, nothing
        )
    if channel.unit != calibration.reading_unit and channel.unit.quantity != calibration.reading_unit.quantity:
        raise UnitError(
            f"{name} is in {channel.unit.symbol}, its calibration is for {calibration.reading_unit.symbol}: give the"
            " calibration of this kind of reading, or the column in its unit"
        )
    from smartshoe.calibration.estimators.estimate import gain_sd

    readings = bridged(at, channel.in_unit(calibration.reading_unit), present)
    sd_n = None
    if estimator is None:
        load_n = calibration.compensator(rate_hz).apply(readings)
    else:
        from smartshoe.calibration.estimators import estimator as named

        found = named(estimator, calibration, rate_hz).estimate(readings, missing)
        load_n, sd_n = found.force_n, found.sd_n
    largest = calibration.load_range_n[1] if calibration.load_range_n else None
    rate = calibration.rate_range_n_per_s[1] if calibration.rate_range_n_per_s else None
    beyond = load_n > BEYOND * largest if largest else nothing
    return UnitLoad(name, load_n, True, "N", missing, saturated, beyond, gain_sd(calibration), largest, rate, sd_n)


def on_the_rail(channel: Channel) -> Mask:
    """Samples (n,) tied at the largest reading, or at the instrument's upper limit, while the load was still rising.

    A hump that is flat for some samples rises softly into its top; a reading that meets its rail does not.
    """
    values, present = channel.values, channel.present
    if values.size < RAIL_RUN + 2:
        return np.zeros(values.size, dtype=bool)
    top = float(values[present].max()) if present.any() else 0.0
    if channel.range_ is not None and top >= channel.range_[1]:
        top = channel.range_[1]
    tied = (values >= top) & present
    if np.count_nonzero(tied) > MOST_TIED * values.size:
        return np.zeros(values.size, dtype=bool)  # a channel that stands still says nothing of its rail
    start, stop = runs_of(tied)
    long = (stop - start) >= RAIL_RUN
    start, stop = start[long], stop[long]
    if start.size == 0:
        return np.zeros(values.size, dtype=bool)
    steps = np.abs(np.diff(values))
    steps = steps[steps > 0]
    resolution = float(np.quantile(steps, 0.02)) if steps.size else 0.0
    rise = values[start] - values[np.maximum(start - 1, 0)]
    if np.median(rise) < RAIL_STEEP * resolution and (stop - start).max() < RAIL_LONG:
        return np.zeros(values.size, dtype=bool)
    found = np.zeros(values.size, dtype=bool)
    for first, last in zip(start, stop, strict=True):
        found[first:last] = True
    return found


def calibration_of(calibrations: Mapping[str, Calibration], name: str) -> Calibration | None:
    """The calibration of unit ``name``: by its full name, or by its region where the calibration names no side."""
    return calibrations.get(name) or calibrations.get(name.split("_", 1)[-1])
