"""A unit's four figures as SVG text, by matplotlib's object interface."""

from __future__ import annotations

import io
import re
from typing import TYPE_CHECKING, Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure
from numpy.typing import NDArray

if TYPE_CHECKING:
    from smartshoe.report.model import UnitReport
    from smartshoe.validate import Trace

Array = NDArray[np.float64]
LOAD, RAW, FORCE = "#6b7280", "#d97706", "#2563eb"
_STYLE: dict[str, Any] = {
    "svg.fonttype": "none",
    "svg.hashsalt": "smartshoe",
    "path.simplify": True,
    "path.simplify_threshold": 0.5,
    "font.size": 9,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.alpha": 0.25,
    "lines.linewidth": 1.1,
    "legend.frameon": False,
}


def decimate(time_s: Array, values: Array, buckets: int = 400) -> tuple[Array, Array]:
    """The least and largest value of each of ``buckets`` spans, in order: a line that looks the same, but short."""
    if values.size <= 2 * buckets:
        return time_s, values
    size = -(-values.size // buckets)
    padded = np.pad(values, (0, -values.size % size), mode="edge").reshape(-1, size)
    first = np.arange(padded.shape[0]) * size
    both = np.stack([first + padded.argmin(axis=1), first + padded.argmax(axis=1)], axis=1)
    index = np.unique(np.minimum(both, values.size - 1))
    return time_s[index], values[index]


def _svg(figure: Figure, prefix: str, title: str) -> str:
    """The figure as an <svg> element without prologue, its ids made unique by ``prefix``, named for screen readers."""
    from html import escape

    text = io.StringIO()
    FigureCanvasSVG(figure).print_svg(text, metadata={"Date": None, "Creator": None})
    svg = text.getvalue()
    svg = svg[svg.index("<svg") :]
    svg = re.sub(r"<metadata>.*?</metadata>", "", svg, flags=re.DOTALL)
    svg = re.sub(r'(\bid="|href="#|url\(#)', rf"\g<1>{prefix}-", svg)
    head = f'<svg role="img" aria-label="{escape(title)}"'
    return svg.replace("<svg", head, 1).replace(">", f"><title>{escape(title)}</title>", 1)


def _joined(traces: tuple[Trace, ...]) -> list[tuple[Trace, Array]]:
    """Each recording with its time shifted to follow the one before."""
    found, start = [], 0.0
    for trace in traces:
        found.append((trace, trace.time_s - trace.time_s[0] + start))
        start = float(found[-1][1][-1]) + 1.0
    return found


def _blank(width: float, height: float, columns: int) -> tuple[Figure, list[Axes]]:
    figure = Figure(figsize=(width, height))
    figure.patch.set_alpha(0.0)
    axes = [figure.add_subplot(1, columns, i + 1) for i in range(columns)]
    for axis in axes:
        axis.patch.set_alpha(0.0)
    figure.subplots_adjust(left=0.09, right=0.91, bottom=0.17, top=0.89, wspace=0.3)
    return figure, axes


def _signals(unit: UnitReport) -> Figure:
    figure, (axis,) = _blank(9.0, 2.8, 1)
    for index, (trace, time) in enumerate(_joined(unit.validation.traces)):
        for values, color, label in (
            (trace.load_n, LOAD, "load"),
            (trace.raw_n, RAW, "reading, in N"),
            (trace.compensated_n, FORCE, "compensated"),
        ):
            axis.plot(*decimate(time, values), color=color, label=label if index == 0 else None)
    # The second scale is the reading's own unit: where the offset lies, and N per unit, are the validation's.
    scale = unit.validation.scale
    offset = unit.identification_dict.get("offsets", {})
    zero = float(np.mean([item["value"] for item in offset.values()])) if offset else 0.0
    if scale:
        right = axis.secondary_yaxis(
            "right", functions=(lambda n: n / scale + zero, lambda p: (p - zero) * scale)
        )
        right.set_ylabel(f"reading ({unit.identification_dict.get('reading_unit', 'reading unit')})")
    axis.set(xlabel="time, recordings one after the other (s)", ylabel="force (N)")
    axis.legend(ncols=3, loc="lower right", bbox_to_anchor=(1.0, 1.0))
    return figure


def _loops(unit: UnitReport) -> Figure:
    pairs = [(trace, cycle) for trace in unit.validation.traces for cycle in trace.cycles]
    rates = [cycle.loading_rate_n_per_s for _, cycle in pairs]
    # The paper's Fig. 8 shows 100 and 800 N/s; else what lies nearest.
    chosen = (
        sorted({int(np.argmin([abs(np.log(r / aim)) for r in rates])) for aim in (100.0, 800.0)})
        if rates
        else []
    )
    figure, axes = _blank(9.0, 3.3, max(len(chosen), 1))
    for axis, index in zip(axes, chosen, strict=False):
        trace, cycle = pairs[index]
        span = slice(cycle.start, cycle.stop)
        step = max(1, (cycle.stop - cycle.start) // 600)
        load = trace.load_n[span][::step]
        axis.plot(load, load, color=LOAD, lw=0.8, ls="--", label="ideal")
        axis.plot(load, trace.static_n[span][::step], color=RAW, label="raw, best line")
        axis.plot(load, trace.compensated_n[span][::step], color=FORCE, label="compensated")
        axis.set(xlabel="load (N)", ylabel="estimate (N)", title=f"{cycle.nominal_rate_n_per_s:g} N/s")
        axis.legend(loc="upper left")
    if not chosen:
        axes[0].text(0.5, 0.5, "no loading cycle found", ha="center", transform=axes[0].transAxes)
    return figure


def _bode(unit: UnitReport) -> Figure:
    info = unit.compensator_info
    rate = float(info["rate"])
    hertz = np.geomspace(min(0.01, rate / 1e4), rate / 2 * 0.999, 160)
    s = 2j * np.pi * hertz
    z = np.exp(-s / rate)
    continuous = (info["b0"] * s + info["b1"]) / (s + info["a1"])
    discrete = np.polyval(list(info["numerator"])[::-1], z) / np.polyval(list(info["denominator"])[::-1], z)
    figure, axes = _blank(9.0, 2.8, 2)
    for axis in axes:
        axis.axvspan(0.5, 5.0, color="#10b981", alpha=0.12, lw=0, label="gait, 0.5–5 Hz")
        axis.set(xscale="log", xlabel="frequency (Hz)")
    for response, color, style, label in (
        (continuous, LOAD, "-", "continuous"),
        (discrete, FORCE, "--", f"bilinear, {rate:g} Hz"),
    ):
        axes[0].plot(
            hertz, 20 * np.log10(np.abs(response) / abs(continuous[0])), style, color=color, label=label
        )
        axes[1].plot(hertz, np.degrees(np.angle(response * np.sign(continuous[0].real))), style, color=color)
    axes[0].set_ylabel("gain over static gain (dB)")
    axes[1].set_ylabel("phase (°)")
    axes[0].legend(loc="best")
    return figure


def _residuals(unit: UnitReport) -> Figure:
    figure, axes = _blank(9.0, 2.8, 2)
    for trace, time in _joined(unit.validation.traces):
        error = trace.compensated_n - trace.load_n
        axes[0].plot(*decimate(time, error, 300), color=FORCE, lw=0.7)
        step = max(1, error.size // 500)
        axes[1].plot(trace.load_n[::step], error[::step], ".", color=FORCE, ms=2, alpha=0.5)
    axes[0].set(xlabel="time (s)", ylabel="compensated − load (N)")
    axes[1].set(xlabel="load (N)", ylabel="compensated − load (N)")
    return figure


def unit_figures(unit: UnitReport, prefix: str = "u1") -> list[tuple[str, str]]:
    """(caption, svg) of the signals, the loops, the filter's Bode plot and the residuals."""
    drawn = (
        ("Load, reading and compensated force against time", _signals),
        ("Loops at the loading rates nearest to 100 and 800 N/s", _loops),
        ("Frequency response of the filter", _bode),
        ("Residuals against time and against load", _residuals),
    )
    with mpl.rc_context(_STYLE):
        return [
            (caption, _svg(draw(unit), f"{prefix}f{index}", f"{unit.name}: {caption}"))
            for index, (caption, draw) in enumerate(drawn)
        ]
