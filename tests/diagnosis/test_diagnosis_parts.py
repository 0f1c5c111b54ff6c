"""The parts of a diagnosis by themselves: what each promises, on signals whose answer is known."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scipy.signal import lfilter

from smartshoe import Recording, dynamic_protocol
from smartshoe.diagnosis import Thresholds
from smartshoe.diagnosis._averaging import kernel, smoothed
from smartshoe.diagnosis._baseline import baseline_of
from smartshoe.diagnosis._contest import Contest
from smartshoe.diagnosis._denoise import noise_sd
from smartshoe.diagnosis._excitation import excitation_of
from smartshoe.diagnosis._experiments import EXPERIMENTS
from smartshoe.diagnosis._held_out import errors, gain
from smartshoe.diagnosis._lack_of_fit import repeating_structure, slow_structure
from smartshoe.diagnosis._likelihood import Likelihood, fit
from smartshoe.diagnosis._noise import effective_noise_sd
from smartshoe.diagnosis._own_terms import residual_of
from smartshoe.diagnosis._scale import Scale, full_scale, thinning
from smartshoe.diagnosis._session import Session, prepare
from smartshoe.models.effects import Conditions, effect
from smartshoe.models.extended import ExtendedModel
from smartshoe.units import MILLIBAR

RATE_HZ = 50.0
MODEL = ExtendedModel(1.0, 0.08, 0.22, 800.0, 140.0, "mbar")


def recording(
    model: ExtendedModel = MODEL, seed: int = 0, noise: float = 0.001, rates: tuple[float, ...] = (100, 200, 400, 800)
) -> Recording:
    """What a model itself would read: for the arithmetic of the parts, not for hidden effects."""
    protocol = dynamic_protocol(rates, repeats=3, rest_s=4.0)
    time_s = np.arange(0.0, protocol.duration_s, 1 / RATE_HZ)
    load_n = protocol.load_at(time_s)
    conditions = Conditions(time_s, load_n / model.full_scale_load_n, 1 / RATE_HZ)
    reading = model.simulate(conditions) + noise * np.random.default_rng(seed).standard_normal(time_s.size)
    return Recording.from_arrays(
        time_s=time_s, force_n=load_n, pressure_mbar=reading * model.full_scale_reading, name=f"triangles_{seed}"
    )


def sessions_of(*recordings: Recording) -> tuple[list[Session], Scale]:
    usable = [one.sensor.present for one in recordings]
    scale = full_scale(recordings, usable, Thresholds())
    return prepare(recordings, usable, None, scale, thinning(recordings, scale, Thresholds()), Thresholds()), scale


def likelihood_of(sessions: list[Session], like: ExtendedModel = MODEL) -> Likelihood:
    return Likelihood(sessions, 0.001, like, Thresholds())


# -- sessions ---------------------------------------------------------------------------------------------------
@given(st.integers(1, 12), st.floats(-3, 3), st.floats(-2, 2))
def test_smoothing_leaves_straight_lines_where_they_are(factor: int, start: float, slope: float) -> None:
    line = start + slope * np.arange(200.0)
    assert_allclose(smoothed(line, kernel(factor), factor), line[::factor], atol=1e-9)


def test_every_third_load_cycle_is_held_out_and_nothing_else() -> None:
    (session,), _ = sessions_of(recording())
    held = {int(number) for number in session.cycle[session.held_out]}
    assert held == set(range(2, int(session.cycle[-1]) + 1, 3))
    assert not (session.fitted & session.judged).any()


def test_held_out_recordings_are_never_fitted() -> None:
    pair = [recording(seed=1), recording(seed=2)]
    usable = [one.sensor.present for one in pair]
    scale = full_scale(pair, usable, Thresholds())
    first, second = prepare(pair, usable, [False, True], scale, [3], Thresholds())
    assert first.fitted.all()
    assert not second.fitted.any()


def test_a_recording_that_continues_another_knows_what_went_before() -> None:
    first = recording(seed=1)
    later = Recording.from_arrays(
        time_s=first.time_s, force_n=first.force_n, pressure_mbar=first["pressure"].values, name="later",
        metadata={"continues": first.name},
    )  # fmt: skip
    sessions, _ = sessions_of(first, later)
    assert sessions[0].conditions.before == {}
    assert sessions[1].conditions.before["largest_load"] == pytest.approx(1.0, abs=0.05)
    assert sessions[1].conditions.before["cycles"] == 12
    assert sessions[1].conditions.before["time_s"] == pytest.approx(first.duration_s, abs=0.5)


def test_the_load_cells_noise_is_taken_out_of_rests() -> None:
    noisy = recording()
    load = noisy.force_n + 0.8 * np.random.default_rng(3).standard_normal(len(noisy))
    again = Recording.from_arrays(
        time_s=noisy.time_s, force_n=load, pressure_mbar=noisy["pressure"].values, name="noisy"
    )
    (session,), _ = sessions_of(again)
    inner = np.convolve(session.resting, np.ones(15), "same") > 14.5
    assert np.std(session.conditions.load[inner]) < 3e-4


# -- noise ------------------------------------------------------------------------------------------------------
@given(st.integers(0, 1000), st.floats(0.3, 30.0))
@settings(max_examples=20)
def test_noise_is_known_to_five_percent_on_any_lattice(seed: int, steps: float) -> None:
    """Of 20,000 samples a standard deviation is known to 0.5 %; the lattice adds a twelfth of its step's square."""
    rng = np.random.default_rng(seed)
    signal = np.round(steps * rng.standard_normal(20_000) + np.linspace(0.0, 300.0, 20_000))
    assert_allclose(noise_sd(signal, Thresholds()), np.sqrt(steps**2 + 1.0 / 12.0), rtol=0.05)


