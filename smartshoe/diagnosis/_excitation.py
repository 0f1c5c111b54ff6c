"""What an experiment can show: rates, holds, rests, repeats; and what must not be claimed where they are missing."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.spatial import KDTree

from smartshoe.arrays import Mask
from smartshoe.diagnosis._averaging import LEAST_WINDOW
from smartshoe.diagnosis._load_cycles import have_later_cycles, least_rise, rises_in
from smartshoe.diagnosis._session import Session
from smartshoe.integrity.thresholds import Thresholds, largest_of_noise
from smartshoe.models.effects import Effect
from smartshoe.models.effects.exposure import LATER_CYCLES
from smartshoe.signals.masks import level_stretches, runs_of


@dataclass(frozen=True, eq=False)
class Excitation:
    """What the load cycles of a set of recordings can show.

    ``rates_per_s`` and ``peaks`` are their loading rates and peak loads, in shares of full scale. ``present`` holds the
    words of `Effect.exposed_by` that apply to the load, ``channels`` those that were logged besides. ``is_judged``:
    held-out data is usable. ``is_cycled``: a fitted recording has more than one load cycle. ``is_unread_at_rest``: it
    rests without load, but no reading there is usable. ``is_held``: a load is held still, if only briefly.
    ``are_rated``: at least half of the rises have enough samples for a rate.
    """

    rates_per_s: tuple[float, ...]
    peaks: tuple[float, ...]
    present: frozenset[str]
    thresholds: Thresholds
    is_judged: bool = True
    is_cycled: bool = True
    is_unread_at_rest: bool = False
    is_held: bool = False
    channels: frozenset[str] = frozenset()
    are_rated: bool = True

    def lacking(self, effect: Effect) -> frozenset[str]:
        """What would show an effect best and is neither in the loads nor logged."""
        return effect.exposed_by - self.present - self.channels

    def hides(self, effect: Effect) -> bool:
        """Whether an effect is not shown, since it goes with the rate and only one rate and no hold is seen.

        At one rate it only acts as another gain; what distinguished it would be how sharply its law turns at a corner.
        """
        goes_with_the_rate = bool(effect.exposed_by) and effect.exposed_by <= {"rates", "holds"}
        sees_rates = len(self.rates_per_s) > 1 or (bool(self.rates_per_s) and self.is_held)
        return goes_with_the_rate and not sees_rates

    def shows(self, effect: Effect) -> bool:
        """Whether this data shows an effect at all.

        Any load shows a curve, a loop or a lag. An effect that stays, or goes on under load, needs more, such as later
        load cycles.
        """
        if self.is_cycled or effect.is_memoryless or not effect.exposed_by:
            return True
        return bool(effect.exposed_by & ({"rates"} | self.tells_apart))

    @property
    def tells_apart(self) -> frozenset[str]:
        """``present`` without the words that a single load cycle does not show."""
        return self.present if self.is_cycled else self.present - LATER_CYCLES

    @property
    def goes_with_the_clock(self) -> bool:
        """Whether peak loads differ, and only rise or only fall with time in every recording."""
        return "peaks" in self.present and "shuffled_loads" not in self.present

    def limits(self) -> list[str]:
        """A sentence for each thing that this data does not show."""
        said = []
        if not self.is_judged:
            said.append(
                "nothing that is held out can be used: how good a simulation is on data it was not fitted to is not"
                " known (hold out a recording whose reading follows its load)"
            )
        if len(self.rates_per_s) <= 1:
            seen = "one loading rate only" if self.rates_per_s else "no rise of the load of which the rate is seen"
            if self.rates_per_s and not self.are_rated:
                seen = "most rises of the load are over within too few samples to tell one loading rate from another"
            nothing = "nothing can be said of rate dependence"
            if self.rates_per_s and self.is_held:
                nothing = "of rate dependence no more can be said than how a ramp differs from a hold"
            said.append(f"{seen}: {nothing}, nor can viscous friction be told from Coulomb's")
        if "holds" not in self.present:
            of_leaks = "" if "peaks" in self.present else ", and the law of a leak is unsure"
            said.append(
                f"no hold longer than {self.thresholds.hold_s:g} s under load: slow creep is not seen{of_leaks}"
            )
        if "rests" not in self.present:
            why = (
                "no reading of the unit at rest without load can be used (see the faults of the data)"
                if self.is_unread_at_rest
                else "the unit is never seen at rest without load"
            )
            said.append(f"{why}: zero, tare and what lies near zero load are told by the model alone")
        if self.goes_with_the_clock:
            said.append(
                "peak loads grow, or fall, with time, so that a drift, a leak or a set can look like a curve of reading"
                " against load, and like one another (shuffle the loads)"
            )
        if "repeats" not in self.present:
            said.append("no load cycle is repeated: how loud the noise is cannot be told from repeats")
        if len(self.peaks) <= 1 and len(self.rates_per_s) >= 1:
            said.append("one peak load only: a curve of reading against load and a softening cannot be told apart well")
        return said


def excitation_of(sessions: Sequence[Session], thresholds: Thresholds) -> Excitation:
    """The excitation of all sessions of which anything is fitted."""
    is_judged = any(one.judged.any() for one in sessions)
    sessions = [one for one in sessions if not one.held_out.all()]
    each = [list(_rises(session, thresholds)) for session in sessions]
    rises = [rise for own in each for rise in own]
    rated = [rise for rise in rises if rise.is_rated]
    hold_s = max((_longest_read_s(one, _held(one, thresholds)) for one in sessions), default=0.0)
    rests = [(rested(one, thresholds), one.conditions.step_s) for one in sessions]
    rest_s = max((_longest_read_s(one, mask) for one, (mask, _) in zip(sessions, rests, strict=True)), default=0.0)
    # What a unit does at rest shows afterwards, even if nothing is read meanwhile.
    idle_s = max((n * step_s for mask, step_s in rests for n in _run_lengths(mask)), default=0.0)
    pauses = [n * step_s for mask, step_s in rests for n in _run_lengths(_inner_runs(mask))]
    # The ends of a ramp are smeared by the filter's window, and known to a sample.
    ends = 1.0 + max((_windows(session) for session in sessions), default=1.0)
    rates = _distinct_rates([(rise.rate, rise.samples) for rise in rated], thresholds.same, ends)
    peaks = _distinct([rise.peak for rise in rises], thresholds.same)
    found = {
        "rates": len(rates) > 1,
        "peaks": len(peaks) > 1,
        "steps": any(rise.rate * thresholds.echo_s > thresholds.same for rise in rated),
        "holds": hold_s >= thresholds.hold_s,
        "rests": rest_s >= thresholds.settled_s,
        "idle": idle_s >= thresholds.idle_s,
        "pauses": bool(pauses) and max(pauses) > thresholds.clear * max(min(pauses), thresholds.settled_s),
        "repeats": _most_alike([(rise.rate, rise.peak) for rise in rated], thresholds.same) > 1,
        "minor_loops": any(rise.is_minor for rise in rises),
        "shuffled_loads": len(peaks) > 1 and _are_shuffled(each, thresholds),
        "low_loads": bool(peaks) and min(peaks) < thresholds.same,
    }
    present = frozenset(word for word, is_there in found.items() if is_there)
    is_cycled = have_later_cycles(sessions, thresholds)
    is_unread = idle_s >= thresholds.settled_s and not found["rests"]
    is_held = hold_s >= _turning_s(thresholds)
    return Excitation(
        tuple(rates),
        tuple(peaks),
        present,
        thresholds,
        is_judged,
        is_cycled,
        is_unread,
        is_held,
        are_rated=thresholds.clear * len(rated) >= len(rises),
    )


class _Rise(NamedTuple):
    """A rise of the load: ``rate`` (full scales per second) over its middle half of ``samples``, ``peak`` reached.

    Where the filter's window is longer than two samples, ``samples`` counts windows. ``is_rated``: one sample more
    would not change the rate. ``is_cut``: the recording ends before the load falls.
    """

    rate: float
    samples: float
    peak: float
    is_minor: bool
    is_rated: bool = True
    is_cut: bool = False


def _rises(session: Session, thresholds: Thresholds) -> Iterator[_Rise]:
    """The rises of a session's load that count as load cycles."""
    load, step_s = session.conditions.load, session.conditions.step_s
    lowest, least = float(load.min()), least_rise(load, thresholds)
    for first, last in rises_in(session.conditions, thresholds):
        rise = float(load[last] - load[first])
        if load[last] <= 0.0:
            continue
        part = (load[first : last + 1] - load[first]) / rise
        samples = int(np.argmax(part >= 0.75)) - int(np.argmax(part >= 0.25))
        is_rated = samples * thresholds.same >= 1.0 or session.thinned > 1  # else a single sample changes the rate
        rate = 0.5 * rise / max(samples * step_s, 0.5 * step_s)
        above = float(load[first]) - lowest > thresholds.clear * least
        is_cut = last + 1 == load.size
        yield _Rise(rate, samples * _windows(session), float(load[last]), above, is_rated, is_cut)


