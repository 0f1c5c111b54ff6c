"""Lags that several recordings show are put to one pair of clocks; a late reading of steps is no reversed one."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.signal import lfilter

from smartshoe.diagnosis import Thresholds, diagnose
from smartshoe.diagnosis._aligned import _is_load_known, aligned, with_lags_removed
from smartshoe.diagnosis._characteristic import friction_of
from smartshoe.integrity import OneClock, _own_clocks, examine
from smartshoe.integrity._clocks import UNSEEN, Lags, _correlation, _peak, one_clock
from smartshoe.integrity._own_clocks import Alone
from smartshoe.recording import Recording

STANDARD = Thresholds()
RATE_HZ = 100.0


def _seen(lag_s: Sequence[float], at_s: Sequence[float] | None = None) -> Lags:
    return Lags(np.array(at_s or 20.0 * np.arange(1.0, len(lag_s) + 1.0)), np.array(lag_s))


# -- by hand ----------------------------------------------------------------------------------------------------------
@given(
    before_s=st.floats(-0.5, 0.5),
    rate=st.floats(0.001, 0.01),
    ahead=st.booleans(),
    begins=st.lists(st.floats(5.0, 60.0), min_size=1, max_size=4),
    bin_s=st.sampled_from([0.0, 0.01, 0.02, 0.05]),
)
def test_lags_on_one_line_are_one_pair_of_clocks(
    before_s: float, rate: float, ahead: bool, begins: list[float], bin_s: float
) -> None:
    """Each lag is known to a bin; recordings differ in when they move."""
    rate = -rate if ahead else rate
    each = []
    for begin in begins:
        at_s = begin + 40.0 * np.arange(6.0)
        line = before_s + rate * at_s
        each.append(Lags(at_s, bin_s * np.rint(line / bin_s) if bin_s else line))
    longest = max(float(np.max(np.abs(one.lag_s))) for one in each)
    found = one_clock([*each, UNSEEN], STANDARD)
    if found is None:  # a bin may be more than a share of all lags
        assert bin_s > STANDARD.same * longest
        return
    for one in each:
        off = found.before_s + found.rate * one.at_s - one.lag_s
        assert np.quantile(np.abs(off), 0.75) <= STANDARD.same * longest * (1.0 + 1e-9)
    if not found.rate:
        return  # a delay that wanders by less than a share of itself
    if not bin_s:
        assert (found.before_s, found.rate) == (pytest.approx(before_s, abs=1e-9), pytest.approx(rate))


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_lags_within_a_share_of_the_longest_are_one_delay(sign: float) -> None:
    for other, is_one in ((0.751, True), (0.749, False)):
        found = one_clock([_seen([sign] * 3), _seen([sign * other] * 3)], STANDARD)
        assert found == (OneClock(pytest.approx(sign * 0.5 * (1.0 + other)), 0.0) if is_one else None)


def test_nothing_is_shared_where_nothing_is_seen() -> None:
    assert one_clock([], STANDARD) is None
    assert one_clock([UNSEEN, UNSEEN], STANDARD) is None
    assert one_clock([UNSEEN, _seen([0.3])], STANDARD) == OneClock(0.3, 0.0)


def test_a_delay_that_wanders_is_one_until_most_of_its_moments_are_off() -> None:
    for wanders, is_one in ((0.24, True), (0.27, False)):
        found = one_clock([_seen([1.0, 1.0 + wanders, 1.0 - wanders, 1.0 + wanders, 1.0 - wanders, 1.0])], STANDARD)
        assert (found == OneClock(1.0, 0.0)) is is_one
    # A moment or two that are off by a step of a walk, say, change nothing.
    assert one_clock([_seen([0.3] * 7 + [1.3])], STANDARD) == OneClock(0.3, 0.0)


def test_recordings_of_two_pairs_of_clocks_share_none() -> None:
    drifts = [0.04, 0.08, 0.12, 0.16]
    assert one_clock([_seen(drifts), _seen(drifts)], STANDARD) == OneClock(pytest.approx(0.0), pytest.approx(0.002))
    assert one_clock([_seen(drifts), _seen([-one for one in drifts])], STANDARD) is None
    assert one_clock([_seen(drifts), _seen([0.5 + one for one in drifts])], STANDARD) is None


# -- readings ---------------------------------------------------------------------------------------------------------
def _walked(late_s: float, seed: int = 1, *, held: bool = True, slow_share: float = 0.05) -> Recording:
    """Steps of about a second, and then a few loads that are ``held``, read ``late_s`` late; a share follows slowly."""
    rng = np.random.default_rng(seed)
    time_s = np.arange(0.0, 90.0, 1.0 / RATE_HZ)
    load = np.zeros(time_s.size)
    begins_s = 2.0
    while begins_s < 40.0:
        lasts_s, height = 0.62 + 0.06 * rng.standard_normal(), 0.85 + 0.1 * rng.random()
        share = (time_s - begins_s) / lasts_s
        there = (share > 0.0) & (share < 1.0)
        load[there] += height * np.sin(np.pi * share[there]) * (1.0 + 0.4 * np.cos(2.0 * np.pi * share[there])) / 1.4
        begins_s += 1.05 + 0.05 * rng.standard_normal()
    if held:
        load += np.interp(
            time_s, [45.0, 48.0, 60.0, 62.0, 70.0, 71.0, 80.0, 82.0], [0.0, 0.6, 0.6, 0.0, 0.0, 0.4, 0.4, 0.0]
        )
    read = np.interp(time_s - late_s, time_s, load)
    keep = float(np.exp(-1.0 / RATE_HZ / 3.0))
    slow = lfilter([1.0 - keep], [1.0, -keep], read)
    return Recording.from_arrays(
        time_s=time_s,
        force_n=800.0 * load + rng.normal(0.0, 0.5, time_s.size),
        pressure_mbar=100.0 * (read + slow_share * slow) + rng.normal(0.0, 0.1, time_s.size),
        name=f"walked_{seed}",
    )


def _ramps(late_s: float, drift: float = 0.0, seed: int = 2, step_s: float = 20.0) -> Recording:
    """Triangles and holds whose reading's clock begins ``late_s`` late and falls behind by ``drift``."""
    rng = np.random.default_rng(seed)
    corners_s: NDArray[np.float64] = np.cumsum(np.tile([2.0, 4.0, 0.3 * step_s, 4.0, 0.7 * step_s], 6))
    loads = np.tile([0.0, 1.0, 1.0, 0.0, 0.0], 6) * np.repeat(rng.uniform(0.4, 1.0, 6), 5)
    time_s = np.arange(0.0, corners_s[-1], 1.0 / RATE_HZ)
    return Recording.from_arrays(
        time_s=time_s,
        force_n=800.0 * np.interp(time_s, corners_s, loads) + rng.normal(0.0, 0.5, time_s.size),
        pressure_mbar=100.0 * np.interp(time_s * (1.0 - drift) - late_s, corners_s, loads)
        + rng.normal(0.0, 0.1, time_s.size),
        name=f"ramps_{seed}",
    )


