"""What the choice between look-alikes rests on: corners, rests, a cause that all recordings share."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from smartshoe import Recording, dynamic_protocol
from smartshoe.diagnosis.baseline import searched, shared_timing
from smartshoe.diagnosis.denoise import noise_sd
from smartshoe.diagnosis.fitting import Evidence, fit
from smartshoe.diagnosis.margins import is_better, margin
from smartshoe.diagnosis.noise import white
from smartshoe.diagnosis.screen import dictionary, noise_of, screen
from smartshoe.diagnosis.session import Scale, Session, full_scale, prepare, thinning
from smartshoe.models.effects import Conditions, effect
from smartshoe.models.extended import ExtendedModel

RATE_HZ = 100.0
LOAD_NOISE_N = 0.8
MODEL = ExtendedModel(1.0, 0.08, 0.22, 800.0, 140.0, "mbar")


def recording(model: ExtendedModel, seed: int, load_noise_n: float = 0.0, tare_n: float = 0.0) -> Recording:
    """Triangles on a unit that is the model itself, with noise on load and reading."""
    protocol = dynamic_protocol((200, 400, 800), repeats=3, rest_s=4.0)
    time_s = np.arange(0.0, protocol.duration_s, 1 / RATE_HZ)
    load_n = protocol.load_at(time_s)
    rng = np.random.default_rng(seed)
    conditions = Conditions(time_s, load_n / model.full_scale_load_n, 1 / RATE_HZ)
    reading = model.simulate(conditions) + 0.001 * rng.standard_normal(time_s.size)
    return Recording.from_arrays(
        time_s=time_s,
        force_n=load_n + tare_n + load_noise_n * rng.standard_normal(time_s.size),
        pressure_mbar=reading * model.full_scale_reading,
        name=f"triangles_{seed}",
    )


def sessions_of(*recordings: Recording) -> tuple[list[Session], Scale]:
    usable = [one.sensor.present for one in recordings]
    scale = full_scale(recordings, usable)
    return prepare(recordings, usable, None, scale, thinning(recordings, scale)), scale


# -- corners ----------------------------------------------------------------------------------------------------
@given(st.integers(0, 1000), st.floats(0.3, 30.0))
@settings(max_examples=20)
def test_noise_is_known_to_five_percent_on_any_lattice(seed: int, steps: float) -> None:
    """Of 20,000 samples a standard deviation is known to 0.5 %; the lattice adds a twelfth of its step's square."""
    rng = np.random.default_rng(seed)
    signal = np.round(steps * rng.standard_normal(20_000) + np.linspace(0.0, 300.0, 20_000))
    assert_allclose(noise_sd(signal), np.sqrt(steps**2 + 1.0 / 12.0), rtol=0.05)


@pytest.mark.parametrize("true", ["delay", "sensor_lag"])
def test_a_noisy_load_does_not_make_a_lag_of_a_delay(true: str) -> None:
    values = {"delay": np.array([0.012]), "sensor_lag": np.array([0.012, 0.2])}
    sessions, scale = sessions_of(
        *(recording(MODEL.with_part(effect(true), values[true]), seed, LOAD_NOISE_N) for seed in range(2))
    )
    start = searched(sessions, scale, None)[1]
    evidence = Evidence(sessions, noise_of(dictionary(start, sessions)), np.zeros(0), 1.0)
    found = {name: fit(evidence, start.with_part(effect(name), at), 20) for name, at in values.items()}
    other = next(name for name in values if name != true)
    assert is_better(evidence, found[true], found[other])
    assert margin(evidence, found[other], found[true], fit(evidence, start)) > 0


