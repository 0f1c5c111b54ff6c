"""What a model leaves over, by known numbers: errors by cycle, what repeats, what wanders, which noise it is."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.signal import lfilter
from test_diagnosis_parts import MODEL, recording, sessions_of
from told_noise import kinds_of_noise

from smartshoe.diagnosis import Thresholds
from smartshoe.diagnosis._force import (
    compensation,
    limit_calibration_off,
)
from smartshoe.diagnosis._gauss_markov import GaussMarkov, gauss_markov_of
from smartshoe.diagnosis._held_out import Errors, errors, gain
from smartshoe.diagnosis._lack_of_fit import PLACES, LackOfFit, repeating_structure, repeats, slow_structure
from smartshoe.diagnosis._limits import limit_own_zeros
from smartshoe.diagnosis._noise import effective_noise_sd
from smartshoe.diagnosis._noise_kinds import noise_with_memory
from smartshoe.diagnosis._own_terms import own_terms_of, residual_of
from smartshoe.diagnosis._residual_structure import ResidualStructure, beyond_noise, worst_place
from smartshoe.diagnosis._scale import Scale
from smartshoe.diagnosis._session import Session, at_full_rate
from smartshoe.diagnosis._validation import extrapolating_effect
from smartshoe.diagnosis._zero import own_zeros
from smartshoe.integrity import DataFault
from smartshoe.models.effects import effect
from smartshoe.recording import Recording
from smartshoe.units import MILLIBAR

Array = NDArray[np.float64]

STANDARD = Thresholds()
NOTHING = LackOfFit(0.0, 0.0, 0, STANDARD)


@pytest.fixture(scope="module")
def sessions() -> list[Session]:
    return sessions_of(recording(seed=1), recording(seed=2), recording(seed=3))[0]


@pytest.fixture(scope="module")
def one(sessions: list[Session]) -> Session:
    """Without noise, all of it fitted, in the model's own shares."""
    clean, at = sessions[0], sessions[0].conditions
    return replace(clean, reading=MODEL.simulate(at), held_out=np.zeros(at.load.size, dtype=bool))


# -- held-out errors ----------------------------------------------------------------------------------------------
def test_a_recordings_own_offset_and_initial_state_are_taken_out(one: Session) -> None:
    past = np.exp(-MODEL.pole_per_s * (one.conditions.time_s - one.conditions.time_s[0]))
    own = 0.03 - 0.02 * past
    noise = 1e-4 * np.random.default_rng(1).standard_normal(past.size)
    off = replace(one, reading=one.reading + own + noise)
    found, added = own_terms_of(off, MODEL, off.reading - MODEL.simulate(off.conditions))
    assert found == pytest.approx([0.03, -0.02], abs=3e-4)
    assert added == pytest.approx(own, abs=3e-4)
    assert np.std(residual_of(off, MODEL)) == pytest.approx(1e-4, rel=0.1)


def test_an_initial_state_is_no_larger_than_what_the_arm_can_hold(one: Session) -> None:
    """Where noise hides it, it is half way to nothing at the share of the load that relaxes: a Gaussian prior."""
    past = np.exp(-MODEL.pole_per_s * one.conditions.time_s)
    centred = past - past.mean()
    share = abs(MODEL.relaxing_share * MODEL.gain)
    loud = share * np.sqrt(float(centred @ centred)) * np.random.default_rng(2).choice([-1.0, 1.0], past.size)
    beside = np.column_stack([np.ones(past.size), past])
    loud -= beside @ np.linalg.lstsq(beside, loud, rcond=None)[0]
    loud *= share * np.sqrt(float(centred @ centred)) / np.std(loud)
    residual = loud + 0.1 * share * past
    found, _ = own_terms_of(one, MODEL, residual)
    assert found[1] == pytest.approx(0.05 * share, rel=0.1)
    stiff, _ = own_terms_of(one, replace(MODEL, gain=0.1), residual)
    assert abs(stiff[1]) < 0.2 * abs(found[1])


