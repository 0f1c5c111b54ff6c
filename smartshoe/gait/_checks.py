"""Flags that say which numbers of a trial should not be trusted, and why, in a sentence each."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from smartshoe.arrays import Mask
from smartshoe.gait._flag import Flag, spans_of, where_text
from smartshoe.gait._labels import clock_flags, label_flags
from smartshoe.gait._series import FootSeries
from smartshoe.gait._strides import LONGEST_GAP_S, Stride
from smartshoe.gait._total import SETTLED_S, TotalForce
from smartshoe.gait._trial import LEAST_RATE_HZ, Foot
from smartshoe.recording import REGIONS
from smartshoe.signals.masks import runs_of

if TYPE_CHECKING:
    from smartshoe.gait._force_sums import Forces


LIGHTEST_N, HEAVIEST_N = 100.0, 2500.0  # range of body weights
WEIGHT_OFF = 0.05
SILENT = 0.02  # of the foot's usual peak: a unit that reaches less bears nothing
FAST = 1.1  # times the calibrated loading rate
FAST_QUANTILE = 0.995
LEAST_DRIFT_S = 10.0
STANDING_DRIFT = 0.02  # of the mean total: largest change from the first fifth of a standing spell to its last


def window_flags(
    feet: Mapping[str, Foot],
    series: Mapping[str, FootSeries],
    strides: Sequence[Stride],
    spans: Sequence[tuple[float, float]],
    loaded: Mapping[str, bool],
    total: TotalForce | None,
) -> list[Flag]:
    """The flags that one window gives rise to; those about whole shoes come first."""
    flags: list[Flag] = []
    if len(feet) == 1:
        flags += _one_shoe_flags(next(iter(feet)))
    for name, foot in feet.items():
        flags += _shoe_flags(foot, series[name], loaded[name], bool(strides or spans))
    labels = label_flags(feet, series, strides)
    flags += labels
    if not labels:
        flags += clock_flags(feet, series, strides)
    if not strides and not spans:
        first = next(iter(feet.values()))
        flags.append(
            Flag(
                "too_short",
                f"{first.time_s[-1] - first.time_s[0]:.3g} s hold no whole stride and no standing of 2 s: record more",
            )
        )
    for name, foot in feet.items():
        flags += _unit_flags(foot, series[name])
        flags += _gap_flags(foot, series[name])
    if total is not None and len(feet) > 1:
        flags += _standing_drift(total, spans)
    return flags + _rate_flags(feet, series)


def trial_flags(forces: Forces, coverage: float, given_n: float | None, walks: int, runs: int) -> list[Flag]:
    """The flags that need the whole trial: an implausible body weight, and strides of both walking and running."""
    flags = _weight_flags(forces, coverage, given_n)
    if walks and runs:
        main = "running" if runs > walks else "walking"
        flags.append(
            Flag(
                "mixed_strides",
                f"{walks} strides are walking and {runs} running: the summary is of the {main} ones",
            )
        )
    return flags


def plain_percent(mask: Mask) -> str:
    """The share of True values, in percent with two digits, as text."""
    share = 100.0 * float(mask.mean())
    return f"{share:.0f}" if share >= 10 else f"{share:.2g}"


def _one_shoe_flags(foot: str) -> list[Flag]:
    other = "right" if foot == "left" else "left"
    return [
        Flag(
            "one_shoe",
            f"the {other} shoe is missing: total force, double support and symmetry are not reported, and body weight"
            f" counts the {foot} foot twice",
            foot=other,
        )
    ]


def _shoe_flags(foot: Foot, series: FootSeries, loaded: bool, moving: bool) -> list[Flag]:
    """Flags about a whole shoe: absent units, no calibration, low rate, wrong sign, no stance, no swing."""
    flags: list[Flag] = []
    absent = [region for region in REGIONS if region not in foot.regions]
    if absent:
        flags.append(
            Flag(
                "missing_unit",
                f"the {foot.name} shoe has no column for {', '.join(absent)}: what they bear is in no force"
                + _late_events(absent),
                foot=foot.name,
                unit=", ".join(absent),
            )
        )
    if not foot.is_force:
        flags.append(
            Flag(
                "uncalibrated",
                f"the {foot.name} shoe's readings are in {foot.units[0].symbol or 'no unit that is known'} and have no"
                " calibration: events and times are reported, forces are not; give --calibration for each unit",
                foot=foot.name,
            )
        )
    if foot.rate_hz < LEAST_RATE_HZ:
        flags.append(
            Flag(
                "low_rate",
                f"{foot.rate_hz:.3g} samples a second make events uncertain by some {500.0 / foot.rate_hz:.0f} ms:"
                " record at 100 Hz or more",
                foot=foot.name,
            )
        )
    if foot.turned:
        flags.append(
            Flag(
                "negative_load",
                f"the {foot.name} shoe's loads are negative and were taken as compression: turn its columns' sign",
                foot=foot.name,
            )
        )
    if len(series.contacts) == 0 and moving and not loaded:
        flags.append(
            Flag(
                "no_stance",
                f"no stance is found on the {foot.name} foot, its loads hardly change: check that its columns are"
                " those of a worn shoe",
                foot=foot.name,
            )
        )
    elif series.contacts.floor_time_s.size == 0 and foot.is_force:
        flags.append(
            Flag(
                "no_swing",
                f"the {foot.name} foot is never seen unloaded: its zero is the calibration's and was not checked; lift"
                " the foot for a second in the record",
                foot=foot.name,
            )
        )
    return flags


def _late_events(absent: Sequence[str]) -> str:
    """A clause on how events suffer from absent heel or toe units; '' if neither is absent."""
    affected = [says for region, says in (("heel", "heel strikes late"), ("toe", "toe offs early")) if region in absent]
    return f", {' and '.join(affected)}, and compared with a whole shoe it is no equal" if affected else ""


def _unit_flags(foot: Foot, series: FootSeries) -> list[Flag]:
    """Flags about single units: saturated, beyond the calibrated load, or without a response to steps."""
    flags: list[Flag] = []
    whole = float(series.usual_peak.sum())
    for column, (region, unit) in enumerate(zip(foot.regions, foot.units, strict=True)):
        if unit.saturated.any():
            spans = spans_of(foot.time_s, unit.saturated)
            flags.append(
                Flag(
                    "saturated",
                    f"{unit.name} stands on its rail in {plain_percent(unit.saturated)} % of the record: the load is"
                    " higher there than is reported",
                    foot.name, region, where_text(spans),
                )
            )  # fmt: skip
        if unit.beyond.any() and unit.range_n:
            spans = spans_of(foot.time_s, unit.beyond)
            most = float(unit.load[unit.beyond].max())
            flags.append(
                Flag(
                    "beyond_calibration",
                    f"{unit.name} bears up to {most:.0f} N, its calibration ends at {unit.range_n:.0f} N: these loads"
                    " are extrapolated",
                    foot.name, region, where_text(spans),
                )
            )  # fmt: skip
        if whole > 0 and len(series.contacts) and series.usual_peak[column] < SILENT * whole:
            flags.append(
                Flag(
                    "silent_unit",
                    f"{unit.name} hardly changes while the foot steps: it bears nothing, or is not connected",
                    foot.name,
                    region,
                )
            )
    return flags


def _gap_flags(foot: Foot, series: FootSeries) -> list[Flag]:
    """Flags for missing samples, separately for long gaps within stances and all others."""
    missing = series.missing
    if not missing.any():
        return []
    start, stop = runs_of(missing)
    long = (stop - start) / foot.rate_hz > 0.5 * LONGEST_GAP_S
    inside = np.array([bool((series.state[a:b] != 0).any()) for a, b in zip(start, stop, strict=True)], dtype=bool)
    flags: list[Flag] = []
    for kind, which, says in (
        ("gap_in_stance", long & inside, "within stances: strides that lose more than 0.1 s count in no mean"),
        ("missing_samples", ~(long & inside), "and straight lines stand in their place"),
    ):
        if which.any():
            marked = np.zeros(missing.size, dtype=bool)
            for a, b in zip(start[which], stop[which], strict=True):
                marked[a:b] = True
            flags.append(
                Flag(
                    kind,
                    f"{plain_percent(marked)} % of the {foot.name} shoe's samples are missing {says}",
                    foot.name,
                    where=where_text(spans_of(foot.time_s, marked)),
                )
            )
    return flags


def _standing_drift(total: TotalForce, spans: Sequence[tuple[float, float]]) -> list[Flag]:
    """A flag if the total force drifts while the person stands, for a standing body's weight does not change."""
    time_s, total_n = total.time_s, total.force_n
    for start_s, end_s in spans:
        first, last = np.searchsorted(time_s, [start_s + SETTLED_S, end_s - SETTLED_S])
        part = total_n[first:last]
        fifth = part.size // 5
        if end_s - start_s < LEAST_DRIFT_S or fifth == 0:
            continue
        begin_n, end_n = float(part[:fifth].mean()), float(part[-fifth:].mean())
        if abs(end_n - begin_n) > STANDING_DRIFT * abs(float(part.mean())):
            return [
                Flag(
                    "standing_drifts",
                    f"the total goes from {begin_n:.0f} to {end_n:.0f} N while the person stands, as no weight does:"
                    " zeros drift or units creep, and only a foot in the air tells a zero; lift each foot for a second"
                    " now and then",
                    where=where_text([(start_s, end_s)]),
                )
            ]
    return []


