"""A unit's charts: error by rate, residual loops, signals, and the filter's frequency response."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from smartshoe.arrays import Array
from smartshoe.calibration.validation import ForceTrace, Validation
from smartshoe.recording import Recording
from smartshoe.report.calibration._unit_report import UnitReport
from smartshoe.report.charts import Chart, Line, Mark, Panel
from smartshoe.report.numbers import plain
from smartshoe.signals.loading import Cycle, Ramp, by_rate, cycles

LOOP_POINTS = 160
SHARE = np.linspace(0.02, 0.98, LOOP_POINTS)  # of the load's span: the corners at the ends of a ramp are left out
GAIT_HZ = (0.5, 5.0)


def error_by_rate(unit: UnitReport, limits: tuple[float, float]) -> Chart | None:
    """Errors of the static line and of the corrected force at each loading rate; None with fewer than two rates."""
    rates = unit.validation.rates
    if len(rates) < 2:
        return None
    slow, fast = rates[0], rates[-1]
    says = (
        f"Corrected, the error is {plain(slow.rmse_compensated_n)} N at {slow.rate_n_per_s:g} N/s and"
        f" {plain(fast.rmse_compensated_n)} N at {fast.rate_n_per_s:g} N/s."
    )
    lines = [
        Line("best static line", np.array([rate.rmse_static_n for rate in rates]), "raw", "dashed"),
        Line("corrected", np.array([rate.rmse_compensated_n for rate in rates]), "corrected"),
    ]
    x = np.array([rate.rate_n_per_s for rate in rates], dtype=float)
    return Chart("Error by loading rate", says, "loading rate (N/s)", x, [Panel("error, rms (N)", lines, limits)],
                 log_x=True)  # fmt: skip


def _cycles_by_rate(validation: Validation) -> dict[float, list[tuple[ForceTrace, Cycle]]]:
    found = [(trace, cycle) for trace in validation.traces for cycle in cycles(trace.time_s, trace.load_n)]
    owner = {id(cycle): trace for trace, cycle in found}
    groups = by_rate([cycle for _, cycle in found])
    return {rate: [(owner[id(cycle)], cycle) for cycle in group] for rate, group in groups.items()}


def _over_load(load_n: Array, error_n: Array, ramp: Ramp, at_n: Array) -> Array:
    """The ramp's error at the loads ``at_n``, smoothed between neighbouring loads so that noise is not aliased."""
    span = slice(ramp.start, ramp.stop)
    order = np.argsort(load_n[span], kind="stable")
    return np.asarray(np.interp(at_n, load_n[span][order], _smooth(error_n[span][order])))


