"""Numbers of the record by which is told without a model: what each decides."""

from __future__ import annotations

from dataclasses import fields

import numpy as np
import pytest
from deciding import STANDARD, decides
from numpy.typing import NDArray

from smartshoe.diagnosis import Thresholds, described
from smartshoe.diagnosis._characteristic import characteristic_of
from smartshoe.diagnosis._excitation import excitation_of
from smartshoe.diagnosis._scale import full_scale
from smartshoe.diagnosis._session import prepare
from smartshoe.diagnosis._zero import first_rests
from smartshoe.diagnosis.decay import decay_of
from smartshoe.integrity import OneClock
from smartshoe.integrity._clocks import Lags, one_clock
from smartshoe.integrity.thresholds import decided_by, largest_of_noise
from smartshoe.models.extended import ExtendedModel
from smartshoe.recording import Recording

Array = NDArray[np.float64]

TIME_S = np.arange(0.0, 60.0, 0.01)
TRIANGLE = np.abs(2.0 * (TIME_S / 6.0 % 1.0) - 1.0)
MBAR = 100.0


def _pressed(reading: Array, load: Array = TRIANGLE, time_s: Array = TIME_S) -> Recording:
    """A reading of so many full scales."""
    return Recording.from_arrays(time_s=time_s, force_n=800.0 * load, pressure_mbar=MBAR * reading)


def _session_traits(load: Array, thresholds: Thresholds, unread: slice | NDArray[np.intp] = slice(0)) -> frozenset[str]:
    time_s = 0.02 * np.arange(load.size)
    recording = Recording.from_arrays(time_s=time_s, force_n=800.0 * load, pressure_mbar=MBAR * load)
    usable = [np.ones(load.size, dtype=bool)]
    usable[0][unread] = False
    scale = full_scale([recording], usable, STANDARD)
    return excitation_of(prepare([recording], usable, None, scale, [1], STANDARD), thresholds).present


def _held_load(hold_s: float, rest_s: float) -> Array:
    """Two rises to full load at 0.5 full scales a second, a hold, and a rest."""
    corners = np.cumsum([0.0, 5.0, 2.0, hold_s, 2.0, rest_s, 2.0, 1.0, 2.0, 5.0])
    return np.interp(np.arange(0.0, corners[-1], 0.02), corners, [0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0])


def test_a_hold_or_a_rest_shows_nothing_where_nothing_is_read() -> None:
    """But a unit that is left alone ages, and shows that afterwards."""
    load = _held_load(10.0, 70.0)
    assert {"holds", "rests", "idle"} <= _session_traits(load, STANDARD)
    begins, ends = (int(np.flatnonzero(load == 1.0)[k]) for k in (0, 500))
    assert not {"holds"} & _session_traits(load, STANDARD, slice(begins, ends))
    unread = load < 0.01
    shown = _session_traits(load, STANDARD, np.flatnonzero(unread))
    assert "rests" not in shown
    assert {"holds", "idle"} <= shown
    # A sample here and there is no hold's end.
    assert {"holds", "rests"} <= _session_traits(load, STANDARD, slice(0, None, 50))


def test_a_number_that_was_asked_for_says_so_beside_what_is_usual() -> None:
    usual = {entry["name"]: entry["origin"] for entry in described(STANDARD)}
    finer = {entry["name"]: entry for entry in described(decided_by(None, material=1e-4))}
    for name in ("material", "imperfection", "tolerable"):
        assert finer[name]["origin"] == f"as asked for; usual is {getattr(STANDARD, name)} ({usual[name]})"
    assert finer["departure"]["origin"] == usual["departure"]


def test_each_number_has_a_unit_a_meaning_and_an_origin() -> None:
    assert all(entry["unit"] and entry["meaning"] and entry["origin"] for entry in described(STANDARD))
    assert [entry["name"] for entry in described(STANDARD)] == [field.name for field in fields(Thresholds)]


def test_clear_is_what_parts_a_straight_line_from_a_bent_one() -> None:
    bent = _pressed(np.tanh(3.0 * (TRIANGLE - 0.5)))
    near, far = decides("clear", 2.0, 50.0, lambda t: characteristic_of(bent, t))
    assert "flattens" in str(near)
    assert "nearly straight" in str(far)


