"""What is a recording's own and no part of a model: its offset, its initial state, its own gains and zeros.

They are estimated on the recording itself, for every model alike: from its fitted samples, or from all of them where
none was fitted; likewise its state after a long gap.
"""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np

from smartshoe.arrays import Array, Mask
from smartshoe.diagnosis._noise import effective_noise_sd
from smartshoe.diagnosis._sensitivity import nuisance_diagonal, nuisances, past_sd
from smartshoe.diagnosis._session import Session
from smartshoe.models.extended import ExtendedModel


def own_terms_of(session: Session, model: ExtendedModel, residual: Array) -> tuple[Array, Array]:
    """A recording's own terms (2 + k,) under ``model``, and what they add to its reading (n,), shares of full scale.

    They are its offset, its initial state, its own gains, the changes of its zero, and its states after long gaps.
    ``residual`` (n,) is the reading less the simulation. A state is bounded by what the arm can hold under full load.

    Where held-out samples come before all fitted ones, the initial state has the prior that it has in every fit, and
    noise counts once per correlation time: extrapolated back, slow noise grows by exp(p t).
    """
    mask = _samples_of_own_terms(session, model.pole_per_s)
    columns = nuisances(session, model.pole_per_s, session.reading - residual)
    seen = columns[mask]
    inner, right_side = seen.T @ seen, seen.T @ residual[mask]
    largest_state = max(abs(model.relaxing_share * model.gain), 1e-6)

    def solved_with(variance: float, state_sd: float) -> Array:
        of_past, of_gap = (variance / sd**2 + 1e-9 for sd in (state_sd, largest_state))
        prior = nuisance_diagonal(session, offset=1e-9, past=of_past, change=variance, gap=of_gap)
        return np.asarray(np.linalg.solve(inner + prior, right_side), dtype=np.float64)

    found = solved_with(float(np.var(residual[mask])) if mask.any() else 0.0, largest_state)
    if session.judged[: int(np.argmax(mask))].any():
        left = residual - columns @ found
        found = solved_with(effective_noise_sd([left], [mask]) ** 2, past_sd(session, model))
    return found, columns @ found


def initial_memory_of(session: Session, model: ExtendedModel, residual: Array) -> tuple[float, float]:
    """The memory that a recording begins with, from its fitted samples, and its standard deviation.

    It has the prior of every fit, and noise counts once per correlation time.
    """
    mask = session.fitted
    columns = nuisances(session, model.pole_per_s, session.reading - residual)
    left = residual - own_terms_of(session, model, residual)[1]
    variance = effective_noise_sd([left], [mask]) ** 2
    known = variance / past_sd(session, model) ** 2
    prior = nuisance_diagonal(session, offset=0.0, past=known, change=variance, gap=variance) + 1e-9 * np.eye(
        columns.shape[1]
    )
    seen = columns[mask]
    inverse = np.linalg.inv(seen.T @ seen + prior)
    return float((inverse @ (seen.T @ residual[mask]))[1]), math.sqrt(variance * float(inverse[1, 1]))


def _samples_of_own_terms(session: Session, pole_per_s: float) -> Mask:
    """(n,) samples from which the own terms are estimated.

    The fitted ones; after a gap also unfitted ones, since the state fades and is seen soon or never.
    """
    if not session.fitted.any():
        return session.usable
    informative = session.fitted.copy()
    fades = max(1, round(1.0 / (pole_per_s * session.conditions.step_s)))
    for begins, ends in pairwise((*session.gap_ends, informative.size)):
        after = slice(begins, min(begins + fades, ends))
        if not informative[after].any():
            informative[after] = session.usable[after]
    return informative


def gains_and_zero_changes(session: Session, own: Array) -> tuple[Array, Array]:
    """The own gains (k,) and zero changes (l,) among the own terms of `own_terms_of`."""
    first, last = 2 + len(session.gain_parts), 2 + len(session.gain_parts) + len(session.zero_changes)
    return own[2:first], own[first:last]


def residual_of(session: Session, model: ExtendedModel) -> Array:
    """(n,) reading less simulation less own terms, shares of full scale."""
    residual = session.reading - model.simulate(session.conditions)
    return np.asarray(residual - own_terms_of(session, model, residual)[1])
