"""The experiment that would separate what this data cannot: which one, and by how much."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np

from smartshoe.diagnosis._contest import Contest, Predict, predicted_session
from smartshoe.diagnosis._excitation import Excitation
from smartshoe.diagnosis._experiments import EXPERIMENTS, paced
from smartshoe.diagnosis._gains_and_zeros import changes_of, time_of
from smartshoe.diagnosis._inference import Inference
from smartshoe.diagnosis._likelihood import Fit, fit
from smartshoe.diagnosis._members import start_with
from smartshoe.diagnosis._result import Cause, NextExperiment
from smartshoe.diagnosis._sensitivity import logged_words
from smartshoe.diagnosis._session import Session
from smartshoe.display import rounded
from smartshoe.integrity.thresholds import Thresholds
from smartshoe.models.effects import effect, in_words, listed, told_apart_by
from smartshoe.models.effects.exposure import CHANNELS, SAYS, Exposure
from smartshoe.protocol import Protocol
from smartshoe.recording import Recording
from smartshoe.signals.loading import ramps, rate_range

SHOWN_BY: dict[Exposure, str] = {
    "rates": "rates",
    "holds": "holds_at_several_loads",
    "rests": "idle",
    "minor_loops": "minor_loops",
    "shuffled_loads": "shuffled_loads",
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
    """The next experiment, or None where nothing is open.

    It is the first of these that applies:

    * the extension is ``worse`` on held-out data: record such loads again, and fit them;
    * the largest doubtful cause that a protocol separates from its nearest equivalent: the shortest such protocol;
    * such a cause that a channel would separate: log that channel;
    * recordings have own gains, or zeros that jump: repeat one of them;
    * a single load cycle shows no cause: record more cycles;
    * structure is left (``open_``), or a name is unsure: the protocol that shows what this data lacks;
    * a zero that a rest shows may be a tare: a reference that distinguishes them;
    * else that no protocol separates the rivals, where there are any.
    """
    pair = _pair(causes)
    if worse:
        held = ", ".join(dict.fromkeys(one.recording.name for one in sessions if one.judged.any()))
        says = f"record loads like those of {held} again, and fit them too: the extended model does not hold for them"
        return NextExperiment(pair, "repeat", None, says)
    doubtful = [cause for cause in causes if cause.equivalents and cause.part is not None]
    proposed: list[NextExperiment] = []
    predict = lru_cache(maxsize=len(EXPERIMENTS))(predicted_session)  # each doubtful cause asks for the same ones
    for cause in sorted(doubtful, key=lambda one: -one.size):
        proposed.append(_separating_experiment(found, cause, sessions, excitation.thresholds, predict))
        if proposed[-1].protocol:
            return _with_its_loads(proposed[-1], sessions, excitation.thresholds)
    if by_channel := [one for one in proposed if one.channel]:
        return by_channel[0]
    if found.own_gains or found.zero_changes:
        return NextExperiment(pair, "repeat", None, _what_to_repeat(found))
    if not found.can_validate:
        says = (
            "repeat the load cycle, several times in one recording or in a second one: a single cycle cannot be checked"
            " against another, so that no cause can be told"
        )
        return NextExperiment(pair, "repeat", None, says)
    least = excitation.thresholds.least_confidence
    zeros = [cause for cause in causes if cause.equivalents and cause.part is None]
    is_unsure = any(cause.confidence < least for cause in causes)
    if open_ or is_unsure or not all(effect(one.name).exposed_by <= excitation.present for one in zeros):
        unseen = _protocol_for_missing_excitation(found, pair, excitation, _least_step_s(sessions))
        return _with_its_loads(unseen, sessions, excitation.thresholds)
    by_reference = (_by_reference(zero, sessions) for zero in zeros)
    return next((one for one in by_reference if one is not None), proposed[0] if proposed else None)


def _by_reference(zero: Cause, sessions: Sequence[Session]) -> NextExperiment | None:
    """The reference that distinguishes a zero from its equivalent, where the catalogue has one; no load does."""
    word = _channel(zero.name, zero.equivalents[0], sessions)
    if word is None:
        return None
    says = f"no load tells {in_words(zero.name)} from {in_words(zero.equivalents[0])}: what does is {SAYS[word]}"
    return NextExperiment((zero.name, *zero.equivalents), None, in_words(word), says)


def _with_its_loads(proposed: NextExperiment, sessions: Sequence[Session], thresholds: Thresholds) -> NextExperiment:
    """``proposed`` with its protocol's highest load and fastest rate, and whether these exceed the recorded ones."""
    if proposed.steps is None:
        return proposed
    rate, recorded = proposed.steps.peak_rate_n_per_s, max(_fastest_n_per_s(one.recording) for one in sessions)
    asks = f"it loads to {rounded(proposed.steps.peak_load_n, 3)} N at up to {rounded(rate, 3)} N/s"
    if rate > (1.0 + thresholds.same) * recorded:
        asks += (
            f", faster than anything recorded (up to {rounded(recorded, 3)} N/s): if the machine cannot, let its fast"
            " ramps take longer, and expect it to tell less"
        )
    return replace(proposed, says=f"{proposed.says}; {asks}")


