"""Which of the effects that were found are causes, and why the others are none."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from smartshoe.diagnosis._inference import Inference
from smartshoe.diagnosis._limits import (
    as_the_cell_shows_of,
    crept_of,
    departure_of,
    few_cycles_of,
    in_a_tare_of,
    led_back_of,
    moved_of,
    not_shown_of,
    of_no_gas,
    other_kind_of,
    parted_clocks,
    past_of,
    remembered_of,
)
from smartshoe.diagnosis._naming import Name, doubted, names_of
from smartshoe.diagnosis._prepared import Prepared
from smartshoe.diagnosis._remembered import may_be_remembered
from smartshoe.diagnosis._session import load_cycles
from smartshoe.diagnosis._zero import Zero, creeping


@dataclass(frozen=True, eq=False)
class Chosen:
    """``names`` and ``zeros`` that are causes; ``limits`` and ``of_zeros``: what is said of such as fit and are none.

    ``nameless``: how far the largest that is of no kind with a name moves the reading, rms, a share of full scale.
    """

    names: tuple[Name, ...]
    zeros: tuple[Zero, ...] = ()
    limits: tuple[str, ...] = ()
    nameless: float = 0.0
    of_zeros: tuple[str, ...] = ()

    def without(self, why: Callable[[Name], str | None]) -> Chosen:
        """Without the names for which there is a reason why they are none, which is said."""
        reasons = [why(one) for one in self.names]
        kept = tuple(one for one, said in zip(self.names, reasons, strict=True) if said is None)
        return replace(self, names=kept, limits=(*self.limits, *(said for said in reasons if said is not None)))


def causes_among(found: Inference, given: Prepared, zeros: Sequence[Zero], left: float) -> Chosen:
    """Of what was ``found``, and of ``zeros`` that were seen; ``left``: rms of structure that no effect explains."""
    thresholds = given.thresholds
    seen = _shown(found, given, left)
    seen = seen.without(lambda one: moved_of(one) if given.is_moved and one.effect.is_latency else None)
    seen = _with_what_is_remembered(seen, found, given)
    rivals = seen.names
    seen = seen.without(lambda one: departure_of(one, rivals, thresholds))
    cycles = load_cycles(given.sessions, thresholds)
    surest = sorted(seen.names, key=lambda one: -one.kind_probability)[:cycles]
    seen = seen.without(lambda one: None if one in surest else few_cycles_of(one, cycles))
    parted = parted_clocks(given.clocks, found.fit.model, given.sessions, thresholds)
    clocks = [] if parted is None else [effect for effect, _ in given.clocks]
    names = tuple(one for one in seen.names if one.effect not in clocks)
    before = () if parted is None else (parted,)
    past = tuple(past_of(one, given.scale) for one in zeros if one.is_past)
    led = tuple(led_back_of(one, given.scale, thresholds) for one in zeros if one.led_from and not one.is_past)
    # A zero that jumps within recordings is no offset.
    kept = tuple(
        one
        for one in zeros
        if not (one.is_past or one.led_from or (found.zero_changes and one.effect.shifts == "reading"))
    )
    seen = Chosen(names, kept, (*before, *seen.limits), seen.nameless, (*past, *led))
    seen = seen.without(lambda one: crept_of(one, creeping(kept, one.effect, one.member.size, thresholds)))
    of_tare = in_a_tare_of(kept, [one.effect for one in seen.names], given.scale, thresholds)
    return replace(seen, of_zeros=(*seen.of_zeros, *as_the_cell_shows_of(kept, given.scale), *of_tare))


def _with_what_is_remembered(seen: Chosen, found: Inference, given: Prepared) -> Chosen:
    """Half sure at most, and said to be, where an effect's arm may remember what a drift is told for."""
    about = found.fit.model, given.sessions, given.thresholds
    unsure = [one for one in seen.names if may_be_remembered(one, *about)]
    names = tuple(doubted(one) if one in unsure else one for one in seen.names)
    return replace(seen, names=names, limits=(*seen.limits, *(remembered_of(one) for one in unsure)))


def _shown(found: Inference, given: Prepared, left: float) -> Chosen:
    """The names of what was found, but for effects of no kind with a name, and those that this data cannot show.

    Such an effect is taken out and all others are named anew, so that none is named for being beside it.
    """
    thresholds = given.thresholds
    members = [one for one in found.members if one.name not in found.undone]
    limits: tuple[str, ...] = ()
    nameless = 0.0
    while True:
        likely = names_of(
            members,
            left,
            thresholds,
            is_clocked=given.excitation.goes_with_the_clock,
            is_unsteady=bool(found.zero_changes),
            alone=found.alone,
        )
        if not likely and found.alone is not None:
            # What does most by itself does not hang on what undoes it beside others.
            undone = [one for one in found.members if one.name in found.undone and one.effect.kind == found.alone.kind]
            likely = names_of(undone, left, thresholds, is_unsteady=True, alone=found.alone)
        shown = Chosen(likely, (), limits).without(
            lambda one: (
                other_kind_of(one, found.fit.model, thresholds)
                or not_shown_of(one, given.excitation)
                or of_no_gas(one, given.scale.unit)
            )
        )
        withheld = [one.member for one in likely if one not in shown.names]
        limits, nameless = shown.limits, max([nameless, *(one.size for one in withheld)])
        if not any(one in members for one in withheld):
            return replace(shown, nameless=nameless)
        members = [one for one in members if one not in withheld]
