"""Zeros that are seen and zeros that are not, an area that is declared, readings that come by another clock."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import norm
from scipy.stats import t as student

from smartshoe.diagnosis import Thresholds, diagnose
from smartshoe.diagnosis._aligned import aligned
from smartshoe.diagnosis._baseline import baseline_of
from smartshoe.diagnosis._limits import limit_wall_ratio
from smartshoe.diagnosis._own_terms import residual_of
from smartshoe.diagnosis._scale import Scale, full_scale
from smartshoe.diagnosis._session import Session, prepare
from smartshoe.diagnosis._zero import Zero, first_rests, offsets, zeros_of
from smartshoe.errors import InputError
from smartshoe.integrity import OneClock
from smartshoe.models.core import USUAL_WALL_RATIO
from smartshoe.models.effects import Conditions, effect
from smartshoe.models.extended import ExtendedModel
from smartshoe.recording import Recording
from smartshoe.signals.lags import lagged

Array = NDArray[np.float64]

STEP_S, FULL_N, FULL_MBAR = 0.04, 800.0, 140.0
MODEL = ExtendedModel(1.0, 0.08, 0.22, FULL_N, FULL_MBAR, "mbar")
TIME_S = np.arange(0.0, 60.0, STEP_S)
PRESSED = np.clip(np.abs((TIME_S / 6.0 + 0.5) % 1.0 - 0.5) * 4.0 - 0.6, 0.0, 1.0) * (TIME_S > 5.0)
STANDARD = Thresholds()


def _run(
    *, tare: float = 0.0, offset: float = 0.0, foot: float = 0.0, seed: int = 0, unit: str = "mbar", **metadata: object
) -> Recording:
    """Shares of full scale: ``tare`` that the load cell shows too much, ``offset`` of the reading, load at the foot."""
    load = foot + (1.0 - foot) * PRESSED
    share = MODEL.simulate(Conditions(TIME_S, load, STEP_S)) + offset
    share = share + 2e-4 * np.random.default_rng(seed).standard_normal(TIME_S.size)
    shown = {f"pressure_{unit}": FULL_MBAR * share}
    return Recording.from_arrays(
        time_s=TIME_S, force_n=FULL_N * (load + tare), name=f"run_{seed}", metadata=metadata, **shown
    )


def _sessions(*runs: Recording) -> tuple[list[Session], Scale]:
    usable = [one.sensor.present for one in runs]
    scale = full_scale(runs, usable, STANDARD)
    return prepare(runs, usable, [False] * len(runs), scale, [1], STANDARD), scale


def _zeros(
    *runs: Recording, left: float = 0.0, remembered: float = 0.0, lasting_memory: float = 0.0
) -> dict[str, Zero]:
    sessions, scale = _sessions(*runs)
    model = baseline_of(sessions, scale)
    found = zeros_of(sessions, model, scale, left, remembered, STANDARD, lasting_memory=lasting_memory)
    return {one.effect.name: one for one in found}


# -- zeros ------------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("offset", [0.0, 0.05])
def test_noise_of_a_short_rest_is_no_offset_and_hides_none_that_is_clear_of_it(offset: float) -> None:
    """2 % of full scale in each of 25 samples."""
    told = 0
    for seed in range(6):
        run = _run(offset=offset, seed=seed)
        values = run.sensor.values + FULL_MBAR * 0.02 * np.random.default_rng(seed + 10).standard_normal(TIME_S.size)
        cut = run.with_channel(replace(run.sensor, values=values)).between(4.0, 60.0)
        told += "zero_offset" in _zeros(cut)
    assert told == (6 if offset else 0)


@pytest.mark.parametrize("offset", [0.03, -0.02])
def test_a_reading_of_an_unloaded_unit_is_its_zero(offset: float) -> None:
    found = _zeros(_run(offset=offset, seed=1), _run(offset=offset, seed=2))
    assert set(found) == {"zero_offset"}
    assert found["zero_offset"].value == pytest.approx(offset, rel=0.1)
    assert found["zero_offset"].size == pytest.approx(abs(offset), rel=0.1)
    # What is read beyond nothing the unit may bear, under a load cell that was set to zero there; less it cannot bear.
    assert found["zero_offset"].alternatives == (("load_cell_tare",) if offset > 0.0 else ())
    assert found["zero_offset"].is_seen
    idle = _run(offset=offset, seed=1)
    idle = idle.with_channel(replace(idle.load, name="command", role="command", values=FULL_N * PRESSED))
    assert _zeros(idle)["zero_offset"].alternatives == ()  # nothing presses it


@pytest.mark.parametrize("tare", [0.03, -0.02])
def test_a_load_that_is_shown_where_none_is_borne_is_the_cells_tare(tare: float) -> None:
    """The effect takes off what the cell shows too much."""
    found = _zeros(_run(tare=tare, seed=1), _run(tare=tare, seed=2))
    assert set(found) == {"load_cell_tare"}
    assert found["load_cell_tare"].value == pytest.approx(-tare, rel=0.1)
    assert found["load_cell_tare"].size == pytest.approx(abs(tare), rel=0.1)


def test_both_zeros_are_told_where_they_differ_the_larger_first() -> None:
    sessions, scale = _sessions(_run(tare=0.03, offset=-0.015, seed=1))
    found = zeros_of(sessions, baseline_of(sessions, scale), scale, 0.0, 0.0, STANDARD)
    assert [one.effect.name for one in found] == ["load_cell_tare", "zero_offset"]
    # Where they are of one sign, and the reading is nearer to the load than to nothing, the unit may bear that load: no
    # tare is told, and an offset only where it is more than a curve may do below that load.
    assert _zeros(_run(tare=0.03, offset=0.03)) == {}
    for offset, is_lower in ((0.035, True), (0.016, True), (0.08, False)):
        (borne,) = _zeros(_run(tare=0.03, offset=offset)).values()
        assert (borne.effect.name, borne.alternatives) == ("zero_offset", ("load_cell_tare",))
        assert borne.value == pytest.approx(offset - 0.03, abs=2e-3)
        assert (borne.extrapolated_from > 0.0) is is_lower
    assert set(_zeros(_run(tare=0.03, offset=0.014))) == {"load_cell_tare", "zero_offset"}
    assert set(_zeros(_run(tare=0.03, offset=-0.03))) == {"load_cell_tare", "zero_offset"}


def test_zeros_that_scatter_are_known_as_well_as_their_mean() -> None:
    """The standard error of a mean of n, by Student's t, beside how well a rest is known to be zero."""
    values = [0.03, 0.05, 0.01, 0.03]
    found = _zeros(*(_run(offset=offset, seed=k) for k, offset in enumerate(values)))
    error = float(np.std(values, ddof=1) / np.sqrt(len(values)))
    wide = float(student.ppf(0.975, 3.0)) / float(norm.ppf(0.975))
    assert found == {}  # three hundredths are not four of its deviations
    apart = _zeros(*(_run(offset=offset + 0.1, seed=k) for k, offset in enumerate(values)))
    assert apart["zero_offset"].sd == pytest.approx(wide * np.hypot(error, STANDARD.zero_sd), rel=0.1)