@pytest.mark.parametrize("known_s", [(0.0, 300.0), (60.0, 300.0), (99.0, 300.0), (0.0, 198.0)])
@pytest.mark.parametrize("missing", ["reading", "load"])
def test_a_lag_is_counted_from_the_recordings_start_also_where_an_end_is_missing(
    known_s: tuple[float, float], missing: str
) -> None:
    late_s, drift = 0.5, 0.005
    whole = _ramps(late_s, drift, step_s=40.0)
    channel = whole.load if missing == "load" else whole.sensor
    there = (whole.time_s >= known_s[0]) & (whole.time_s <= known_s[1])
    found = examine([whole.with_channel(channel.with_values(np.where(there, channel.values, np.nan)))], STANDARD)
    assert found.one_clock == OneClock(pytest.approx(late_s, abs=0.03), pytest.approx(drift, rel=0.05))
    assert found.clock_offset_s == pytest.approx((late_s + 0.5 * drift * whole.duration_s,), abs=0.03)


def _reversed(recording: Recording) -> Recording:
    return recording.with_channel(replace(recording.sensor, values=-recording.sensor.values))


@pytest.mark.parametrize("late_s", [0.0, 0.05, 0.2, 0.25, 0.3, 0.35])
def test_a_walk_that_is_read_late_does_not_fall_as_the_load_rises(late_s: float) -> None:
    """By a quarter of a step the reading is high where the load is low."""
    found = examine([_walked(late_s)], STANDARD)
    assert "wrong_sign" not in {fault.kind for fault in found.faults}
    if found.clock_offset_s[0]:
        assert found.clock_offset_s[0] == pytest.approx(late_s, abs=0.06)


