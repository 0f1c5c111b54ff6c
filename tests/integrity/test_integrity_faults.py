"""Each fault of the data, hidden in a simulated unit's recording at a drawn strength, is found, named and masked."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from test_integrity_clean import simulated

from smartshoe import diagnose
from smartshoe.integrity import Integrity, examine
from smartshoe.integrity._hum import aliases
from smartshoe.integrity._quantisation import _usual
from smartshoe.integrity.thresholds import Thresholds
from smartshoe.protocol import Protocol, dynamic_protocol, static_protocol
from smartshoe.recording import Channel, Recording
from smartshoe.signals.lags import lagged

Array = NDArray[np.float64]

PROTOCOLS = st.sampled_from([static_protocol((100.0, 500.0, 800.0)), dynamic_protocol()])
SEEDS = st.integers(0, 999)
NOISES_PERCENT = st.sampled_from([0.05, 0.1, 0.3])
RECALL, FALSELY_MASKED = 0.95, 0.005
STEP_MBAR = 0.03  # of the simulated converter


def recorded(protocol: Protocol, seed: int, noise_percent: float = 0.05) -> Recording:
    """A left toe: 100 mbar over its range, so that a per cent is a millibar."""
    return simulated(protocol, seed, sensor={"noise_percent": noise_percent})


def with_reading(recording: Recording, reading: Array) -> Recording:
    sensor = recording.sensor
    return recording.with_channel(Channel.from_values(sensor.name, reading, sensor.unit, sensor.role))


def on_lattice(reading: Array) -> Array:
    return np.asarray(np.rint(reading / STEP_MBAR) * STEP_MBAR)


def kinds(found: Integrity) -> set[str]:
    return {fault.kind for fault in found.faults}


def recall_and_false(found: Integrity, bad: NDArray[np.bool_], touched: NDArray[np.bool_]) -> tuple[float, float]:
    """Share of ``bad`` samples that are masked (1 where one is missed), and of samples that were not ``touched``."""
    masked = ~found.usable[0]
    missed = int((~masked[bad]).sum())
    # One sample missed of a handful says nothing of a share.
    return 1.0 if missed <= 1 else 1.0 - missed / int(bad.sum()), float(masked[~touched].mean())


@settings(max_examples=12)
@given(PROTOCOLS, SEEDS, NOISES_PERCENT, st.floats(16.0, 300.0), st.floats(-3.3, -2.0))
def test_spikes(protocol, seed, noise_percent, deviations, share_exponent):
    rng = np.random.default_rng(seed)
    recording = recorded(protocol, seed, noise_percent)
    at = rng.choice(len(recording), max(3, int(len(recording) * 10**share_exponent)), replace=False)
    reading = recording.sensor.values.copy()
    reading[at] += rng.choice([-1.0, 1.0], at.size) * rng.uniform(1.0, 2.0, at.size) * deviations * noise_percent
    found = examine([with_reading(recording, reading)])
    bad = np.zeros(reading.size, dtype=bool)
    bad[at] = True
    recall, false = recall_and_false(found, bad, bad)
    assert kinds(found) == {"spikes"}
    assert recall >= RECALL
    assert false < FALSELY_MASKED


@settings(max_examples=8)
@given(PROTOCOLS, SEEDS, st.floats(40.0, 300.0))
def test_spikes_of_the_reference_load(protocol, seed, size_n):
    rng = np.random.default_rng(seed)
    recording = recorded(protocol, seed)
    at = rng.choice(len(recording), 15, replace=False)
    load = recording.load.values.copy()
    load[at] += rng.choice([-1.0, 1.0], 15) * size_n
    found = examine([recording.with_channel(replace(recording.load, values=load))])
    bad = np.zeros(load.size, dtype=bool)
    bad[at] = True
    recall, false = recall_and_false(found, bad, bad)
    assert kinds(found) == {"spikes"}
    assert "reference load" in found.faults[0].says
    assert recall >= RECALL
    assert false < FALSELY_MASKED


@settings(max_examples=12)
@given(PROTOCOLS, SEEDS, NOISES_PERCENT, st.integers(10, 100), st.floats(0.01, 0.1))
def test_held_samples(protocol, seed, noise_percent, length, share):
    rng = np.random.default_rng(seed)
    recording = recorded(protocol, seed, noise_percent)
    reading = recording.sensor.values.copy()
    touched = np.zeros(reading.size, dtype=bool)
    for start in rng.integers(1, reading.size - length - 1, max(3, int(share * reading.size / length))):
        reading[start : start + length] = reading[start - 1]
        touched[start : start + length] = True
    bad = np.abs(reading - recording.sensor.values) > 8.0 * noise_percent + 8.0 * STEP_MBAR
    found = examine([with_reading(recording, reading)])
    assert "held_samples" in kinds(found)
    if bad.any():
        recall, false = recall_and_false(found, bad, touched)
        assert recall >= RECALL
        assert false < FALSELY_MASKED


@settings(max_examples=12)
@given(SEEDS, NOISES_PERCENT, st.floats(0.55, 0.95), st.booleans())
def test_a_channel_that_freezes_is_held_until_the_end_or_since_the_beginning(seed, noise_percent, share, is_end):
    """It catches up with nothing, so that the load alone tells, by more than a quarter of its span.

    Near the top it may pass for saturation.
    """
    recording = recorded(dynamic_protocol(), seed, noise_percent)
    reading = recording.sensor.values.copy()
    at = round((share if is_end else 1.0 - share) * reading.size)
    frozen = slice(at, None) if is_end else slice(None, at + 1)
    assume((reading[at] - reading.min()) / np.ptp(reading) > 0.1)
    assume(np.ptp(recording.load.values[frozen]) > 0.3 * np.ptp(recording.load.values))
    is_near_top = (reading[at] - reading.min()) / np.ptp(reading) > 0.8
    reading[frozen] = reading[at]
    found = examine([with_reading(recording, reading)])
    assert kinds(found) & {"held_samples", *(["saturation"] if is_near_top else [])}
    masked = np.zeros(reading.size, dtype=bool)
    masked[frozen] = True
    assert np.mean(found.usable[0][masked]) < FALSELY_MASKED
    assert np.mean(~found.usable[0][~masked]) < FALSELY_MASKED


@pytest.mark.parametrize("lengths", [(16, 25), (40, 6), (30, 12, 20)])
@pytest.mark.parametrize("seed", range(3))
def test_dropouts_with_one_good_sample_between_them_are_all_left_out(seed, lengths):
    recording = recorded(dynamic_protocol(), seed)
    reading, gone = recording.sensor.values.copy(), np.zeros(len(recording), dtype=bool)
    start = int(np.flatnonzero(recording.load.values > 500.0)[0])
    for length in lengths:
        gone[start : start + length] = True
        start += length + 1
    reading[gone] = 0.5 + 1e-4 * np.arange(gone.sum())  # no value that comes again
    found = examine([with_reading(recording, reading)])
    assert kinds(found) == {"dropouts"}
    assert np.array_equal(~found.usable[0], gone)


@settings(max_examples=12)
@given(
    PROTOCOLS,
    SEEDS,
    NOISES_PERCENT,
    st.integers(3, 200),
    st.floats(0.005, 0.05),
    st.sampled_from(["rail", "rest", "0"]),
)
def test_dropouts(protocol, seed, noise_percent, length, share, level):
    rng = np.random.default_rng(seed)
    recording = recorded(protocol, seed, noise_percent)
    clean = recording.sensor.values
    reading, rest = clean.copy(), float(np.median(clean[:30]))
    value = {"rail": -12.5, "rest": rest, "0": 0.0}[level]
    touched = np.zeros(reading.size, dtype=bool)
    starts = rng.integers(1, reading.size - length - 1, max(3, int(share * reading.size / length)))
    for start in starts:
        reading[start : start + length] = value
        touched[start : start + length] = True
    loaded = clean > 8.0 + 30.0 * noise_percent  # below, a dropout is rest
    bad = touched & loaded
    if bad.sum() < 3:
        return
    found = examine([with_reading(recording, reading)])
    recall, false = recall_and_false(found, bad, touched)
    assert recall >= RECALL
    assert false < FALSELY_MASKED
    # Falls from low loads alone may be a logger that held its rest, or a rail: masked all the same.
    falls_from_high = float((clean[starts] - rest).max()) > 0.4 * float(np.ptp(clean))
    assert kinds(found) & ({"dropouts"} if falls_from_high else {"dropouts", "held_samples", "low_rail"})


def test_where_a_sensor_ends_in_one_recording_it_ends_in_the_others() -> None:
    """Also in one that rests there for most of its time, which is of use all the same."""
    one = recorded(dynamic_protocol(), 3)
    longer = np.full(2 * len(one), 6.0)
    rested = Recording.from_arrays(
        time_s=one.sample_time_s * np.arange(len(one) + longer.size),
        force_n=np.concatenate([one.load.values, 0.0 * longer]),
        pressure_mbar=np.concatenate([np.maximum(one.sensor.values, 6.0), longer]),
    )
    assert "low_rail" not in kinds(examine([rested]))
    found = examine([with_reading(one, np.maximum(one.sensor.values, 6.0)), rested])
    assert [(fault.kind, fault.recording) for fault in found.faults] == [("low_rail", 0), ("low_rail", 1)]
    assert found.refusals == ()
    assert np.array_equal(found.usable[1], rested.sensor.values > 6.0)
    assert 3 * found.usable[1].sum() < len(rested)
    # Of one that leaves its end at once under load, the readings at rest are told.
    pressed = np.tile(np.repeat([0.0, 300.0, 0.0, 500.0], 150), 6)
    steps = Recording.from_arrays(
        time_s=one.sample_time_s * np.arange(pressed.size), force_n=pressed,
        pressure_mbar=np.where(pressed > 0.0, 0.15 * pressed + 0.01 * np.sin(np.arange(pressed.size)), 6.0),
    )  # fmt: skip
    found = examine([with_reading(one, np.maximum(one.sensor.values, 6.0)), steps])
    (said,) = [fault.says for fault in found.faults if (fault.kind, fault.recording) == ("low_rail", 1)]
    assert said.startswith(f"{np.sum(pressed == 0.0)} readings are exactly 6 mbar at rest: the sensor cannot go lower")
    high, cut = recorded(dynamic_protocol(), 4), recorded(dynamic_protocol((200.0, 760.0)), 5)
    top = 0.94 * float(high.sensor.values.max())
    both = [with_reading(run, np.minimum(run.sensor.values, top)) for run in (high, cut)]
    found = examine(both)
    assert {(fault.kind, fault.recording) for fault in found.faults} >= {("saturation", 0)}
    for mask, run in zip(found.usable, both, strict=True):
        assert not mask[run.sensor.values == top].any()


@settings(max_examples=12)
@given(PROTOCOLS, SEEDS, NOISES_PERCENT, st.sampled_from([1.05, 1.3, 3.0]), st.integers(3, 40))
def test_a_reading_that_drops_out_to_its_upper_end(protocol, seed, noise_percent, times, length):
    """As that of a wire that breaks, which an input pulls up."""
    rng = np.random.default_rng(seed)
    recording = recorded(protocol, seed, noise_percent)
    clean = recording.sensor.values
    reading, bad = clean.copy(), np.zeros(clean.size, dtype=bool)
    for start in rng.integers(1, reading.size - length - 1, 6):
        bad[start : start + length] = True
    reading[bad] = times * float(np.ptp(clean)) + float(clean.min())
    found = examine([with_reading(recording, reading)])
    assert kinds(found) == {"dropouts"}
    assert recall_and_false(found, bad & (clean < 0.7 * clean.max()), bad) == (1.0, 0.0)
    assert recall_and_false(found, bad, bad)[0] >= RECALL


def test_pulses_of_pressure_are_no_dropouts_to_an_end() -> None:
    recording = recorded(dynamic_protocol(), 5)
    reading, rng = recording.sensor.values.copy(), np.random.default_rng(5)
    for start in rng.integers(1, reading.size - 21, 6):
        reading[start : start + 20] = 120.0 + 0.5 * rng.standard_normal(20)
    assert "dropouts" not in kinds(examine([with_reading(recording, reading)]))


def test_of_several_recordings_each_dropout_to_an_end_is_said_once() -> None:
    recording, rng = recorded(dynamic_protocol(), 6), np.random.default_rng(6)
    both = []
    for _ in range(2):
        reading = recording.sensor.values.copy()
        for start in rng.integers(1, reading.size - 21, 6):
            reading[start : start + 20] = 110.0
        both.append(with_reading(recording, reading))
    found = examine(both)
    assert [(fault.kind, fault.recording) for fault in found.faults] == [("dropouts", 0), ("dropouts", 1)]
    assert all("to about 110 mbar" in fault.says for fault in found.faults)


@settings(max_examples=12)
@given(PROTOCOLS, SEEDS, NOISES_PERCENT, st.integers(3, 40))
def test_a_load_that_drops_out_is_missing(protocol, seed, noise_percent, length):
    rng = np.random.default_rng(seed)
    recording = recorded(protocol, seed, noise_percent)
    load_n, bad = recording.load.values.copy(), np.zeros(len(recording), dtype=bool)
    loaded = np.flatnonzero(np.convolve(load_n < 60.0, np.ones(100), "same") == 0.0)
    for start in rng.choice(loaded, 6):
        bad[start : start + length] |= load_n[start : start + length] > 60.0
    load_n[bad] = 0.0
    found = examine([recording.with_channel(replace(recording.load, values=load_n))])
    assert kinds(found) == {"dropouts"}
    assert found.faults[0].says.startswith("the reference load drops out")
    gone = ~found.recordings[0].load.present
    assert np.array_equal(gone, ~found.usable[0])
    # Where the reading falls by half meanwhile the unit may have been unloaded.
    assert (gone[bad].mean() > 0.9, gone[~bad].any()) == (True, False)


@pytest.mark.parametrize("noise_n", [0.0, 0.5])
@pytest.mark.parametrize("lag_s", [0.5, 1.5, 3.0])
def test_a_load_that_leaves_a_slow_unit_for_a_while_has_not_dropped_out(lag_s: float, noise_n: float) -> None:
    """Its reading is on its way down until the load is back. A force plate writes nothing below a threshold."""
    time_s = np.arange(0.0, 60.0, 0.01)
    load_n = np.where(time_s % 3.0 < 2.5, 500.0, 0.0) * (time_s > 2.0)
    load_n += np.where(load_n > 0.0, noise_n, 0.0) * np.random.default_rng(2).standard_normal(time_s.size)
    reading = 0.1 * lagged(load_n, 0.01, lag_s) + 0.1 * np.random.default_rng(1).standard_normal(time_s.size)
    found = examine([Recording.from_arrays(time_s=time_s, force_n=load_n, pressure_mbar=reading)])
    assert "dropouts" not in kinds(found)


@settings(max_examples=8)
@given(PROTOCOLS, SEEDS, st.floats(0.5, 5.0))
def test_a_coarse_lattice_is_a_fault(protocol, seed, step_percent):
    recording = recorded(protocol, seed)
    step = 0.84 * step_percent  # the unit reaches 84 mbar
    found = examine([with_reading(recording, np.rint(recording.sensor.values / step) * step)])
    assert kinds(found) == {"quantisation"}
    said = float(found.faults[0].says.split(" of ")[1].split(" mbar")[0])
    assert said == pytest.approx(step, rel=1e-3)
    assert found.faults[0].error == pytest.approx(step / np.sqrt(12.0), rel=1e-3)
    assert found.usable[0].all()


def test_the_way_from_one_plateau_to_the_next_is_no_step_of_a_lattice():
    assert _usual(np.array([0.0, 7.0, 7.0, 7.5, 7.0, 120.0, 7.0, 300.0]), Thresholds()) == 7.0


@settings(max_examples=6)
@given(PROTOCOLS, SEEDS, st.floats(0.01, 0.1), st.floats(0.5, 4.0))
def test_steps_that_grow_with_the_reading_are_a_lattice(protocol, seed, step, mu):
    # A logarithmic code, as telephony has it (ITU-T G.711).
    recording = recorded(protocol, seed)
    code = np.log1p(mu * np.maximum(recording.sensor.values, 0.0) / 84.0)
    found = examine([with_reading(recording, 84.0 * np.expm1(np.rint(code / step) * step) / mu)])
    assert kinds(found) == {"quantisation"}
    assert found.usable[0].all()


def test_a_lattice_that_noise_dithers_is_none():
    recording = recorded(dynamic_protocol(), 5, 0.3)
    step = 0.024  # 12 bits over 100 mbar
    assert examine([with_reading(recording, np.rint(recording.sensor.values / step) * step)]).faults == ()


@settings(max_examples=8)
@given(PROTOCOLS, SEEDS, st.floats(0.04, 0.5))
def test_saturation(protocol, seed, cut):
    recording = recorded(protocol, seed)
    reading = recording.sensor.values
    top = float((1.0 - cut) * reading.max())
    found = examine([with_reading(recording, np.minimum(reading, top))])
    assert kinds(found) == {"saturation"}
    recall, false = recall_and_false(found, reading > top, reading >= top)
    assert recall >= RECALL
    assert false < FALSELY_MASKED


@settings(max_examples=8)
@given(PROTOCOLS, SEEDS, st.floats(4.0, 10.0))
def test_a_rail_below_which_the_sensor_does_not_go(protocol, seed, rail_mbar):
    recording = recorded(protocol, seed)
    reading = recording.sensor.values
    found = examine([with_reading(recording, np.maximum(reading, rail_mbar))])
    assert kinds(found) == {"low_rail"}
    on = (reading < rail_mbar) & (recording.load.values > 20.0)
    assert recall_and_false(found, on, reading <= rail_mbar)[0] >= RECALL
    assert not found.usable[0][reading <= rail_mbar].any()
    (fault,) = found.faults
    blind_n = float(fault.says.split("loads below about ")[1].split(" N are not seen")[0])
    there = np.abs(reading - rail_mbar) < 0.5  # creep and noise move where a load reads so
    assert 0.6 * blind_n < float(np.median(recording.force_n[there])) < 1.6 * blind_n


def test_of_a_unit_whose_sensor_ends_above_its_zero_no_zero_is_told() -> None:
    """At rest it reads where the sensor ends: no offset is seen there, nor a curve that bends to it."""
    recording = recorded(dynamic_protocol(), 3)
    plain, cut = (diagnose([with_reading(recording, np.maximum(recording.sensor.values, low))]) for low in (-10.0, 6.0))
    assert [fault.kind for fault in cut.data_faults] == ["low_rail"]
    assert (plain.verdict, plain.causes, cut.verdict, cut.causes) == ("adequate", (), "adequate", ())


@settings(max_examples=12)
@given(
    PROTOCOLS,
    SEEDS,
    st.floats(0.03, 2.0),
    st.one_of(st.sampled_from([50.0, 60.0, 150.0]), st.floats(3.0, 47.0)),
    st.floats(0.5, 2.5),
)
def test_hum_at_any_frequency_also_folded(protocol, seed, amplitude_mbar, frequency_hz, phase):
    recording = recorded(protocol, seed)
    hum = amplitude_mbar * np.sin(2 * np.pi * frequency_hz * recording.time_s + phase)
    found = examine([with_reading(recording, on_lattice(recording.sensor.values + hum))])
    assert kinds(found) == {"hum"}
    folded = abs(frequency_hz - 100.0 * np.rint(frequency_hz / 100.0))
    said = float(found.faults[0].says.split(" at ")[1].split(" Hz")[0])
    assert said == pytest.approx(folded, abs=0.05)


def test_one_tone_is_one_line_however_short_the_rests_are():
    """Rests of two seconds resolve no closer than a hertz: a mains tone had stood there as three."""
    time_s = 0.004 * np.arange(15_000)
    load = 200.0 * np.clip(np.sin(2 * np.pi * time_s / 8.0) * 3.0, -1.0, 1.0) + 200.0
    rng = np.random.default_rng(8)
    tone = 0.5 * np.sin(2 * np.pi * (50.03 * time_s + 0.02 * np.sin(2 * np.pi * time_s / 20.0)))
    reading = 0.2 * load + tone + rng.normal(0.0, 0.02, time_s.size)
    made = Recording.from_arrays(time_s=time_s, force_n=load + rng.normal(0.0, 0.05, load.size), pressure_mbar=reading)
    (told,) = [fault.says for fault in examine([made]).faults if fault.kind == "hum"]
    assert "at 50.0" in told
    assert told.count(" Hz") - told.count("Hz mains") == 1


def test_a_tone_beside_rounded_stamps_has_its_own_frequency():
    """120 Hz to four decimals: most steps are 8.3 ms, which would be 120.48 Hz, and the tone at 50.2 Hz."""
    time_s = np.arange(12_000) / 120.0
    load = 200.0 * np.clip(np.sin(2 * np.pi * time_s / 8.0) * 3.0, -1.0, 1.0) + 200.0
    rng = np.random.default_rng(8)
    reading = 0.2 * load + 0.5 * np.sin(2 * np.pi * 50.0 * time_s) + rng.normal(0.0, 0.02, time_s.size)
    rounded = {"time_s": time_s.round(4), "force_n": load + rng.normal(0.0, 0.05, load.size), "pressure_mbar": reading}
    (told,) = [fault.says for fault in examine([Recording.from_arrays(**rounded)]).faults if fault.kind == "hum"]
    assert float(told.split(" at ")[1].split(" Hz")[0]) == pytest.approx(50.0, abs=0.05)


def test_names_the_mains_frequency_that_a_line_may_be():
    assert aliases(50.0, 100.0, 100.0)[0] == "50 Hz mains"
    assert aliases(40.0, 100.0, 100.0)[0] == "60 Hz mains"
    assert aliases(7.0, 100.0, 100.0) == []


@settings(max_examples=8)
@given(SEEDS, st.floats(0.25, 2.0), st.sampled_from([-1.0, 1.0]), st.floats(-0.002, 0.002))
def test_two_clocks(seed, size_s, sign, rate):
    recording = recorded(dynamic_protocol(), seed)
    lag_s = sign * size_s
    t = recording.time_s
    middle = 0.5 * (t[0] + t[-1])
    late = np.interp(t - lag_s - rate * (t - middle), t, recording.sensor.values)
    found = examine([with_reading(recording, on_lattice(late)).between(3.0, float(t[-1]) - 3.0)])
    assert "two_clocks" in kinds(found)
    assert found.clock_offset_s[0] == pytest.approx(lag_s, abs=0.12)


def test_a_lag_of_a_sample_or_two_is_left_to_the_model():
    recording = recorded(dynamic_protocol(), 1)
    late = np.concatenate([recording.sensor.values[:2], recording.sensor.values[:-2]])
    assert examine([with_reading(recording, late)]).faults == ()


def test_wrong_sign_and_the_sign_of_what_is_no_pressure():
    recording = recorded(dynamic_protocol(), 1)
    assert kinds(examine([with_reading(recording, -recording.sensor.values)])) == {"wrong_sign"}
    counts = Recording.from_arrays(
        time_s=recording.time_s, force_n=recording.force_n, toe_counts=250.0 - recording.sensor.values
    )
    assert kinds(examine([counts])) == set()


@settings(max_examples=12)
@given(SEEDS, st.sampled_from([1.0, -1.0]), st.floats(2.0, 30.0))
def test_what_creeps_under_a_load_that_stands_has_no_wrong_sign(seed: int, way: float, tau_s: float) -> None:
    """The noise of a load that stands rises and falls with what creeps by chance."""
    rng = np.random.default_rng(seed)
    time_s = np.arange(0.0, 40.0, 0.01)
    pressure = 70.0 + way * 10.0 * np.exp(-time_s / tau_s) + 0.05 * rng.standard_normal(time_s.size)
    force_n = 350.0 + 0.2 * rng.standard_normal(time_s.size)
    held = Recording.from_arrays(time_s=time_s, force_n=force_n, pressure_mbar=pressure)
    assert "wrong_sign" not in kinds(examine([held]))


@pytest.mark.parametrize("what", ["constant", "noise", "load at rest"])
def test_a_reading_that_does_not_follow_is_refused(what):
    recording = recorded(dynamic_protocol(), 1)
    noise = np.random.default_rng(0).standard_normal(len(recording))
    if what == "load at rest":
        recording = recording.with_channel(replace(recording.load, values=0.3 * noise))
    else:
        recording = with_reading(recording, 12.0 + (noise if what == "noise" else 0.0 * noise))
    found = examine([recording])
    assert kinds(found) == {"does_not_follow_load"}
    assert len(found.refusals) == 1
    assert not found.usable[0].any()


def test_a_recording_is_refused_by_itself():
    good = recorded(dynamic_protocol(), 1)
    found = examine([good, good.taken(slice(0, 40)), good.without("force")])
    short, bare = found.refusals
    assert "40 samples" in short
    assert "--force" in bare
    assert [fault.kind for fault in found.faults] == ["short_recording", "no_reference"]
    assert [fault.recording for fault in found.faults] == [1, 2]
    assert [mask.any() for mask in found.usable] == [True, False, False]
    assert "--force" in examine([good.without("force")]).refusals[0]


def test_missing_samples_gaps_and_uneven_steps():
    recording = recorded(dynamic_protocol(), 1)
    reading = recording.sensor.values.copy()
    reading[1000:1040] = np.nan
    found = examine([with_reading(recording, reading)])
    assert kinds(found) == {"missing_samples"}
    assert np.flatnonzero(~found.usable[0]).tolist() == list(range(1000, 1040))
    fault = found.faults[0]
    assert (fault.start_s, fault.stop_s) == pytest.approx((10.0, 10.39))

    kept = np.ones(len(recording), dtype=bool)
    kept[3000:3050] = False
    found = examine([recording.taken(kept)])
    assert kinds(found) == {"gaps"}
    assert found.usable[0].all()

    moved = recording.time_s + 0.004 * np.random.default_rng(0).uniform(-1, 1, len(recording))
    load, pressure = (np.interp(moved, recording.time_s, c.values) for c in (recording.load, recording.sensor))
    found = examine([Recording.from_arrays(time_s=moved, force_n=load, pressure_mbar=on_lattice(pressure))])
    assert kinds(found) == {"uneven_sampling"}


@pytest.mark.parametrize("seed", range(3))
def test_a_log_without_a_clock_has_no_gaps_but_where_steps_are_beyond_its_own_scatter(seed):
    rng = np.random.default_rng(seed)
    time_s = np.cumsum(rng.gamma(3.0, 0.01 / 3.0, 9000) + 1e-4)
    load = 400.0 * (1.0 - np.cos(2.0 * np.pi * time_s / 8.0))
    reading = 0.12 * load + 0.1 * rng.standard_normal(time_s.size)

    def found(kept):
        rows = Recording.from_arrays(time_s=time_s[kept], force_n=load[kept], pressure_mbar=reading[kept])
        return kinds(examine([rows]))

    assert found(np.ones(time_s.size, dtype=bool)) == {"uneven_sampling"}
    assert found(np.abs(time_s - 40.0) > 0.5) == {"uneven_sampling", "gaps"}


def test_mostly_dropped_out_is_refused():
    recording = recorded(dynamic_protocol(), 1)
    reading = np.where(np.random.default_rng(0).random(len(recording)) < 0.7, np.nan, recording.sensor.values)
    found = examine([with_reading(recording, reading)])
    assert len(found.refusals) == 1
    assert not found.usable[0].any()


def test_a_fault_as_the_contract_writes_it():
    recording = recorded(dynamic_protocol(), 1)
    reading = recording.sensor.values.copy()
    reading[4000] += 20.0
    written = examine([with_reading(recording, reading)]).faults[0].to_dict()
    assert set(written) == {"kind", "where", "share", "says"}
    assert written["kind"] == "spikes"
    assert written["where"].endswith(", 40-40 s")
    assert written["share"] == pytest.approx(1 / len(recording))
