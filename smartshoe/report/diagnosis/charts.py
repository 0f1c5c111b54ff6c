"""Figures of the reasoning: screening, likeness, shares, what is left, faults, the next protocol, as SVG texts."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import matplotlib as mpl
import numpy as np
from numpy.typing import NDArray

from smartshoe.diagnosis.result import Diagnosis, Trace
from smartshoe.masks import runs_of
from smartshoe.protocol import Protocol
from smartshoe.report.diagnosis.sentences import file_name, share_text, shares, words
from smartshoe.report.diagnosis.views import Map
from smartshoe.report.paper.drawing import STYLE, figure_of, svg

Array = NDArray[np.float64]

CAUSE, EQUIVALENT, OTHER = "#0072B2", "#56B4E9", "#cbd5e1"
MOST_BARS, MOST_ALIKE = 12, 10
ALIKE = 0.95  # of the likeness: beyond it only a full fit can tell two effects apart, if at all


def screening(diagnosis: Diagnosis) -> str | None:
    """Effects ranked by what each alone could take off the baseline's misfit; causes and their equivalents marked."""
    ranked = [(name, fall) for name, fall in diagnosis.screening if np.isfinite(fall) and fall > 0][:MOST_BARS]
    if not ranked:
        return None
    causes = {cause.name for cause in diagnosis.causes}
    alike = {name for cause in diagnosis.causes for name in cause.equivalents}
    names, falls = [name for name, _ in ranked], np.array([fall for _, fall in ranked])
    with mpl.rc_context(STYLE):
        figure, (axis,) = figure_of(5.2, 0.7 + 0.27 * len(names), 1)
        place = np.arange(len(names))
        for kind, colour, label in (
            (causes, CAUSE, "named as a cause"),
            (alike, EQUIVALENT, "cannot be told from a cause"),
            (set(names) - causes - alike, OTHER, "not chosen"),
        ):
            shown = [k for k, name in enumerate(names) if name in kind and (kind is causes or name not in causes)]
            if shown:
                axis.barh(place[shown], falls[shown] / falls[0] * 100.0, color=colour, label=label, height=0.72)
        for k, fall in enumerate(falls):
            axis.text(fall / falls[0] * 100.0 + 1.5, k, f"{fall:,.0f}", va="center", fontsize=8)
        axis.set_yticks(place, [words(name) for name in names])
        axis.invert_yaxis()
        axis.set_xlim(0, 122)
        axis.grid(axis="y", visible=False)
        axis.set_axisbelow(True)
        axis.set_xlabel("fall of −2 log likelihood (%, and as a number)")
        axis.legend(loc="lower right", fontsize=8)
        figure.subplots_adjust(left=0.33, right=0.99, top=0.98)
        return svg(figure)


def likeness(diagnosis: Diagnosis) -> str | None:
    """How alike the effects at the top of the screening look in this data: 1 cannot be told apart."""
    matrix = diagnosis.likeness
    names = [name for name, _ in diagnosis.screening]
    if matrix is None or matrix.shape != (len(names), len(names)) or len(names) < 2:
        return None
    chosen = _shown(diagnosis, names)
    part = np.nan_to_num(matrix[np.ix_(chosen, chosen)], nan=0.0)
    with mpl.rc_context(STYLE):
        height = 1.7 + 0.29 * len(chosen)
        figure, (axis,) = figure_of(5.2, height, 1)
        _cells(axis, part, "Blues", 0.0, 1.0)
        for i, j in np.ndindex(part.shape):
            if i != j:
                axis.text(
                    j, i, f"{part[i, j]:.2f}", ha="center", va="center", fontsize=7,
                    color="white" if part[i, j] > 0.6 else "#374151", fontweight="bold" if part[i, j] > ALIKE else None,
                )  # fmt: skip
        labels = [words(names[k]) for k in chosen]
        axis.set_xticks(range(len(chosen)), labels, rotation=40, ha="right")
        axis.set_yticks(range(len(chosen)), labels)
        figure.subplots_adjust(left=0.31, right=0.98, top=0.98, bottom=1.4 / height)
        return svg(figure)