@given(st.floats(0.0, 0.9), st.integers(0, 99))
@settings(max_examples=15, deadline=None)
def test_correlated_samples_tell_as_much_as_the_mean_of_a_markov_process(memory: float, seed: int) -> None:
    """The variance of the mean of n samples is sd^2 (1 + memory) / (1 - memory) / n (Box and Jenkins 1976)."""
    rng = np.random.default_rng(seed)
    e = lfilter([0.002], [1.0, -memory], rng.standard_normal(60_000))
    own_sd = 0.002 / np.sqrt(1.0 - memory**2)
    parts = [e[:40_000], e[40_000:]]
    found = effective_noise_sd(parts, [np.ones(part.size, dtype=bool) for part in parts])
    assert found == pytest.approx(own_sd * np.sqrt((1.0 + memory) / (1.0 - memory)), rel=0.15)


def test_structure_counts_once_a_correlation_time() -> None:
    slow = np.sin(np.linspace(0.0, 6.0 * np.pi, 3000))
    everywhere = np.ones(slow.size, dtype=bool)
    fine = effective_noise_sd([np.repeat(slow, 10)], [np.ones(10 * slow.size, dtype=bool)])
    # Ten times the samples of the same course tell no more: the information n / sd^2 stays.
    assert fine == pytest.approx(np.sqrt(10.0) * effective_noise_sd([slow], [everywhere]), rel=0.02)


# -- baseline and fits --------------------------------------------------------------------------------------------
@given(st.floats(0.03, 0.5), st.floats(0.05, 2.0))
@settings(max_examples=12, deadline=None)
def test_the_baseline_is_found_wherever_its_pole_is(share: float, rate: float) -> None:
    truth = ExtendedModel(1.0, share, rate, 800.0, 140.0, "mbar")
    sessions, scale = sessions_of(recording(truth, noise=0.0005))
    start = baseline_of(sessions, scale)
    found = fit(likelihood_of(sessions, start), start).model
    assert np.sqrt(np.mean(residual_of(sessions[0], found) ** 2)) < 0.0007


def test_a_fit_finds_an_effects_parameter_within_its_error_bar() -> None:
    truth = MODEL.with_part(effect("gain_drift"), np.array([2e-4, 0.0, 60.0, 0.0, 1.0]))
    sessions, scale = sessions_of(recording(truth))
    start = baseline_of(sessions, scale).with_part(effect("gain_drift"))
    found = fit(likelihood_of(sessions, start), start)
    sd = float(np.sqrt(found.covariance[3, 3]))
    assert found.model.theta[3] == pytest.approx(2e-4, abs=4 * sd + 1e-6)


def test_a_bound_holds_and_a_parameter_without_influence_stays() -> None:
    sessions, scale = sessions_of(recording())
    start = baseline_of(sessions, scale).with_part(effect("linear_leak")).with_part(effect("gain_drift"))
    found = fit(likelihood_of(sessions, start), start).model
    leak, drift = (part for part in found.parts)
    assert leak.values[0] >= 0.0
    assert drift.values[1] == 0.0  # the coefficient of a temperature that was not logged


# -- what is left ---------------------------------------------------------------------------------------------
@given(st.integers(0, 50), st.floats(0.0, 0.5), st.sampled_from([0.1, 0.3, 0.6]))
@settings(max_examples=25, deadline=None)
def test_noise_of_any_colour_is_not_taken_for_structure(seed: int, share: float, tau_s: float) -> None:
    sessions, _ = sessions_of(recording(rates=(50, 100, 200, 400)))
    rng = np.random.default_rng(seed)
    session = sessions[0]
    step_s, n = session.conditions.step_s, session.reading.size
    keep = np.exp(-step_s / tau_s)
    coloured = np.zeros(n)
    for k in range(1, n):
        coloured[k] = keep * coloured[k - 1] + np.sqrt(1 - keep**2) * rng.standard_normal()
    noise = 0.001 * (np.sqrt(1 - share) * rng.standard_normal(n) + np.sqrt(share) * coloured)
    assert not repeating_structure(sessions, [noise], Thresholds()).significant
    assert not slow_structure(sessions, [noise], Thresholds()).significant


