"""What a trial adds up to, where it is known exactly: weights, shares of time, order of contact, sequence."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from trials import Array, analysed, loads_of, ran, recorded, stood, walked

from simulators.people import Trial
from smartshoe.errors import RefusedError
from smartshoe.gait import ContactDetector, Contacts, Coverage, GaitResult, analyse
from smartshoe.gait._force_sums import ForceSums
from smartshoe.gait._strides import Stride
from smartshoe.gait._trial import feet_of
from smartshoe.gait._trial_sums import TrialSums
from smartshoe.gait._window import analyse_window
from smartshoe.gait.indices import deviations, sequence_errors
from smartshoe.gait.phases import PHASES, crisp
from smartshoe.gait.summary import both_down, of_main_activity
from smartshoe.recording import Recording

RATE_HZ = 200.0


def _teeter(seconds: float) -> Array:
    """The share of the left foot in a walk whose whole force is steady: 0.4 s on each foot, 0.1 s between them."""
    at = np.arange(0.0, seconds, 1.0 / RATE_HZ) % 1.0
    return np.interp(at, [0.0, 0.4, 0.5, 0.9, 1.0], [1.0, 1.0, 0.0, 0.0, 1.0])


def _shared(left: Array, total_n: Array | float, start_s: float = 0.0) -> Recording:
    loads = {"left_heel_n": left, "left_toe_n": left, "right_heel_n": 1.0 - left, "right_toe_n": 1.0 - left}
    time_s = start_s + np.arange(left.size) / RATE_HZ
    return recorded(time_s, {name: 0.5 * share * total_n for name, share in loads.items()})


def test_where_the_whole_force_is_steady_it_is_the_body_weight() -> None:
    weight = analyse(_shared(_teeter(12.0), 700.0)).forces.body_weight
    assert weight is not None
    assert weight.source == "strides"
    assert weight.value == pytest.approx(700.0, rel=1e-9)


@pytest.mark.parametrize("start_s", [0.0, 500.0])
def test_walking_and_standing_count_by_the_time_that_they_last(start_s: float) -> None:
    left = np.concatenate([_teeter(12.0), np.full(1000, 0.5)])
    total_n = np.concatenate([np.full(2400, 700.0), np.full(1000, 740.0)])
    forces = analyse(_shared(left, total_n, start_s)).forces
    assert forces.body_weight is not None
    assert forces.body_weight.source == "strides"
    assert forces.standing_total_n == pytest.approx(740.0, abs=0.1)
    # Of 17 s some 11 are whole strides and 4 are settled standing.
    assert forces.mean_total_n == pytest.approx((11 * 700.0 + 4 * 740.0) / 15, abs=2.5)


def _analysed_with(gain_sd: float) -> float:
    """The expected error of a trial whose units' gains are known to ``gain_sd``."""
    feet, _ = feet_of([walked().recording], ())
    uncertain = {
        name: replace(foot, units=tuple(replace(unit, gain_sd=gain_sd) for unit in foot.units))
        for name, foot in feet.items()
    }
    found = analysed()
    contacts = {name: series.contacts for name, series in found.feet.items()}
    sums = ForceSums(uncertain, 0.8)
    for name, own in contacts.items():
        sums.add_floors(name, own)
    sums.add(analyse_window(uncertain, contacts, found.covering, None))
    rmse_n = sums.forces(None).rmse_estimate_n
    assert rmse_n is not None
    return rmse_n


def test_the_gains_uncertainty_adds_its_share_of_the_load_to_the_expected_error() -> None:
    plain_n, uncertain_n = _analysed_with(0.0), _analysed_with(0.05)
    mean_square = sum(float(np.mean(foot.load**2, axis=0).sum()) for foot in analysed().feet.values())
    assert uncertain_n**2 - plain_n**2 == pytest.approx(0.05**2 * mean_square / 0.8**2, rel=1e-6)


def _stride(start_s: float, *, runs: bool = False, toe_off_s: float | None = None) -> Stride:
    off_s = start_s + 0.6 if toe_off_s is None else toe_off_s
    return Stride("left", start_s, start_s + 1.0, off_s, None, None, 60.0, None, None, None, runs, False)


def test_a_stride_is_out_of_sequence_where_two_events_come_together_or_one_is_missing() -> None:
    strike_s = np.array([0.0, 1.0, 2.0, 3.0])
    # Heel, then metatarsal: in order; with the heel; never; in order, but off the ground as the heel leaves it.
    onset_s = np.column_stack([strike_s, strike_s + np.array([0.1, 0.0, np.nan, 0.1])])
    release_s = np.column_stack([strike_s + 0.3, strike_s + 0.6])
    contacts = Contacts(("heel", "meta1"), strike_s, strike_s + 0.6, onset_s, release_s, np.zeros(0), np.zeros((0, 2)))
    strides = [_stride(0.0), _stride(1.0), _stride(2.0), _stride(3.0, toe_off_s=3.3)]
    assert [sequence_errors(contacts, [stride])[0] for stride in strides] == [0, 1, 1, 1]
    assert sequence_errors(contacts, strides) == (3, 4)