def test_what_the_loads_noise_adds_is_taken_off_again() -> None:
    """The cost under a noisy load is that under none, but for the draw's own scatter."""
    late = MODEL.with_part(effect("sensor_lag"), np.array([0.02, 0.2]))
    costs = []
    for noise_n in (0.0, LOAD_NOISE_N):
        sessions, _ = sessions_of(recording(late, 3, noise_n))
        model = ExtendedModel.from_dict({**late.to_dict(), "full_scale_reading": late.full_scale_reading})
        evidence = Evidence(sessions, white(0.0005), np.zeros(0), 1.0)
        plain = fit(evidence, model, 20)
        costs.append(evidence.cost_of_corners(plain.model) / sum(one.fitted.sum() for one in sessions))
    assert_allclose(costs[1], costs[0], rtol=0.15)


# -- rests ------------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("true", ["load_cell_tare", "zero_offset"])
def test_the_screen_tells_a_tare_from_an_offset_by_the_rests(true: str) -> None:
    model = MODEL if true == "load_cell_tare" else MODEL.with_part(effect("zero_offset"), np.array([0.02]))
    sessions, scale = sessions_of(recording(model, 1, tare_n=-16.0 if true == "load_cell_tare" else 0.0))
    rest = np.array([np.mean(one.conditions.load[one.resting]) for one in sessions])
    start = searched(sessions, scale, None)[1]
    evidence = Evidence(sessions, white(0.001), rest, 3e-4)
    looked = screen(dictionary(start, sessions), evidence.noise, evidence.rests(start))
    falls = {one.candidate.effect.name: one.fall for one in looked.ranked}
    other = {"load_cell_tare": "zero_offset", "zero_offset": "load_cell_tare"}[true]
    # The readings tell them apart hardly; the one rest says how far off the load of the other one is.
    assert_allclose(falls[true] - falls[other], (0.02 / evidence.rest_sd) ** 2, rtol=0.15)


# -- curves -----------------------------------------------------------------------------------------------------
def test_a_soft_saturation_without_ties_is_what_the_screen_sees_first() -> None:
    soft = MODEL.with_part(effect("saturation"), np.array([0.6, 0.9, 0.03, 0.0]))
    sessions, scale = sessions_of(recording(soft, 2))
    looked = screen(dictionary(searched(sessions, scale, None)[1], sessions), white(0.001))
    assert looked.names[0] == "saturation"


# -- fits -------------------------------------------------------------------------------------------------------
def test_what_is_held_still_stays_where_it_is() -> None:
    sessions, scale = sessions_of(recording(MODEL.with_part(effect("zero_offset"), np.array([0.02])), 4))
    start = searched(sessions, scale, None)[1].with_part(effect("zero_offset"), np.array([0.005]))
    evidence = Evidence(sessions, white(0.001), np.zeros(0), 1.0)
    held = fit(evidence, start, still=("zero_offset",))
    assert held.model.parts[0].values[0] == 0.005
    assert held.cost < evidence.cost(start)
    assert_allclose(fit(evidence, start).model.parts[0].values[0], 0.02, rtol=0.05)


# -- clocks -----------------------------------------------------------------------------------------------------
def test_one_drift_of_all_recordings_comes_before_a_clock_for_each() -> None:
    drift = MODEL.with_part(effect("clock_drift"), np.array([0.003]))
    given, scale = sessions_of(*(recording(drift, seed) for seed in range(2)))
    # Moved by what each is late in its middle, as without a model they would be.
    late_s = 0.003 * 0.5 * given[0].conditions.time_s[-1]
    moved = [
        Session(
            one.recording, one.index, one.conditions,
            np.interp(one.conditions.time_s + late_s, one.conditions.time_s, one.reading),
            one.usable, one.held_out, one.cycle, one.resting, one.thinned,
        )
        for one in given
    ]  # fmt: skip
    found = shared_timing(given, moved, scale, [0.0027])
    assert found is not None
    assert found[0] == "clock_drift"


def test_clocks_that_part_differently_share_nothing() -> None:
    early = MODEL.with_part(effect("delay"), np.array([1.2]))
    one, other = recording(early, 0), recording(MODEL, 1)
    given, scale = sessions_of(one, other)
    moved, _ = sessions_of(recording(MODEL, 0), other)
    assert shared_timing(given, moved, scale, [0.0]) is None
