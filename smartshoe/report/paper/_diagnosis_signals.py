"""Figures of a diagnosis' signals: simulation and measurement, loops, and the residual before and after."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from smartshoe.arrays import Array
from smartshoe.diagnosis import Trace
from smartshoe.report.diagnosis.views import (
    MOST_GROUPS,
    EvidenceView,
    TraceSegment,
    binned,
    edges_of,
    loops_at_two_rates,
    spectrum,
    worst_cycle,
)
from smartshoe.report.paper.drawing import STYLE, figure_of, thin
from smartshoe.signals.masks import runs_of

# Okabe and Ito's colours, which colour-blind readers can distinguish; the baseline is also dashed.
MEASURED, BASELINE, EXTENDED = "#111827", "#D55E00", "#0072B2"
DIRECTIONS = ((1, "#009E73", "loading"), (-1, "#CC79A7", "unloading"))
SHADE = "#eef2ff"


def beside_measurement(traces: Sequence[Trace], unit: str) -> Figure | None:
    """The worst cycle that was not fitted and the whole recording around it, with the error of each simulation."""
    worst = worst_cycle(traces)
    if worst is None:
        return None
    trace = worst.trace
    changed = _differs(trace)
    with mpl.rc_context(STYLE):
        figure, axes = figure_of(10.6, 5.4, 2, 2)
        figure.subplots_adjust(left=0.085)
        whole = TraceSegment(trace, 0, trace.time_s.size)
        for column, (segment, title) in enumerate(
            ((worst, "the cycle where the simulation is worst"), (whole, "the whole recording"))
        ):
            signal, off = axes[column], axes[2 + column]
            time_s, reading = trace.time_s[segment.span], trace.reading[segment.span]
            usable = trace.usable[segment.span]
            signal.plot(*thin(time_s, reading), color=MEASURED, lw=2.2, alpha=0.45, label="measured")
            for values, colour, line, label in _simulations(trace, changed):
                part = values[segment.span]
                signal.plot(*thin(time_s, part), line, color=colour, label=label)
                off.plot(*thin(time_s[usable], (reading - part)[usable]), color=colour, lw=0.8, label=label)
            off.axhline(0.0, color=MEASURED, lw=0.6)
            signal.set_title(f"{_short(trace.name)}: {title}", fontsize=9)
            off.set_xlabel("time (s)")
        axes[0].set_ylabel(f"reading ({unit})")
        axes[2].set_ylabel(f"measured − simulated ({unit})")
        axes[0].legend(loc="best", fontsize=8)
        axes[3].axvspan(
            float(trace.time_s[worst.start]), float(trace.time_s[worst.stop - 1]), color=SHADE, zorder=0, lw=0
        )
        return figure


def loops(traces: Sequence[Trace], unit: str) -> Figure | None:
    """Reading over load at a slow and a fast rate; below it minus a straight line, so that the loop is visible."""
    chosen = loops_at_two_rates(traces)
    if not chosen:
        return None
    with mpl.rc_context(STYLE):
        figure, axes = figure_of(10.6, 5.4, len(chosen), 2)
        figure.subplots_adjust(left=0.085)
        for column, (rate, segment) in enumerate(chosen):
            trace = segment.trace
            above, below = axes[column], axes[len(chosen) + column]
            load_n, reading = trace.load_n[segment.span], trace.reading[segment.span]
            line = np.polynomial.Polynomial.fit(load_n, reading, 1)
            above.plot(*_path(load_n, reading), color=MEASURED, lw=2.2, alpha=0.45, label="measured")
            below.plot(*_path(load_n, reading - line(load_n)), color=MEASURED, lw=2.0, alpha=0.45)
            for values, colour, style, label in _simulations(trace, _differs(trace)):
                part = values[segment.span]
                above.plot(*_path(load_n, part), style, color=colour, label=label)
                below.plot(*_path(load_n, part - line(load_n)), style, color=colour)
            above.set_title(f"{rate:g} N/s ({_short(trace.name)})", fontsize=9)
            below.set_xlabel("load (N)")
        axes[0].set_ylabel(f"reading ({unit})")
        axes[len(chosen)].set_ylabel(f"reading less a\nstraight line ({unit})")
        axes[0].legend(loc="upper left", fontsize=8)
        return figure


def residual_by_course(found: EvidenceView, unit: str) -> Figure:
    """The residual over time, load cycle and frequency; before above and after below, on the same axes."""
    courses = _residuals(found)
    with mpl.rc_context(STYLE):
        figure, axes = _rows_of_three(len(courses))
        judged = found.judged
        limit = _limit(found.before)
        densities = []
        for row, (residual, colour, label) in enumerate(courses):
            by_time, by_cycle, by_frequency = axes[3 * row : 3 * row + 3]
            by_time.plot(*thin(found.time_s, residual), color=colour, lw=0.5, alpha=0.45)
            mean = binned(found.time_s, residual, edges_of(found.time_s, 150))
            by_time.plot(mean.x, mean.mean, color=colour, lw=1.4)
            for begin, end in _held_out_spans(found):
                by_time.axvspan(begin, end, color=SHADE, zorder=0, lw=0)
            cycle = found.cycle[judged].astype(float) + 1.0
            _mean_and_band(by_cycle, cycle, residual[judged], colour, bins=int(min(np.ptp(cycle) + 1, 4 * MOST_GROUPS)))
            by_cycle.xaxis.get_major_locator().set_params(integer=True)
            shown = spectrum(found, residual)
            densities += [(*shown, colour)] if shown[0].size else []
            for frequency, density, its_colour in densities:
                by_frequency.loglog(frequency, density, color=its_colour, lw=1.4 if its_colour == colour else 0.8)
            by_time.set_ylabel(f"{label}measured − simulated ({unit})")
            by_frequency.set_ylabel(f"density ({unit}/√Hz)")
            for axis in (by_time, by_cycle):
                axis.set_ylim(-limit, limit)
                axis.axhline(0.0, color=MEASURED, lw=0.6)
        _same_limits(*axes[2::3])
        _named(axes, "over time", "over load cycles", "over frequency")
        _labelled(axes, "time, recordings one after the other (s)", "load cycle (number)", "frequency (Hz)")
        return figure


def residual_by_state(found: EvidenceView, unit: str) -> Figure:
    """The residual over load, reading and rate, loading and unloading separately; before above and after below."""
    courses = _residuals(found)
    with mpl.rc_context(STYLE):
        figure, axes = _rows_of_three(len(courses))
        judged, direction = found.judged, found.direction
        limit = _limit(found.before)
        for row, (residual, own, label) in enumerate(courses):
            by_load, by_reading, by_rate = axes[3 * row : 3 * row + 3]
            for sense, colour, name in DIRECTIONS:
                chosen = judged & (direction == sense)
                for axis, x in ((by_load, found.load_n), (by_reading, found.reading)):
                    _mean_and_band(axis, x[chosen], residual[chosen], colour, name)
            _mean_and_band(by_rate, found.rate_n_per_s[judged], residual[judged], own)
            by_load.set_ylabel(f"{label}measured − simulated ({unit})")
            for axis in (by_load, by_reading, by_rate):
                axis.set_ylim(-limit, limit)
                axis.axhline(0.0, color=MEASURED, lw=0.6)
        _named(axes, "over load", "over the reading", "over the rate of loading")
        _labelled(axes, "load (N)", f"reading ({unit})", "rate (N/s), unloading negative")
        axes[0].legend(loc="best", fontsize=8)
        return figure


def _rows_of_three(rows: int) -> tuple[Figure, list[Any]]:
    height = 0.6 + 2.0 * rows
    figure, axes = figure_of(10.6, height, 3, rows)
    figure.subplots_adjust(left=0.085, wspace=0.32, hspace=0.22)
    return figure, axes


def _named(axes: Sequence[Any], *titles: str) -> None:
    for axis, title in zip(axes[:3], titles, strict=True):
        axis.set_title(title, fontsize=9)


def _labelled(axes: Sequence[Any], *labels: str) -> None:
    for axis, label in zip(axes[-3:], labels, strict=True):
        axis.set_xlabel(label)


def _simulations(trace: Trace, changed: bool) -> list[tuple[Array, str, str, str]]:
    said = [(trace.baseline, BASELINE, "--", "baseline simulation")]
    return [*said, (trace.extended, EXTENDED, "-", "extended simulation")] if changed else said


def _residuals(found: EvidenceView) -> tuple[tuple[Array, str, str], ...]:
    """Residual, colour and label, before and after; only one of them if nothing was added to the model."""
    if not found.is_changed:
        return ((found.before, BASELINE, ""),)
    return (found.before, BASELINE, "before\n"), (found.after, EXTENDED, "after\n")


def _differs(trace: Trace) -> bool:
    return not np.array_equal(trace.baseline, trace.extended)


def _short(name: str) -> str:
    # matplotlib would read a pair of dollar signs as mathematics.
    return (name if len(name) <= 28 else f"{name[:27]}…").replace("$", r"\$")


def _path(load_n: Array, values: Array) -> tuple[Array, Array]:
    """A loop with fewer points: those at which ``values`` are extreme."""
    _, thinned, load = thin(np.arange(load_n.size, dtype=float), values, load_n)
    return load, thinned


def _limit(values: Array) -> float:
    return 1.25 * float(np.percentile(np.abs(values), 99.7)) or 1.0


def _mean_and_band(axis: Any, x: Array, values: Array, colour: str, label: str = "", bins: int | None = None) -> None:
    """Draw the mean as a line and one standard deviation around it as a band."""
    found = binned(x, values, edges_of(x, bins))
    axis.fill_between(found.x, found.mean - found.sd, found.mean + found.sd, color=colour, alpha=0.15, lw=0)
    axis.plot(found.x, found.mean, color=colour, lw=1.4, marker=".", ms=3.5, label=label)


def _held_out_spans(found: EvidenceView) -> list[tuple[float, float]]:
    """Begin and end in s of the segments that were not fitted; none if all or nothing was fitted."""
    mask = found.held_out
    if not mask.any() or mask.all():
        return []
    return [(float(found.time_s[a]), float(found.time_s[b - 1])) for a, b in zip(*runs_of(mask), strict=True)]


def _same_limits(*axes: Any) -> None:
    low = min(axis.get_ylim()[0] for axis in axes)
    high = max(axis.get_ylim()[1] for axis in axes)
    for axis in axes:
        axis.set_ylim(low, high)
