"""Charts as numbers: what a page draws, reduced to a size limit and packed for the browser."""

from __future__ import annotations

import base64
import json
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from smartshoe.arrays import Array, Index

Style = Literal["line", "dashed", "points"]

PAGE_BYTES = 620_000  # limit for the packed numbers of a page, which keeps the whole page under a megabyte
FEWEST_POINTS = 400  # that a line keeps, however many charts share a page
BYTES_OF_X, BYTES_OF_Y, BASE64 = 4, 2, 4 / 3
STEPS = 65_000  # into which a line's range is divided by its 16-bit numbers


@dataclass(frozen=True, eq=False)
class Line:
    """One line of a chart: ``values`` (n,) over the chart's x; NaN leaves a gap.

    ``colour`` is the name of a colour in the page's style. ``low`` and ``high`` (n,) draw a band around a line, or
    error bars on points.
    """

    label: str
    values: Array
    colour: str
    style: Style = "line"
    low: Array | None = None
    high: Array | None = None


@dataclass(frozen=True, eq=False)
class Panel:
    """Lines on one vertical scale; ``limits`` fixes it, so that neighbouring charts can be compared."""

    label: str
    lines: Sequence[Line]
    limits: tuple[float, float] | None = None
    height: int = 200


@dataclass(frozen=True, slots=True)
class Mark:
    """A shaded span from ``start`` to ``end`` of x; a single line if the two are equal."""

    start: float
    end: float
    colour: str
    label: str = ""


@dataclass(frozen=True, eq=False)
class Chart:
    """Panels below each other over a common ``x`` (n,), ascending.

    ``says`` tells in words what can be seen, also for readers who cannot see it. Charts of one ``group`` share cursor
    and zoom. With ``dates``, x is in seconds since 1970. ``window`` is the part of x shown at first, None for all; its
    samples are all kept if they fit. ``weight`` is the chart's share of the page's numbers, relative to 1 for the
    others.
    """

    title: str
    says: str
    x_label: str
    x: Array
    panels: Sequence[Panel]
    group: str = ""
    log_x: bool = False
    dates: bool = False
    marks: Sequence[Mark] = field(default_factory=tuple)
    window: tuple[float, float] | None = None
    weight: float = 1.0

    @property
    def lines(self) -> list[Line]:
        """The lines of all panels."""
        return [line for panel in self.panels for line in panel.lines]

    @property
    def bytes_of_point(self) -> float:
        """Number of bytes that one point takes on the page: its x, and the value and band of every line."""
        columns = sum(1 + (line.low is not None) + (line.high is not None) for line in self.lines)
        return (BYTES_OF_X + BYTES_OF_Y * columns) * BASE64


def reduced(x: Array, signals: Sequence[Array], most: int) -> Index:
    """Indices (k,), at most about ``most``, of samples that keep the extremes of every signal in each segment."""
    if x.size <= most:
        return np.arange(x.size)
    block = -(-x.size * 2 * len(signals) // most)
    count = -(-x.size // block)
    start = np.arange(count) * block
    chosen = [np.array([0, x.size - 1])]
    for signal in signals:
        # The last segment may be shorter than the others; it is padded with its last value.
        filled = np.pad(np.where(np.isfinite(signal), signal, 0.0), (0, count * block - x.size), mode="edge")
        cut = filled.reshape(count, block)
        chosen += [start + cut.argmin(axis=1), start + cut.argmax(axis=1)]
    return np.unique(np.minimum(np.concatenate(chosen), x.size - 1))


def shares(charts: Sequence[Chart], page_bytes: float = PAGE_BYTES) -> list[int]:
    """The number of points that each chart may keep, by weight; what one chart does not need is left to the others."""
    allowed = [0] * len(charts)
    left, weights = page_bytes, sum(chart.weight for chart in charts)
    order = sorted(range(len(charts)), key=lambda k: charts[k].x.size * charts[k].bytes_of_point / charts[k].weight)
    for k in order:
        each, own = charts[k].bytes_of_point, charts[k].weight
        allowed[k] = min(charts[k].x.size, max(FEWEST_POINTS, int(left * own / weights / each)))
        left -= allowed[k] * each
        weights -= own
    return allowed


def _kept_indices(chart: Chart, most: int) -> NDArray[np.intp]:
    """Indices of about ``most`` samples: the extremes, and all in the window if they are at most half of these."""
    signals = [line.values for line in chart.lines]
    if chart.window is not None and chart.x.size > most:
        first, last = np.searchsorted(chart.x, chart.window)
        if last - first <= most // 2:
            elsewhere = reduced(chart.x, signals, most - int(last - first))
            return np.union1d(elsewhere, np.arange(first, last))
    return reduced(chart.x, signals, most)


def _text(values: NDArray[Any]) -> str:
    return base64.b64encode(np.ascontiguousarray(values).tobytes()).decode("ascii")


def _packed(values: Array) -> dict[str, Any]:
    """Values (n,) as 16-bit steps over their range; the lowest integer marks missing ones."""
    there = np.isfinite(values)
    low, high = (float(values[there].min()), float(values[there].max())) if there.any() else (0.0, 0.0)
    step = (high - low) / STEPS or 1.0
    steps = np.full(values.size, -32768, dtype="<i2")
    middle = 0.5 * low + 0.5 * high
    steps[there] = np.round((values[there] - middle) / step).astype("<i2")
    return {"middle": middle, "step": step, "steps": _text(steps)}


def _line(line: Line, index: Index) -> dict[str, Any]:
    packed: dict[str, Any] = {"label": line.label, "colour": line.colour, "style": line.style}
    packed["y"] = _packed(line.values[index])
    for name, values in (("low", line.low), ("high", line.high)):
        if values is not None:
            packed[name] = _packed(values[index])
    return packed


def packed(chart: Chart, most: int) -> dict[str, Any]:
    """The chart as an object for the page's script, with about ``most`` points at most."""
    index = _kept_indices(chart, most)
    x0 = float(chart.x[0]) if chart.x.size else 0.0
    return {
        "title": chart.title,
        "xLabel": chart.x_label,
        "x0": x0,
        "x": _text((chart.x[index] - x0).astype("<f4")),
        "of": int(chart.x.size),
        "group": chart.group,
        "logX": chart.log_x,
        "dates": chart.dates,
        "window": chart.window and (max(chart.window[0], x0), min(chart.window[1], float(chart.x[-1]))),
        "marks": [[mark.start, mark.end, mark.colour, mark.label] for mark in chart.marks],
        "panels": [
            {
                "label": panel.label,
                "limits": panel.limits,
                "height": panel.height,
                "lines": [_line(line, index) for line in panel.lines],
            }
            for panel in chart.panels
        ],
    }


def script_text(charts: Sequence[Chart]) -> str:
    """All charts as JSON that is safe inside a script element."""
    allowed = shares(charts)
    text = json.dumps([packed(c, most) for c, most in zip(charts, allowed, strict=True)], allow_nan=False)
    return text.replace("<", "\\u003c")
