"""Events against truth, and what they must not depend on."""

from __future__ import annotations

import numpy as np
import pytest
from event_scoring import score, scores
from hypothesis import example, given, settings
from hypothesis import strategies as st
from trials import analysed, loads_of, ran, recorded, stood, times_of, walked

from simulators.people import Person, Run, Stand, Walk, trial
from smartshoe.errors import InputError, UsageError
from smartshoe.gait import ContactDetector, analyse

KINDS = ("heel_strike", "foot_flat", "heel_off", "toe_off")


@pytest.mark.parametrize("speed", [0.8, 1.3, 2.0])
@pytest.mark.parametrize(("asymmetry", "drift"), [(0.0, 0.0), (0.3, 0.05)])
def test_heel_strike_and_toe_off_lie_within_ten_milliseconds(speed: float, asymmetry: float, drift: float) -> None:
    person = Person(load_asymmetry=asymmetry, time_asymmetry=asymmetry)
    made = trial(person, Walk(speed), 30.0, np.random.default_rng(3), sensors=False, noise_n=2.0, drift=drift)
    found = scores(analyse(made.recording), made)
    for kind in ("heel_strike", "toe_off"):
        assert found[kind].true > 30
        assert found[kind].missed == found[kind].false == 0
        assert found[kind].median_ms < 10.0
        assert found[kind].p95_ms < 20.0
    # The forefoot comes softly, so that its onset is less sharp than a heel strike.
    for kind in ("foot_flat", "heel_off"):
        assert found[kind].missed == found[kind].false == 0
        assert found[kind].p95_ms < 20.0


def test_readings_without_a_calibration_give_the_same_events() -> None:
    made = trial(Person(), Walk(1.3), 20.0, np.random.default_rng(4))
    found = analyse(made.recording)
    assert found.feet["left"].force_n is None
    for kind in ("heel_strike", "toe_off"):
        own = scores(found, made)[kind]
        assert own.missed == own.false == 0
        assert own.p95_ms < 20.0


def test_running_and_its_flight() -> None:
    found = analyse(ran().recording)
    assert found.activity == "running"
    assert found.summary["double_support_percent"] == 0.0
    assert found.summary["flight_percent"] > 10.0
    assert scores(found, ran())["heel_strike"].p95_ms < 20.0


@pytest.mark.parametrize("move", [Walk(1.3), Run(3.0)])
@pytest.mark.parametrize("rate_hz", [100.0, 200.0])
def test_a_foot_that_runs_bears_from_the_load_from_which_one_that_walks_does(move: Walk | Run, rate_hz: float) -> None:
    # A runner's peak is 2.5 body weights: by a share of the peak he would come 3 ms late, and leave 4 ms early.
    settings = {"sensors": False, "coverage": 1.0}
    made, fine = (
        trial(Person(), move, 15.0, np.random.default_rng(8), sample_rate_hz=hz, **settings) for hz in (rate_hz, 2e3)
    )
    found = scores(analyse(made.recording), fine)
    for kind in ("heel_strike", "toe_off"):
        assert np.mean(np.abs(found[kind].error_s)) < 1.5e-3


def test_starts_stops_and_standing_make_no_strides() -> None:
    parts = ((Stand(), 6.0), (Walk(1.2), 10.0), (Stand(), 6.0), (Run(2.7), 6.0), (Stand(), 4.0))
    made = trial(Person(), parts, None, np.random.default_rng(5), sensors=False, noise_n=1.0)
    found = analyse(made.recording)
    assert found.activity == "mixed"
    assert {stride.runs for stride in found.strides} == {False, True}
    for stride in found.strides:
        assert stride.time_s < 2.0
        walking = 5.5 < stride.start_s < 17.0
        assert walking or 21.5 < stride.start_s < 29.0
        assert stride.runs != walking
    assert [round(start) for start, _ in found.standing_s] == pytest.approx([1, 16, 28], abs=1)


def test_sway_and_tiptoe_are_no_steps() -> None:
    found = analyse(stood().recording)
    assert found.activity == "standing"
    assert found.strides == ()
    assert [event.event for event in found.events if event.event == "toe_off"] == []


# -- what events do not depend on --------------------------------------------------------------------------
@settings(max_examples=8)
@given(
    scale=st.floats(0.4, 3.0),
    offsets_n=st.lists(st.floats(-150.0, 300.0), min_size=8, max_size=8),
)
@example(scale=0.5, offsets_n=[0.0, 0.0, 0.0, 0.0, 0.0, 0.0, -61.0, -150.0])  # mostly negative, and no tension
@example(scale=0.4, offsets_n=[-150.0] * 8)
def test_events_do_not_move_with_body_weight_or_offset(scale: float, offsets_n: list[float]) -> None:
    moved = {
        name: scale * values + offset
        for (name, values), offset in zip(loads_of(walked()).items(), offsets_n, strict=True)
    }
    found = analyse(recorded(walked().time_s, moved))
    for foot in ("left", "right"):
        for kind in KINDS:
            # Rounding alone: offsets take digits off sums of hundreds of newtons.
            assert times_of(found, foot, kind) == pytest.approx(times_of(analysed(), foot, kind), abs=1e-6)


