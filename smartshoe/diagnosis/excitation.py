"""What an experiment can show at all: rates, holds, rests, repeats; and what must not be claimed where they lack."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from smartshoe.diagnosis.session import CYCLE_SHARE, Session
from smartshoe.diagnosis.thresholds import Thresholds
from smartshoe.loading import turning_points
from smartshoe.masks import runs_of

Array = NDArray[np.float64]

STANDARD = Thresholds()


@dataclass(frozen=True, eq=False)
class Excitation:
    """``rates_per_s`` and ``peaks`` (shares of full scale) of the load cycles; times of the longest hold and rest.

    ``present`` holds the words of `Effect.exposed_by` that apply.
    """

    rates_per_s: tuple[float, ...]
    peaks: tuple[float, ...]
    longest_hold_s: float
    longest_rest_s: float
    repeats: int
    present: frozenset[str]
    thresholds: Thresholds = STANDARD

    def limits(self) -> list[str]:
        """A sentence for each thing of which this data says nothing."""
        said = []
        if len(self.rates_per_s) <= 1:
            said.append(
                "one loading rate only: nothing can be said of rate dependence, nor can viscous friction be told from"
                " Coulomb's"
            )
        if "holds" not in self.present:
            said.append(
                f"no hold longer than {self.thresholds.hold_s:g} s under load: little can be said of a leak, and"
                " nothing of slow creep"
            )
        if "rests" not in self.present:
            said.append("the unit is never seen unloaded: zero, tare and what lies near zero load cannot be judged")
        if "repeats" not in self.present:
            said.append("no load cycle is repeated: what repeats cannot be told from noise without a model")
        if len(self.peaks) <= 1 and len(self.rates_per_s) >= 1:
            said.append("one peak load only: the curve of reading against load and softening are seen along one path")
        return said


def excitation_of(sessions: Sequence[Session], thresholds: Thresholds = STANDARD) -> Excitation:
    """What all sessions together hold."""
    rates: list[tuple[float, int]] = []
    peaks: list[float] = []
    hold_s = rest_s = 0.0
    pauses: list[float] = []
    minor = False
    kinds: dict[tuple[int, int], int] = {}
    alike = float(np.log1p(thresholds.same))
    for session in sessions:
        load, step_s = session.conditions.load, session.conditions.step_s
        span = min(1.0, max(float(np.ptp(load)), 1e-9))
        lowest = float(load.min())
        points = turning_points(load, CYCLE_SHARE * span)
        for first, last in pairwise(points):
            rise = float(load[last] - load[first])
            if abs(rise) < 3.0 * CYCLE_SHARE * span:
                continue
            part = (load[first : last + 1] - load[first]) / rise
            begin, end = int(np.argmax(part >= 0.25)), int(np.argmax(part >= 0.75))
            if (end - begin) * thresholds.same < 1.0 and session.thinned == 1:
                continue  # a sample more or less makes another rate of it
            rate = 0.5 * rise / max((end - begin) * step_s, 0.5 * step_s)
            if rise > 0:
                rates.append((rate, end - begin))
                peaks.append(float(load[last]))
                kind = (round(np.log(rate) / alike), round(np.log(peaks[-1]) / alike))
                kinds[kind] = kinds.get(kind, 0) + 1
                if load[first] > lowest + thresholds.clear * CYCLE_SHARE * span:
                    minor = True
        flat = np.abs(session.conditions.rate_per_s) < thresholds.still_per_s
        hold_s = max(hold_s, _longest(flat & ~session.resting & (load > CYCLE_SHARE)) * step_s)
        lengths = _runs(session.resting)
        rest_s = max([rest_s, *(n * step_s for n in lengths)])
        pauses += [n * step_s for n in lengths[1:-1]]
    present = set()
    few_rates, few_peaks = _distinct_rates(rates, thresholds.same), _distinct(peaks, thresholds.same)
    if len(few_rates) > 1:
        present.add("rates")
    if len(few_peaks) > 1:
        present.add("peaks")
    if any(rate * thresholds.echo_s > thresholds.same for rate, _ in rates):
        present.add("steps")
    if hold_s >= thresholds.hold_s:
        present.add("holds")
    # A reading has come to its zero when any sensor's lag is over.
    settled_s = thresholds.clear * thresholds.sensor_lag_s
    if rest_s >= settled_s:
        present.add("rests")
    if rest_s >= thresholds.idle_s:
        present.add("idle")
    if pauses and max(pauses) > thresholds.clear * max(min(pauses), settled_s):
        present.add("pauses")
    if kinds and max(kinds.values()) >= 2:
        present.add("repeats")
    if minor:
        present.add("minor_loops")
    if few_peaks and min(few_peaks) < thresholds.same:
        present.add("low_loads")
    repeats = max(kinds.values(), default=0)
    return Excitation(tuple(few_rates), tuple(few_peaks), hold_s, rest_s, repeats, frozenset(present), thresholds)


def _runs(mask: NDArray[np.bool_]) -> list[int]:
    first, last = runs_of(mask)
    return [int(n) for n in last - first]


def _longest(mask: NDArray[np.bool_]) -> int:
    return max(_runs(mask), default=0)


def _distinct(values: Sequence[float], alike: float) -> list[float]:
    found: list[float] = []
    for value in sorted(values):
        if not found or value > found[-1] * (1.0 + alike):
            found.append(value)
    return found


def _distinct_rates(rates: Sequence[tuple[float, int]], same: float) -> list[float]:
    """Rates that differ by more than ``same``, and by more than ramps of so few samples tell.

    Both ends of a ramp lie within a sample, since load is smoothed over two: a ramp of n samples lasted n +- 2. A
    stray ramp beside a single rate, a first one say, makes no second rate.
    """
    found: list[float] = []
    ramps: list[int] = []
    reach = 0.0
    for rate, samples in sorted(rates):
        n = max(samples, 1)
        if not found or (rate > found[-1] * (1.0 + same) and rate * n / (n + 2.0) > reach):
            found.append(rate)
            ramps.append(0)
            reach = rate * n / max(n - 2.0, 0.1)
        ramps[-1] += 1
    most = int(np.argmax(ramps)) if ramps else 0
    return [found[most]] if ramps and ramps[most] >= (1.0 - same) * sum(ramps) else found