def _windows(session: Session) -> float:
    """The number of the filter's windows per sample, at most 1."""
    return min(1.0, session.thinned / LEAST_WINDOW)


def _are_shuffled(each: Sequence[Sequence[_Rise]], thresholds: Thresholds) -> bool:
    """Whether in any recording the peak loads do not go with time."""
    trends = []
    for rises in each:
        peaks = np.array([rise.peak for rise in rises if not rise.is_cut])
        if peaks.size > 1:
            varies = np.ptp(peaks) > thresholds.same * np.max(peaks)
            trends.append(abs(float(np.corrcoef(np.arange(peaks.size), peaks)[0, 1])) if varies else 0.0)
    return not trends or min(trends) < 1.0 - thresholds.same


def _still(session: Session, thresholds: Thresholds) -> Mask:
    """(n,) True where the load does not move: from sample to sample, or for a noisy load by means before and after."""
    conditions, largest = session.conditions, largest_of_noise(session.conditions.load.size, thresholds)
    if largest * math.sqrt(2.0) * conditions.load_noise <= thresholds.still_per_s * conditions.step_s:
        return np.asarray(np.abs(conditions.rate_per_s) < thresholds.still_per_s)
    return _still_on_average(session, 0.5 * thresholds.settled_s, thresholds)


def _still_on_average(session: Session, width_s: float, thresholds: Thresholds) -> Mask:
    """(n,) True where means of the load over ``width_s`` before and after differ by no more than a held load's."""
    conditions, largest = session.conditions, largest_of_noise(session.conditions.load.size, thresholds)
    width = max(1, round(width_s / conditions.step_s))
    total, at = np.concatenate([[0.0], np.cumsum(conditions.load)]), np.arange(conditions.load.size)
    first, last = np.maximum(at + 1 - width, 0), np.minimum(at + 1 + width, at.size)
    before = (total[at + 1] - total[first]) / (at + 1 - first)
    after = np.where(last > at + 1, (total[last] - total[at + 1]) / np.maximum(last - at - 1, 1), before)
    noise = largest * conditions.load_noise * math.sqrt(2.0 / width)
    return np.asarray(np.abs(after - before) < thresholds.still_per_s * width * conditions.step_s + noise)


