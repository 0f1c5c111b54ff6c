"""Which way each effect moves the reading (docs/simulated_effects.md), and that none of them does at zero."""

from __future__ import annotations

import numpy as np
import pydantic
import pytest

from simulators.hidden.effects import EFFECTS, Options, Subject, merged
from simulators.hidden.recordings import hide
from simulators.provider import provider
from smartshoe.protocol import Protocol, Segment

SUBJECT = Subject("left_toe", 1.341, 0.215, 1.0, 100.0, 60.0)
# Two triangles to 800 N at 200 N/s, one held for 10 s, rests between.
PROTOCOL = Protocol(
    "signs",
    (
        Segment("rest", 0.0, 2.0),
        Segment("ramp", 800.0, 4.0),
        Segment("ramp", 0.0, 4.0),
        Segment("rest", 0.0, 4.0),
        Segment("ramp", 800.0, 4.0),
        Segment("hold", 800.0, 10.0),
        Segment("ramp", 0.0, 4.0),
        Segment("rest", 0.0, 4.0),
    ),
)
AT_S = {
    "start": 1.0, "low": 2.2, "up": 4.0, "peak": 5.97, "down": 8.0, "rest": 11.0, "again": 16.0, "top": 17.9,
    "held": 27.9, "falling": 30.0, "end": 35.5,
}  # fmt: skip
# For each effect with its draws: which way the reading goes, in the places where physics says so; 0 is "stays".
SIGNS: dict[str, tuple[float, dict[str, float], dict[str, int]]] = {
    "second_relaxation": (0.5, {"time_constant_s": 1.0}, {"start": 0, "up": -1, "peak": -1, "falling": 1, "end": 1}),
    "power_law_creep": (0.5, {"exponent": 0.3}, {"start": 0, "up": -1, "peak": -1, "held": -1}),
    "linear_leak": (0.02, {}, {"start": 0, "peak": -1, "rest": -1, "held": -1, "end": -1}),
    "orifice_leak": (0.004, {}, {"start": 0, "peak": -1, "rest": -1, "held": -1, "end": -1}),
    "gas_heat": (1.0, {"time_constant_s": 1.0}, {"start": 0, "up": 1, "peak": 1, "held": 0, "down": -1, "falling": -1}),
    "wall_hardening": (1.0, {}, {"start": 0, "low": 0, "up": -1, "peak": -1, "held": -1, "rest": 0}),
    "contact_area": (0.2, {}, {"start": 0, "up": -1, "peak": -1}),
    "sensor_nonlinearity": (0.2, {"odd": 0.0, "sign": 1.0}, {"start": 0, "up": 1, "down": 1, "peak": 1}),
    "dead_band": (30.0, {"gap_spread": 0.4}, {"start": 0, "low": -1, "up": -1, "peak": -1}),
    "play_hysteresis": (0.02, {"first_slip": 0.01, "last_slip": 0.2}, {"start": 0, "up": -1, "down": 1, "rest": 1}),
    "bouc_wen_hysteresis": (
        0.02,
        {"width": 0.1, "exponent": 1.5, "gamma": 0.3},
        {"start": 0, "up": -1, "down": 1, "rest": 1},
    ),
    "load_unload_asymmetry": (0.05, {"sign": 1.0, "direction_turn_n": 5.0}, {"up": 0, "down": -1, "falling": -1}),
    "rate_gain": (0.1, {}, {"start": 0, "up": 1, "down": 1, "held": 0}),
    "mullins_softening": (0.2, {"width": 0.3}, {"up": 0, "peak": 0, "down": 1, "again": 1}),
    "cycle_conditioning": (0.05, {"sign": 1.0, "cycles": 3.0}, {"up": 0, "down": 0, "again": 1, "held": 1}),
    "gain_drift": (0.05, {"sign": 1.0, "by_temperature": 0.0}, {"start": 0, "up": 1, "held": 1, "rest": 0}),
    "sensor_lag": (0.1, {}, {"start": 0, "up": -1, "down": 1, "held": 0}),
    "delay": (0.1, {}, {"start": 0, "up": -1, "down": 1, "held": 0}),
    "clock_drift": (0.002, {"sign": 1.0}, {"up": -1, "down": 1, "falling": 1}),
    "zero_offset": (1.0, {"sign": 1.0}, {"start": 1, "peak": 1, "rest": 1}),
    "zero_drift": (0.05, {"sign": 1.0, "by_temperature": 0.0}, {"start": 1, "peak": 1, "rest": 1, "end": 1}),
    "warm_up": (2.0, {"sign": 1.0, "warm_up_time_constant_s": 10.0}, {"start": 1, "rest": 1, "end": 1}),
    "permanent_set": (0.005, {}, {"start": 0, "peak": 1, "rest": 1, "held": 1, "end": 1}),
    "saturation": (0.2, {"soft": 0.0}, {"start": 0, "up": 0, "peak": -1, "held": -1, "rest": 0}),
    "cross_talk": (0.1, {"period_s": 3.0}, {"rest": 1, "end": 1}),
    "resonance": (0.5, {"resonance_hz": 0.5, "resonance_damping": 0.03}, {"start": 0, "low": -1}),
    "intermittent_pinch": (0.5, {"pinch_from": 0.2, "pinch_share": 1.0, "seed": 1.0}, {"low": 0, "peak": -1}),
    "snap_through": (0.1, {"snap_up": 0.7, "snap_down": 0.3}, {"up": 0, "peak": -1, "down": -1}),
    "gain_step": (5.0, {"sign": 1.0, "gain_step_at_s": 13.0}, {"peak": 0, "again": 1, "held": 1}),
}
# Without a sign: they average to nothing, or a case draws their sense.
NO_SIGN = {
    "gas_compression", "load_cell_tare", "hum", "coloured_noise", "heteroscedastic_noise", "timing_jitter", "spikes",
    "quantisation", "held_samples", "dropouts", "slow_sine", "telegraph_noise", "random_seating", "draughts",
}  # fmt: skip