def test_no_zero_is_told_of_a_sensor_whose_zero_is_a_convention() -> None:
    sessions, scale = _sessions(_run(offset=0.03, unit="v"))
    assert zeros_of(sessions, MODEL, scale, 0.0, 0.0, STANDARD) == ()
    assert _zeros(_run(offset=2.0), _run(offset=2.0)) == {}


@pytest.mark.parametrize("tare", [0.03, -0.02, 0.0])
def test_a_tare_is_told_of_any_sensor_where_a_command_says_that_nothing_presses(tare: float) -> None:
    """Its reading at rest is a convention, the load there is none."""
    plain = _run(tare=tare, offset=0.03, unit="v")
    assert set(_zeros(plain)) == ({"load_cell_tare"} if tare < 0.0 else set())  # it may bear what is shown
    found = _zeros(plain.with_channel(replace(plain.load, name="command", role="command", values=FULL_N * PRESSED)))
    assert [one.effect.name for one in found.values()] == ["load_cell_tare"] * bool(tare)
    if tare:
        assert found["load_cell_tare"].value == pytest.approx(-tare, rel=0.1)


def test_a_calibration_of_a_bent_unit_beside_a_tare_gives_the_force_that_it_states() -> None:
    """The curve is that over the load as logged: a tare before it would give other readings, and another force."""
    bent = MODEL.with_part("wall_hardening", np.array([0.15, 0.0]))
    runs = []
    for seed in range(4):
        noise = 2e-4 * np.random.default_rng(seed).standard_normal(TIME_S.size)
        reading = FULL_MBAR * (bent.simulate(Conditions(TIME_S, (0.7 + 0.1 * seed) * PRESSED, STEP_S)) + noise)
        load_n = FULL_N * ((0.7 + 0.1 * seed) * PRESSED - 0.03)
        runs.append(Recording.from_arrays(time_s=TIME_S, force_n=load_n, name=f"run_{seed}", pressure_mbar=reading))
    found = diagnose(runs[:3], hold_out=runs[3:])
    assert "load_cell_tare" in [cause.name for cause in found.causes]
    force_n = found.calibration(unit="tared").compensator(1.0 / STEP_S).apply(runs[3])
    assert found.extended is not None
    assert float(np.sqrt(np.mean((force_n - runs[3].force_n) ** 2))) < 1.3 * found.extended.force_rmse_n
    assert found.model is not None
    simulated = found.model.reading(Conditions(TIME_S, runs[3].force_n / found.full_scale_load_n, STEP_S))
    assert float(np.sqrt(np.mean((simulated - runs[3].sensor.values) ** 2))) < 1e-3 * FULL_MBAR