def stays_still(session: Session, thresholds: Thresholds) -> Mask:
    """(n,) True in runs of a ``few`` logged samples within which the load stays within ``standing``.

    A load that changes at random from sample to sample is slow here and there, but never held. Where a few samples last
    no longer than a load takes to turn, the rate suffices, and all is True.
    """
    load, few_s = session.conditions.load, math.ceil(thresholds.few / session.thinned) * session.conditions.step_s
    if few_s <= _turning_s(thresholds):
        return np.ones(load.size, dtype=bool)
    return _within_standing(session, few_s, thresholds)


def _within_standing(session: Session, width_s: float, thresholds: Thresholds) -> Mask:
    """(n,) True in stretches of ``width_s`` within which the load stays within ``standing``."""
    load, few = session.conditions.load, round(width_s / session.conditions.step_s)
    few = min(few + 1 - few % 2, load.size)  # odd, so that the filters are centred
    return level_stretches(load, few, thresholds.standing)


def _turning_s(thresholds: Thresholds) -> float:
    """The longest time in s that a load takes to turn."""
    return thresholds.clear * thresholds.settled_s


def _held(session: Session, thresholds: Thresholds) -> Mask:
    """(n,) True where a load is borne and does not move."""
    is_borne = ~session.resting & (session.conditions.load > thresholds.cycle)
    is_still = _still(session, thresholds) & stays_still(session, thresholds)
    return np.asarray(is_borne & (is_still | _still_for_a_hold(session, thresholds)))


