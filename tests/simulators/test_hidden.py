"""Hidden-effect cases: the strength that was asked for, twins, sessions, determinism, refusals."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from simulators.hidden._baseline import lagged, left_over, residual
from simulators.hidden._protocols import PROTOCOLS, build
from simulators.hidden.effects import EFFECTS
from simulators.hidden.effects.noise import alias_hz
from simulators.hidden.recordings import hide
from smartshoe.errors import UsageError
from smartshoe.protocol import dynamic_protocol

SHORT = dynamic_protocol([100.0, 400.0, 800.0], repeats=2, rest_s=2.0)
# On so short a record a dropout or a held run is more, and compressed air or heat less, than what is asked.
STEPS = {"held_samples", "dropouts"}
CATALOGUE = {
    "second_relaxation", "power_law_creep", "linear_leak", "orifice_leak", "gas_heat", "gas_compression",
    "wall_hardening", "contact_area", "sensor_nonlinearity", "dead_band", "play_hysteresis", "bouc_wen_hysteresis",
    "load_unload_asymmetry", "rate_gain", "mullins_softening", "cycle_conditioning", "gain_drift", "sensor_lag",
    "delay", "clock_drift", "zero_offset", "zero_drift", "warm_up", "permanent_set", "saturation", "cross_talk",
    "load_cell_tare", "hum", "coloured_noise", "heteroscedastic_noise", "timing_jitter", "spikes", "quantisation",
    "held_samples", "dropouts",
}  # fmt: skip


def strength(recording, case) -> float:
    """The case's strength again, from a twin without noise."""
    needs_zero = EFFECTS[case.effects[0].name].needs_zero
    reading = recording["pressure"].with_nan()
    left = left_over(recording.force_n, reading, recording.sample_time_s, constant=not needs_zero)
    return 100.0 * left / case.full_scale_mbar


def test_the_registry_has_the_whole_catalogue_and_more():
    assert {name for name, effect in EFFECTS.items() if effect.inside} == CATALOGUE
    assert len(set(EFFECTS) - CATALOGUE) >= 7


@pytest.mark.parametrize("name", EFFECTS)
def test_asked_strength_is_reached(name):
    case = hide({name: 0.4}, protocol=SHORT, seed=11, recordings=1, hold_out=0, nuisances=0)
    (effect,) = case.effects
    assert (effect.name, effect.family, effect.stage) == (name, EFFECTS[name].family, EFFECTS[name].stage)
    if name in STEPS:
        assert effect.note == "" or "steps" in effect.note
    else:
        assert effect.strength_percent_fs == pytest.approx(0.4, rel=0.05), effect.note
    # The twin without noise is drawn as the one that was scaled; only its load cell's tare and own noise differ.
    assert strength(case.noise_free[0], case) == pytest.approx(effect.strength_percent_fs, rel=1e-6)
    if effect.inside:
        baseline = strength(case.clean[0], case)
        assert baseline < 0.02


@pytest.mark.parametrize(
    ("name", "says"),
    [("gas_heat", "fraction"), ("held_samples", "held_share"), ("second_relaxation", "k3"), ("rate_gain", "clip")],
)
def test_what_cannot_be_reached_is_said(name, says):
    case = hide({name: 25.0}, protocol=SHORT, seed=11, recordings=1, hold_out=0, nuisances=0)
    (effect,) = case.effects
    assert effect.strength_percent_fs < 25.0
    assert says in effect.note


def test_a_seed_fixes_every_number_and_another_gives_others():
    def readings(seed: int) -> list[np.ndarray]:
        case = hide(["linear_leak", "play_hysteresis"], strength_percent_fs=0.5, protocol=SHORT, seed=seed)
        return [r.pressure_pa for r in case.recordings + case.hold_out] + [r.force_n for r in case.recordings]

    first = readings(5)
    assert all(np.array_equal(a, b) for a, b in zip(first, readings(5), strict=True))
    assert not np.array_equal(first[0], readings(6)[0])


def test_each_recording_is_a_session_of_its_own():
    case = hide({"linear_leak": 1.0, "warm_up": 1.0}, protocol=SHORT, seed=3, recordings=3, nuisances=0)
    first, second, third = (r.pressure_pa for r in case.noise_free[:3])
    assert np.array_equal(first, second)
    assert np.array_equal(first, third)
    noisy = [r.pressure_pa for r in case.recordings]
    assert not np.array_equal(noisy[0], noisy[1])
    assert all(r.time_s[0] == 0.0 for r in case.recordings)
    assert [r.name for r in case.recordings + case.hold_out] == ["dynamic_1", "dynamic_2", "dynamic_3", "dynamic_4"]


def test_noise_is_as_asked_and_its_twins_have_none():
    case = hide([], protocol=SHORT, seed=2, noise_percent_fs=0.2, coloured_share=0.4, recordings=1, nuisances=0)
    noise = case.recordings[0]["pressure"].values - case.noise_free[0]["pressure"].values
    # 3.4e3 samples, two fifths of the variance correlated over up to 0.5 s: a tenth.
    assert 100 * noise.std() / case.full_scale_mbar == pytest.approx(0.2, rel=0.1)
    assert case.effects == ()
    assert np.array_equal(case.noise_free[0].pressure_pa, case.clean[0].pressure_pa)
    load = case.recordings[0].force_n - case.clean[0].force_n
    assert 0.25 < load.std() < 0.9


