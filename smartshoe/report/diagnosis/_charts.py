"""A diagnosis' charts: the error before and after over time, load, rate, cycles and frequency; the load to run next."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from smartshoe.arrays import Array
from smartshoe.diagnosis import Diagnosis, Trace
from smartshoe.display import duration
from smartshoe.protocol import Protocol
from smartshoe.report.charts import Chart, Line, Mark, Panel, Style
from smartshoe.report.diagnosis._sentences import file_name
from smartshoe.report.diagnosis.views import (
    Binned,
    EvidenceView,
    TraceSegment,
    binned,
    edges_of,
    loops_at_two_rates,
    spectrum,
    worst_cycle,
)
from smartshoe.report.numbers import plain
from smartshoe.report.wording import words
from smartshoe.signals.masks import runs_of

BEFORE, AFTER = "raw", "corrected"
WAYS = ((1, "loading", "line"), (-1, "unloading", "dashed"))
MOST_RECORDINGS = 6  # whose faults are drawn
LOOP_POINTS = 120
SEEN_SHARE = 0.005  # of a chart's width: a longer gap is seen


def _residuals(found: EvidenceView) -> list[tuple[str, str, Array]]:
    """Label, colour and residual, before and after; only one of them if nothing was added to the model."""
    before = ("before", BEFORE, found.before)
    return [before, ("after", AFTER, found.after)] if found.is_changed else [("error", BEFORE, found.before)]


def _limits(values: Array) -> tuple[float, float]:
    limit = 1.25 * float(np.percentile(np.abs(values), 99.7)) or 1.0
    return -limit, limit


def _around(lines: Sequence[Line]) -> tuple[float, float] | None:
    """A scale, symmetric about zero, that contains the lines' bands; None if they contain no number."""
    bands = np.concatenate([band for line in lines for band in (line.low, line.high) if band is not None])
    most = float(np.nanmax(np.abs(bands), initial=0.0))
    return (-1.08 * most, 1.08 * most) if most > 0 else None


def _line(label: str, colour: str, found: Binned, dashed: bool = False) -> Line:
    style: Style = "dashed" if dashed else "line"
    return Line(label, found.mean, colour, style, low=found.mean - found.sd, high=found.mean + found.sd)


def _broken(time_s: Array, values: Array) -> Array:
    """``values`` (n,) with lines broken where samples are left out, or missing, for as long as a chart shows."""
    steps_s = np.diff(time_s, prepend=time_s[0])
    return np.where(steps_s > max(SEEN_SHARE * np.ptp(time_s), 3.0 * np.median(steps_s)), np.nan, values)


def over_time(found: EvidenceView, unit: str) -> Chart:
    """The error of all recordings, one after the other, before and after on a common scale, below the load."""
    limits = _limits(found.before)
    panels = [Panel("load (N)", [Line("load", _broken(found.time_s, found.load_n), "load")], height=90)]
    panels += [
        Panel(f"{label} ({unit})", [Line(label, _broken(found.time_s, residual), colour)], limits, 150)
        for label, colour, residual in _residuals(found)
    ]
    judged = found.held_out
    marks: list[Mark] = []
    if judged.any() and not judged.all():
        marks = [
            Mark(float(found.time_s[a]), float(found.time_s[b - 1]), "mark", "not fitted")
            for a, b in zip(*runs_of(judged), strict=True)
        ]
    said = "Measured less simulated reading, recordings one after the other."
    said += " Shaded: not fitted." if marks else ""
    return Chart("The error over time", said, "time (s)", found.time_s, panels, marks=marks)


