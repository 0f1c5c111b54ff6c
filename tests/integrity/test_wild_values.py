"""Wild values, a logger's -9999 or a load cell's glitch: missing before anything else is asked of load or reading."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from test_integrity_clean import simulated

from smartshoe import diagnose
from smartshoe.integrity import Integrity, examine
from smartshoe.integrity._examination import _with_known_load
from smartshoe.integrity._fault import Finding
from smartshoe.integrity._wild import with_missing, without_wild
from smartshoe.integrity.thresholds import Thresholds
from smartshoe.protocol import dynamic_protocol
from smartshoe.recording import Recording

Array = NDArray[np.float64]

STANDARD = Thresholds()
TIME_S = np.arange(0.0, 60.0, 0.01)
TRIANGLE = np.abs(2.0 * (TIME_S / 6.0 % 1.0) - 1.0)
NOISE = np.random.default_rng(4).standard_normal((2, TIME_S.size))
LOAD_N, MBAR = 800.0 * (TRIANGLE + 1e-3 * NOISE[0]), 100.0 * (TRIANGLE + 1e-3 * NOISE[1])


def _run(load_n: Array = LOAD_N, mbar: Array = MBAR) -> Recording:
    return Recording.from_arrays(time_s=TIME_S, force_n=load_n, pressure_mbar=mbar, name="run")


def _with(signal: Array, values: dict[int, float]) -> Array:
    changed = signal.copy()
    for at, value in values.items():
        changed[at] = value
    return changed


def _wild(channel: str, values: dict[int, float]) -> Recording:
    """A run of which the load, or the reading, has such values."""
    return _run(_with(LOAD_N, values)) if channel == "force" else _run(mbar=_with(MBAR, values))


def _missing(found: Integrity, channel: str) -> list[int]:
    (recording,) = found.recordings
    return np.flatnonzero(~recording[channel].present).tolist()


@pytest.mark.parametrize(("channel", "unit"), [("force", "N"), ("pressure", "mbar")])
@pytest.mark.parametrize(
    ("values", "said"),
    [
        ({1111: -99999.0}, "a sample of -99999"),
        ({1111: 99999.0, 3000: -88888.0}, "2 samples, the farthest of 99999"),
        ({1111: 88888.0, 3000: -99999.0, 3001: 77777.0}, "3 samples, the farthest of -99999"),
    ],
)
def test_wild_values_are_missing_and_told_with_channel_count_and_the_farthest(
    channel: str, unit: str, values: dict[int, float], said: str
) -> None:
    found = examine([_wild(channel, values)])
    (fault,) = found.faults
    assert (fault.kind, fault.severity) == ("spikes", "material")
    assert fault.says == f"{channel} holds {said} {unit}, far beyond all others: left out"
    assert fault.share == pytest.approx(len(values) / TIME_S.size)
    assert _missing(found, channel) == sorted(values)
    assert np.flatnonzero(~found.usable[0]).tolist() == sorted(values)
    assert (found.refusals, found.clock_offset_s) == ((), (0.0,))


@settings(max_examples=12)
@given(
    st.sampled_from(["force", "pressure"]),
    st.dictionaries(st.integers(0, TIME_S.size - 1), st.floats(2e4, 1e9), min_size=1, max_size=20),
    st.sampled_from([-1.0, 1.0]),
)
def test_all_else_is_judged_as_if_they_had_never_been_logged(
    channel: str, sizes: dict[int, float], sign: float
) -> None:
    values = {at: sign * size for at, size in sizes.items()}
    found, never = examine([_wild(channel, values)]), examine([_wild(channel, dict.fromkeys(values, np.nan))])
    assert _missing(found, channel) == _missing(never, channel) == sorted(values)
    assert np.array_equal(found.usable[0], never.usable[0])
    assert {fault.kind for fault in found.faults} == {"spikes"}
    assert {fault.kind for fault in never.faults} == {"missing_samples"}
    assert (found.clock_offset_s, found.refusals) == (never.clock_offset_s, never.refusals)
    (kept,) = found.recordings
    for name, signal in (("force", LOAD_N), ("pressure", MBAR)):
        there = kept[name].present
        assert np.array_equal(kept[name].values[there], signal[there])  # nothing else is touched


@pytest.mark.parametrize(("spans", "is_wild"), [(9.9, False), (10.1, True), (-9.9, False), (-10.1, True)])
def test_a_value_is_wild_beyond_ten_spans_of_nearly_all_others(spans: float, is_wild: bool) -> None:
    """Of the middle 95 %: from 0.025 to 0.975 of a ramp."""
    ramp = np.linspace(0.0, 1.0, 4001)
    low, high = 0.025, 0.975
    value = (high if spans > 0 else low) + spans * (high - low)
    run = Recording.from_arrays(
        time_s=0.01 * np.arange(4001), force_n=_with(800.0 * ramp, {7: 800.0 * value}), pressure_mbar=100.0 * ramp
    )
    kept, findings = without_wild(run, STANDARD)
    assert (len(findings), np.flatnonzero(~kept.load.present).tolist()) == ((1, [7]) if is_wild else (0, []))
    assert (kept is run) is not is_wild
    far, _ = without_wild(run, replace(STANDARD, extrapolates=12.0))
    assert far is run


@pytest.mark.parametrize(("count", "is_wild"), [(100, True), (101, False)])
def test_more_of_them_than_a_fortieth_are_how_a_channel_is(count: int, is_wild: bool) -> None:
    run = Recording.from_arrays(
        time_s=0.01 * np.arange(4000),
        force_n=_with(np.linspace(0.0, 800.0, 4000), dict.fromkeys(range(2000, 2000 + count), 1e6)),
        pressure_mbar=np.linspace(0.0, 100.0, 4000),
    )
    kept, findings = without_wild(run, STANDARD)
    assert (len(findings), int((~kept.load.present).sum())) == ((1, count) if is_wild else (0, 0))
    # So many to both sides together, where neither alone reaches what nearly all others are.
    apart = {500 + 20 * k: (-1.0) ** k * 1e6 for k in range(count)}
    kept, findings = without_wild(replace_load(run, apart), STANDARD)
    assert (len(findings), int((~kept.load.present).sum())) == ((1, count) if is_wild else (0, 0))


def replace_load(run: Recording, values: dict[int, float]) -> Recording:
    ramp = np.linspace(0.0, 800.0, len(run))
    return run.with_channel(replace(run.load, values=_with(ramp, values)))


@pytest.mark.parametrize("count", [1, 5, 6, 40])
def test_for_longer_than_a_moment_only_one_number_stands_for_nothing(count: int) -> None:
    ramp = np.linspace(0.0, 800.0, 4000)
    run = Recording.from_arrays(time_s=0.01 * np.arange(4000), force_n=ramp, pressure_mbar=ramp / 8.0)
    rising = {2000 + k: 1e6 + k for k in range(count)}
    for values, is_wild in ((rising, count <= STANDARD.few), (dict.fromkeys(rising, -9999.0), True)):
        kept, findings = without_wild(replace_load(run, values), STANDARD)
        assert (len(findings), int((~kept.load.present).sum())) == ((1, count) if is_wild else (0, 0))


def test_what_load_and_reading_do_together_was_a_press_unless_both_are_one_number() -> None:
    ramp = np.linspace(0.0, 8.0, 4000)
    for load_n, mbar, is_wild in ((800.0, 100.0, False), (-9999.0, -9999.0, True)):
        run = Recording.from_arrays(
            time_s=0.01 * np.arange(4000), force_n=_with(ramp, {7: load_n}), pressure_mbar=_with(ramp / 8.0, {7: mbar})
        )
        kept, findings = without_wild(run, STANDARD)
        assert (len(findings), bool(kept.load.present[7])) == ((2, False) if is_wild else (0, True))


@pytest.mark.parametrize("half_s", [1.0, pytest.param(1.5, marks=pytest.mark.long)])
def test_a_few_presses_of_a_unit_that_rests_most_of_the_time_are_no_wild_values(half_s: float) -> None:
    """Less than a fortieth of the samples are loaded, so that what nearly all others are is noise."""
    rng, time_s = np.random.default_rng(0), np.arange(0.0, 400.0, 0.01)
    load_n = sum(800.0 * np.clip(1.0 - np.abs(time_s - at) / half_s, 0.0, 1.0) for at in (100, 200, 300))
    run = Recording.from_arrays(
        time_s=time_s,
        force_n=load_n + 0.3 * rng.standard_normal(time_s.size),
        pressure_mbar=0.1 * load_n + 0.02 * rng.standard_normal(time_s.size),
        name="idle",
    )
    assert (examine([run]).faults, examine([run]).refusals) == ((), ())
    assert diagnose(run).verdict == "adequate"


def test_of_a_channel_that_hardly_tells_anything_none_is_wild() -> None:
    def kept(load_n: Array) -> Recording:
        sound = np.linspace(0.0, 100.0, load_n.size)
        run = Recording.from_arrays(time_s=0.01 * np.arange(load_n.size), force_n=load_n, pressure_mbar=sound)
        return without_wild(run, STANDARD)[0]

    flat, few = _with(np.full(4000, 5.0), {7: 1e6}), _with(np.linspace(0.0, 800.0, 99), {7: 1e6})
    assert kept(flat).load.present.all()  # a constant has no span
    assert kept(few).load.present.all()
    assert not kept(_with(np.linspace(0.0, 800.0, 100), {7: 1e6})).load.present.all()
    # Of samples that are missing nothing is asked.
    gone = np.where(np.arange(150) % 3 == 0, np.nan, np.linspace(0.0, 800.0, 150))
    assert not kept(_with(gone, {7: 1e6})).load.present[7]
    assert kept(_with(np.where(np.arange(150) % 3 == 1, gone, np.nan), {7: 1e6})).load.present[7]


def test_a_channel_stays_what_it_is_but_for_what_is_missing() -> None:
    run = _run(mbar=_with(MBAR, {5: np.nan}))
    sensor = replace(run.sensor, range_=(-1.0, 200.0), resolution=0.01)
    at = np.isin(np.arange(TIME_S.size), [7, 9])
    fewer = with_missing(run.with_channel(sensor), sensor, at).sensor
    assert (fewer.name, fewer.unit, fewer.role) == (sensor.name, sensor.unit, "sensor")
    assert (fewer.range_, fewer.resolution) == ((-1.0, 200.0), 0.01)
    assert np.flatnonzero(~fewer.present).tolist() == [5, 7, 9]
    assert np.array_equal(fewer.values[fewer.present], MBAR[fewer.present])
    assert np.array_equal(sensor.values[at], MBAR[at])  # the recording that was given is as it was


def test_recordings_come_back_in_their_order_and_sound_ones_as_they_were_given() -> None:
    sound, glitched = _run(), replace(_wild("force", {1111: 5e4}), name="glitched")
    found = examine([sound, glitched, sound.taken(slice(0, 40))])
    assert [one.name for one in found.recordings] == ["run", "glitched", "run"]
    assert (found.recordings[0] is sound, len(found.recordings[2])) == (True, 40)
    assert [fault.recording for fault in found.faults if fault.kind == "spikes"] == [1]


@pytest.mark.parametrize("size_n", [200.0, -150.0, 3000.0])
def test_a_spike_is_missing_of_the_load_and_one_of_the_reading_is_left_out_of_fits(size_n: float) -> None:
    loaded = examine([_run(_with(LOAD_N, {1111: LOAD_N[1111] + size_n}))])
    assert [fault.kind for fault in loaded.faults] == ["spikes"]
    assert loaded.faults[0].says.startswith("the reference load has an isolated spike of ")
    assert (_missing(loaded, "force"), _missing(loaded, "pressure")) == ([1111], [])
    assert np.flatnonzero(~loaded.usable[0]).tolist() == [1111]
    read = examine([_run(mbar=_with(MBAR, {1111: MBAR[1111] + 0.1 * size_n}))])
    assert read.faults[0].says.startswith("the reading has an isolated spike of ")
    assert (_missing(read, "force"), _missing(read, "pressure")) == ([], [])
    assert np.flatnonzero(~read.usable[0]).tolist() == [1111]


@pytest.mark.parametrize(("foot_n", "is_none"), [(10.0, True), (20.0, False), (100.0, False)])
def test_a_spike_that_the_load_beside_it_bends_to_is_a_peak_between_two_samples(foot_n: float, is_none: bool) -> None:
    """By a quarter of it on both sides together; what is left of it is missing in fits all the same."""
    foot = foot_n * np.array([0.25, 0.5, 0.75, 1.0])
    peak = LOAD_N[1106:1117] + np.concatenate([[0.0], foot, [100.0 + foot_n], foot[::-1], [0.0]])
    found = examine([_run(_with(LOAD_N, dict(zip(range(1106, 1117), peak, strict=True))))])
    assert _missing(found, "force") == ([1111] if is_none else [])
    assert not found.usable[0][1111]


def test_a_unit_whose_load_cell_has_spikes_is_as_good_as_it_was() -> None:
    """Ten of a part of the span: simulated as loads they would make a lag, or a heat of the gas."""
    run = simulated(dynamic_protocol((200.0, 800.0), repeats=3, rest_s=2.0), 3)
    load_n, rng = run.load.values.copy(), np.random.default_rng(1)
    at = rng.choice(load_n.size, 10, replace=False)
    load_n[at] += rng.choice([-1.0, 1.0], at.size) * rng.uniform(100.0, 300.0, at.size)
    plain, found = diagnose(run), diagnose(run.with_channel(replace(run.load, values=load_n)))
    assert (plain.verdict, found.verdict, found.causes) == ("adequate", "adequate", ())
    assert plain.baseline is not None
    assert found.baseline is not None
    assert found.baseline.rmse == pytest.approx(plain.baseline.rmse, rel=0.02)


@pytest.mark.parametrize("value", [5000.0, 99999.0, -9999.0])
def test_a_unit_of_which_one_load_sample_is_wild_is_as_good_as_it_was(value: float) -> None:
    run = simulated(dynamic_protocol((200.0, 800.0), repeats=3, rest_s=2.0), 3)
    load_n = run.load.values.copy()
    load_n[load_n.size // 2] = value
    glitched = run.with_channel(replace(run.load, values=load_n))
    plain, found = diagnose(run), diagnose(glitched)
    assert (plain.verdict, found.verdict) == ("adequate", "adequate")
    assert found.causes == ()
    assert found.full_scale_load_n == pytest.approx(plain.full_scale_load_n, rel=1e-3)
    assert plain.baseline is not None
    assert found.baseline is not None
    assert found.baseline.rmse == pytest.approx(plain.baseline.rmse, rel=0.02)
    (fault,) = (one for one in found.data_faults if one.kind == "spikes")
    assert fault.share == pytest.approx(1.0 / len(run))


def test_of_the_load_no_samples_are_taken_but_those_that_are_none() -> None:
    run, at = _run(), [np.isin(np.arange(TIME_S.size), places) for places in ([3], [5, 6], [8])]
    findings = [Finding("spikes", one, "", no_load=of) for one, of in zip(at, (*at[:2], None), strict=True)]
    assert np.flatnonzero(~_with_known_load(run, findings).load.present).tolist() == [3, 5, 6]
    assert _with_known_load(run, findings[2:]) is run
    assert _with_known_load(run, ()) is run


@pytest.mark.parametrize("ramp", [(0.2, 0.5, 0.8), (0.3, 0.6), (0.1, 0.3, 0.5, 0.7, 0.9)])
@pytest.mark.parametrize("is_first", [True, False])
def test_the_few_samples_of_a_ramp_before_a_long_hold_are_none(ramp: tuple[float, ...], is_first: bool) -> None:
    """A relaxation test: a stretch within a few samples, then a hold of which the span is that of the noise."""
    hold = 1.0 + 1e-4 * NOISE[0][:400]
    load = 800.0 * np.concatenate([ramp, hold] if is_first else [hold, ramp[::-1]])
    read = 100.0 * (1.0 + 0.2 * np.exp(-np.arange(load.size) / 50.0)) + 0.1 * NOISE[1][: load.size]
    run = Recording.from_arrays(time_s=0.01 * np.arange(load.size), force_n=load, pressure_mbar=read)
    assert without_wild(run, STANDARD)[1] == []


@pytest.mark.parametrize("at", [0, TIME_S.size - 1])
def test_one_number_with_which_a_recording_begins_or_ends_is(at: int) -> None:
    run, findings = without_wild(_wild("force", {at: -99999.0}), STANDARD)
    assert [finding.kind for finding in findings] == ["spikes"]
    assert not run["force"].present[at]