@pytest.mark.parametrize("late_s", [0.0, 0.3, 0.4, 0.45, 0.5, -0.4])
def test_nor_does_one_of_steps_alone_that_is_read_late_by_half_of_one(late_s: float) -> None:
    """It follows turned over, and far more closely as it is."""
    found = examine([_walked(late_s, held=False)], STANDARD)
    assert "wrong_sign" not in {fault.kind for fault in found.faults}
    assert found.clock_offset_s[0] == pytest.approx(late_s, abs=0.02)


@pytest.mark.parametrize(
    "late_s", [-2.5, 1.6, 3.0, *(pytest.param(late_s, marks=pytest.mark.long) for late_s in (-2.0, 2.0, 2.5))]
)
@pytest.mark.parametrize("seed", [2, pytest.param(3, marks=pytest.mark.bank)])
def test_steps_are_read_as_late_as_they_are_alone_and_beside_others(late_s: float, seed: int) -> None:
    """Late by more than a step: no two steps are alike, so that the reading follows its own far more closely."""
    alone, beside = _walked(late_s, seed, held=False), _ramps(late_s)
    found = examine([alone], STANDARD)
    assert {fault.kind for fault in found.faults} == {"two_clocks"}
    assert found.clock_offset_s == pytest.approx((late_s,), abs=0.005)
    found = examine([beside, alone], STANDARD)
    assert {fault.kind for fault in found.faults} == {"two_clocks"}
    assert found.clock_offset_s == pytest.approx((late_s, late_s), abs=0.05)
    assert found.one_clock is not None


@given(
    seed=st.integers(0, 2**31),
    size=st.integers(400, 800),
    lag=st.integers(-50, 50),
    offset=st.floats(-5.0, 5.0),
    scale=st.floats(0.1, 10.0),
)
def test_what_lags_correlates_wholly_at_its_lag_however_long(
    seed: int, size: int, lag: int, offset: float, scale: float
) -> None:
    """Of what overlaps, whatever zero and gain the reading has: 1 at its own lag, and nowhere more."""
    longest = 100
    load = np.random.default_rng(seed).standard_normal(size + 2 * longest)
    reading = offset + scale * load[longest - lag : longest - lag + size]
    found = _correlation(load[longest : longest + size], reading, longest, STANDARD)
    assert found.size == 2 * longest + 1
    assert np.max(np.abs(found)) <= 1.0
    assert found[longest + lag] == pytest.approx(1.0, abs=1e-9)
    assert _peak(found, STANDARD) == longest + lag


def test_of_peaks_that_are_as_high_the_one_nearest_to_no_lag_is_taken() -> None:
    even = np.cos(2.0 * np.pi * np.arange(-100, 101) / 40.0)
    nudged = even - 0.1
    nudged[100 + 40] = 1.0 - 0.06
    assert _peak(nudged, STANDARD) == 100
    nudged[100 + 40] = 1.0 - 0.04  # far closer
    assert _peak(nudged, STANDARD) == 140
    nudged = even - 7e-4
    nudged[100 + 40] = 1.0  # closer by what a unit itself does
    assert _peak(nudged, STANDARD) == 100


def test_a_period_that_is_as_long_as_the_longest_lag_is_one_of_the_peaks() -> None:
    even = np.cos(2.0 * np.pi * np.arange(-100, 101) / 100.0) - 0.03
    even[[0, -1]] += 0.01  # a gain that drifts
    assert _peak(even, STANDARD) == 100


