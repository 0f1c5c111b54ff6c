"""Sums over the windows of a trial, one for a short trial and many for a day: activity, summary, indices, forces."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from smartshoe.arrays import Array
from smartshoe.gait._contact import Contacts
from smartshoe.gait._force_sums import Forces, ForceSums
from smartshoe.gait._series import FootSeries
from smartshoe.gait._strides import Stride
from smartshoe.gait._sums import Moments, StrideSums
from smartshoe.gait._trial import Foot
from smartshoe.gait._window import AnalysisWindow
from smartshoe.gait.indices import POINTS, deviations, overlaid, pattern, sequence_errors
from smartshoe.gait.summary import Activity, activity_by_time


class _Regularity:
    """How regular one foot's strides of one kind (walking or running) are."""

    def __init__(self, regions: int, reference: Array | None) -> None:
        self.wrong = self.judged = self.count = self.inside = 0
        self._whole = np.zeros((POINTS, regions))
        self._reference = reference
        self._deviation = Moments()
        self._abnormality = 0.0

    def add(self, series: FootSeries, strides: Sequence[Stride]) -> None:
        if not strides:
            return
        wrong, judged = sequence_errors(series.contacts, strides)
        self.wrong, self.judged = self.wrong + wrong, self.judged + judged
        each = overlaid(strides, series.time_s, series.load)
        self._whole += each.sum(axis=0)
        self.count += len(strides)
        wanted = pattern(self._whole / self.count) if self._reference is None else self._reference
        if wanted is not None and wanted.shape == self._whole.shape:
            self._deviation.add(deviations(each, wanted))
        for stride in strides:
            first, last = np.searchsorted(series.time_s, [stride.start_s, stride.end_s])
            self._abnormality += float(series.abnormality[first:last].sum())
            self.inside += int(last - first)

    def to_dict(self) -> dict[str, float | None]:
        return {
            "sequence_error_percent": 100.0 * self.wrong / self.judged if self.judged else None,
            "deviation_percent": self._deviation.mean if self._deviation.count else None,
            "abnormality_percent": 100.0 * self._abnormality / self.inside if self.inside else None,
        }


class TrialSums:
    """Sums over a trial of ``feet``, window by window.

    ``reference`` are patterns (`POINTS`, r) by foot, with which strides are compared; without it a foot's pattern is
    its own mean stride up to and including the window compared.
    """

    def __init__(self, feet: Mapping[str, Foot], coverage: float, reference: Mapping[str, Array] | None = None) -> None:
        self._feet = tuple(feet)
        self._forces = ForceSums(feet, coverage)
        self._kinds = {runs: StrideSums(self._feet) for runs in (False, True)}
        self._regular = {
            (runs, name): _Regularity(len(foot.units), reference.get(name, np.zeros(0)) if reference else None)
            for runs in (False, True)
            for name, foot in feet.items()
        }
        self._time_s = {False: 0.0, True: 0.0}  # duration of walking (False) and running (True) strides, gaps or not
        self._stepping: set[str] = set()
        self.strides = {False: 0, True: 0}
        self.standing_s = 0.0
        self.contacts = dict.fromkeys(feet, 0)
        self.floors = dict.fromkeys(feet, 0)
        self.was_loaded = False

    @property
    def moved(self) -> bool:
        """Whether a stride or standing was seen."""
        return any(self.strides.values()) or self.standing_s > 0.0

    def add_contacts(self, foot: str, contacts: Contacts) -> None:
        """Add a foot's next contacts, with the floors beside them."""
        self.contacts[foot] += len(contacts)
        self.floors[foot] += contacts.floor_time_s.size
        self._forces.add_floors(foot, contacts)

    def add(self, window: AnalysisWindow) -> None:
        """Add one more window."""
        self._forces.add(window)
        self.was_loaded |= any(window.loaded.values())
        contacts = window.contacts
        for stride in window.strides:
            self._time_s[stride.runs] += stride.time_s
            self.strides[stride.runs] += 1
            self._stepping.add(stride.foot)
        for runs in (False, True):
            own = [stride for stride in window.strides if stride.runs == runs and not stride.gap]
            self._kinds[runs].add(contacts, own)
            for name, series in window.series.items():
                self._regular[runs, name].add(series, [stride for stride in own if stride.foot == name])
        for start_s, end_s in window.spans:
            self.standing_s += max(0.0, min(end_s, window.end_s) - max(start_s, window.start_s))

    @property
    def _main(self) -> bool:
        return self._kinds[True].count > self._kinds[False].count

    def activity(self) -> Activity:
        """The activity that takes most of the time."""
        feet = max(len(self._stepping), 1)
        return activity_by_time(
            {"walking": self._time_s[False] / feet, "running": self._time_s[True] / feet, "standing": self.standing_s}
        )

    def summary(self) -> dict[str, Any]:
        """The summary figures of the strides without gaps of the main activity."""
        return self._kinds[self._main].summary()

    def indices(self) -> dict[str, dict[str, float | None]]:
        """Each foot's indices in percent: sequence errors, deviation from the pattern, abnormality."""
        return {name: self._regular[self._main, name].to_dict() for name in self._feet}

    def forces(self, given_n: float | None) -> Forces:
        """Body weight and total forces; ``given_n`` is the body weight if it was given."""
        return self._forces.forces(given_n)
