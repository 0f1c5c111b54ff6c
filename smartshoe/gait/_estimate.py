"""From a unit's reading to its load: the one place where forces enter a trial.

`estimate` uses the calibration's own compensator or an estimator of `smartshoe.calibration.estimators`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from smartshoe.arrays import Array, Mask
from smartshoe.errors import UnitError
from smartshoe.recording import Channel
from smartshoe.signals.masks import bridged, runs_of

if TYPE_CHECKING:
    from smartshoe.calibration import Calibration
    from smartshoe.calibration.estimators import ForceEstimate, ForceRun


BEYOND = 1.02  # times the largest calibrated load: noise at the limit does not count as extrapolation
RAIL_RUN, RAIL_LONG = 4, 100  # equal samples in a row; no peak of a load is flat for as long as RAIL_LONG
MOST_TIED = 0.5
RAIL_STEEP = 4.0  # in resolutions: how much a load still rises in the sample before it reaches its rail


class LoadRun:
    """Converts a unit's readings, finite and in its channel's unit, to load with an error bar, piece after piece.

    ``gain_sd`` is the standard deviation of the calibration's static gain, as a share.
    """

    def __init__(self, to_load: Callable[[Array], Array], run: ForceRun | None = None, gain_sd: float = 0.0) -> None:
        self._to_load, self._run, self.gain_sd = to_load, run, gain_sd

    def push(self, readings: Array, missing: Mask) -> tuple[Array, Array | None]:
        """Take the next readings and their mask (n,); return the loads now known, and with an estimator their sd.

        An estimator may return fewer or more loads than readings, since it may wait for later readings.
        """
        values = self._to_load(readings)
        return (values, None) if self._run is None else self._both(self._run.push(values, missing))

    def finish(self) -> tuple[Array, Array | None]:
        """Return the remaining loads, and their sd with an estimator, once there are no more readings."""
        return (np.zeros(0), None) if self._run is None else self._both(self._run.finish())

    def _both(self, found: ForceEstimate) -> tuple[Array, Array]:
        return found.force_n, np.hypot(found.sd_n, self.gain_sd * found.force_n)


@dataclass(frozen=True, eq=False)
class UnitLoad:
    """A unit's load (n,), in N if ``is_force``, otherwise in the reading's own unit ``symbol``.

    ``missing``, ``saturated`` and ``beyond`` (n,) mark missing samples, readings on the rail and loads beyond the
    calibrated range. ``sd_n`` (n,) is the estimator's error bar, None without one. ``gain_sd`` is the standard
    deviation of the calibration's static gain as a share, 0 if unknown. ``range_n`` and ``rate_n_per_s`` are the
    largest load and loading rate in the calibration, None if unknown. ``begin`` starts a new conversion for a stream;
    an estimator takes the noise from the readings given here.
    """

    name: str
    load: Array
    is_force: bool
    symbol: str
    missing: Mask
    saturated: Mask
    beyond: Mask
    begin: Callable[[], LoadRun]
    gain_sd: float = 0.0
    range_n: float | None = None
    rate_n_per_s: float | None = None
    sd_n: Array | None = None


def estimate(
    name: str, channel: Channel, rate_hz: float, calibration: Calibration | None, estimator: str | None = None
) -> UnitLoad:
    """The load of unit ``name`` from its ``channel`` (n,), sampled evenly at ``rate_hz``.

    A channel in a unit of force is the load already. ``estimator`` is a name of `smartshoe.calibration.estimators`;
    None means the calibration's own compensator. Raises `UnitError` if the calibration is for another quantity.
    """
    present = channel.present
    readings, missing = bridged(np.arange(present.size, dtype=float), channel.values, present), ~present
    nothing = np.zeros(present.size, dtype=bool)
    is_force = channel.unit.quantity == "force"
    begin = _conversion(name, channel, rate_hz, None if is_force else calibration, estimator, readings)
    run = begin()
    (load, sd_n), (rest, rest_sd_n) = run.push(readings, missing), run.finish()
    if rest.size:
        load = np.concatenate([load, rest])
        sd_n = None if sd_n is None or rest_sd_n is None else np.concatenate([sd_n, rest_sd_n])
    symbol = "N" if is_force or calibration is not None else channel.unit.symbol
    found = UnitLoad(
        name, load, symbol == "N", symbol, missing, on_the_rail(channel), nothing, begin, run.gain_sd, sd_n=sd_n
    )
    if is_force or calibration is None:
        return found
    largest = calibration.load_range_n[1] if calibration.load_range_n else None
    rate = calibration.rate_range_n_per_s[1] if calibration.rate_range_n_per_s else None
    return replace(found, beyond=load > BEYOND * largest if largest else nothing, range_n=largest, rate_n_per_s=rate)


def _conversion(
    name: str,
    channel: Channel,
    rate_hz: float,
    calibration: Calibration | None,
    estimator: str | None,
    readings: Array,
) -> Callable[[], LoadRun]:
    """Return a function that starts a new conversion from readings to load."""
    if calibration is None:
        return lambda: LoadRun(channel.unit.to_si if channel.unit.quantity == "force" else np.asarray)
    unit = calibration.reading_unit
    if channel.unit != unit and channel.unit.quantity != unit.quantity:
        raise UnitError(
            f"{name} is in {channel.unit.symbol}, its calibration is for {unit.symbol}: give the"
            " calibration of this kind of reading, or the column in its unit"
        )
    from smartshoe.calibration.estimators import estimator as named
    from smartshoe.calibration.estimators import gain_sd

    gain, missing = gain_sd(calibration), ~channel.present

    def converted(values: Array) -> Array:
        return channel.unit.convert(values, unit)

    if estimator is not None:
        chosen = named(estimator, calibration, rate_hz)
        return lambda: LoadRun(converted, chosen.begin(converted(readings), missing), gain)

    def own() -> LoadRun:
        push = calibration.compensator(rate_hz).push
        return LoadRun(lambda values: push(converted(values)), None, gain)

    return own


def on_the_rail(channel: Channel) -> Mask:
    """Samples (n,) equal to the largest reading, or to the instrument's upper limit, reached while the load still rose.

    A peak that is flat for some samples rises softly to its top; a reading that hits its rail does not.
    """
    values, present = channel.values, channel.present
    if values.size < RAIL_RUN + 2:
        return np.zeros(values.size, dtype=bool)
    top = float(values[present].max()) if present.any() else 0.0
    if channel.range_ is not None and top >= channel.range_[1]:
        top = channel.range_[1]
    tied = (values >= top) & present
    if np.count_nonzero(tied) > MOST_TIED * values.size:
        return np.zeros(values.size, dtype=bool)  # a channel that never changes does not show where its rail is
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
    """The calibration of unit ``name``: by its full name, or by its region if the calibration names no side."""
    return calibrations.get(name) or calibrations.get(name.split("_", 1)[-1])
