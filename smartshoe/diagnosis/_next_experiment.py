"""The experiment that would separate what this data cannot: which one, and by how much."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from smartshoe.diagnosis._excitation import Excitation
from smartshoe.diagnosis._experiments import EXPERIMENTS
from smartshoe.diagnosis._gains_and_zeros import changes_of
from smartshoe.diagnosis._inference import Inference
from smartshoe.diagnosis._likelihood import Fit, fit
from smartshoe.diagnosis._members import begun_with
from smartshoe.diagnosis._result import Cause, NextExperiment
from smartshoe.diagnosis._sensitivity import logged_channels
from smartshoe.diagnosis._session import Session
from smartshoe.display import moment
from smartshoe.integrity.thresholds import Thresholds
from smartshoe.models.effects import Conditions, effect, in_words, listed, told_apart_by
from smartshoe.models.effects.exposure import CHANNELS, SAYS, Exposure
from smartshoe.protocol import Protocol

SHOWN_BY: dict[Exposure, str] = {
    "rates": "rates",
    "holds": "long_hold",
    "rests": "idle",
    "minor_loops": "minor_loops",
    "peaks": "shuffled_loads",
    "pauses": "pauses",
    "steps": "steps",
}


def next_experiment(
    found: Inference,
    causes: Sequence[Cause],
    sessions: Sequence[Session],
    excitation: Excitation,
    *,
    open_: bool,
    worse: bool = False,
) -> NextExperiment | None:
    """For the most doubtful cause: the shortest protocol that tells it clearly better than this data, or a channel.

    Before all else, where the extension is ``worse`` on what is held out: such loads among those that are fitted.
    Where no cause is in doubt, but recordings have gains of their own, one of them again. Where none is, and something
    is left (``open_``), or a name is not sure, what this data never showed; else None. Where a single load cycle tells
    no cause, more of them.
    """
    pair = _pair(causes)
    if worse:
        held = ", ".join(dict.fromkeys(one.recording.name for one in sessions if one.judged.any()))
        says = f"record what {held} holds once more, and fit it too: the extended model does not hold for its loads"
        return NextExperiment(pair, "repeat", None, says)
    doubtful = [cause for cause in causes if cause.equivalents and cause.part is not None]
    if doubtful:
        return _told_apart(found, max(doubtful, key=lambda one: one.size), sessions, excitation.thresholds)
    if found.own_gains or found.zero_changes:
        return NextExperiment(pair, "repeat", None, _again(found))
    if not found.can_validate:
        says = (
            "repeat the load cycle, several times in one recording or in a second one: of a single one nothing can be"
            " held against another, so that no cause can be told"
        )
        return NextExperiment(pair, "repeat", None, says)
    least = excitation.thresholds.least_confidence
    is_open = open_ or any(cause.equivalents or cause.confidence < least for cause in causes)
    return _unseen(found, pair, excitation) if is_open else None


def _told_apart(found: Inference, cause: Cause, sessions: Sequence[Session], thresholds: Thresholds) -> NextExperiment:
    """The shortest protocol that tells a cause from its nearest equivalent clearly better than this data, or a channel.

    Each protocol is simulated with the fitted model, and with the equivalent in the cause's place.
    """
    rival, part = cause.equivalents[0], str(cause.part)
    truth = found.fit if part == cause.name else _in_place_of(found, part, cause.name)
    other = _in_place_of(found, part, rival)
    margin = next((one.margin for one in cause.rivals if one.effect == rival), 0.0)
    peak_n = found.fit.model.full_scale_load_n
    noise_sd = found.fit.likelihood.noise_sd
    finest = min(sessions, key=lambda one: one.conditions.step_s)
    expected = {
        name: expected_margin(truth, other, made(peak_n), noise_sd, finest) for name, made in EXPERIMENTS.items()
    }
    most = max(expected.values())
    names = (cause.name, *cause.equivalents)
    both = listed((cause.name, rival), "and")
    channel = _channel(cause.name, rival, sessions)
    no_name = -2.0 * math.log(thresholds.false_name)  # less tells nothing apart
    if most < no_name:
        instead = f"log the {channel} too" if channel else "use either, both predict the same reading"
        says = f"no load history that a machine can run tells {both} apart: {instead}"
        return NextExperiment(names, None, channel, says, most)
    telling = {
        name: EXPERIMENTS[name](peak_n) for name, by in expected.items() if by > max(margin, most / thresholds.clear)
    }
    if not telling:
        instead = f"log the {channel} too" if channel else f"{in_words(cause.name)} follows better"
        says = (
            f"none of the {len(expected)} protocols is expected to tell {both} apart better than this data already"
            f" does: {instead}"
        )
        return NextExperiment(names, None, channel, says, most)
    chosen = min(telling, key=lambda name: telling[name].duration_s)
    better = "which this data does not"
    if margin > no_name:
        times = expected[chosen] / margin
        better = f"{times:.2g} times as well as this data does"
        if times < 1.0 + thresholds.same:
            better = "little better than this data does"
        elif times > thresholds.extrapolates:
            better = "far better than this data does"
    says = f"run the protocol {in_words(chosen)}: it should tell {both} apart, {better}"
    return NextExperiment(names, chosen, channel, says, expected[chosen], telling[chosen])


def _again(found: Inference) -> str:
    """What to record once more where gains differ, or where they or zeros change."""
    for what, changes in (("gain", changes_of(found.own_gains)), ("zero", found.zero_changes)):
        if changes:
            return (
                f"record {changes[0].recording} again, and watch unit, cable and logger at"
                f" {moment(changes[0].begins_s, 4)} s: whether the {what} changes there each time"
            )
    return (
        "record one of these again twice, once without moving the unit and once after taking it out and putting it"
        " back: whether the gain is the mounting's, and how far that moves it"
    )


def _in_place_of(found: Inference, name: str, rival: str) -> Fit:
    """The fit with ``rival`` in the place of an effect."""
    less = found.fit.model.without(name)
    return fit(found.fit.likelihood, begun_with(effect(rival), less, found.fit.likelihood))


def _pair(causes: Sequence[Cause]) -> tuple[str, ...]:
    """The largest cause that has equivalents with these, else the largest with its nearest rival; () where none has."""
    others = [(cause, cause.equivalents) for cause in causes]
    others += [(cause, tuple(rival.effect for rival in cause.rivals[:1])) for cause in causes]
    return next(((cause.name, *names) for cause, names in others if names), ())


def _unseen(found: Inference, names: tuple[str, ...], excitation: Excitation) -> NextExperiment:
    """The first protocol that holds what this data lacks; the same again where it lacks nothing."""
    peak_n = found.fit.model.full_scale_load_n
    for word, protocol in SHOWN_BY.items():
        if word not in excitation.present:
            says = f"run the protocol {in_words(protocol)}: this data lacks {SAYS[word]}, by which kinds differ"
            return NextExperiment(names, protocol, None, says, None, EXPERIMENTS[protocol](peak_n))
    says = "run the same protocol again, twice: what repeats in all three is the unit's, what does not is the session's"
    return NextExperiment(names, "repeat", None, says)


def expected_margin(truth: Fit, rival: Fit, protocol: Protocol, noise_sd: float, like: Session) -> float:
    """By how much -2 log likelihood would be worse with the rival, were ``truth`` true and the protocol run once.

    The rival may move its parameters as far as the data so far lets it: min over d of |yA - yB - J d|^2 + d' H d in
    standard deviations of the noise, H the information that it was fitted with.
    """
    step_s = like.conditions.step_s
    time_s = np.arange(0.0, protocol.duration_s, step_s)
    full_n = truth.model.full_scale_load_n
    conditions = Conditions(time_s, protocol.load_at(time_s) / full_n, step_s, like.conditions.load_noise)
    reading, slopes = rival.model.sensitivities(conditions)
    difference = (truth.model.simulate(conditions) - reading) / noise_sd
    J = slopes / noise_sd
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
    columns = set.intersection(*({*one.recording.channels} for one in sessions))
    lacking = (told_apart_by(effect(name), effect(rival)) & CHANNELS) - logged_channels(sessions) - columns
    return in_words(min(lacking)) if lacking else None