def test_mirrored_feet_give_mirrored_results() -> None:
    other = {"left": "right", "right": "left"}
    mirrored = {
        f"{other[name.split('_', 1)[0]]}_{name.split('_', 1)[1]}": values for name, values in loads_of(walked()).items()
    }
    found = analyse(recorded(walked().time_s, mirrored), coverage=0.8)
    straight = analysed()
    for foot in ("left", "right"):
        for kind in KINDS:
            assert np.array_equal(times_of(found, foot, kind), times_of(straight, other[foot], kind))
        assert found.summary["stride_time_s"][foot] == straight.summary["stride_time_s"][other[foot]]
        assert found.summary["impulse_n_s"][foot] == straight.summary["impulse_n_s"][other[foot]]
        assert np.array_equal(found.feet[foot].centre, straight.feet[other[foot]].centre, equal_nan=True)
    for name, value in found.summary["right_over_left_percent"].items():
        assert value == pytest.approx(-straight.summary["right_over_left_percent"][name], rel=1e-9)
    assert found.summary["asymmetry_percent"] == pytest.approx(straight.summary["asymmetry_percent"])
    assert found.summary["double_support_percent"] == pytest.approx(straight.summary["double_support_percent"])


@given(shift_s=st.floats(-1e4, 1e5))
@settings(max_examples=5)
def test_a_shift_of_time_shifts_the_events(shift_s: float) -> None:
    found = analyse(recorded(walked().time_s + shift_s, loads_of(walked())), coverage=0.8)
    for foot in ("left", "right"):
        for kind in KINDS:
            # A time of 1e5 s holds 1.5e-11 s; even steps come from its first and last time.
            assert times_of(found, foot, kind) - shift_s == pytest.approx(times_of(analysed(), foot, kind), abs=1e-6)
    assert found.summary["cadence_steps_per_min"] == pytest.approx(analysed().summary["cadence_steps_per_min"])


@pytest.mark.parametrize("rate_hz", [100.0, 450.0, 1000.0])
def test_events_do_not_depend_on_the_sample_rate(rate_hz: float) -> None:
    made = [
        trial(Person(), Walk(1.3), 20.0, np.random.default_rng(6), sensors=False, sample_rate_hz=hz)
        for hz in (200.0, rate_hz)
    ]
    straight, other = (analyse(one.recording) for one in made)
    for foot in ("left", "right"):
        for kind in ("heel_strike", "toe_off"):
            # Straight lines between samples 10 ms apart miss a curved onset by a fraction of that.
            both = score(times_of(other, foot, kind), times_of(straight, foot, kind))
            assert both.missed == both.false == 0
            assert both.p95_ms < 3.0
    assert other.summary["cadence_steps_per_min"] == pytest.approx(straight.summary["cadence_steps_per_min"], rel=1e-3)
    assert other.summary["stance_percent"]["left"] == pytest.approx(straight.summary["stance_percent"]["left"], abs=0.5)


def test_uneven_samples_are_set_on_an_even_grid() -> None:
    rng = np.random.default_rng(7)
    keep = rng.random(walked().time_s.size) > 0.05
    columns = {name: values[keep] for name, values in loads_of(walked()).items()}
    found = analyse(recorded(walked().time_s[keep], columns))
    both = score(times_of(found, "left", "heel_strike"), times_of(analysed(), "left", "heel_strike"))
    assert both.missed == both.false == 0
    assert both.p95_ms < 5.0


# -- blocks ------------------------------------------------------------------------------------------------
def _left() -> np.ndarray:
    made = walked(90.0)
    return np.column_stack([made.recording[f"left_{region}"].values for region in ("toe", "meta1", "meta4", "heel")])


@settings(max_examples=6)
@given(sizes=st.lists(st.integers(1, 9000), min_size=1, max_size=12))
def test_blocks_of_any_size_give_the_numbers_of_the_whole(sizes: list[int]) -> None:
    loads = _left()
    detector = ContactDetector(200.0)
    whole = detector.apply(loads)
    told, start, number = [], 0, 0
    while start < len(loads):
        size = sizes[number % len(sizes)]
        told.append(detector.push(loads[start : start + size]))
        start, number = start + size, number + 1
    told.append(detector.finish())
    for name in ("strike_s", "toe_off_s", "onset_s", "release_s", "floor_time_s", "floor"):
        pieces = np.concatenate([getattr(part, name) for part in told])
        assert np.array_equal(pieces, getattr(whole, name), equal_nan=True)


def test_a_stream_holds_no_more_than_its_window() -> None:
    detector = ContactDetector(200.0, window_s=10.0)
    loads = _left()
    for start in range(0, len(loads), 100):
        detector.push(loads[start : start + 100])
        assert detector.held_samples <= 200 * (10 + 2 * 3) + 100


def test_a_detector_says_what_it_cannot_use() -> None:
    detector = ContactDetector(200.0)
    with pytest.raises(InputError, match="one column for each of toe"):
        detector.push(np.zeros((5, 3)))
    with pytest.raises(InputError, match="not finite"):
        detector.push(np.full((5, 4), np.nan))
    with pytest.raises(UsageError, match="sample_rate_hz is 0"):
        ContactDetector(0.0)
