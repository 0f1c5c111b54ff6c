"""Strides, phases, memberships and indices: laws, and numbers that are known."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from trials import analysed, loads_of, ran, recorded, stood, times_of, walked

from simulators.people import Person, Walk, trial
from smartshoe.errors import UsageError
from smartshoe.files.atomic import json_text
from smartshoe.gait import Contacts, analyse, centre_of_pressure, memberships
from smartshoe.gait._crossing import bent_places, growth, level_places, rise_places, running_median
from smartshoe.gait._strides import loading_rate, strides_of
from smartshoe.gait.insole import PLACES
from smartshoe.gait.membership import PHASES
from smartshoe.gait.summary import asymmetry
from smartshoe.recording import REGIONS


# -- onsets ------------------------------------------------------------------------------------------------
@settings(max_examples=25)
@given(power=st.floats(1.0, 2.4), place=st.floats(8.0, 20.0), height=st.floats(0.5, 50.0), bears=st.floats(0.0, 1.5))
def test_the_way_down_a_power_law_is_exact(power: float, place: float, height: float, bears: float) -> None:
    # Fine samples: what is left is the straight line between them.
    at = np.arange(0.0, 60.0, 0.01)
    load = np.tile(height * np.maximum(at - place, 0.0) ** power, (4, 1))
    lowest = np.full(4, 0.05 * load.max())
    crossed = rise_places(load, lowest[:, None] * np.array([1.0, 2.0, 4.0]), 5.0 * lowest)
    ratio = growth(crossed, 1.5)
    assert ratio == pytest.approx(2.0 ** (1.0 / power), rel=1e-3)
    wanted = place + (bears * lowest[0] / height) ** (1.0 / power)
    assert 0.01 * level_places(crossed, ratio, np.full(4, bears)) == pytest.approx(wanted, abs=0.05)


@settings(max_examples=25)
@given(power=st.floats(1.0, 2.4), onset=st.floats(8.05, 8.95), height=st.floats(0.5, 50.0), share=st.floats(0.0, 0.99))
def test_an_onset_between_two_samples_is_found_by_its_law(
    power: float, onset: float, height: float, share: float
) -> None:
    load = height * np.maximum(np.arange(30) - onset, 0.0)[None] ** power
    level = share * load[:, 9]
    straight = rise_places(load, level[:, None], np.array([load.max()]))[:, 0]
    bent = bent_places(load, level, straight, 2.0 ** (1.0 / power))
    if level > 0:
        assert bent == pytest.approx(onset + (level / height) ** (1.0 / power), abs=1e-6)
        assert straight <= bent + 1e-6


def test_a_load_that_was_there_before_keeps_its_straight_line() -> None:
    load = np.array([[0.0, 1.0, 2.0, 3.0, 4.0]])  # the law through 2 and 3 begins at 0, before the sample of 1
    assert bent_places(load, np.array([1.5]), np.array([1.5]), 2.0) == pytest.approx(1.5)


def test_a_load_that_never_comes_has_no_onset() -> None:
    crossed = rise_places(np.zeros((2, 30)), np.tile([1.0, 2.0, 4.0], (2, 1)), np.full(2, 5.0))
    assert np.isnan(crossed).all()
    assert growth(crossed, 1.7) == 1.7


def test_where_no_sample_lies_by_a_contact_there_is_no_onset() -> None:
    """As of a logger that takes one sample in ten seconds."""
    assert np.isnan(rise_places(np.zeros((2, 0)), np.tile([1.0, 2.0, 4.0], (2, 1)), np.full(2, 5.0))).all()


@given(values=arrays(float, st.integers(1, 30), elements=st.floats(-9, 9) | st.just(np.nan)))
@settings(max_examples=20)
def test_running_median_is_that_of_each_neighbourhood(values: np.ndarray) -> None:
    found = running_median(values, 5)
    for index in range(values.size):
        near = values[max(0, index - 2) : index + 3]
        near = near[np.isfinite(near)]
        assert np.isnan(found[index]) if near.size == 0 else found[index] == pytest.approx(np.median(near))


# -- membership, centre of pressure --------------------------------------------------------------------------
LOADS = arrays(float, (7, 4), elements=st.floats(-20.0, 900.0))


@settings(max_examples=25)
@given(loads=LOADS, scale=st.floats(0.3, 3.0))
def test_memberships_sum_to_one_and_do_not_know_body_weight(loads: np.ndarray, scale: float) -> None:
    usual = np.array([200.0, 110.0, 260.0, 370.0])
    member, abnormality = memberships(loads, REGIONS, usual)
    assert member.sum(axis=1) == pytest.approx(1.0)
    assert (member >= 0.0).all()
    assert ((abnormality >= 0.0) & (abnormality <= 1.0)).all()
    heavier, _ = memberships(scale * loads, REGIONS, scale * usual)
    assert heavier == pytest.approx(member, abs=1e-9)


def test_each_phase_is_found_where_its_loads_are() -> None:
    usual = np.full(4, 100.0)
    on = {
        "initial_contact": {"heel"},
        "loading_response": {"heel", "meta4"},
        "mid_stance": {"heel", "meta4", "meta1"},
        "terminal_stance": {"meta4", "meta1", "toe"},
        "pre_swing": {"toe"},
        "swing": set(),
    }
    loads = np.array([[80.0 if region in regions else 0.0 for region in REGIONS] for regions in on.values()])
    member, abnormality = memberships(loads, REGIONS, usual)
    assert [list(PHASES)[k] for k in member.argmax(axis=1)] == list(on)
    assert (abnormality < 0.05).all()
    # Heel and toe with nothing between them is no phase of gait.
    _, odd = memberships(np.array([[80.0, 0.0, 0.0, 80.0]]), REGIONS, usual)
    assert odd[0] > 0.9


@settings(max_examples=25)
@given(loads=LOADS, scale=st.floats(0.3, 3.0))
def test_centre_of_pressure_stays_within_the_units(loads: np.ndarray, scale: float) -> None:
    centre = centre_of_pressure(loads, REGIONS, 10.0)
    places = np.array(list(PLACES.values()))
    known = np.isfinite(centre[:, 0])
    assert np.array_equal(known, np.maximum(loads, 0.0).sum(axis=1) > 10.0)
    assert (centre[known] >= places.min(axis=0) - 1e-12).all()
    assert (centre[known] <= places.max(axis=0) + 1e-12).all()
    assert centre_of_pressure(scale * loads, REGIONS, scale * 10.0) == pytest.approx(centre, nan_ok=True)


def test_the_centre_of_pressure_goes_from_heel_to_toe() -> None:
    for foot in analysed().feet.values():
        for stride in analysed().strides[2:8]:
            if stride.foot != foot.name:
                continue
            at = stride.start_s + np.array([0.1, 0.9]) * (stride.toe_off_s - stride.start_s)
            first, last = (foot.centre[int(np.searchsorted(foot.time_s, s)), 0] for s in at)
            assert first == pytest.approx(PLACES["heel"][0], abs=0.01)
            assert last > PLACES["meta1"][0]


# -- strides and the summary ---------------------------------------------------------------------------------
def test_loading_rate_of_a_ramp() -> None:
    stance_n = np.concatenate([np.linspace(0.0, 600.0, 31), np.linspace(600.0, 0.0, 90)])
    # 600 N in 30 samples of 5 ms.
    assert loading_rate(stance_n, 200.0) == pytest.approx(4000.0)
    assert loading_rate(np.zeros(20), 200.0) is None


@given(samples=st.integers(8, 60), phase=st.floats(0.0, 0.9), slope=st.floats(10.0, 1e5))
def test_the_loading_rate_of_a_straight_rise_is_its_slope_wherever_the_samples_lie(
    samples: int, phase: float, slope: float
) -> None:
    rise_n = slope / 200.0 * (phase + np.arange(samples))
    fall_n = np.linspace(rise_n[-1], 0.0, 3 * samples)
    assert loading_rate(np.concatenate([rise_n, fall_n[1:]]), 200.0) == pytest.approx(slope, rel=1e-9)


def test_the_centre_of_pressure_stays_on_the_insole_and_reaches_both_ends_of_it() -> None:
    table = analysed().columns()
    for foot in ("left", "right"):
        along = table[f"{foot}_centre_along_percent"]
        seen = along[np.isfinite(along)]
        assert 0.0 <= seen.min() < 40.0
        assert 60.0 < seen.max() <= 100.0


def test_asymmetry_is_right_less_left_over_their_mean() -> None:
    assert asymmetry(90.0, 110.0) == pytest.approx(20.0)
    assert asymmetry(5.0, 5.0) == 0.0


@pytest.mark.parametrize(("load", "time"), [(0.0, 0.0), (0.2, 0.0), (0.0, 0.1), (-0.3, -0.1)])
def test_asymmetry_of_load_and_time_is_found(load: float, time: float) -> None:
    person = Person(load_asymmetry=load, time_asymmetry=time)
    made = trial(person, Walk(1.3), 60.0, np.random.default_rng(21), sensors=False, outside="even")
    found = analyse(made.recording, coverage=0.8).summary
    # Fifty strides that vary by 3 % (loads) and 1.6 % (times) leave their mean uncertain by 0.5 and 0.3 %.
    assert found["right_over_left_percent"]["impulse"] == pytest.approx(100.0 * load, abs=2.0)
    assert found["right_over_left_percent"]["stance_time"] == pytest.approx(100.0 * time, abs=1.2)
    assert found["asymmetry_percent"] == pytest.approx(abs(found["right_over_left_percent"]["impulse"]))


def test_the_summary_is_that_of_the_true_events() -> None:
    made, summary = walked(), analysed().summary
    strike_s = {foot: made.times_s(foot, "heel_strike") for foot in ("left", "right")}
    stride_s = {foot: np.diff(times) for foot, times in strike_s.items()}
    both = np.concatenate(list(stride_s.values()))
    assert summary["cadence_steps_per_min"] == pytest.approx(120.0 / both.mean(), rel=1e-3)
    for foot, own in stride_s.items():
        assert summary["stride_time_s"][foot]["mean"] == pytest.approx(own.mean(), rel=1e-3)
        assert summary["stride_time_s"][foot]["cv_percent"] == pytest.approx(
            100 * own.std(ddof=1) / own.mean(), abs=0.1
        )
        stance_s = made.times_s(foot, "toe_off")[: own.size] - strike_s[foot][:-1]
        # Both events err by some 1 ms of a stride of 1.1 s.
        assert summary["stance_percent"][foot] == pytest.approx(100 * np.mean(stance_s / own), abs=0.3)
    double = sum(summary["stance_percent"].values()) - 100.0
    assert summary["double_support_percent"] == pytest.approx(double, abs=0.5)
    assert summary["order_of_contact"] == ["heel", "meta4", "meta1", "toe"]


def test_the_four_phases_follow_each_other() -> None:
    for foot in analysed().feet.values():
        seen = foot.state[np.flatnonzero(np.diff(foot.state, prepend=-1))]
        steps = np.diff(seen) % 4
        assert (steps == 1).all()


def test_indices_of_a_regular_gait_are_small_and_of_another_one_larger() -> None:
    straight = analysed()
    for values in straight.indices.values():
        assert values["sequence_error_percent"] == 0.0
        assert values["deviation_percent"] < 2.0
    against = analyse(ran().recording, coverage=0.8, reference=straight)
    assert against.indices["left"]["deviation_percent"] > 5.0
    same = analyse(walked().recording, coverage=0.8, reference=straight)
    assert same.indices == straight.indices
    heavier = recorded(walked().time_s, {name: 1.7 * values for name, values in loads_of(walked()).items()})
    moved = analyse(heavier, coverage=0.8, reference=straight)
    assert moved.indices["left"]["deviation_percent"] == pytest.approx(straight.indices["left"]["deviation_percent"])


# -- the result ----------------------------------------------------------------------------------------------
def test_the_object_is_json_without_nan() -> None:
    for found in (analysed(), analyse(stood().recording), analyse(ran().recording)):
        assert json.loads(json_text(found.to_dict()))["schema"] == "smartshoe.gait/1"


def test_frames_hold_strides_events_and_forces() -> None:
    found = analysed()
    strides = found.to_frame()
    assert len(strides) == len(found.strides)
    assert strides["peak_n"].tolist() == [stride.peak_n for stride in found.strides]
    assert len(found.to_frame("events")) == len(found.events)
    forces = found.to_frame("forces")
    np.testing.assert_allclose(
        forces["total_n"].to_numpy(), forces["left_total_n"] + forces["right_total_n"], rtol=1e-6
    )
    assert set(forces["left_phase"]) == {"swing", "heel", "flat", "push"}
    with pytest.raises(UsageError, match="table 'steps' is not known"):
        found.to_frame("steps")  # type: ignore[arg-type]


def test_c3d_holds_loads_and_events_with_their_side(tmp_path: Path) -> None:
    ezc3d = pytest.importorskip("ezc3d")
    from smartshoe.gait import write_c3d

    made = walked(60.0)
    shifted = recorded(made.time_s + 100.0, loads_of(made))
    found = analyse(shifted, coverage=0.8)
    assert len(found.events) > 255
    write_c3d(tmp_path / "walk.c3d", found)
    read = ezc3d.c3d(str(tmp_path / "walk.c3d"))
    group = read["parameters"]["EVENT"]
    times = np.hstack([group[name]["value"] for name in ("TIMES", "TIMES2")])
    contexts = [*group["CONTEXTS"]["value"], *group["CONTEXTS2"]["value"]]
    labels = [*group["LABELS"]["value"], *group["LABELS2"]["value"]]
    assert group["USED"]["value"][0] == len(found.events)
    # Single precision holds a minute to 4 us.
    assert 60.0 * times[0] + times[1] == pytest.approx([event.time_s - 100.0 for event in found.events], abs=1e-5)
    assert contexts == [event.foot.capitalize() for event in found.events]
    assert labels.count("Foot Strike") == sum(event.event == "heel_strike" for event in found.events)
    analog = read["parameters"]["ANALOG"]
    column = analog["LABELS"]["value"].index("left_total")
    assert analog["UNITS"]["value"][column] == "N"
    np.testing.assert_allclose(read["data"]["analogs"][0, column], found.feet["left"].force_n, rtol=0, atol=1e-3)
    assert read["parameters"]["TRIAL"]["START_S"]["value"][0] == pytest.approx(100.0)


def test_events_come_in_order_of_time() -> None:
    times = [event.time_s for event in analysed().events]
    assert times == sorted(times)
    assert len(times_of(analysed(), "left", "heel_strike")) > 20


def test_impulse_and_peak_are_those_of_the_whole_stance() -> None:
    rate_hz = 100.0
    time_s = np.arange(0.0, 3.0, 1.0 / rate_hz)
    strike_s, toe_off_s = np.array([0.5, 1.6, 2.7]), np.array([1.2, 2.3, np.nan])
    down = (time_s >= 0.5) & (time_s < 1.2)
    force_n = np.where(down, 500.0, 0.0) + np.where((time_s >= 1.6) & (time_s < 2.3), 800.0, 0.0)
    none = np.full((3, 1), np.nan)
    contacts = Contacts(("heel",), strike_s, toe_off_s, none, none, np.zeros(0), np.zeros((0, 1)))
    found = strides_of("left", contacts, time_s + 1e-6, force_n, np.zeros(time_s.size, dtype=bool))
    # 0.7 s at 500 and at 800 N; a sample's share of that is 1.4 %.
    assert [stride.impulse_n_s for stride in found] == pytest.approx([350.0, 560.0], rel=1e-3)
    assert [stride.peak_n for stride in found] == [500.0, 800.0]


def test_the_sd_of_a_standing_weight_is_that_of_the_mean_of_its_blocks() -> None:
    time_s = np.arange(0.0, 41.0, 0.01)
    # Half a second is left out at either end; 20 blocks of 2 s are 10 N above and below 700 N in turn.
    block = np.floor((time_s - 0.5 + 1e-6) / 2.0)
    total_n = 700.0 + np.where(block % 2 == 0, 10.0, -10.0)
    found = analyse(recorded(time_s, {"left_heel_n": 0.4 * total_n, "right_heel_n": 0.6 * total_n})).forces.body_weight
    assert found is not None
    assert found.source == "standing"
    assert found.value == pytest.approx(700.0, abs=0.05)
    assert found.sd == pytest.approx(10.0 / np.sqrt(19.0), rel=0.01)
