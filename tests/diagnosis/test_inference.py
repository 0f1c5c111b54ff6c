"""The evidence for a set of effects, its slow twin, and what a diagnosis must not depend on."""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from numpy.typing import NDArray
from scipy.signal import StateSpace, lfilter, lsim
from told_evidence import taken_for_exact

from smartshoe import Recording, diagnose, dynamic_protocol
from smartshoe.diagnosis import Diagnosis, Thresholds, described
from smartshoe.diagnosis._baseline import baseline_of
from smartshoe.diagnosis._evidence import Evidence
from smartshoe.diagnosis._scale import full_scale
from smartshoe.diagnosis._sensitivity import Linearised, linearised, nuisance_precision, nuisances
from smartshoe.diagnosis._session import prepare
from smartshoe.models.effects import Conditions, effect
from smartshoe.models.extended import ExtendedModel

Array = NDArray[np.float64]

RATE_HZ = 25.0
MODEL = ExtendedModel(1.0, 0.08, 0.22, 800.0, 140.0, "mbar")


def recording(
    model: ExtendedModel = MODEL,
    seed: int = 0,
    noise: float = 0.001,
    repeats: int = 2,
    unit: str = "mbar",
    tare_n: float = 0.0,
) -> Recording:
    """What a model itself would read under triangles at three rates; for arithmetic, not for hidden effects."""
    protocol = dynamic_protocol((100, 300, 800), repeats=repeats, rest_s=4.0)
    time_s = np.arange(0.0, protocol.duration_s, 1 / RATE_HZ)
    load_n = protocol.load_at(time_s)
    conditions = Conditions(time_s, load_n / model.full_scale_load_n, 1 / RATE_HZ)
    share = model.simulate(conditions) + noise * np.random.default_rng(seed).standard_normal(time_s.size)
    return Recording.from_arrays(
        time_s=time_s,
        force_n=load_n + tare_n,
        **{f"pressure_{unit}": share * model.full_scale_reading},
        name=f"run_{seed}",
    )


def with_reading(given: Recording, change: float = 1.0, offset: float = 0.0) -> Recording:
    return Recording.from_arrays(
        time_s=given.time_s, force_n=given.force_n, pressure_v=change * given.sensor.values + offset, name=given.name
    )


@pytest.fixture(scope="module")
def small() -> Linearised:
    pair = [recording(MODEL.with_part(effect("gas_compression"), np.array([0.05])), seed) for seed in range(2)]
    usable = [one.sensor.present for one in pair]
    scale = full_scale(pair, usable, Thresholds())
    sessions = prepare(pair, usable, [False, False], scale, [8], Thresholds())
    return linearised(baseline_of(sessions, scale), sessions, Thresholds())


# -- evidence -------------------------------------------------------------------------------------------------
def plain_score(given: Linearised, sd: float, members: tuple[int, ...]) -> float:
    """-2 log density of the target under the explicit covariance, and the odds: the slow twin, equations exact."""
    limits = given.thresholds
    blocks, targets = [], []
    offset_sd = 1e3
    for k, (session, rows) in enumerate(zip(given.sessions, given.rows, strict=True)):
        past = np.zeros((rows.shape[0], 2 * len(given.sessions)))
        own = nuisances(session, given.model.pole_per_s)
        precision = nuisance_precision(session, given.model)
        past[:, 2 * k : 2 * k + 2] = own * np.array([offset_sd, precision[1, 1] ** -0.5])
        prior = np.full(rows.shape[1] - 1, limits.imperfection)
        prior[: given.baseline_count] = 1.0
        for one in given.candidates:
            if one.effect.why_unnamed:  # no good unit has a little of it
                prior[[c - 1 for c in one.columns]] = 0.0
        for member in members:
            prior[[c - 1 for c in given.candidates[member].columns]] = limits.strength_sd
        kept = session.fitted
        blocks.append(np.column_stack([rows[:, 1:] * prior, past])[kept])
        targets.append(rows[kept, 0])
    z, y = np.concatenate(blocks), np.concatenate(targets)
    covariance = z @ z.T + sd**2 * np.eye(y.size)
    _, log_determinant = np.linalg.slogdet(covariance)
    return float(y @ np.linalg.solve(covariance, y) + log_determinant)