def test_slow_noise_is_not_led_back_to_first_cycles_that_are_held_out(one: Session) -> None:
    """What a unit brings along grows by exp(p t) towards them: white noise would tell it from what little is left."""
    step_s, time_s = one.conditions.step_s, one.conditions.time_s
    held = time_s < 2.0 / MODEL.pole_per_s
    decay = np.exp(-step_s / 2.0)
    for seed in range(5):
        white = 1e-3 * np.sqrt(1.0 - decay**2) * np.random.default_rng(seed).standard_normal(time_s.size)
        slow_noise = lfilter([1.0], [1.0, -decay], white)
        off = replace(one, reading=one.reading + slow_noise, held_out=held)
        assert np.max(np.abs(residual_of(off, MODEL)[held] - slow_noise[held])) < 2.5e-3
    loaded = replace(one, conditions=replace(one.conditions, load=one.conditions.load + 0.3), held_out=held)
    past = np.exp(-MODEL.pole_per_s * time_s)
    own, _ = own_terms_of(loaded, MODEL, 0.01 + 0.02 * past)
    assert own == pytest.approx([0.01, 0.02], rel=0.02)  # where nothing hides it, it is found


def test_errors_are_counted_by_held_out_cycle(one: Session) -> None:
    held = np.isin(one.cycle, [2, 5])
    off = 0.01 * (one.cycle == 2) + 0.03 * (one.cycle == 5)
    kept = one.usable.copy()
    kept[np.flatnonzero(one.cycle == 5)[:7]] = False
    judged = replace(one, held_out=held, reading=one.reading + off, usable=kept)
    found = errors([judged, replace(one, held_out=np.zeros_like(held))], MODEL)
    counts = np.array([np.sum(kept & (one.cycle == k)) for k in (2, 5)])
    assert found.counts == pytest.approx(counts)
    assert found.squares == pytest.approx(counts * np.array([0.01, 0.03]) ** 2, rel=1e-3)
    assert found.rmse == pytest.approx(np.sqrt((counts @ np.array([1e-4, 9e-4])) / counts.sum()), rel=1e-3)
    seen = judged.reading[held & kept]
    assert found.spread == pytest.approx(float(np.std(seen)))
    nothing = errors([replace(one, held_out=np.zeros_like(held))], MODEL)
    assert (nothing.is_empty, found.is_empty) == (True, False)


def test_the_spread_is_about_each_recordings_own_mean(one: Session) -> None:
    everything = np.ones(one.reading.size, dtype=bool)
    pair = [replace(one, held_out=everything), replace(one, held_out=everything, reading=5.0 + 2.0 * one.reading)]
    assert errors(pair, MODEL).spread == pytest.approx(np.std(one.reading) * np.sqrt(2.5))


def test_fit_and_explained_variance_are_those_of_error_over_spread() -> None:
    found = Errors(np.array([3.0, 6.0]), np.array([100.0, 800.0]), 0.4)
    assert found.rmse == pytest.approx(0.1)
    assert found.fit_percent == pytest.approx(75.0)
    assert found.variance_explained_percent == pytest.approx(100.0 * (1.0 - 1.0 / 16.0))


def test_a_gains_interval_is_that_of_cycles_drawn_anew() -> None:
    """Of n cycles with gains of one or the other kind: that of the binomial draw."""
    before = Errors(np.ones(40), np.full(40, 10.0), 1.0)
    after = Errors(np.repeat([0.04, 0.64], 20), np.full(40, 10.0), 1.0)
    found = gain(before, after, Scale(800.0, -50.0, MILLIBAR), STANDARD)
    assert found.gain_percent == pytest.approx(100.0 * (1.0 - np.sqrt(0.34)))
    drawn = np.random.default_rng(7).binomial(40, 0.5, 100_000) / 40.0
    expected = np.percentile(100.0 * (1.0 - np.sqrt(0.04 * drawn + 0.64 * (1.0 - drawn))), [2.5, 97.5])
    assert found.ci95 == pytest.approx(expected, abs=2.0)
    assert (found.rmse_before, found.unit) == (pytest.approx(50.0 * np.sqrt(0.1)), "mbar")
    assert found.rmse_after == pytest.approx(50.0 * np.sqrt(0.034))
    single = gain(
        Errors(np.ones(1), np.ones(1), 1.0), Errors(np.array([0.25]), np.ones(1), 1.0), found_scale(), STANDARD
    )
    assert (single.gain_percent, single.ci95) == (50.0, (50.0, 50.0))