@pytest.mark.parametrize("regions", [("heel", "toe"), ("meta4", "meta1")])
def test_a_shoe_that_cannot_tell_the_sequence_is_not_judged(regions: tuple[str, str]) -> None:
    strike_s = np.array([0.0, 1.0])
    onset_s, release_s = (np.column_stack([strike_s + a, strike_s + b]) for a, b in ((0.0, 0.1), (0.3, 0.6)))
    contacts = Contacts(regions, strike_s, strike_s + 0.6, onset_s, release_s, np.zeros(0), np.zeros((0, 2)))
    assert sequence_errors(contacts, [_stride(0.0), _stride(1.0)]) == (0, 0)


def test_of_as_many_strides_walked_as_run_those_walked_are_told() -> None:
    walks, runs = _stride(0.0), _stride(1.0, runs=True)
    assert of_main_activity([walks, runs]) == [walks]
    assert of_main_activity([walks, runs, runs]) == [runs, runs]


def test_an_activity_is_told_by_the_time_that_it_takes() -> None:
    """Four seconds of running after thirty of walking are less than a seventh."""
    run = {name: values[:800] for name, values in loads_of(ran()).items()}
    both = {name: np.concatenate([values, run[name]]) for name, values in loads_of(walked()).items()}
    found = analyse(recorded(np.arange(both["left_heel_n"].size) / RATE_HZ, both), coverage=0.8)
    assert found.activity == "walking"
    assert any(stride.runs for stride in found.strides)


def _own(found: GaitResult, foot: str) -> list[Stride]:
    return [stride for stride in of_main_activity(found.strides) if stride.foot == foot]


def test_abnormality_is_its_mean_over_the_samples_of_the_strides() -> None:
    for name, foot in analysed().feet.items():
        spans = [np.searchsorted(foot.time_s, [s.start_s, s.end_s]) for s in _own(analysed(), name)]
        inside = np.concatenate([foot.abnormality[first:last] for first, last in spans])
        assert analysed().indices[name]["abnormality_percent"] == pytest.approx(100.0 * inside.mean(), rel=1e-12)


def test_the_lateral_metatarsal_is_counted_where_it_comes_first() -> None:
    earlier, seen = 0, 0
    for name, foot in analysed().feet.items():
        own = np.isin(foot.contacts.strike_s, [stride.start_s for stride in _own(analysed(), name)])
        meta4, meta1 = (foot.contacts.onset_s[own, foot.contacts.regions.index(unit)] for unit in ("meta4", "meta1"))
        earlier += int(np.sum(meta4 < meta1))
        seen += int(np.sum(np.isfinite(meta4) & np.isfinite(meta1)))
    assert seen > 40
    assert analysed().summary["meta4_before_meta1_percent"] == pytest.approx(100.0 * earlier / seen, rel=1e-12)


def test_a_stride_in_which_the_other_foot_lacks_its_samples_weighs_nothing() -> None:
    left = _teeter(12.0)
    gone = {name: 350.0 * share for name, share in (("left", left), ("right", 1.0 - left))}
    columns = {f"{side}_{unit}_n": load.copy() for side, load in gone.items() for unit in ("heel", "toe")}
    for unit in ("heel", "toe"):
        columns[f"right_{unit}_n"][1600:1700] = np.nan  # half a second from 8 s on: bridged by a line that is wrong
    weight = analyse(recorded(np.arange(left.size) / RATE_HZ, columns)).forces.body_weight
    assert weight is not None
    assert weight.value == pytest.approx(700.0, rel=1e-9)


def test_one_shoes_strides_last_as_long_as_they_do() -> None:
    """Of 24 s of walking and 3.5 s of standing six sevenths are walking, with one shoe as with two."""
    left = np.concatenate([_teeter(24.0), np.full(700, 0.5)])
    time_s = np.arange(left.size) / RATE_HZ
    assert analyse(recorded(time_s, {"left_heel_n": 350.0 * left, "left_toe_n": 350.0 * left})).activity == "walking"


def test_a_deviation_is_the_rms_distance_in_percent_of_the_peak() -> None:
    shape = np.abs(np.sin(np.linspace(0.0, np.pi, 101)))[:, None] * np.array([0.6, 0.4])
    each = 900.0 * np.stack([shape, shape])
    assert deviations(each, shape) == pytest.approx([0.0, 0.0], abs=1e-9)
    assert deviations(each, shape + np.array([0.03, -0.04])) == pytest.approx(np.full(2, 100.0 * np.sqrt(12.5e-4)))
    assert deviations(0.0 * each, shape).tolist() == [0.0, 0.0]