def test_the_evidence_is_the_gaussian_density_of_the_explicit_covariance(small: Linearised) -> None:
    sd = 0.002
    evidence = Evidence(small, sd)
    sets = [(k,) for k in (0, 5, 11, 30)]
    slow = [plain_score(small, sd, members) for members in [(), *sets]]
    fast = [taken_for_exact(evidence, members).score - evidence.odds_of(members) for members in [(), *sets]]
    # Both are known up to one constant.
    assert_allclose(np.diff(fast), np.diff(slow), rtol=1e-4, atol=0.05)


@pytest.mark.parametrize("field", ["imperfection", "material"])
def test_what_any_effect_adds_to_a_good_unit_is_its_imperfection_whatever_is_material(
    small: Linearised, field: str
) -> None:
    """What an effect gains falls as imperfections grow, by as much as that of the explicit covariance."""
    sd, usual, member = 0.002, Evidence(small, 0.002), (11,)
    given = replace(small, thresholds=replace(Thresholds(), **{field: 2e-3}))
    evidence = Evidence(given, sd)
    gained = [taken_for_exact(one, member).score - taken_for_exact(one, ()).score for one in (usual, evidence)]
    slow = plain_score(given, sd, member) - plain_score(given, sd, ())
    assert gained[1] - evidence.odds_of(member) == pytest.approx(slow, rel=1e-4, abs=0.05)
    assert (gained[0] == pytest.approx(gained[1], rel=1e-9)) is (field == "material")


def test_every_extension_is_the_score_of_the_extended_set(small: Linearised) -> None:
    evidence = Evidence(small, 0.002)
    for score, k, strengths in evidence.extensions(()):
        exact = taken_for_exact(evidence, (k,))
        assert score == pytest.approx(exact.score, abs=1e-3)
        assert_allclose(strengths, exact.strengths[0], rtol=1e-3, atol=1e-9)


def test_likeness_is_the_cosine_of_what_the_baseline_cannot_follow(small: Linearised) -> None:
    evidence, alone = Evidence(small, 0.002), [0, 5, 11, 30]
    followed, made = [], []
    for k, (session, rows) in enumerate(zip(small.sessions, small.rows, strict=True)):
        past = np.zeros((rows.shape[0], 2 * len(small.sessions)))
        past[:, 2 * k : 2 * k + 2] = nuisances(session, small.model.pole_per_s)
        adds = [rows[:, small.candidates[m].columns] @ evidence.posterior((m,)).strengths[0] for m in alone]
        followed.append(np.column_stack([rows[:, 1 : 1 + small.baseline_count], past])[session.fitted])
        made.append(np.column_stack(adds)[session.fitted])
    z, y = np.concatenate(followed), np.concatenate(made)
    left = y - z @ np.linalg.lstsq(z, y, rcond=None)[0]
    left /= np.linalg.norm(left, axis=0)
    found = evidence.likeness(alone)
    assert_allclose(found, np.abs(left.T @ left), atol=1e-3)
    assert_allclose(np.diag(found), 1.0, atol=1e-12)
    assert found.min() >= 0.0


def test_a_departure_never_makes_the_right_law_much_less_likely(small: Linearised) -> None:
    evidence = Evidence(small, 0.002)
    (right,) = (k for k, one in enumerate(small.candidates) if one.name == "gas_compression")
    others = [k for k, one in enumerate(small.candidates) if one.effect.family != "static_curve"]
    best = evidence.posterior((right,)).score
    assert all(evidence.posterior((k,)).score > best for k in others[::9])


# -- what a diagnosis must not depend on ------------------------------------------------------------------------
STRONG = MODEL.with_part(effect("gas_compression"), np.array([0.12]))


def told(found: Diagnosis) -> list[tuple[str, float]]:
    return [(one.name, round(one.confidence, 2)) for one in found.causes]


