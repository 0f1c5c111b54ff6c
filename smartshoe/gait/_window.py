"""`AnalysisWindow`: a whole short trial, or two minutes of a day together with some seconds on either side."""

from __future__ import annotations

from collections.abc import Mapping, MutableSequence, Sequence
from dataclasses import dataclass

import numpy as np

from smartshoe.arrays import Array, Mask
from smartshoe.gait._checks import window_flags
from smartshoe.gait._contact import LEAST_LOAD_N, Contacts
from smartshoe.gait._coverage import Coverage
from smartshoe.gait._flag import Flag
from smartshoe.gait._series import FootSeries, series_of
from smartshoe.gait._strides import Stride, strides_of, with_runs
from smartshoe.gait._total import TotalForce, above_floor, standing_spans, total_of
from smartshoe.gait._trial import Foot


@dataclass(frozen=True, eq=False)
class AnalysisWindow:
    """What was found from ``start_s`` on and before ``end_s``; ``feet``, ``series`` and ``contacts`` reach beyond it.

    ``strides`` are those that begin in the window; ``spans`` are begin and end of spells of standing, not cut at the
    window's ends. ``total`` is the sum of the feet's forces, None if a foot's loads are not in N.
    """

    start_s: float
    end_s: float
    feet: Mapping[str, Foot]
    series: Mapping[str, FootSeries]
    strides: tuple[Stride, ...]
    spans: tuple[tuple[float, float], ...]
    loaded: Mapping[str, bool]
    total: TotalForce | None
    flags: tuple[Flag, ...]

    @property
    def contacts(self) -> dict[str, Contacts]:
        """Each foot's contacts."""
        return {name: one.contacts for name, one in self.series.items()}

    def own(self, time_s: Array) -> Mask:
        """(n,) True where a time lies inside the window."""
        return (time_s >= self.start_s - 1e-9) & (time_s < self.end_s - 1e-9)


def analyse_window(
    feet: Mapping[str, Foot],
    contacts: Mapping[str, Contacts],
    coverage: Coverage,
    body_weight_n: float | None,
    *,
    peaks: Mapping[str, MutableSequence[Array]] | None = None,
    start_s: float = -np.inf,
    end_s: float = np.inf,
) -> AnalysisWindow:
    """Analyse the window from ``start_s`` to ``end_s`` of ``feet`` and ``contacts``, both of which may reach beyond it.

    ``peaks`` holds, for each foot, its units' peaks (r,) in earlier stances; those of this window are added to it.
    """
    peaks = {name: [] for name in feet} if peaks is None else peaks
    loads = {name: above_floor(foot, contacts[name]) for name, foot in feet.items()}
    for name, foot in feet.items():
        peaks[name].extend(_peaks_of(foot.time_s, loads[name], contacts[name], start_s, end_s))
    loaded = {name: is_loaded(foot, loads[name], body_weight_n) for name, foot in feet.items()}
    series = {
        name: series_of(foot, contacts[name], loads[name], coverage, _usual_peak(peaks[name], loads[name]))
        for name, foot in feet.items()
    }
    near = [
        stride
        for name, one in series.items()
        for stride in strides_of(name, one.contacts, one.time_s, one.force_n, one.missing)
    ]
    strides = tuple(stride for stride in with_runs(near) if start_s <= stride.start_s < end_s)
    spans = tuple(standing_spans(feet, contacts, loaded))
    forces = {name: one.force_n for name, one in series.items() if one.force_n is not None}
    total = total_of(feet, forces) if len(forces) == len(feet) else None
    flags = window_flags(feet, series, strides, spans, loaded, total)
    return AnalysisWindow(start_s, end_s, feet, series, strides, spans, loaded, total, tuple(flags))


def is_loaded(foot: Foot, load: Array, body_weight_n: float | None) -> bool:
    """Whether the foot bears load on average; false for uncalibrated readings, in which only steps can show it."""
    if not foot.is_force:
        return False
    return float(np.mean(load.sum(axis=1))) > max(LEAST_LOAD_N, 0.05 * (body_weight_n or 0.0))


def _peaks_of(time_s: Array, load: Array, contacts: Contacts, start_s: float, end_s: float) -> list[Array]:
    """The peaks (r,) of the units in each stance that ends from ``start_s`` on and before ``end_s``."""
    with np.errstate(invalid="ignore"):
        known = np.isfinite(contacts.strike_s) & (contacts.toe_off_s >= start_s) & (contacts.toe_off_s < end_s)
    bounds = np.searchsorted(time_s, np.column_stack([contacts.strike_s[known], contacts.toe_off_s[known]]))
    return [load[first:last].max(axis=0) for first, last in bounds if last > first]


def _usual_peak(peaks: Sequence[Array], load: Array) -> Array:
    """The median peak (r,) of each unit, at least 0; its largest load (n, r) if no stance is known."""
    found = np.median(np.array(peaks), axis=0) if len(peaks) else load.max(axis=0)
    return np.asarray(np.maximum(found, 0.0))