def run(options: Options, noise: bool = False):
    quiet = {"load_noise_n": 0.0, "daq": {"bits": 24}}
    given = merged(SUBJECT.options(), {"sensor": {"noise_percent": 0.1}} if noise else quiet, options)
    with provider.open_machine("instron", given, np.random.default_rng(4)) as machine:
        return machine.run(PROTOCOL)


@pytest.fixture(scope="module")
def plain():
    return run({})


@pytest.mark.parametrize("name", SIGNS)
def test_reading_moves_the_way_that_physics_says(name, plain):
    amount, draws, expected = SIGNS[name]
    found = run(EFFECTS[name].options(amount, draws, SUBJECT))
    moved = found.pressure_pa - plain.pressure_pa
    full_scale_pa = 100.0 * SUBJECT.full_scale_mbar
    for place, sign in expected.items():
        here = moved[round(100 * AT_S[place])] / full_scale_pa
        if sign:
            assert sign * here > 1e-4, f"{place}: {here:+.5f}"
        else:
            # What an arm's tail and a delayed corner still leave.
            assert abs(here) < 5e-4, f"{place}: {here:+.5f}"


def test_every_effect_has_a_sign_or_is_known_to_have_none():
    assert set(SIGNS) | NO_SIGN == set(EFFECTS)
    assert not set(SIGNS) & NO_SIGN


def test_a_tare_moves_the_logged_load_and_leaves_the_reading(plain):
    found = run({"load_cell_tare_n": 7.0})
    np.testing.assert_allclose(found.force_n - plain.force_n, np.full(len(plain), 7.0), rtol=0, atol=1e-3)
    assert np.array_equal(found.pressure_pa, plain.pressure_pa)


def test_compressed_air_bends_the_curve_upwards(plain):
    found = run(EFFECTS["gas_compression"].options(300.0, {}, SUBJECT))
    half, full = found.pressure_pa[[400, 600]]
    plain_half, plain_full = plain.pressure_pa[[400, 600]]
    assert half / full < plain_half / plain_full - 0.01