@pytest.fixture(scope="module")
def plain() -> tuple[list[Recording], Diagnosis]:
    runs = [recording(STRONG, seed) for seed in range(3)]
    runs = [with_reading(one) for one in runs]
    return runs, diagnose(runs[:2], hold_out=[runs[2]])


@pytest.mark.parametrize("values", [(0.08, 0.03, 0.0), pytest.param((0.13, 0.1, 0.0), marks=pytest.mark.long)])
def test_a_corner_below_the_least_load_is_a_dead_band_and_no_curve(values: tuple[float, float, float]) -> None:
    """A tare lifts every load over the band, so that a fit that begins small has no slope towards it."""
    model = MODEL.with_part(effect("dead_band"), np.array(values))
    runs = [recording(model, seed, tare_n=24.0) for seed in range(3)]
    found = diagnose(runs[:2], hold_out=[runs[2]])
    assert {"dead_band", "load_cell_tare"} == {one.name for one in found.causes if one.size > 1e-3}
    assert "static_curve" not in {one.effect.family for one in found.causes}
    assert found.explained_percent > 90.0


def test_a_lag_that_the_baselines_arm_could_imitate_is_a_lag() -> None:
    """A plain model takes an arm of a few hundredths of a second for it, and then a second arm for the wall's."""
    late = MODEL.with_part(effect("sensor_lag"), np.array([0.12, 0.3]))
    curved = late.with_part(effect("sensor_nonlinearity"), np.array([0.012, -0.003, 0.001]))
    protocol = dynamic_protocol((300, 800, 3000), repeats=2, rest_s=3.0)
    time_s = np.arange(0.0, protocol.duration_s, 0.01)
    load = protocol.load_at(time_s) / curved.full_scale_load_n
    share = curved.simulate(Conditions(time_s, load, 0.01))
    runs = []
    for seed in range(3):
        noisy = share + 3e-4 * np.random.default_rng(seed).standard_normal(time_s.size)
        runs.append(
            Recording.from_arrays(time_s=time_s, force_n=800.0 * load, pressure_mbar=140.0 * noisy, name=f"late_{seed}")
        )
    found = diagnose(runs[:2], hold_out=[runs[2]])
    assert {one.effect.family for one in found.causes} == {"timing", "static_curve"}
    assert found.explained_percent > 95.0


def test_a_lag_that_an_arm_as_walls_have_imitates_is_a_lag() -> None:
    """The plain model's arm, of 0.1 s, was within all bounds, and about it nothing was found."""
    relaxes_s, share, lag_s, noise = 0.7, 0.25, 0.2, 1e-3
    presses = (
        ((800, 800, 500, 800, 300, 800), (200, 80, 200, 400, 100, 200), 0.0, 0.0),
        ((800, 400, 600, 800, 200, 700), (400,) * 6, 4.0, 3.0),
        ((600, 800, 400, 700, 800, 500, 800), (160, 300, 90, 220, 120, 350, 260), 0.0, 0.0),
    )
    runs, rng = [], np.random.default_rng(0)
    for peaks, rates, hold_s, rest_s in presses:
        corners = [(4.0, 0.0)]
        for peak, rate in zip(peaks, rates, strict=True):
            corners += [(peak / rate, peak), (hold_s + 0.01, peak), (peak / rate, 0.0), (rest_s + 0.01, 0.0)]
        at_s = np.concatenate([[0.0], np.cumsum([lasts_s for lasts_s, _ in corners])])
        time_s = np.arange(0.0, at_s[-1] + 4.0, 0.01)
        load = np.interp(time_s, at_s, [0.0, *(load for _, load in corners)])
        read = 0.25 * load
        for tau_s, part in ((relaxes_s, share), (lag_s, 1.0)):
            keep = np.exp(-0.01 / tau_s)
            read = (1.0 - part) * read + part * lfilter([1.0 - keep], [1.0, -keep], read)
        read = read + 200.0 * noise * rng.standard_normal(time_s.size)
        load = load + 0.3 * rng.standard_normal(time_s.size)
        runs.append(Recording.from_arrays(time_s=time_s, force_n=load, pressure_mbar=read, name=f"late_{len(runs)}"))
    (cause,) = diagnose(runs).causes
    assert cause.name == "sensor_lag"
    assert cause.parameters["time_constant"].value == pytest.approx(lag_s, rel=0.2)


