"""The experiment that would separate what this data cannot: which one, and by how much."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from smartshoe.diagnosis.confidence import SEPARATED
from smartshoe.diagnosis.experiments import EXPERIMENTS
from smartshoe.diagnosis.fitting import Fit
from smartshoe.diagnosis.noise import NoiseModel
from smartshoe.diagnosis.result import Cause, NextExperiment
from smartshoe.diagnosis.selection import Choice
from smartshoe.diagnosis.session import Session
from smartshoe.models.effects import Conditions, effect, told_apart_by
from smartshoe.protocol import Protocol

DOUBTFUL = 5.0 * SEPARATED  # margins below this deserve another experiment
CHANNELS = {
    "displacement": "displacement",
    "temperature": "temperature",
    "pressure_reference": "pressure reference",
    "neighbour": "neighbour",
}


def next_experiment(choice: Choice, causes: Sequence[Cause], sessions: Sequence[Session]) -> NextExperiment | None:
    """For the most doubtful cause: the protocol with the largest expected margin, or the channel to log.

    None where every cause is told from its rivals with ease.
    """
    near = {cause.name: [r for r in choice.rivals[cause.name] if r.fit and r.margin < DOUBTFUL] for cause in causes}
    doubtful = [cause for cause in causes if near[cause.name]]
    if not doubtful:
        return None
    # The largest cause that is in doubt: what matters most comes first.
    cause = max(doubtful, key=lambda one: one.size)
    rivals = near[cause.name]
    rival, margin, other = rivals[0].effect, rivals[0].margin, rivals[0].fit
    if other is None:
        return None
    peak_n = choice.fit.model.full_scale_load_n
    found = {
        name: expected_margin(choice.fit, other, made(peak_n), choice.evidence.noise, sessions[0])
        for name, made in EXPERIMENTS.items()
    }
    best = max(found, key=lambda name: found[name])
    names = (cause.name, *(one.effect for one in rivals))
    told = " and ".join(name.replace("_", " ") for name in names[:2])
    channel = _channel(cause.name, rival, sessions)
    if found[best] < DOUBTFUL and channel is not None:
        return NextExperiment(
            names,
            None,
            channel,
            f"no load history tells {told} apart well (the best, {best.replace('_', ' ')}, by {found[best]:,.0f}):"
            f" log the {channel} too",
            found[best],
        )
    if found[best] < SEPARATED:
        return NextExperiment(
            names,
            None,
            channel,
            f"no load history that a machine can run tells {told} apart: take either, they predict the same",
            found[best],
        )
    return NextExperiment(
        names,
        best,
        channel,
        f"run {best.replace('_', ' ')}: it should tell {told} apart by {found[best]:,.0f} of -2 log likelihood,"
        f" where this data does by {max(margin, 0.0):,.0f}",
        found[best],
        EXPERIMENTS[best](peak_n),
    )


def expected_margin(truth: Fit, rival: Fit, protocol: Protocol, noise: NoiseModel, like: Session) -> float:
    """By how much -2 log likelihood would be worse with the rival, were ``truth`` true and the protocol run once.

    The rival may move its parameters as far as the data so far lets it: min over d of |yA - yB - J d|^2 + d' H d in
    whitened units, H the information that it was fitted with.
    """
    step_s = like.conditions.step_s
    time_s = np.arange(0.0, protocol.duration_s, step_s)
    full_n = truth.model.full_scale_load_n
    conditions = Conditions(time_s, protocol.load_at(time_s) / full_n, step_s, like.conditions.load_noise)
    reading, slopes = rival.model.sensitivities(conditions)
    difference = noise.whitened(truth.model.simulate(conditions) - reading)
    J = noise.whitened(slopes)
    information = np.linalg.pinv(rival.covariance, rcond=1e-12, hermitian=True)
    unseen = np.diag(rival.covariance) == 0
    scale = np.sqrt(np.sum(J**2, axis=0) + np.diag(information))
    good = (scale > 0) & ~unseen
    if not good.any():
        return float(difference @ difference)
    Js, H = J[:, good] / scale[good], information[np.ix_(good, good)] / np.outer(scale[good], scale[good])
    moved = np.linalg.lstsq(Js.T @ Js + H, Js.T @ difference, rcond=1e-12)[0]
    left = difference - Js @ moved
    return float(left @ left + moved @ H @ moved)


def _channel(name: str, rival: str, sessions: Sequence[Session]) -> str | None:
    """The channel that the catalogue says would tell them apart, if it was not logged already."""
    said = told_apart_by(effect(name), effect(rival))
    logged = {channel for session in sessions for channel in session.recording.channels}
    for word, channel in CHANNELS.items():
        if word in said and channel not in logged:
            return channel
    return None
