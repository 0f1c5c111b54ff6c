"""Sorts a trial's recordings into feet, each with its units' loads on an even time base."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from smartshoe.arrays import Array, Mask
from smartshoe.display import first_names
from smartshoe.errors import InputError, MissingChannelError, UnitError, UsageError
from smartshoe.gait._estimate import UnitLoad, calibration_of, estimate
from smartshoe.gait._flag import Flag
from smartshoe.recording import REGIONS, UNITS_OF_A_SHOE, Channel, Recording

if TYPE_CHECKING:
    from smartshoe.calibration import Calibration


FEET = ("left", "right")
GAP_STEPS = 2.5
NEGATIVE = 10.0  # times further below zero than above it: loads for which tension is positive
FEWEST_STEPS_PER_S = 0.2
CALM_S, CALM_SHARE = 0.1, 0.2  # of the time: a foot is in the air at least that long
LEAST_RATE_HZ = 40.0
FEWEST_SAMPLES = 8
_QUANTITIES = frozenset({"force", "pressure", "voltage", "counts", "resistance", "length", "unknown", "dimensionless"})


@dataclass(frozen=True, eq=False)
class Foot:
    """One shoe's loads: ``load`` (n, r) at the evenly spaced times ``time_s`` (n,), with a column for each unit.

    ``turned`` is true if the loads came negative and their sign was changed.
    """

    name: str
    time_s: Array
    rate_hz: float
    units: tuple[UnitLoad, ...]
    source: str
    turned: bool = False

    @property
    def regions(self) -> tuple[str, ...]:
        """The region of each unit, in the order of the columns."""
        return tuple(unit.name.split("_", 1)[-1] for unit in self.units)

    @property
    def load(self) -> Array:
        """(n, r) loads as estimated; floors are not subtracted."""
        return np.column_stack([unit.load for unit in self.units])

    @property
    def sd_n(self) -> Array | None:
        """(n,) error bar of the sum over the units in N; None unless every unit has one."""
        known = [unit.sd_n for unit in self.units if unit.sd_n is not None]
        return np.asarray(np.sqrt(np.sum(np.square(known), axis=0))) if len(known) == len(self.units) else None

    @property
    def is_force(self) -> bool:
        """Whether every unit's load is in N."""
        return all(unit.is_force for unit in self.units)

    @property
    def missing(self) -> Mask:
        """(n,) True where any unit lacks a sample."""
        return np.asarray(np.any([unit.missing for unit in self.units], axis=0))


def feet_of(
    recordings: Sequence[Recording], calibrations: Sequence[Calibration], estimator: str | None = None
) -> tuple[dict[str, Foot], list[Flag]]:
    """Sort the recordings of one trial into feet, and return them with the flags raised on the way.

    One recording may hold both shoes; two recordings hold one each. Columns without a side belong to the side named in
    the recording's unit, name or file. Raises `InputError` if no unit of a shoe is there, `UsageError` if two
    recordings or two calibrations claim the same unit, and `UnitError` for columns that are not loads.
    """
    if not recordings:
        raise UsageError("a trial needs at least one recording: give one")
    by_name = _by_unit(calibrations)
    feet: dict[str, Foot] = {}
    flags: list[Flag] = []
    used: set[str] = set()
    for number, recording in enumerate(recordings):
        sides, said = _sides(recording, number, set(feet))
        flags += said
        for foot, channels in sides.items():
            if foot in feet:
                raise UsageError(
                    f"{recording.label} and {feet[foot].source} both hold the {foot} shoe: give one trial at a time"
                )
            feet[foot] = _foot(foot, recording, channels, by_name, estimator)
            used |= {u.name for u in feet[foot].units} | set(feet[foot].regions)
    for name in sorted(set(by_name) - used):
        flags.append(
            Flag("unused_calibration", f"the calibration of {name or 'an unnamed unit'} fits no column of the trial")
        )
    return {name: feet[name] for name in FEET if name in feet}, flags


def _by_unit(calibrations: Sequence[Calibration]) -> Mapping[str, Calibration]:
    """The calibrations by the name of their unit; raises `UsageError` if two have the same."""
    found: dict[str, Calibration] = {}
    for calibration in calibrations:
        if calibration.unit in found:
            raise UsageError(
                f"two calibrations are for unit {calibration.unit or '(unnamed)'!r}: give one, or name their units"
                " with identify --unit"
            )
        found[calibration.unit] = calibration
    return found


