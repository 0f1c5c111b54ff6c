"""Zeros: by numbers that are put in, at the very bounds that decide."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import norm
from scipy.stats import t as student

from smartshoe.diagnosis import Thresholds, _zero
from smartshoe.diagnosis._own_terms import initial_memory_of
from smartshoe.diagnosis._scale import Scale
from smartshoe.diagnosis._session import prepare
from smartshoe.diagnosis._zero import _drift_at_rest, _zero_by_model, first_rests, offsets, sd_of_a_mean, zeros_of
from smartshoe.models.effects import Conditions, shift_of
from smartshoe.models.extended import ExtendedModel
from smartshoe.recording import Recording
from smartshoe.units import MILLIBAR, VOLT

Array = NDArray[np.float64]

STANDARD = Thresholds()
MODEL = ExtendedModel(0.8, 0.1, 0.22, 800.0, 140.0, "mbar")
SCALE = Scale(800.0, 140.0, MILLIBAR)
MANY = float(norm.isf(0.5 * STANDARD.false_alarm))


@pytest.fixture(autouse=True)
def _no_past(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing is remembered at a rest, but where a test is about it."""
    if "past" not in request.node.name:
        monkeypatch.setattr(_zero, "initial_memory_of", lambda *given: (0.0, 0.0))


# -- zeros that are seen ----------------------------------------------------------------------------------------------
def _seen(
    monkeypatch: pytest.MonkeyPatch,
    rests: Sequence[tuple[float, ...]],
    scale: Scale = SCALE,
) -> dict[str, Any]:
    """By loads, readings and drifts of first rests, and the noise of both means."""
    told = np.array([(*one, 0.0, 0.0)[:5] for one in rests]).reshape(-1, 5)
    told = np.insert(told, 3, told[:, 2], axis=1)  # nothing fades
    monkeypatch.setattr(_zero, "first_rests", lambda *given: told)
    found = zeros_of([], MODEL, scale, 0.0, 0.0, STANDARD)
    sizes = [one.size for one in found]
    assert sizes == sorted(sizes, reverse=True)
    return {one.effect.shifts: one for one in found}


def test_a_zero_is_named_from_so_many_of_its_deviations_on(monkeypatch: pytest.MonkeyPatch) -> None:
    """Four ten-thousandths, how well a rest is known to be zero, each."""
    bound = MANY * STANDARD.zero_sd
    for by, is_named in ((0.999, False), (1.001, True)):
        assert ("load" in _seen(monkeypatch, [(by * bound, -0.1, 0.0)])) is is_named
        assert ("reading" in _seen(monkeypatch, [(0.1, -by * bound, 0.0)])) is is_named
    found = _seen(monkeypatch, [(0.02, -0.05, 0.0)])
    assert (found["load"].value, found["load"].size) == (-0.02, pytest.approx(0.016))
    assert (found["reading"].value, found["reading"].size) == (pytest.approx(-0.04), pytest.approx(0.04))
    assert found["load"].sd == found["reading"].sd == pytest.approx(STANDARD.zero_sd)


def test_where_zero_is_a_convention_only_a_load_below_nothing_is_a_tare(monkeypatch: pytest.MonkeyPatch) -> None:
    """Volts at rest say nothing, and a positive load may be borne; but no pressed unit bears less than nothing."""
    volts = replace(SCALE, unit=VOLT)
    assert _seen(monkeypatch, [(0.02, -0.05, 0.0)], volts) == {}
    for by, is_named in ((0.999, False), (1.001, True)):
        found = _seen(monkeypatch, [(-by * MANY * STANDARD.zero_sd, -0.05, 0.0)], volts)
        assert set(found) == ({"load"} if is_named else set())
    found = _seen(monkeypatch, [(-0.02, 0.3, 0.0)], volts)
    assert (found["load"].value, found["load"].size) == (0.02, pytest.approx(0.016))


