"""`examine`: all checks that a recording of a shoe allows, in the order in which a person would make them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from smartshoe.arrays import Array
from smartshoe.calibration import Calibration, compensate
from smartshoe.errors import InputError, MissingChannelError, UsageError
from smartshoe.gait._estimate import calibration_of
from smartshoe.gait.field._at_rest import SHORTEST_S, check_zero
from smartshoe.gait.field._body_weight import check_body_weight
from smartshoe.gait.field._finding import CheckResult, Verdict
from smartshoe.gait.field._silence import check_units
from smartshoe.gait.field._swing_zero import SwingZero
from smartshoe.gait.field._temperature import temperature_of_zeros
from smartshoe.recording import UNITS_OF_A_SHOE, Channel, Recording
from smartshoe.signals.noise import white_noise_sd

USUAL_FULL_SCALE_N = 800.0  # of the protocols in the paper
REST_LONGEST_S = 5.0
STEPS_ON = 0.05  # of full scale: a unit's change when somebody steps into the shoe
BEFORE_S = 0.3  # end of the rest that is left out, since a hand may be on the shoe
LOADED_NOISES = 50.0  # times the noise of a reading: a step changes it by more, a rest never does
REPORTED_DRIFT = 0.02  # of full scale
ZERO_REPEATS = 0.002  # of full scale: how well a sensor's zero repeats from day to day (HDI data sheet: 0.1 % typical)
WORST: tuple[Verdict, ...] = ("fault", "warning", "unknown", "ok")


@dataclass(frozen=True, eq=False)
class Examination:
    """What `examine` found of one recording.

    ``verdict`` is the worst of its findings, "unknown" where nothing could be checked.
    """

    name: str
    findings: tuple[CheckResult, ...]

    @property
    def verdict(self) -> Verdict:
        """The most serious verdict: "fault", "warning" or "ok"; "unknown" if nothing could be checked."""
        said = {finding.verdict for finding in self.findings}
        return next((verdict for verdict in ("fault", "warning", "ok") if verdict in said), "unknown")

    def of_kind(self, kind: str) -> tuple[CheckResult, ...]:
        """The findings of one kind."""
        return tuple(finding for finding in self.findings if finding.kind == kind)

    def to_dict(self) -> dict[str, Any]:
        """The examination as an object for JSON."""
        return {
            "recording": self.name,
            "verdict": self.verdict,
            "findings": [finding.to_dict() for finding in self.findings],
        }


def examine(
    recording: Recording,
    calibrations: Sequence[Calibration] = (),
    *,
    body_weight_n: float | None = None,
    coverage: float = 1.0,
) -> Examination:
    """Check the units of one or two shoes in ``recording``: response, zero at the start, drift in swing, body weight.

    Channels are readings, with a calibration for the unit of that name if there is one, or forces already. Raises
    `MissingChannelError` if the recording has no unit of a shoe, and `UsageError` if two calibrations are for one unit.
    """
    units = _shoe_of(recording)
    if len(recording) < 2:
        raise InputError(f"{recording.label} holds one sample: record a few seconds at least")
    by_unit = _named(units, calibrations)
    found: list[CheckResult] = []
    for group in _same_kind(units):
        readings = np.column_stack([channel.with_nan() for channel in group.values()])
        scale = np.array([_full_scale(name, channel, by_unit) for name, channel in group.items()])
        expected = np.array([_expected(name, channel, by_unit) for name, channel in group.items()])
        highs = [channel.range_[1] if channel.range_ else math.inf for channel in group.values()]
        high = np.array(highs) if all(map(math.isfinite, highs)) else None
        found += check_units(recording.time_s, readings, list(group), full_scale=scale, range_high=high)
        found += _at_rest(recording.time_s, readings, group, scale, expected, by_unit)
    forces = _forces(recording, units, by_unit)
    feet = _feet(forces)
    for names in feet.values():
        found += _in_swing(recording, {name: forces[name] for name in names}, by_unit)
    if body_weight_n is not None:
        found.append(_body_weight(recording, units, forces, feet, body_weight_n, coverage))
    found.sort(key=lambda finding: WORST.index(finding.verdict))
    return Examination(recording.label, tuple(found))


def examine_trial(
    recordings: Sequence[Recording],
    calibrations: Sequence[Calibration] = (),
    *,
    body_weight_n: float | None = None,
    coverage: float = 1.0,
) -> tuple[Examination, ...]:
    """`examine` for several recordings, each with the calibrations of its units.

    For two simultaneous recordings of one shoe each, body weight is checked on their sum, and that result comes last.
    Raises `UsageError` for a calibration that fits none of them.
    """
    fitting: list[list[Calibration]] = [[] for _ in recordings]
    for calibration in calibrations:
        fits = [k for k, r in enumerate(recordings) if calibration in _named(_shoe_of(r), [calibration]).values()]
        if not fits:
            raise UsageError(
                f"the calibration of {calibration.unit or 'a unit without a name'!r} fits no column of"
                f" {', '.join(recording.label for recording in recordings)}: give the calibrations of this shoe"
            )
        for k in fits:
            fitting[k].append(calibration)
    pair = _is_pair(recordings)
    alone_n = None if pair else body_weight_n
    found = [
        examine(recording, own, body_weight_n=alone_n, coverage=coverage)
        for recording, own in zip(recordings, fitting, strict=True)
    ]
    if pair and body_weight_n is not None:
        found.append(_weighed_together(recordings, fitting, body_weight_n, coverage))
    return tuple(found)


def _is_pair(recordings: Sequence[Recording]) -> bool:
    """Whether these are two recordings of one shoe each, of different feet, which overlap by half of their time."""
    if len(recordings) != 2:
        return False
    sides = [{_side(name) for name in _shoe_of(recording)} for recording in recordings]
    if any(len(side) != 1 for side in sides) or (sides[0] == sides[1] and sides[0] != {""}):
        return False
    one, other = recordings
    shared_s = min(one.time_s[-1], other.time_s[-1]) - max(one.time_s[0], other.time_s[0])
    return bool(shared_s > 0.5 * max(one.duration_s, other.duration_s))


def _weighed_together(
    recordings: Sequence[Recording], fitting: Sequence[Sequence[Calibration]], body_weight_n: float, coverage: float
) -> Examination:
    """Check body weight on two shoes in two files; a mean over strides tolerates a delay between their clocks."""
    one, other = recordings
    label = f"{one.label} and {other.label}"
    totals: list[tuple[Array, Array]] = []
    for recording, own in zip(recordings, fitting, strict=True):
        units = _shoe_of(recording)
        forces = _forces(recording, units, _named(units, own))
        finding = _not_weighable(recording, units, forces)
        if finding is not None:
            return Examination(label, (finding,))
        totals.append((recording.time_s, np.sum(list(forces.values()), axis=0)))
    first_s = totals[0][0]
    shared = (first_s >= other.time_s[0]) & (first_s <= other.time_s[-1])
    time_s = first_s[shared]
    feet = {"first": totals[0][1][shared], "second": np.interp(time_s, *totals[1])}
    return Examination(label, (check_body_weight(time_s, feet, body_weight_n, coverage=coverage),))


def _shoe_of(recording: Recording) -> dict[str, Channel]:
    """The channels of a shoe's units; raises `MissingChannelError` if there is none."""
    units = {name: channel for name, channel in recording.channels.items() if name in UNITS_OF_A_SHOE}
    if not units:
        raise MissingChannelError(
            f"{recording.label} has no unit of a shoe; it has {', '.join(recording.channels)}: name columns like"
            " left_heel_mbar or heel_n"
        )
    return units


