"""Recordings whose readings lag by times of their own, too short to be seen before any model."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from smartshoe.diagnosis import Thresholds
from smartshoe.diagnosis._own_lags import OwnLags, lags_of_judged, own_lags
from smartshoe.diagnosis._scale import full_scale
from smartshoe.diagnosis._session import Session, prepare
from smartshoe.models.effects import Conditions
from smartshoe.models.extended import ExtendedModel
from smartshoe.recording import Recording

Array = NDArray[np.float64]

STANDARD = Thresholds()
STEP_S, FULL_N, FULL_MBAR = 0.02, 800.0, 140.0
MODEL = ExtendedModel(1.0, 0.08, 0.22, FULL_N, FULL_MBAR, "mbar")
TIME_S = np.arange(0.0, 60.0, STEP_S)


def _late(name: str, lag_s: float, period_s: float, seed: int, **metadata: object) -> Recording:
    """A unit under triangles, whose reading is later than its load; noise of 0.02 % of full scale."""
    load = np.clip(np.abs((TIME_S / period_s + 0.5) % 1.0 - 0.5) * 4.0 - 0.6, 0.0, 1.0) * (TIME_S > 5.0)
    share = MODEL.simulate(Conditions(TIME_S, load, STEP_S))
    share = np.interp(TIME_S - lag_s, TIME_S, share) + 2e-4 * np.random.default_rng(seed).standard_normal(TIME_S.size)
    return Recording.from_arrays(
        time_s=TIME_S, force_n=FULL_N * load, pressure_mbar=FULL_MBAR * share, name=name, metadata=metadata
    )


def _sessions(*runs: Recording, held_out: int = 0) -> list[Session]:
    usable = [one.sensor.present for one in runs]
    scale = replace(full_scale(runs, usable, STANDARD), load_n=FULL_N, reading=FULL_MBAR)
    held = [place >= len(runs) - held_out for place in range(len(runs))]
    return prepare(runs, usable, held, scale, [1] * (len(runs) - held_out), STANDARD)


lags = st.floats(-0.05, 0.05)


def _own(*runs: Recording, model: ExtendedModel = MODEL, held_out: int = 0) -> OwnLags | None:
    return own_lags(_sessions(*runs, held_out=held_out), model, STANDARD)


@given(st.tuples(lags, lags, lags), st.integers(0, 99))
def test_lags_that_differ_are_found_to_a_millisecond_and_others_are_none(
    lags_s: tuple[float, float, float], seed: int
) -> None:
    """Triangles of 6 s move the reading by 0.5 full scales a second: 3 ms are what small imperfections do."""
    found = _own(*(_late(f"r{k}", lag_s, 6.0 + k, seed + k) for k, lag_s in enumerate(lags_s)), held_out=1)
    apart_s = abs(lags_s[0] - lags_s[1])  # the last one is only judged, and tells nothing of the others
    if apart_s > 0.012:
        assert found is not None
    elif apart_s < 0.003:
        assert found is None
    if found is not None:
        mean_s = np.mean(lags_s[:2]) if found.are_about_mean else 0.0
        assert [found.each_s[k] + mean_s for k in range(3)] == pytest.approx(lags_s, abs=1e-3)


def test_the_models_delay_is_a_part_of_each_lag_since_the_clocks_may_have_made_it() -> None:
    runs = [_late("early", 0.01, 6.0, 1), _late("late", 0.05, 7.0, 2)]
    found = _own(*runs, model=MODEL.with_part("delay", np.array([0.03])))
    assert found is not None
    assert not found.are_about_mean  # two lags of 10 and 50 ms have a mean of 30 +- 20 ms, widened by Student's 12.7
    assert found.each_s == pytest.approx({0: 0.01, 1: 0.05}, abs=1e-3)


def test_a_delay_that_is_large_beside_what_clocks_differ_by_is_the_units() -> None:
    runs = [_late(f"r{k}", lag_s, 6.0 + k, k) for k, lag_s in enumerate((0.085, 0.1, 0.115))]
    found = _own(*runs)
    assert found is not None
    assert found.are_about_mean
    assert found.each_s == pytest.approx({0: -0.015, 1: 0.0, 2: 0.015}, abs=1e-3)


def test_one_recording_and_one_that_continues_another_tell_no_clocks() -> None:
    early, late = _late("early", 0.0, 6.0, 1), _late("late", 0.05, 7.0, 2)
    assert _own(late) is None
    assert _own(early, late) is not None
    assert _own(early, _late("late", 0.05, 7.0, 2, continues="early")) is None


def test_what_a_good_units_imperfections_add_up_to_decides_how_far_clocks_may_differ() -> None:
    runs = _sessions(_late("early", 0.0, 6.0, 1), _late("late", 0.02, 7.0, 2))
    assert own_lags(runs, MODEL, STANDARD) is not None
    assert own_lags(runs, MODEL, replace(STANDARD, tolerable=0.02)) is None


@settings(max_examples=20)
@given(lags, lags, st.integers(0, 99))
def test_a_recording_that_judges_shows_its_own_clock_to_a_millisecond(
    fitted_s: float, judged_s: float, seed: int
) -> None:
    """Relative to the fitted ones, whose delay is the model's, or stays in what it leaves."""
    runs = (
        _late("one", fitted_s, 6.0, seed),
        _late("other", fitted_s, 7.0, seed + 1),
        _late("w", judged_s, 5.0, seed + 2),
    )
    found = lags_of_judged(_sessions(*runs, held_out=1), MODEL, STANDARD)
    apart_s = judged_s - fitted_s
    if abs(apart_s) > 0.006:
        assert found == {2: pytest.approx(apart_s, abs=0.001)}
    if abs(apart_s) < 0.001:  # small imperfections do as much
        assert found == {}
    assert lags_of_judged(_sessions(*runs[:2]), MODEL, STANDARD) == {}
    assert lags_of_judged(_sessions(*runs), MODEL, STANDARD) == {}


def test_a_lag_that_leaves_most_of_what_a_recording_is_off_by_is_no_clock() -> None:
    """Of another unit, whose arm is another: its readings are late as well, but no shift makes them the same."""
    runs = [_late("one", 0.0, 6.0, 1), _late("other", 0.0, 7.0, 2), _late("w", 0.004, 5.0, 3)]
    share = runs[2].sensor.values
    runs[2] = runs[2].with_channel(runs[2].sensor.with_values(share + 2.0 * np.sin(TIME_S)))
    assert lags_of_judged(_sessions(*runs, held_out=1), MODEL, STANDARD) == {}
