"""Sensor, converter, machine, shoe and provider."""

from __future__ import annotations

import numpy as np
import pydantic
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from simulators.instruments import presets
from simulators.instruments.daq import MyRioParameters, SimulatedMyRio
from simulators.instruments.sensor import HdiParameters, SimulatedHdiSensor
from simulators.people.profiles import Gait
from simulators.people.shape import COLUMNS
from simulators.provider import provider
from smartshoe.errors import DeviceError, LimitError, UsageError
from smartshoe.protocol import Protocol, Segment, dynamic_protocol
from smartshoe.recording import REGIONS

SHORT = dynamic_protocol([400.0, 800.0], rest_s=1.0)
QUIET = {"load_noise_n": 0.0, "sensor": {"noise_percent": 0.0}}


def rng(seed: int = 1) -> np.random.Generator:
    return np.random.default_rng(seed)


@given(st.lists(st.floats(-5e4, 5e4), min_size=1, max_size=50))
def test_sensor_stays_within_its_rails_and_repeats_exactly_there(pressures):
    sensor = SimulatedHdiSensor(HdiParameters(lag_s=0.0), rng())
    reading = sensor.to_pressure_pa(sensor.read(np.array(pressures), 1000.0))
    assert reading.min() >= -200.0 - 1e-9
    assert reading.max() <= 20_200.0 + 1e-9
    beyond = np.array(pressures) > 20_300
    assert np.unique(reading[beyond].round(6)).size <= 1
    below = np.array(pressures) < 0
    assert np.all(np.abs(reading[below]) < 8 * 10)  # eight deviations of 10 Pa


def test_sensor_lag_is_first_order_and_carries_over():
    sensor = SimulatedHdiSensor(HdiParameters(noise_fraction=0.0, lag_s=0.01), rng())
    ramp_pa = 1e4 * np.arange(1, 1001) / 1000.0
    whole = sensor.to_pressure_pa(sensor.read(ramp_pa, 1000.0))
    time_s = np.arange(1, 1001) / 1000.0
    assert whole == pytest.approx(1e4 * (time_s - 0.01 * (1 - np.exp(-time_s / 0.01))), abs=1e-6)
    sensor.reset()
    parts = [sensor.to_pressure_pa(sensor.read(part, 1000.0)) for part in np.split(ramp_pa, [1, 7, 500])]
    np.testing.assert_allclose(np.concatenate(parts), whole, rtol=0, atol=1e-9)


def test_sensor_noise_is_what_is_asked_for():
    sensor = SimulatedHdiSensor(HdiParameters(noise_fraction=0.001), rng())
    reading_pa = sensor.to_pressure_pa(sensor.read(np.full(100_000, 5e3), 1000.0))[1000:]
    assert reading_pa.std() == pytest.approx(20.0, rel=0.02)  # sd of a deviation from 1e5 draws: 0.2 %


@given(st.lists(st.floats(0, 5), min_size=1), st.floats(-0.05, 0.05))
def test_converter_gives_lattice_values_within_half_a_step(volts, error_v):
    daq = SimulatedMyRio(MyRioParameters(absolute_error_v=error_v), rng())
    logged = daq.convert(np.array(volts))
    counts = logged / daq.parameters.step_v
    assert np.abs(counts - counts.round()).max() < 1e-9
    inside = np.clip(np.array(volts) + error_v, 0, 5 - daq.parameters.step_v)
    assert np.abs(logged - inside).max() <= daq.parameters.step_v / 2 + 1e-12


def test_drawn_errors_lie_within_50_mv_and_differ_between_channels_and_seeds():
    drawn = [
        SimulatedMyRio(MyRioParameters(absolute_error_v="drawn", load_absolute_error_v="drawn"), rng(i))
        for i in range(20)
    ]
    errors = np.array([[d.error_v, d.load_error_v] for d in drawn])
    assert np.abs(errors).max() <= 0.05
    assert np.unique(errors).size == 40


def test_clock_errors_shift_the_signal_and_not_the_log():
    options = {**QUIET, "daq": {"clock_offset_s": 0.25, "clock_skew": 0.01}}
    with provider.open_machine("instron", options, rng()) as machine:
        recording = machine.run(SHORT)
        assert np.allclose(np.diff(recording.time_s), 0.01)
        true_s = 0.25 + 1.01 * recording.time_s
        assert np.abs(recording.force_n - np.interp(true_s, machine.truth.time_s, machine.truth.load_n)).max() < 0.13


