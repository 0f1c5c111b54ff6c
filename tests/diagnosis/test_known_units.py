"""Units whose every number is known, in files as laboratories bring them: what is named, and what is left open."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.signal import lfilter

from simulators.hidden.recordings import HiddenCase, hide
from smartshoe import Recording, compensate, diagnose
from smartshoe.diagnosis import Diagnosis
from smartshoe.models.effects import Conditions, effect
from smartshoe.models.extended import ExtendedModel
from smartshoe.protocol import Protocol, Segment, dynamic_protocol
from smartshoe.recording import Channel
from smartshoe.units import unit

Array = NDArray[np.float64]

STEP_S, PEAK_N, SHARE = 0.01, 50.0, 0.3


def _course(*parts: tuple[float, float], peak_n: float = 1.0) -> Array:
    """Straight lines to such shares of the peak in so many seconds."""
    corners_s = np.cumsum([0.0, *(seconds for _, seconds in parts)])
    at_s = STEP_S * np.arange(round(corners_s[-1] / STEP_S) + 1)
    return np.asarray(peak_n * np.interp(at_s, corners_s, [0.0, *(share for share, _ in parts)]), dtype=np.float64)


def _times(load: Array) -> Array:
    return np.asarray(STEP_S * np.arange(load.size), dtype=np.float64)


TRIANGLES_N = _course(
    (0.0, 3.0),
    *((x, s) for ramp_s in (5.0, 2.5, 1.0, 0.77) for _ in range(4) for x, s in ((1, ramp_s), (0, ramp_s), (0, 2))),
    peak_n=PEAK_N,
)

HOLDS_N = _course(
    (0.0, 3.0),
    *((x, s) for peak in (0.2, 0.6, 1.0, 0.4) for x, s in ((peak, 1), (peak, 20), (0, 1), (0, 15))),
    peak_n=PEAK_N,
)


def _solid(load: Array, tau_s: float) -> Array:
    """A standard linear solid under straight lines between samples: a part at once, the rest by one exact lag."""
    keep = float(np.exp(-STEP_S / tau_s))
    first = 1.0 - tau_s / STEP_S * (1.0 - keep)
    return np.asarray((1.0 - SHARE) * load + SHARE * lfilter([first, 1.0 - keep - first], [1.0, -keep], load))


def _run(load: Array, reading: Array, name: str, noise: float = 0.0, seed: int = 0) -> Recording:
    noisy = reading + noise * np.random.default_rng(seed).standard_normal(load.size)
    return Recording.from_arrays(time_s=_times(load), force_n=load, pressure_mbar=noisy, name=name)


def _named(found: Diagnosis) -> set[str]:
    return {cause.name for cause in found.causes}


# -- what is no effect ------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("is_logged", [True, False])
@pytest.mark.parametrize(("tau_s", "seed"), [(10.0, 0), (10.0, 2), (5.0, 4)])
def test_a_unit_that_went_on_being_pressed_in_a_gap_of_its_file_has_no_effect(
    tau_s: float, seed: int, is_logged: bool
) -> None:
    """Half a minute of triangles that nobody logged, or of which the load cell logged nothing."""
    time_s = _times(TRIANGLES_N)
    whole = _run(TRIANGLES_N, _solid(TRIANGLES_N, tau_s), "gap", 0.05, seed)
    lacking = (time_s > 30.5) & (time_s < 61.0)
    shown = np.where(lacking, np.nan, TRIANGLES_N)
    run = _run(shown, whole.sensor.values, "gap") if is_logged else whole.taken(~lacking)
    found = diagnose(run)
    assert (found.verdict, found.causes, found.minor) == ("adequate", (), ())
    assert found.baseline is not None
    assert found.baseline.rmse == pytest.approx(0.05, rel=0.1)
    assert found.model is not None
    assert 1.0 / found.model.relaxation_rate_per_s == pytest.approx((1.0 - SHARE) * tau_s, rel=0.6)


@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.long) for seed in (1, 2))])
def test_holds_of_which_the_ramps_were_not_logged_are_foretold_as_well_as_they_are_fitted(seed: int) -> None:
    """What the arm holds after a gap is the recording's own, also where all of it lies in what is held out."""
    peaks = np.random.default_rng(seed).permutation(np.linspace(0.1, 1.0, 10))
    load = _course((0.0, 3.0), *((x, s) for p in peaks for x, s in ((p, 10), (p, 12), (0, 10), (0, 12))), peak_n=PEAK_N)
    run = _run(load, _solid(load, 5.0), "holds", 0.05, seed)
    found = diagnose(run.taken(np.abs(np.gradient(load)) < 1e-9))
    assert (found.verdict, found.causes) == ("adequate", ())
    assert found.baseline is not None
    assert found.baseline.rmse == pytest.approx(0.05, rel=0.1)