@pytest.mark.long
@pytest.mark.parametrize(
    ("presses", "power", "rate_hz"),
    [
        (6, 0.5, 5.0),
        (6, 1.0, 20.0),
        (7, 2.0, 20.0),
    ],
)
def test_a_reading_that_falls_over_a_few_even_presses_has_a_baseline_that_follows_it(
    presses: int, power: float, rate_hz: float
) -> None:
    """Their period may be the longest lag that is looked for; smoothed by much they are sines."""
    place = presses * np.arange(193) / 193.0
    load = 26.0 * np.maximum(np.sin(2.0 * np.pi * (place - 0.25)), 0.0) ** power * (1.0 + 0.05 * place)
    noise = np.random.default_rng(2).standard_normal((2, place.size))
    read = 1300.0 - 230.0 * np.sqrt(load) + 3.0 * noise[0]
    time_s = np.arange(place.size) / rate_hz
    run = Recording.from_arrays(time_s=time_s, force_n=load + 0.02 * noise[1], pressure_counts=read)
    found = diagnose(run)
    assert found.baseline is not None
    assert found.baseline.fit_percent > 60.0
    assert found.extended is not None
    assert found.extended.rmse < 0.5 * found.baseline.rmse
    assert found.causes[0].effect.kind == "static_curve"


def test_what_rises_to_the_longest_lag_is_no_peak() -> None:
    rising = np.linspace(0.0, 1.0, 201)
    assert _peak(rising, STANDARD) is None
    assert _peak(rising[::-1], STANDARD) is None


@pytest.mark.parametrize("late_s", [0.3, 0.4])
def test_even_strokes_that_are_read_late_are_turned_over_where_others_show_by_how_much(late_s: float) -> None:
    """Even triangles look the same from above: by themselves they may as well fall as the load rises."""
    rng = np.random.default_rng(5)
    time_s = np.arange(0.0, 60.0, 1.0 / RATE_HZ)

    def stroked(at_s: NDArray[np.float64]) -> NDArray[np.float64]:
        return 2.0 * np.abs(at_s % 1.0 - 0.5) * np.interp(at_s, [0.0, 60.0], [0.7, 1.0])

    even = Recording.from_arrays(
        time_s=time_s,
        force_n=800.0 * stroked(time_s) + rng.normal(0.0, 0.5, time_s.size),
        pressure_mbar=100.0 * stroked(time_s - late_s) + rng.normal(0.0, 0.1, time_s.size),
        name="even",
    )
    assert "wrong_sign" in {fault.kind for fault in examine([even], STANDARD).faults}
    found = examine([_ramps(late_s), even], STANDARD)
    assert {fault.kind for fault in found.faults} == {"two_clocks"}
    assert found.one_clock == OneClock(pytest.approx(late_s, abs=0.03), 0.0)


def test_a_reversed_reading_among_others_on_one_clock_stays_so() -> None:
    found = examine([_ramps(0.0), _reversed(_ramps(0.0, seed=4))], STANDARD)
    assert [(fault.kind, fault.recording) for fault in found.faults] == [("wrong_sign", 1)]


@pytest.mark.parametrize("period_s", [0.8, 2.0, 10.0])
@pytest.mark.parametrize("unit", ["mbar", "counts"])
def test_a_reading_that_falls_is_late_by_no_half_of_a_period(period_s: float, unit: str) -> None:
    """Even triangles look the same from above: half a period later the one is the other turned over."""
    rng = np.random.default_rng(3)
    time_s = np.arange(0.0, 90.0, 1.0 / RATE_HZ)
    load = np.abs((time_s / period_s) % 1.0 - 0.5) * np.interp(time_s, [5.0, 80.0], [1.0, 0.6]) * (time_s < 84.0)
    recording = Recording.from_arrays(
        time_s=time_s,
        force_n=800.0 * load + rng.normal(0.0, 0.5, time_s.size),
        **{f"pressure_{unit}": 100.0 - 100.0 * load + rng.normal(0.0, 0.1, time_s.size)},
    )
    found = examine([recording], STANDARD)
    assert found.clock_offset_s == (0.0,)
    assert ("wrong_sign" in {fault.kind for fault in found.faults}) == (unit == "mbar")