def test_same_is_how_far_rates_of_one_kind_differ() -> None:
    corners = np.cumsum([0.0, 2.0, 2.0, 2.0, 2.0, 1.4, 1.4, 2.0, 1.4, 1.4, 2.0])
    load = np.interp(
        np.arange(0.0, corners[-1], 0.02), corners, [0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0]
    )
    apart, alike = decides("same", 0.2, 0.6, lambda t: "rates" in _session_traits(load, t))
    assert (apart, alike) == (True, False)


def test_standing_is_how_far_a_load_at_rest_may_move() -> None:
    load = 500.0 * (1.0 + 0.03 * np.sin(TIME_S))
    falling = 100.0 * np.exp(-TIME_S / 20.0)
    recording = Recording.from_arrays(time_s=TIME_S, force_n=load, pressure_mbar=falling)
    moves, stands = decides("standing", 0.02, 0.1, lambda t: decay_of(recording, t) is not None)
    assert (moves, stands) == (False, True)


def test_standing_is_what_a_load_must_leave_for_another_cycle() -> None:
    rippled = _pressed(TRIANGLE, TRIANGLE + 0.03 * np.sin(10.0 * np.pi * TIME_S))
    usable = [np.ones(TIME_S.size, dtype=bool)]

    def cycles(thresholds: Thresholds) -> int:
        scale = full_scale([rippled], usable, thresholds)
        return int(prepare([rippled], usable, None, scale, [1], thresholds)[0].cycle[-1]) + 1

    ripples, triangles = decides("standing", 0.002, 0.02, cycles)
    assert (ripples > 20, triangles) == (True, 10)


def test_hold_is_how_long_a_first_rest_shows_a_zero() -> None:
    load = _held_load(5.0, 20.0)
    time_s = 0.02 * np.arange(load.size)
    rising = _pressed(load + 0.01 * (time_s > 2.0), load, time_s)
    usable = [np.ones(load.size, dtype=bool)]
    scale = full_scale([rising], usable, STANDARD)
    sessions = prepare([rising], usable, None, scale, [1], STANDARD)
    model = ExtendedModel(1.0, 0.0, 0.22, 800.0, 100.0, "mbar")
    before, after = decides("hold_s", 1.0, 4.0, lambda t: float(first_rests(sessions, model, t)[0, 1]))
    assert (before, after) == (pytest.approx(0.0, abs=1e-4), pytest.approx(0.005, abs=1e-3))


def test_same_is_how_far_lags_of_one_delay_differ() -> None:
    pair = [Lags(np.array([10.0]), np.array([lag_s])) for lag_s in (1.0, 1.4)]
    each, shared = decides("same", 0.2, 0.4, lambda t: one_clock(pair, t))
    assert (each, shared) == (None, OneClock(1.2, 0.0))


@pytest.mark.parametrize(("field", "word"), [("hold_s", "holds"), ("idle_s", "idle")])
def test_holds_and_idle_times_are_as_long_as_said(field: str, word: str) -> None:
    load = _held_load(5.0, 20.0)
    shorter, longer = decides(field, 2.0, 90.0, lambda t: word in _session_traits(load, t))
    assert (shorter, longer) == (True, False)


def test_still_is_the_slowest_ramp() -> None:
    load = _held_load(20.0, 5.0)
    creeping = load - 0.0005 * 0.02 * np.cumsum(load > 0.9)
    fast, slow = decides("still_per_s", 1e-5, 0.004, lambda t: "holds" in _session_traits(creeping, t))
    assert (fast, slow) == (False, True)


def test_false_alarm_sets_the_largest_deviate_that_noise_makes() -> None:
    rare, common = decides("false_alarm", 1e-6, 1e-2, lambda t: largest_of_noise(10_000, t))
    assert rare > 6.0 > 5.0 > common


def test_held_out_every_is_the_share_of_load_cycles_that_judges() -> None:
    recording = _pressed(TRIANGLE)
    usable = [np.ones(TIME_S.size, dtype=bool)]
    scale = full_scale([recording], usable, STANDARD)

    def held_out(thresholds: Thresholds) -> list[int]:
        (session,) = prepare([recording], usable, None, scale, [1], thresholds)
        return sorted({int(number) for number in session.cycle[session.held_out]})

    assert decides("held_out_every", 3, 5, held_out) == ([2, 5, 8], [4, 9])