def test_a_single_contact_has_its_phases_and_a_foot_without_any_is_in_swing() -> None:
    time_s = np.arange(0.0, 1.0, 0.1)
    none, one = np.zeros(0), np.array([[0.15, 0.35]])
    contacts = Contacts(("heel", "meta1"), one[:, 0], np.array([0.75]), one, one + 0.4, none, np.zeros((0, 2)))
    assert [PHASES[k] for k in crisp(contacts, time_s)] == ["swing"] * 2 + ["heel"] * 2 + ["flat"] * 2 + [
        "push"
    ] * 2 + ["swing"] * 2
    empty = Contacts(("heel",), none, none, np.zeros((0, 1)), np.zeros((0, 1)), none, np.zeros((0, 1)))
    assert not crisp(empty, time_s).any()


def test_double_support_is_what_both_stances_share_up_to_the_last_contact() -> None:
    def foot(first_s: float, count: int, stance_s: float = 0.6) -> Contacts:
        strike_s = first_s + np.arange(float(count))
        once = np.full((count, 1), np.nan)
        return Contacts(("heel",), strike_s, strike_s + stance_s, once, once, np.zeros(0), np.zeros((0, 1)))

    strides = [_stride(float(k), toe_off_s=k + 0.6) for k in range(3)]
    assert both_down({"left": foot(0.0, 4), "right": foot(-0.5, 4)}, strides) == pytest.approx((20.0, 0.0))
    # Without the other foot nothing is shared, and it is in the air whenever this one is.
    assert both_down({"left": foot(0.0, 4), "right": foot(50.0, 2)}, strides) == pytest.approx((0.0, 40.0))
    # Both at once and neither, in one stride: down from 0 to 0.4 s and from 0.3 to 0.7 s of each second.
    short = [_stride(float(k), toe_off_s=k + 0.4) for k in range(3)]
    assert both_down({"left": foot(0.0, 4, 0.4), "right": foot(-0.7, 5, 0.4)}, short) == pytest.approx((10.0, 30.0))


@pytest.mark.parametrize(("samples", "gaps"), [(1, 0), (18, 0), (24, 1)])
def test_a_stride_loses_its_say_where_a_tenth_of_a_second_is_missing_in_one_piece(samples: int, gaps: int) -> None:
    left = _teeter(12.0)
    columns = {f"left_{unit}_n": 350.0 * left for unit in ("heel", "toe")}
    columns |= {f"right_{unit}_n": 350.0 * (1.0 - left) for unit in ("heel", "toe")}
    columns["left_toe_n"][1230 : 1230 + samples] = np.nan  # 6.15 s: in the middle of a stance
    found = analyse(recorded(np.arange(left.size) / RATE_HZ, columns))
    assert sum(stride.gap for stride in found.strides if stride.foot == "left") == gaps
    assert not any(stride.gap for stride in found.strides if stride.foot == "right")


@pytest.mark.parametrize(("made", "moves"), [(walked, True), (stood, True), (None, False)])
def test_a_trial_that_steps_or_stands_has_moved(made: Callable[[], Trial] | None, moves: bool) -> None:
    feet, _ = feet_of([(made or walked)().recording], ())
    sums = TrialSums(feet, 0.8)
    if made is not None:
        contacts = {name: ContactDetector(foot.rate_hz, foot.regions).apply(foot.load) for name, foot in feet.items()}
        sums.add(analyse_window(feet, contacts, Coverage(0.8), None))
    assert sums.moved == moves


def test_a_stride_belongs_to_the_window_in_which_it_begins() -> None:
    feet, _ = feet_of([walked().recording], ())
    contacts = {name: ContactDetector(foot.rate_hz, foot.regions).apply(foot.load) for name, foot in feet.items()}
    whole = analyse_window(feet, contacts, Coverage(0.8), None).strides
    cut_s = whole[len(whole) // 2].start_s
    parts = [
        analyse_window(feet, contacts, Coverage(0.8), None, start_s=start_s, end_s=end_s).strides
        for start_s, end_s in ((-np.inf, cut_s), (cut_s, np.inf))
    ]
    assert parts[0] + parts[1] == whole


def test_shoes_that_nobody_wore_are_refused() -> None:
    time_s = np.arange(0.0, 10.0, 1.0 / RATE_HZ)
    with pytest.raises(RefusedError, match="no stance is found and no foot is loaded"):
        analyse(recorded(time_s, {"left_heel_n": 0.0 * time_s, "right_heel_n": 0.0 * time_s}))
