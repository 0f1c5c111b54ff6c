"""Zeros that move in the load cell, and not in the reading: the rests tell, which show an unloaded unit."""

from __future__ import annotations

from collections.abc import Sequence

from smartshoe.diagnosis._excitation import rested
from smartshoe.diagnosis._naming import Name
from smartshoe.diagnosis._session import Session, fitted_of
from smartshoe.integrity.thresholds import Thresholds
from smartshoe.models.extended import ExtendedModel


def may_be_of_the_load_cell(
    name: Name, model: ExtendedModel, sessions: Sequence[Session], thresholds: Thresholds
) -> bool:
    """Whether, at rest, the logged load moves by about what ``name`` takes the zero the other way (``clear``).

    Such an effect only undoes there what the load cell shows of an unloaded machine, and the reading stays: a zero that
    moves in the reading moves no load. A load that moves by far more is no shadow of the effect; one that changes the
    gain changes the reading by a share of it.
    """
    moved = total = count = 0.0
    for one in fitted_of(sessions):
        at = rested(one, thresholds) & one.fitted
        if not at.any():
            continue
        shift = model.simulate(one.conditions) - model.without(name.member.name).simulate(one.conditions)
        shift, load = (values[at] - values[at].mean() for values in (shift, model.gain * one.conditions.load))
        moved, total, count = moved - float(load @ shift), total + float(shift @ shift), count + int(at.sum())
    is_material = total > thresholds.material**2 * count
    return is_material and total < thresholds.clear * moved < thresholds.clear**2 * total
