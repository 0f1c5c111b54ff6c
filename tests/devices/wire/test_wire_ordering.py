"""Frames in their place: over loss, wraps, pauses, other rates and restarts, whatever the chunks."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from smartshoe.devices.wire._ordering import Ordering, Placed
from smartshoe.devices.wire.counters import Counters

MOST_LOST = 32767


@dataclass
class Device:
    """What a device sends, and what should come of it: (boot, count, clock in us) of each frame given out."""

    count: int
    clock_us: int
    period_us: int = 5000
    boot: int = 0
    sent: list[tuple[int, int]] = field(default_factory=list)
    expected: list[tuple[int, int, int]] = field(default_factory=list)
    lost: int = 0
    duplicated: int = 0

    def run(self, frames: int, jitter: list[int]) -> None:
        for k in range(frames):
            stamp = self.clock_us + (jitter[k % len(jitter)] * self.period_us) // 1000
            if self.expected and self.expected[-1][0] == self.boot:
                stamp = max(stamp, self.expected[-1][2] + 1)  # a clock rises
            self.sent.append((self.count & 0xFFFF, stamp & 0xFFFFFFFF))
            self.expected.append((self.boot, self.count, stamp))
            self._step(1)

    def _step(self, samples: int) -> None:
        self.count += samples
        self.clock_us += samples * self.period_us

    def lose(self, samples: int) -> None:
        self.lost += samples
        self._step(samples)

    def repeat(self, back: int) -> None:
        # Only what came after the device's last change of state is surely among the frames given out.
        self.sent.append(self.sent[-back])
        self.duplicated += 1

    def pause(self, seconds: int) -> None:
        self.clock_us += seconds * 1_000_000

    def restart(self, clock_us: int) -> None:
        self.count, self.clock_us, self.boot = 0, clock_us, self.boot + 1


JITTER = st.lists(st.integers(-200, 200), min_size=1, max_size=7)
EVENT = st.one_of(
    st.tuples(st.just("lose"), st.integers(1, MOST_LOST)),
    st.tuples(st.just("lose"), st.integers(1, 20)),
    st.tuples(st.just("repeat"), st.integers(1, 4)),
    st.tuples(st.just("pause"), st.integers(1, 1500)),
    st.tuples(st.just("rate"), st.sampled_from([1000, 2500, 4000, 10_000, 20_000])),
    st.tuples(st.just("restart"), st.integers(50_000, 3_000_000)),
    st.tuples(st.just("run"), st.integers(2, 300)),
)
HISTORY = st.lists(st.tuples(EVENT, st.integers(8, 120), JITTER), max_size=12)
# A device that starts is at least as old as its samples.
FIRST = st.tuples(st.integers(0, 70_000), st.integers(0, 2**33)).map(lambda f: (f[0], f[1] + f[0] * 20_000 + 50_000))


def _played(first: tuple[int, int], history: list[tuple[tuple[str, int], int, list[int]]]) -> Device:
    device = Device(*first)
    device.run(70, [0])
    for (what, value), frames, jitter in history:
        if what == "lose":
            device.lose(value)
        elif what == "repeat":
            device.repeat(value)
        elif what == "pause":
            device.pause(value)
        elif what == "rate":
            device.period_us = value
            device.run(300, [0])  # while a new rate is being learnt, a long gap may cost a frame
        elif what == "restart":
            device.run(70, [0])  # younger devices are not told from a late frame
            device.restart(value)
        else:
            device.run(value, jitter)
        device.run(frames, jitter)
    device.run(40, [0])  # the last frame waits where its pace is new
    return device


def _place(ordering: Ordering, sent: list[tuple[int, int]], cuts: list[int]) -> list[tuple[int, int, int]]:
    given_out = []
    edges = [0, *sorted(min(cut, len(sent)) for cut in cuts), len(sent)]
    for start, stop in pairwise(edges):
        block = np.array(sent[start:stop], dtype=np.int64).reshape(-1, 2)
        placed = ordering.place(block[:, 0], block[:, 1])
        given_out += zip(placed.boot.tolist(), placed.sequence.tolist(), placed.time_us.tolist(), strict=True)
    return given_out


def _from_first(expected: list[tuple[int, int, int]]) -> list[tuple[int, int, int]]:
    """As an ordering has it: the first frame's count and clock as sent, what follows unwrapped from there."""
    out, turns = [], {}
    for boot, count, clock in expected:
        shift = turns.setdefault(boot, ((count & 0xFFFF) - count, (clock & 0xFFFFFFFF) - clock))
        out.append((boot, count + shift[0], clock + shift[1]))
    return out