def worst(traces: Sequence[Trace], unit: str) -> Chart | None:
    """The errors of both simulations in the load cycle, or part of the time, in which the baseline is worst."""
    segment = worst_cycle(traces)
    if segment is None:
        return None
    trace = segment.trace
    usable = trace.usable[segment.span]
    label = "before" if differs(trace) else "error"
    lines = [Line(label, np.where(usable, (trace.reading - trace.baseline)[segment.span], np.nan), BEFORE)]
    if differs(trace):
        lines.append(Line("after", np.where(usable, (trace.reading - trace.extended)[segment.span], np.nan), AFTER))
    held = "not fitted" if trace.held_out[segment.span].mean() > 0.5 else "fitted"
    says = (
        f"{file_name(trace.name)}, the load cycle, or part of the time where there are few cycles, on which the"
        f" simulation is furthest off ({held})."
    )
    panels = [
        Panel("load (N)", [Line("load", trace.load_n[segment.span], "load")], height=90),
        Panel(f"measured − simulated ({unit})", lines, height=200),
    ]
    return Chart("Where the error is largest", says, "time (s)", trace.time_s[segment.span], panels)


def differs(trace: Trace) -> bool:
    """Whether the simulations of the extended model and of the baseline differ for a recording."""
    return not np.array_equal(trace.baseline, trace.extended)


def loops(traces: Sequence[Trace], unit: str) -> list[Chart]:
    """Reading minus a straight line over load, loading and unloading separately, at the slowest and fastest rate."""
    return [
        _loop(rate, segment, unit) for rate, segment in loops_at_two_rates(traces) if segment.stop - segment.start > 20
    ]


def _loop(rate: float, segment: TraceSegment, unit: str) -> Chart:
    trace, span = segment.trace, segment.span
    load_n, reading = trace.load_n[span], trace.reading[span]
    straight = np.polynomial.Polynomial.fit(load_n, reading, 1)
    top = int(np.argmax(load_n))
    low, high = (float(edge) for edge in np.percentile(load_n, [3.0, 97.0]))
    at_n = np.linspace(low, high, LOOP_POINTS)
    shown = [("measured", "load", reading), ("before", BEFORE, trace.baseline[span])]
    if differs(trace):
        shown.append(("after", AFTER, trace.extended[span]))
    lines = []
    for label, colour, values in shown:
        bent = values - straight(load_n)
        lines.append(Line(f"{label}, loading", _along(load_n[: top + 1], bent[: top + 1], at_n), colour))
        lines.append(Line(f"{label}, unloading", _along(load_n[top:], bent[top:], at_n), colour, "dashed"))
    says = f"{file_name(trace.name)}: reading less one straight line, so that the loop can be seen."
    return Chart(f"The loop at {rate:g} N/s", says, "load (N)", at_n, [Panel(f"less a line ({unit})", lines)],
                 group="loops")  # fmt: skip


def _along(load_n: Array, values: Array, at_n: Array) -> Array:
    """``values`` of one direction of a loop, interpolated at loads ``at_n`` (m,); NaN beyond the direction's ends."""
    order = np.argsort(load_n, kind="stable")
    return np.asarray(np.interp(at_n, load_n[order], values[order], left=np.nan, right=np.nan))


def over_state(found: EvidenceView, unit: str) -> list[Chart]:
    """The error over load, reading and rate; loading and unloading are separate, and before is above after."""
    reading = "Mean and band of one sd; lines that part between loading and unloading are a loop."
    charts = []
    for title, label, x in (("load", "load (N)", found.load_n), ("the reading", f"reading ({unit})", found.reading)):
        edges = edges_of(x[found.judged])
        panels: list[Panel] = []
        for when, colour, residual in _residuals(found):
            lines = []
            for sense, way, style in WAYS:
                chosen = found.judged & (found.direction == sense)
                lines.append(_line(way, colour, binned(x[chosen], residual[chosen], edges), style == "dashed"))
            panels.append(Panel(f"{when} ({unit})", lines, _around(panels[0].lines if panels else lines), 130))
        middle = 0.5 * (edges[:-1] + edges[1:])
        charts.append(Chart(f"The error over {title}", reading, label, middle, panels))
    rate = found.rate_n_per_s[found.judged]
    x, lines = _means(found, rate, edges_of(rate))
    charts.append(Chart("The error over the rate of loading", "Mean and band of one sd; unloading is negative.",
                        "rate (N/s)", x, [Panel(f"measured − simulated ({unit})", lines)]))  # fmt: skip
    return charts


