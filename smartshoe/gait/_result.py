"""`GaitResult` and `DayResult`: what is known of a trial, as numbers, as tables and as an object for JSON."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, Literal

import numpy as np

from smartshoe.arrays import Array
from smartshoe.display import Shown, SummaryTable, panels, significant
from smartshoe.errors import UsageError
from smartshoe.gait._coverage import Coverage
from smartshoe.gait._events import Event
from smartshoe.gait._flag import Flag
from smartshoe.gait._force_sums import Forces
from smartshoe.gait._series import FootSeries
from smartshoe.gait._strides import Stride
from smartshoe.gait.phases import PHASES as STATES
from smartshoe.gait.summary import Activity

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

Table = Literal["strides", "events", "forces"]

SCHEMA = "smartshoe.gait/1"


class Figures(dict[str, Any]):
    """Summary figures by name; calling the object gives them as a text table, like other results' ``summary()``."""

    def __init__(self, figures: Mapping[str, Any], table: SummaryTable) -> None:
        super().__init__(figures)
        self._table = table

    def __call__(self) -> str:
        """The table as text of several lines."""
        return self._table.to_text()


@dataclass(frozen=True, eq=False, repr=False)
class GaitFindings(Shown):
    """The results that every trial has.

    ``events`` are in order of time, ``strides`` in order of their start, ``indices`` are by foot. ``figures`` are what
    `summary` shows. ``coverage`` is the share of the load on the units, ``covering`` how it was applied. `to_dict`
    returns the object of ``smartshoe gait --json``.
    """

    activity: Activity
    events: tuple[Event, ...]
    strides: tuple[Stride, ...]
    figures: Mapping[str, Any]
    indices: Mapping[str, Mapping[str, float | None]]
    forces: Forces
    flags: tuple[Flag, ...]
    coverage: float
    covering: Coverage

    _tables: ClassVar[tuple[str, ...]] = ("strides", "events")

    @property
    def summary(self) -> Figures:
        """Figures by name, as in ``summary["cadence_steps_per_min"]``; ``summary()`` returns a table as text."""
        return Figures(self.figures, self._summary_table())

    def to_dict(self) -> dict[str, Any]:
        """The result in schema smartshoe.gait/1, without NaN or infinity."""
        weight = self.forces.body_weight
        return {
            "schema": SCHEMA,
            "activity": self.activity,
            "events": [{"time_s": e.time_s, "foot": e.foot, "event": e.event} for e in self.events],
            "strides": [stride.to_dict() for stride in self.strides],
            "summary": dict(self.figures),
            "indices": {foot: dict(values) for foot, values in self.indices.items()},
            "forces": {
                "body_weight_n": None if weight is None else {"value": weight.value, "sd": weight.sd},
                "body_weight_source": None if weight is None else weight.source,
                "mean_total_n": self.forces.mean_total_n,
                "standing_total_n": self.forces.standing_total_n,
                "rmse_estimate_n": self.forces.rmse_estimate_n,
                "coverage": self.coverage,
            },
            "flags": [flag.to_dict() for flag in self.flags],
        }

    def to_frame(self, table: Table = "strides") -> pd.DataFrame:
        """A pandas DataFrame: ``strides`` (one row each) or ``events``; raises `UsageError` for another table."""
        import pandas as pd

        if table == "strides":
            columns = list(Stride.__dataclass_fields__)
            return pd.DataFrame([stride.to_dict() for stride in self.strides], columns=columns)
        if table == "events":
            return pd.DataFrame([(e.time_s, e.foot, e.event) for e in self.events], columns=["time_s", "foot", "event"])
        known = ", ".join(self._tables)
        raise UsageError(f"table {table!r} is not known of a {type(self).__name__}: use one of {known}")

    def _counts(self) -> tuple[int, int]:
        """The trial's numbers of strides and of events."""
        return len(self.strides), len(self.events)

    def _summary_table(self) -> SummaryTable:
        """The figures that are single numbers, and the flags, as a table."""
        weight = self.forces.body_weight
        rows = [
            [name.replace("_", " "), significant(value) if isinstance(value, (int, float)) else str(value)]
            for name, value in self.figures.items()
            if value is not None and not isinstance(value, Mapping)
        ]
        strides, events = self._counts()
        said = "" if weight is None else f", body weight {significant(weight.value)} N ({weight.source})"
        return SummaryTable(
            f"{self.activity}: {strides} strides, {events} events{said}",
            ["figure", "value"],
            rows,
            [flag.says for flag in self.flags],
        )