@pytest.mark.parametrize(
    ("load", "offset"),
    [
        pytest.param(TRIANGLES_N, 0.0, marks=pytest.mark.long),
        (TRIANGLES_N, 5.0),
        (HOLDS_N, 0.0),
        pytest.param(HOLDS_N, 1.0, marks=pytest.mark.long),
    ],
)
def test_a_line_without_any_noise_is_diagnosed_and_has_its_offset_alone(load: Array, offset: float) -> None:
    """Of which rounding is all that is left."""
    found = diagnose(_run(load, 0.7 * load + offset, "line"))
    assert found.verdict == ("explained" if offset else "adequate")
    assert _named(found) == ({"zero_offset"} if offset else set())
    assert found.extended is not None
    assert found.extended.rmse < 1e-9 * PEAK_N
    assert found.model is not None
    assert found.model.relaxing_share == pytest.approx(0.0, abs=1e-6)
    for cause in found.causes:
        assert cause.parameters["offset"].value == pytest.approx(offset, rel=1e-6)


# -- what one load cycle cannot tell ----------------------------------------------------------------------------------
@pytest.mark.parametrize("ramp_s", [2.0, 5.0, 20.0])
def test_one_load_cycle_of_a_strongly_curved_unit_is_unexplained_and_says_so(ramp_s: float) -> None:
    load = _course((0.0, 2.0), (1.0, ramp_s), (0.0, ramp_s), (0.0, 3.0), peak_n=PEAK_N)
    found = diagnose(_run(load, load - 0.008 * load**2, "once", 0.02, 1))
    assert (found.verdict, found.causes) == ("unexplained", ())
    assert "% is left, and nothing shows that this is noise, and no cause can be named from this data" in found.says
    assert any("one load cycle of one recording: nothing in it is independent" in limit for limit in found.limits)
    assert found.leftover is not None
    assert found.explained_percent == 0.0
    assert 0.0 < found.explainable_percent <= 100.0
    plain = diagnose(_run(load, 0.7 * load, "once", 0.02, 1))
    assert (plain.verdict, plain.causes) == ("adequate", ())


# -- a cause of two kinds that look alike -----------------------------------------------------------------------------
def _held(rates_per_s: tuple[float, ...], shares: tuple[float, ...], times: int) -> Array:
    """A rest, and each height at each rate, held and left, all of it so often."""
    corners = [(0.0, 5.0)]
    corners += [c for r in rates_per_s for x in shares for c in ((x, x / r), (x, 8.0), (0.0, x / r), (0.0, 6.0))]
    return np.concatenate([_course(*corners)] * times)


BASE = ExtendedModel(1.0, 0.06, 0.2, 800.0, 90.0, "mbar")
COURSES = {
    "a": _held((0.125, 0.5), (1.0, 0.375, 0.625), 3),
    "b": _held((0.25, 1.0), (0.5, 1.0, 0.25), 3),
    "h": _held((0.375,), (0.75, 0.875, 0.4375), 2),
}