@pytest.mark.parametrize(("tare", "way"), [(0.03, "24 N more"), (-0.02, "16 N less")])
def test_a_calibration_beside_a_tare_is_said_to_give_the_force_as_the_load_cell_shows_it(tare: float, way: str) -> None:
    """And it does: off by the tare from what presses, which nothing had said."""
    runs = [_run(tare=tare, seed=seed) for seed in range(3)]
    found = diagnose(runs[:2], hold_out=runs[2:])
    assert [cause.name for cause in found.causes] == ["load_cell_tare"]
    (said,) = found.limits_of_the_force
    assert f"as the load cell shows it, {way} than what presses" in said
    force_n = found.calibration(unit="tared").compensator(1.0 / STEP_S).apply(runs[2])
    assert np.mean(force_n - FULL_N * PRESSED) == pytest.approx(FULL_N * tare, rel=0.05)


def test_no_tare_is_told_of_a_unit_that_is_never_unloaded_by_command() -> None:
    """A sensor in volts has no zero that a model could tell; a diagnosis of it ended in a division by nothing."""
    loaded = _run(foot=0.1, offset=0.03, unit="v")
    command_n = FULL_N * (0.1 + 0.9 * PRESSED)
    assert _zeros(loaded.with_channel(replace(loaded.load, name="command", role="command", values=command_n))) == {}


def test_a_unit_that_is_never_unloaded_leaves_open_which_zero_it_is() -> None:
    runs = [_run(foot=0.1, offset=0.1, seed=seed) for seed in range(3)]
    found = _zeros(*runs)
    assert set(found) == {"zero_offset"}
    assert found["zero_offset"].value == pytest.approx(0.1, abs=3.0 * found["zero_offset"].sd)
    assert found["zero_offset"].alternatives == ("load_cell_tare",)
    assert not found["zero_offset"].is_seen
    # Whatever the model leaves or remembers may lie in the offset too.
    assert _zeros(*runs, left=0.05) == {}
    assert found["zero_offset"].extrapolated_from == 0.0
    assert _zeros(*runs, remembered=0.5)["zero_offset"].extrapolated_from == pytest.approx(
        0.1, rel=0.05
    )  # so that it is no cause
    known = found["zero_offset"].sd
    # What a loop holds does not fade, however little it begins with.
    lasting_memory = _zeros(*runs, lasting_memory=0.05)["zero_offset"]
    assert (lasting_memory.extrapolated_from, lasting_memory.sd) == (
        pytest.approx(0.1, rel=0.05),
        pytest.approx(np.hypot(known, 0.05), rel=0.1),
    )
    assert _zeros(*runs, left=0.01)["zero_offset"].sd == pytest.approx(np.hypot(known, 0.01), rel=0.05)
    assert _zeros(*runs, remembered=0.1)["zero_offset"].sd > known


def test_a_first_rest_is_what_is_commanded_where_a_tare_lifts_the_load() -> None:
    plain = _run(tare=0.2, offset=0.05)
    commanded = plain.with_channel(replace(plain.load, name="command", role="command", values=FULL_N * PRESSED))
    sessions, _ = _sessions(commanded)
    rests = first_rests(sessions, MODEL, STANDARD)
    assert rests.shape == (1, 6)
    load, reading = float(sessions[0].conditions.load[0]), float(np.mean(sessions[0].reading[:25]))
    assert rests[0, :2] == pytest.approx([load, reading], abs=2e-3)