@dataclass(frozen=True, eq=False, repr=False)
class GaitResult(GaitFindings):
    """A trial with its signals: ``feet`` holds each foot's series over time.

    ``total_n`` (n,) at ``total_time_s`` (n,) is the force of both feet, None if unknown; ``standing_s`` holds begin and
    end of each spell of standing.
    """

    feet: Mapping[str, FootSeries]
    total_time_s: Array
    total_n: Array | None
    standing_s: Sequence[tuple[float, float]]

    _tables = ("strides", "events", "forces")

    def to_frame(self, table: Table = "strides") -> pd.DataFrame:
        """A pandas DataFrame: ``strides`` (one row each), ``events``, or ``forces`` (one row a sample)."""
        if table != "forces":
            return super().to_frame(table)
        import pandas as pd

        forces = self.columns()
        for name in self.feet:
            forces[f"{name}_phase"] = pd.Categorical.from_codes(forces[f"{name}_phase"], pd.Index(STATES))
        return pd.DataFrame(forces)

    def plot(self) -> Figure:
        """A figure with a panel for each foot: force over time and the events.

        If no force is known, the readings of the units are shown.
        """
        figure, axes = panels(len(self.feet))
        for axis, (name, foot) in zip(axes, self.feet.items(), strict=True):
            if foot.force_n is not None:
                axis.plot(foot.time_s, foot.force_n, linewidth=0.8, color="black", label="whole foot")
            for column, region in enumerate(foot.regions):
                axis.plot(foot.time_s, foot.load[:, column], linewidth=0.8, label=region)
            for event, colour in (("heel_strike", "tab:green"), ("toe_off", "tab:red")):
                times = [one.time_s for one in self.events if one.foot == name and one.event == event]
                axis.plot(times, np.zeros(len(times)), "|", markersize=10, color=colour, label=event.replace("_", " "))
            unit = "N" if foot.is_force else foot.symbol
            axis.set(title=name, xlabel="time (s)", ylabel=f"{'force' if foot.is_force else 'reading'} ({unit})")
            axis.legend(loc="upper right")
        return figure

    def columns(self) -> dict[str, Any]:
        """The table of forces by column: units, feet, total, centre of pressure (% of the insole's length), phase.

        Phase is 0 in swing, 1 on the heel, 2 on the flat foot, 3 in push. Times are those of the first foot; the other
        foot is interpolated if its times differ. NaN where unknown.
        """
        base = next(iter(self.feet.values())).time_s
        found: dict[str, Any] = {"time_s": base}
        for name, foot in self.feet.items():
            suffix = "n" if foot.is_force else foot.symbol.casefold()
            for column, region in enumerate(foot.regions):
                found[f"{name}_{region}_{suffix}"] = _interpolated(base, foot, foot.load[:, column])
            if foot.force_n is not None:
                found[f"{name}_total_n"] = _interpolated(base, foot, foot.force_n)
            if foot.sd_n is not None:
                found[f"{name}_total_sd_n"] = _interpolated(base, foot, foot.sd_n)
        if self.total_n is not None:
            found["total_n"] = np.interp(base, self.total_time_s, self.total_n, left=np.nan, right=np.nan)
        for name, foot in self.feet.items():
            for column, way in enumerate(("along", "medial")):
                found[f"{name}_centre_{way}_percent"] = 100.0 * _interpolated(base, foot, foot.centre[:, column])
            nearest = np.clip(np.round((base - foot.time_s[0]) * foot.rate_hz).astype(int), 0, foot.time_s.size - 1)
            found[f"{name}_phase"] = foot.state[nearest]
        return found


def _interpolated(base: Array, foot: FootSeries, values: Array) -> Array:
    """Values (n,) of a foot interpolated at the times ``base``; NaN outside the foot's own times."""
    if base is foot.time_s:
        return values
    return np.asarray(np.interp(base, foot.time_s, values, left=np.nan, right=np.nan))


@dataclass(frozen=True, eq=False, repr=False)
class DayResult(GaitFindings):
    """A long trial: numbers and flags of the whole, but no signals over time.

    ``events`` and ``strides`` are only the first ones, up to time ``listed_s`` (None if all are listed), of
    ``event_count`` and ``stride_count``.
    """

    duration_s: float
    recorded_s: float
    event_count: int
    stride_count: int
    listed_s: float | None

    def _counts(self) -> tuple[int, int]:
        return self.stride_count, self.event_count

    def to_dict(self) -> dict[str, Any]:
        """The result in schema smartshoe.gait/1, with an additional object ``stream``."""
        return super().to_dict() | {
            "stream": {
                "duration_s": self.duration_s,
                "recorded_s": self.recorded_s,
                "events": self.event_count,
                "strides": self.stride_count,
                "listed_to_s": self.listed_s,
            }
        }

    def plot(self) -> Figure:
        """A figure with the duration of each listed stride, and its stance as a share of it, by foot."""
        figure, (times, shares) = panels(2)
        for name in self.indices:
            own = [stride for stride in self.strides if stride.foot == name]
            start_s = [stride.start_s for stride in own]
            times.plot(start_s, [stride.time_s for stride in own], ".", markersize=3, label=name)
            shares.plot(start_s, [stride.stance_percent for stride in own], ".", markersize=3, label=name)
        times.set(ylabel="stride time (s)")
        shares.set(xlabel="time (s)", ylabel="stance (% of stride)")
        times.legend(loc="upper right")
        return figure