@settings(max_examples=15, deadline=None)
@given(
    st.lists(st.builds(Segment, st.just("ramp"), st.floats(0, 900), st.floats(0.02, 2)), min_size=1, max_size=6).map(
        lambda s: Protocol("drawn", tuple(s))
    )
)
def test_trajectory_is_never_negative_nor_beyond_the_command_and_has_finite_acceleration(protocol):
    with provider.open_machine("instron", QUIET, rng()) as machine:
        machine.run(protocol)
        truth = machine.truth
        assert truth.load_n.min() >= 0
        assert truth.load_n.max() <= protocol.peak_load_n + 1e-9
        # An average over 41 ms bounds the change of rate by (largest change of rate)/41 ms.
        jerk_free = 2 * (protocol.peak_rate_n_per_s + 1e-6) / 0.041
        assert np.abs(np.diff(truth.load_n, 2)).max() * 1e6 <= jerk_free * (1 + 1e-6) + 1.0


def test_a_run_reads_85_percent_of_range_at_800_newton_and_agrees_with_its_truth():
    with provider.open_machine("instron", {"unit": "left_heel"}, rng()) as machine:
        recording = machine.run(dynamic_protocol([50.0], rest_s=5.0))
        assert recording.unit == "left_heel"
        assert recording.pressure_pa.max() / 20_000 == pytest.approx(0.85, abs=0.03)  # the arm still bears a part
        truth = machine.truth
        load_n, pressure_pa = truth.load_n[::10], truth.pressure_pa[::10]
        # Noise of 0.3 N and of 10 Pa, with the lattice: six deviations.
        assert np.abs(recording.force_n - load_n).max() < 6 * np.hypot(0.3, 0.244 / 12**0.5)
        assert np.abs(recording.pressure_pa - pressure_pa).max() < 6 * np.hypot(10, 6.1 / 12**0.5) + 1.0
        assert np.array_equal(recording.command_n, dynamic_protocol([50.0], rest_s=5.0).load_at(recording.time_s))
        assert float(recording.metadata["effective_area_m2"]) == presets.bladder("left_heel").effective_area_m2
        assert [d.name for d in machine.describe()] == list(recording.channels)


def test_logs_are_the_instruments_own():
    with provider.open_machine("instron", {"bluehill_clock_offset_s": 0.35}, rng()) as machine:
        recording = machine.run(SHORT)
        bluehill, myrio = machine.logs
    assert bluehill.time_s[0] == 0.35
    assert {"extension", "force"} == set(bluehill.channels)
    volts = myrio["pressure"].values
    step_v = 5 / 4096
    assert np.abs(volts / step_v - (volts / step_v).round()).max() < 1e-9
    assert (volts - 0.5) / 4 * 100 == pytest.approx(recording["pressure"].values)
    assert recording["displacement"].values == pytest.approx(bluehill["extension"].values, abs=1e-9)


def test_same_seed_same_numbers_and_another_seed_others():
    def run(seed: int) -> np.ndarray:
        with provider.open_machine("instron", {"daq": {"absolute_error_v": "drawn"}}, rng(seed)) as machine:
            return machine.run(SHORT).pressure_pa

    assert np.array_equal(run(3), run(3))
    assert not np.array_equal(run(3), run(4))


def test_each_run_starts_from_rest():
    with provider.open_machine("instron", {**QUIET, "bladder": {"hysteresis": {"strength": 0.02}}}, rng()) as machine:
        assert np.array_equal(machine.run(SHORT).pressure_pa, machine.run(SHORT).pressure_pa)


def test_machine_refuses_what_it_and_the_sensor_cannot_stand_before_anything_moves():
    with provider.open_machine("instron", {}, rng()) as machine:
        with pytest.raises(LimitError, match="2000 N"):
            machine.run(dynamic_protocol([100.0], peak_n=2001.0))
        assert machine.truth is None
    with (
        provider.open_machine("instron", {"bladder": {"effective_area_m2": 0.004}}, rng()) as machine,
        pytest.raises(LimitError, match="proof pressure of 1 bar"),
    ):
        machine.run(dynamic_protocol([100.0]))
    with pytest.raises(DeviceError, match="not open"):
        machine.run(SHORT)


