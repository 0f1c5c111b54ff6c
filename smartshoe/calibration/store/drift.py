"""Drift of a unit's parameters over its life: a trend, steps at repairs, and jumps that no repair explains."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any

import numpy as np

from smartshoe.arrays import Array, Index
from smartshoe.calibration import Calibration
from smartshoe.calibration.store._calibration_store import CalibrationStore
from smartshoe.calibration.store._entry import Entry, HistoryEvent
from smartshoe.calibration.store.dates import days_between, iso
from smartshoe.calibration.store.quantities import STATIC_GAIN, ZERO, quantities, require_one_reading_unit, top_load_n
from smartshoe.errors import UsageError
from smartshoe.models.parameter import Parameter

DAYS_OF_A_YEAR = 365.25
ROUNDING = 1e-12
JUMP_CHANCE = 0.01  # probability of reporting a jump anywhere in a history that has none
LEAST_FREEDOM = 2  # degrees of freedom required to judge a jump


@dataclass(frozen=True, slots=True)
class DriftStep:
    """A step of a quantity (``change``, in its unit) at a repair, or between two calibrations."""

    date: datetime
    change: Parameter
    says: str

    @property
    def is_significant(self) -> bool:
        """Whether the 95 % interval of the change excludes zero."""
        return _leaves_out_zero(self.change)

    def to_dict(self) -> dict[str, Any]:
        """The step for JSON."""
        return {"date": iso(self.date), "change": self.change.to_dict(), "says": self.says}


@dataclass(frozen=True, eq=False)
class Trend:
    """A quantity over the unit's life: ``values`` and ``sds`` (n,) at ``days`` (n,) since the first calibration.

    ``pieces`` (n,) number the segments between ``repairs`` and ``jumps``, each with its own level; ``per_year`` is
    their common slope, None where it cannot be estimated; ``levels`` are the fitted values at day 0, one per segment.
    ``scatter`` is the spread about the fit relative to the sds (1: fully explained by them; NaN where there are no sds
    or no degrees of freedom).
    """

    name: str
    unit: str
    days: Array
    values: Array
    sds: Array
    pieces: Index
    per_year: Parameter | None
    levels: Array
    repairs: tuple[DriftStep, ...]
    jumps: tuple[DriftStep, ...]
    scatter: float
    says: str

    @property
    def moves(self) -> bool:
        """Whether the 95 % interval of the slope excludes zero."""
        return self.per_year is not None and _leaves_out_zero(self.per_year)

    def fitted(self, days: Array, piece: int) -> Array:
        """The fitted values (m,) at ``days`` (m,) in a segment."""
        slope = 0.0 if self.per_year is None else self.per_year.value / DAYS_OF_A_YEAR
        return np.asarray(self.levels[piece] + slope * days)

    def to_dict(self) -> dict[str, Any]:
        """The trend for JSON."""
        return {
            "unit": self.unit,
            "values": [float(value) for value in self.values],
            "sds": [float(sd) if math.isfinite(sd) else None for sd in self.sds],
            "per_year": None if self.per_year is None else self.per_year.to_dict(),
            "repairs": [step.to_dict() for step in self.repairs],
            "jumps": [step.to_dict() for step in self.jumps],
            "scatter": self.scatter if math.isfinite(self.scatter) else None,
            "says": self.says,
        }


@dataclass(frozen=True, eq=False)
class Drift:
    """A unit's life: its calibrations, its events, and a trend for every quantity that all calibrations have."""

    serial_number: str
    entries: tuple[Entry, ...]
    events: tuple[HistoryEvent, ...]
    trends: dict[str, Trend]
    top_load_n: float
    says: str

    def to_dict(self) -> dict[str, Any]:
        """The drift as a JSON object, schema smartshoe.drift/1."""
        return {
            "schema": "smartshoe.drift/1",
            "serial_number": self.serial_number,
            "calibrations": [entry.to_dict() for entry in self.entries],
            "events": [event.to_dict() for event in self.events],
            "top_load_n": self.top_load_n,
            "trends": {name: trend.to_dict() for name, trend in self.trends.items()},
            "says": self.says,
        }


def drift(store: CalibrationStore, serial_number: str) -> Drift:
    """The drift of a unit's parameters; raises `UsageError` where it has fewer than two calibrations."""
    entries, events = store.history(serial_number), store.events(serial_number)
    if not entries:
        store.latest(serial_number)  # its error lists what the store has
    if len(entries) < 2:
        raise UsageError(
            f"unit {serial_number} has one calibration in {store}: a drift needs two at least, add another"
        )
    calibrations = [entry.calibration() for entry in entries]
    require_one_reading_unit(calibrations)
    dates = [entry.date for entry in entries]
    days = np.array([days_between(dates[0], date) for date in dates])
    repairs = [event for event in events if event.kind == "repaired"]
    lives = np.array([sum(event.date <= entry.date for event in repairs) for entry in entries], dtype=np.intp)
    trends = {
        name: _trend(name, unit, days, values, sds, lives, dates, repairs)
        for name, unit, values, sds in _followed(calibrations)
    }
    top_n = top_load_n(calibrations)
    return Drift(serial_number, entries, events, trends, top_n, _says(serial_number, entries, trends, top_n))