def _named(units: Mapping[str, Channel], calibrations: Sequence[Calibration]) -> dict[str, Calibration]:
    """The calibration of each unit that has one: by full name, or by region if the calibration names no side."""
    by_name: dict[str, Calibration] = {}
    for calibration in calibrations:
        if calibration.unit in by_name:
            raise UsageError(f"two calibrations are of {calibration.unit or 'a unit without a name'}: give one a unit")
        by_name[calibration.unit] = calibration
    found = {name: calibration_of(by_name, name) for name in units}
    return {name: calibration for name, calibration in found.items() if calibration is not None}


def _same_kind(units: Mapping[str, Channel]) -> list[dict[str, Channel]]:
    """Units of one shoe whose readings have the same unit of measurement, so that they can be compared."""
    groups: dict[tuple[str, str], dict[str, Channel]] = {}
    for name, channel in units.items():
        groups.setdefault((_side(name), channel.unit.symbol), {})[name] = channel
    return list(groups.values())


def _side(name: str) -> str:
    return name.partition("_")[0] if "_" in name else ""


def _full_scale(name: str, channel: Channel, by_unit: Mapping[str, Calibration]) -> float:
    """Full scale of a unit's readings: the known one, otherwise the range of the recorded readings."""
    known = _known_full_scale(name, channel, by_unit)
    if known is not None:
        return known
    seen = float(np.ptp(channel.values))
    return seen if seen > 0.0 else 1.0