def _rate_flags(feet: Mapping[str, Foot], series: Mapping[str, FootSeries]) -> list[Flag]:
    """A flag if units are loaded faster than they were calibrated."""
    faster: list[tuple[float, float, str]] = []
    for name, foot in feet.items():
        for unit in foot.units:
            if unit.rate_n_per_s and len(series[name].contacts):
                rate = float(np.quantile(np.abs(np.diff(unit.load)), FAST_QUANTILE)) * foot.rate_hz
                if rate > FAST * unit.rate_n_per_s:
                    faster.append((rate, unit.rate_n_per_s, unit.name))
    if not faster:
        return []
    rate, limit, name = max(faster)
    return [
        Flag(
            "beyond_calibrated_rate",
            f"{len(faster)} units are loaded faster than they were calibrated ({name}: {rate:.0f} N/s, calibrated to"
            f" {limit:.0f} N/s): the filter is extrapolated there",
        )
    ]


def _weight_flags(forces: Forces, coverage: float, given_n: float | None) -> list[Flag]:
    """Flags for a body weight that no person has, and for one that differs from the given one."""
    flags: list[Flag] = []
    weight, mean_n = forces.body_weight, forces.mean_total_n
    found_n = mean_n if mean_n is not None else (weight.value if weight is not None else None)
    if found_n is None:
        return flags
    if not LIGHTEST_N <= found_n <= HEAVIEST_N:
        flags.append(
            Flag(
                "implausible_weight",
                f"the mean total force is {found_n:.3g} N, which is no standing person's weight: the person sat, or"
                " check the columns' units (N, not kN or kg) and the calibrations",
            )
        )
    if given_n is not None and mean_n is not None and abs(mean_n / given_n - 1.0) > WEIGHT_OFF:
        flags.append(
            Flag(
                "body_weight_mismatch",
                f"the mean total force over whole strides or standing is {mean_n:.1f} N, {100 * mean_n / given_n:.0f} %"
                f" of the body weight given: a coverage of {min(coverage * mean_n / given_n, 9.99):.2f} would make them"
                " equal",
            )
        )
    return flags