def found_scale() -> Scale:
    return Scale(800.0, 140.0, MILLIBAR)


def test_an_effect_that_is_far_larger_in_what_was_not_fitted_is_beyond_knowledge(one: Session) -> None:
    tenth = replace(one, conditions=replace(one.conditions, load=0.1 * one.conditions.load, cache={}))
    held = replace(one, held_out=np.ones(one.reading.size, dtype=bool))
    railed = MODEL.with_part(effect("saturation"), np.array([0.5, 0.6, 0.01, 0.0]))
    assert extrapolating_effect([tenth, held], railed, STANDARD) == "saturation"
    assert extrapolating_effect([one, held], railed, STANDARD) is None
    assert extrapolating_effect([tenth, held], MODEL, STANDARD) is None


# -- structure --------------------------------------------------------------------------------------------------------
def test_what_repeats_is_as_large_as_it_is(sessions: list[Session]) -> None:
    """A bow over each loaded stretch; rests hold none of it, so that it is less over the record."""
    residuals, square = [], 0.0
    for session in sessions:
        load = session.conditions.load
        bow = 0.004 * load * (1.0 - load)
        residuals.append(bow + 1e-4 * np.random.default_rng(session.index).standard_normal(load.size))
        square += float(bow @ bow)
    size = sum(session.reading.size for session in sessions)
    found = repeating_structure(sessions, residuals, STANDARD)
    assert found.rms == pytest.approx(np.sqrt(square / size), rel=0.1)
    assert found.z > 100.0
    # Nine presses of each of four rates, of which two rates press as long; each with each other one.
    assert found.pairs >= 4 * (9 * 8 // 2)
    kinds = repeats(sessions, residuals, STANDARD.cycle)
    assert sum(len(rows) for rows, _ in kinds) == 36
    # All but the rest that a recording begins with is within a cycle or rests after one.
    before = sum(float(np.argmax(session.conditions.load > 0.1)) for session in sessions)
    assert sum(share for _, share in kinds) == pytest.approx(1.0 - before / size, abs=0.05)


def test_what_repeats_in_fast_cycles_counts_for_the_time_that_they_take(sessions: list[Session]) -> None:
    """Cycles that come often are a small part of the record where they are short."""
    residuals, square = [], 0.0
    for session in sessions:
        fast = np.abs(session.conditions.rate_per_s) > 0.5
        bow = 0.004 * fast * (session.conditions.load > 0.1)
        residuals.append(bow + 1e-5 * np.random.default_rng(session.index).standard_normal(bow.size))
        square += float(bow @ bow)
    size = sum(session.reading.size for session in sessions)
    assert square > 0.0
    assert repeating_structure(sessions, residuals, STANDARD).rms == pytest.approx(np.sqrt(square / size), rel=0.15)


def test_the_score_of_noise_that_repeats_by_chance_is_a_normal_deviate(sessions: list[Session]) -> None:
    rng = np.random.default_rng(11)
    scores = [
        repeating_structure(
            sessions, [lfilter([1.0], [1.0, -0.9], rng.standard_normal(s.reading.size)) for s in sessions], STANDARD
        ).z
        for _ in range(20)
    ]
    assert np.std(scores) == pytest.approx(1.0, abs=0.5)
    assert abs(np.mean(scores)) < 0.8


def test_nothing_repeats_without_repeats(sessions: list[Session]) -> None:
    single = replace(sessions[0], cycle=np.zeros(sessions[0].reading.size, dtype=np.intp))
    assert repeating_structure([single], [np.ones(single.reading.size)], STANDARD) == NOTHING
    short = [replace(s, reading=s.reading[:50], usable=s.usable[:50]) for s in sessions]
    assert slow_structure(short, [np.ones(50) for _ in short], STANDARD) == NOTHING


def test_cycles_with_lacking_samples_are_left_out(sessions: list[Session]) -> None:
    session = sessions[0]
    kinds = repeats([session], [session.reading], STANDARD.cycle)
    usable = session.usable.copy()
    loaded = np.flatnonzero((session.cycle == 4) & (session.conditions.load > 0.3))
    usable[loaded] = False
    fewer = repeats([replace(session, usable=usable)], [session.reading], STANDARD.cycle)
    assert sum(len(rows) for rows, _ in kinds) - sum(len(rows) for rows, _ in fewer) == 1


def test_rows_of_a_kind_are_the_residual_along_the_cycle(sessions: list[Session]) -> None:
    session = sessions[0]
    kinds = repeats([session], [session.conditions.load], STANDARD.cycle)
    assert len(kinds) == 4
    for kind, _ in kinds:
        assert kind.shape[0] == 3
        assert np.max(kind, axis=1) == pytest.approx(np.ones(3), abs=0.06)
        assert kind[:, [0, PLACES - 1]] == pytest.approx(0.1, abs=0.1)
        assert int(np.argmax(kind[0])) == pytest.approx(PLACES / 2, abs=3)
        assert np.all(kind[:, PLACES:] <= 0.1)


@pytest.mark.parametrize("colour", [0.0, 0.8])
def test_means_of_noise_vary_as_its_own_fast_part_says(sessions: list[Session], colour: float) -> None:
    rng = np.random.default_rng(3)
    noise = [lfilter([1.0], [1.0, -colour], rng.standard_normal(s.reading.size)) for s in sessions]
    assert abs(slow_structure(sessions, noise, STANDARD).z) < 3.0
    sines = [3.0 * np.sin(2 * np.pi * s.conditions.time_s / 60.0) for s in sessions]
    wander = [one + sine for one, sine in zip(noise, sines, strict=True)]
    found = slow_structure(sessions, wander, STANDARD)
    assert found.z > 3.0
    assert found.rms == pytest.approx(3.0 / np.sqrt(2.0), rel=0.25)
    blocks = sum(int(s.conditions.time_s[-1] / STANDARD.lasting_s) for s in sessions)
    assert found.pairs == pytest.approx(blocks, abs=6)


def test_a_jump_in_one_block_makes_it_no_loud_noise(sessions: list[Session]) -> None:
    session = sessions[0]
    noise = 1e-3 * np.random.default_rng(5).standard_normal(session.reading.size)
    stepped = noise + 0.01 * (session.conditions.time_s > 0.5 * session.conditions.time_s[-1])
    assert slow_structure([session], [stepped], STANDARD).z > 10.0


def test_what_is_beyond_white_noise_is_the_rest_of_the_power(sessions: list[Session]) -> None:
    rng = np.random.default_rng(4)
    residuals = [1e-3 * rng.standard_normal(s.reading.size) for s in sessions]
    assert beyond_noise(sessions, residuals, STANDARD) < 3e-4
    tilted = [r + 2e-3 * np.sin(s.conditions.time_s / 3.0) for r, s in zip(residuals, sessions, strict=True)]
    assert beyond_noise(sessions, tilted, STANDARD) == pytest.approx(2e-3 / np.sqrt(2.0), rel=0.05)
    held = [replace(s, held_out=np.ones(s.reading.size, dtype=bool)) for s in sessions]
    assert beyond_noise(held, tilted, STANDARD) == 0.0


def _memory(**changes: Any) -> GaussMarkov:
    quiet = GaussMarkov(0.004, 1.0, 0.1, 0.1, 0.1, 0.0, STANDARD)
    return replace(quiet, **changes)


def test_noise_is_white_gaussian_deaf_to_the_load_and_quick_enough() -> None:
    assert _memory().is_noise
    for off in (
        {"spectrum_statistic": 9.0},
        {"kurtosis_z": 9.0},
        {"kurtosis_z": -9.0},
        {"load_z": 9.0},
        {"tau_s": 9.0},
    ):
        assert not _memory(**off).is_noise
    assert _memory(kurtosis_z=50.0, excess_kurtosis=-1.8).switches
    for off in ({"spectrum_statistic": 9.0}, {"load_z": 9.0}, {"excess_kurtosis": 0.0}, {"kurtosis_z": 3.0}):
        assert not _memory(**{"kurtosis_z": 50.0, "excess_kurtosis": -1.8, **off}).switches


def test_the_structure_is_the_largest_of_what_stands_out() -> None:
    repeated, wandering = LackOfFit(0.003, 50.0, 9, STANDARD), LackOfFit(0.002, 50.0, 9, STANDARD)
    quiet = LackOfFit(0.009, 1.0, 9, STANDARD)

    def left(repeats_: LackOfFit, slow_: LackOfFit, memory: GaussMarkov | None = None) -> ResidualStructure:
        return ResidualStructure(repeats_, slow_, quiet, memory, "", 0.0035)

    assert (left(repeated, wandering).rms, left(repeated, wandering).how) == (0.003, "repeats")
    assert (left(wandering, repeated).rms, left(wandering, repeated).how) == (0.003, "changes slowly")
    swings = left(quiet, quiet, _memory(rms=0.003, tau_s=math.inf))  # as a resonance does, within less than a block
    assert (swings.rms, swings.how) == (0.003, "is correlated over time")
    assert (left(quiet, quiet).rms, left(quiet, quiet).significant) == (0.0, False)
    for memory in (None, _memory()):  # what follows the load is structure, be what is slow in it noise or not
        rings = ResidualStructure(quiet, quiet, LackOfFit(0.003, 50.0, 9, STANDARD), memory, "", 0.0035)
        assert (rings.rms, rings.how, rings.is_noise) == (0.003, "follows the load", False)
    # Noise with a memory is no structure; what has a memory and is no noise is, though no larger than all there is.
    noise, other = _memory(), _memory(spectrum_statistic=9.0)
    assert left(quiet, wandering, noise).is_noise
    assert not left(quiet, wandering, noise).significant
    assert left(repeated, wandering, noise).rms == 0.003
    assert not left(repeated, wandering, noise).is_noise
    assert left(quiet, quiet, other).rms == 0.0035
    assert left(quiet, quiet, replace(other, rms=0.001)).rms == 0.001


def test_what_wanders_is_noise_that_remembers_and_what_changes_slowly_but_not_what_repeats() -> None:
    repeated, wandering, quiet = LackOfFit(0.003, 50.0, 9, STANDARD), LackOfFit(0.002, 50.0, 9, STANDARD), NOTHING
    noise = _memory(tau_s=0.75, rms=0.004)
    for repeats_, slow_, memory, most in (
        (quiet, wandering, None, 0.002), (repeated, wandering, None, 0.0), (quiet, quiet, None, 0.0),
        (quiet, wandering, noise, 0.004 / math.sqrt(2.0)), (quiet, quiet, replace(noise, spectrum_statistic=9.0), 0.0),
    ):  # fmt: skip
        assert ResidualStructure(repeats_, slow_, quiet, memory, "", 0.0035).sd_of_mean(3.0) == pytest.approx(most)


def test_what_is_left_is_tested_where_a_test_would_show_all_of_it() -> None:
    blind, keen = LackOfFit(0.0, 0.0, 9, STANDARD), LackOfFit(0.0, 0.0, 9, STANDARD, 1e-12)
    for repeats_, slow_, memory, told in (
        (blind, blind, None, False), (keen, blind, None, False), (blind, keen, None, True),
        (blind, blind, _memory(), True),
    ):  # fmt: skip
        assert ResidualStructure(repeats_, slow_, blind, memory, "", 0.0035).is_tested is told
    assert not ResidualStructure(keen, keen, keen, None, "", 1e-6).is_tested


def test_it_is_said_under_which_load_and_when_the_most_is_left(sessions: list[Session]) -> None:
    at = sessions[2].conditions
    rising = (at.rate_per_s > 0.05) & (at.load > 0.5) & (at.load < 0.75)
    residuals = [np.zeros(s.reading.size) for s in sessions]
    late = at.time_s > 0.9 * at.time_s[-1]
    residuals[2] = 0.01 * rising + 0.05 * (rising & late)
    said = worst_place(sessions, residuals, STANDARD)
    assert "at 50-75 % of full load while loading" in said
    assert f"; the worst stretch is {sessions[2].recording.name}, " in said
    begin, end = map(float, re.findall(r"(\d+)-(\d+) s$", said)[0])
    assert (begin, end) == (pytest.approx(0.9 * at.time_s[-1], abs=1.0), pytest.approx(at.time_s[-1], abs=1.0))
    share, samples = float(re.findall(r"^(\d+) %", said)[0]), float(re.findall(r"\((\d+) % of the samples\)", said)[0])
    assert share > 60.0
    loads = np.concatenate([s.conditions.load for s in sessions])
    rates = np.concatenate([s.conditions.rate_per_s for s in sessions])
    here = (loads >= 0.5) & (loads < 0.75) & (rates > STANDARD.still_per_s)
    assert samples == pytest.approx(100.0 * float(np.mean(here)), abs=1.0)
    held = [1.0 * (s.conditions.load < 0.1) * (np.abs(s.conditions.rate_per_s) < 1e-3) for s in sessions]
    assert "at 0-25 % of full load while the load stands" in worst_place(sessions, held, STANDARD)
    falling = [1.0 * (s.conditions.load > 0.8) * (s.conditions.rate_per_s < -0.05) for s in sessions]
    assert "at 75-100 % of full load while unloading" in worst_place(sessions, falling, STANDARD)


def test_the_slow_part_is_as_large_whatever_the_rate_of_the_log() -> None:
    """Means over half a second: a recording with four times the samples holds no more of it."""
    coarse, quick = recording(seed=1), recording(seed=2)
    step_s = 0.25 * float(quick.time_s[1])
    time_s = np.arange(0.0, float(quick.time_s[-1]), step_s)
    fine = Recording.from_arrays(
        time_s=time_s,
        force_n=np.interp(time_s, quick.time_s, quick.force_n),
        pressure_mbar=np.interp(time_s, quick.time_s, quick.sensor.values),
        name="fine",
    )
    sessions, _ = sessions_of(coarse, fine)
    assert sessions[1].conditions.step_s < 0.3 * sessions[0].conditions.step_s
    residuals = [np.full(one.reading.size, size) for one, size in zip(sessions, (0.02, 0.01), strict=True)]
    assert f"; the worst stretch is {coarse.name}, " in worst_place(sessions, residuals, STANDARD)


# -- which noise ------------------------------------------------------------------------------------------------------
def _remembering(session: Session, tau_s: float, rng: np.random.Generator) -> Array:
    keep = float(np.exp(-session.conditions.step_s / tau_s))
    drawn = np.sqrt(1.0 - keep**2) * rng.standard_normal(session.reading.size + 2000)
    return np.asarray(lfilter([1.0], [1.0, -keep], drawn)[2000:])


def test_a_memory_is_known_by_its_time_and_size_whatever_the_level(sessions: list[Session]) -> None:
    rng = np.random.default_rng(6)
    for tau_s in (0.5, 1.5):
        noise = [0.01 * _remembering(s, tau_s, rng) for s in sessions]
        found = gauss_markov_of(sessions, noise, STANDARD)
        lifted = gauss_markov_of(sessions, [one + 3.0 for one in noise], STANDARD)
        assert found is not None
        assert found.tau_s == pytest.approx(tau_s, rel=0.5)
        assert found.rms == pytest.approx(0.01, rel=0.3)
        assert lifted is not None
        assert lifted.rms == pytest.approx(found.rms, rel=1e-3)
        assert (lifted.tau_s, lifted.excess_kurtosis) == (found.tau_s, pytest.approx(found.excess_kurtosis))


def test_samples_that_lack_surprise_nobody(sessions: list[Session]) -> None:
    rng = np.random.default_rng(8)
    noise = [0.01 * _remembering(s, 1.0, rng) for s in sessions]
    usable = [s.usable & ~((s.conditions.time_s > 40.0) & (s.conditions.time_s < 50.0)) for s in sessions]
    torn = [replace(s, usable=mask) for s, mask in zip(sessions, usable, strict=True)]
    spoilt = [np.where(mask, one, 5.0) for one, mask in zip(noise, usable, strict=True)]
    found = gauss_markov_of(torn, spoilt, STANDARD)
    assert found is not None
    assert found.is_noise
    assert found.rms == pytest.approx(0.01, rel=0.3)


def test_correlation_is_not_looked_for_across_what_lacks() -> None:
    rng = np.random.default_rng(12)
    white = rng.standard_normal(20_000)
    kept = np.ones(white.size, dtype=bool)
    kept[5000:9000] = False
    spoilt = np.where(kept, 2.0 + white, 400.0)
    assert effective_noise_sd([spoilt, white], [kept, np.zeros(white.size, dtype=bool)]) == pytest.approx(1.0, rel=0.1)


@pytest.fixture(scope="module")
def fine() -> list[Session]:
    runs = [recording(noise=0.0, seed=1), recording(noise=0.0, seed=2)]
    sessions, scale = sessions_of(*runs)
    usable = [run.sensor.present for run in runs]
    made = at_full_rate(sessions, usable, replace(scale, load_n=800.0, reading=140.0), STANDARD)
    return [replace(s, reading=MODEL.simulate(s.conditions)) for s in made]


def _kinds(
    sessions: list[Session], noise: list[Array], known: list[DataFault] | None = None, **changes: Any
) -> list[tuple[str, int]]:
    given = [replace(s, reading=s.reading + one) for s, one in zip(sessions, noise, strict=True)]
    told = {"explained": True, "material": 1e-4, "memory": None, **changes}
    found = kinds_of_noise(given, MODEL, known or [], **told)
    return [(one.kind, one.recording) for one in found]


def _white(sessions: list[Session], size: float = 1e-3) -> list[Array]:
    rng = np.random.default_rng(13)
    return [size * rng.standard_normal(s.reading.size) for s in sessions]


def test_kinds_of_noise_are_told_recording_by_recording(fine: list[Session]) -> None:
    plain = _white(fine)
    assert _kinds(fine, plain) == []
    louder = [one * (1.0 + 4.0 * np.abs(s.conditions.load)) for one, s in zip(plain, fine, strict=True)]
    assert ("heteroscedastic_noise", 0) in _kinds(fine, louder)
    assert _kinds(fine, [louder[0], plain[1]]) == [("heteroscedastic_noise", 0)]
    hum = 3e-3 * np.sin(2 * np.pi * 11.0 * fine[0].conditions.time_s)
    assert ("hum", 0) in _kinds(fine, [plain[0] + hum, plain[1]])
    # What is weaker than what counts, what is known already, and what a fault imitates is not told again.
    assert _kinds(fine, [plain[0] + hum, plain[1]], material=0.1) == []
    for kind in ("dropouts", "held_samples"):
        fault = DataFault(kind, 0, "one", 0.0, 1.0, 1.0, "", "minor")
        assert _kinds(fine, louder, [fault]) == [("heteroscedastic_noise", 1)]
    hums = DataFault("hum", 0, "one", 0.0, 1.0, 1.0, "", "minor")
    assert ("hum", 0) not in _kinds(fine, [plain[0] + hum, plain[1]], [hums])


def test_coloured_noise_is_told_where_no_structure_would_be_taken_for_it(fine: list[Session]) -> None:
    rng = np.random.default_rng(14)
    spectrum_statistic = [0.004 * _remembering(s, 0.2, rng) for s in fine]
    both = [("coloured_noise", 0), ("coloured_noise", 1)]
    assert [one for one in _kinds(fine, spectrum_statistic) if one[0] == "coloured_noise"] == both
    assert _kinds(fine, _white(fine), memory=_memory()) == both
    assert [one for one in _kinds(fine, spectrum_statistic, memory=_memory()) if one[0] == "coloured_noise"] == both
    assert "coloured_noise" not in dict(_kinds(fine, spectrum_statistic, explained=False))
    assert _kinds(fine, _white(fine), memory=_memory(spectrum_statistic=9.0)) == []
    assert _kinds(fine, _white(fine), memory=_memory(rms=1e-5)) == []
    (first, _) = noise_with_memory(fine, MODEL, [], True, 1e-4, _memory(tau_s=1.25))
    assert "1.2 s" in first.says
    assert "0.4 % of full scale" in first.says
    run = fine[0].recording
    assert (first.start_s, first.stop_s) == (run.time_s[0], pytest.approx(run.time_s[-1]))


def test_zeros_of_recordings_that_differ_are_told_and_no_calibration_foresees_them() -> None:
    clean = [recording(seed=seed) for seed in (1, 2)]
    sensor = clean[1].sensor
    moved = clean[1].with_channel(sensor.with_values(sensor.values + 0.05 * MODEL.full_scale_reading))
    sessions, scale = sessions_of(*clean)
    assert own_zeros(sessions, MODEL, STANDARD) is None
    assert limit_own_zeros(None, scale) == []
    sessions, scale = sessions_of(clean[0], moved)
    zeros = own_zeros(sessions, MODEL, STANDARD)
    assert zeros is not None
    assert np.ptp(zeros.offsets) == pytest.approx(0.05, rel=0.05)
    bent = MODEL.with_part("dead_band", np.array([0.2, 0.3, 0.0]))
    assert own_zeros(sessions, bent, STANDARD) is None  # where as much is left it may be the model's error
    (said,) = limit_own_zeros(zeros, scale)
    read = scale.zero + float(zeros.offsets[0]) * scale.reading  # as it is logged
    assert f"from {read:.4g} {scale.unit.symbol} in triangles_1 to " in said
    assert f"in triangles_2, {100.0 * float(np.ptp(zeros.offsets)):.2g} % of full scale apart: " in said
    assert own_zeros(sessions, replace(MODEL, relaxing_share=9.0), STANDARD) is None  # no wall has such an arm
    on = replace(sessions[1], recording=replace(moved, metadata={"continues": "triangles_1"}))
    assert own_zeros([sessions[0], on], MODEL, STANDARD) is None
    assert own_zeros([on], MODEL, STANDARD) is None
    held = replace(sessions[1], held_out=np.ones_like(sessions[1].held_out))
    judged = own_zeros([sessions[0], held], MODEL, STANDARD)  # what is judged has one too, and makes no mean
    assert judged is not None
    # One zero for both is off by half of what they differ by; and one recording that begins so is told.
    (said,) = limit_calibration_off(compensation(sessions, MODEL, MODEL, STANDARD), STANDARD)
    off_n = 0.025 / MODEL.gain * scale.load_n
    assert float(said.split("is off by ")[1].split(" N (rms)")[0]) == pytest.approx(off_n, rel=0.2)
    alike, _ = sessions_of(clean[0], clean[1])
    assert limit_calibration_off(compensation(alike, MODEL, MODEL, STANDARD), STANDARD) == []
