"""Which of the effects found are causes, and why the others are not."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace

from smartshoe.diagnosis._inference import Inference
from smartshoe.diagnosis._limits import (
    limit_clocks_disagree,
    limit_curves_in_tare,
    limit_force_as_logged,
    limit_load_cell_moves,
    limit_remembered,
    limit_zero_drifted,
    limit_zero_extrapolated,
    reason_clocks_aligned,
    reason_departure,
    reason_few_cycles,
    reason_no_gas,
    reason_not_shown,
    reason_of_another_kind,
    reason_tare_creeps,
)
from smartshoe.diagnosis._load_cycles import load_cycles
from smartshoe.diagnosis._load_drift import may_be_of_the_load_cell
from smartshoe.diagnosis._naming import Name, capped_at_half, names_of
from smartshoe.diagnosis._prepared import Prepared
from smartshoe.diagnosis._remembered import may_be_remembered
from smartshoe.diagnosis._zero import Zero, creeping_tare
from smartshoe.models.effects import told_apart_by

# Why names are half sure at most.
JUMPS = "the zero jumps within recordings, and jumps that are not seen may look like any effect"
AN_INTEGRAL = "the reading goes with the integral of the load, as no pressed unit's does"
UNDONE = "other effects of the model undo a part of it"
REMEMBERED = "it may be a memory of loads before the recordings"
OF_THE_LOAD_CELL = "at rest the logged load moves as it has it, and not the reading: the load cell's zero may move"


@dataclass(frozen=True, eq=False)
class NamedCauses:
    """The ``names`` and ``zeros`` that are causes, and sentences on those that are not: ``limits``, ``zero_limits``.

    ``unnamed_rms`` is the size of the largest effect without a name, rms as a share of full scale.
    """

    names: tuple[Name, ...]
    zeros: tuple[Zero, ...] = ()
    limits: tuple[str, ...] = ()
    unnamed_rms: float = 0.0
    zero_limits: tuple[str, ...] = ()

    def without(self, why: Callable[[Name], str | None]) -> NamedCauses:
        """The same without the names for which ``why`` gives a reason; the reasons join ``limits``."""
        reasons = [why(one) for one in self.names]
        kept = tuple(one for one, said in zip(self.names, reasons, strict=True) if said is None)
        return replace(self, names=kept, limits=(*self.limits, *(said for said in reasons if said is not None)))

    def with_doubt(self, doubt: str, unsure: Sequence[Name], limits: Sequence[str]) -> NamedCauses:
        """The same with the ``unsure`` names half sure at most, for a ``doubt`` that ``limits`` tell more of."""
        names = tuple(capped_at_half(one, doubt) if one in unsure else one for one in self.names)
        return replace(self, names=names, limits=(*self.limits, *limits))


def causes_among(found: Inference, given: Prepared, zeros: Sequence[Zero], residual_rms: float) -> NamedCauses:
    """The causes among the effects ``found`` and the ``zeros`` seen; ``residual_rms``: structure without an effect."""
    thresholds = given.thresholds
    chosen = _shown(found, given, residual_rms)
    chosen = chosen.without(
        lambda one: reason_clocks_aligned(one) if given.is_moved and one.effect.is_latency else None
    )
    about = found.fit.model, given.sessions, thresholds
    remembered = [one for one in chosen.names if may_be_remembered(one, *about)]
    chosen = chosen.with_doubt(REMEMBERED, remembered, limit_remembered(remembered))
    of_cell = [one for one in chosen.names if may_be_of_the_load_cell(one, *about)]
    chosen = chosen.with_doubt(OF_THE_LOAD_CELL, of_cell, limit_load_cell_moves(of_cell))
    rivals = chosen.names
    chosen = chosen.without(lambda one: reason_departure(one, rivals, thresholds))
    cycles = load_cycles(given.sessions, thresholds)
    surest = sorted(chosen.names, key=lambda one: -one.kind_probability)[:cycles]
    chosen = chosen.without(lambda one: None if one in surest else reason_few_cycles(one, cycles))
    clocks_disagree = limit_clocks_disagree(given.clocks, found.fit.model, given.sessions, thresholds)
    clocks = [effect for effect, _ in given.clocks] if clocks_disagree else []
    names = tuple(one for one in chosen.names if one.effect not in clocks)
    # An offset is constant: where the zero jumps within recordings there is none.
    kept = tuple(
        _with_gaps(one, names, given.excitation.tells_apart | given.excitation.channels)
        for one in zeros
        if not (
            one.may_have_drifted or one.extrapolated_from or (found.zero_changes and one.effect.shifts == "reading")
        )
    )
    chosen = NamedCauses(names, kept, (*clocks_disagree, *chosen.limits), chosen.unnamed_rms)
    chosen = chosen.without(
        lambda one: reason_tare_creeps(one, creeping_tare(kept, one.effect, one.member.size, thresholds))
    )
    zero_limits = (
        *limit_zero_drifted(zeros, given.scale),
        *limit_zero_extrapolated(zeros, given.scale, thresholds),
        *limit_force_as_logged(kept, given.scale),
        *limit_curves_in_tare(kept, [one.effect for one in chosen.names], given.scale, thresholds),
    )
    return replace(chosen, zero_limits=zero_limits)


def _with_gaps(zero: Zero, names: Sequence[Name], present: Collection[str]) -> Zero:
    """A tare with those ``names`` as alternatives that nothing ``present`` tells from it.

    At the load shown at rest the unit reads nothing: under a gap it may bear that load.
    """
    if zero.effect.shifts != "load":
        return zero
    words = {one.effect.name: told_apart_by(zero.effect, one.effect) for one in names}
    alike = (name for name, told_by in words.items() if told_by and told_by.isdisjoint(present))
    return replace(zero, alternatives=tuple(dict.fromkeys((*zero.alternatives, *alike))))


def _shown(found: Inference, given: Prepared, residual_rms: float) -> NamedCauses:
    """The names of what was found, without effects of no named kind and effects that this data cannot show.

    Whenever such an effect is removed all others are named again, so that none owes its name to it.
    """
    thresholds = given.thresholds
    members = [one for one in found.members if one.name not in found.cancelling_names]
    limits: tuple[str, ...] = ()
    unnamed_rms = 0.0
    while True:
        left = {one.name for one in members}
        names = names_of(
            members,
            residual_rms,
            thresholds,
            is_clocked=given.excitation.goes_with_the_clock,
            doubt=JUMPS if found.zero_changes else AN_INTEGRAL if given.is_integral else "",
            best_single=found.best_single,
            together=[one for one in found.together if {one.name, *one.kin} <= left],
        )
        if not names and found.best_single is not None:
            # The best single effect does not depend on effects that cancel it.
            cancelling_members = [
                one
                for one in found.members
                if one.name in found.cancelling_names and one.effect.kind == found.best_single.kind
            ]
            names = names_of(cancelling_members, residual_rms, thresholds, doubt=UNDONE, best_single=found.best_single)
        shown = NamedCauses(names, (), limits).without(
            lambda one: (
                reason_of_another_kind(one, found.fit.model, thresholds)
                or reason_not_shown(one, given.excitation)
                or reason_no_gas(one, given.scale.unit)
            )
        )
        withheld = [one.member for one in names if one not in shown.names]
        limits, unnamed_rms = shown.limits, max([unnamed_rms, *(one.size for one in withheld)])
        if not any(one in members for one in withheld):
            return replace(shown, unnamed_rms=unnamed_rms)
        members = [one for one in members if one not in withheld]