@settings(max_examples=150)
@given(FIRST, HISTORY, st.lists(st.integers(0, 3000), max_size=5))
def test_every_frame_is_given_out_once_in_its_place(first, history, cuts) -> None:  # type: ignore[no-untyped-def]
    device = _played(first, history)
    counters = Counters()
    assert _place(Ordering(counters), device.sent, cuts) == _from_first(device.expected)
    assert counters.lost == device.lost
    assert counters.duplicated == device.duplicated
    assert counters.restarts == device.boot
    assert counters.late == counters.implausible == 0
    assert counters.frames == len(device.expected)


@settings(max_examples=60)
@given(FIRST, HISTORY, st.lists(st.integers(0, 3000), max_size=40), st.randoms(use_true_random=False))
def test_chunks_make_no_difference_even_to_nonsense(first, history, cuts, random) -> None:  # type: ignore[no-untyped-def]
    sent = _played(first, history).sent
    for _ in range(10):
        at = random.randrange(len(sent))
        sent.insert(at, (random.randrange(1 << 16), random.randrange(1 << 32)))
        sent.insert(at, sent[random.randrange(len(sent))])
    one, many = Counters(), Counters()
    assert _place(Ordering(one), sent, []) == _place(Ordering(many), sent, cuts)
    assert one == many


def _regular(n: int, start: int = 1000) -> list[tuple[int, int]]:
    return [((start + k) & 0xFFFF, ((start + k) * 5000) & 0xFFFFFFFF) for k in range(n)]


def test_a_frame_out_of_place_is_dropped_and_its_neighbours_stay() -> None:
    sent = _regular(200)
    sent.insert(100, (7, 4_000_000_000))
    counters = Counters()
    assert [count for _, count, _ in _place(Ordering(counters), sent, [])] == list(range(1000, 1200))
    assert counters.implausible == 1


def test_two_frames_of_one_stamp_are_no_device_that_started_anew() -> None:
    sent = _regular(200)
    sent[100:100] = [(7, 4_000_000_000), (8, 4_000_000_000)]
    counters = Counters()
    assert [count for _, count, _ in _place(Ordering(counters), sent, [])] == list(range(1000, 1200))
    assert (counters.implausible, counters.restarts) == (2, 0)


@pytest.mark.parametrize("frames", [3, 4, 5])
def test_the_pace_of_two_frames_is_known_at_once(frames: int) -> None:
    counts, clocks = np.array(_regular(frames), dtype=np.int64).T
    placed = Ordering(Counters()).place(counts, clocks)
    assert placed.rows.tolist() == list(range(1, frames + 1))
    assert placed.held is None


def test_a_frame_that_comes_after_later_ones_is_counted_late_and_left_out() -> None:
    sent = _regular(200)
    sent.insert(110, sent.pop(100))
    counters = Counters()
    assert [count for _, count, _ in _place(Ordering(counters), sent, [])] == [*range(1000, 1100), *range(1101, 1200)]
    assert (counters.late, counters.lost) == (1, 1)


def test_a_late_frame_behind_a_gap_does_not_drive_out_the_one_that_waits() -> None:
    sent = [*_regular(200), *_regular(50, 1000 + 200 + 400)]
    sent.insert(201, (1598, 1598 * 5000))  # sent before the first frame behind the gap, comes after it
    counters = Counters()
    given_out = _place(Ordering(counters), sent, [])
    assert [count for _, count, _ in given_out] == [*range(1000, 1200), *range(1600, 1650)]
    assert (counters.late, counters.implausible) == (1, 0)


