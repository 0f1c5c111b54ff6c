"""Sessions: recordings in shares of full scale, filtered, thinned and cut into load cycles.

Load and reading pass the same short zero-phase filter, with which linear physics commutes, so that nothing is
distorted. Noise on the reference load would make a smoother simulation fit better and so imitate a lag or a dead band;
the filter removes most of it, and a fit costs a fraction.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise

import numpy as np

from smartshoe.arrays import Array, Index, Mask
from smartshoe.diagnosis._denoise import followed_share, noise_sd, without_noise
from smartshoe.diagnosis._jittered import with_sampling_jitter
from smartshoe.diagnosis._neighbours import neighbours_of
from smartshoe.diagnosis._scale import Scale, reading_in
from smartshoe.diagnosis._slow_stretches import spacing_of
from smartshoe.integrity.thresholds import Thresholds, largest_of_noise
from smartshoe.models.effects import Conditions
from smartshoe.models.effects.cycle_conditioning import half_way
from smartshoe.recording import Recording
from smartshoe.signals.loading import rises_of
from smartshoe.signals.masks import bridged, runs_of
from smartshoe.units import Unit

LEAST_WINDOW = 3  # samples on either side of the average, a resolution: half and twice changed no name in two cases


@dataclass(frozen=True, eq=False)
class DenoisedLoad:
    """The ``load`` (n,) without its noise; standard deviations of that noise before (``raw_sd``) and after."""

    load: Array
    raw_sd: float
    remaining_sd: float


@dataclass(frozen=True, eq=False)
class Session:
    """One recording on an even grid, in shares of full scale (`smartshoe.models.effects.Conditions`).

    Samples (n,): ``reading``; ``usable``, False where missing or faulty; ``held_out``, True where left out of every
    fit; ``cycle``, the number of the load cycle, or of a part of the time where there are few; ``resting``, True
    without load.

    ``index`` is the recording's place, ``thinned`` the factor of thinning, ``denoised`` the load at the full rate.
    ``own_gain_sd`` is the prior standard deviation of the recording's own gain, relative to the common one; 0 where all
    share it. At the samples ``gain_changes`` the gain changes again; at ``zero_changes`` the zero does, with prior
    ``zero_sd``. ``gap_ends`` are the first samples after gaps with an unknown load that are long enough for the wall to
    creep. ``unknown_past``: the load that a unit at rest may still remember. ``white_sd`` is the standard deviation of
    the reading's white noise at the full rate. ``without_gas_memory``: effects by which a gas remembers are not sought.
    """

    recording: Recording
    index: int
    conditions: Conditions
    reading: Array
    usable: Mask
    held_out: Mask
    cycle: Index
    resting: Mask
    thinned: int
    denoised: DenoisedLoad
    own_gain_sd: float = 0.0
    gain_changes: tuple[int, ...] = ()
    zero_changes: tuple[int, ...] = ()
    zero_sd: float = 0.0
    gap_ends: tuple[int, ...] = ()
    unknown_past: float = 1.0
    white_sd: float = 0.0
    without_gas_memory: bool = False

    @property
    def gain_parts(self) -> tuple[Mask, ...]:
        """(n,) for each own gain, True where it holds; empty where all recordings share one gain."""
        if not self.own_gain_sd:
            return ()
        at = np.arange(self.reading.size)
        return tuple((at >= a) & (at < b) for a, b in pairwise((0, *self.gain_changes, at.size)))

    @cached_property
    def fitted(self) -> Mask:
        """(n,) the samples that a fit may use."""
        return self.usable & ~self.held_out

    @property
    def judged(self) -> Mask:
        """(n,) the samples that only judge a fit."""
        return self.usable & self.held_out


def fitted_of(sessions: Iterable[Session]) -> tuple[Session, ...]:
    """The sessions of which any sample is fitted."""
    return tuple(session for session in sessions if session.fitted.any())


def all_fitted(sessions: Iterable[Session]) -> list[Session]:
    """The same sessions with nothing held out."""
    return [replace(one, held_out=np.zeros_like(one.held_out)) for one in sessions]


def prepare(
    recordings: Sequence[Recording],
    usable: Sequence[Mask],
    held_out: Sequence[bool] | None,
    scale: Scale,
    factors: Sequence[int],
    thresholds: Thresholds,
) -> list[Session]:
    """The sessions of ``recordings``; ``held_out`` for each recording, or None to hold out every third load cycle.

    ``factors`` thin the first recordings; all others are thinned by the smallest of them.
    """
    factors = [*factors, *[min(factors)] * (len(recordings) - len(factors))]
    made: dict[int, Session] = {}
    histories: dict[str | None, _History] = {}
    order = _by_continuation(recordings)
    for index in order:
        recording = recordings[index]
        past = histories.get(_predecessor(recording), _History())
        made[index] = _session(recording, index, usable[index], scale, factors[index], past, thresholds)
        histories[recording.name] = _history_after(made[index].conditions, thresholds)
    sessions = _with_common_temperature_zero([made[index] for index in range(len(recordings))])
    if held_out is not None:
        return [
            replace(session, held_out=np.full(session.reading.size, out))
            for session, out in zip(sessions, held_out, strict=True)
        ]
    return _with_cycles_held_out(sessions, order, thresholds)


def _with_cycles_held_out(sessions: list[Session], order: Sequence[int], thresholds: Thresholds) -> list[Session]:
    """``sessions`` with every so many load cycles held out, counted on from one to the next in ``order``.

    The order is that of the loads as far as known, else by content, so that neither names nor the order given decide.
    """
    count, kept = 0, [*sessions]
    for index in order:
        number = sessions[index].cycle + count
        kept[index] = replace(sessions[index], held_out=(number + 1) % thresholds.held_out_every == 0)
        count = int(number[-1]) + 1
    return kept


def _with_common_temperature_zero(sessions: Sequence[Session]) -> list[Session]:
    """``sessions`` with temperatures relative to the first temperature logged in any of them."""
    logged = [kelvin for one in sessions if (kelvin := one.conditions.temperature_k) is not None]
    return [
        one
        if (kelvin := one.conditions.temperature_k) is None
        else replace(one, conditions=replace(one.conditions, temperature_k=kelvin - logged[0][0]))
        for one in sessions
    ]


def _by_continuation(recordings: Sequence[Recording]) -> list[int]:
    """The recordings' places ordered by content, but each after the one that it continues.

    Names only tell which continues which: a renamed file is the same data.
    """
    order: list[int] = []
    waiting = sorted(range(len(recordings)), key=lambda k: content_of(recordings[k]))
    while waiting:
        names: Counter[str | None] = Counter(recordings[k].name for k in waiting)
        ready = [k for k in waiting if names[_predecessor(recordings[k])] <= continues(recordings[k], recordings[k])]
        placed = {*(ready or waiting)}  # in a ring of recordings that continue each other none is the first
        order += [k for k in waiting if k in placed]
        waiting = [k for k in waiting if k not in placed]
    return order


def content_of(recording: Recording) -> tuple[float, ...]:
    """Length, duration and mean load and reading: numbers that order recordings alike in any unit."""
    means = (float(np.mean(one.si)) for one in recording.loads_and_sensors)
    return recording.time_s.size, recording.duration_s, *means


def without_predecessor(recordings: Sequence[Recording]) -> list[Recording]:
    """Recordings that continue one that is not among them."""
    given = [one for one in recordings if "continues" in one.metadata]
    return [one for one in given if not any(continues(one, other) for other in recordings if other is not one)]


def continues(later: Recording, earlier: Recording) -> bool:
    """Whether a recording continues another one."""
    return _predecessor(later) == earlier.name


def _predecessor(recording: Recording) -> str | None:
    """The name of the recording that this one continues."""
    return recording.metadata.get("continues")


def at_full_rate(
    sessions: Sequence[Session], usable: Sequence[Mask], scale: Scale, thresholds: Thresholds
) -> list[Session]:
    """The same sessions without thinning, with the same cycles and held-out parts."""
    return _with_common_temperature_zero(
        [
            _session(one.recording, one.index, mask, scale, 1, _History.of(one.conditions), thresholds, one)
            for one, mask in zip(sessions, usable, strict=True)
        ]
    )


@dataclass(frozen=True, eq=False)
class _History:
    """What earlier recordings left to one that continues them: ``sums``, and their ``load`` (n,) every ``step_s``."""

    sums: Mapping[str, float] = field(default_factory=dict)
    load: Array = field(default_factory=lambda: np.zeros(0))
    step_s: float = 1.0

    @classmethod
    def of(cls, conditions: Conditions) -> _History:
        """The history that a session's conditions hold."""
        return cls(conditions.before, conditions.earlier, conditions.step_s)

    def load_every(self, step_s: float) -> Array:
        """The load on another step; its last sample is one step before the recording that follows."""
        if self.step_s == step_s or not self.load.size:
            return self.load
        count = max(round(self.load.size * self.step_s / step_s), 1)
        ago_s = step_s * np.arange(count, 0, -1)
        return np.asarray(np.interp(-ago_s, self.step_s * np.arange(-self.load.size, 0), self.load))


