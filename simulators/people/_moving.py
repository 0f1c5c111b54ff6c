"""From activities to contacts: heel strikes, stances and the load of each, such that momentum balances.

The contacts alternate. Each carries body weight for its own time, half of the time between its neighbours' heel
strikes; if one stance takes too much, the next ones take less. So the mean total vertical force over whole strides is
body weight, as it must be for a body that neither rises nor sinks in the long run.

*Left out:* correlation of stride times over many strides, fatigue, stumbling, kerbs and stairs.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from simulators.people._stances import LARGEST_WARP, Stances, mean_heights, mean_load
from simulators.people.person import Move, Person, Run
from simulators.people.shape import COLUMNS, Outside, table
from smartshoe.arrays import Array, Index
from smartshoe.recording import REGIONS

PHASE_SD = {"walk": 0.020, "run": 0.030}  # sd of the time shift of a region's load, as a share of stance
STANCE_OF_STRIDE_CV = 0.3  # variation of stance independent of the stride, over the stride time's variation
TURN_LEAN = 0.35  # share of a metatarsal's load that a tight turn moves to the other one
TURN_TIME = 0.10  # by this share the inner foot's stance is longer in a tight turn
SHORTEST_BOTH = 0.02  # of a stride: least double support or flight


@dataclass(frozen=True, eq=False)
class Steps:
    """Contacts of both feet in order of time: all (m,).

    ``foot`` is 0 left, 1 right, ``move`` the index of the activity.
    """

    strike_s: Array
    foot: Index
    move: Index
    stance_s: Array


def steps(
    person: Person,
    moves: Sequence[tuple[Move, float, float]],
    first_foot: int,
    rng: np.random.Generator,
) -> Steps:
    """Heel strikes and stances of ``moves`` (move, begin and end in s), one after another without a stop."""
    strikes: list[Array] = []
    feet: list[Index] = []
    owners: list[Index] = []
    now, foot = moves[0][1], first_foot
    for number, (move, _, end_s) in enumerate(moves):
        stride_s = 120.0 / move.cadence(person)
        count = max(int(1.3 * (end_s - now) / (0.5 * stride_s)) + 12, 2)
        side = (foot + np.arange(count)) % 2
        # With a longer right stance the step from left to right is shorter, which keeps double supports equal.
        lean = 0.5 * move.resolved_stance_share * (person.time_asymmetry + TURN_TIME * -move.turning)
        mean_s = stride_s * np.where(side == 0, 0.5 - lean, 0.5 + lean)
        noise_s = stride_s * move.resolved_stride_time_cv / np.sqrt(2.0) * rng.standard_normal(count)
        gaps_s = np.maximum(mean_s + noise_s, 0.5 * mean_s)
        at_s = now + np.concatenate([[0.0], np.cumsum(gaps_s)])
        within = int(np.searchsorted(at_s[:-1], end_s))
        strikes.append(at_s[:within])
        feet.append(side[:within])
        owners.append(np.full(within, number))
        now, foot = float(at_s[within]), int((foot + within) % 2)
    strike_s, side, owner = np.concatenate(strikes), np.concatenate(feet), np.concatenate(owners)
    return Steps(strike_s, side, owner, _stance_s(person, [m for m, _, _ in moves], strike_s, side, owner, rng))


def _stance_s(
    person: Person, moves: Sequence[Move], strike_s: Array, side: Index, owner: Index, rng: np.random.Generator
) -> Array:
    own_s = np.array([120.0 / move.cadence(person) for move in moves])[owner]
    share = np.array([move.resolved_stance_share for move in moves])[owner]
    cv = np.array([move.resolved_stride_time_cv for move in moves])[owner]
    turning = np.array([move.turning for move in moves])[owner]
    runs = np.array([isinstance(move, Run) for move in moves])[owner]
    # A contact's duration scales with its own time, so that a late step makes it longer rather than harder.
    stride_s = 2.0 * _own_time_s(strike_s) if strike_s.size > 1 else own_s
    sign = np.where(side == 1, 1.0, -1.0)
    share = share * (1.0 + 0.5 * sign * (person.time_asymmetry - TURN_TIME * turning))
    stance_s = stride_s * share * (1.0 + STANCE_OF_STRIDE_CV * cv * rng.standard_normal(side.size))
    # The other foot must have landed before this one lifts (walking), or must not have landed yet (running).
    other_s = 0.5 * own_s
    other_s[:-1] = np.diff(strike_s)
    least = np.where(runs, 0.1 * stride_s, other_s + SHORTEST_BOTH * stride_s)
    most = np.where(runs, other_s - SHORTEST_BOTH * stride_s, stride_s * (1.0 - SHORTEST_BOTH))
    return np.asarray(np.clip(stance_s, least, np.maximum(most, least)))


def contacts(
    person: Person,
    moves: Sequence[Move],
    made: Steps,
    coverage: float,
    outside: Outside,
    rng: np.random.Generator,
) -> tuple[Stances, Stances]:
    """The contacts of the left and the right foot for the steps, with loads in N."""
    tables: list[Array] = []
    rows = np.empty((len(moves), 2), dtype=np.intp)
    for number, move in enumerate(moves):
        for foot, inwards in enumerate((-1.0, 1.0)):
            rows[number, foot] = len(tables)
            kind = "run" if isinstance(move, Run) else "walk"
            # Turning left, the body leans left: onto the left foot's outer and the right foot's inner edge.
            tables.append(table(kind, move.speed_m_per_s, coverage, outside, TURN_LEAN * move.turning * inwards))
    kind_of = rows[made.move, made.foot]
    count = made.strike_s.size
    load_cv = np.array([move.resolved_load_cv for move in moves])[made.move]
    height = np.maximum(1.0 + load_cv[:, None] * rng.standard_normal((count, len(COLUMNS))), 0.3)
    phase_sd = np.array([PHASE_SD["run" if isinstance(move, Run) else "walk"] for move in moves])[made.move]
    warp = np.clip(phase_sd[:, None] * rng.standard_normal((count, len(COLUMNS))), -LARGEST_WARP, LARGEST_WARP)
    warp[:, REGIONS.index("heel")] = 0.0
    means = mean_load(mean_heights(tables), kind_of, height, warp)
    impulse = person.body_weight_n * _own_time_s(made.strike_s) * _shared(person, made, load_cv, rng)
    amplitude = impulse / (made.stance_s * means)
    left, right = (
        Stances(
            made.strike_s[of], made.stance_s[of], amplitude[of], kind_of[of], height[of], warp[of], np.array(tables),
            np.zeros((int(of.sum()), 2)), np.zeros(int(of.sum())),
        )
        for of in (made.foot == 0, made.foot == 1)
    )  # fmt: skip
    return left, right


def _own_time_s(strike_s: Array) -> Array:
    """Half of the time (m,) in s between the heel strikes before and after each; together they cover the whole time."""
    if strike_s.size == 1:
        return np.full(1, 0.5)
    gap_s = np.diff(strike_s)
    return np.asarray(0.5 * (np.concatenate([gap_s[:1], gap_s]) + np.concatenate([gap_s, gap_s[-1:]])))


def _shared(person: Person, made: Steps, load_cv: Array, rng: np.random.Generator) -> Array:
    """Each contact's load (m,) relative to its due share: the person's asymmetry, and noise that later ones balance."""
    noise = 0.5 * load_cv * rng.standard_normal(load_cv.size)
    given = noise - np.concatenate([[0.0], noise[:-1]])
    return np.asarray((1.0 + 0.5 * person.load_asymmetry * np.where(made.foot == 1, 1.0, -1.0)) * (1.0 + given))