def test_stamps_that_stray_by_more_than_a_period_lose_nothing() -> None:
    rng = np.random.default_rng(5)
    n = 5000
    # A task that runs late now and then: stamps rise, but stray by up to three periods.
    late = np.where(rng.random(n) < 0.1, rng.uniform(0, 3 * 5000, n), 0.0)
    clock = np.maximum.accumulate(np.arange(n) * 5000 + late.astype(int)) + np.arange(n)
    sent = [(k & 0xFFFF, int(clock[k])) for k in range(n)]
    given_out = _place(Ordering(Counters()), sent, [])
    assert [count for _, count, _ in given_out] == list(range(n))
    assert [time for _, _, time in given_out] == clock.tolist()


def test_a_gap_of_several_turns_of_the_count_is_counted_by_the_clock() -> None:
    ahead = 3 * 65536 + 1234
    sent = [*_regular(3000), *_regular(50, 1000 + 3000 + ahead)]
    counters = Counters()
    given_out = _place(Ordering(counters), sent, [])
    assert given_out[3000][1] - given_out[2999][1] == ahead + 1
    assert counters.lost == ahead


def test_nothing_is_given_out_for_nothing() -> None:
    none = np.zeros(0, dtype=np.int64)
    placed = Ordering(Counters()).place(none, none)
    assert isinstance(placed, Placed)
    assert placed.rows.size == 0
    assert placed.held is None


@pytest.mark.parametrize("periods", [-3.0, 3.0])
def test_a_frame_whose_clock_is_periods_off_is_dropped(periods: float) -> None:
    sent = _regular(200)
    count, clock = sent[100]
    sent[100] = (count, clock + round(5000 * periods))
    counters = Counters()
    given_out = _place(Ordering(counters), sent, [])
    assert [count for _, count, _ in given_out] == [*range(1000, 1100), *range(1101, 1200)]
    assert (counters.implausible, counters.lost) == (1, 1)


def test_times_that_are_given_out_rise() -> None:
    sent = _regular(200)
    sent[100] = (sent[100][0], sent[101][1])  # stamped with the time of the one behind it
    counters = Counters()
    given_out = _place(Ordering(counters), sent, [])
    assert [count for _, count, _ in given_out] == [*range(1000, 1100), *range(1101, 1200)]
    assert min(np.diff([time for _, _, time in given_out])) > 0
    assert counters.implausible == 1


@pytest.mark.parametrize("periods", [-0.4, 0.4])
def test_a_frame_whose_clock_is_less_than_half_a_period_off_is_given_out(periods: float) -> None:
    sent = _regular(200)
    count, clock = sent[100]
    sent[100] = (count, clock + round(5000 * periods))
    counters = Counters()
    assert [count for _, count, _ in _place(Ordering(counters), sent, [])] == list(range(1000, 1200))
    assert (counters.implausible, counters.lost) == (0, 0)


@pytest.mark.parametrize(("lost", "restarted"), [(30_000, False), (40_000, True)])
def test_a_young_device_whose_clock_and_count_might_also_have_wrapped_is_one_that_restarted(
    lost: int, restarted: bool
) -> None:
    # The last frame lies so that count 200 at 1 s is, modulo both wraps, also ``lost`` samples later: within half a
    # turn of the count that is a gap, beyond it the device has booted.
    period_us, young = 5000, (200, 1_000_000)
    last = ((young[0] - lost) & 0xFFFF, (young[1] - lost * period_us) & 0xFFFFFFFF)
    steps = np.concatenate([np.arange(-299, 1), np.arange(300)])
    counts = np.where(np.arange(600) < 300, last[0], young[0]) + steps
    clocks = np.where(np.arange(600) < 300, last[1], young[1]) + steps * period_us
    placed = Ordering(Counters()).place(counts & 0xFFFF, clocks & 0xFFFFFFFF)
    assert sorted(set(placed.boot.tolist())) == ([0, 1] if restarted else [0])
    if not restarted:
        assert np.diff(placed.sequence).max() == lost
