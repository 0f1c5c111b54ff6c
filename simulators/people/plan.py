"""A trial's plan: every contact and every stay of a sequence of activities, drawn once, then evaluated at any times.

The loads at a time depend on the plan alone, so that a day can be evaluated block by block and a fine grid agrees with
a coarse one. A walk that begins from standing unloads the first foot while the other takes over; at its end the
swinging foot lands beside the other.

*Left out:* balance of momentum in the half second of starting and stopping (within some 20 % of body weight).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import groupby

import numpy as np

from simulators.people._moving import contacts, steps
from simulators.people._stances import Stances
from simulators.people._standing import Lift, StandingStay, Sway
from simulators.people.person import Activity, Move, Part, Person, Stand, Tiptoe
from simulators.people.shape import COLUMNS, COVERAGE, Outside
from smartshoe.arrays import Array
from smartshoe.errors import UsageError

FEET = ("left", "right")
STEP_ON_S = 0.5
STEP_ON_APART_S = 0.3
UNLOAD_S = 0.35  # duration of unloading the first foot when a walk begins
FIRST_SWING_S = 0.42
LATE_BEGIN_S, LATE_END_S = 0.10, 0.45  # how much longer a stance from or to standing lasts


@dataclass(frozen=True, eq=False)
class GaitPlan:
    """What both feet do over ``duration_s``: chains of contacts, (left, right) each, and stays on both feet."""

    person: Person
    duration_s: float
    chains: tuple[tuple[Stances, Stances], ...]
    stays: tuple[StandingStay, ...]

    def loads_n(self, time_s: Array) -> Array:
        """True loads (n, 2, 5) in N at the increasing times (n,): left and right, columns as in `COLUMNS`."""
        loads = np.zeros((time_s.size, 2, len(COLUMNS)))
        for stay in self.stays:
            loads += stay.loads_n(time_s)
        for chain in self.chains:
            for foot, stances in enumerate(chain):
                end_s = stances.begin_s[-1] + stances.duration_s[-1] if stances.begin_s.size else -np.inf
                if time_s.size and end_s > time_s[0] and stances.begin_s[0] < time_s[-1]:
                    loads[:, foot] += stances.loads_n(time_s)
        return loads


def parts_of(activity: Activity | Sequence[Part], duration_s: float | None) -> tuple[tuple[Part, ...], float]:
    """A sequence of (activity, seconds), and its total duration in s; raises `UsageError` where that is not defined."""
    if isinstance(activity, Move | Stand | Tiptoe):
        if duration_s is None:
            raise UsageError("duration_s is missing: say how long the trial lasts")
        activity = ((activity, duration_s),)
    parts = tuple(activity)
    if not parts or any(not seconds > 0 for _, seconds in parts):
        raise UsageError("a sequence needs one activity at least, each with a duration above 0 s")
    whole = sum(seconds for _, seconds in parts)
    if duration_s is not None and duration_s > whole + 1e-9:
        # The last activity continues.
        parts = (*parts[:-1], (parts[-1][0], parts[-1][1] + duration_s - whole))
    return parts, whole if duration_s is None else duration_s


def plan(
    person: Person,
    activity: Activity | Sequence[Part],
    duration_s: float | None,
    rng: np.random.Generator,
    *,
    coverage: float = COVERAGE,
    outside: Outside = "midfoot",
    first_contact_s: float = 0.5,
) -> GaitPlan:
    """The plan of a trial that begins in the air and lands at ``first_contact_s``.

    ``activity`` is one activity, or a sequence of (activity, seconds). ``coverage`` is the share of each activity's
    load that passes through the coils. Raises `UsageError` for an impossible duration or coverage.
    """
    if not 0.0 < coverage <= 1.0:
        raise UsageError(f"coverage is {coverage:g}: give the share of the load under the coils, above 0, at most 1")
    parts, whole_s = parts_of(activity, duration_s)
    groups = [(moving, list(some)) for moving, some in groupby(parts, key=lambda part: isinstance(part[0], Move))]
    chains: list[tuple[Stances, Stances]] = []
    stays: list[StandingStay] = []
    never = np.full((2, 2), np.inf)
    comes_s = np.array([[0.0, STEP_ON_S], [STEP_ON_APART_S, STEP_ON_APART_S + STEP_ON_S]]) + first_contact_s
    now = 0.0
    for number, (moving, some) in enumerate(groups):
        end_s = now + sum(seconds for _, seconds in some)
        last = number == len(groups) - 1
        if not moving:
            leaves_s = never if last else np.tile([end_s, end_s + UNLOAD_S], (2, 1))
            stays.append(_stay(person, some, now, comes_s, leaves_s, coverage, rng))
        else:
            begin_s = first_contact_s if number == 0 else now
            chain, comes_s = _chain(person, some, begin_s, number > 0, not last, coverage, outside, rng)
            chains.append(chain)
        now = end_s
    return GaitPlan(person, whole_s, tuple(chains), tuple(stays))


def _stay(
    person: Person,
    parts: Sequence[Part],
    begin_s: float,
    comes_s: Array,
    leaves_s: Array,
    coverage: float,
    rng: np.random.Generator,
) -> StandingStay:
    sways = (Sway.drawn(rng), Sway.drawn(rng))
    lifts: list[Lift] = []
    sway_cv = next((a.sway_cv for a, _ in parts if isinstance(a, Stand)), Stand().sway_cv)
    now = begin_s
    for activity, seconds in parts:
        if isinstance(activity, Tiptoe):
            up_s, down_s = max(now, float(comes_s.max()) + 0.2), now + seconds
            if down_s - up_s < 2.0 * activity.rise_s:
                raise UsageError(
                    f"{seconds:g} s on tiptoe is too short to rise and come down in {activity.rise_s:g} s each:"
                    " give it longer"
                )
            lifts.append(Lift(up_s, down_s, activity.rise_s, activity.sway_cv))
        now += seconds
    return StandingStay(person, coverage, sway_cv, sways, tuple(lifts), comes_s, leaves_s)


def _chain(
    person: Person,
    parts: Sequence[Part],
    begin_s: float,
    from_standing: bool,
    to_standing: bool,
    coverage: float,
    outside: Outside,
    rng: np.random.Generator,
) -> tuple[tuple[Stances, Stances], Array]:
    """The contacts of moves without a stop, and the times (2, 2) at which each foot is down to stand afterwards."""
    moves: list[tuple[Move, float, float]] = []
    now = begin_s
    for activity, seconds in parts:
        if isinstance(activity, Move):
            moves.append((activity, now, now + seconds))
        now += seconds
    only = [move for move, _, _ in moves]
    step_s = [60.0 / move.cadence(person) for move in only]
    end_s = now - step_s[-1] - UNLOAD_S if to_standing else now + 3.0 * step_s[-1]
    moves[-1] = (moves[-1][0], moves[-1][1], end_s)
    if from_standing:
        # The foot that still stands is a contact too: it would have struck one step before the first one.
        first_s = begin_s + UNLOAD_S + FIRST_SWING_S - step_s[0]
        moves[0] = (moves[0][0], first_s, moves[0][2])
    made = steps(person, moves, 1 if from_standing else 0, rng)
    chain = contacts(person, only, made, coverage, outside, rng)
    if from_standing:
        foot = int(made.foot[0])
        chain = _late(chain, foot, 0, begin_s - LATE_BEGIN_S, None, (begin_s, begin_s + UNLOAD_S), 1.0)
    comes_s = np.full((2, 2), np.inf)
    if to_standing:
        last_s, foot = float(made.strike_s[-1]), int(made.foot[-1])
        down_s = last_s + 0.85 * step_s[-1]
        comes_s = np.tile([down_s, down_s + UNLOAD_S], (2, 1))
        chain = _late(chain, foot, -1, None, down_s + LATE_END_S, (down_s, down_s + UNLOAD_S), -1.0)
    return chain, comes_s


def _late(
    chain: tuple[Stances, Stances],
    foot: int,
    at: int,
    begin_s: float | None,
    end_s: float | None,
    fade_s: tuple[float, float],
    fades: float,
) -> tuple[Stances, Stances]:
    """The chain with contact ``at`` of ``foot`` started earlier or ended later, and faded from or to standing."""
    old = chain[foot]
    begin, duration, amplitude = old.begin_s.copy(), old.duration_s.copy(), old.amplitude_n.copy()
    window, kind = old.fade_s.copy(), old.fades.copy()
    stop_s = end_s if end_s is not None else begin[at] + duration[at]
    begin[at] = begin_s if begin_s is not None else begin[at]
    duration[at] = stop_s - begin[at]
    # A longer contact keeps its load rather than its impulse.
    amplitude[at] = np.median(amplitude)
    window[at], kind[at] = fade_s, fades
    new = replace(old, begin_s=begin, duration_s=duration, amplitude_n=amplitude, fade_s=window, fades=kind)
    return (new, chain[1]) if foot == 0 else (chain[0], new)