def _shown(diagnosis: Diagnosis, names: Sequence[str]) -> list[int]:
    """Causes, their equivalents and rivals, then the best of the screening; in the screening's order."""
    wanted = [cause.name for cause in diagnosis.causes]
    wanted += [name for cause in diagnosis.causes for name in cause.equivalents]
    wanted += [cause.rivals[0].effect for cause in diagnosis.causes if cause.rivals]
    order = [name for name in dict.fromkeys([*wanted, *names]) if name in names]
    return sorted(names.index(name) for name in order[:MOST_ALIKE])


def error_shares(diagnosis: Diagnosis) -> str | None:
    """One bar: of the baseline's error, what is explained, what could be and is not, what is noise."""
    if diagnosis.baseline is None:
        return None
    part = shares(diagnosis)
    with mpl.rc_context(STYLE):
        figure, (axis,) = figure_of(10.6, 1.35, 1)
        begin = 0.0
        for width, colour, hatch, label in (
            (part.explained, CAUSE, None, "explained"),
            (part.left, "#E69F00", "///", "could be explained, and is left"),
            (part.noise, "#d1d5db", None, "noise"),
        ):
            axis.barh(
                0, width, left=begin, color=colour, hatch=hatch, edgecolor="white", label=f"{label}: {width:.1f} %"
            )
            begin += width
        axis.set_xlim(0, 100)
        axis.set_yticks([])
        axis.grid(visible=False)
        axis.set_xlabel("percent of the baseline's error variance on data that was not fitted")
        axis.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=3)
        figure.subplots_adjust(left=0.02, right=0.98, bottom=0.36, top=0.76)
        return svg(figure)