@pytest.mark.parametrize(
    ("cutoff_hz", "damping"),
    [(2.0, 0.7), *(pytest.param(*one, marks=pytest.mark.long) for one in ((6.0, 0.7), (2.5, 0.4), (5.0, 0.4)))],
)
def test_a_lag_of_two_poles_that_are_a_pair_is_a_lag_alone(cutoff_hz: float, damping: float) -> None:
    """Of a Butterworth filter, or a tube with its cavity, two real poles were a delay, or left a gas that heats."""
    turn, step_s = 2.0 * np.pi * cutoff_hz, 0.002
    line = StateSpace([[0.0, turn], [-turn, -2.0 * damping * turn]], [[0.0], [turn]], [[1.0, 0.0]], [[0.0]])
    protocols = {
        "triangles": dynamic_protocol((50, 200, 800), repeats=2, rest_s=4.0),
        "others": dynamic_protocol((100, 400), repeats=3, rest_s=3.0),
    }
    runs, rng = [], np.random.default_rng(round(10 * cutoff_hz + damping))
    keep = np.exp(-step_s / 0.9)
    for name, protocol in protocols.items():
        time_s = np.arange(0.0, protocol.duration_s, step_s)
        load = protocol.load_at(time_s)
        pressure = 0.2 * load + 0.03 * lfilter([1.0 - keep], [1.0, -keep], load)
        read = lsim(line, pressure, time_s)[1] + 0.1 * rng.standard_normal(time_s.size)
        every = slice(None, None, 5)
        runs.append(
            Recording.from_arrays(time_s=time_s[every], force_n=load[every], pressure_mbar=read[every], name=name)
        )
    found = diagnose(runs[:1], hold_out=runs[1:])
    (cause,) = found.causes
    assert cause.name == "sensor_lag"
    assert cause.confidence > 0.95
    assert not found.minor
    assert cause.parameters["time_constant"].value == pytest.approx(2.0 * damping / turn, rel=0.02)
    assert 0.5 / np.sqrt(0.25 + (cause.parameters["second_pole"].value - 0.5) ** 2) == pytest.approx(damping, rel=0.02)


@pytest.mark.parametrize("bow", [0.03, pytest.param(-0.03, marks=pytest.mark.long)])
def test_a_bow_that_small_imperfections_could_add_up_to_is_half_sure_and_sure_of_better_units(bow: float) -> None:
    """Of 0.24 % of full scale "no effect of the catalogue accounts for it" was all that was said."""
    runs = []
    for seed, rates in enumerate(((50, 100, 200, 400), (80, 160, 320, 640))):
        protocol = dynamic_protocol(rates, repeats=3, rest_s=5.0)
        time_s = np.arange(0.0, protocol.duration_s, 0.02)
        share = protocol.load_at(time_s) / 800.0
        bent = share + bow * share * (1.0 - share)
        keep = np.exp(-0.02 / 1.5)
        read = 0.94 * bent + 0.06 * lfilter([1.0 - keep], [1.0, -keep], bent)
        read += 1e-3 * np.random.default_rng(seed).standard_normal(time_s.size)
        runs.append(
            Recording.from_arrays(time_s=time_s, force_n=800.0 * share, pressure_mbar=120.0 * read, name=f"bent_{seed}")
        )
    found, of_better_units = diagnose(runs), diagnose(runs, material=1e-4)
    for one in (found, of_better_units):
        assert one.verdict == "explained"
        assert {cause.effect.is_memoryless for cause in one.causes} == {True}
    assert max(cause.confidence for cause in found.causes) <= 0.5
    assert max(cause.confidence for cause in of_better_units.causes) > 0.9


def test_a_curve_is_found_and_gains_on_data_not_fitted(plain: tuple[list[Recording], Diagnosis]) -> None:
    _, found = plain
    assert found.causes
    assert found.causes[0].effect.family == "static_curve"
    assert found.causes[0].held_out.ci95[0] > 0