def _known_full_scale(name: str, channel: Channel, by_unit: Mapping[str, Calibration]) -> float | None:
    """The range of the unit's sensor, or the reading at the calibration's largest load; None if neither is known."""
    if channel.unit.quantity == "force":
        return float(channel.unit.from_si(USUAL_FULL_SCALE_N))
    if channel.range_ is not None:
        return channel.range_[1] - channel.range_[0]
    calibration = by_unit.get(name)
    if calibration is not None and calibration.reading_unit == channel.unit:
        load_n = (calibration.load_range_n or (0.0, USUAL_FULL_SCALE_N))[1]
        return load_n * calibration.a1 / calibration.b1
    return None


def _expected(name: str, channel: Channel, by_unit: Mapping[str, Calibration]) -> float:
    calibration = by_unit.get(name)
    return calibration.offset if calibration is not None and calibration.reading_unit == channel.unit else 0.0


def _at_rest(
    time_s: Array,
    readings: Array,
    group: Mapping[str, Channel],
    scale: Array,
    expected: Array,
    by_unit: Mapping[str, Calibration],
) -> list[CheckResult]:
    """Check the zero during the time before somebody steps in, and the warming it implies."""
    held = np.column_stack([channel.values for channel in group.values()])  # missing samples hold the last reading
    first = np.median(held[: max(2, int(0.2 / np.median(np.diff(time_s))))], axis=0)
    noise = np.array([white_noise_sd(column) for column in held.T])
    moved = np.abs(held - first) > np.maximum(STEPS_ON * scale, 6.0 * noise)
    unscaled = [name for name, channel in group.items() if _known_full_scale(name, channel, by_unit) is None]
    if unscaled and (np.ptp(held, axis=0) <= LOADED_NOISES * noise).all():
        says = (
            f"nobody stepped in, and no range or calibration says how much a reading of {', '.join(unscaled)} is: the"
            " zero is not checked, give --calibration"
        )
        return [CheckResult("zero", "unknown", says, ", ".join(group))]
    on = int(np.argmax(moved.any(axis=1))) if moved.any() else time_s.size
    end_s = float(time_s[on] - BEFORE_S) if on < time_s.size else float(time_s[-1])
    stop = int(np.searchsorted(time_s, min(end_s, float(time_s[0]) + REST_LONGEST_S), side="right"))
    if stop < 2 or time_s[stop - 1] - time_s[0] < SHORTEST_S:
        says = (
            f"no rest of {SHORTEST_S:g} s before the first step: the zero is not checked, stand off for 2 s next time"
        )
        return [CheckResult("zero", "unknown", says, ", ".join(group))]
    symbol = next(iter(group.values())).unit.symbol
    span = slice(0, stop)
    zeros = check_zero(
        time_s[span], readings[span], list(group), full_scale=scale, expected=expected, symbol=symbol
    )  # fmt: skip
    found = [item.finding() for item in zeros]
    unit = next(iter(group.values())).unit
    if unit.quantity == "pressure" and all(name in by_unit for name in group) and all(z.is_usable for z in zeros):
        changes = np.array([item.reading for item in zeros]) - expected
        sds = np.hypot([item.sd for item in zeros], ZERO_REPEATS * scale)
        found.append(temperature_of_zeros(
            changes * unit.scale, sds * unit.scale, list(group), when="since the calibration: "
        ))  # fmt: skip
    return found


