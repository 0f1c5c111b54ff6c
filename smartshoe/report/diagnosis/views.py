"""Numbers for a diagnosis' figures: the worst cycle, and residuals by load, rate, cycle and frequency."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from smartshoe.arrays import Array, Index, Mask
from smartshoe.diagnosis import Trace
from smartshoe.signals.loading import Cycle, by_rate, cycles, ramps

SLOPE_S = 0.2  # time over which a load's rate is taken
STANDING_SHARE = 0.004  # of full scale a second: below it the load counts as constant
FEWEST_IN_A_BIN = 5
FEWEST_IN_A_CELL = 15  # of the map over load and rate, in which the fastest ramps leave few samples
MOST_BINS, FEWEST_BINS = 24, 4
ENOUGH = 20_000  # number of samples of a recording that suffices to find its ramps
PLACES = 10  # number of rows into which a map divides a cycle
MOST_GROUPS = 12  # largest number of groups of cycles in a map


@dataclass(frozen=True, eq=False)
class Binned:
    """Mean and standard deviation of a residual in bins centred at ``x``, all (m,); NaN in bins with few samples."""

    x: Array
    mean: Array
    sd: Array


def edges_of(x: Array, bins: int | None = None) -> Array:
    """Edges (bins + 1,) of equal bins between the 0.5th and 99.5th percentile of ``x`` (n,).

    By default few samples get fewer bins, since loading and unloading share them unevenly.
    """
    if bins is None:
        bins = min(max(x.size // (4 * FEWEST_IN_A_BIN), FEWEST_BINS), MOST_BINS)
    low, high = (float(edge) for edge in np.percentile(x, [0.5, 99.5])) if x.size else (0.0, 0.0)
    return np.linspace(low, high if high > low else low + 1.0, bins + 1)


def binned(x: Array, values: Array, edges: Array) -> Binned:
    """``values`` (n,) in bins of ``x`` (n,); values beyond the edges are added to the outermost bins."""
    bins = edges.size - 1
    place = np.clip(((x - edges[0]) / (edges[1] - edges[0])).astype(np.intp), 0, bins - 1)
    count = np.bincount(place, minlength=bins)
    few = count < FEWEST_IN_A_BIN
    mean = np.bincount(place, values, bins) / np.maximum(count, 1)
    variance = np.bincount(place, (values - mean[place]) ** 2, bins) / np.maximum(count, 1)
    middle = 0.5 * (edges[:-1] + edges[1:])
    return Binned(middle, np.where(few, np.nan, mean), np.where(few, np.nan, np.sqrt(variance)))


@dataclass(frozen=True, eq=False)
class EvidenceView:
    """All usable samples of all recordings, one after the other; all arrays are (n,).

    ``time_s`` runs on from one recording to the next; recording k begins at ``starts[k]``. ``before`` and ``after`` are
    measured minus simulated reading.
    """

    time_s: Array
    load_n: Array
    reading: Array
    rate_n_per_s: Array
    cycle: Index
    before: Array
    after: Array
    held_out: Mask
    starts: tuple[float, ...]
    names: tuple[str, ...]
    full_scale_load_n: float

    @cached_property
    def judged(self) -> Mask:
        """(n,) samples that were not fitted, or all samples if nothing was held out."""
        return self.held_out if self.held_out.any() else np.ones(self.held_out.size, dtype=bool)

    @cached_property
    def is_changed(self) -> bool:
        """Whether the extended model differs from the baseline."""
        return not np.array_equal(self.before, self.after)

    @cached_property
    def direction(self) -> Index:
        """(n,) 1 while loading, -1 while unloading, 0 while the load is constant."""
        still = STANDING_SHARE * self.full_scale_load_n
        return np.sign(np.where(np.abs(self.rate_n_per_s) < still, 0.0, self.rate_n_per_s)).astype(np.intp)


def evidence(traces: Sequence[Trace], full_scale_load_n: float) -> EvidenceView | None:
    """Join the traces; None if no sample can be used."""
    columns: list[tuple[Array, ...]] = []
    starts, names = [], []
    clock, first_cycle = 0.0, 0
    for trace in traces:
        good = trace.usable & np.isfinite(trace.reading) & np.isfinite(trace.baseline) & np.isfinite(trace.extended)
        if good.sum() < 2:
            continue
        time_s = trace.time_s - trace.time_s[0]
        starts.append(clock)
        names.append(trace.name)
        columns.append(
            tuple(
                np.asarray(column, dtype=float)[good]
                for column in (
                    clock + time_s,
                    trace.load_n,
                    trace.reading,
                    slope(trace.time_s, trace.load_n),
                    trace.cycle + float(first_cycle),
                    trace.reading - trace.baseline,
                    trace.reading - trace.extended,
                    trace.held_out.astype(float),
                )
            )
        )
        clock += float(time_s[-1])
        first_cycle += int(trace.cycle[-1]) + 1
    if not columns:
        return None
    time_s, load_n, reading, rate, cycle, before, after, held_out = (
        np.concatenate([part[k] for part in columns]) for k in range(8)
    )
    return EvidenceView(
        time_s,
        load_n,
        reading,
        rate,
        cycle.astype(np.intp),
        before,
        after,
        held_out > 0.5,
        tuple(starts),
        tuple(names),
        full_scale_load_n or float(np.max(np.abs(load_n))) or 1.0,
    )


def slope(time_s: Array, load_n: Array) -> Array:
    """The load's rate (n,) in N/s, taken over `SLOPE_S`."""
    if time_s.size < 3:
        return np.zeros(time_s.size)
    step_s = float(time_s[-1] - time_s[0]) / (time_s.size - 1)
    half = min(max(1, round(0.5 * SLOPE_S / step_s)), (time_s.size - 1) // 2)
    index = np.arange(time_s.size)
    right, left = np.minimum(index + half, time_s.size - 1), np.maximum(index - half, 0)
    return np.asarray((load_n[right] - load_n[left]) / (time_s[right] - time_s[left]))


@dataclass(frozen=True, slots=True)
class TraceSegment:
    """Samples ``start:stop`` of a trace."""

    trace: Trace
    start: int
    stop: int

    @property
    def span(self) -> slice:
        """The samples as a slice."""
        return slice(self.start, self.stop)


def worst_cycle(traces: Sequence[Trace]) -> TraceSegment | None:
    """The load cycle in which the baseline simulation is worst, among those not fitted if there are any."""
    found: list[tuple[bool, float, TraceSegment]] = []
    for trace in traces:
        edges = np.flatnonzero(np.diff(trace.cycle)) + 1
        for start, stop in zip([0, *edges], [*edges, trace.cycle.size], strict=True):
            usable = trace.usable[start:stop] & np.isfinite(trace.baseline[start:stop])
            if usable.sum() < 8:
                continue
            error = (trace.reading[start:stop] - trace.baseline[start:stop])[usable]
            found.append(
                (
                    bool(trace.held_out[start:stop].mean() > 0.5),
                    float(np.mean(error**2)),
                    TraceSegment(trace, int(start), int(stop)),
                )
            )
    if not found:
        return None
    return max(found, key=lambda one: one[:2])[2]


def loops_at_two_rates(traces: Sequence[Trace]) -> list[tuple[float, TraceSegment]]:
    """A cycle at the lowest and one at the highest loading rate (N/s), preferably not fitted; empty without cycles."""
    owner: dict[int, TraceSegment] = {}
    found: list[Cycle] = []
    for trace in traces:
        step = max(1, trace.time_s.size // ENOUGH)
        for cycle in cycles(trace.time_s[::step], trace.load_n[::step]):
            owner[id(cycle)] = TraceSegment(trace, step * cycle.start, min(step * cycle.stop, trace.time_s.size))
            found.append(cycle)
    groups = by_rate(found)
    chosen = sorted({min(groups), max(groups)}) if groups else []

    def merit(cycle: Cycle) -> tuple[bool, float]:
        one = owner[id(cycle)]
        return bool(one.trace.held_out[one.span].mean() > 0.5), float(np.ptp(one.trace.load_n[one.span]))

    return [(rate, owner[id(max(groups[rate], key=merit))]) for rate in chosen]


@dataclass(frozen=True, eq=False)
class Map:
    """Mean residuals ``values`` (rows, columns), NaN where there is no data; ``row_edges`` is (rows + 1,)."""

    values: Array
    columns: tuple[str, ...]
    row_edges: Array


def by_load_and_rate(found: EvidenceView, residual: Array, traces: Sequence[Trace], bins: int = 12) -> Map | None:
    """Mean residual by load (rows, N) and rate of the ramp (columns: unloading, constant load, loading)."""
    rates = sorted({abs(_two_digits(rate)) for trace in traces for rate in _rates(trace)})
    if not rates:
        return None
    classes = _merged(rates)
    signed = [-rate for rate in reversed(classes)] + [0.0, *classes]
    speed = np.abs(found.rate_n_per_s)
    nearest = np.argmin(np.abs(np.log(np.maximum(speed, 1e-9))[:, None] - np.log(np.array(classes))[None, :]), axis=1)
    column = len(classes) + found.direction * (1 + nearest)
    low, high = (float(edge) for edge in np.percentile(found.load_n, [0.1, 99.9]))
    edges = np.linspace(low, high if high > low else low + 1.0, bins + 1)
    row = np.clip(np.searchsorted(edges, found.load_n, "right") - 1, 0, bins - 1)
    names = tuple("held" if rate == 0 else f"{rate:+g}" for rate in signed)
    values = _means(row, column, residual, bins, len(signed), FEWEST_IN_A_CELL)
    return Map(values, names, edges)


def by_place_and_cycle(found: EvidenceView, residual: Array) -> Map | None:
    """Mean residual by place within the load cycle (rows, percent of its duration) and by cycle (columns)."""
    numbers = int(found.cycle.max()) + 1
    if numbers < 2:
        return None
    first = np.full(numbers, np.inf)
    last = np.full(numbers, -np.inf)
    np.minimum.at(first, found.cycle, found.time_s)
    np.maximum.at(last, found.cycle, found.time_s)
    length = np.maximum(last - first, 1e-9)[found.cycle]
    row = np.clip(((found.time_s - first[found.cycle]) / length * PLACES).astype(np.intp), 0, PLACES - 1)
    group = -(-numbers // MOST_GROUPS)
    columns = -(-numbers // group)
    values = _means(row, found.cycle // group, residual, PLACES, columns, FEWEST_IN_A_BIN)
    edges = np.linspace(0.0, 100.0, PLACES + 1)
    ends = [(1 + group * k, min(group * (k + 1), numbers)) for k in range(columns)]
    return Map(values, tuple(f"{a}" if a == b else f"{a}–{b}" for a, b in ends), edges)


def _means(row: Index, column: Index, values: Array, rows: int, columns: int, fewest: int) -> Array:
    flat = row * columns + column
    count = np.bincount(flat, minlength=rows * columns).astype(float)
    total = np.bincount(flat, values, rows * columns)
    return np.where(count >= fewest, total / np.maximum(count, 1.0), np.nan).reshape(rows, columns)


def _rates(trace: Trace) -> list[float]:
    step = max(1, trace.time_s.size // ENOUGH)
    return [ramp.rate_n_per_s for ramp in ramps(trace.time_s[::step], trace.load_n[::step])]


def _two_digits(value: float) -> float:
    return float(f"{value:.2g}")


def _merged(rates: Sequence[float], alike: float = 0.25, most: int = 6) -> list[float]:
    """Rates in which those within ``alike`` of each other are merged; at most ``most`` of them."""
    groups: list[list[float]] = []
    for rate in rates:
        if rate <= 0:
            continue
        if groups and rate <= (1.0 + alike) * groups[-1][0]:
            groups[-1].append(rate)
        else:
            groups.append([rate])
    means = [_two_digits(float(np.median(group))) for group in groups]
    if len(means) > most:
        means = [means[k] for k in np.unique(np.linspace(0, len(means) - 1, most).round().astype(int))]
    return means


def spectrum(found: EvidenceView, residual: Array) -> tuple[Array, Array]:
    """Frequency (m,) in Hz and amplitude spectral density (m,) of the residual, averaged in bins of log frequency.

    Each recording is weighted by its duration and contributes up to half its sample rate. Empty bins are left out.
    """
    from scipy.signal import welch  # a diagnosis has imported it already; without one a page should not load it

    edges = np.searchsorted(found.time_s, found.starts[1:])
    columns: list[Array] = []
    for time_s, own in zip(np.split(found.time_s, edges), np.split(residual, edges), strict=True):
        gaps = np.diff(time_s)
        if not np.any(gaps > 0):
            continue
        step_s = float(np.median(gaps[gaps > 0]))
        length = int(min(own.size, max(256, 2 ** int(np.log2(max(own.size / 4, 2))))))
        frequency, power = welch(own - own.mean(), 1.0 / step_s, nperseg=length, detrend=False)
        columns.append(np.array([frequency[1:], power[1:], np.full(frequency.size - 1, own.size * step_s)]))
    frequency, power, weight = np.concatenate([np.zeros((3, 0)), *columns], axis=1)
    if frequency.size == 0:
        return frequency, power
    place = np.floor(24 * np.log10(frequency / frequency.min())).astype(np.intp)
    total = np.bincount(place, power * weight)
    filled = total > 0
    count = np.bincount(place, weight)[filled]
    return np.bincount(place, frequency * weight)[filled] / count, np.sqrt(total[filled] / count)
