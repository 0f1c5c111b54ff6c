"""Repeated load cycles: finds them, aligns them on the load and averages them; also derives instruments from them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from smartshoe.arrays import Array, Mask
from smartshoe.recording import Recording
from smartshoe.signals import loading

SAME_RATE = 0.10  # also for the time from mid-rise to mid-fall, which a hold would change
SAME_PEAK = 0.05
NEAR_REST = 0.05  # of the load's range


@dataclass(frozen=True, slots=True)
class Repeat:
    """One cycle of ``recording`` (its index): samples ``start:stop``, up to the next cycle, including the rest.

    ``rise`` and ``fall`` are straight lines (slope in N/s, intercept in N) through 10 % to 90 % of the ramps, over time
    from the recording's first sample.
    """

    recording: int
    start: int
    stop: int
    base_n: float
    peak_n: float
    rise: tuple[float, float]
    fall: tuple[float, float]

    @property
    def rate_n_per_s(self) -> float:
        """Mean of the two ramps' absolute rates."""
        return 0.5 * (self.rise[0] - self.fall[0])

    def crossings_s(self, level_n: float) -> tuple[float, float]:
        """Times in s at which the two lines cross a level.

        More exact than single samples, since the whole ramp contributes.
        """
        (up, at_up), (down, at_down) = self.rise, self.fall
        return (level_n - at_up) / up, (level_n - at_down) / down

    @property
    def duration_s(self) -> float:
        """Time in s from mid-rise to mid-fall."""
        rise_s, fall_s = self.crossings_s(0.5 * (self.base_n + self.peak_n))
        return fall_s - rise_s


@dataclass(frozen=True)
class CycleGroup:
    """Repeats of one kind of cycle: rate within 10 %, peak within 5 %, mid-rise to mid-fall within 10 %.

    A sample's place in the cycle is in seconds of the mean cycle: 0 at mid-rise, ``duration_s`` at mid-fall.
    ``first_s`` to ``last_s`` are the places covered by every repeat, from the foot of the ramp into the rest.
    """

    rate_n_per_s: float
    peak_n: float
    level_n: float
    duration_s: float
    first_s: float
    last_s: float
    repeats: tuple[Repeat, ...]

    def places_s(self, repeat: Repeat, recordings: Sequence[Recording]) -> Array:
        """(stop - start,) places of the repeat's own samples in s; they may lie outside ``first_s`` to ``last_s``."""
        return _places(repeat, recordings, self.level_n, self.duration_s)

    def covers(self, places_s: Array) -> Mask:
        """Mask of the places that every repeat covers."""
        inside: Mask = (places_s >= self.first_s) & (places_s <= self.last_s)
        return inside


def repeated_cycles(recordings: Sequence[Recording], *, skip_first: int = 0) -> list[CycleGroup]:
    """The kinds of load cycle that occur at least twice, by rate; rests between cycles may vary.

    The first ``skip_first`` cycles of each recording are left out, as a unit may soften during them. Raises
    `MissingChannelError` for a recording without load.
    """
    found = [repeat for index in range(len(recordings)) for repeat in _repeats(recordings, index)[skip_first:]]
    kinds: list[list[Repeat]] = []
    for repeat in sorted(found, key=lambda one: one.rate_n_per_s):
        for kind in kinds:
            if _are_alike(repeat, kind):
                kind.append(repeat)
                break
        else:
            kinds.append([repeat])
    groups = (_group(kind, recordings) for kind in kinds if len(kind) > 1)
    return [group for group in groups if group.last_s > group.first_s]


def averaged_reading(recordings: Sequence[Recording]) -> list[Array]:
    """For each recording (n,): the mean of the *other* repeats' readings at each sample's place; NaN outside repeats.

    In the first recording's reading unit; the recording's own reading at rest replaces that of the others. Its noise is
    independent of the sample's own, so it is an instrument for the inverse direction. It is not independent of
    neighbouring samples in the other repeats: a model that remembers the previous cycle keeps some bias. Raises
    `MissingChannelError` without load or reading, `UnitError` for readings of different quantities.
    """
    unit = recordings[0].sensor.unit
    signals, rests = [], []
    for recording in recordings:
        sensor = recording.sensor
        reading = np.where(sensor.present, sensor.in_unit(unit), np.nan)
        load_n = recording.force_n
        resting = (load_n <= load_n.min() + NEAR_REST * np.ptp(load_n)) & np.isfinite(reading)
        # One constant per recording transfers at most 1/n of a sample's own noise into its instrument.
        rests.append(float(np.median(reading[resting])) if resting.any() else 0.0)
        signals.append(reading - rests[-1])
    averaged = [np.full(len(recording), np.nan) for recording in recordings]
    for group in repeated_cycles(recordings):
        for repeat in group.repeats:
            places_s = group.places_s(repeat, recordings)
            inside = group.covers(places_s)
            others = [
                _at(group, other, recordings, signals, places_s[inside]) for other in group.repeats if other != repeat
            ]
            target = averaged[repeat.recording][repeat.start : repeat.stop]
            target[inside] = _mean_of_finite(np.stack(others)) + rests[repeat.recording]
    return averaged


