"""Recordings prepared for a diagnosis: on the load's clock, in shares of full scale, with a model to start from."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import chain

from smartshoe.arrays import Array
from smartshoe.diagnosis._aligned import Aligned, aligned, with_lags_removed
from smartshoe.diagnosis._baseline import baseline_of, has_negative_gain, with_usual_arm
from smartshoe.diagnosis._characteristic import conductance_of, friction_of
from smartshoe.diagnosis._excitation import Excitation, excitation_of
from smartshoe.diagnosis._grid import longest_step_s
from smartshoe.diagnosis._integral import limit_integral
from smartshoe.diagnosis._limits import limit_noisy_load
from smartshoe.diagnosis._neighbours import with_one_neighbour
from smartshoe.diagnosis._ranges import ranges_of
from smartshoe.diagnosis._scale import Scale, fitted_lengths, full_scale, thinning
from smartshoe.diagnosis._sensitivity import logged_words
from smartshoe.diagnosis._session import Session, at_full_rate, prepare
from smartshoe.diagnosis._slow_segments import limit_slow_segments
from smartshoe.diagnosis._zero import zeros_of
from smartshoe.display import first_names
from smartshoe.integrity import Integrity
from smartshoe.integrity.thresholds import Thresholds
from smartshoe.models.effects import Effect
from smartshoe.models.extended import ExtendedModel
from smartshoe.recording import Recording


@dataclass(frozen=True, eq=False)
class Prepared:
    """``sessions``, thinned for fits, and ``fine``, at the full rate; ``start`` is the model that fits start from.

    ``limits`` are sentences on the data before any fit. ``is_no_unit``: the reading follows something other than the
    unit's load. ``is_integral``: it follows what the load adds up to. ``clocks`` are effects, with values, that put
    reading and load on one clock. ``is_moved``: fitted readings were shifted there, each by its own lag.
    """

    sessions: list[Session]
    fine: list[Session]
    scale: Scale
    limits: list[str]
    start: ExtendedModel
    excitation: Excitation
    is_no_unit: bool
    is_integral: bool
    clocks: Sequence[tuple[Effect, Array]]
    is_moved: bool
    thresholds: Thresholds


def prepared(recordings: Sequence[Recording], count: int, integrity: Integrity, thresholds: Thresholds) -> Prepared:
    """The prepared ``recordings``; the first ``count`` are fitted, the others are held out."""
    recordings, said_of_neighbours = with_one_neighbour(recordings, count, integrity.usable, thresholds)
    clocks = aligned(recordings, integrity)
    held_out = [place >= count for place in clocks.places]
    count = held_out.count(False)
    is_moved = not clocks.moved.isdisjoint(clocks.places[:count])
    fitted, usable = clocks.recordings[:count], clocks.usable[:count]
    following = with_lags_removed(fitted, usable, None if is_moved else integrity.one_clock)
    scale = full_scale(fitted, usable, thresholds, following)
    held = held_out if any(held_out) else None
    factors = thinning(fitted, scale, thresholds)
    clocks, said_of_length = _first_parts(clocks, fitted_lengths(fitted, factors))
    sessions = [
        replace(one, index=clocks.places[one.index])
        for one in prepare(clocks.recordings, clocks.usable, held, scale, factors, thresholds)
    ]
    if not clocks.parts and has_negative_gain(sessions, thresholds):
        sessions = [replace(one, reading=-one.reading) for one in sessions]
        scale = replace(scale, reading=-scale.reading)
    start = baseline_of(sessions, scale)
    if clocks.parts:  # against the load on another clock no relaxation is found
        start = with_usual_arm(start)
    for added, values in clocks.parts:
        start = start.with_part(added, values)
    excitation = replace(excitation_of(sessions, thresholds), channels=logged_words(sessions))
    ranges = ranges_of(sessions, start, scale, thresholds)
    friction = [friction_of(recording, thresholds) for recording in following]  # a lag would look like friction
    said_of_curve = (*friction, conductance_of(clocks.recordings[:count], thresholds))
    slow = (
        limit_slow_segments(one.recording, mask, longest_step_s(one.recording, one.thinned), thresholds)
        for one, mask in zip(sessions, clocks.usable, strict=True)
    )
    # By edges that are late it is known that the reading is the load of another time, and no integral.
    integral = [] if clocks.parts else limit_integral(sessions, thresholds)
    limits = [
        *said_of_neighbours,
        *clocks.says,
        *said_of_length,
        *chain.from_iterable(slow),
        *ranges.says,
        *(said for said in said_of_curve if said is not None),
        *integral,
        *limit_noisy_load(sessions, scale, thresholds),
        *excitation.limits(),
    ]
    seen = [one for one in zeros_of(sessions, start, scale, 0.0, 0.0, thresholds) if one.is_seen]
    if tares := [one.effect.of_at_most(one.value) for one in seen if one.effect.shifts == "load"]:
        sessions = [replace(one, tare=tares[0]) for one in sessions]
    return Prepared(
        sessions=sessions,
        fine=at_full_rate(sessions, clocks.usable, scale, thresholds),
        scale=scale,
        limits=limits,
        start=start,
        excitation=excitation,
        is_no_unit=ranges.is_trap or all(said is not None for said in friction),
        is_integral=bool(integral),
        clocks=clocks.parts,
        is_moved=is_moved,
        thresholds=thresholds,
    )


def _first_parts(clocks: Aligned, lengths: Sequence[int]) -> tuple[Aligned, list[str]]:
    """``clocks`` with only ``lengths`` samples of the first recordings, and the sentence on the rest."""
    recordings, usable, cut = [*clocks.recordings], [*clocks.usable], []
    for k, length in enumerate(lengths):
        whole = recordings[k]
        if length < len(whole):
            recordings[k], usable[k] = whole.taken(slice(0, length)), usable[k][:length]
            cut.append(f"of {whole.name} the first {recordings[k].duration_s:.0f} of {whole.duration_s:.0f} s")
    if not cut:
        return clocks, []
    said = (
        f"fast loads over so long a time are too many samples for one fit: {first_names(cut)} are used, and what"
        " changes later is not seen (fit shorter recordings, from early and from late)"
    )
    return replace(clocks, recordings=recordings, usable=usable), [said]