def _of(model: ExtendedModel, noise_mbar: float, noise_n: float = 0.0) -> list[Recording]:
    """Two recordings to fit and one to hold out."""
    rng, made = np.random.default_rng(0), []
    for name, load in COURSES.items():
        shown = 800.0 * load + noise_n * rng.standard_normal(load.size)
        reading = model.reading(Conditions(_times(load), load, STEP_S)) + noise_mbar * rng.standard_normal(load.size)
        made.append(_run(shown, reading, name))
    return made


def test_a_lag_of_a_sample_is_one_or_a_delay_and_nothing_is_left_of_it() -> None:
    """Of both together each would be immaterial beside the other, and neither named."""
    *fitted, judged = _of(BASE.with_part(effect("sensor_lag"), np.array([0.012, 0.0])), 0.03, 0.02)
    found = diagnose(fitted, hold_out=judged)
    assert found.verdict == "explained"
    (cause,) = found.causes
    assert {cause.name, *cause.equivalents} == {"delay", "sensor_lag"}
    assert not {"delay", "sensor_lag", "flexible_lag"} & set(found.minor)
    late_s = next(iter(cause.parameters.values()))
    assert late_s.unit == "s"
    assert late_s.value == pytest.approx(0.012, rel=0.15)
    assert found.explained_percent == pytest.approx(found.explainable_percent, abs=1.0)


@pytest.mark.parametrize(
    "rate_per_s", [0.0, 6e-5, *(pytest.param(rate, marks=pytest.mark.long) for rate in (4e-5, 8e-5))]
)
def test_of_a_leak_below_notice_no_more_could_be_explained_than_is_no_noise(rate_per_s: float) -> None:
    """Of what is off where it is judged, the noise is known: the rest is the leak's, some per cent of it."""
    noise_mbar = 0.09
    leak = effect("linear_leak")
    *fitted, judged = _of(BASE.with_part(leak, np.array([rate_per_s])) if rate_per_s else BASE, noise_mbar)
    found = diagnose(fitted, hold_out=judged)
    assert (found.verdict, found.causes, found.explained_percent) == ("adequate", (), 0.0)
    assert found.baseline is not None
    of_the_leak = 100.0 * (1.0 - (noise_mbar / found.baseline.rmse) ** 2)
    assert found.explainable_percent <= max(of_the_leak, 0.0) + 1.0
    # What is no structure is nothing; the noise is known to some per cent.
    assert (found.explainable_percent > max(of_the_leak - 4.0, 0.0)) is bool(rate_per_s)
    assert found.explainable_percent < 12.0


# -- what counts ------------------------------------------------------------------------------------------------------
@pytest.fixture(scope="module")
def leaking() -> HiddenCase:
    """A leak of 0.6 % of full scale."""
    triangles = dynamic_protocol((200.0, 800.0), repeats=3, rest_s=2.0).segments
    held = (Segment("ramp", 600.0, 3.0), Segment("hold", 600.0, 20.0), Segment("ramp", 0.0, 3.0))
    steps = Protocol("short", (*triangles, *held, Segment("rest", 0.0, 10.0)))
    return hide(
        ["linear_leak"], strength_percent_fs=0.6, protocol=steps, seed=5, nuisances=0, recordings=2, sample_rate_hz=50.0
    )


@pytest.mark.long
def test_a_cause_stays_one_as_what_counts_is_raised_to_a_third_of_it(leaking: HiddenCase) -> None:
    """With all that is said of it; beyond its size it counts for nothing, and the unit is good enough."""
    usual = diagnose(leaking.recordings, hold_out=leaking.hold_out)
    (cause,) = usual.causes
    assert (usual.verdict, cause.effect.family) == ("explained", "leak")
    assert cause.size == pytest.approx(0.006, rel=0.2)
    found = diagnose(leaking.recordings, hold_out=leaking.hold_out, material=2e-3)
    (again,) = found.causes
    assert (found.verdict, again.name, again.equivalents) == (usual.verdict, cause.name, cause.equivalents)
    assert again.confidence == pytest.approx(cause.confidence, abs=1e-9)
    assert again.size == pytest.approx(cause.size, rel=1e-6)
    assert found.explained_percent == pytest.approx(usual.explained_percent, rel=1e-6)
    coarse = diagnose(leaking.recordings, hold_out=leaking.hold_out, material=2.0 * cause.size)
    assert (coarse.verdict, coarse.causes, coarse.minor) == ("adequate", (), (cause.name,))


