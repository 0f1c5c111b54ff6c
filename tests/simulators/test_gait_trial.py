"""A person's true loads and events: shapes, momentum, speed, asymmetry, starts and stops, blocks."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from simulators.people import Person, Run, Stand, Tiptoe, Walk, blocks, move_at, plan, trial
from simulators.people.shape import COLUMNS, PHASES, RUNNING, WALKING, covered, table
from smartshoe.errors import UsageError
from smartshoe.recording import REGIONS

WEIGHT_N = 519.4
HEEL, META4, META1, TOE = (COLUMNS.index(name) for name in ("heel", "meta4", "meta1", "toe"))


def rng(seed: int = 1) -> np.random.Generator:
    return np.random.default_rng(seed)


def whole_strides(made, foot="left", skip=2):
    strikes = made.times_s(foot, "heel_strike")
    return (made.time_s >= strikes[skip]) & (made.time_s < strikes[-skip - 1]), strikes.size - 2 * skip - 1


def total(made):
    return made.total_n["left"] + made.total_n["right"]


moves = st.one_of(st.floats(0.8, 2.0).map(Walk), st.floats(2.1, 4.5).map(Run))


@given(moves, st.floats(-0.3, 0.3), st.floats(-0.3, 0.3), st.integers(0, 1000))
@settings(max_examples=20)
def test_mean_total_force_over_whole_strides_is_body_weight(move, load_asymmetry, time_asymmetry, seed):
    made = trial(Person(WEIGHT_N, load_asymmetry, time_asymmetry), move, 60.0, rng(seed), sensors=False)
    inside, count = whole_strides(made)
    # What is owed at the two ends: a step whose time is off by 30 % of a half stride, and 5 % of one impulse.
    assert total(made)[inside].mean() == pytest.approx(WEIGHT_N, rel=0.35 / count)
    assert min(load.min() for load in made.unit_n.values()) >= 0.0
    for foot in ("left", "right"):
        units = sum(made.unit_n[f"{foot}_{region}"] for region in REGIONS)
        assert np.all(made.total_n[foot] >= units - 1e-9)


@given(moves, st.integers(0, 1000))
@settings(max_examples=10)
def test_loads_have_no_steps(move, seed):
    made = plan(Person(), ((Stand(), 3.0), (move, 6.0), (Stand(), 3.0)), None, rng(seed))
    steps = [np.abs(np.diff(made.loads_n(np.arange(0.0, 12.0, dt)), axis=0)).max() for dt in (4e-4, 2e-4, 1e-4)]
    # A smooth course moves half as far in half of the time; a step as far as before.
    assert steps[1] < 0.65 * steps[0]
    assert steps[2] < 0.65 * steps[1]


def test_walking_has_the_published_landmarks():
    shape = table("walk", 1.3, 0.8, "midfoot")
    percent = np.linspace(0, 100, PHASES + 1)
    peak, at = shape.max(axis=0), percent[shape.argmax(axis=0)]
    assert 0.68 <= peak[HEEL] <= 0.725
    assert 9 <= at[HEEL] <= 18
    assert 0.47 <= peak[META4] <= 0.515
    assert 73 <= at[META4] <= 77
    assert 0.20 <= peak[META1] <= 0.22
    assert 75 <= at[META1] <= 79
    assert 0.39 <= peak[TOE] <= 0.47
    assert 83 <= at[TOE] <= 85
    bears = shape > 0.02 * peak
    assert 39 <= percent[bears[:, HEEL]][-1] <= 58
    assert 22 <= percent[bears[:, META4]][0] <= 31
    whole = shape.sum(axis=1)
    assert np.interp(24, percent, whole) == pytest.approx(1.03, abs=0.02)
    assert 0.65 <= whole[380:500].min() <= 0.71
    assert 41 <= percent[380 + whole[380:500].argmin()] <= 46
    assert 1.08 <= np.interp(72, percent, whole) <= 1.14


def test_running_is_one_hump_of_more_than_twice_body_weight_and_flies():
    made = trial(Person(WEIGHT_N), Run(2.68), 30.0, rng(), sensors=False)
    for foot in ("left", "right"):
        strikes, offs = made.times_s(foot, "heel_strike"), made.times_s(foot, "toe_off")
        for begin, end in zip(strikes[3:10], offs[3:10], strict=True):
            own = made.total_n[foot][(made.time_s > begin) & (made.time_s < end)]
            rises = np.diff(own) > 0
            assert np.count_nonzero(rises[:-1] & ~rises[1:]) == 1
            assert own.max() > 1.9 * WEIGHT_N
    inside, _ = whole_strides(made)
    assert 0.2 < np.mean(total(made)[inside] == 0.0) < 0.45


def test_walkers_always_have_a_foot_on_the_ground():
    made = trial(Person(), Walk(2.0), 60.0, rng(), sensors=False)
    inside, _ = whole_strides(made)
    assert total(made)[inside].min() > 0.1 * WEIGHT_N


def test_time_varies_more_as_speed_falls_and_peaks_more_as_it_rises():
    spreads = []
    for speed in (0.8, 1.3, 2.0):
        made = trial(Person(), Walk(speed), 400.0, rng(), sensors=False)
        strikes = made.times_s("left", "heel_strike")
        at = np.searchsorted(made.time_s, strikes)
        peaks = np.maximum.reduceat(made.total_n["left"], at)[1:-1]
        spreads.append((np.diff(strikes).std() / np.diff(strikes).mean(), peaks.std() / peaks.mean()))
    times, heights = zip(*spreads, strict=True)
    assert times[0] > times[1] > times[2]
    assert heights[0] < heights[1] < heights[2]


def test_people_run_from_two_metres_a_second():
    assert isinstance(move_at(2.0), Walk)
    assert isinstance(move_at(2.1), Run)


@given(st.floats(-0.4, 0.4), st.floats(-0.3, 0.3))
@settings(max_examples=10)
def test_asymmetry_is_what_was_asked_for(load, time):
    steady = Walk(1.3, stride_time_cv=0.0, load_cv=0.0)
    made = trial(Person(WEIGHT_N, load, time), steady, 60.0, rng(), sensors=False)
    inside, _ = whole_strides(made)
    left, right = (made.total_n[foot][inside].sum() for foot in ("left", "right"))
    assert 2 * (right - left) / (right + left) == pytest.approx(load, abs=0.005)
    stance = {
        foot: np.median(made.times_s(foot, "toe_off")[1:20] - made.times_s(foot, "heel_strike")[1:20])
        for foot in ("left", "right")
    }
    # Stances are told at 2 % of body weight, a little within them; the lighter foot's threshold is reached later.
    asked = 2 * (stance["right"] - stance["left"]) / (stance["right"] + stance["left"])
    assert asked == pytest.approx(time, abs=0.02)


@given(st.floats(0.4, 1.0), st.sampled_from(["midfoot", "even"]))
@settings(max_examples=12)
def test_coverage_moves_load_off_the_coils_and_leaves_the_feet_alone(coverage, outside):
    steady = Walk(1.3, load_cv=0.0)
    whole = trial(Person(), steady, 20.0, rng(5), sensors=False, coverage=1.0)
    made = trial(Person(), steady, 20.0, rng(5), sensors=False, coverage=coverage, outside=outside)
    inside, _ = whole_strides(made)
    borne = sum(made.unit_n.values())
    assert borne[inside].sum() / total(made)[inside].sum() == pytest.approx(coverage, abs=0.01)
    # The regions' own shifts of phase act on what they bear, so feet agree on average and not to the last digit.
    assert total(made)[inside].mean() == pytest.approx(total(whole)[inside].mean(), rel=1e-3)


def test_the_courses_of_what_passes_beside():
    natural = np.column_stack([np.full(11, 1.0), *[np.zeros(11)] * 3, np.linspace(0.0, 0.5, 11)])
    for coverage in (0.3, 0.8, 0.95, 1.0):
        made = covered(natural, coverage, "midfoot")
        np.testing.assert_allclose(made.sum(axis=1), natural.sum(axis=1), rtol=1e-6)
        assert made[:, :-1].sum() / made.sum() == pytest.approx(coverage)
        assert made.min() >= 0.0
    assert covered(natural, 0.7, "even")[:, -1] == pytest.approx(0.3 * natural.sum(axis=1))


def test_events_are_where_the_true_loads_cross_a_share_of_body_weight():
    made = trial(Person(800.0), Walk(1.1), 20.0, rng(), sensors=False, sample_rate_hz=1000.0)
    for foot in ("left", "right"):
        for event in ("heel_strike", "toe_off"):
            force = np.interp(made.times_s(foot, event), made.time_s, made.total_n[foot])
            np.testing.assert_allclose(force, np.full(force.size, 16.0), rtol=1e-6)
        kinds = [e.event for e in made.events if e.foot == foot]
        assert kinds[:8] == ["heel_strike", "foot_flat", "heel_off", "toe_off"] * 2
    coarse = trial(Person(800.0), Walk(1.1), 20.0, rng(), sensors=False)
    apart_s = np.abs([a.time_s - b.time_s for a, b in zip(made.events, coarse.events, strict=True)])
    assert apart_s.max() < 1e-3  # 200 Hz against 1000 Hz: the onset is curved between samples


def test_events_do_not_move_with_body_weight():
    light, heavy = (trial(Person(weight), Walk(1.3), 20.0, rng(), sensors=False) for weight in (400.0, 1000.0))
    assert [e.time_s for e in light.events] == pytest.approx([e.time_s for e in heavy.events], abs=1e-12)


def test_standing_tiptoe_walking_turning_running_and_standing_again():
    sequence = ((Stand(), 4.0), (Tiptoe(), 4.0), (Stand(), 2.0), (Walk(1.2), 6.0), (Walk(1.0, turning=0.8), 4.0),
                (Run(2.5), 4.0), (Walk(1.2), 4.0), (Stand(), 4.0))  # fmt: skip
    made = trial(Person(WEIGHT_N), sequence, None, rng(), sensors=False)
    assert made.time_s[-1] == pytest.approx(32.0, abs=0.01)
    still = (made.time_s > 2) & (made.time_s < 3.9) | (made.time_s > 30)
    np.testing.assert_allclose(total(made)[still], np.full(still.sum(), WEIGHT_N), rtol=1e-6)
    up = (made.time_s > 5) & (made.time_s < 7)
    assert made.unit_n["left_heel"][up].max() == 0.0
    assert made.unit_n["left_meta1"][up].min() > 0.1 * WEIGHT_N
    rise = (made.time_s >= 4) & (made.time_s < 8)
    assert total(made)[rise].mean() == pytest.approx(WEIGHT_N, rel=1e-3)  # who goes up comes down: momentum
    for foot in ("left", "right"):
        ground = [e.event for e in made.events if e.foot == foot and e.event in ("heel_strike", "toe_off")]
        assert ground == ["heel_strike", "toe_off"] * (len(ground) // 2) + ["heel_strike"]
    # Starting and stopping leave momentum out, and stay near body weight nevertheless.
    for begin, end in ((9.9, 10.5), (27.5, 28.5)):
        joint = (made.time_s > begin) & (made.time_s < end)
        assert 0.6 * WEIGHT_N < total(made)[joint].mean() < 1.4 * WEIGHT_N


def test_a_turn_to_the_left_leans_on_the_left_foots_outer_edge():
    straight, turned = (trial(Person(), Walk(1.0, turning=t), 60.0, rng(), sensors=False) for t in (0.0, 1.0))

    def inner(made, foot):
        return made.unit_n[f"{foot}_meta1"].sum() / (
            made.unit_n[f"{foot}_meta1"].sum() + made.unit_n[f"{foot}_meta4"].sum()
        )

    assert inner(turned, "left") < inner(straight, "left")
    assert inner(turned, "right") > inner(straight, "right")


def test_blocks_join_to_the_whole_with_the_sensors_memory():
    settings_ = {"units": {"*": {"sensor": {"noise_percent": 0.0}}}}
    whole = trial(Person(), Walk(1.3), 21.0, rng(3), **settings_)
    parts = list(blocks(Person(), Walk(1.3), 21.0, rng(3), block_s=4.0, **settings_))
    assert len(parts) == 6
    assert np.array_equal(np.concatenate([p.time_s for p in parts]), whole.time_s)
    assert [e for p in parts for e in p.events] == list(whole.events)
    for unit, load in whole.unit_n.items():
        assert np.array_equal(np.concatenate([p.unit_n[unit] for p in parts]), load)
        joined = np.concatenate([p.recording[unit].values for p in parts])
        # Filters started from their state differ in rounding: one count of the converter at most.
        assert np.abs(joined - whole.recording[unit].values).max() < 0.07


def test_sensors_record_in_mbar_and_drift():
    quiet = trial(Person(), Stand(), 30.0, rng(2))
    drifting = trial(Person(), Stand(), 30.0, rng(2), drift=0.05)
    moved = drifting.recording["left_heel"].values - quiet.recording["left_heel"].values
    assert moved[-200:].mean() == pytest.approx(0.05 * 200.0, rel=0.02)
    loads = trial(Person(), Stand(), 30.0, rng(2), sensors=False, drift=0.05, sides=("right",))
    assert set(loads.recording.channels) == {f"right_{region}" for region in REGIONS}
    assert (loads.recording["right_toe"].si - loads.unit_n["right_toe"])[-1] == pytest.approx(
        0.05 * WEIGHT_N, rel=0.001
    )


def test_order_of_the_pulses_is_heel_outer_inner_toe():
    for pulses in (WALKING, RUNNING):
        assert [pulses[name][0] for name in ("heel", "meta4", "meta1", "toe")] == sorted(
            pulses[name][0] for name in ("heel", "meta4", "meta1", "toe")
        )


@pytest.mark.parametrize(
    ("call", "says"),
    [
        (lambda: Walk(4.0), "walk at 4 m/s: give a speed from 0.3 to 2.6"),
        (lambda: Run(0.5), "run at 0.5 m/s"),
        (lambda: Walk(1.3, stance_share=0.45), "stance_share is 0.45"),
        (lambda: Person(-1.0), "body_weight_n is -1"),
        (lambda: Person(500.0, load_asymmetry=0.9), "load_asymmetry is 0.9"),
        (lambda: Tiptoe(rise_s=0.1), "rise_s is 0.1"),
        (lambda: trial(coverage=0.0, duration_s=5.0), "coverage is 0"),
        (lambda: trial(activity=(), duration_s=None), "at least"),
        (lambda: trial(duration_s=None), "duration_s is missing"),
        (lambda: trial(activity=((Tiptoe(), 1.0),), duration_s=None), "too short to rise"),
        (lambda: trial(sample_rate_hz=0.0), "sample_rate_hz is 0"),
    ],
)
def test_what_nobody_can_do_is_refused(call, says):
    with pytest.raises(UsageError, match=says):
        call()