def test_a_reading_that_agrees_with_the_load_or_is_far_off_is_no_zero(monkeypatch: pytest.MonkeyPatch) -> None:
    both = MANY * math.sqrt(2.0) * STANDARD.zero_sd
    for by, is_named in ((0.999, False), (1.001, True)):
        for way in (-by, by):
            assert bool(_seen(monkeypatch, [(0.004, 0.004 + way * both, 0.0)])) is is_named
    # A load of which at least half is read may be borne: no tare is told, and an offset by the model only.
    for share, is_borne in ((0.499, False), (0.501, True), (1.2, True), (2.0, True)):
        found = _seen(monkeypatch, [(0.05, 0.05 * share, 0.0)])
        assert ("load" not in found) is is_borne
        assert found["reading"].is_seen is not is_borne
    assert [*_seen(monkeypatch, [(-0.05, -0.045, 0.0)])] == ["load", "reading"]  # nothing bears what pulls
    for reading, is_named in ((0.3001, False), (0.2999, True), (-0.3001, False)):
        assert bool(_seen(monkeypatch, [(0.0, reading, 0.0)])) is is_named


def test_an_offset_that_only_undoes_a_drift_is_none(monkeypatch: pytest.MonkeyPatch) -> None:
    """The unloaded unit reads nothing: that an offset cancels what the model drifts by would be a coincidence."""
    bound = MANY * STANDARD.zero_sd
    for read, is_named in ((0.0, False), (0.999 * bound, False), (1.001 * bound, True)):
        assert bool(_seen(monkeypatch, [(0.0, -0.02 - read, 0.02)])) is is_named
        assert bool(_seen(monkeypatch, [(0.0, 0.02 + read, -0.02)])) is is_named


def test_a_zeros_deviation_is_of_its_scatter_its_rest_and_what_drifted(monkeypatch: pytest.MonkeyPatch) -> None:
    rests = [(0.10, -0.05, 0.01), (0.11, -0.06, -0.03), (0.12, -0.09, 0.02)]
    found = _seen(monkeypatch, rests)
    loads, readings, drifted = np.array(rests).T
    assert found["load"].sd == pytest.approx(sd_of_a_mean(loads, np.zeros(3), STANDARD))
    assert found["load"].value == pytest.approx(-0.11)
    assert np.mean(np.abs(drifted)) == pytest.approx(0.02)
    scattered = _seen(monkeypatch, [(0.3 + a, 0.1 * b, c) for a, b, c in rests])
    assert "reading" not in scattered  # a quarter of the drift is more than it
    scattered = _seen(monkeypatch, [(0.3 + a, 0.1 * b - 0.05, c) for a, b, c in rests])
    assert scattered["reading"].value == pytest.approx(0.8 * (0.1 * float(np.mean(readings)) - 0.05))
    error = sd_of_a_mean(0.1 * readings, np.zeros(3), STANDARD)
    assert scattered["reading"].sd == pytest.approx(math.hypot(error, 0.25 * 0.02))


def test_what_recordings_scatter_by_is_known_as_well_as_students_t_says() -> None:
    """Of three that scatter far beyond all that is known, by two degrees of freedom; of noise that is known, by it."""
    zeros, none = np.array([0.10, 0.11, 0.12]), np.zeros(3)
    wide = float(student.ppf(0.975, 2.0)) / float(norm.ppf(0.975))
    assert sd_of_a_mean(zeros, none, STANDARD) == pytest.approx(
        wide * math.hypot(0.01 / math.sqrt(3.0), 4e-4), rel=0.01
    )
    # As much noise as they scatter by: nothing is estimated.
    noise = math.sqrt(0.01**2 / 3.0 + 4e-4**2)
    assert sd_of_a_mean(zeros, np.full(3, 0.01), STANDARD) == pytest.approx(noise)
    assert sd_of_a_mean(zeros, np.full(3, 0.02), STANDARD) > noise  # nor is noise less where they agree
    assert sd_of_a_mean(zeros[:1], np.array([0.01]), STANDARD) == pytest.approx(math.hypot(0.01, 4e-4))
    assert sd_of_a_mean(zeros[:1], none[:1], STANDARD) == STANDARD.zero_sd
    # Half of it is known: four times as many degrees of freedom.
    half = sd_of_a_mean(np.array([-1.0, 1.0]) * 4e-4, np.zeros(2), STANDARD)
    assert half == pytest.approx(math.sqrt(2.0) * 4e-4 * float(student.ppf(0.975, 4.0)) / float(norm.ppf(0.975)))