@pytest.mark.long
def test_a_finer_record_still_names_what_a_coarser_one_does(leaking: HiddenCase) -> None:
    found = diagnose(leaking.recordings, hold_out=leaking.hold_out, material=5e-5)
    assert "leak" in {cause.effect.family for cause in found.causes}
    assert found.thresholds.imperfection == pytest.approx(5e-5)


@pytest.mark.parametrize("seed", range(3))
def test_one_load_cycle_of_a_plain_unit_is_adequate_however_coarse_its_log_is(seed: int) -> None:
    """The window of thinned samples makes white noise of neighbours alike, and would be taken for structure."""
    time_s = np.arange(0.0, 12.0, 0.04)
    load = np.interp(time_s, [0, 5, 7, 9, 12], [0.0, 0.0, 1.0, 0.0, 0.0])
    model = ExtendedModel(1.0, 0.08, 0.22, 800.0, 140.0, "mbar")
    noise = 0.006 * np.random.default_rng(seed).standard_normal(time_s.size)
    share = model.simulate(Conditions(time_s, load, 0.04)) + noise
    run = Recording.from_arrays(time_s=time_s, force_n=800.0 * load, pressure_mbar=140.0 * share, name="one")
    found = diagnose(run)
    assert found.verdict == "adequate"
    assert found.explainable_percent == pytest.approx(0.0, abs=2.0)


@pytest.mark.parametrize("offset_mbar", [5.0, pytest.param(13.3, marks=pytest.mark.long)])
def test_holds_without_any_noise_are_diagnosed_without_overflow(offset_mbar: float) -> None:
    parts = [(0.0, 3.0)]
    for level in (10.0, 30.0, 50.0, 20.0, 25.0):
        parts += [(level, level / 40.0), (level, 20.0), (0.0, level / 40.0), (0.0, 15.0)]
    ends_s = np.cumsum([seconds for _, seconds in parts])
    time_s = np.arange(0.0, ends_s[-1], 0.01)
    load_n = np.interp(time_s, [0.0, *ends_s], [0.0, *(level for level, _ in parts)])
    reading = 0.7 * load_n + offset_mbar
    run = Recording.from_arrays(time_s=time_s, force_n=load_n, pressure_mbar=reading, name="exact")
    with np.errstate(over="raise"):
        diagnose(run)


# -- what nothing in the data tells apart -----------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("paces_s", "by_clock"),
    [
        ((3.0,), True),
        ((2.0, 6.0), True),
        ((2.0, 6.0), False),
        pytest.param((3.0,), False, marks=pytest.mark.long),
    ],
)
def test_a_gain_by_the_clock_and_one_by_load_cycles_are_one_where_cycles_come_evenly(
    by_clock: bool, paces_s: tuple[float, ...]
) -> None:
    """At one pace, in recordings of one rate, cycles are a clock; at two, they are none."""
    runs = []
    for k, ramp_s in enumerate((*paces_s, *paces_s)[:2]):
        load = _course((0.0, 2.0), *[(x, s) for _ in range(14) for x, s in ((1, ramp_s), (0, ramp_s), (0, 1))])
        gone = _times(load) / 42.0 if by_clock else np.cumsum(np.abs(np.diff(load, prepend=0.0))) / 2.0 / 6.0
        reading = 100.0 * _solid(load, 2.0) * (1.04 - 0.04 * np.exp(-gone))
        runs.append(_run(PEAK_N * load, reading, f"run_{k}", 0.02, k))
    found = diagnose(runs)
    (cause,) = (one for one in found.causes if one.name in {"gain_drift", "cycle_conditioning"})
    assert cause.confidence >= 0.5  # by the clock only its free form follows
    if len(paces_s) == 1:
        assert {cause.name, *cause.equivalents} == {"gain_drift", "cycle_conditioning"}
        assert found.next_experiment is not None
        assert {*found.next_experiment.separates} == {"gain_drift", "cycle_conditioning"}
    else:
        assert (cause.name, cause.equivalents) == ("gain_drift" if by_clock else "cycle_conditioning", ())