def test_a_load_of_which_a_gauge_reads_nothing_is_its_cells_tare_however_large() -> None:
    for tare in (0.09, -0.12):
        found = _zeros(*(_run(tare=tare, seed=seed) for seed in range(3)))
        assert set(found) == {"load_cell_tare"}
        assert found["load_cell_tare"].value == pytest.approx(-tare / (1.0 + tare), abs=0.003)
    # A unit that bears a fixture reads it.
    assert "load_cell_tare" not in _zeros(*(_run(foot=0.09, seed=seed) for seed in range(3)))


def test_what_has_drifted_by_the_first_rest_is_no_zero() -> None:
    sessions, _ = _sessions(_run())
    drifting = MODEL.with_part(effect("zero_drift"), np.array([0.002, 0.0, 60.0, 1.0]))
    (rest,) = first_rests(sessions, drifting, STANDARD)
    kept = STANDARD.hold_s > TIME_S
    assert rest[2] == pytest.approx(0.002 * float(np.mean(TIME_S[kept])), rel=0.05)
    assert rest[1] == pytest.approx(-rest[2], abs=1e-3)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_an_offset_that_a_drift_of_the_zero_may_have_come_by_is_its_past(sign: float) -> None:
    """It lies the way that the zero drifts, and within an order of magnitude of what it drifts by in a recording."""
    duration_s = float(TIME_S[-1])
    sessions, scale = _sessions(_run(offset=0.03 * sign, seed=1), _run(offset=0.03 * sign, seed=2))
    for moved, may_have_drifted in ((0.006, True), (0.0015, False), (0.0, False), (-0.006, False)):
        drift = np.array([sign * moved / duration_s, 0.0, 0.0, 1.0])
        drifting = baseline_of(sessions, scale).with_part(effect("zero_drift"), drift)
        (found,) = zeros_of(sessions, drifting, scale, 0.0, 0.0, STANDARD)
        assert found.effect.name == "zero_offset"
        assert found.may_have_drifted == may_have_drifted


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_an_offset_beside_a_neighbour_is_none_of_a_drift(sign: float) -> None:
    """A neighbour that is loaded as the recording ends moves the reading then, and was logged from the beginning on."""
    sessions, scale = _sessions(_run(offset=0.03 * sign, seed=1), _run(offset=0.03 * sign, seed=2))
    beside = np.clip(TIME_S / 6.0 - 8.0, 0.0, 1.0)
    beside_them = [replace(one, conditions=replace(one.conditions, neighbour=beside)) for one in sessions]
    pressed = baseline_of(sessions, scale).with_part(effect("cross_talk"), np.array([0.01 * sign]))
    (found,) = zeros_of(beside_them, pressed, scale, 0.0, 0.0, STANDARD)
    assert found.effect.name == "zero_offset"
    assert not found.may_have_drifted


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_no_tare_is_told_where_a_drift_may_have_come_by_what_is_read_beyond_the_load(sign: float) -> None:
    """The unit may bear the load that is shown: a drift that is known explains more than a tare and an offset."""
    duration_s = float(TIME_S[-1])

    def told(moved: float, *runs: Recording) -> list[tuple[str, bool]]:
        sessions, scale = _sessions(*runs)
        drift = np.array([sign * moved / duration_s, 0.0, 0.0, 1.0])
        drifting = baseline_of(sessions, scale).with_part(effect("zero_drift"), drift)
        return [
            (one.effect.name, one.may_have_drifted) for one in zeros_of(sessions, drifting, scale, 0.0, 0.0, STANDARD)
        ]

    shown = [_run(tare=0.018, offset=0.018 + 0.03 * sign, seed=seed) for seed in (1, 2)]
    both = {"load_cell_tare", "zero_offset"}
    beyond = both if sign < 0.0 else {"zero_offset"}  # what is read above the load is an offset, or the tare
    assert told(0.006, *shown) == [("zero_offset", True)]
    assert {name for name, _ in told(0.002, *shown)} == beyond  # more than an order of magnitude
    assert {name for name, _ in told(-0.006, *shown)} == beyond  # it drifts the other way
    # A unit of which it is known that nothing presses it, and a load cell that shows a pull.
    command = replace(shown[0].load, name="command", role="command", values=FULL_N * PRESSED)
    assert {name for name, _ in told(0.006, *(one.with_channel(command) for one in shown))} == both
    pulled = [_run(tare=-0.018, offset=-0.018 + 0.03 * sign, seed=seed) for seed in (1, 2)]
    assert {name for name, _ in told(0.006, *pulled)} == both


