"""Leave one rate out: a right model stays where it is, a wrong one moves though its fit in percent is high."""

from __future__ import annotations

from dataclasses import fields

import numpy as np
import pytest
from presses import press, pressed

from smartshoe.errors import NotIdentifiableError
from smartshoe.identification.leave_out import leave_one_rate_out
from smartshoe.protocol import dynamic_protocol
from smartshoe.recording import Recording

RATES = (100.0, 400.0, 800.0)


def one_each(**noise: float) -> list[Recording]:
    return [
        press(rates=(rate,), offset=3.0 + index, seed=index, name=f"{rate:g}", **noise)
        for index, rate in enumerate(RATES)
    ]


@pytest.mark.parametrize("kind", ["one recording", "a recording for each rate"])
def test_a_right_model_predicts_the_rate_it_has_not_seen_to_its_noise(kind: str) -> None:
    noise_n = 2.23
    recordings = press(load_noise=noise_n, offset=3.0) if kind == "one recording" else one_each(load_noise=noise_n)
    result = leave_one_rate_out(recordings)
    assert [fold.rate_n_per_s for fold in result.folds] == list(RATES)
    for fold in result.folds:
        assert fold.cycles == 2
        # 600 samples and more: sd of the rmse 3 %; the zero of a left-out recording from 200 adds 0.3 %.
        assert fold.rmse_left_out_n == pytest.approx(noise_n, rel=0.12)
        assert fold.rmse_fitted_n == pytest.approx(noise_n, rel=0.12)
        assert fold.rmse_left_out_n < fold.max_left_out_n < 6 * noise_n
    # Of nine standard deviates the largest stays within 4 but for 1 in 1000 cases.
    assert max(one.moved_sd for one in result.movements.values()) < 4
    assert "no parameter moves" in result.says


def test_the_zero_of_a_recording_left_out_does_not_matter() -> None:
    plain, other = one_each(load_noise=1.0), one_each(load_noise=1.0)
    last = other[-1]
    other[-1] = Recording.from_arrays(
        time_s=last.time_s, force_n=last.force_n, pressure_mbar=last.sensor.values + 40.0, name=last.name
    )
    first, second = (leave_one_rate_out(recordings).folds[-1] for recordings in (plain, other))
    assert second.rmse_left_out_n == pytest.approx(first.rmse_left_out_n, rel=1e-6)


def test_the_reading_unit_is_the_first_recordings_whichever_is_left_out() -> None:
    mixed = one_each(load_noise=1.0)
    first = mixed[0]
    mixed[0] = Recording.from_arrays(
        time_s=first.time_s, force_n=first.force_n, pressure_kpa=first.sensor.values / 10, name=first.name,
        unit=first.unit,
    )  # fmt: skip
    for fold in leave_one_rate_out(mixed).folds:
        assert fold.found.reading_unit.symbol == "kPa"
        assert fold.rmse_left_out_n == pytest.approx(1.0, rel=0.12)


def test_the_forward_direction_gives_errors_of_force() -> None:
    result = leave_one_rate_out(press(reading_noise=1.0), direction="forward")
    for fold in result.folds:
        # White noise passes the compensator with its direct gain b0, 1.59 N per mbar.
        assert fold.rmse_left_out_n == pytest.approx(1.59, rel=0.12)


def two_relaxations(share: float) -> Recording:
    """A second relaxation at 3 rad/s, of ``share`` of the load, that the fitted model lacks."""
    protocol = dynamic_protocol(RATES, repeats=2, rest_s=2.0)
    fine = np.arange(0.0, protocol.duration_s, 1e-3)
    load = protocol.load_at(fine)
    slow = pressed(([1.0, 0.215], [1.6, 0.33]), load, 1e-3)
    fast = pressed(([share, 0.0], [1.0, 3.0]), load, 1e-3)
    force_n = load[::10] + 1.0 * np.random.default_rng(3).standard_normal(load[::10].size)
    return Recording.from_arrays(time_s=fine[::10], force_n=force_n, pressure_mbar=(slow + fast)[::10])


def test_a_second_relaxation_moves_the_pole_by_many_sd_at_a_high_fit() -> None:
    result = leave_one_rate_out(two_relaxations(0.02))
    assert result.everything.fit_percent > 96.0
    assert result.movements["a1"].moved_sd > 10
    assert "the model is wrong" in result.says


def test_a_fold_that_is_refused_says_so_and_leaves_the_others_standing() -> None:
    result = leave_one_rate_out(two_relaxations(0.01))
    refused = [fold for fold in result.folds if fold.found is None]
    assert 0 < len(refused) < len(result.folds)
    assert "the model is wrong" in result.says
    for fold in refused:
        assert "relaxation" in fold.refused
        assert np.isnan(fold.rmse_left_out_n)
        assert f"without {fold.rate_n_per_s:g} N/s" in result.says


def test_one_rate_is_refused() -> None:
    with pytest.raises(NotIdentifiableError, match="second loading rate"):
        leave_one_rate_out(press(load_noise=1.0, rates=(400.0,), repeats=3))


def test_what_json_holds_is_what_was_found() -> None:
    result = leave_one_rate_out(one_each(load_noise=1.0))
    told = result.to_dict()
    for fold, item in zip(result.folds, told["folds"], strict=True):
        assert item == {name: getattr(fold, name) for name in item}
        assert set(item) == {each.name for each in fields(fold)} - {"found"}
    assert {name: moved["moved_sd"] for name, moved in told["movements"].items()} == {
        name: moved.moved_sd for name, moved in result.movements.items()
    }
    assert told["says"] == result.says