def _followed(calibrations: Sequence[Calibration]) -> list[tuple[str, str, Array, Array]]:
    every = [quantities(calibration) for calibration in calibrations]
    found = []
    for name, first in every[0].items():
        if all(name in other for other in every):
            values = np.array([other[name].value for other in every])
            sds = np.array([other[name].sd for other in every])
            if np.ptp(values) > 0.0 or np.any(sds > 0.0):  # c = 1, fixed in all calibrations, does not drift
                found.append((name, first.unit, values, sds))
    return found


@dataclass(frozen=True, eq=False)
class _TrendFit:
    """Weighted least squares: theta (p,), its covariance including the scatter, degrees of freedom, scatter."""

    theta: Array
    covariance: Array
    freedom: int
    scatter: float

    def parameter(self, contrast: Array, unit: str) -> Parameter:
        """contrast @ theta with its interval, by Student's t, since the scatter between calibrations is estimated."""
        from scipy.special import stdtrit

        value = float(contrast @ self.theta)
        sd = math.sqrt(max(float(contrast @ self.covariance @ contrast), 0.0))
        if self.freedom < 1:
            return Parameter(value, math.nan, (math.nan, math.nan), unit)
        return Parameter.from_sd(value, sd, unit, float(stdtrit(self.freedom, 0.975)))


def _fit(design: Array, values: Array, sds: Array) -> _TrendFit | None:
    """Weighted least squares of ``values`` (n,); None where the design does not determine every coefficient.

    Scatter beyond the sds widens the error bars (Birge 1932: never narrows them): a calibration's sd does not cover how
    the unit was placed under the anvil.
    """
    known = bool(np.isfinite(sds).all() and (sds > 0.0).all())
    weight = 1.0 / sds if known else np.ones(values.size)
    weighted = design * weight[:, None]
    size = np.linalg.norm(weighted, axis=0)
    scaled = weighted / np.where(size > 0.0, size, 1.0)
    if np.linalg.matrix_rank(scaled) < design.shape[1]:
        return None
    theta = np.linalg.lstsq(scaled, values * weight, rcond=None)[0]
    left = values * weight - scaled @ theta
    freedom = values.size - design.shape[1]
    rounding = ROUNDING * float(np.abs(values * weight).max())  # even exact values are known only to their digits
    spread = max(math.sqrt(float(left @ left) / freedom), rounding) if freedom > 0 else math.nan
    widen = max(spread, 1.0) if known else spread
    covariance = widen**2 * np.linalg.inv(scaled.T @ scaled) / np.outer(size, size)
    return _TrendFit(theta / size, covariance, freedom, spread if known else math.nan)


def _trend(
    name: str,
    unit: str,
    days: Array,
    values: Array,
    sds: Array,
    lives: Index,
    dates: Sequence[datetime],
    repairs: Sequence[HistoryEvent],
) -> Trend:
    # Numbered without gaps: of two repairs with no calibration in between, only the last one counts.
    pieces = np.unique(lives, return_inverse=True)[1].astype(np.intp)
    jumped: set[int] = set()
    while (at := _jump(days, values, sds, pieces)) is not None:
        jumped.add(at)
        pieces[at:] += 1
    found, slope_of = _fit_of(days, values, sds, pieces)
    slope = None
    levels = found.theta[: int(pieces[-1]) + 1].copy()
    if slope_of is not None:
        slope = found.parameter(slope_of * DAYS_OF_A_YEAR, f"{unit}/year")
        levels -= float(slope_of @ found.theta) * float(days.mean())
    at_repairs, jumps = [], []
    for k in (int(at) + 1 for at in np.flatnonzero(np.diff(pieces))):
        contrast = np.zeros(found.theta.size)
        contrast[[pieces[k] - 1, pieces[k]]] = -1.0, 1.0
        change = found.parameter(contrast, unit)
        if k in jumped:
            between = f"between {iso(dates[k - 1])} and {iso(dates[k])}"
            said = f"{_amount(name, change)} {between}, which no repair explains"
            jumps.append(DriftStep(dates[k], change, said))
        else:
            when = repairs[int(lives[k]) - 1].date
            at_repairs.append(DriftStep(when, change, f"{_amount(name, change)} at the repair of {iso(when)}"))
    return Trend(
        name, unit, days, values, sds, pieces, slope, levels, tuple(at_repairs), tuple(jumps), found.scatter,
        _trend_says(name, slope, at_repairs, jumps, values),
    )  # fmt: skip