def test_what_repeats_and_what_wanders_are_seen() -> None:
    sessions, _ = sessions_of(recording(rates=(50, 100, 200, 400)))
    at = sessions[0].conditions
    noise = 0.0005 * np.random.default_rng(1).standard_normal(at.load.size)
    bow = 0.002 * at.load * (1 - at.load)
    wander = 0.001 * np.sin(2 * np.pi * at.time_s / 47.0)
    assert repeating_structure(sessions, [noise + bow], Thresholds()).z > 10.0
    seen = slow_structure(sessions, [noise + wander], Thresholds())
    assert seen.z > 5.0
    assert seen.rms == pytest.approx(0.001 / np.sqrt(2), rel=0.2)


# -- judgement, traits, experiments ---------------------------------------------------------------------------
def test_a_gains_interval_holds_the_gain_and_shrinks_to_nothing_for_nothing() -> None:
    truth = MODEL.with_part(effect("gas_compression"), np.array([0.05]))
    sessions, scale = sessions_of(recording(truth))
    plain = baseline_of(sessions, scale)
    start = fit(likelihood_of(sessions, plain), plain).model
    better = fit(likelihood_of(sessions, plain), start.with_part(effect("gas_compression"))).model
    won = gain(errors(sessions, start), errors(sessions, better), scale, Thresholds())
    assert won.ci95[0] <= won.gain_percent <= won.ci95[1]
    assert won.gain_percent > 30.0
    nothing = gain(errors(sessions, start), errors(sessions, start), scale, Thresholds())
    assert nothing.gain_percent == 0.0
    assert nothing.ci95 == (0.0, 0.0)


def test_one_rate_is_said_to_say_nothing_of_rates() -> None:
    sessions, _ = sessions_of(recording(rates=(200, 200)))
    said = " ".join(excitation_of(sessions, Thresholds()).limits())
    assert "one loading rate only" in said
    several, _ = sessions_of(recording())
    assert "one loading rate only" not in " ".join(excitation_of(several, Thresholds()).limits())
    assert {"rates", "rests", "repeats"} <= excitation_of(several, Thresholds()).present


@pytest.mark.parametrize("name", sorted(EXPERIMENTS))
def test_an_experiment_asks_for_no_more_than_the_load_it_is_made_for(name: str) -> None:
    protocol = EXPERIMENTS[name](800.0)
    assert protocol.peak_load_n <= 800.0 + 1e-9
    assert protocol.name == name
    assert all(segment.duration_s > 0 and segment.load_n >= 0 for segment in protocol.segments)


def test_two_equal_models_cannot_be_told_apart_by_any_experiment() -> None:
    sessions, scale = sessions_of(recording())
    plain = baseline_of(sessions, scale)
    found = fit(likelihood_of(sessions, plain), plain)
    for made in EXPERIMENTS.values():
        assert Contest(found, found, found).after_experiment(made(800.0), 0.02).margin == pytest.approx(0.0, abs=0.1)


def test_steps_tell_a_lag_from_a_delay_better_than_triangles_do() -> None:
    truth = MODEL.with_part(effect("sensor_lag"), np.array([0.03, 0.0]))
    sessions, scale = sessions_of(recording(truth))
    plain = baseline_of(sessions, scale)
    likelihood = likelihood_of(sessions, plain)
    start = fit(likelihood, plain).model
    lag = fit(likelihood, start.with_part(effect("sensor_lag"), np.array([0.02, 0.1])))
    delay = fit(likelihood, start.with_part(effect("delay"), np.array([0.02])))
    now = Contest(lag, delay, fit(likelihood, start))
    margins = {name: now.after_experiment(EXPERIMENTS[name](800.0), 0.02).margin for name in ("steps", "rates", "idle")}
    assert margins["steps"] > 2 * margins["rates"]
    assert margins["steps"] > 2 * margins["idle"]
    for name, margin in margins.items():  # whether it is asked for or not, it grows by as much
        grown = margin - now.margin
        assert now.after_experiment(EXPERIMENTS[name](800.0), 0.02, 1.01 * grown) is None
        assert now.after_experiment(EXPERIMENTS[name](800.0), 0.02, 0.99 * grown).margin == margin
    for name in ("steps", "idle"):  # whatever the rival were fitted to, it cannot miss more than it does as it is
        before = Contest(lag, lag, now.without).after_experiment(EXPERIMENTS[name](800.0), 0.02, 1.0)
        assert before is None
    for made in EXPERIMENTS.values():  # what is passed over by its bound would not have come as far
        then = now.after_experiment(made(800.0), 0.02)
        assert now.after_experiment(made(800.0), 0.02, min_log_odds=0.999 * then.log_odds) is not None
    alike = Contest(lag, fit(likelihood, lag.model.with_part(effect("zero_drift")), 1), now.without)
    for made in EXPERIMENTS.values():
        most = alike.after_experiment(made(800.0), 0.02).log_odds
        assert alike.after_experiment(made(800.0), 0.02, min_log_odds=1.0) is None
        assert most < 1.0


def test_units_of_the_scale_are_the_readings() -> None:
    _, scale = sessions_of(recording())
    assert scale.unit == MILLIBAR
    assert scale.load_n == pytest.approx(800.0, rel=0.01)