def test_a_load_beyond_the_load_channel_is_noted():
    with provider.open_machine("instron", QUIET, rng()) as machine:
        recording = machine.run(dynamic_protocol([800.0], peak_n=1200.0))
    assert recording.force_n.max() < 980
    assert "clipped" in recording.notes[0]


@pytest.mark.parametrize(
    ("options", "loc"),
    [
        ({"foo": 1}, ("foo",)),
        ({"bladder": {"k3": 1}}, ("bladder", "k3")),
        ({"bladder": {"hysteresis": {"strength": "much"}}}, ("bladder", "hysteresis", "strength")),
        ({"bladder": {"k1": -1.0}}, ("bladder", "k1")),
        ({"bladder": 3}, ("bladder",)),
        ({"sensor": {"range_mbar": 0}}, ("sensor", "range_mbar")),
        ({"daq": {"absolute_error_v": 0.2}}, ("daq", "absolute_error_v")),
        ({"unit": 3}, ("unit",)),
    ],
)
def test_wrong_options_name_their_key(options, loc):
    with pytest.raises(pydantic.ValidationError) as caught:
        provider.open_machine("instron", options, rng())
    assert caught.value.errors()[0]["loc"] == loc


def test_given_keys_override_the_preset_and_the_area_follows_them():
    machine = provider.open_machine("instron", {"unit": "right_heel", "bladder": {"k1": 1.0}}, rng())
    found = machine.specimen.bladder.parameters
    assert (found.k1, found.k2) == (1.0, 0.159)
    assert found.nominal_pressure_pa(800.0) == pytest.approx(0.85 * 20_000)
    assert provider.open_machine("instron").specimen.name == "left_toe"


@pytest.mark.parametrize("target", ["walk", "stand", "run", "tiptoe"])
def test_shoe_streams_its_four_units_on_a_virtual_clock(target):
    with provider.open_shoe(target, {"duration_s": 4.0, "side": "right"}, rng()) as shoe:
        blocks = list(shoe.blocks())
        time_s = np.concatenate([b.time_s for b in blocks])
        np.testing.assert_allclose(time_s, np.arange(800) / 200, rtol=1e-6)
        assert blocks[0].names == tuple(f"right_{r}" for r in REGIONS) == tuple(d.name for d in shoe.describe())
        readings_pa = 100 * np.concatenate([b.readings for b in blocks])
        bound = 6 * np.hypot(10, 6.1 / 12**0.5) + 0.01 * np.abs(np.diff(shoe.truth.pressure_pa, axis=0)).max() * 200
        assert np.abs(readings_pa - shoe.truth.pressure_pa).max() < bound
    with pytest.raises(DeviceError, match="not open"):
        next(shoe.blocks())


def test_walking_loads_heel_then_outer_then_inner_metatarsal_then_toe():
    time_s = np.arange(20_000) / 1000
    gait = Gait(first_contact_s=0.0, stride_time_cv=0.0, cadence_steps_per_min=110.0, stance_share=0.62)
    loads = gait.plan("walk", 20.0, rng()).loads_n(time_s)[:, 0]
    stride = slice(1, int(1000 * 120 / 110))
    onset = {r: int(np.argmax(loads[stride, COLUMNS.index(r)] > 5)) for r in REGIONS}
    assert sorted(REGIONS, key=onset.__getitem__) == ["heel", "meta4", "meta1", "toe"]
    total = loads.sum(axis=1)
    assert np.mean(total > 0) == pytest.approx(0.62, abs=0.01)
    assert 0.8 < total.max() / 519.4 < 1.6


def test_standing_bears_body_weight_on_two_feet():
    loads = Gait(sway_cv=0.05).plan("stand", 60.0, rng()).loads_n(np.arange(2000, 60_000) / 1000)
    np.testing.assert_allclose(loads.sum(axis=(1, 2)), np.full(58_000, 519.4), rtol=1e-6)
    assert loads[:, :, :4].min() > 0


def test_unknown_targets_and_units_are_refused():
    with pytest.raises(UsageError, match="instron"):
        provider.open_machine("press", {}, rng())
    with pytest.raises(UsageError, match="walk, stand"):
        provider.open_shoe("hop", {}, rng())
    with pytest.raises(UsageError, match=r"units\.left_thumb"):
        provider.open_shoe("walk", {"units": {"left_thumb": {}}}, rng())
    with pytest.raises(pydantic.ValidationError, match="side"):
        provider.open_shoe("walk", {"side": "middle"}, rng())