# At zero these two are not the identity: their parameter runs the other way round, or the unit is another one.
AT_ZERO = [name for name in EFFECTS if name not in ("gas_compression", "saturation")]


@pytest.fixture(scope="module")
def noisy():
    return run({}, noise=True)


@pytest.mark.parametrize("name", AT_ZERO)
def test_zero_strength_is_the_identity_to_the_last_bit(name, noisy):
    effect = EFFECTS[name]
    draws = effect.draw(np.random.default_rng(5), SUBJECT)
    found = run(effect.options(0.0, draws, SUBJECT), noise=True)
    assert np.array_equal(found.pressure_pa, noisy.pressure_pa)
    assert np.array_equal(found.force_n, noisy.force_n)
    assert np.array_equal(found["displacement"].values, noisy["displacement"].values)


@pytest.mark.parametrize("name", EFFECTS)
def test_the_largest_amount_is_one_that_the_options_allow(name):
    effect = EFFECTS[name]
    for seed in range(4):  # either sign, either kind
        options = effect.options(effect.largest, effect.draw(np.random.default_rng(seed), SUBJECT), SUBJECT)
        provider.open_machine("instron", merged(SUBJECT.options(), options))


def test_a_limit_out_of_reach_is_the_identity(noisy):
    assert np.array_equal(run({"sensor": {"limit": {"softness": 0.1}}}, noise=True).pressure_pa, noisy.pressure_pa)
    assert np.array_equal(
        run({"sensor": {"limit": {"highest_percent": 500.0}}}, noise=True)["pressure"].values,
        run({"sensor": {"limit": {"highest_percent": 900.0}}}, noise=True)["pressure"].values,
    )


@pytest.mark.parametrize(
    ("options", "key"),
    [
        ({"bladder": {"second_relaxation": {"k4": 1.0}}}, "k4"),
        ({"bladder": {"contact": {"gap_n": -1.0}}}, "gap_n"),
        ({"bladder": {"odd": {"pinch": 2.0}}}, "pinch"),
        ({"sensor": {"curve": {"bridge": -1.0}}}, "bridge"),
        ({"sensor": {"wander": {"slow_sine_period_s": 0.0}}}, "slow_sine_period_s"),
        ({"daq": {"reading": {"held_run": 0.5}}}, "held_run"),
        ({"room": {"humidity": 0.5}}, "humidity"),
        ({"neighbour": {"highest_mbar": 0.0}}, "highest_mbar"),
        ({"load_cell_tare_n": "much"}, "load_cell_tare_n"),
    ],
)
def test_a_scenario_may_switch_each_on_and_wrong_options_name_their_key(options, key):
    with pytest.raises(pydantic.ValidationError) as caught:
        provider.open_machine("instron", options)
    assert caught.value.errors()[0]["loc"][-1] == key


def test_channels_of_room_and_neighbour_are_logged_only_where_asked_for(plain):
    assert not {"temperature", "neighbour"} & set(plain.channels)
    found = run({"room": {"logged": True, "drift_k_per_s": 0.1}, "neighbour": {"logged": True}})
    assert found["temperature"].unit.symbol == "°C"
    assert found["temperature"].role == found["neighbour"].role == "auxiliary"
    assert found["temperature"].values[-1] - found["temperature"].values[0] == pytest.approx(3.6, abs=0.2)
    assert np.array_equal(found.pressure_pa, plain.pressure_pa)


def test_dropouts_may_be_missing_samples():
    found = run({"daq": {"reading": {"dropout_share": 0.05, "dropout_missing": True}}})
    assert found["pressure"].missing is not None
    assert 0.02 < found["pressure"].missing.mean() < 0.09


def test_signs_survive_in_a_hidden_case():
    case = hide({"linear_leak": 1.0}, protocol=PROTOCOL, seed=1, recordings=1, nuisances=0)
    moved = case.noise_free[0].pressure_pa - case.clean[0].pressure_pa
    assert moved[-50:].max() < 0
