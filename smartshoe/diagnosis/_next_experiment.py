"""The experiment that would separate what this data cannot: which one, and by how much."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from smartshoe.diagnosis._contest import Contest
from smartshoe.diagnosis._excitation import Excitation
from smartshoe.diagnosis._experiments import EXPERIMENTS, paced
from smartshoe.diagnosis._gains_and_zeros import changes_of, time_of
from smartshoe.diagnosis._inference import Inference
from smartshoe.diagnosis._likelihood import Fit, fit
from smartshoe.diagnosis._members import begun_with
from smartshoe.diagnosis._ranges import rounded
from smartshoe.diagnosis._result import Cause, NextExperiment
from smartshoe.diagnosis._sensitivity import logged_words
from smartshoe.diagnosis._session import Session
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
    """What to do next, where anything is open.

    For the largest doubtful cause that any protocol tells from its nearest equivalent: the shortest such, a channel.

    Before all else, where the extension is ``worse`` on what is held out: such loads among those that are fitted.
    Where neither parts any, but recordings have gains of their own, one of them again. Where they have not, and
    something is left (``open_``), or a name is not sure, what this data never showed; else what tells a zero that is
    seen from a tare, or that either may be used of what is in doubt, None where nothing is. Where a single load cycle
    tells no cause, more of them.
    """
    pair = _pair(causes)
    if worse:
        held = ", ".join(dict.fromkeys(one.recording.name for one in sessions if one.judged.any()))
        says = f"record what {held} holds once more, and fit it too: the extended model does not hold for its loads"
        return NextExperiment(pair, "repeat", None, says)
    doubtful = [cause for cause in causes if cause.equivalents and cause.part is not None]
    told: list[NextExperiment] = []
    for cause in sorted(doubtful, key=lambda one: -one.size):
        told.append(_told_apart(found, cause, sessions, excitation.thresholds))
        if told[-1].protocol:
            return _with_its_loads(told[-1], sessions, excitation.thresholds)
    if by_channel := [one for one in told if one.channel]:
        return by_channel[0]
    if found.own_gains or found.zero_changes:
        return NextExperiment(pair, "repeat", None, _again(found))
    if not found.can_validate:
        says = (
            "repeat the load cycle, several times in one recording or in a second one: of a single one nothing can be"
            " held against another, so that no cause can be told"
        )
        return NextExperiment(pair, "repeat", None, says)
    least = excitation.thresholds.least_confidence
    zeros = [cause for cause in causes if cause.equivalents and cause.part is None]
    is_unsure = any(cause.confidence < least for cause in causes)
    if open_ or is_unsure or not all(effect(one.name).exposed_by <= excitation.present for one in zeros):
        unseen = _unseen(found, pair, excitation, _least_step_s(sessions))
        return _with_its_loads(unseen, sessions, excitation.thresholds)
    by_reference = (_by_reference(zero, sessions) for zero in zeros)
    return next((one for one in by_reference if one is not None), told[0] if told else None)


def _by_reference(zero: Cause, sessions: Sequence[Session]) -> NextExperiment | None:
    """What tells a zero that a rest shows from its equivalent, as the catalogue has it: no load does."""
    word = _channel(zero.name, zero.equivalents[0], sessions)
    if word is None:
        return None
    says = f"no load tells {in_words(zero.name)} from {in_words(zero.equivalents[0])}: what does is {SAYS[word]}"
    return NextExperiment((zero.name, *zero.equivalents), None, in_words(word), says)


def _with_its_loads(told: NextExperiment, sessions: Sequence[Session], thresholds: Thresholds) -> NextExperiment:
    """Also how high and how fast its protocol loads, and what it asks of a machine that was seen doing less."""
    if told.steps is None:
        return told
    rate, recorded = told.steps.peak_rate_n_per_s, max(_fastest_n_per_s(one.recording) for one in sessions)
    asks = f"it loads to {rounded(told.steps.peak_load_n)} N at up to {rounded(rate)} N/s"
    if rate > (1.0 + thresholds.same) * recorded:
        asks += (
            f", faster than anything recorded (up to {rounded(recorded)} N/s): if the machine cannot, let its fast"
            " ramps take longer, and expect it to tell less"
        )
    return replace(told, says=f"{told.says}; {asks}")


def _fastest_n_per_s(recording: Recording) -> float:
    """How fast a load was put on or taken off: over whole ramps, or by most of the way where they are in steps."""
    time_s, load_n = recording.time_s, recording.force_n
    by_way = (rate_range([(time_s, sign * load_n)])[1] for sign in (1.0, -1.0))
    return max([*by_way, *(abs(one.rate_n_per_s) for one in ramps(time_s, load_n))])


def _told_apart(found: Inference, cause: Cause, sessions: Sequence[Session], thresholds: Thresholds) -> NextExperiment:
    """The shortest protocol that rules a cause's nearest equivalent out, or tells clearly more than this data.

    Of those that this data does not hold already, each as slow as its logger asks for, of which that takes enough
    samples to tell anything. Where none rules it out, the channel that would, if there is one. What is foretold is a
    unit of the cause: of another one nothing is said.
    """
    rival = cause.equivalents[0]
    now = _contest(found, cause, rival)
    peak_n, least_s = found.fit.model.full_scale_load_n, _least_step_s(sessions)
    made = [paced(make(peak_n), least_s, thresholds) for make in EXPERIMENTS.values()]
    made = [one for one in made if one.duration_s > (thresholds.least_samples - 1) * least_s]
    held = now.cause.likelihood.sessions
    left = [one for one in made if not any(_is_of(one, session, peak_n, thresholds.same) for session in held)]
    no_name = -2.0 * math.log(thresholds.false_name)  # less tells nothing apart
    of_use = min(thresholds.clear * now.log_odds, _ruled_out_at(thresholds))
    foretold: list[tuple[Protocol, Contest]] = []
    for protocol in sorted(left, key=lambda one: one.duration_s):
        then = now.after(protocol, least_s, no_name, of_use)
        if then is not None:
            foretold.append((protocol, then))
            if _rules_out(then, thresholds):
                break
    names, both = (cause.name, *cause.equivalents), listed((cause.name, rival), "and")
    no_use = f"if it is {in_words(cause.name)}, no protocol is expected to rule out {in_words(rival)}"
    chosen, word = _most_telling(now, foretold, thresholds), _channel(cause.name, rival, sessions)
    channel = None if word is None else in_words(word)
    if chosen is None or (word is not None and not _rules_out(chosen[1], thresholds)):
        most = max((then.margin - now.margin for _, then in foretold), default=0.0)
        lost = [name for name in (cause.name, rival) if effect(name).why_not_undone]
        instead = "use either for loads like those recorded, under which they read too nearly alike"
        if len(lost) == 1:
            why = effect(lost[0]).why_not_undone
            stays = f"the {in_words(lost[0])} stays in the force, since {why}"
            instead = f"under loads like those recorded they read too nearly alike, but {stays}"
        if word is not None:
            instead = f"what would is {SAYS[word]}"
        says = f"{no_use}: {instead}"
        return NextExperiment(names, None, channel, says, most)
    protocol, then = chosen
    says = f"run the protocol {in_words(protocol.name)}: it should tell {both} apart, which this data does not"
    if not _rules_out(then, thresholds):
        says = (
            f"run the protocol {in_words(protocol.name)}: it should tell more of {both} than this data does, though,"
            f" {no_use}"
        )
    return NextExperiment(names, protocol.name, channel, says, then.margin - now.margin, protocol)


def _least_step_s(sessions: Sequence[Session]) -> float:
    """The time from sample to sample of the recording that was logged most quickly."""
    return min(one.recording.sample_time_s for one in sessions)


def _rules_out(contest: Contest, thresholds: Thresholds) -> bool:
    """Whether the rival would be no equivalent any more."""
    return contest.log_odds >= _ruled_out_at(thresholds)


def _ruled_out_at(thresholds: Thresholds) -> float:
    """The log odds from which on a rival is no equivalent."""
    return -math.log(thresholds.equivalent_odds)


def _most_telling(
    now: Contest, foretold: Sequence[tuple[Protocol, Contest]], thresholds: Thresholds
) -> tuple[Protocol, Contest] | None:
    """Of what is ``foretold``, shortest first, the last, if it ends the doubt; else what tells clearly more than now.

    Of several that tell about as much as the best the shortest.
    """
    if foretold and _rules_out(foretold[-1][1], thresholds):
        return foretold[-1]
    most = max((then.log_odds for _, then in foretold), default=0.0)
    least = max(thresholds.clear * now.log_odds, most / thresholds.clear)
    return next((one for one in foretold if one[1].log_odds > least), None)


def _is_of(protocol: Protocol, session: Session, peak_n: float, same: float) -> bool:
    """Whether a recording is of this protocol, but for its end, and for how exactly a machine follows and is logged."""
    time_s = session.conditions.time_s
    asked = protocol.load_at(time_s) / peak_n
    off = float(np.std(session.conditions.load - asked))
    return time_s[-1] > (1.0 - same) * protocol.duration_s and off < same * float(np.std(asked))


def _contest(found: Inference, cause: Cause, rival: str) -> Contest:
    """A cause and its rival as they were fitted, or, of those that were not, as they are fitted now.

    Beside both what is a drift is held alike: they are told apart by loads that last for longer.
    """
    (member,) = (one for one in found.members if one.name == cause.part)
    fits = {one.effect: one.fit for one in (*member.laws, *member.untold)}

    def fitted(name: str) -> Fit:
        if name == member.name:
            return found.fit
        one = fits.get(name) or _in_place_of(found, member.name, name)
        return replace(one, model=one.model.held_as(found.fit.model))

    return Contest(fitted(cause.name), fitted(rival), member.without).settled()


def _again(found: Inference) -> str:
    """What to record once more where gains differ, or where they or zeros change."""
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
    return fit(found.fit.likelihood, begun_with(effect(rival), less, found.fit.likelihood))


def _pair(causes: Sequence[Cause]) -> tuple[str, ...]:
    """The largest cause that has equivalents with these, else the largest with its nearest rival; () where none has."""
    others = [(cause, cause.equivalents) for cause in causes]
    others += [(cause, tuple(rival.effect for rival in cause.rivals[:1])) for cause in causes]
    return next(((cause.name, *names) for cause, names in others if names), ())


def _unseen(found: Inference, names: tuple[str, ...], excitation: Excitation, sample_time_s: float) -> NextExperiment:
    """The first protocol that holds what this data lacks; the same again where it lacks nothing.

    Before all others what would tell the first of ``names`` from the rest, as the catalogue has it.
    """
    peak_n = found.fit.model.full_scale_load_n
    telling = {word for rival in names[1:] for word in told_apart_by(effect(names[0]), effect(rival))}
    lacking = [word for word in SHOWN_BY if word not in excitation.present]
    lacking.sort(key=lambda word: word not in telling)
    if excitation.goes_with_the_clock:  # which by itself leaves every cause half sure
        lacking.sort(key=lambda word: word != "shuffled_loads")
    if lacking:
        name = SHOWN_BY[lacking[0]]
        says = f"run the protocol {in_words(name)}: this data lacks {SAYS[lacking[0]]}, by which kinds differ"
        steps = paced(EXPERIMENTS[name](peak_n), sample_time_s, excitation.thresholds)
        return NextExperiment(names, name, None, says, None, steps)
    says = "run the same protocol again, twice: what repeats in all three is the unit's, what does not is the session's"
    return NextExperiment(names, "repeat", None, says)


def _channel(name: str, rival: str, sessions: Sequence[Session]) -> Exposure | None:
    """The channel that the catalogue says would tell them apart, if it was not logged already."""
    lacking = (told_apart_by(effect(name), effect(rival)) & CHANNELS) - logged_words(sessions)
    return min(lacking, default=None)