def _forces(recording: Recording, units: Mapping[str, Channel], by_unit: Mapping[str, Calibration]) -> dict[str, Array]:
    """Force (n,) in N of each unit whose force is known."""
    forces: dict[str, Array] = {}
    for name, channel in units.items():
        if channel.unit.quantity == "force":
            forces[name] = channel.si
        elif name in by_unit:
            alone = recording.without(*(other for other in recording.channels if other != name))
            forces[name] = compensate(alone, by_unit[name])
    return forces


def _feet(forces: Mapping[str, Array]) -> dict[str, list[str]]:
    feet: dict[str, list[str]] = {}
    for name in forces:
        feet.setdefault(_side(name), []).append(name)
    return feet


def _in_swing(
    recording: Recording, forces: Mapping[str, Array], by_unit: Mapping[str, Calibration]
) -> list[CheckResult]:
    """Each unit's zero error in swing at the end of the recording, and the warming it would imply."""
    names = list(forces)
    follower = SwingZero(len(names), sample_rate_hz=recording.sample_rate_hz, slew_per_s=1.0)
    follower.push(np.column_stack(list(forces.values())))
    if not follower.swings:
        return []
    found = []
    for name, zero_n in zip(names, follower.zero, strict=True):
        large = abs(zero_n) > REPORTED_DRIFT * follower.full_scale
        says = f"{name} shows {zero_n:.2g} N in swing at the end"
        says += ": zero it in swing, or before use" if large else ", as good as nothing"
        found.append(
            CheckResult("swing_zero", "warning" if large else "ok", says, name, None, {"zero_n": float(zero_n)})
        )  # fmt: skip
    warm = [name for name in names if name in by_unit and by_unit[name].reading_unit.quantity == "pressure"]
    if len(warm) == len(names) and len(warm) > 1:
        # Convert from force back to pressure by the static gain; the zero moves slowly enough for that.
        per_n = np.array([by_unit[n].a1 / by_unit[n].b1 * by_unit[n].reading_unit.scale for n in warm])
        spread_n = np.array([max(white_noise_sd(forces[name]), 1.0) for name in warm])
        found.append(temperature_of_zeros(follower.zero * per_n, spread_n * per_n, warm, when="in swing at the end: "))
    return found


def _body_weight(
    recording: Recording,
    units: Mapping[str, Channel],
    forces: Mapping[str, Array],
    feet: Mapping[str, Sequence[str]],
    body_weight_n: float,
    coverage: float,
) -> CheckResult:
    """Check body weight on the forces of the feet; "unknown" if they cannot be used."""
    finding = _not_weighable(recording, units, forces)
    if finding is not None:
        return finding
    totals = {side or "one": np.sum([forces[name] for name in names], axis=0) for side, names in feet.items()}
    return check_body_weight(recording.time_s, totals, body_weight_n, coverage=coverage)


def _not_weighable(
    recording: Recording, units: Mapping[str, Channel], forces: Mapping[str, Array]
) -> CheckResult | None:
    """The reason why body weight cannot be checked; None if it can."""
    without = [name for name in units if name not in forces]
    if without:
        many = "has" if len(without) == 1 else "have"
        says = f"{', '.join(without)} {many} no force: give --calibration for each unit"
        return CheckResult("body_weight", "unknown", says)
    if not recording.is_uniform:
        return CheckResult(
            "body_weight", "unknown", "the steps of time are uneven: body weight is checked on even ones"
        )
    return None
