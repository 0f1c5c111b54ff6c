"""Kinds of noise in the residual of the chosen model, in addition to data faults and causes."""

from __future__ import annotations

from collections.abc import Sequence

from smartshoe.diagnosis._gauss_markov import GaussMarkov
from smartshoe.diagnosis._session import Session
from smartshoe.display import percent
from smartshoe.integrity import DataFault
from smartshoe.models.effects import NoiseEffect, catalogue
from smartshoe.models.extended import ExtendedModel

# A repeated sample lags like jitter; a dropout or a spike makes the variance follow the load.
IMITATED_BY = frozenset({"held_samples", "dropouts", "spikes", "gaps", "uneven_sampling"})


def noise_kinds(
    fine: Sequence[Session],
    model: ExtendedModel,
    known: Sequence[DataFault],
    explained: bool,
    material: float,
    memory: GaussMarkov | None,
) -> list[DataFault]:
    """The kinds of noise that the residual at the full rate shows, in recordings without a fault that imitates them.

    Where structure is left that is not ``explained`` it would be taken for coloured noise, which is then not sought.
    The ``memory`` of the residual shows it where no load cycle repeats. Noise below ``material`` (share of full scale)
    does not count.
    """
    kinds = [one for one in catalogue().values() if isinstance(one, NoiseEffect)]
    kinds.sort(key=lambda one: one.has_memory)  # last, what is most easily imitated
    found = []
    for session in fine:
        faults = {fault.kind for fault in known if fault.recording == session.index}
        if faults & IMITATED_BY or not session.usable.all():
            continue
        conditions = session.conditions
        prediction = model.simulate(conditions)
        residual = session.reading - prediction
        for noise in kinds:
            if noise.name in faults or (noise.has_memory and not explained):
                continue
            one = noise.evidence(residual, conditions, prediction)
            if one is not None and one.strength >= material:
                found.append(_throughout(session, noise.name, one.says))
    remembering = next(one.name for one in kinds if one.has_memory)
    told = {fault.recording for fault in found if fault.kind == remembering}
    if memory is not None and memory.is_noise and memory.rms >= material:
        says = (
            f"what is left is correlated over about {memory.tau_s:.2g} s, under any load alike: coloured noise of"
            f" {percent(memory.rms)} of full scale"
        )
        found += [
            _throughout(session, remembering, says)
            for session in fine
            if session.fitted.any() and session.index not in told
        ]
    return found


def _throughout(session: Session, kind: str, says: str) -> DataFault:
    """A minor data fault over the whole of a recording."""
    start_s = float(session.recording.time_s[0])
    stop_s = start_s + float(session.conditions.time_s[-1])
    return DataFault(kind, session.index, session.recording.label, start_s, stop_s, 1.0, says, "minor")