@pytest.mark.parametrize(
    ("change", "offsets"), [(1.0, (3.0, -40.0, 500.0)), (-1.0, (0.0, 0.0, 0.0)), (1e-3, (0.0, 0.0, 0.0))]
)
def test_offset_sign_and_unit_of_a_reading_change_no_cause(
    plain: tuple[list[Recording], Diagnosis], change: float, offsets: tuple[float, float, float]
) -> None:
    runs, found = plain
    other = [with_reading(one, change, offset) for one, offset in zip(runs, offsets, strict=True)]
    again = diagnose(other[:2], hold_out=[other[2]])
    assert [one.name for one in again.causes] == [one.name for one in found.causes]
    assert again.causes[0].held_out.gain_percent == pytest.approx(found.causes[0].held_out.gain_percent, abs=2.0)


@pytest.mark.parametrize(("change", "wander"), [(0.5, 0.0), (1.0, 20.0)])
def test_what_is_held_out_selects_nothing(
    plain: tuple[list[Recording], Diagnosis], change: float, wander: float
) -> None:
    runs, found = plain
    wrong = change * runs[2].sensor.values + wander * np.sin(runs[2].time_s / 15.0)
    nonsense = Recording.from_arrays(
        time_s=runs[2].time_s, force_n=runs[2].force_n, pressure_v=wrong + 7.0, name="nonsense"
    )
    again = diagnose(runs[:2], hold_out=[nonsense])
    assert found.model is not None
    assert again.rejected is not None  # what is held out may reject an extension, and nothing else
    selected = again.rejected.theta, found.model.without("zero_offset").theta
    assert_allclose(*selected, rtol=1e-9, atol=1e-12)
    assert [(one.name, one.confidence) for one in again.causes] == [(one.name, one.confidence) for one in found.causes]
    assert again.causes[0].held_out.rmse_after != found.causes[0].held_out.rmse_after
    assert again.verdict == "partly_explained"  # of another unit, or of one that wanders


def test_nothing_is_named_where_nothing_is_wrong() -> None:
    runs = [recording(MODEL, seed) for seed in range(3)]
    found = diagnose(runs[:2], hold_out=[runs[2]])
    assert not found.causes
    assert found.verdict == "adequate"


def test_one_load_cycle_claims_nothing_and_says_so() -> None:
    protocol = dynamic_protocol((100,), repeats=1, rest_s=4.0)
    time_s = np.arange(0.0, protocol.duration_s, 1 / 50.0)
    load_n = protocol.load_at(time_s)
    reading = STRONG.simulate(Conditions(time_s, load_n / 800.0, 1 / 50.0)) * 140.0
    reading += 0.1 * np.random.default_rng(0).standard_normal(time_s.size)
    one = Recording.from_arrays(time_s=time_s, force_n=load_n, pressure_mbar=reading, name="once")
    found = diagnose([one], hold_out=[recording(STRONG, 1)])
    assert not found.causes
    assert any("one load cycle" in said for said in found.limits)


# -- numbers ----------------------------------------------------------------------------------------------------
def test_every_number_says_its_unit_its_meaning_and_its_origin() -> None:
    listed = described(Thresholds())
    assert len(listed) == len(fields(Thresholds)) < 40
    for one in listed:
        assert one["unit"]
        assert one["meaning"]
        assert one["origin"]


@given(st.floats(1e-5, 1e-2))
@settings(max_examples=3, deadline=None)
def test_material_reaches_the_result(material: float) -> None:
    """Of less than is usual, imperfections are less by as much."""
    found, usual = diagnose([recording()], material=material), Thresholds()
    finer = min(material / usual.material, 1.0)
    assert (found.thresholds.imperfection, found.thresholds.tolerable) == pytest.approx((2e-4 * finer, 1.5e-3 * finer))
    kept = {"imperfection": usual.imperfection, "tolerable": usual.tolerable}
    assert replace(found.thresholds, **kept) == replace(usual, material=material)
