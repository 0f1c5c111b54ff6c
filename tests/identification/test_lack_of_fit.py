"""The F test on repeated cycles: of its stated size where the model is right, and awake where it is not."""

from __future__ import annotations

import numpy as np
import pytest
from presses import press, pressed
from scipy import signal

from smartshoe.errors import NotIdentifiableError, UsageError
from smartshoe.identification import identify
from smartshoe.identification.lack_of_fit import lack_of_fit, lack_of_fit_of
from smartshoe.protocol import dynamic_protocol
from smartshoe.recording import Recording

CASES = 300


def loads(repeats: int = 3) -> Recording:
    protocol = dynamic_protocol((200.0, 400.0, 800.0), repeats=repeats, rest_s=1.3)
    time_s = np.arange(0.0, protocol.duration_s, 0.01)
    load_n = protocol.load_at(time_s)
    return Recording.from_arrays(time_s=time_s, force_n=load_n, pressure_mbar=load_n)


@pytest.mark.parametrize("correlation", [0.5, *(pytest.param(one, marks=pytest.mark.long) for one in (0.0, 0.9))])
def test_false_alarms_are_as_many_as_stated(correlation: float) -> None:
    recording = loads()
    rng = np.random.default_rng(11)
    white = rng.standard_normal((CASES, len(recording) + 200))
    noise = signal.lfilter([1.0], [1.0, -correlation], white, axis=1)[:, 200:]
    p_values = np.array([lack_of_fit_of({"r": row}, [recording], unknowns=0).p_value for row in noise])
    # Binomial(300, 0.05) is 15, sd 3.8: four of those either way.
    assert 0 < (p_values < 0.05).sum() <= 30
    assert 0.4 < p_values.mean() < 0.6


def test_false_alarms_after_a_fit_are_as_many_as_stated() -> None:
    alarms = 0
    for seed in range(24):
        recording = press(load_noise=2.23, seed=seed, rates=(200.0, 800.0), repeats=3)
        alarms += lack_of_fit(identify(recording, method="gn"), recording).p_value < 0.05
    # Binomial(24, 0.05) holds 5 or fewer in all but 1 of 1000 cases.
    assert alarms <= 5


def second_relaxation(share: float) -> Recording:
    """A plant with a relaxation of its own at 3 rad/s beside the fitted one, of ``share`` of the load."""
    protocol = dynamic_protocol((100.0, 400.0, 800.0), repeats=3, rest_s=2.0)
    fine = np.arange(0.0, protocol.duration_s, 1e-3)
    load = protocol.load_at(fine)
    slow = pressed(([1.0, 0.215], [1.6, 0.33]), load, 1e-3)
    fast = pressed(([share, 0.0], [1.0, 3.0]), load, 1e-3)
    force_n = load[::10] + 2.23 * np.random.default_rng(3).standard_normal(load[::10].size)
    return Recording.from_arrays(time_s=fine[::10], force_n=force_n, pressure_mbar=(slow + fast)[::10])


def bent(curvature_per_n: float) -> Recording:
    clean = press(repeats=3, load_noise=2.23)
    reading = clean.sensor.values
    return Recording.from_arrays(
        time_s=clean.time_s, force_n=clean.force_n, pressure_mbar=reading + curvature_per_n * reading**2
    )


@pytest.mark.parametrize("recording", [second_relaxation(0.01), bent(2e-5)], ids=["second relaxation", "static curve"])
def test_what_the_model_lacks_is_seen(recording: Recording) -> None:
    found = identify(recording)
    assert found.fit_percent > 95.0
    test = lack_of_fit(found, recording)
    assert test.p_value < 1e-4
    assert test.n_cycles == 9
    assert "lacks" in test.says


def test_the_repeatable_share_is_that_of_the_variance() -> None:
    recording = loads(repeats=4)
    rng = np.random.default_rng(5)
    wave = recording.force_n - recording.force_n.mean()
    wave /= wave.std()
    residual = wave + rng.standard_normal(len(recording))
    test = lack_of_fit_of({"r": residual}, [recording], unknowns=0)
    # Half; the rests at the record's ends, outside of the cycles, shift it by some percent.
    assert test.repeatable_percent == pytest.approx(50.0, abs=5.0)


def test_samples_that_do_not_count_are_left_out() -> None:
    recording = loads()
    residual = np.random.default_rng(6).standard_normal(len(recording))
    gone = residual.copy()
    gone[500:560] = np.nan
    assert np.isfinite(lack_of_fit_of({"r": gone}, [recording], unknowns=0).p_value)
    with pytest.raises(NotIdentifiableError, match="counted places"):
        lack_of_fit_of({"r": np.full(len(recording), np.nan)}, [recording], unknowns=0)


def test_nothing_repeated_is_refused() -> None:
    recording = press(load_noise=1.0, repeats=1)
    with pytest.raises(NotIdentifiableError, match="no load cycle is repeated"):
        lack_of_fit(identify(recording), recording)
    with pytest.raises(UsageError, match="in order"):
        lack_of_fit_of({"r": np.zeros(3)}, [loads()], unknowns=0)


def test_of_two_repeats_the_mean_has_as_many_degrees_as_their_difference() -> None:
    """Fewer of both where the noise depends on itself: a block that follows the last one tells less."""
    recording = loads(repeats=2)
    white = np.random.default_rng(3).standard_normal(len(recording) + 200)
    slow = signal.lfilter([1.0], [1.0, -0.97], white)[200:]
    told = [lack_of_fit_of({"r": noise}, [recording], unknowns=0).degrees for noise in (white[200:], slow)]
    assert all(mean == difference for mean, difference in told)
    assert told[1][0] < 0.8 * told[0][0]