def _session(
    recording: Recording,
    index: int,
    usable: Mask,
    scale: Scale,
    factor: int,
    past: _History,
    thresholds: Thresholds,
    template: Session | None = None,
) -> Session:
    """The session of one recording, thinned by ``factor``; cycles, held-out parts and noise those of a ``template``."""
    step_s = recording.sample_time_s
    logged = _logged(
        recording,
        usable,
        scale,
        longest_step_s(recording, factor if template is None else template.thinned),
        thresholds,
    )
    reading = scale.share(logged.reading)
    weights = thinning_weights(factor, reading.size) if template is None else kernel(1)
    denoised = (
        template.denoised
        if template is not None
        else _denoised_load(logged.load_n / scale.load_n, reading, step_s, thresholds)
    )
    rest = _load_at_rest(denoised.load, reading, step_s, scale.unit, thresholds)
    reach = largest_of_noise(denoised.load.size, thresholds) * denoised.raw_sd
    auxiliary = {name: smoothed(values, weights, factor) for name, values in logged.auxiliary.items()}
    conditions = Conditions(
        logged.time_s[::factor],
        smoothed(_with_level_rests(denoised.load, rest + 0.25 * thresholds.standing, reach), weights, factor),
        step_s * factor,
        denoised.remaining_sd * float(np.sqrt(np.sum(weights**2))),
        temperature_k=auxiliary.get("temperature_k"),
        neighbour=auxiliary.get("neighbour"),
        before=past.sums,
        earlier=past.load_every(step_s * factor),
    )
    coverage = smoothed(logged.usable.astype(float), weights, factor)
    # A reading that is logged at a fraction of the load's rate never fills a window.
    typical_coverage = float(np.median(coverage[coverage > 0.0])) if logged.usable.any() else 1.0
    load = conditions.load
    if template is None:
        held_out, cycle = np.zeros(load.size, dtype=bool), _cycles(conditions, thresholds)
    else:
        nearest = np.minimum(
            (np.arange(load.size) + template.thinned // 2) // template.thinned, template.cycle.size - 1
        )
        held_out, cycle = template.held_out[nearest], template.cycle[nearest]
    return Session(
        recording,
        index,
        conditions,
        smoothed(reading, weights, factor),
        coverage > 0.7 * typical_coverage,
        held_out,
        cycle,
        np.abs(load - rest) < thresholds.standing,
        factor,
        denoised,
        gap_ends=tuple(
            int(end) // factor
            for begin, end in zip(*runs_of(~logged.load_known), strict=True)
            if begin > 0 and end < logged.load_known.size and (end - begin) * step_s > thresholds.settled_s
        ),
        unknown_past=thresholds.unknown_past,
        white_sd=template.white_sd if template is not None else noise_sd(reading, thresholds),
    )


@dataclass(frozen=True, eq=False)
class _Logged:
    """A recording on an even grid, (n,) each, interpolated where samples are missing; ``reading`` in the scale's unit.

    ``usable``: load and reading are present and sound. ``load_known``: the load is present. ``auxiliary``: temperature
    and neighbour, where they were logged.
    """

    time_s: Array
    load_n: Array
    reading: Array
    usable: Mask
    load_known: Mask
    auxiliary: dict[str, Array]


def longest_step_s(recording: Recording, factor: int) -> float:
    """The longest step in s that a fit can follow in a recording thinned by ``factor``: the width of its average."""
    return (max(factor, LEAST_WINDOW) + 0.5) * recording.sample_time_s  # half a sample more, since stamps are rounded


def _logged(recording: Recording, usable: Mask, scale: Scale, longest_s: float, thresholds: Thresholds) -> _Logged:
    """The recording on an even grid; samples are usable up to ``longest_s`` apart."""
    time_s, step_s = recording.time_s - recording.time_s[0], recording.sample_time_s
    known = recording.load.present
    good = usable & recording.sensor.present & known
    reading = bridged(time_s, reading_in(recording, scale.unit), good)
    load_n = bridged(time_s, recording.force_n, known)
    auxiliary = _auxiliary_channels(recording, time_s, scale)
    if recording.is_uniform:
        return _Logged(time_s, load_n, reading, good, known, auxiliary)
    even = np.asarray(step_s * np.arange(int(time_s[-1] / step_s) + 1), dtype=np.float64)
    nearest = np.clip(np.searchsorted(time_s, even - 0.5 * step_s), 0, time_s.size - 1)
    is_near = np.abs(time_s[nearest] - even) < step_s
    spacing = spacing_of(time_s, even, longest_s, thresholds)
    good, known = (one[nearest] & is_near | spacing.followed(one) for one in (good, known))
    return _Logged(
        even,
        np.interp(even, time_s, load_n),
        np.interp(even, time_s, reading),
        good,
        known,
        {name: np.interp(even, time_s, values) for name, values in auxiliary.items()},
    )


def _load_at_rest(load: Array, reading: Array, step_s: float, unit: Unit, thresholds: Thresholds) -> float:
    """The load that the cell shows of an unloaded unit, as its tare: the lowest one, or the first if it begins so."""
    low = float(np.quantile(load[:: max(1, load.size // 5000)], 0.02))
    if unit.quantity == "pressure" and begins_unloaded(load, reading, step_s, thresholds):
        return min(low, float(load[0]))
    return min(low, thresholds.standing)


def _denoised_load(load: Array, reading: Array, step_s: float, thresholds: Thresholds) -> DenoisedLoad:
    """The load (n,) without noise and with the reading's sampling jitter, both in shares of full scale."""
    raw_sd = noise_sd(load, thresholds) * math.sqrt(max(1.0 - followed_share(load, reading, thresholds), 0.0))
    denoised, remaining_sd = without_noise(load, step_s, raw_sd, thresholds)
    return DenoisedLoad(with_sampling_jitter(denoised, reading, step_s, thresholds), raw_sd, remaining_sd)


def begins_unloaded(load: Array, reading: Array, step_s: float, thresholds: Thresholds) -> bool:
    """Whether a recording begins with a load (n,) at which its gauge (n,) reads almost nothing, so that it is a tare.

    Not where load and reading both fall clearly below that later: then it began loaded, with a gauge zeroed there.
    """
    first = slice(0, max(1, round(thresholds.settled_s / step_s)))
    begun, read = (float(one[first].mean()) for one in (load, reading))
    if not (np.ptp(load[first]) < thresholds.standing and abs(read) < thresholds.same * abs(begun)):
        return False
    fall = min(level - float(np.quantile(one, 0.01)) for level, one in ((begun, load), (read, reading)))
    return fall < thresholds.standing


def _with_level_rests(load: Array, level: float, reach: float) -> Array:
    """``load`` with each rest at its mean, up to ``reach``: an unloaded unit does not feel the load cell's noise."""
    out = load.copy()
    for first, last in zip(*runs_of(load < level), strict=True):
        part = load[first:last]
        middle = float(np.median(part))
        still = np.abs(part - middle) < reach
        if still.sum() > 10:
            out[first:last][still] = part[still].mean()
    return out


def kernel(factor: int) -> Array:
    """Weights of a Hann window over two thinned steps: a zero-phase average of sum one."""
    if factor <= 1:
        return np.ones(1)
    window = np.hanning(2 * factor + 1)[1:-1]
    return np.asarray(window / window.sum())


def thinning_weights(factor: int, size: int) -> Array:
    """The weights by which a recording of ``size`` samples is averaged before it is thinned by ``factor``.

    At least so wide that noise of the load is smoothed alike in reading and simulation, whatever the thinning.
    """
    return kernel(min(max(factor, LEAST_WINDOW), size))


def smoothed(signal: Array, weights: Array, factor: int) -> Array:
    """(m,) ``signal`` (n,) averaged and thinned; ends are mirrored through their end points, which keeps the slope."""
    half = weights.size // 2
    if not half:
        return np.array(signal[::factor], dtype=float)
    return np.convolve(np.pad(signal, half, "reflect", reflect_type="odd"), weights, "valid")[::factor]


def _auxiliary_channels(recording: Recording, time_s: Array, scale: Scale) -> dict[str, Array]:
    """Temperature and neighbour (n,) in the units of conditions, where any sample is present."""
    found = {}
    temperature, neighbours = recording.channels.get("temperature"), neighbours_of(recording)
    if temperature is not None and temperature.role == "auxiliary" and temperature.present.any():
        found["temperature_k"] = bridged(time_s, temperature.si, temperature.present)
    if neighbours:
        share = neighbours[0].in_unit(scale.unit) / abs(scale.reading)
        found["neighbour"] = bridged(time_s, share, neighbours[0].present)
    return found


def load_cycles(sessions: Sequence[Session], thresholds: Thresholds) -> int:
    """The number of rises of the load in fitted recordings."""
    return sum(_rises(session.conditions, thresholds) for session in fitted_of(sessions))


def have_later_cycles(sessions: Sequence[Session], thresholds: Thresholds) -> bool:
    """Whether any fitted recording holds more than one load cycle."""
    return any(load_cycles([session], thresholds) > 1 for session in sessions)


def _rises(conditions: Conditions, thresholds: Thresholds) -> int:
    """The number of rises of the load; cached in the conditions."""

    def count() -> Array:
        load = conditions.load
        return np.array([len(rises_of(load, thresholds.cycle * max(float(np.ptp(load)), 1e-9)))])

    return int(conditions.kept("rises", (thresholds.cycle,), count)[0])


def _cycles(conditions: Conditions, thresholds: Thresholds) -> Index:
    """(n,) number of the load cycle; of equal parts of the time where there are too few cycles to hold some out."""
    load = conditions.load
    # A share of full scale, or of the record's own span where that is smaller.
    threshold = thresholds.cycle * min(1.0, max(float(np.ptp(load)), 1e-9))
    # A cycle begins at the foot of a rise, after a rest at its last low sample.
    feet = [foot for foot, _ in rises_of(load, threshold)]
    starts = []
    for foot in feet:
        level = load[foot] + 0.25 * threshold
        end = foot
        while end + 1 < load.size and load[end + 1] <= level:
            end += 1
        starts.append(end)
    fewest = 2 * thresholds.held_out_every  # so that at least two are held out
    if len(starts) < fewest:
        parts = np.arange(load.size) * (2 * fewest) // load.size
        return np.asarray(parts, dtype=np.intp)
    cycle = np.zeros(load.size, dtype=np.intp)
    cycle[starts[1:]] = 1
    return np.cumsum(cycle)


def _history_after(conditions: Conditions, thresholds: Thresholds) -> _History:
    """The history that a session leaves to the one that continues it."""
    load = conditions.load
    before = conditions.before
    sums = {
        "largest_load": max(before.get("largest_load", 0.0), float(load.max())),
        "cycles": before.get("cycles", 0.0) + len(rises_of(load, thresholds.cycle)),
        "way": before.get("way", 0.0) + float(half_way(conditions)[-1]),
        "time_s": before.get("time_s", 0.0) + float(conditions.time_s[-1]),
        "dose": before.get("dose", 0.0) + float(np.trapezoid(np.maximum(load, 0.0), conditions.time_s)),
    }
    return _History(sums, np.concatenate([conditions.earlier, load]), conditions.step_s)
