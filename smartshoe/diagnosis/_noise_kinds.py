"""Kinds of noise in the residual of the chosen model, in addition to data faults and causes."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from smartshoe.diagnosis._gauss_markov import GaussMarkov
from smartshoe.diagnosis._reported_lines import lines_of, reported_tones
from smartshoe.diagnosis._session import Session
from smartshoe.display import percent
from smartshoe.integrity import DataFault
from smartshoe.models.effects import NoiseEffect, catalogue
from smartshoe.models.extended import ExtendedModel

# A repeated sample lags like jitter; a dropout or a spike makes the variance follow the load.
IMITATED_BY = frozenset({"held_samples", "dropouts", "spikes", "gaps", "uneven_sampling"})


def noise_without_memory(
    fine: Sequence[Session], model: ExtendedModel, known: Sequence[DataFault], material: float
) -> list[DataFault]:
    """The kinds of noise without a memory that the residual at the full rate shows, beside the faults ``known``.

    Not in recordings with a fault that imitates them. Noise below ``material`` (share of full scale) does not count.
    """
    kinds = [one for one in _kinds() if not one.has_memory]
    return [fault for session in fine for fault in _shown(session, model, kinds, known, material)]


def noise_with_memory(
    fine: Sequence[Session],
    model: ExtendedModel,
    known: Sequence[DataFault],
    explained: bool,
    material: float,
    memory: GaussMarkov | None,
) -> list[DataFault]:
    """The recordings with noise that remembers, as `noise_without_memory`.

    Where structure is left that is not ``explained`` it would be taken for such noise, which is then not sought. The
    ``memory`` of the residual shows it where no load cycle repeats.
    """
    kinds = [one for one in _kinds() if one.has_memory]
    found = [fault for session in fine for fault in _shown(session, model, kinds, known, material) if explained]
    told = {fault.recording for fault in found}
    if memory is not None and memory.is_noise and memory.rms >= material:
        says = (
            f"what is left is correlated over about {memory.tau_s:.2g} s, under any load alike: coloured noise of"
            f" {percent(memory.rms)} of full scale"
        )
        found += [
            _throughout(session, kinds[0].name, says)
            for session in fine
            if session.fitted.any() and session.index not in told
        ]
    return found


def _kinds() -> list[NoiseEffect]:
    """The kinds of noise that a residual shows."""
    return [one for one in catalogue().values() if isinstance(one, NoiseEffect)]


def _shown(
    session: Session,
    model: ExtendedModel,
    kinds: Sequence[NoiseEffect],
    known: Sequence[DataFault],
    material: float,
) -> Iterator[DataFault]:
    """The ``kinds`` of noise that a ``session``'s residual shows beside those ``known``."""
    faults = {fault.kind for fault in known if fault.recording == session.index}
    if faults & IMITATED_BY or not session.usable.all():
        return
    prediction = model.simulate(session.conditions)
    residual = session.reading - prediction
    residual = residual - reported_tones(session, residual, lines_of(session, known))
    for noise in kinds:
        if faults.isdisjoint({noise.name, *noise.imitated_by}):
            one = noise.evidence(residual, session.conditions, prediction)
            if one is not None and one.strength >= material:
                yield _throughout(session, noise.name, one.says, one.lines_hz)


def _throughout(session: Session, kind: str, says: str, lines_hz: tuple[float, ...] = ()) -> DataFault:
    """A minor data fault over the whole of a recording."""
    start_s = float(session.recording.time_s[0])
    stop_s = start_s + float(session.conditions.time_s[-1])
    label = session.recording.label
    return DataFault(kind, session.index, label, start_s, stop_s, 1.0, says, "minor", lines_hz=lines_hz)