def _fastest_n_per_s(recording: Recording) -> float:
    """The fastest rate of the load in N/s: over whole ramps, or over most of the way where it goes in steps."""
    time_s, load_n = recording.time_s, recording.force_n
    by_way = (rate_range([(time_s, sign * load_n)])[1] for sign in (1.0, -1.0))
    return max([*by_way, *(abs(one.rate_n_per_s) for one in ramps(time_s, load_n))])


def _separating_experiment(
    found: Inference, cause: Cause, sessions: Sequence[Session], thresholds: Thresholds, predict: Predict
) -> NextExperiment:
    """The shortest protocol that rules a cause's nearest equivalent out, or tells clearly more than this data.

    Protocols that this data already holds are left out, and each is as slow as the logger needs. If none rules the
    rival out, the channel that would, if there is one. The predictions are for a unit that has the cause.
    """
    rival = cause.equivalents[0]
    now = _contest(found, cause, rival)
    peak_n, least_s = found.fit.model.full_scale_load_n, _least_step_s(sessions)
    made = [paced(make(peak_n), least_s, thresholds) for make in EXPERIMENTS.values()]
    made = [one for one in made if one.duration_s > (thresholds.least_samples - 1) * least_s]
    held = now.cause.likelihood.sessions
    left = [one for one in made if not any(_is_run_of(one, session, peak_n, thresholds.same) for session in held)]
    no_name = -2.0 * math.log(thresholds.false_name)  # a smaller gain separates nothing
    min_log_odds = min(thresholds.clear * now.log_odds, _ruled_out_at(thresholds))
    predicted: list[tuple[Protocol, Contest]] = []
    for protocol in sorted(left, key=lambda one: one.duration_s):
        then = now.after_experiment(protocol, least_s, no_name, min_log_odds, predict)
        if then is not None:
            predicted.append((protocol, then))
            if _rules_out(then, thresholds):
                break
    names, both = (cause.name, *cause.equivalents), listed((cause.name, rival), "and")
    no_use = f"if it is {in_words(cause.name)}, no protocol is expected to rule out {in_words(rival)}"
    chosen, word = _most_telling(now, predicted, thresholds), _channel(cause.name, rival, sessions)
    channel = None if word is None else in_words(word)
    if chosen is None or (word is not None and not _rules_out(chosen[1], thresholds)):
        most = max((then.margin - now.margin for _, then in predicted), default=0.0)
        fits = ((cause.name, now.cause), (rival, now.rival))
        lost = [name for name, one in fits if _is_never_undone(name, one, least_s)]
        instead = "use either for loads like those recorded, under which they read too nearly alike"
        if len(lost) == 1:
            why = effect(lost[0]).why_not_undone
            stays_still = f"the {in_words(lost[0])} stays in the force, since {why}"
            instead = f"under loads like those recorded they read too nearly alike, but {stays_still}"
        if word is not None:
            instead = f"what would is {SAYS[word]}"
        says = f"{no_use}: {instead}"
        return NextExperiment(names, None, channel, says, most)
    protocol, then = chosen
    says = f"run the protocol {in_words(protocol.name)}: it should tell {both} apart, which this data does not"
    if not _rules_out(then, thresholds):
        says = (
            f"run the protocol {in_words(protocol.name)}: it should tell more about {both} than this data does, though,"
            f" {no_use}"
        )
    return NextExperiment(names, protocol.name, channel, says, then.margin - now.margin, protocol)


def _is_never_undone(name: str, fitted: Fit, step_s: float) -> bool:
    """Whether an effect has no inverse on a stream at the values of a fit."""
    if not effect(name).why_not_undone:
        return False
    return effect(name).inverse(fitted.model.part(name).values, step_s) is None


def _least_step_s(sessions: Sequence[Session]) -> float:
    """The sampling interval of the most quickly logged recording."""
    return min(one.recording.sample_time_s for one in sessions)


def _rules_out(contest: Contest, thresholds: Thresholds) -> bool:
    """Whether the rival would no longer be an equivalent."""
    return contest.log_odds >= _ruled_out_at(thresholds)