def _fit_of(days: Array, values: Array, sds: Array, pieces: Index) -> tuple[_TrendFit, Array | None]:
    """Levels of the segments (at the mean day) and their common slope; also the slope's contrast per day.

    Where the slope is not determined (each segment has one date), the levels alone, and None.
    """
    levels = (pieces[:, None] == np.arange(int(pieces[-1]) + 1)).astype(float)
    found = _fit(np.column_stack([levels, days - days.mean()]), values, sds)
    if found is not None:
        return found, np.eye(found.theta.size)[-1]
    found = _fit(levels, values, sds)
    if found is None:  # levels alone are always determined, so only non-finite numbers get here
        raise UsageError(
            "the calibrations hold numbers that no level fits: look at them with smartshoe calibrations list"
        )
    return found, None


def _jump(days: Array, values: Array, sds: Array, pieces: Index) -> int | None:
    """Index of the first calibration after the strongest step within a segment; None unless it is significant.

    Every gap between two calibrations is tried, and the probability is multiplied by their number (Bonferroni); it must
    be below `JUMP_CHANCE`.
    """
    from scipy.special import stdtr  # Student's t; importing scipy.stats takes a second

    gaps = [k for k in range(1, values.size) if pieces[k] == pieces[k - 1] and days[k] > days[k - 1]]
    best: tuple[float, int] | None = None
    for k in gaps:
        split = pieces + (np.arange(values.size) >= k)
        found, slope_of = _fit_of(days, values, sds, split)
        if slope_of is None or found.freedom < LEAST_FREEDOM:
            continue
        contrast = np.zeros(found.theta.size)
        contrast[[split[k] - 1, split[k]]] = -1.0, 1.0
        change, sd = float(contrast @ found.theta), math.sqrt(float(contrast @ found.covariance @ contrast))
        chance = 2.0 * float(stdtr(found.freedom, -abs(change) / sd)) * len(gaps) if sd > 0.0 else 1.0
        if chance < JUMP_CHANCE and (best is None or chance < best[0]):
            best = chance, k
    return None if best is None else best[1]


def _leaves_out_zero(change: Parameter) -> bool:
    low, high = change.ci95
    return low > 0.0 or high < 0.0


def _words(name: str) -> str:
    return name.replace("_", " ")


def _amount(name: str, change: Parameter) -> str:
    low, high = change.ci95
    bounds = f" (95 %: {low:.3g} to {high:.3g})" if math.isfinite(low) else ""
    return f"{_words(name)} changed by {change.value:.3g} {change.unit}{bounds}"


def _trend_says(
    name: str, slope: Parameter | None, repairs: Sequence[DriftStep], jumps: Sequence[DriftStep], values: Array
) -> str:
    said = []
    if slope is None:
        said.append(f"{_words(name)}: no trend can be distinguished from the repairs")
    elif not math.isfinite(slope.sd):
        said.append(f"{_words(name)}: {slope.value:.3g} {slope.unit}, from too few calibrations for an interval")
    else:
        low, high = slope.ci95
        size = float(np.abs(values).mean())
        share = f", {100 * slope.value / size:.2g} % a year" if name != ZERO else ""
        verb = ("rises" if slope.value > 0.0 else "falls") if _leaves_out_zero(slope) else "shows no trend"
        said.append(f"{_words(name)} {verb}: {slope.value:.3g} {slope.unit} (95 %: {low:.3g} to {high:.3g}){share}")
    said += [step.says for step in repairs if step.is_significant]
    said += [step.says for step in jumps]
    return "; ".join(said)


def _says(serial_number: str, entries: Sequence[Entry], trends: dict[str, Trend], top_n: float) -> str:
    """One sentence: what the drift of the static gain means in newtons at the load ``top_n``."""
    span = days_between(entries[0].date, entries[-1].date)
    start = f"unit {serial_number}, {len(entries)} calibrations over {span:.0f} days"
    gain = trends.get(STATIC_GAIN)
    if gain is None or gain.per_year is None or not math.isfinite(gain.per_year.sd):
        return f"{start}: too few between repairs to tell a trend of the static gain"
    share = gain.per_year.value / float(np.abs(gain.values).mean())
    low, high = (bound / float(np.abs(gain.values).mean()) * top_n for bound in gain.per_year.ci95)
    verdict = "drifts" if gain.moves else "shows no drift beyond its errors"
    said = (
        f"{start}: the static gain {verdict}, {share * top_n:.2g} N a year at {top_n:.0f} N ({low:.2g} to {high:.2g})"
    )
    return "; ".join([said, *(jump.says for jump in gain.jumps)])