def _smooth(values: Array) -> Array:
    """Running mean over one step of the chart's grid."""
    width = max(1, values.size // LOOP_POINTS)
    padded = np.pad(values, (width // 2, width - 1 - width // 2), mode="edge")
    return np.asarray(np.convolve(padded, np.full(width, 1.0 / width), mode="valid"))


@dataclass(frozen=True, slots=True, eq=False)
class ResidualLoop:
    """A unit's errors at ``rate_n_per_s`` over loads ``at_n`` (n,), averaged over the cycles of that rate.

    ``errors_n`` maps "raw up", "raw down", "corrected up" and "corrected down" to estimate minus load (n,), in N.
    """

    rate_n_per_s: float
    at_n: Array
    errors_n: Mapping[str, Array]


def residual_loops(validation: Validation) -> tuple[ResidualLoop, ...]:
    """The loops at the slowest and at the fastest rate; only one if there is one rate, none without cycles."""
    groups = _cycles_by_rate(validation)
    return tuple(_residual_loop(rate, groups[rate]) for rate in sorted({min(groups), max(groups)} if groups else ()))


def _residual_loop(rate_n_per_s: float, group: Sequence[tuple[ForceTrace, Cycle]]) -> ResidualLoop:
    low = max(float(trace.load_n[cycle.start : cycle.stop].min()) for trace, cycle in group)
    high = min(float(trace.load_n[cycle.start : cycle.stop].max()) for trace, cycle in group)
    at_n = low + SHARE * (high - low)
    found = {}
    for kind, name in (("raw", "static_n"), ("corrected", "compensated_n")):
        for way in ("up", "down"):
            each = [
                _over_load(trace.load_n, getattr(trace, name) - trace.load_n, getattr(cycle, way), at_n)
                for trace, cycle in group
            ]
            found[f"{kind} {way}"] = np.mean(each, axis=0)
    return ResidualLoop(rate_n_per_s, at_n, found)


def loop_chart(unit: UnitReport, loop: ResidualLoop, limits: tuple[float, float]) -> Chart:
    """The errors of the static line and of the filter over load, separately for loading and unloading."""
    errors = loop.errors_n
    widths = {kind: float(np.abs(errors[f"{kind} up"] - errors[f"{kind} down"]).max()) for kind in ("raw", "corrected")}
    says = (
        f"The static line's loop (shaded) is {plain(widths['raw'], 2)} N wide, the corrected one"
        f" {plain(widths['corrected'], 2)} N."
    )
    raw_low, raw_high = (extreme(errors["raw up"], errors["raw down"]) for extreme in (np.minimum, np.maximum))
    lines = [
        Line("static, loading", errors["raw up"], "raw", low=raw_low, high=raw_high),
        Line("static, unloading", errors["raw down"], "raw", "dashed"),
        Line("corrected, loading", errors["corrected up"], "corrected"),
        Line("corrected, unloading", errors["corrected down"], "corrected", "dashed"),
    ]
    name = f"Residual loop at {loop.rate_n_per_s:g} N/s"
    panel = Panel("estimate − load (N)", lines, limits)
    return Chart(name, says, "load (N)", loop.at_n, [panel], group=f"loops {unit.name}")


def signals(unit: UnitReport, recording: Recording) -> Chart:
    """Load and reading over time and, if the recording was judged, the remaining error."""
    sensor = recording.sensor
    panels = [
        Panel("load (N)", [Line("load", recording.force_n, "load")], height=120),
        Panel(f"{sensor.name} ({sensor.unit.symbol})", [Line("reading", sensor.values, "reading")], height=120),
    ]
    trace = next((one for one in unit.validation.traces if one.name == recording.name), None)
    judged = trace is not None and trace.time_s.size == len(recording)
    if trace is not None and judged:
        left = np.where(trace.valid, trace.compensated_n - trace.load_n, np.nan)
        panels.append(Panel("error (N)", [Line("corrected − load", left, "corrected")], height=120))
    kind = "judged" if judged else "fitted" if recording.name in unit.fitted else "not used"
    says = f"{plain(recording.duration_s)} s at {plain(recording.sample_rate_hz)} Hz; {kind}."
    return Chart(f"Recording {recording.name}", says, "time (s)", recording.time_s, panels)


def response(unit: UnitReport) -> Chart:
    """Gain and phase lead of the filter at its sample rate; the frequency band of gait is shaded."""
    discrete, parameters = unit.identification["discrete"], unit.identification["parameters"]
    rate_hz = float(discrete["sample_rate_hz"])
    a1, b0, b1 = (float(parameters[name]["value"]) for name in ("a1", "b0", "b1"))
    frequency = np.geomspace(max(a1 / (2 * np.pi) / 30, 1e-4), 0.499 * rate_hz, 200)

    def both(at_hz: Array) -> tuple[NDArray[Any], NDArray[Any]]:
        s, z = 2j * np.pi * at_hz, np.exp(-2j * np.pi * at_hz / rate_hz)
        numerator, denominator = (np.polyval(discrete[name][::-1], z) for name in ("numerator", "denominator"))
        return numerator / denominator / (b1 / a1), (b0 * s + b1) / (s + a1) / (b1 / a1)

    made, _ = both(frequency)
    in_gait = np.linspace(*GAIT_HZ, 50) if GAIT_HZ[1] < 0.5 * rate_hz else frequency
    filtered, identified = both(in_gait)
    apart = 100 * float(np.max(np.abs(filtered / identified - 1)))
    says = (
        f"At {rate_hz:g} Hz the filter follows the identified model to {plain(apart, 2)} % in gait's band"
        f" ({GAIT_HZ[0]:g} to {GAIT_HZ[1]:g} Hz, shaded)."
    )
    panels = [
        Panel("gain over static gain", [Line("gain", np.abs(made), "corrected")], height=130),
        Panel("phase lead (°)", [Line("phase lead", np.degrees(np.angle(made)), "reading")], height=130),
    ]
    return Chart("The correcting filter (Bode)", says, "frequency (Hz)", frequency, panels, log_x=True,
                 marks=[Mark(*GAIT_HZ, "mark", "gait")])  # fmt: skip


def common_limits(
    units: Sequence[UnitReport], loops: Iterable[ResidualLoop]
) -> tuple[tuple[float, float], tuple[float, float]]:
    """A common scale for all units' loops and one for their errors by rate, so that units can be compared."""
    widest = max((float(np.abs(error).max()) for loop in loops for error in loop.errors_n.values()), default=1.0)
    worst = max(
        (max(rate.rmse_static_n, rate.rmse_compensated_n) for unit in units for rate in unit.validation.rates),
        default=1.0,
    )
    return (-1.08 * widest, 1.08 * widest), (0.0, 1.08 * worst)