# -- zeros that no rest shows -----------------------------------------------------------------------------------------
@pytest.mark.parametrize("tare", [pytest.param(0.0, marks=pytest.mark.long), 1.0])
def test_a_zero_that_is_led_back_from_high_loads_is_told_and_one_from_no_load_is_named(tare: float) -> None:
    """By how much the reading is off at no load is seen; what does it may lie below the lowest load."""

    def run(lowest: float, name: str) -> Recording:
        load = lowest + (1.0 - lowest) * _course(*[(x, s) for s in (4.0, 2.0) for _ in range(5) for x in (1, 0)])
        acting = load + tare * 0.025
        reading = 100.0 * (_solid(acting - acting[0], 2.0) + acting[0] + (1.0 - tare) * 0.025)
        return _run(PEAK_N * load, reading, name, 0.02, len(name))

    high = [run(0.2, "high"), run(0.25, "higher")]
    found = diagnose(high)
    assert (found.verdict, found.causes) == ("adequate", ())
    (said,) = (one for one in found.limits if one.startswith("extrapolated to no load from 2"))
    assert "an offset, a tare, what the unit does below" in said
    found = diagnose([*high, run(0.0, "from nothing")])
    (cause,) = found.causes
    assert {cause.name, *cause.equivalents} == {"zero_offset", "load_cell_tare"}
    assert cause.parameters["offset"].value == pytest.approx(2.5, rel=0.1)
    assert not any(one.startswith("extrapolated") for one in found.limits)