@settings(max_examples=6, deadline=None)
@given(seed=st.integers(0, 10_000), name=st.sampled_from(["contact_area", "play_hysteresis", "delay", "zero_offset"]))
def test_nuisances_are_small_and_of_other_families(seed, name):
    case = hide({name: 0.5}, protocol=SHORT, seed=seed, recordings=1, hold_out=0)
    assert len(case.nuisances) == 2
    for nuisance in case.nuisances.values():
        assert nuisance.family != EFFECTS[name].family
        assert 0.02 < nuisance.strength_percent_fs < 0.09


def test_effects_together_keep_their_own_strengths():
    asked = {"gas_compression": 0.5, "delay": 0.3, "linear_leak": 0.8}
    case = hide(asked, protocol=SHORT, seed=9, recordings=1, hold_out=0, nuisances=0)
    assert [e.name for e in case.effects] == list(asked)
    for effect in case.effects:
        assert effect.strength_percent_fs == pytest.approx(asked[effect.name], rel=0.05)
    # Scaled for the range that compression chose.
    assert case.full_scale_mbar == pytest.approx(0.7 * case.options["sensor"]["range_mbar"])
    assert 0.8 < case.recordings[0]["pressure"].values.max() / case.full_scale_mbar < 1.2


def test_catalogue_parameters_are_what_the_recordings_show():
    case = hide({"zero_offset": 0.5}, protocol=SHORT, seed=4, recordings=1, hold_out=0, nuisances=0)
    offset = case.noise_free[0]["pressure"].values - case.clean[0]["pressure"].values
    np.testing.assert_allclose(
        offset, np.full(offset.size, case.effects[0].catalogue["offset_mbar"]), rtol=0, atol=1e-3
    )
    case = hide({"delay": 0.5}, protocol=SHORT, seed=4, recordings=1, hold_out=0, nuisances=0)
    late, prompt = case.noise_free[0], case.clean[0]
    delay_s = case.effects[0].catalogue["delay_s"]
    shifted = np.interp(late.time_s - delay_s, prompt.time_s, prompt.pressure_pa)
    assert np.abs(late.pressure_pa - shifted).max() < 5e-4 * prompt.pressure_pa.max()
    case = hide({"cross_talk": 0.5}, protocol=SHORT, seed=4, recordings=1, hold_out=0, nuisances=0)
    crossed = case.noise_free[0]["pressure"].values - case.clean[0]["pressure"].values
    assert crossed.max() == pytest.approx(case.effects[0].catalogue["coupling_mbar"], rel=1e-3)
    assert alias_hz(60.02, 100.0) == pytest.approx(39.98)
    assert alias_hz(50.0, 100.0) == 50.0


@pytest.mark.parametrize("name", PROTOCOLS)
def test_protocols_start_and_end_unloaded_and_keep_within_the_paper_s_loads(name):
    protocol = build(name, np.random.default_rng(1))
    other = build(name, np.random.default_rng(1), other=True)
    for p in (protocol, other):
        assert p.segments[-1].load_n == 0.0
        assert 0 < p.peak_load_n <= 800.0
        assert all(s.load_n >= 0 and s.duration_s > 0 for s in p.segments)
    if name != "step":
        assert protocol.peak_rate_n_per_s < 8_000.0
    fixed = build(name, np.random.default_rng(1))
    assert fixed == protocol


def test_sampling_rate_is_as_asked():
    case = hide(["wall_hardening"], strength_percent_fs=0.5, protocol=SHORT, sample_rate_hz=250.0, seed=1, recordings=1)
    assert case.recordings[0].sample_rate_hz == pytest.approx(250.0)


@settings(max_examples=15, deadline=None)
@given(pole=st.floats(0.02, 10), fast=st.floats(0.2, 1.0), share=st.floats(0.02, 0.6), offset=st.floats(-5, 5))
def test_a_refitted_baseline_follows_every_standard_linear_solid(pole, fast, share, offset):
    load_n = SHORT.load_at(np.arange(0, SHORT.duration_s, 0.01))
    reading = fast * load_n + share * lagged(load_n, 0.01, pole) + offset
    # The pole is searched to a ten-thousandth.
    assert left_over(load_n, reading, 0.01) < 2e-5 * 800.0
    leading = fast * load_n - 0.5 * share * lagged(load_n, 0.01, pole)
    assert left_over(load_n, leading, 0.01) > 50 * left_over(load_n, reading, 0.01)  # no arm does that


def test_a_baseline_is_blind_to_a_missing_sample():
    load_n = SHORT.load_at(np.arange(0, SHORT.duration_s, 0.01))
    reading = load_n**1.1
    gap = reading.copy()
    gap[100:110] = np.nan
    rest = residual(load_n, gap, 0.01)
    assert np.isnan(rest[100:110]).all()
    assert np.nanstd(rest) == pytest.approx(residual(load_n, reading, 0.01).std(), rel=0.05)


def test_what_cannot_be_asked_is_refused():
    with pytest.raises(UsageError, match="linear_leek"):
        hide(["linear_leek"])
    with pytest.raises(UsageError, match="positive"):
        hide({"linear_leak": 0.0})
    with pytest.raises(UsageError, match="protocol 'walk'"):
        hide(["linear_leak"], protocol="walk")


def test_a_soft_limit_may_be_as_weak_as_a_hard_one():
    seeds = {}
    for seed in range(12):
        case = hide({"saturation": 0.1}, protocol=SHORT, seed=seed, recordings=1, hold_out=0, nuisances=0)
        (effect,) = case.effects
        seeds[effect.parameters["sensor.limit.softness"]] = effect.strength_percent_fs
    assert set(seeds) == {0.0, 0.06}
    assert all(found == pytest.approx(0.1, rel=0.05) for found in seeds.values())
