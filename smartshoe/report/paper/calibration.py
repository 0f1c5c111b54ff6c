"""A unit's figures for papers: signals, loops, the filter's Bode plot, residuals."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from smartshoe.calibration.validation import ForceTrace
from smartshoe.recording import Recording
from smartshoe.report.calibration import UnitReport
from smartshoe.report.paper.drawing import STYLE, figure_of, save, thin
from smartshoe.signals.loading import by_rate, cycles

LOAD, READING, RAW, COMPENSATED = "#1f2937", "#2563eb", "#d97706", "#059669"
FEWEST = 300


def signals(recordings: Sequence[Recording]) -> Figure:
    """Load and reading over time, with one column for each recording."""
    with mpl.rc_context(STYLE):
        columns = len(recordings)
        figure, axes = figure_of(9.6, 3.6, columns, 2)
        for column, recording in enumerate(recordings):
            sensor = recording.sensor
            for axis, values, colour, label in (
                (axes[column], recording.force_n, LOAD, "load (N)"),
                (axes[columns + column], sensor.values, READING, f"{sensor.name} ({sensor.unit.symbol})"),
            ):
                axis.plot(*thin(recording.time_s, values), color=colour)
                if column == 0:
                    axis.set_ylabel(label)
            axes[column].set_title(recording.name)
            axes[columns + column].set_xlabel("time (s)")
        return figure


def loops(traces: Sequence[ForceTrace], rates_n_per_s: Sequence[float] = (100.0, 800.0)) -> Figure | None:
    """Raw (best static line) and compensated force over load at a low and a high rate, as in the paper's Fig. 8.

    The nearest available rates are taken; None if the recordings contain no cycle.
    """
    found = [(trace, cycle) for trace in traces for cycle in cycles(trace.time_s, trace.load_n)]
    groups = by_rate([cycle for _, cycle in found])
    if not groups:
        return None
    owner = {id(cycle): trace for trace, cycle in found}
    chosen = sorted({min(groups, key=lambda rate: abs(rate - wanted)) for wanted in rates_n_per_s})
    with mpl.rc_context(STYLE):
        figure, axes = figure_of(9.6, 5.2, len(chosen), 2)
        # Below each loop its error is drawn: above, a loop of one percent is only a thick line.
        for axis, distance, rate in zip(axes, axes[len(chosen) :], chosen, strict=False):
            cycle = groups[rate][-1]
            trace, span = owner[id(cycle)], slice(cycle.start, cycle.stop)
            load_n = trace.load_n[span]
            axis.plot([load_n.min(), load_n.max()], [load_n.min(), load_n.max()], color="#9ca3af", lw=0.8)
            for values, colour, label in (
                (trace.static_n[span], RAW, "raw, best static line"),
                (trace.compensated_n[span], COMPENSATED, "compensated"),
            ):
                axis.plot(*thin(np.arange(load_n.size, dtype=float), load_n, values)[1:], color=colour, label=label)
                distance.plot(
                    *thin(np.arange(load_n.size, dtype=float), load_n, values - load_n)[1:], color=colour, lw=0.8
                )
            axis.set_title(f"{rate:g} N/s")
            distance.set_xlabel("load (N)")
        axes[0].set_ylabel("estimate (N)")
        axes[len(chosen)].set_ylabel("estimate − load (N)")
        axes[0].legend(loc="upper left")
        return figure


def bode(
    a1: float, b0: float, b1: float, rate_hz: float, numerator: Sequence[float], denominator: Sequence[float]
) -> Figure:
    """Gain and phase of (b0 s + b1)/(s + a1) and of its bilinear filter at ``rate_hz``; the band of gait is shaded."""
    frequency = np.geomspace(max(a1 / (2 * np.pi) / 30, 1e-4), 0.499 * rate_hz, 200)
    s = 2j * np.pi * frequency
    z = np.exp(-s / rate_hz)
    shapes = (
        ((b0 * s + b1) / (s + a1), LOAD, "-", "identified"),
        (
            np.polyval(numerator[::-1], z) / np.polyval(denominator[::-1], z),
            COMPENSATED,
            "--",
            f"filter at {rate_hz:g} Hz",
        ),
    )
    with mpl.rc_context(STYLE):
        figure, (gain, phase) = figure_of(9.6, 2.8, 2)
        for response, colour, line, label in shapes:
            gain.semilogx(frequency, np.abs(response) / (b1 / a1), line, color=colour, label=label)
            phase.semilogx(frequency, np.degrees(np.angle(response)), line, color=colour)
        for axis, label in ((gain, "gain over static gain"), (phase, "phase lead (°)")):
            axis.axvspan(0.5, 5.0, color="#dbeafe", zorder=0, label="gait, 0.5–5 Hz" if axis is gain else None)
            axis.set_xlabel("frequency (Hz)")
            axis.set_ylabel(label)
        gain.legend(loc="upper left", fontsize=8)
        return figure


def residuals(traces: Sequence[ForceTrace]) -> Figure:
    """Compensated force minus load, over time and over load."""
    with mpl.rc_context(STYLE):
        figure, (by_time, by_load) = figure_of(9.6, 2.8, 2)
        start = 0.0
        for trace in traces:
            error = (trace.compensated_n - trace.load_n)[trace.valid]
            time_s = trace.time_s[trace.valid]
            by_time.plot(*thin(start + time_s - time_s[0], error), color=COMPENSATED, lw=0.7)
            start += float(time_s[-1] - time_s[0])
            step = max(1, error.size // FEWEST)
            by_load.plot(trace.load_n[trace.valid][::step], error[::step], ".", color=COMPENSATED, ms=2.0)
        by_time.set_xlabel("time, recordings one after the other (s)")
        by_time.set_ylabel("compensated − load (N)")
        by_load.set_xlabel("load (N)")
        return figure


def figures_of(unit: UnitReport) -> Iterator[tuple[str, Figure]]:
    """Yield the unit's figures with their names."""
    discrete, parameters = unit.identification["discrete"], unit.identification["parameters"]
    a1, b0, b1 = (parameters[name]["value"] for name in ("a1", "b0", "b1"))
    yield "signals", signals(unit.recordings)
    drawn = loops(unit.validation.traces)
    if drawn is not None:
        yield "loops", drawn
    yield "bode", bode(a1, b0, b1, discrete["sample_rate_hz"], discrete["numerator"], discrete["denominator"])
    yield "residuals", residuals(unit.validation.traces)


def write_figures(folder: Path, units: Sequence[UnitReport], endings: Sequence[str]) -> list[Path]:
    """Write each unit's figures as ``UNIT_WHAT`` with each of ``endings`` below ``folder``; returns the paths."""
    return [
        path
        for unit in units
        for what, figure in figures_of(unit)
        for path in save(figure, folder, f"{unit.name}_{what}", endings)
    ]