def test_an_offset_within_what_wanders_is_none() -> None:
    sessions, scale = _sessions(_run(offset=0.03, seed=1), _run(offset=0.03, seed=2))
    model = baseline_of(sessions, scale)
    (known,) = zeros_of(sessions, model, scale, 0.0, 0.0, STANDARD)
    assert zeros_of(sessions, model, scale, 0.0, 0.0, STANDARD, 0.02) == ()
    (quieter,) = zeros_of(sessions, model, scale, 0.0, 0.0, STANDARD, 0.002)
    one_look_each = 0.002 / np.sqrt(2.0)
    assert quieter.sd == pytest.approx(np.hypot(known.sd, one_look_each), rel=1e-6)


def test_a_tare_is_told_where_several_rests_read_nothing_whatever_wanders_elsewhere() -> None:
    sessions, scale = _sessions(_run(tare=-0.01, seed=1), _run(tare=-0.01, seed=2))
    model = baseline_of(sessions, scale)
    for some, told in ((sessions, ["load"]), (sessions[:1], [])):
        found = zeros_of(some, model, scale, 0.0, 0.0, STANDARD, 0.01)
        assert [one.effect.shifts for one in found] == told


def test_each_recordings_own_offset_is_found_under_a_model() -> None:
    sessions, scale = _sessions(_run(offset=0.02, seed=1), _run(offset=-0.04, seed=2), _run(offset=0.1, seed=3))
    found = offsets(sessions, baseline_of(sessions, scale))
    assert found == pytest.approx(np.array([0.02, -0.04, 0.1]) * FULL_MBAR / scale.reading, abs=1e-3)


# -- what is declared -------------------------------------------------------------------------------------------
def _ratio(area_m2: float | None, unit: str = "mbar") -> float:
    declared = {} if area_m2 is None else {"effective_area_m2": area_m2}
    return baseline_of(*_sessions(_run(unit=unit, **declared))).wall_ratio


def test_an_effective_area_tells_how_much_of_the_load_the_wall_bears() -> None:
    """1 + k1 x0^2/(nRT): the pressure that the load over the area would make, over the one that is read."""
    pascal_per_newton = FULL_MBAR * 100.0 / FULL_N
    for area_m2 in (0.005, 0.02):
        assert _ratio(area_m2) == pytest.approx(1.0 / (area_m2 * pascal_per_newton), rel=0.02)
    for impossible in (1.0, 1e-4, None):  # the wall would pull, or bear nearly all
        assert _ratio(impossible) == USUAL_WALL_RATIO
    assert _ratio(0.02, "v") == USUAL_WALL_RATIO


def test_an_area_tells_it_whatever_the_place_of_the_recording_that_declares_it() -> None:
    declared, bare = _run(effective_area_m2=0.005), _run(seed=1)
    told = {baseline_of(*_sessions(*runs)).wall_ratio for runs in ((declared, bare), (bare, declared))}
    assert min(told) == pytest.approx(max(told), rel=1e-6) == pytest.approx(1.0 / (0.005 * 17.5), rel=0.02)
    assert baseline_of(*_sessions(bare, _run(seed=2))).wall_ratio == USUAL_WALL_RATIO