@pytest.mark.parametrize("late_s", [0.0, 0.25])
def test_a_walk_whose_reading_is_reversed_is_told_so_however_late(late_s: float) -> None:
    walked = _walked(late_s)
    assert "wrong_sign" in {fault.kind for fault in examine([_reversed(walked)], STANDARD).faults}


@pytest.mark.parametrize("drift", [0.0, 0.0005])
def test_what_is_late_by_a_quarter_of_its_period_is_no_friction(drift: float) -> None:
    """The reading then goes with the direction of the load rather than with it."""
    time_s = np.arange(0.0, 60.0, 1.0 / RATE_HZ)
    late_s = 0.25 + drift * time_s

    def load(at_s: NDArray[np.float64]) -> NDArray[np.float64]:
        return 0.5 * (1.0 - np.cos(2.0 * np.pi * at_s)) * (1.0 + 0.1 * np.sin(0.7 * at_s))

    swayed = Recording.from_arrays(
        time_s=time_s, force_n=800.0 * load(time_s), pressure_mbar=100.0 * load(time_s - late_s), name="swayed"
    )
    assert "its direction" in str(friction_of(swayed, STANDARD))
    whole = [swayed.sensor.present]
    assert with_lags_removed([swayed], whole, None) == [swayed]
    (moved,) = with_lags_removed([swayed], whole, OneClock(0.25, drift))
    assert friction_of(moved, STANDARD) is None
    assert np.max(np.abs(moved.sensor.values - 100.0 * load(time_s))[100:-100]) < 1.0


def test_what_relaxes_through_a_hold_is_not_turned_over_by_what_looks_like_a_lag() -> None:
    """A ramp of a second, held for thirty, of a wall that gives way: most of the hold the reading falls."""
    time_s = np.arange(0.0, 33.0, 1.0 / 32.0)
    load = 20.0 * np.interp(time_s, [0.0, 1.0, 2.0, 32.0, 33.0], [0.0, 0.0, 1.0, 1.0, 0.0])
    fade = np.exp(-1.0 / 32.0 / 3.0)
    reading = 20.0 * load - 0.7 * 20.0 * lfilter([1.0 - fade], [1.0, -fade], load)
    runs = [
        Recording.from_arrays(time_s=time_s, force_n=load, pressure_mbar=reading + offset, name=f"held_{offset:g}")
        for offset in (0.0, 15.0, -90.0)
    ]
    whole = [run.sensor.present for run in runs]
    for lag_s in (8.0, 20.0, 40.0):
        assert with_lags_removed(runs, whole, OneClock(lag_s, 0.0)) == runs
    found = diagnose(runs[:2], hold_out=runs[2])
    assert found.baseline_model is not None
    assert found.baseline_model.full_scale_reading > 0.0
    assert found.baseline is not None
    assert found.baseline.variance_explained_percent > 95.0


def test_a_walk_shares_the_delay_that_ramps_show() -> None:
    runs = [_ramps(0.25), _walked(0.25, slow_share=0.0)]
    integrity = examine(runs, STANDARD)
    assert integrity.clock_offset_s[0] == pytest.approx(0.25, abs=0.06)
    ((one, value),) = aligned(runs, integrity).parts
    assert (one.name, float(value[0])) == ("delay", pytest.approx(0.25, abs=0.06))


@pytest.mark.long
def test_and_it_is_found_to_milliseconds_for_both() -> None:
    runs = [_ramps(0.25), _walked(0.25, slow_share=0.0)]
    found = diagnose(runs, hold_out=[_ramps(0.25, seed=3)])
    (cause,) = [cause for cause in found.causes if cause.name == "delay"]
    assert cause.parameters["delay"].value == pytest.approx(0.25, abs=0.005)
    assert not any("was shifted to" in said for said in found.limits)


def test_a_drift_that_one_recording_tells_and_others_follow_is_one_cause() -> None:
    """A long one shows two clocks; a shorter one is late by less than is told, but on the same line."""
    drift = 0.0015
    runs = [_ramps(0.0, drift, step_s=40.0), _ramps(0.0, drift, seed=4, step_s=10.0)]
    integrity = examine(runs, STANDARD)
    assert [bool(one) for one in integrity.clock_offset_s] == [True, False]
    parts = aligned(runs, integrity).parts
    assert [one.name for one, _ in parts] == ["clock_drift", "delay"]
    assert float(parts[0][1][0]) == pytest.approx(drift, rel=0.25)
    causes = {cause.name: cause for cause in diagnose(runs, hold_out=[_ramps(0.0, drift, seed=5)]).causes}
    assert causes["clock_drift"].parameters["clock_rate_error"].value == pytest.approx(drift, rel=0.02)