def test_a_zero_within_the_noise_of_its_rest_is_none(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of one recording nothing else tells how well its rest is known."""
    bound = MANY * math.hypot(0.003, STANDARD.zero_sd)
    for by, is_named in ((0.999, False), (1.001, True)):
        assert ("reading" in _seen(monkeypatch, [(0.1, -by * bound, 0.0, 0.0, 0.003)])) is is_named
        assert ("load" in _seen(monkeypatch, [(by * bound, -0.1, 0.0, 0.003, 0.0)])) is is_named


# -- zeros that are not -----------------------------------------------------------------------------------------------
def _session(load: Array, fitted: Any = None) -> Any:
    kept = np.ones(load.size, dtype=bool) if fitted is None else fitted
    return SimpleNamespace(
        conditions=Conditions(0.1 * np.arange(load.size), load, 0.1), fitted=kept, reading=0.0 * load,
        resting=np.abs(load) < 0.02, recording=SimpleNamespace(command_n=None, metadata={}), thinned=1,
        own_gain_sd=0.0, gain_parts=(), zero_changes=(), gap_ends=(),
        denoised=SimpleNamespace(raw_sd=0.0), white_sd=0.0,
    )  # fmt: skip


def _told(
    monkeypatch: pytest.MonkeyPatch,
    offsets: list[float],
    left: float = 0.0,
    remembered: float = 0.0,
    share: float = 1.0,
    begun: tuple[float, ...] = (0.2, 0.4),
) -> Any:
    """Of recordings that begin at such a ``share`` of these loads, their lowest, and drift by as much."""
    monkeypatch.setattr(_zero, "offsets", lambda *given: np.array(offsets))
    monkeypatch.setattr(_zero, "_drift_at_rest", lambda one, model: np.linspace(0.01, 0.01 + one.conditions.load[0], 5))
    sessions = [_session(share * np.linspace(one, 0.9, 101)) for one in begun[: len(offsets)]]
    sessions.append(_session(np.full(9, 0.01), np.zeros(9, dtype=bool)))
    return _zero_by_model(sessions, MODEL, left, remembered, STANDARD)


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("shown", [[0.2], [0.25, 0.27]])
def test_a_zero_that_is_never_seen_is_known_as_well_as_all_that_may_lie_in_it(
    monkeypatch: pytest.MonkeyPatch, shown: list[float], sign: float
) -> None:
    """The past of a quarter of the arm and of what is remembered; a quarter of the lowest load and of drifts."""
    begun = 0.02 * np.array([0.2, 0.4])[: len(shown)]
    lowest = begun + 0.01 * (0.02 * 0.9 - begun)
    own = 4e-4**2 + (begun * (0.25 * 0.1 + 0.02)) ** 2 + (0.25 * begun) ** 2 + (0.25 * lowest) ** 2
    weights = 1.0 / own
    weights /= weights.sum()
    mean = float(weights @ shown)
    scatter = math.sqrt(weights @ (np.array(shown) - mean) ** 2) if len(shown) > 1 else 0.0
    sd = math.sqrt(scatter**2 + 0.003**2 + (weights @ np.sqrt(own)) ** 2)
    (zero,) = _told(monkeypatch, [sign * one for one in shown], 0.003, 0.02, 0.02)
    assert zero.sd == pytest.approx(sd)
    assert (zero.value, zero.size) == (pytest.approx(sign * mean), pytest.approx(mean))
    assert (zero.effect.shifts, zero.alternatives) == ("reading", (shift_of("load").name,))
    assert zero.extrapolated_from == 0.0


def test_of_recordings_that_are_never_unloaded_those_tell_the_zero_that_come_nearest(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """One that begins at half of full scale, or is pressed from there on, hides nothing of one from next to none."""
    for shown in ([0.02], [0.02, 0.05], [0.02, -0.3]):
        (zero,) = _told(monkeypatch, shown, begun=(1e-4, 0.5))
        assert (zero.value, zero.extrapolated_from) == (pytest.approx(0.02, abs=2e-3), 0.0)
        assert zero.sd < 0.005


def test_a_zero_that_is_led_back_from_high_loads_is_told_as_such(monkeypatch: pytest.MonkeyPatch) -> None:
    """What the unit does below them may make it: it is no cause."""
    monkeypatch.setattr(_zero, "_drift_at_rest", lambda one, model: np.zeros(5))
    still, load = replace(MODEL, relaxing_share=0.0), np.linspace(0.2, 0.9, 101)
    near, sd = MANY * STANDARD.zero_sd, MANY * math.hypot(STANDARD.zero_sd, 0.25 * 0.207)
    for offset, extrapolated_from in (
        (0.999 * near, None),
        (1.001 * near, 0.207),
        (0.999 * sd, 0.207),
        (1.001 * sd, 0.0),
    ):
        monkeypatch.setattr(_zero, "offsets", lambda *given, offset=offset: np.array([offset]))
        found = _zero_by_model([_session(load)], still, 0.0, 0.0, STANDARD)
        assert [one.extrapolated_from for one in found] == (
            [] if extrapolated_from is None else [pytest.approx(extrapolated_from)]
        )


def test_an_unseen_zero_is_told_between_its_deviations_and_what_is_foreign(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(_zero, "_drift_at_rest", lambda one, model: np.zeros(5))
    still = replace(MODEL, relaxing_share=0.0)
    session = _session(np.zeros(50))

    def told(offset: float) -> bool:
        monkeypatch.setattr(_zero, "offsets", lambda *given: np.array([offset]))
        return bool(_zero_by_model([session], still, 0.0, 0.0, STANDARD))

    bound = MANY * STANDARD.zero_sd
    assert [told(by * bound) for by in (0.999, 1.001, -0.999, -1.001)] == [False, True, False, True]
    assert [told(by * 0.3) for by in (0.999, 1.001, -1.001)] == [True, False, False]


def test_offsets_are_of_what_is_fitted_without_what_a_past_adds() -> None:
    """A reading that is off by an offset and by what an earlier load left, which fades."""
    time_s = 0.1 * np.arange(400)
    load = np.abs((time_s / 4.0) % 2.0 - 1.0)
    sessions = []
    for offset, fitted in ((0.3, True), (9.0, False), (-0.2, True)):
        one = _session(load, np.full(400, fitted))
        one.held_out, one.usable = ~one.fitted, np.ones(400, dtype=bool)
        one.judged = one.held_out
        one.reading = MODEL.simulate(one.conditions) + offset + 0.05 * np.exp(-0.22 * time_s)
        sessions.append(one)
    assert offsets(sessions, MODEL) == pytest.approx([0.3, -0.2], abs=2e-3)


def test_a_past_is_known_as_well_as_noise_lets_it() -> None:
    """By least squares under its prior; its standard deviation is that of repeated draws."""
    time_s = 0.1 * np.arange(600)
    load, past = np.abs((time_s / 4.0) % 2.0 - 1.0), 0.004
    one = _session(load)
    one.held_out, one.usable = ~one.fitted, np.ones(600, dtype=bool)
    one.judged, one.unknown_past = one.held_out, STANDARD.unknown_past
    found = []
    for seed in range(60):
        noise = 2e-3 * np.random.default_rng(seed).standard_normal(600)
        found.append(initial_memory_of(one, MODEL, noise + 0.3 + past * np.exp(-MODEL.pole_per_s * time_s)))
    values, sds = np.array(found).T
    assert np.mean(values) == pytest.approx(past, abs=3.0 * np.std(values) / np.sqrt(60.0) + 0.1 * past)
    assert np.median(sds) == pytest.approx(np.std(values), rel=0.35)
    one.reading = 0.3 + 0.01 * np.ones(600)
    assert initial_memory_of(one, MODEL, np.full(600, 0.3))[0] == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize(
    ("sd", "faded", "is_seen"), [(0.0999, 0.51, True), (0.1001, 1.0, False), (0.0999, 0.49, False)]
)
def test_what_a_past_leaves_at_a_rest_is_taken_out_where_it_is_clear_and_fades_there(
    monkeypatch: pytest.MonkeyPatch, sd: float, faded: float, is_seen: bool
) -> None:
    one = _rested(25)
    fading = np.exp(-MODEL.pole_per_s * one.conditions.time_s)
    one.reading = one.reading + faded * 0.1 * fading
    monkeypatch.setattr(_zero, "initial_memory_of", lambda *given: (0.1, sd / MANY))
    (rest,) = first_rests([one], MODEL, STANDARD)
    gone = 0.1 * float(np.mean(fading[:25])) if is_seen else 0.0
    read = float(np.mean(one.reading[:25]))
    assert rest[:4] == pytest.approx(np.array([0.0, read - gone, gone, 0.1 * is_seen]) / [1.0, 0.8, 0.8, 0.8])


@pytest.mark.parametrize(("stands_at", "is_named"), [(0.0, False), (0.01, True)])
def test_a_past_that_begins_where_nothing_is_read_is_a_drift_and_no_offset(
    monkeypatch: pytest.MonkeyPatch, stands_at: float, is_named: bool
) -> None:
    """1.6 % of full scale by which a sensor warms, as fast as a past would fade; beside an offset it is told as one."""
    one = _rested(25)
    warmed = -0.016 * np.expm1(-MODEL.pole_per_s * one.conditions.time_s)
    one.reading = one.reading - 0.01 + stands_at + warmed
    monkeypatch.setattr(_zero, "initial_memory_of", lambda *given: (-0.016, 1e-4))
    found = zeros_of([one], MODEL, SCALE, 0.0, 0.0, STANDARD)
    assert [zero.effect.shifts for zero in found] == ["reading"] * is_named


# -- first rests ------------------------------------------------------------------------------------------------------
def _rested(count: int, level: float = 0.0, reading: float = 0.01, step_s: float = 0.1) -> Any:
    load = np.concatenate([np.full(count, level), np.linspace(level, 1.0, 60)])
    shown = np.concatenate([np.full(count, reading), np.linspace(reading, 1.0, 60)])
    one = _session(load)
    one.conditions = Conditions(step_s * np.arange(load.size), load, step_s)
    one.reading = shown
    one.resting = np.arange(load.size) < count
    return one


def test_a_load_that_begins_to_rise_at_once_is_no_rest() -> None:
    """A reading that is late says nothing of its zero there; a machine that creeps as slowly as in a hold rests."""
    for per_s, is_told in ((0.9 * STANDARD.still_per_s, True), (1.1 * STANDARD.still_per_s, False)):
        one = _rested(20)
        load = one.conditions.load.copy()
        load[:20] = 0.1 * per_s * np.arange(20)
        one.conditions = Conditions(one.conditions.time_s, load, 0.1)
        assert first_rests([one], MODEL, STANDARD).size == (6 if is_told else 0)


def test_a_single_sample_of_a_slow_log_is_no_rest() -> None:
    """Nobody sees whether the load stood still there."""
    for count, is_told in ((1, False), (2, True)):
        assert first_rests([_rested(count, step_s=1.8)], MODEL, STANDARD).size == (6 if is_told else 0)


def test_a_first_rest_lasts_as_long_as_a_reading_takes_to_settle() -> None:
    """Four tenths of a second: four samples; and no more of it is looked at than of a hold that shows creep."""
    for count, is_told in ((3, False), (4, True)):
        found = first_rests([_rested(count)], MODEL, STANDARD)
        assert found.shape == ((1, 6) if is_told else (0, 6))
    long = _rested(50)
    long.reading[30:] = 9.0
    (rest,) = first_rests([long], MODEL, STANDARD)
    assert rest[:3] == pytest.approx([0.0, 0.01 / 0.8, 0.0])
    # Where it is not fitted it does not count; where the unit rests all along it is the first three seconds.
    long.fitted[:27] = False
    assert first_rests([long], MODEL, STANDARD).size == 0
    long.fitted[26] = True
    assert first_rests([long], MODEL, STANDARD).shape == (1, 6)
    ever = _rested(80)
    ever.resting[:] = True
    assert first_rests([ever], MODEL, STANDARD)[0, :3] == pytest.approx([0.0, 0.01 / 0.8, 0.0])
    assert first_rests([], MODEL, STANDARD).shape == (0, 6)
    slow = _rested(2, step_s=10.0)
    slow.reading[1] = 9.0  # ten seconds on: no more than a single sample lies within a hold
    assert first_rests([slow], MODEL, STANDARD)[0, :3] == pytest.approx([0.0, 0.01 / 0.8, 0.0])


def test_a_first_rest_is_as_long_as_a_command_asks_for_nothing() -> None:
    """By a thousandth of the largest command, either way, while the load stands still."""
    one = _rested(30, level=0.3, reading=0.2)
    one.resting[:] = False
    assert first_rests([one], MODEL, STANDARD).size == 0
    for asked, is_told in ((0.99, True), (1.01, False), (-0.99, True), (-1.01, False)):
        command = np.concatenate([np.full(10, asked), np.linspace(1.0, -1000.0, 80)])
        one.recording = SimpleNamespace(command_n=command, metadata={}, time_s=one.conditions.time_s)
        found = first_rests([one], MODEL, STANDARD)
        assert found.shape == ((1, 6) if is_told else (0, 6))
        if is_told:
            assert found[0, :2] == pytest.approx([0.3, 0.2 / 0.8])
    moved = _rested(30, level=0.3, reading=0.2)
    moved.recording = SimpleNamespace(command_n=np.zeros(90), metadata={}, time_s=moved.conditions.time_s)
    moved.conditions.load[3:] = 0.3 + 0.02
    assert first_rests([moved], MODEL, STANDARD).size == 0
    # A command at the full rate is taken at the thinned samples; one that ends earlier has no rest beyond.
    thin = _rested(30, level=0.3, reading=0.2)
    thin.thinned, thin.resting[:] = 3, False
    command = np.full(90, 500.0)
    command[0:12:3] = 0.0
    thin.recording = SimpleNamespace(command_n=command, metadata={}, time_s=np.arange(90) * thin.conditions.step_s / 3)
    assert first_rests([thin], MODEL, STANDARD).shape == (1, 6)
    command[0] = 500.0
    assert first_rests([thin], MODEL, STANDARD).size == 0


@pytest.mark.parametrize("slow_step_s", [0.005, 0.01, 0.03])
def test_a_command_is_read_by_the_clock_also_of_a_log_that_begins_slower_or_faster(slow_step_s: float) -> None:
    """Both the rest of a second and the tare in it, of 120 N, are the log's whatever its pace."""
    time_s = np.concatenate([np.arange(0.0, 3.0, slow_step_s), np.arange(3.0, 30.0, 0.01)])
    asked = np.interp(time_s, [1.0, 3.0, 5.0, 8.0, 14.0, 20.0, 30.0], [0.0, 400.0, 400.0, 0.0, 0.0, 800.0, 0.0])
    run = Recording.from_arrays(time_s=time_s, force_n=120.0 + asked, pressure_mbar=0.14 * asked, command_n=asked)
    scale = Scale(920.0, 112.0, MILLIBAR)
    sessions = prepare([run], [np.ones(time_s.size, dtype=bool)], None, scale, [1], STANDARD)
    (rest,) = first_rests(sessions, MODEL, STANDARD)
    assert rest[:2] == pytest.approx([120.0 / 920.0, 0.0], abs=1e-3)


def test_a_first_rest_at_a_tare_ends_where_the_load_leaves_it() -> None:
    one = _rested(30, level=0.3, reading=0.01)
    one.resting[:] = False
    one.conditions.load[20:30] = 0.3 + 0.02
    one.reading[20:30] = 5.0
    (rest,) = first_rests([one], MODEL, STANDARD)
    assert rest[:3] == pytest.approx([0.3, 0.01 / 0.8, 0.0])


def test_the_mean_of_a_rest_is_known_as_well_as_its_noise_and_the_samples_that_were_taken_of_it_let_it() -> None:
    one = _rested(16)
    one.denoised, one.white_sd, one.thinned = SimpleNamespace(raw_sd=0.01), 0.02, 4
    (rest,) = first_rests([one], MODEL, STANDARD)
    assert rest[4:] == pytest.approx([0.01 / 8.0, 0.02 / 0.8 / 8.0])
    one.fitted[:12] = False
    (rest,) = first_rests([one], MODEL, STANDARD)
    assert rest[4:] == pytest.approx([0.01 / 4.0, 0.02 / 0.8 / 4.0])


def test_what_has_drifted_at_rest_is_taken_out_of_a_first_rest() -> None:
    drifting = MODEL.with_part("dead_band").with_part("zero_drift", np.array([0.002, 0.0, 60.0, 1.0]))
    one = _rested(25)
    moved = _drift_at_rest(one, drifting)
    expected = drifting.simulate(one.conditions) - drifting.without("zero_drift").simulate(one.conditions)
    assert moved == pytest.approx(expected)
    assert np.ptp(moved) > 0.0
    (rest,) = first_rests([one], drifting, STANDARD)
    mean = float(np.mean(moved[:25]))
    assert rest[1:3] == pytest.approx([(0.01 - mean) / 0.8, mean / 0.8])


def test_a_rest_of_what_continues_a_recording_is_no_first_one() -> None:
    """The unit still remembers what that held."""
    first, later = _rested(25), _rested(25, reading=0.03)
    later.recording = SimpleNamespace(**{**vars(first.recording), "metadata": {"continues": "first"}})
    assert first_rests([first, later], MODEL, STANDARD) == pytest.approx(first_rests([first], MODEL, STANDARD))
    assert not first_rests([later], MODEL, STANDARD).size