@pytest.mark.parametrize(("name", "values"), [("linear_leak", [0.003]), ("gas_heat", [0.2, 2.0, 0.0])])
def test_what_a_leak_or_heat_does_goes_with_how_stiff_the_wall_is_which_is_said_where_nothing_tells_it(
    name: str, values: list[float]
) -> None:
    """By the rms between that of the model and that of the stiffest wall known, beside what counts."""
    bare, declared = _run(seed=1), _run(seed=2, effective_area_m2=0.005)
    sessions, _ = _sessions(bare, _run(seed=2))
    model = MODEL.with_part(effect(name), np.array(values))
    stiffest = replace(model, wall_ratio=1.78)
    off = [residual_of(one, model) - residual_of(one, stiffest) for one in sessions]
    rms = float(np.sqrt(np.mean(np.concatenate(off) ** 2)))
    assert rms > 0.0
    for material, is_said in ((0.999 * rms, True), (1.001 * rms, False)):
        assert (limit_wall_ratio(model, sessions, replace(STANDARD, material=material)) != []) is is_said
    sensitive = replace(STANDARD, material=0.999 * rms)
    assert limit_wall_ratio(model, sessions, sensitive) == [
        "the wall's stiffness relative to the gas is not known (N = 1.6 is assumed, units of the paper have 1.51 to"
        " 1.78): rates of leaks and times of heat depend on it, and may lie outside their intervals (declare"
        " the tube's effective area, in a file by a line '# effective_area_m2: ...' above the table)"
    ]
    for runs in ((declared, bare), (bare, declared)):
        told, scale = _sessions(*runs)
        assert limit_wall_ratio(replace(model, wall_ratio=baseline_of(told, scale).wall_ratio), told, sensitive) == []
    # An area that no wall has tells nothing, which is said even where it decides over nothing.
    told, scale = _sessions(_run(seed=1, effective_area_m2=1.0), bare)
    for thresholds in (sensitive, replace(STANDARD, material=0.4)):
        (said,) = limit_wall_ratio(replace(model, wall_ratio=baseline_of(told, scale).wall_ratio), told, thresholds)
        assert said.endswith(
            "(correct effective_area_m2: the declared one gives an N outside 1.02 to 50, which no tube has)"
        )
    # Without either it decides over nothing.
    assert limit_wall_ratio(MODEL.with_part("dead_band"), sessions, replace(STANDARD, material=1e-12)) == []


@pytest.mark.parametrize("declared", ["40 cm2", "nan", "0", "-0.004"])
def test_an_effective_area_that_is_no_positive_number_is_an_error_that_names_it(declared: str) -> None:
    with pytest.raises(InputError, match=f"run_0: effective_area_m2 is '{declared}': give a positive number in m2"):
        baseline_of(*_sessions(_run(effective_area_m2=declared)))


def test_a_lag_comes_to_a_step_by_its_time_constant() -> None:
    step = np.concatenate([[0.0], np.ones(400)])
    answer = lagged(step, 0.01, 0.5)
    assert answer[1:] == pytest.approx(1.0 - np.exp(-0.01 * np.arange(1, 401) / 0.5), abs=1e-12)
    assert lagged(3.0 + 0.0 * step, 0.01, 0.5) == pytest.approx(3.0 + 0.0 * step, abs=1e-12)


# -- two clocks -------------------------------------------------------------------------------------------------
def _told(
    offset_s: tuple[float, ...], rate: tuple[float, ...], runs: list[Recording], shared: OneClock | None = None
) -> Any:
    usable = tuple(one.sensor.present for one in runs)
    integrity: Any = SimpleNamespace(
        clock_offset_s=offset_s,
        clock_rate=rate,
        one_clock=shared,
        usable=usable,
        others=frozenset(),
        are_about_mean=False,
        judged_lags_s={},
    )
    return aligned(runs, integrity)


def _late(lag_s: float, rate: float = 0.0) -> Recording:
    """A reading that shows each moment by ``lag_s`` late, and by ``rate`` more a second away from the middle."""
    middle_s = 0.5 * (TIME_S[0] + TIME_S[-1])
    source_s = TIME_S - lag_s - rate * (TIME_S - middle_s)
    share = np.interp(source_s, TIME_S, PRESSED)
    return Recording.from_arrays(time_s=TIME_S, force_n=FULL_N * PRESSED, pressure_mbar=FULL_MBAR * share, name="late")


@pytest.mark.parametrize(("lag_s", "way"), [(0.6, "lags"), (-0.6, "leads")])
def test_a_reading_of_another_clock_is_moved_to_the_loads(lag_s: float, way: str) -> None:
    runs = [_late(lag_s), _run()]
    found = _told((lag_s, 0.0), (0.0, 0.0), runs)
    assert (found.parts, found.moved) == ((), {0})
    (said,) = found.says
    assert "late" in said
    assert f"the reading {way} the load by 0.6 s" in said
    usable = found.usable[0]
    assert 0 < np.count_nonzero(~usable) <= 0.6 / STEP_S + 2  # no reading was taken for the time beyond its ends
    assert usable[0 if lag_s > 0 else -1]
    off = found.recordings[0].sensor.values - FULL_MBAR * PRESSED
    assert np.max(np.abs(off[usable])) < 0.02 * FULL_MBAR
    assert found.recordings[1] is runs[1]
    assert found.usable[1].all()