def rested(session: Session, thresholds: Thresholds) -> Mask:
    """(n,) True where there is no load and it does not move."""
    return np.asarray(session.resting & (_still(session, thresholds) | _still_for_a_hold(session, thresholds)))


def _still_for_a_hold(session: Session, thresholds: Thresholds) -> Mask:
    """(n,) True where the load does not move for the time of a hold but by what averages out over it.

    Hum, and noise that is correlated over time, move a held load for moments. A slow log has too few samples in a hold.
    """
    if thresholds.hold_s < thresholds.few * session.conditions.step_s:
        return np.zeros(session.resting.size, dtype=bool)
    averages = _still_on_average(session, 0.5 * thresholds.hold_s, thresholds)
    return averages & _within_standing(session, thresholds.hold_s, thresholds)


def _inner_runs(mask: Mask) -> Mask:
    """(n,) ``mask`` without the runs that begin or end the recording."""
    other = np.flatnonzero(~mask)
    inner = np.zeros_like(mask)
    if other.size:
        inner[other[0] : other[-1]] = mask[other[0] : other[-1]]
    return inner


def _run_lengths(mask: Mask) -> list[int]:
    """The lengths of the runs of True, in samples."""
    first, last = runs_of(mask)
    return [int(n) for n in last - first]


def _longest_read_s(session: Session, mask: Mask) -> float:
    """The longest time in s for which the reading is usable within a run of ``mask`` (n,)."""
    total = np.concatenate([[0], np.cumsum(session.usable)])
    first, last = runs_of(mask)
    return float(np.max(total[last] - total[first], initial=0)) * session.conditions.step_s


def _distinct(values: Sequence[float], alike: float) -> list[float]:
    """The values of which each exceeds the one before by more than a share ``alike``."""
    found: list[float] = []
    for value in sorted(values):
        if not found or value > found[-1] * (1.0 + alike):
            found.append(value)
    return found


def _most_alike(kinds: Sequence[tuple[float, float]], same: float) -> int:
    """The largest number of pairs that agree with one of them within ``same`` in both numbers."""
    if not kinds:
        return 0
    at = np.log(kinds)
    return int(KDTree(at).query_ball_point(at, np.log1p(same), p=np.inf, return_length=True).max())


def _distinct_rates(rates: Sequence[tuple[float, float]], same: float, ends: float = 2.0) -> list[float]:
    """Rates that differ from one another by more than ``same``, and by more than ramps of so few samples can tell.

    ``rates`` are pairs of a rate and its number of samples. A ramp of n samples lasted n +- ``ends``, since half a
    window and half a step are open at either end. Of ramps that may share a rate, the one that is surely no faster
    represents all, so that short ramps do not chain others together. A single ramp beside many equal ones makes no
    second rate.
    """
    between = []
    for rate, samples in rates:
        n = max(samples, 1.0)
        between.append((rate * n / max(n - ends, 0.1), rate, rate * n / (n + ends)))
    found: list[float] = []
    reach = 0.0
    for most, rate, least in sorted(between):
        if not found or (rate > found[-1] * (1.0 + same) and least > reach):
            found.append(rate)
            reach = most
    alike = [sum(one / (1.0 + same) <= rate <= one * (1.0 + same) for rate, _ in rates) for one in found]
    largest = max(alike, default=0)
    is_single = len(rates) - largest == 1 and largest >= (1.0 - same) * len(rates)
    return [found[alike.index(largest)]] if is_single else found
