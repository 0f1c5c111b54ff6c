"""`Recording`: immutable channels with names and units on one time base, exchanged between all packages.

Numbers stay exactly as the instrument logged them, each channel with its unit, so that reading and writing lose
nothing; a computation requests SI by name (``recording.force_n``, ``channel.si``) or a unit explicitly.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Literal, Self, cast

import numpy as np
from numpy.typing import ArrayLike

from smartshoe.arrays import Array, Index, Mask, numbers_of
from smartshoe.display import Summarised, SummaryTable, first_names, panels, significant
from smartshoe.errors import InputError, MissingChannelError, UnitError
from smartshoe.stamps import SAME_STEP, mean_step_s, rounded_grid_step_s, usual_step_s
from smartshoe.units import SECOND, Unit, declared, unit_of_suffix

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Role = Literal["load", "sensor", "command", "auxiliary"]

REGIONS = ("toe", "meta1", "meta4", "heel")
UNITS_OF_A_SHOE = REGIONS + tuple(f"{side}_{region}" for side in ("left", "right") for region in REGIONS)
LOAD_NAME, COMMAND_NAME, SENSOR_NAME = "force", "command", "pressure"
TIME_NAME = "time"  # the name of the time base, which no channel may have


@dataclass(frozen=True, eq=False)
class Channel:
    """One signal of a recording.

    ``values`` (n,) are finite and read-only, in ``unit``; where ``missing`` (n,) is True there was no sample, and the
    value repeats the last one. ``range_`` and ``resolution`` are the instrument's, in ``unit``.
    """

    name: str
    values: Array
    unit: Unit
    role: Role = "auxiliary"
    missing: Mask | None = None
    range_: tuple[float, float] | None = None
    resolution: float | None = None

    @classmethod
    def from_values(cls, name: str, values: ArrayLike, unit: Unit, role: Role = "auxiliary") -> Self:
        """A channel from arbitrary numbers: non-finite ones become missing samples."""
        array = np.array(numbers_of(values, f"channel {name}"), copy=True)
        if array.ndim != 1:
            raise InputError(f"channel {name} has shape {array.shape}: give one number per sample")
        finite = np.isfinite(array)
        missing: Mask | None = None
        if not finite.all():
            missing = ~finite
            if missing.all():
                array[:] = 0.0
            else:
                index = np.where(finite, np.arange(array.size), 0)
                np.maximum.accumulate(index, out=index)
                index[: int(np.argmax(finite))] = int(np.argmax(finite))
                array = array[index]
            missing.flags.writeable = False
        array.flags.writeable = False
        return cls(name, array, unit, role, missing)

    @property
    def si(self) -> Array:
        """(n,) values in the quantity's SI unit."""
        return self.unit.to_si(self.values)

    def in_unit(self, unit: Unit) -> Array:
        """(n,) values in ``unit``."""
        return self.unit.convert(self.values, unit)

    @property
    def present(self) -> Mask:
        """(n,) True where a sample was logged."""
        return np.ones(self.values.size, dtype=bool) if self.missing is None else ~self.missing

    def with_nan(self) -> Array:
        """(n,) values with NaN at missing samples: only for output (files, plots)."""
        if self.missing is None:
            return self.values
        return np.where(self.missing, np.nan, self.values)

    def with_values(self, values: ArrayLike) -> Channel:
        """The same channel with ``values`` (n,) instead, NaN where a sample is missing."""
        made = Channel.from_values(self.name, values, self.unit)
        return replace(self, values=made.values, missing=made.missing)

    def taken(self, index: slice | Index | Mask) -> Channel:
        """The channel at the samples ``index``."""
        values = self.values[index]
        values.flags.writeable = False
        return replace(self, values=values, missing=None if self.missing is None else self.missing[index])


def _role_of(name: str, unit_: Unit) -> Role:
    if name == LOAD_NAME and unit_.quantity == "force":
        return "load"
    if name == COMMAND_NAME:
        return "command"
    if name == SENSOR_NAME or name in UNITS_OF_A_SHOE:
        return "sensor"
    return "auxiliary"