def _ruled_out_at(thresholds: Thresholds) -> float:
    """The log odds from which a rival is no equivalent."""
    return -math.log(thresholds.equivalent_odds)


def _most_telling(
    now: Contest, predicted: Sequence[tuple[Protocol, Contest]], thresholds: Thresholds
) -> tuple[Protocol, Contest] | None:
    """Of the ``predicted`` contests, shortest protocol first, the last if it rules the rival out.

    Else the shortest that tells clearly more than now and about as much as the best, or None.
    """
    if predicted and _rules_out(predicted[-1][1], thresholds):
        return predicted[-1]
    most = max((then.log_odds for _, then in predicted), default=0.0)
    least = max(thresholds.clear * now.log_odds, most / thresholds.clear)
    return next((one for one in predicted if one[1].log_odds > least), None)


def _is_run_of(protocol: Protocol, session: Session, peak_n: float, same: float) -> bool:
    """Whether a recording is a run of this protocol, within the accuracy of a machine and except for its end."""
    time_s = session.conditions.time_s
    asked = protocol.load_at(time_s) / peak_n
    off = float(np.std(session.conditions.load - asked))
    return time_s[-1] > (1.0 - same) * protocol.duration_s and off < same * float(np.std(asked))


def _contest(found: Inference, cause: Cause, rival: str) -> Contest:
    """A cause and its rival as they were fitted, or fitted now if they were not.

    Drifts are held alike in both: only loads that last longer distinguish them.
    """
    (member,) = (one for one in found.members if one.name == cause.part)
    fits = {one.effect: one.fit for one in (*member.laws, *member.confounded)}

    def fitted(name: str) -> Fit:
        if name == member.name:
            return found.fit
        one = fits.get(name) or _in_place_of(found, member.name, name)
        return replace(one, model=one.model.held_as(found.fit.model))

    return Contest(fitted(cause.name), fitted(rival), member.without).refitted()


def _what_to_repeat(found: Inference) -> str:
    """What to record again where gains differ, or where they or zeros change."""
    for what, changes in (("gain", changes_of(found.own_gains)), ("zero", found.zero_changes)):
        if changes:
            return (
                f"record {changes[0].recording} again, and watch unit, cable and logger {time_of(changes[0])}: whether"
                f" the {what} changes there each time"
            )
    return (
        "record one of these again twice, once without moving the unit and once after taking it out and putting it"
        " back: whether the gain is the mounting's, and how far that moves it"
    )


def _in_place_of(found: Inference, name: str, rival: str) -> Fit:
    """The fit with ``rival`` in the place of an effect."""
    less = found.fit.model.without(name)
    return fit(found.fit.likelihood, start_with(effect(rival), less, found.fit.likelihood))


def _pair(causes: Sequence[Cause]) -> tuple[str, ...]:
    """The largest cause with its equivalents, else the largest with its nearest rival; empty without either."""
    others = [(cause, cause.equivalents) for cause in causes]
    others += [(cause, tuple(rival.effect for rival in cause.rivals[:1])) for cause in causes]
    return next(((cause.name, *names) for cause, names in others if names), ())


def _protocol_for_missing_excitation(
    found: Inference, names: tuple[str, ...], excitation: Excitation, sample_time_s: float
) -> NextExperiment:
    """The first protocol that shows what this data lacks, or a repetition where it lacks nothing.

    What would separate the first of ``names`` from the others, by the catalogue, comes first.
    """
    peak_n = found.fit.model.full_scale_load_n
    telling = {word for rival in names[1:] for word in told_apart_by(effect(names[0]), effect(rival))}
    lacking = [word for word in SHOWN_BY if word not in excitation.present]
    lacking.sort(key=lambda word: word not in telling)
    if excitation.goes_with_the_clock:  # which alone leaves every cause half sure
        lacking.sort(key=lambda word: word != "shuffled_loads")
    if lacking:
        name = SHOWN_BY[lacking[0]]
        says = (
            f"run the protocol {in_words(name)}: this data lacks {SAYS[lacking[0]]}, which tell kinds of effects apart"
        )
        steps = paced(EXPERIMENTS[name](peak_n), sample_time_s, excitation.thresholds)
        return NextExperiment(names, name, None, says, None, steps)
    says = "run the same protocol again, twice: what repeats in all three is the unit's, what does not is the session's"
    return NextExperiment(names, "repeat", None, says)


def _channel(name: str, rival: str, sessions: Sequence[Session]) -> Exposure | None:
    """The channel that would separate the two, by the catalogue, if it is not logged already."""
    lacking = (told_apart_by(effect(name), effect(rival)) & CHANNELS) - logged_words(sessions)
    return min(lacking, default=None)