def what_is_left(by_load: Map | None, by_cycle: Map | None, unit: str) -> str | None:
    """Maps of the mean residual that the extended simulation leaves, on one colour scale."""
    maps: list[tuple[Map, str, str, str]] = []
    if by_load is not None:
        maps.append((by_load, "over load and rate", "rate of the ramp (N/s), unloading left", "load (N)"))
    if by_cycle is not None:
        title, up = "over the course of each load cycle", "place in the cycle (% of its time)"
        maps.append((by_cycle, title, "load cycle (number)", up))
    maps = [one for one in maps if np.isfinite(one[0].values).any()]
    if not maps:
        return None
    everything = np.concatenate([np.abs(found.values[np.isfinite(found.values)]) for found, *_ in maps])
    limit = float(np.percentile(everything, 98)) or 1.0
    with mpl.rc_context(STYLE):
        figure, axes = figure_of(10.6, 3.6, len(maps))
        for axis, (found, title, across, up) in zip(axes, maps, strict=True):
            mesh: Any = _cells(axis, found.values, "RdBu_r", -limit, limit, found.row_edges)
            shown = np.arange(0, len(found.columns), -(-len(found.columns) // 14))
            axis.set_xticks(shown, [found.columns[k] for k in shown], rotation=35 if found is by_load else 0)
            axis.set_title(title, fontsize=9)
            axis.set_xlabel(across)
            axis.set_ylabel(up)
        figure.subplots_adjust(left=0.07, right=0.87, bottom=0.2, wspace=0.22)
        bar = figure.add_axes((0.89, 0.2, 0.015, 0.7))
        figure.colorbar(mesh, cax=bar, label=f"measured − simulated ({unit})")
        return svg(figure)


def data_faults(diagnosis: Diagnosis) -> str | None:
    """Where in time each fault of the data lies, and what was left out: a strip for each recording and kind."""
    if not diagnosis.data_faults or not diagnosis.traces:
        return None
    strips: list[tuple[str, tuple[float, float], list[tuple[float, float]], float | None]] = []
    for index, trace in enumerate(diagnosis.traces):
        faults = [fault for fault in diagnosis.data_faults if fault.recording == index]
        if not faults:
            continue
        ends = float(trace.time_s[0]), float(trace.time_s[-1])
        name = _clipped(file_name(faults[0].label))
        for kind in dict.fromkeys(fault.kind for fault in faults):
            alike = [fault for fault in faults if fault.kind == kind]
            spans = [(fault.start_s, fault.stop_s) for fault in alike]
            strips.append((f"{name}: {words(kind)}", ends, spans, sum(fault.share for fault in alike)))
        if not trace.usable.all():
            strips.append((f"{name}: left out", ends, _left_out(trace), None))
    if not strips:
        return None
    longest = max(high - low for _, (low, high), _, _ in strips) or 1.0
    height = 0.75 + 0.28 * len(strips)
    with mpl.rc_context(STYLE):
        figure, (axis,) = figure_of(10.6, height, 1)
        for k, (_, (low, high), spans, share) in enumerate(strips):
            axis.barh(k, high - low, left=low, height=0.45, color="#e5e7eb")
            # A single sample would be thinner than a pixel.
            wide = [(start, max(stop - start, 0.003 * longest)) for start, stop in spans]
            axis.broken_barh(wide, (k - 0.35, 0.7), color="#374151" if share is None else "#E69F00", lw=0)
            if share is not None:
                axis.text(high + 0.008 * longest, k, share_text(min(share, 1.0)), va="center", fontsize=8)
        axis.set_yticks(range(len(strips)), [label for label, *_ in strips], fontsize=8)
        axis.set_xlim(right=max(high for _, (_, high), _, _ in strips) + 0.07 * longest)
        axis.invert_yaxis()
        axis.grid(axis="y", visible=False)
        axis.set_axisbelow(True)
        axis.set_xlabel("time (s)")
        figure.subplots_adjust(left=0.3, right=0.985, top=0.97, bottom=0.48 / height)
        return svg(figure)


def _left_out(trace: Trace) -> list[tuple[float, float]]:
    """Stretches of samples that no fit uses, those close to each other as one."""
    first, last = runs_of(~trace.usable)
    close = 0.002 * float(trace.time_s[-1] - trace.time_s[0])
    spans: list[tuple[float, float]] = []
    for start, stop in zip(trace.time_s[first], trace.time_s[last - 1], strict=True):
        if spans and start - spans[-1][1] <= close:
            spans[-1] = (spans[-1][0], float(stop))
        else:
            spans.append((float(start), float(stop)))
    return spans


def _clipped(name: str) -> str:
    kept = name if len(name) <= 22 else f"…{name[-21:]}"
    return kept.replace("$", r"\$")


def protocol(steps: Protocol) -> str:
    """The load that the protocol asks for, against time."""
    time_s, load_n = steps.corners()
    minutes = steps.duration_s > 600
    with mpl.rc_context(STYLE):
        figure, (axis,) = figure_of(10.6, 2.4, 1)
        axis.plot(time_s / 60 if minutes else time_s, load_n, color=CAUSE)
        axis.fill_between(time_s / 60 if minutes else time_s, load_n, color=CAUSE, alpha=0.12, lw=0)
        axis.set_xlabel("time (min)" if minutes else "time (s)")
        axis.set_ylabel("load (N)")
        return svg(figure)


def _cells(axis: Any, values: Array, colours: str, low: float, high: float, edges: Array | None = None) -> Any:
    """Coloured cells, the first row on top where rows are names, at the bottom where they are numbers."""
    rows, columns = values.shape
    up = np.arange(rows + 1) - 0.5 if edges is None else edges
    mesh = axis.pcolormesh(
        np.arange(columns + 1) - 0.5, up, np.ma.masked_invalid(values), cmap=colours, vmin=low, vmax=high,
        edgecolors="face", linewidth=0.2, rasterized=values.size > 400,
    )  # fmt: skip
    if edges is None:
        axis.invert_yaxis()
    axis.grid(visible=False)
    return mesh