def only_reading(roles: Sequence[Role | None], units: Sequence[Unit | None]) -> int | None:
    """Index of the only auxiliary channel beside a load, if its unit is one of sensor readings; else None.

    Channels of the crosshead and of the room do not count.
    """
    beside = {"length", "temperature"}
    left = [
        index
        for index, (role, unit_) in enumerate(zip(roles, units, strict=True))
        if role != "load" and not (role == "auxiliary" and unit_ is not None and unit_.quantity in beside)
    ]
    if len(left) != 1 or roles[left[0]] != "auxiliary":
        return None
    unit_ = units[left[0]]
    return left[0] if unit_ is not None and unit_.quantity not in ("force", "time") else None


def split_column(column: str) -> tuple[str, Unit | None]:
    """A plain table's column ``name_unit`` as its name and unit (None where the suffix is not a unit)."""
    for cut in range(len(column)):  # the longest suffix that is a unit: force_n_per_s before force_n_per + s
        if column[cut] == "_" and 0 < cut < len(column) - 1:
            found = unit_of_suffix(column[cut + 1 :])
            if found is not None:
                return column[:cut], found
    return column, None


@dataclass(frozen=True, eq=False, repr=False)
class Recording(Summarised):
    """One experiment: channels on one time base.

    ``time_s`` (n,) increases strictly; its step may vary. ``unit`` names the sensing unit (``left_toe``). ``metadata``
    holds the information in the file, ``source`` its origin, ``notes`` the changes that the reader made (rows dropped,
    signs reversed), one sentence each.
    """

    time_s: Array
    channels: Mapping[str, Channel]
    name: str = "recording"
    unit: str | None = None
    metadata: Mapping[str, str] = field(default_factory=dict)
    source: str = ""
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        time_s = np.array(numbers_of(self.time_s, f"{self.label}: time_s"), copy=True)
        if time_s.ndim != 1 or time_s.size == 0:
            raise InputError(f"{self.label} holds no samples")
        if not np.isfinite(time_s).all():
            at = int(np.argmin(np.isfinite(time_s)))
            raise InputError(f"{self.label}: time of sample {at + 1} is missing: give every row a time")
        step = np.diff(time_s)
        if step.size and not (step > 0).all():
            at = int(np.argmax(step <= 0))
            fault = "repeats" if step[at] == 0 else "goes back"
            raise InputError(
                f"{self.label}: time {fault} at sample {at + 2} ({time_s[at]:.9g} s, then {time_s[at + 1]:.9g} s):"
                " remove or re-time that row"
            )
        time_s.flags.writeable = False
        object.__setattr__(self, "time_s", time_s)
        for channel in self.channels.values():
            if channel.values.shape != time_s.shape:
                raise InputError(
                    f"{self.label}: channel {channel.name} has {channel.values.size} samples, time has {time_s.size}"
                )
        named = [column_name(channel) for channel in self.channels.values()]
        twice = (
            TIME_NAME
            if TIME_NAME in self.channels
            else next((name for name, count in Counter([f"{TIME_NAME}_s", *named]).items() if count > 1), None)
        )
        if twice is not None:
            raise InputError(f"{self.label} has two columns {twice}: rename one, the time base's own is time_s")
        object.__setattr__(self, "channels", MappingProxyType(dict(self.channels)))
        object.__setattr__(self, "metadata", MappingProxyType(dict(self.metadata)))

    @classmethod
    def from_arrays(
        cls,
        *,
        time_s: ArrayLike,
        name: str = "recording",
        unit: str | None = None,
        metadata: Mapping[str, str] | None = None,
        **columns: ArrayLike,
    ) -> Self:
        """A recording from arrays named like a plain table's columns: ``force_n=``, ``pressure_mbar=``, ...

        A single column beside the load is the reading if its unit is one of sensor readings (``cell_v=``). NaN, or a
        masked array's mask, marks a missing sample. Raises `UnitError` for a name without a unit, `InputError` for
        values that are not numbers, shapes that differ or time that does not increase.
        """
        channels: dict[str, Channel] = {}
        for column, values in columns.items():
            channel_name, unit_ = split_column(column)
            if unit_ is None:
                raise UnitError(f"column {column!r} ends in no known unit: name it like force_n or pressure_mbar")
            channels[channel_name] = Channel.from_values(channel_name, values, unit_, _role_of(channel_name, unit_))
        if SENSOR_NAME in channels:  # the unit under test; other named sensors of the shoe are its neighbours
            channels = {
                key: replace(one, role="auxiliary") if one.role == "sensor" and key != SENSOR_NAME else one
                for key, one in channels.items()
            }
        keys = list(channels)
        only = only_reading([one.role for one in channels.values()], [one.unit for one in channels.values()])
        if only is not None:
            channels[keys[only]] = replace(channels[keys[only]], role="sensor")
        return cls(cast("Array", time_s), channels, name, unit, dict(metadata or {}))

    def __reduce__(self) -> tuple[Any, ...]:
        """Support pickling between processes, which a mapping proxy does not."""
        plain = (self.time_s, dict(self.channels), self.name, self.unit, dict(self.metadata), self.source, self.notes)
        return type(self), plain

    # -- properties ------------------------------------------------------------------------------------------
    @property
    def label(self) -> str:
        """The file, or else the name, by which error messages refer to this recording."""
        return self.source or self.name

    def positive(self, key: str, unit: str) -> float:
        """The number under ``key`` in the metadata; raises `InputError` unless it is above 0."""
        text = self.metadata[key]
        try:
            value = float(text)
        except ValueError:
            value = np.nan
        if not (np.isfinite(value) and value > 0):
            raise InputError(f"{self.label}: {key} is {text!r}: give a positive number in {unit}")
        return value

    def __len__(self) -> int:
        return int(self.time_s.size)

    def __getitem__(self, name: str) -> Channel:
        try:
            return self.channels[name]
        except KeyError:
            raise MissingChannelError(
                f"{self.label} has no channel {name!r}; it has {first_names(list(self.channels)) or 'none'}"
            ) from None

    @property
    def duration_s(self) -> float:
        """Time in s from the first sample to the last."""
        return float(self.time_s[-1] - self.time_s[0])

    @cached_property
    def sample_time_s(self) -> float:
        """The median step in s, or that of the even grid from which the times were rounded: see `usual_step_s`."""
        if len(self) < 2:
            raise InputError(f"{self.label} holds one sample: a signal needs two at least")
        return usual_step_s(self.time_s)

    @property
    def sample_rate_hz(self) -> float:
        """Samples per second where none is missing: `sample_rate_of` its time."""
        if len(self) < 2:
            raise InputError(f"{self.label} holds one sample: a rate needs two at least")
        return sample_rate_of(self.time_s)

    @property
    def is_uniform(self) -> bool:
        """Whether every step is within 1 % of the median step."""
        step = np.diff(self.time_s)
        return bool(step.size == 0 or np.all(np.abs(step - np.median(step)) <= SAME_STEP * np.median(step)))

    def plot(self) -> Figure:
        """A figure of every channel over time, with one axis per unit of measurement; NaN leaves a gap."""
        symbols = list(dict.fromkeys(channel.unit.symbol for channel in self.channels.values()))
        figure, axes = panels(max(len(symbols), 1))
        for axis, symbol in zip(axes, symbols, strict=False):
            for channel in self.channels.values():
                if channel.unit.symbol == symbol:
                    axis.plot(self.time_s, channel.with_nan(), linewidth=0.8, label=channel.name)
            axis.set(xlabel="time (s)", ylabel=symbol or "1")
            axis.legend(loc="upper right")
        axes[0].set_title(self.name)
        return figure

    def _summary_table(self) -> SummaryTable:
        rows = []
        for channel in self.channels.values():
            values = channel.values[channel.present]
            ends = (float(values.min()), float(values.max())) if values.size else (None, None)
            lost = str(len(self) - values.size)
            rows.append([channel.name, channel.role, channel.unit.symbol, *map(significant, ends), lost])
        return SummaryTable(
            f"{self.name}: {len(self)} samples, {significant(self.duration_s)} s",
            ["channel", "role", "unit", "least", "most", "missing"],
            rows,
            self.notes,
        )

    # -- channels --------------------------------------------------------------------------------------------
    def of_role(self, role: Role) -> tuple[Channel, ...]:
        """The channels of one role, in the recording's order."""
        return tuple(channel for channel in self.channels.values() if channel.role == role)

    @property
    def loads_and_sensors(self) -> tuple[Channel, ...]:
        """Every reference load, then every reading."""
        return (*self.of_role("load"), *self.of_role("sensor"))

    @property
    def load(self) -> Channel:
        """The reference load (compression positive); raises `MissingChannelError` where there is none."""
        found = self.of_role("load")
        if not found:
            raise MissingChannelError(
                f"{self.label} has no reference load; {self._named_by('--force', 'Load[N]', LOAD_NAME, 'n')}"
                f" (columns: {first_names(list(self.channels))})"
            )
        return found[0]

    @property
    def sensors(self) -> tuple[Channel, ...]:
        """The readings of the sensing units."""
        return self.of_role("sensor")

    @property
    def sensor(self) -> Channel:
        """The only reading of a unit's recording; raises `MissingChannelError` unless there is exactly one."""
        found = self.sensors
        if len(found) != 1:
            names = first_names([one.name for one in found])
            what = f"{len(found)} readings ({names})" if found else "no sensor reading"
            likely = next((one.name for one in found or self.of_role("auxiliary")), "")
            raise MissingChannelError(
                f"{self.label} has {what}; {self._named_by('--sensor', likely, SENSOR_NAME, 'v')}"
                f" (columns: {first_names(list(self.channels))})"
            )
        return found[0]

    def _named_by(self, option: str, column: str, name: str, suffix: str) -> str:
        """How the user can choose a column: for a file by an ``option``, for arrays by their names."""
        if not self.source:
            return f"name its array {name}_ and its unit, for example {name}_{suffix}="
        example = f", for example {option} '{column}'" if column else ""
        return f"name its column with {option}{example}"

    @property
    def force_n(self) -> Array:
        """(n,) reference load in newton."""
        return self.load.si

    @property
    def pressure_pa(self) -> Array:
        """(n,) the unit's gauge pressure in pascal; raises `UnitError` where the sensor's reading is not a pressure."""
        sensor = self.sensor
        if sensor.unit.quantity != "pressure":
            raise UnitError(f"{self.label}: {sensor.name} is in {sensor.unit.symbol}, not a pressure")
        return sensor.si

    @property
    def command_n(self) -> Array | None:
        """(n,) the commanded load in newton, or None where it was not logged."""
        found = self.of_role("command")
        return found[0].si if found else None

    # -- changed copies --------------------------------------------------------------------------------------
    def with_channel(self, channel: Channel) -> Recording:
        """This recording with ``channel`` added, or replacing the one of the same name."""
        return replace(self, channels={**self.channels, channel.name: channel})

    def without(self, *names: str) -> Recording:
        """This recording without the named channels."""
        return replace(self, channels={n: c for n, c in self.channels.items() if n not in names})

    def taken(self, index: slice | Index | Mask) -> Recording:
        """This recording at the samples ``index`` (a slice, a mask or increasing indices)."""
        return replace(
            self,
            time_s=self.time_s[index],
            channels={name: channel.taken(index) for name, channel in self.channels.items()},
        )

    def between(self, start_s: float, end_s: float) -> Recording:
        """The samples with start_s <= time < end_s."""
        first, last = np.searchsorted(self.time_s, [start_s, end_s])
        return self.taken(slice(int(first), int(last)))

    def noted(self, *sentences: str) -> Recording:
        """This recording with remarks added to ``notes``."""
        return replace(self, notes=(*self.notes, *sentences))

    def to_frame(self):  # type: ignore[no-untyped-def]  # pandas stays a lazy import
        """A pandas DataFrame with the plain table's column names; NaN where a sample is missing."""
        import pandas as pd

        return pd.DataFrame(dict(self.columns()))

    def columns(self) -> list[tuple[str, Array]]:
        """The plain table's columns: (``name_unit``, values with NaN where missing), time first."""
        return [("time_s", self.time_s)] + [(column_name(c), c.with_nan()) for c in self.channels.values()]


def column_name(channel: Channel) -> str:
    """The plain table's column for a channel: its name with the unit's suffix."""
    return f"{channel.name}_{channel.unit.suffix}"


def sample_rate_of(time_s: Array) -> float:
    """Sampling rate in Hz, while no sample is missing, of time stamps (n,), at least two.

    If the stamps were rounded from an even grid, its rate is used: at 90 Hz, stamps rounded to milliseconds are mostly
    11 ms apart. Otherwise the mean step without gaps.
    """
    step_s = rounded_grid_step_s(time_s)
    return 1.0 / (mean_step_s(time_s) if step_s is None else step_s)


__all__ = [
    "REGIONS",
    "SECOND",
    "UNITS_OF_A_SHOE",
    "Channel",
    "Recording",
    "Role",
    "column_name",
    "declared",
    "sample_rate_of",
    "split_column",
]