@pytest.mark.parametrize("seed", [20, *(pytest.param(seed, marks=pytest.mark.bank) for seed in (22, 25))])
def test_what_a_walk_remembers_from_before_it_was_cut_is_no_offset(seed: int) -> None:
    """As the foot swings, and as it stands: the wall has borne the steps before."""
    case = hide({}, protocol="walking", seed=seed)
    cut = []
    for place, one in enumerate(case.recordings):
        load = one.force_n
        swings = load < 0.02 * load.max()
        begins = np.flatnonzero(np.diff(swings.astype(int)) == 1) + 4
        first = int(begins[begins > len(one) // 4 + 137 * place][0])
        if place % 2:
            first += int(np.argmax(load[first:] > 0.5 * load.max()))
        cut.append(one.taken(slice(first, len(one))))
    found = diagnose(cut, case.hold_out)
    assert "zero_offset" not in _named(found)
    assert found.verdict in ("adequate", "explained")


@pytest.mark.parametrize(
    ("tau_s", "kept", "named", "sign"),
    [
        (1.0, 0.1, set(), -1.0),
        (1.0, 0.0, {"linear_leak"}, 1.0),
        pytest.param(1.0, 0.1, set(), 1.0, marks=pytest.mark.long),
        pytest.param(1.0, 0.0, {"linear_leak"}, -1.0, marks=pytest.mark.long),
        *(pytest.param(3.0, 0.1, set(), sign, marks=pytest.mark.long) for sign in (1.0, -1.0)),
    ],
)
def test_charge_that_fades_is_no_friction(tau_s: float, kept: float, named: set[str], sign: float) -> None:
    """A reading that fades from each change of the load lies higher while the load rises, as friction does."""
    runs = []
    for seed in range(3):
        rng = np.random.default_rng(seed)
        presses = [(rng.uniform(0.4, 1.0), rng.uniform(0.5, 3.0), rng.uniform(1.0, 20.0)) for _ in range(6)]
        load = (
            _course(
                (0.0, 2.0),
                *((x, s) for peak, ramp, hold in presses for x, s in ((peak, ramp), (peak, hold), (0, ramp), (0, 5))),
            )
            * 800.0
        )
        keep = float(np.exp(-STEP_S / tau_s))
        faded = lfilter([1.0 - keep], [1.0, -keep], load)
        runs.append(_run(load, 5.0 + sign * 0.1 * (load - (1.0 - kept) * faded), f"r{seed}", 0.05, seed))
    found = diagnose(runs[:2], hold_out=runs[2])
    assert not any("direction" in said for said in found.limits)
    assert _named(found) - {"zero_offset"} == named
    assert found.verdict in ("adequate", "explained")
    assert found.extended is not None
    assert found.extended.variance_explained_percent > 99.9


def _stairs(seed: int) -> Array:
    rng = np.random.default_rng(seed)
    presses = zip(rng.uniform(0.25, 1.0, 7), rng.uniform(0.5, 3.0, 7), rng.uniform(1.0, 40.0, 7), strict=True)
    steps = [((peak, ramp), (peak, hold), (0.0, ramp), (0.0, 15.0)) for peak, ramp, hold in presses]
    return _course((0.0, 3.0), *(step for press in steps for step in press), peak_n=PEAK_N)


def _giving_way(seed: int, spectrum: dict[float, float], bow: float = 0.0) -> Recording:
    """Of a polymer that is stretched, or a foil that is pressed, in ohms, which fall through a hold."""
    load = _stairs(seed)
    share = load / PEAK_N
    bent = share + bow * share * (1.0 - share)
    fading = [(part, float(np.exp(-STEP_S / tau))) for tau, part in spectrum.items()]
    given_way = sum(part * lfilter([1.0 - keep], [1.0, -keep], bent) for part, keep in fading)
    reading = 80.0 * (bent - given_way) + 5.0 + 0.05 * np.random.default_rng(seed).standard_normal(load.size)
    foil = Channel.from_values("foil", reading, unit("ohm"), "sensor")
    return Recording.from_arrays(time_s=_times(load), force_n=load, name=f"r{seed}").with_channel(foil)


@pytest.mark.parametrize(
    ("spectrum", "bow", "named"),
    [
        ({1.0: 0.2, 20.0: 0.05}, 0.0, {"second_relaxation"}),
        pytest.param({1.0: 0.2, 20.0: 0.15}, 0.0, {"second_relaxation"}, marks=pytest.mark.long),
        pytest.param({2.0: 0.3, 60.0: 0.2}, 0.3, {"second_relaxation", "static_curve"}, marks=pytest.mark.long),
    ],
)
def test_what_gives_way_in_holds_is_a_relaxation_where_the_reading_is_no_pressure(
    spectrum: dict[float, float], bow: float, named: set[str], tmp_path: Path
) -> None:
    runs = [_giving_way(seed, spectrum, bow) for seed in range(3)]
    found = diagnose(runs[:2], hold_out=runs[2])
    assert {c.effect.family if c.effect.family == "static_curve" else c.name for c in found.causes} == named
    assert found.verdict == "explained"
    relaxing = next(cause for cause in found.causes if cause.effect.family == "relaxation")
    assert relaxing.parameters["share"].value < 0.0
    assert found.extended is not None
    assert found.extended.variance_explained_percent > 99.98
    found.calibration(unit="foil").save(tmp_path / "foil.json")
    force = compensate(runs[2], tmp_path / "foil.json")
    assert float(np.sqrt(np.mean((force - runs[2].force_n) ** 2))) < 0.01 * PEAK_N


@pytest.mark.long
def test_a_resistance_that_gives_way_over_many_times_is_none_of_a_gas() -> None:
    runs = [_giving_way(seed, {0.3: 0.1, 3.0: 0.1, 30.0: 0.1, 300.0: 0.1}) for seed in range(3)]
    found = diagnose(runs[:2], hold_out=runs[2])
    assert {cause.effect.family for cause in found.causes} == {"relaxation"}
    assert any("is no gas pressure" in said for said in found.limits)


@pytest.mark.long
@pytest.mark.parametrize("seed", range(3))
def test_an_adhesive_under_a_gauge_that_gives_way_by_no_single_exponential_is_a_relaxation(seed: int) -> None:
    """Stretched over a decade, beside an arm that creeps on: free heat of a gas follows it, which no strip has."""
    runs = [_giving_way(3 * seed + k, {0.6: -0.1, 4.0: 0.015, 12.0: 0.03, 36.0: 0.015}) for k in range(3)]
    found = diagnose(runs[:2], hold_out=runs[2])
    assert found.verdict == "explained"
    assert {cause.effect.family for cause in found.causes} == {"relaxation"}
    assert found.causes[0].confidence > 0.75


# -- what is far larger than the effects of a good unit ---------------------------------------------------------------
def _clipped(share: float, load: Array) -> Array:
    """A sensor that ends at a ``share`` of what the unit would give."""
    return np.minimum(_solid(load, 3.0), share * PEAK_N)


def _beyond_a_gap(share: float, load: Array) -> Array:
    """A gap in the contact that bears a ``share`` of the largest load before the tube is touched."""
    return _solid(np.maximum(load - share * PEAK_N, 0.0), 3.0)


def _late(tau_s: float, load: Array) -> Array:
    keep = float(np.exp(-STEP_S / tau_s))
    return np.asarray(lfilter([1.0 - keep], [1.0, -keep], _solid(load, 3.0)))


@pytest.mark.parametrize(
    ("distorted", "size", "named"),
    [
        (_clipped, 0.6, "saturation"),
        pytest.param(_clipped, 0.4, "saturation", marks=pytest.mark.long),
        pytest.param(_beyond_a_gap, 0.45, "dead_band", marks=pytest.mark.long),
        (_late, 0.1, "sensor_lag"),
        pytest.param(_late, 0.5, "sensor_lag", marks=pytest.mark.long),
    ],
)
def test_what_is_far_larger_than_small_effects_is_told_as_what_it_is(
    distorted: Callable[[float, Array], Array], size: float, named: str
) -> None:
    """A range, a gap or a filter that was chosen wrongly: 40 % of the load are lost, or a lag bends the wall's arm."""
    loads = (TRIANGLES_N, HOLDS_N, 0.9 * HOLDS_N)
    runs = [_run(load, distorted(size, load), f"run_{k}", 0.05, k) for k, load in enumerate(loads)]
    found = diagnose(runs[:2], hold_out=runs[2:])
    assert found.verdict == "explained"
    assert found.causes[0].name == named
    assert found.causes[0].confidence > 0.9
    assert not [one.name for one in found.causes[1:] if one.confidence > 0.5]


@pytest.mark.parametrize(
    "offset_mbar", [-0.3, *(pytest.param(offset, marks=pytest.mark.long) for offset in (0.4, 1.0))]
)
def test_a_preload_that_the_unit_bears_is_no_tare(offset_mbar: float) -> None:
    """The machine touches the unit throughout, and its sensor is off: at rest both load and reading are above zero."""
    preload = 0.8
    courses = [np.concatenate([np.zeros(400), load]) for load in (TRIANGLES_N, HOLDS_N, 0.9 * HOLDS_N)]
    runs = [
        _run(load + preload, _solid(load, 3.0) + preload + offset_mbar, f"run_{k}", 0.05, k)
        for k, load in enumerate(courses)
    ]
    found = diagnose(runs[:2], hold_out=runs[2:])
    assert "load_cell_tare" not in [one.name for one in found.causes]
    assert all(one.name == "zero_offset" and "load_cell_tare" in one.equivalents for one in found.causes)