def _sides(
    recording: Recording, number: int, taken: set[str]
) -> tuple[dict[str, list[tuple[str, Channel]]], list[Flag]]:
    """The units' channels of each foot in a recording, with flags; ``taken`` are the feet of earlier recordings."""
    named = {name: channel for name, channel in recording.channels.items() if name in UNITS_OF_A_SHOE}
    if not named:
        raise MissingChannelError(
            f"{recording.label} has no column of a shoe's unit: name them like left_heel_mbar or right_toe_n, or"
            f" say which is which, --sensor left_heel='{next(iter(recording.channels), 'COLUMN')}[N]'"
            f" (columns: {first_names(list(recording.channels)) or 'none'})"
        )
    for name, channel in named.items():
        if channel.unit.quantity not in _QUANTITIES:
            raise UnitError(
                f"{recording.label}: {name} is in {channel.unit.symbol}, which is no load and no reading of one: give"
                " newton, or millibar with --calibration"
            )
    sides: dict[str, list[tuple[str, Channel]]] = {}
    for foot in FEET:
        found = [(f"{foot}_{region}", named[f"{foot}_{region}"]) for region in REGIONS if f"{foot}_{region}" in named]
        if found:
            sides[foot] = found
    bare = [(region, named[region]) for region in REGIONS if region in named]
    if not bare:
        return sides, []
    named_side = _side_named(recording)
    foot = named_side or next((side for side in FEET if side not in taken and side not in sides), FEET[number % 2])
    if foot in sides:
        raise InputError(
            f"{recording.label} holds {bare[0][0]} and {sides[foot][0][0]}: put left_ or right_ before the columns"
        )
    sides[foot] = [(f"{foot}_{region}", channel) for region, channel in bare]
    if named_side is not None:
        return sides, []
    return sides, [
        Flag(
            "side_unknown",
            f"{recording.label} does not say which foot it is and is taken as the {foot} one: put left_ or right_"
            " before its columns",
            foot=foot,
        )
    ]


def _side_named(recording: Recording) -> str | None:
    """The only foot named in the recording's unit, metadata, name or source; None if there is none."""
    for text in (recording.unit or "", recording.metadata.get("side", ""), recording.name, recording.source):
        found = {side for side in FEET if re.search(rf"(?<![a-z]){side}(?![a-z])", text.casefold())}
        if len(found) == 1:
            return found.pop()
    return None


def _foot(
    foot: str,
    recording: Recording,
    channels: Sequence[tuple[str, Channel]],
    by_name: Mapping[str, Calibration],
    estimator: str | None,
) -> Foot:
    """A foot with its units' loads on an even time base, with the sign turned if compression is negative."""
    if len(recording) < FEWEST_SAMPLES:
        raise InputError(f"{recording.label} holds {len(recording)} samples: a trial needs some seconds of them")
    time_s, rate_hz, on_grid = _even(recording)
    units = tuple(
        estimate(n, on_grid(channel), rate_hz, calibration_of(by_name, n), estimator) for n, channel in channels
    )
    kinds = {unit.is_force for unit in units}
    if len(kinds) == 2:
        # Forces and uncalibrated readings cannot be added.
        bare = [unit.name for unit in units if not unit.is_force]
        raise InputError(
            f"{recording.label}: no calibration of {', '.join(bare)}, whose columns are not in N, as other units are:"
            " give its --calibration, or leave out its column"
        )
    turned = kinds == {True} and _is_upside_down(np.sum([unit.load for unit in units], axis=0), rate_hz)
    if turned:
        units = tuple(replace(unit, load=-unit.load) for unit in units)
    return Foot(foot, time_s, rate_hz, units, recording.label, bool(turned))


def _is_upside_down(load: Array, rate_hz: float) -> bool:
    """Whether compression is negative in ``load`` (n,).

    It is if the load is mostly below zero and, where it has steps, at rest near its maximum. A large zero error makes a
    load negative too; but a foot in the air is at rest, and its load is then at its minimum.
    """
    low, high = (float(level) for level in np.quantile(load, [0.01, 0.99]))
    if -low <= NEGATIVE * max(high, 0.0):
        return False
    above = load > 0.5 * (low + high)
    steps = np.count_nonzero(above[1:] & ~above[:-1])
    if steps < max(2.0, FEWEST_STEPS_PER_S * load.size / rate_hz):
        return True
    half = max(1, round(0.5 * CALM_S * rate_hz))
    moves = np.abs(load[2 * half :] - load[: -2 * half])
    calm = load[half:-half][moves <= np.quantile(moves, CALM_SHARE)]
    return float(np.median(calm)) > 0.5 * (low + high)


def _even(recording: Recording):  # type: ignore[no-untyped-def]  # the third is a function of a channel
    """Even times (n,) with the recording's median step, their rate in Hz, and a function that resamples a channel."""
    time_s = recording.time_s
    step = recording.sample_time_s
    if recording.is_uniform:
        count = time_s.size
        grid = time_s[0] + np.arange(count) * (time_s[-1] - time_s[0]) / (count - 1)
        # Rounded to nine digits: a clock with another start must not change the rate by rounding.
        return grid, float(f"{(count - 1) / (time_s[-1] - time_s[0]):.9g}"), lambda channel: channel
    count = int(np.floor((time_s[-1] - time_s[0]) / step + 1e-6)) + 1
    grid = time_s[0] + step * np.arange(count)
    after = np.clip(np.searchsorted(time_s, grid), 1, time_s.size - 1)
    hole = (time_s[after] - time_s[after - 1] > GAP_STEPS * step) & (np.abs(time_s[after] - grid) > 0.5 * step)
    hole &= np.abs(time_s[after - 1] - grid) > 0.5 * step

    def placed(channel: Channel) -> Channel:
        present = channel.present
        values = np.interp(grid, time_s[present], channel.values[present]) if present.any() else np.zeros(count)
        missing = hole | (np.interp(grid, time_s, (~present).astype(float)) > 0.5)
        return replace(channel, values=values, missing=missing if missing.any() else None)

    return grid, 1.0 / step, placed