@pytest.mark.parametrize(("parts", "own"), [(0.0, {}), (0.3, {2: 0.3})])
def test_what_one_pair_of_clocks_accounts_for_is_no_lag_of_a_recordings_own(
    monkeypatch: pytest.MonkeyPatch, parts: float, own: dict[int, float]
) -> None:
    """Clocks that part by a tenth of a second in five minutes, too little to be told of any recording alone."""
    rate = -3.4e-4
    each = [
        _seen([rate * at_s for at_s in moments], moments) for moments in ([20, 130, 270], [30, 250], [60, 110, 190])
    ]
    each[2] = replace(each[2], lag_s=each[2].lag_s + parts)
    monkeypatch.setattr(_own_clocks, "own_lags_s", lambda *told: {2: parts or -0.0376})
    runs = [_ramps(0.0, rate)] * 3
    found = _own_clocks.clocks_of(
        runs, [run.sensor.present for run in runs], [Alone(lags=one) for one in each], 3, STANDARD
    )
    assert {place: by.before_s for place, by in found.own.items()} == own
    assert (found.shared is None) is bool(own)
    if not own:
        assert found.shared == OneClock(pytest.approx(0.0, abs=0.03), pytest.approx(rate, rel=0.02))


# -- diagnoses --------------------------------------------------------------------------------------------------------
def _parted(recording: Recording, late_s: float) -> Recording:
    """What was logged while both clocks ran, the reading's ``late_s`` (early where negative) after the load's."""
    by = round(abs(late_s) * RATE_HZ)
    ahead, behind = slice(by, None), slice(None, len(recording) - by)
    load, read = (ahead, behind) if late_s > 0.0 else (behind, ahead)
    return Recording.from_arrays(
        time_s=recording.time_s[behind],
        force_n=recording.force_n[load],
        pressure_mbar=recording.sensor.values[read],
        name=recording.name,
    )


@pytest.mark.parametrize(
    "late_s", [-2.0, 0.5, *(pytest.param(late_s, marks=pytest.mark.long) for late_s in (-0.5, -0.3, 0.3, 1.2, 2.0))]
)
@pytest.mark.parametrize("made", [lambda: _walked(0.0, held=False), lambda: _ramps(0.0)], ids=["steps", "ramps"])
def test_a_recording_alone_that_is_late_or_early_is_that_and_nothing_else(
    made: Callable[[], Recording], late_s: float
) -> None:
    """Low where the load is high it is no falling reading, on its way where the load rests it has no offset."""
    found = diagnose([_parted(made(), late_s)])
    assert [cause.name for cause in found.causes] == ["delay"]
    assert found.causes[0].parameters["delay"].value == pytest.approx(late_s, abs=0.002)
    assert found.verdict == "explained"
    assert found.full_scale_reading > 0.0
    assert {fault.kind for fault in found.data_faults} == {"two_clocks"}


@given(before_s=st.floats(-3.0, 3.0), rate=st.floats(-0.01, 0.01), begins_s=st.floats(-5.0, 1e6))
def test_a_reading_is_used_where_the_load_that_it_follows_was_logged(
    before_s: float, rate: float, begins_s: float
) -> None:
    time_s = begins_s + 0.1 * np.arange(600)
    recording = Recording.from_arrays(time_s=time_s, force_n=np.ones(600), pressure_mbar=np.ones(600))
    clock = OneClock(before_s, rate)
    lasted_s = time_s - time_s[0]
    followed_s = lasted_s - before_s - rate * lasted_s
    known = _is_load_known(recording, clock)
    assert np.array_equal(known, (followed_s >= 0.0) & (followed_s <= lasted_s[-1]))
    assert known.sum() >= 600 - (abs(before_s) + 60.0 * abs(rate)) / 0.1 - 2