def _repeats(recordings: Sequence[Recording], index: int) -> list[Repeat]:
    """The cycles of one recording, each up to the foot of the next ramp."""
    recording = recordings[index]
    time_s, load_n = recording.time_s - recording.time_s[0], recording.force_n
    found = loading.cycles(time_s, load_n)
    stops = [cycle.start for cycle in found[1:]] + [len(recording)]
    repeats = []
    for cycle, stop in zip(found, stops, strict=True):
        part = load_n[cycle.start : cycle.stop]
        base_n, peak_n = 0.5 * float(part[0] + part[-1]), float(part.max())
        lines = [
            _line(time_s[ramp.start : ramp.stop], load_n[ramp.start : ramp.stop], base_n, peak_n)
            for ramp in (cycle.up, cycle.down)
        ]
        if lines[0] is not None and lines[1] is not None and lines[0][0] > 0 > lines[1][0]:
            repeats.append(Repeat(index, cycle.start, max(stop, cycle.stop), base_n, peak_n, lines[0], lines[1]))
    return repeats


def _line(time_s: Array, load_n: Array, base_n: float, peak_n: float) -> tuple[float, float] | None:
    progress = (load_n - base_n) / (peak_n - base_n)
    inner = (progress >= 0.1) & (progress <= 0.9)
    if np.count_nonzero(inner) < 2:
        return None
    t, f = time_s[inner], load_n[inner]
    centred = t - t.mean()
    slope = float(centred @ f / (centred @ centred))
    return slope, float(f.mean() - slope * t.mean())


def _are_alike(repeat: Repeat, kind: Sequence[Repeat]) -> bool:
    return all(
        abs(value - reference) <= share * abs(reference)
        for value, reference, share in (
            (repeat.rate_n_per_s, float(np.mean([one.rate_n_per_s for one in kind])), SAME_RATE),
            (repeat.peak_n, float(np.mean([one.peak_n for one in kind])), SAME_PEAK),
            (repeat.duration_s, float(np.mean([one.duration_s for one in kind])), SAME_RATE),
        )
    )


def _group(kind: Sequence[Repeat], recordings: Sequence[Recording]) -> CycleGroup:
    level_n = float(np.mean([0.5 * (one.base_n + one.peak_n) for one in kind]))
    crossings = [one.crossings_s(level_n) for one in kind]
    duration_s = float(np.mean([fall_s - rise_s for rise_s, fall_s in crossings]))
    places = [_places(one, recordings, level_n, duration_s) for one in kind]
    # A long rest after the cycle adds no information: keep at most as much of it as the cycle lasts.
    return CycleGroup(
        rate_n_per_s=float(np.mean([one.rate_n_per_s for one in kind])),
        peak_n=float(np.mean([one.peak_n for one in kind])),
        level_n=level_n,
        duration_s=duration_s,
        first_s=max(float(place[0]) for place in places),
        last_s=min(2.5 * duration_s, *(float(place[-1]) for place in places)),
        repeats=tuple(sorted(kind, key=lambda one: (one.recording, one.start))),
    )


def _places(repeat: Repeat, recordings: Sequence[Recording], level_n: float, duration_s: float) -> Array:
    recording = recordings[repeat.recording]
    rise_s, fall_s = repeat.crossings_s(level_n)
    time_s = recording.time_s[repeat.start : repeat.stop] - recording.time_s[0]
    places_s: Array = (time_s - rise_s) * (duration_s / (fall_s - rise_s))
    return places_s


def _at(
    group: CycleGroup, repeat: Repeat, recordings: Sequence[Recording], signals: Sequence[Array], places_s: Array
) -> Array:
    """A repeat's signal at given places of the cycle; NaN next to a missing sample."""
    own_s = group.places_s(repeat, recordings)
    return np.interp(places_s, own_s, signals[repeat.recording][repeat.start : repeat.stop])


def _mean_of_finite(rows: Array) -> Array:
    finite = np.isfinite(rows)
    count = finite.sum(axis=0)
    total = np.where(finite, rows, 0.0).sum(axis=0)
    return np.where(count > 0, total / np.maximum(count, 1), np.nan)
