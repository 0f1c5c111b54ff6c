"""Sessions: recordings in shares of full scale, filtered, thinned and cut into load cycles.

Load and reading pass the same short zero-phase filter, with which linear physics commutes, so that nothing is
distorted. Noise on the reference load would make a smoother simulation fit better and so imitate a lag or a dead band;
the filter removes most of it, and a fit costs a fraction.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np

from smartshoe.arrays import Array, Index, Mask
from smartshoe.diagnosis._averaging import kernel, smoothed, thinning_weights
from smartshoe.diagnosis._continuation import History, by_continuation, history_after, predecessor
from smartshoe.diagnosis._denoise import followed_share, noise_sd, without_noise
from smartshoe.diagnosis._grid import logged_on_grid, longest_step_s
from smartshoe.diagnosis._jittered import with_sampling_jitter
from smartshoe.diagnosis._load_cycles import cycles_of
from smartshoe.diagnosis._rest import load_at_rest, with_level_rests
from smartshoe.diagnosis._scale import Scale
from smartshoe.integrity.thresholds import Thresholds, largest_of_noise, stretch_by
from smartshoe.models.effects import Conditions, Effect
from smartshoe.recording import Recording
from smartshoe.signals.masks import runs_of


@dataclass(frozen=True, eq=False)
class DenoisedLoad:
    """The ``load`` (n,) without its noise; standard deviations of that noise before (``raw_sd``) and after.

    ``noise_left`` (n,): the share of that noise's variance that is left: all where no straight line goes through.
    """

    load: Array
    raw_sd: float
    remaining_sd: float
    noise_left: Array


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
    ``without_catch_alls``: nor are blocks that follow a part of what is left in most data. ``tare``: the load cell's,
    of at most what rests show; None where they show none.
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
    without_catch_alls: bool = False
    tare: Effect | None = None

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


def stretch_of(sessions: Sequence[Session]) -> float:
    """`stretch_by` of the longest fitted recording.

    So much slower may a unit be than the usual ones. What is slower still is not told from a drift.
    """
    longest_s = max((float(np.ptp(one.conditions.time_s)) for one in fitted_of(sessions)), default=0.0)
    return stretch_by(longest_s)


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
    histories: dict[str | None, History] = {}
    order = by_continuation(recordings)
    for index in order:
        recording = recordings[index]
        past = histories.get(predecessor(recording), History())
        made[index] = _session(recording, index, usable[index], scale, factors[index], past, thresholds)
        histories[recording.name] = history_after(made[index].conditions, thresholds)
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


def at_full_rate(
    sessions: Sequence[Session], usable: Sequence[Mask], scale: Scale, thresholds: Thresholds
) -> list[Session]:
    """The same sessions without thinning, with the same cycles and held-out parts."""
    return _with_common_temperature_zero(
        [
            _session(one.recording, one.index, mask, scale, 1, History.of(one.conditions), thresholds, one)
            for one, mask in zip(sessions, usable, strict=True)
        ]
    )


def _session(
    recording: Recording,
    index: int,
    usable: Mask,
    scale: Scale,
    factor: int,
    past: History,
    thresholds: Thresholds,
    template: Session | None = None,
) -> Session:
    """The session of one recording, thinned by ``factor``; cycles, held-out parts and noise those of a ``template``."""
    step_s = recording.sample_time_s
    logged = logged_on_grid(
        recording,
        usable,
        scale,
        longest_step_s(recording, factor if template is None else template.thinned),
        thresholds,
        is_judged=template is not None,
    )
    reading = scale.share(logged.reading)
    weights = thinning_weights(factor, reading.size) if template is None else kernel(1)
    denoised = (
        template.denoised
        if template is not None
        else _denoised_load(logged.load_n / scale.load_n, reading, step_s, thresholds)
    )
    rest = load_at_rest(denoised.load, reading, step_s, scale.unit, thresholds)
    reach = largest_of_noise(denoised.load.size, thresholds) * denoised.raw_sd
    auxiliary = {name: smoothed(values, weights, factor) for name, values in logged.auxiliary.items()}
    conditions = Conditions(
        logged.time_s[::factor],
        smoothed(with_level_rests(denoised.load, rest + 0.25 * thresholds.standing, reach), weights, factor),
        step_s * factor,
        denoised.remaining_sd * float(np.sqrt(np.sum(weights**2))),
        temperature_k=auxiliary.get("temperature_k"),
        neighbour=auxiliary.get("neighbour"),
        before=past.sums,
        earlier=past.load_every(step_s * factor),
        load_noise_left=denoised.noise_left[::factor],
    )
    coverage = smoothed(logged.usable.astype(float), weights, factor)
    # A reading that is logged at a fraction of the load's rate never fills a window.
    typical_coverage = float(np.median(coverage[coverage > 0.0])) if logged.usable.any() else 1.0
    load = conditions.load
    if template is None:
        held_out, cycle = np.zeros(load.size, dtype=bool), cycles_of(conditions, thresholds)
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


def _denoised_load(load: Array, reading: Array, step_s: float, thresholds: Thresholds) -> DenoisedLoad:
    """The load (n,) without noise and with the reading's sampling jitter, both in shares of full scale."""
    raw_sd = noise_sd(load, thresholds) * math.sqrt(max(1.0 - followed_share(load, reading, thresholds), 0.0))
    denoised, remaining_sd, noise_left = without_noise(load, step_s, raw_sd, thresholds)
    return DenoisedLoad(with_sampling_jitter(denoised, reading, step_s, thresholds), raw_sd, remaining_sd, noise_left)