def test_readings_moved_about_a_shared_delay_say_so() -> None:
    runs = [_late(0.6), _run()]
    usable = tuple(one.sensor.present for one in runs)
    integrity: Any = SimpleNamespace(
        clock_offset_s=(0.6, 0.0), clock_rate=(0.0, 0.0), one_clock=None, usable=usable, others=frozenset(),
        are_about_mean=True,
        judged_lags_s={},
    )  # fmt: skip
    (said,) = aligned(runs, integrity).says
    assert "the reading lags those of the other recordings by 0.6 s" in said
    assert "not diagnosed" not in said


def test_a_clock_that_runs_fast_is_slowed() -> None:
    found = _told((0.2, 0.0), (0.01, 0.0), [_late(0.2, 0.01), _run()])
    off = found.recordings[0].sensor.values - FULL_MBAR * PRESSED
    assert np.max(np.abs(off[found.usable[0]])) < 0.03 * FULL_MBAR


def test_what_was_not_usable_stays_so_where_it_is_moved_to() -> None:
    runs = [_late(0.6), _run()]
    masks = [one.sensor.present.copy() for one in runs]
    masks[0][500:520] = False
    lags_s = (0.6, 0.0)
    integrity: Any = SimpleNamespace(
        clock_offset_s=lags_s,
        clock_rate=(0.0, 0.0),
        one_clock=None,
        usable=tuple(masks),
        others=frozenset(),
        are_about_mean=False,
        judged_lags_s={},
    )
    lost = np.flatnonzero(~aligned(runs, integrity).usable[0][:1400])
    assert lost[0] == pytest.approx(500 - 0.6 / STEP_S, abs=1)
    assert lost.size == pytest.approx(20, abs=1)


def test_a_lag_that_all_share_is_the_models() -> None:
    runs = [_run(), _run()]
    found = _told((0.5, 0.0), (0.0, 0.0), runs, OneClock(0.51, 0.0))
    ((one, value),) = found.parts
    assert (one.name, found.says, found.moved) == ("delay", (), frozenset())
    assert value == pytest.approx([0.51])
    assert found.recordings == runs
    # What is seen to follow late, where no clock is told, is the unit's.
    assert _told((0.0, 0.0), (0.0, 0.0), runs, OneClock(0.1, 0.0)).parts == ()


def test_clocks_that_part_from_the_start_on_are_a_drift() -> None:
    rate = 0.002
    half_s = 0.5 * float(TIME_S[-1] - TIME_S[0])
    # They may have been apart at the start, by as much in each.
    for before_s in (0.0, 0.5, -0.5):
        both = _told((before_s + rate * half_s,) * 2, (rate, rate), [_run(), _run()], OneClock(before_s, rate)).parts
        assert [(one.name, float(value[0])) for one, value in both] == [("clock_drift", rate), ("delay", before_s)]
    # It is what such a clock makes of a reading.
    (one, value), _ = both
    drifted = MODEL.with_part(one, value).simulate(Conditions(TIME_S, PRESSED, STEP_S))
    late = _late(rate * half_s, rate).sensor.values / FULL_MBAR
    plain = MODEL.simulate(Conditions(TIME_S, late, STEP_S))
    assert np.sqrt(np.mean((drifted - plain) ** 2)) < 5e-3


@pytest.mark.parametrize("rate", [0.0, 0.01])
def test_clocks_that_are_further_apart_than_a_delay_can_be_are_put_right_one_by_one(rate: float) -> None:
    upper = effect("delay").parameters[0].upper
    half = 0.5 * float(TIME_S[-1] - TIME_S[0]) * rate
    for by, is_told in ((0.99, True), (1.01, False), (-0.99, True), (-1.01, False)):
        shared = OneClock(by * upper, rate)
        found = _told((by * upper + half,) * 2, (rate,) * 2, [_run(), _run()], shared)
        assert [one.name for one, _ in found.parts] == ["clock_drift", "delay"][rate == 0.0 :] * is_told
        assert len(found.moved) == 2 * (not is_told)