def _means(found: EvidenceView, x: Array, edges: Array) -> tuple[Array, list[Line]]:
    """The means of the error before and after over ``x``, both of judged samples; bins without samples are left out."""
    each = [(when, colour, binned(x, residual[found.judged], edges)) for when, colour, residual in _residuals(found)]
    filled = np.isfinite(each[0][2].mean)
    drawn = [(when, colour, Binned(*(v[filled] for v in (one.x, one.mean, one.sd)))) for when, colour, one in each]
    return drawn[0][2].x, [_line(*one) for one in drawn]


def over_cycles(found: EvidenceView, unit: str) -> Chart | None:
    """Mean and spread of the error in each load cycle, before and after; None with one cycle."""
    cycle = found.cycle[found.judged]
    if np.ptp(cycle) == 0:
        return None
    edges = np.asarray(np.arange(cycle.min(), cycle.max() + 2) + 0.5, dtype=np.float64)
    x, lines = _means(found, cycle.astype(np.float64) + 1.0, edges)
    says = (
        "Mean and band of one sd; what comes and goes with use shows here. Where load cycles are few, they are parts of"
        " the time. Numbers count on through all recordings"
    )
    says += "." if found.judged.all() else "; those that were fitted are not shown."
    panels = [Panel(f"measured − simulated ({unit})", lines)]
    return Chart("The error over load cycles", says, "load cycle (number)", x, panels)


def over_frequency(found: EvidenceView, unit: str) -> Chart | None:
    """The amplitude spectral density of the error in decibel, before and after; None if there is nothing to show."""
    made = [(when, colour, *spectrum(found, residual)) for when, colour, residual in _residuals(found)]
    made = [one for one in made if one[2].size > 1]
    if not made:
        return None
    frequency = made[0][2]
    lines = [
        Line(when, np.interp(frequency, own, 20.0 * np.log10(density)), colour) for when, colour, own, density in made
    ]
    says = "Where all is explained, no rise is left at low frequencies."
    label = f"density (dB of 1 {unit}/√Hz)"
    return Chart("The error over frequency", says, "frequency (Hz)", frequency, [Panel(label, lines)], log_x=True)


def faults(diagnosis: Diagnosis) -> list[Chart]:
    """Load and reading of each recording with faults; faults are shaded, and samples left out of every fit are gaps."""
    charts: list[Chart] = []
    for trace in diagnosis.traces:
        own = [fault for fault in diagnosis.data_faults if fault.recording == trace.recording]
        if not own or len(charts) == MOST_RECORDINGS:
            continue
        marks = [Mark(fault.start_s, fault.stop_s, "look", words(fault.kind)) for fault in own]
        used = np.where(trace.usable, trace.reading, np.nan)
        panels = [
            Panel("load (N)", [Line("load", trace.load_n, "load")], height=80),
            Panel(f"reading ({diagnosis.unit})", [Line("reading, as fitted", used, "reading")], height=110),
        ]
        kinds = ", ".join(dict.fromkeys(words(fault.kind) for fault in own))
        left_out = 100.0 * float(np.mean(~trace.usable))
        says = f"Shaded from the first sample at fault to the last: {kinds}."
        says += f" {plain(left_out, 2)} % of the samples were left out of every fit: gaps." if left_out > 0 else ""
        charts.append(Chart(file_name(own[0].label), says, "time (s)", trace.time_s, panels, marks=marks))
    return charts


def protocol(steps: Protocol) -> Chart:
    """The load over time that a protocol prescribes."""
    time_s, load_n = steps.corners()
    says = f"{duration(steps.duration_s)}, up to {plain(float(np.max(load_n)))} N."
    return Chart("The load to run next", says, "time (s)", time_s, [Panel("load (N)", [Line("load", load_n, "load")])])
