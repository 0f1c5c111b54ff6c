"""Kinds of noise in what the chosen model leaves: after the data's own faults, and beside the causes."""

from __future__ import annotations

from collections.abc import Sequence

from smartshoe.diagnosis._gauss_markov import GaussMarkov
from smartshoe.diagnosis._session import Session
from smartshoe.integrity import DataFault
from smartshoe.models.effects.coloured_noise import ColouredNoise
from smartshoe.models.effects.coloured_noise import evidence as wandering
from smartshoe.models.effects.heteroscedastic_noise import HeteroscedasticNoise
from smartshoe.models.effects.heteroscedastic_noise import evidence as growing
from smartshoe.models.effects.hum import Hum
from smartshoe.models.effects.hum import evidence as humming
from smartshoe.models.effects.timing_jitter import TimingJitter
from smartshoe.models.effects.timing_jitter import evidence as jittering
from smartshoe.models.extended import ExtendedModel

KINDS = {Hum: humming, TimingJitter: jittering, HeteroscedasticNoise: growing, ColouredNoise: wandering}
# A sample that repeats the one before it lags like jitter; a dropout or a spike makes the variance follow the load.
IMITATED_BY = frozenset({"held_samples", "dropouts", "spikes", "gaps", "uneven_sampling"})


def noise_kinds(
    fine: Sequence[Session],
    model: ExtendedModel,
    known: Sequence[DataFault],
    explained: bool,
    material: float,
    memory: GaussMarkov | None,
) -> list[DataFault]:
    """What the residual at the full rate shows, for recordings in which no fault of the data would imitate it.

    Where structure is left that no effect has ``explained``, it would be taken for coloured noise. Where no load cycle
    repeats, the ``memory`` of what is left tells of it. Nothing weaker than ``material`` (share of full scale) counts.
    """
    found = []
    for session in fine:
        faults = {fault.kind for fault in known if fault.recording == session.index}
        if faults & IMITATED_BY or not session.usable.all():
            continue
        conditions = session.conditions
        prediction = model.simulate(conditions)
        residual = session.reading - prediction
        for noise, evidence in KINDS.items():
            if noise.name in faults or (noise is ColouredNoise and not explained):
                continue
            one = evidence(residual, conditions, prediction, conditions.step_s)
            if one is not None and one.strength >= material:
                found.append(_throughout(session, noise.name, one.says))
    told = {fault.recording for fault in found if fault.kind == ColouredNoise.name}
    if memory is not None and memory.is_noise and memory.rms >= material:
        says = (
            f"what is left is correlated over about {memory.tau_s:.2g} s, under any load alike: coloured noise of"
            f" {100 * memory.rms:.2g} % of full scale"
        )
        found += [
            _throughout(session, ColouredNoise.name, says)
            for session in fine
            if session.fitted.any() and session.index not in told
        ]
    return found


def _throughout(session: Session, kind: str, says: str) -> DataFault:
    start_s = float(session.recording.time_s[0])
    stop_s = start_s + float(session.conditions.time_s[-1])
    return DataFault(kind, session.index, session.recording.label, start_s, stop_s, 1.0, says, "minor")
