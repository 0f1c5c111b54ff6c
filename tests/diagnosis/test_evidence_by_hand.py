"""Evidence, fits and expected margins against slow twins that write their matrices out."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from numpy.testing import assert_allclose
from numpy.typing import NDArray

from smartshoe import Recording, dynamic_protocol
from smartshoe.diagnosis import Thresholds
from smartshoe.diagnosis._evidence import Evidence
from smartshoe.diagnosis._likelihood import Fit, Likelihood, fit
from smartshoe.diagnosis._scale import Scale
from smartshoe.diagnosis._search import best_additions, best_step, is_admissible, search
from smartshoe.diagnosis._sensitivity import Linearised, departures, linearised, nuisance_precision, nuisances
from smartshoe.diagnosis._session import Session, prepare
from smartshoe.diagnosis._state import linearised_search, state_at, with_members
from smartshoe.diagnosis._validation import error_of, rms_difference
from smartshoe.models.effects import Conditions, effect
from smartshoe.models.extended import ExtendedModel
from smartshoe.units import MILLIBAR

Array = NDArray[np.float64]

RATE_HZ, SD, SPAN_MBAR = 25.0, 0.002, 140.0
MODEL = ExtendedModel(1.0, 0.08, 0.22, 800.0, SPAN_MBAR, "mbar")
TRUTH = MODEL.with_part(effect("gas_compression"), np.array([0.08]))
STANDARD = Thresholds()
OWN_SD = 1.0  # of a baseline's own changes: anything up to full scale
SCALE = Scale(800.0, SPAN_MBAR, MILLIBAR)
PROTOCOL = dynamic_protocol((100, 300, 800), repeats=2, rest_s=4.0)


def _run(model: ExtendedModel, seed: int, noise: float = SD) -> Recording:
    time_s = np.arange(0.0, PROTOCOL.duration_s, 1 / RATE_HZ)
    load_n = PROTOCOL.load_at(time_s)
    share = model.simulate(Conditions(time_s, load_n / 800.0, 1 / RATE_HZ))
    share = share + noise * np.random.default_rng(seed).standard_normal(time_s.size)
    return Recording.from_arrays(time_s=time_s, force_n=load_n, pressure_mbar=SPAN_MBAR * share, name=f"run_{seed}")


def _sessions(model: ExtendedModel, count: int = 2, noise: float = SD, thinned: int = 12) -> list[Session]:
    runs = [_run(model, seed, noise) for seed in range(count)]
    usable = [one.sensor.present for one in runs]
    return prepare(runs, usable, [False] * count, SCALE, [thinned], STANDARD)


@pytest.fixture(scope="module")
def sessions() -> list[Session]:
    return _sessions(TRUTH)


@pytest.fixture(scope="module")
def given(sessions: list[Session]) -> Linearised:
    return linearised(MODEL, sessions, STANDARD)


@pytest.fixture(scope="module")
def evidence(given: Linearised) -> Evidence:
    return Evidence(given, SD)


def _number(given: Linearised, name: str) -> int:
    return next(k for k, one in enumerate(given.candidates) if one.name == name)


class _Twin:
    """The target as one Gaussian vector: every column with its prior, in one explicit covariance."""

    def __init__(self, given: Linearised, sd: float) -> None:
        self.given, self.sd = given, sd
        self.kept = [session.fitted for session in given.sessions]
        pasts = []
        for k, session in enumerate(given.sessions):
            own = nuisances(session, given.model.pole_per_s)[self.kept[k]]
            rest = nuisance_precision(session, given.model)[1, 1] ** -0.5
            wide = np.zeros((own.shape[0], 2 * len(given.sessions)))
            wide[:, 2 * k : 2 * k + 2] = own * np.array([1e3, rest])
            pasts.append(wide)
        self.past = np.concatenate(pasts)
        self.rows = np.concatenate([rows[kept] for rows, kept in zip(given.rows, self.kept, strict=True)])
        white = self.sd**2 * np.eye(self.rows.shape[0]) + self.past @ self.past.T
        self.white = white

    def seen(self, signals: list[Array]) -> Array:
        return np.concatenate([one[kept] for one, kept in zip(signals, self.kept, strict=True)])

    def prior(self, members: tuple[int, ...]) -> Array:
        sds = np.full(self.rows.shape[1] - 1, self.given.thresholds.imperfection)
        sds[: self.given.baseline_count] = 1.0
        for one in self.given.candidates:
            if one.effect.why_unnamed:  # what no law does is no small imperfection
                sds[[c - 1 for c in one.columns]] = 0.0
        for member in members:
            sds[[c - 1 for c in self.given.candidates[member].columns]] = self.given.thresholds.strength_sd
        return sds

    def cost(
        self, members: tuple[int, ...], departing: dict[int, tuple[Array, float]]
    ) -> tuple[float, Array, dict[int, float]]:
        """-2 log density but for a constant, the mean (c,) of all columns' coefficients, and how far each departs."""
        sds = self.prior(members)
        z = self.rows[:, 1:] * sds
        covariance = self.white + z @ z.T
        for columns, spread in departing.values():
            covariance = covariance + spread**2 * columns @ columns.T
        y = self.rows[:, 0]
        solved = np.linalg.solve(covariance, y)
        by = {m: float(np.sqrt(np.mean((spread * made.T @ solved) ** 2))) for m, (made, spread) in departing.items()}
        return float(y @ solved + np.linalg.slogdet(covariance)[1]), sds * (z.T @ solved), by

    def signature(self, member: int) -> list[Array]:
        """What a member adds to the reading beyond what the baseline and the nuisances follow, least squares."""
        given = self.given
        (column,) = given.candidates[member].columns
        own = [rows[:, 1 : 1 + given.baseline_count] for rows in given.rows]
        pasts = [nuisances(s, given.model.pole_per_s) for s in given.sessions]
        wide = np.zeros((self.rows.shape[0], 2 * len(pasts)))
        first = 0
        for k, (past, kept) in enumerate(zip(pasts, self.kept, strict=True)):
            wide[first : first + kept.sum(), 2 * k : 2 * k + 2] = past[kept]
            first += int(kept.sum())
        beside = np.column_stack([self.seen(own), wide])
        found = np.linalg.lstsq(beside, self.rows[:, column], rcond=None)[0]
        return [
            rows[:, column]
            - one @ found[: given.baseline_count]
            - past @ found[given.baseline_count + 2 * k : given.baseline_count + 2 * k + 2]
            for k, (rows, one, past) in enumerate(zip(given.rows, own, pasts, strict=True))
        ]

    def posterior(self, members: tuple[int, ...]) -> tuple[float, Array, dict[int, float]]:
        """The density with members whose equations depart in proportion to their sizes, these found in two rounds."""
        found, mean, departure_sds = self.cost(members, {})
        made = {m: self.seen(departures(self.given, self.signature(m))) for m in members}
        for _ in range(2):
            amounts = {m: abs(mean[self.given.candidates[m].columns[0] - 1]) for m in members}
            limits = self.given.thresholds
            parts = {m: (made[m], limits.departure * amounts[m] / made[m].shape[1] ** 0.5) for m in members}
            found, mean, departure_sds = self.cost(members, parts)
        return found, mean, departure_sds


# -- evidence -------------------------------------------------------------------------------------------------------
def test_an_equation_departs_in_proportion_to_its_size(given: Linearised, evidence: Evidence) -> None:
    twin = _Twin(given, SD)
    one, other = _number(given, "gas_compression"), _number(given, "rate_gain")
    sets = [(one,), (other,), tuple(sorted((one, other)))]
    slow = [twin.posterior(members) for members in sets]
    fast = [evidence.posterior(members) for members in sets]
    plain = [score.score - evidence.odds_of(score.members) for score in fast]
    # Both are known up to one constant.
    assert_allclose(np.diff(plain), np.diff([cost for cost, _, _ in slow]), rtol=1e-3, atol=0.1)
    for (_, mean, departure_sds), posterior in zip(slow, fast, strict=True):
        expected = [mean[given.candidates[m].columns[0] - 1] for m in posterior.members]
        assert_allclose([float(s[0]) for s in posterior.strengths], expected, rtol=1e-2, atol=1e-6)
        assert posterior.departure_sds == pytest.approx([departure_sds[m] for m in posterior.members], rel=0.02)


def test_a_member_that_stands_by_itself_departs_little_and_moves_the_reading_by_what_it_explains(
    given: Linearised, evidence: Evidence
) -> None:
    right = _number(given, "gas_compression")
    found = evidence.posterior((right,))
    assert found.departure_sds[0] < 1.0
    assert found.together == pytest.approx(found.sizes[0])
    # What the baseline, fitted anew, leaves of the effect.
    twin = _Twin(given, SD)
    expected = abs(found.strengths[0][0]) * np.sqrt(np.mean(twin.seen(twin.signature(right)) ** 2))
    assert found.sizes[0] == pytest.approx(float(expected), rel=1e-3)


def test_departures_made_at_once_are_those_made_one_after_another(given: Linearised) -> None:
    after, once = Evidence(given, SD), Evidence(given, SD)
    once.prepare_departures((9, 2, 5, 2))
    once.prepare_departures(())
    for members in ((2,), (2, 5), (2, 5, 9), (5, 11)):
        one, other = after.posterior(members), once.posterior(members)
        assert other.score == pytest.approx(one.score, rel=1e-9)
        assert other.departure_sds == pytest.approx(one.departure_sds, rel=1e-6, abs=1e-9)


def test_an_extension_of_a_set_scores_as_the_set_whose_new_equation_is_exact(
    given: Linearised, evidence: Evidence
) -> None:
    right = _number(given, "gas_compression")
    best = evidence.posterior((right,))
    twin = _Twin(given, SD)
    amount = abs(float(best.strengths[0][0]))
    made = twin.seen(departures(given, twin.signature(right)))
    departing = {right: (made, given.thresholds.departure * amount / made.shape[1] ** 0.5)}
    plain, _, _ = twin.cost((right,), departing)
    told = {k: (score, strengths) for score, k, strengths in evidence.extensions((right,))}
    assert right not in told
    assert set(told) == set(range(len(given.candidates))) - {right}
    for k in [_number(given, name) for name in ("rate_gain", "linear_leak", "delay", "sensor_nonlinearity")]:
        cost, mean, _ = twin.cost((right, k), departing)
        score, strengths = told[k]
        assert score - best.score == pytest.approx(cost - plain + evidence.odds_of((k,)), abs=0.3)
        assert_allclose(strengths, mean[[c - 1 for c in given.candidates[k].columns]], rtol=0.02, atol=1e-5)


def test_of_several_strengths_the_departures_are_of_the_likeliest(given: Linearised) -> None:
    """Under noise so loud that the prior has its say in how far each goes."""
    twin, evidence = _Twin(given, 0.3), Evidence(given, 0.3)
    by_noise = np.linalg.solve(twin.white, twin.rows)
    several = [one.columns for one in given.candidates if len(one.columns) > 1]
    assert several
    for columns in several:
        index = [*range(1, 1 + given.baseline_count), *columns]
        prior = np.diag([OWN_SD] * given.baseline_count + [given.thresholds.strength_sd**-2] * len(columns))
        known = by_noise[:, index].T
        strengths = np.linalg.solve(known @ twin.rows[:, index] + prior, known @ twin.rows[:, 0])[
            given.baseline_count :
        ]
        assert_allclose(evidence._direction(columns), strengths / np.linalg.norm(strengths), rtol=0.0, atol=1e-3)


def test_odds_are_of_one_effect_among_all_at_one_of_its_shapes(given: Linearised, evidence: Evidence) -> None:
    names = [one.name for one in given.candidates]
    effects, limits = len(set(names)), given.thresholds
    for k in (0, 7, 20):
        against = effects / limits.false_name * names.count(names[k])
        assert evidence.odds_of((k,)) == pytest.approx(2.0 * np.log(against))
    assert evidence.odds_of((0, 7)) == pytest.approx(evidence.odds_of((0,)) + evidence.odds_of((7,)))
    assert evidence.odds_of(()) == 0.0


# -- search ---------------------------------------------------------------------------------------------------------
@pytest.fixture(scope="module")
def two() -> tuple[Linearised, Evidence]:
    truth = TRUTH.with_part(effect("rate_gain"), np.array([0.03, 1.0]))
    given = linearised(MODEL, _sessions(truth), STANDARD)
    return given, Evidence(given, SD)


def test_the_best_set_is_better_than_all_that_one_change_makes_of_it(two: tuple[Linearised, Evidence]) -> None:
    given, evidence = two
    best = search(evidence)
    assert len({given.candidates[m].slot for m in best.members}) == len(best.members) >= 2
    assert "rate_gain" in {given.candidates[m].name for m in best.members}
    for member in best.members:
        assert evidence.posterior(tuple(m for m in best.members if m != member)).score > best.score
    for k in best_additions(evidence, best.members, 100):
        more = evidence.posterior((*best.members, k))
        assert more.score >= best.score - 1e-6 or not is_admissible(evidence, more)
    assert search(evidence, best.members).members == best.members
    # From a wrong start it comes back: by a swap.
    wrong = _number(given, "linear_leak")
    assert search(evidence, (wrong,)).score == pytest.approx(best.score, abs=5.0)


def test_a_step_is_one_change_and_never_for_the_worse(two: tuple[Linearised, Evidence]) -> None:
    _, evidence = two
    first = best_step(evidence)
    assert len(first.members) == 1
    assert first.score < evidence.posterior(()).score
    second = best_step(evidence, first.members)
    assert len(set(second.members) ^ set(first.members)) in (1, 2)
    assert second.score <= first.score


def test_additions_are_one_an_effect_best_first_without_what_is_taken_or_banned(
    two: tuple[Linearised, Evidence],
) -> None:
    given, evidence = two
    found = best_additions(evidence, (), 100)
    names = [given.candidates[k].name for k in found]
    assert len(set(names)) == len(names)
    scores = {k: score for score, k, _ in evidence.extensions(())}
    assert [scores[k] for k in found] == sorted(scores[k] for k in found)
    for k in found:
        own = [scores[j] for j, one in enumerate(given.candidates) if one.name == given.candidates[k].name]
        signed = [one for one in own if one < scores[k]]
        assert len(given.candidates[k].columns) > 1 or not signed or given.candidates[k].effect.parameters[0].lower == 0
    assert best_additions(evidence, (), 3) == found[:3]
    banned = names[0]
    assert banned not in {given.candidates[k].name for k in best_additions(evidence, (), 100, (banned,))}
    taken = given.candidates[found[0]].slot
    assert taken not in {given.candidates[k].slot for k in best_additions(evidence, (found[0],), 100)}


def test_a_strength_that_physics_forbids_is_not_allowed() -> None:
    """A reading that rises where a leak would let it fall."""
    swells = MODEL.with_part(effect("linear_leak"), np.array([-2e-3]))
    given = linearised(MODEL, _sessions(swells), STANDARD)
    evidence = Evidence(given, SD)
    leak = _number(given, "linear_leak")
    found = evidence.posterior((leak,))
    assert found.strengths[0][0] < 0.0
    assert not is_admissible(evidence, found)
    assert leak not in best_additions(evidence, (), 100)
    assert is_admissible(evidence, evidence.posterior(()))


def test_effects_that_cancel_each_other_are_not_allowed(two: tuple[Linearised, Evidence]) -> None:
    _, evidence = two
    best = search(evidence)
    inflated = replace(best, sizes=tuple(1.0 for _ in best.sizes), together=0.01)
    assert not is_admissible(evidence, inflated)
    assert is_admissible(evidence, replace(best, sizes=tuple(0.01 for _ in best.sizes), together=0.02))


def test_what_is_found_is_begun_with_at_about_its_size(two: tuple[Linearised, Evidence]) -> None:
    given, evidence = two
    likelihood = Likelihood(given.sessions, SD, MODEL, STANDARD)
    rate = _number(given, "rate_gain")
    found = evidence.posterior((rate,))
    begun = with_members(given, found, MODEL.with_part("zero_drift"), likelihood)
    assert begun.names == ("rate_gain",)
    assert begun.parts[0].values[0] == pytest.approx(0.03, rel=0.5)
    assert likelihood.cost(begun) < likelihood.cost(MODEL)
    # What stands in the model already keeps its values.
    again = with_members(given, found, begun, likelihood)
    assert again.theta == pytest.approx(begun.theta)


def test_a_state_says_what_a_new_set_is_worth_and_what_bends_it(two: tuple[Linearised, Evidence]) -> None:
    given, _ = two
    plain = fit(Likelihood(given.sessions, SD, MODEL, STANDARD), MODEL)
    state = state_at(plain)
    assert state.fitted_members == ()
    assert state.score_gain == pytest.approx(state.evidence.posterior(()).score - state.best.score)
    assert state.score_gain > state.evidence.odds
    assert state.is_worth_a_fit
    assert [one.name for one in state.chosen] == [state.linearisation.candidates[m].name for m in state.best.members]
    large = max(state.best.sizes)
    for linear, exceeds_linear_range in ((0.5 * large, True), (2.0 * large, False)):
        limits = replace(STANDARD, linear=linear)
        again = state_at(fit(Likelihood(given.sessions, SD, MODEL, limits), MODEL))
        assert again.exceeds_linear_range is exceeds_linear_range
        # Only one change where it bends: the next linearisation may tell another.
        assert (len(again.best.members) == 1) is exceeds_linear_range
    name = state.chosen[0].name
    _, without = linearised_search(plain.model, given.sessions, STANDARD, (name,))
    assert name not in {given.candidates[m].name for m in without.members}


# -- directions of departure --------------------------------------------------------------------------------------
def test_departures_are_a_signature_times_polynomials_and_its_lags(given: Linearised) -> None:
    ones = [np.ones(session.reading.size) for session in given.sessions]
    (first, _) = departures(given, ones)
    at = given.sessions[0].conditions
    legendre = np.polynomial.legendre.Legendre

    def along(column: Array, expected: Array) -> float:
        return float(column @ expected / np.linalg.norm(column) / np.linalg.norm(expected))

    load, elapsed = 2.0 * at.load - 1.0, np.linspace(-1.0, 1.0, at.time_s.size)
    for k, expected in ((0, load), (1, legendre([0, 0, 1])(load)), (4, elapsed), (5, legendre([0, 0, 1])(elapsed))):
        assert along(first[:, k], expected) == pytest.approx(1.0, abs=1e-6)
    moving = np.abs(at.rate_per_s) > 0.05
    direction, speed = first[moving, 2], first[moving, 3]
    assert np.sign(direction) == pytest.approx(np.sign(at.rate_per_s[moving]))
    assert np.ptp(np.abs(direction)) < 0.02 * np.abs(direction).max()
    # By decades of the rate.
    slope, start = np.polyfit(np.log10(np.abs(at.rate_per_s[moving])), speed, 1)
    assert speed == pytest.approx(start + slope * np.log10(np.abs(at.rate_per_s[moving])), abs=0.05 * np.ptp(speed))
    assert slope > 0.0
    assert first[:, 6:] == pytest.approx(0.0, abs=1e-6)  # a constant's lag is the constant


def test_departures_are_as_large_as_their_signature(given: Linearised) -> None:
    rng = np.random.default_rng(1)
    signature = [rng.standard_normal(session.reading.size) for session in given.sessions]
    made = departures(given, signature)
    kept = [session.fitted for session in given.sessions]
    whole = np.concatenate([part[mask] for part, mask in zip(made, kept, strict=True)])
    rms = np.sqrt(np.mean(np.concatenate([s[m] for s, m in zip(signature, kept, strict=True)]) ** 2))
    assert np.sqrt(np.mean(whole**2, axis=0)) == pytest.approx(np.full(whole.shape[1], rms), rel=1e-6)


# -- fits -----------------------------------------------------------------------------------------------------------
def _slow_cost(likelihood: Likelihood, model: ExtendedModel, like: ExtendedModel) -> float:
    """Residuals against the covariance of white noise and what is each session's own."""
    total = 0.0
    for session in likelihood.sessions:
        kept = session.fitted
        residual = (session.reading - model.simulate(session.conditions))[kept]
        past = nuisances(session, model.pole_per_s)[kept]
        rest = nuisance_precision(session, like)[1, 1] ** -0.5
        wide = past * np.array([10.0, rest])
        covariance = likelihood.noise_sd**2 * np.eye(residual.size) + wide @ wide.T
        total += float(residual @ np.linalg.solve(covariance, residual))
    return total


def test_the_cost_is_that_of_residuals_with_an_unknown_offset_and_past(sessions: list[Session]) -> None:
    likelihood = Likelihood(sessions, SD, MODEL, STANDARD)
    for model in (MODEL, TRUTH, replace(MODEL, gain=1.02)):
        assert likelihood.cost(model) == pytest.approx(_slow_cost(likelihood, model, MODEL), rel=1e-4)


LAGGING = TRUTH.with_part(effect("second_relaxation"), np.array([0.1, 0.8]))


@pytest.fixture(scope="module")
def fitted() -> tuple[Likelihood, ExtendedModel, Fit]:
    sessions = _sessions(LAGGING, thinned=4)
    likelihood = Likelihood(sessions, SD, MODEL, STANDARD)
    start = LAGGING.at(LAGGING.theta * np.array([1.02, 0.9, 1.1, 1.3, 0.8, 1.25]))
    return likelihood, start, fit(likelihood, start)


def _penalised(likelihood: Likelihood, start: ExtendedModel, model: ExtendedModel) -> float:
    """Cost and the prior of the one time constant, a factor e about where it was begun."""
    moved = np.log(model.theta[5] / start.theta[5])
    return likelihood.cost(model) + float(moved) ** 2


def test_slopes_that_are_brought_up_to_date_are_nearly_those_computed_anew(
    fitted: tuple[Likelihood, ExtendedModel, Fit],
) -> None:
    likelihood, start, found = fitted
    before = likelihood.normal(start)
    theta = start.theta + 0.3 * (found.model.theta - start.theta)
    moved = start.at(theta)
    likelihood.cost(moved)
    cost, pull, normal = likelihood.broyden_normal(moved, theta - start.theta)
    exact = likelihood.normal(moved)
    assert cost == pytest.approx(exact[0], rel=1e-9)
    scale = np.sqrt(np.diag(exact[2]))
    # Nearer than the slopes from before in the one direction that was gone.
    best_step = (theta - start.theta) * scale
    curved = [(one / np.outer(scale, scale)) @ best_step for one in (normal, before[2], exact[2])]
    assert np.linalg.norm(curved[0] - curved[2]) < 0.8 * np.linalg.norm(curved[1] - curved[2])
    assert pull / scale == pytest.approx(exact[1] / scale, abs=0.1 * float(np.linalg.norm(exact[1] / scale)))


def test_the_covariance_is_the_inverse_of_half_the_costs_curvature(
    fitted: tuple[Likelihood, ExtendedModel, Fit],
) -> None:
    likelihood, start, found = fitted
    theta, sds = found.model.theta, np.sqrt(np.diag(found.covariance))
    count = theta.size
    curvature = np.empty((count, count))

    def at(*moves: tuple[int, float]) -> float:
        moved = theta.copy()
        for k, by in moves:
            moved[k] += 0.3 * by * sds[k]
        return _penalised(likelihood, start, found.model.at(moved))

    for i in range(count):
        curvature[i, i] = at((i, 1.0)) - 2.0 * found.cost + at((i, -1.0))
    for i, j in combinations(range(count), 2):
        corners = at((i, 1.0), (j, 1.0)) - at((i, 1.0), (j, -1.0)) - at((i, -1.0), (j, 1.0)) + at((i, -1.0), (j, -1.0))
        curvature[i, j] = curvature[j, i] = 0.25 * corners
    # Steps were of so many standard deviations: this is the matrix of correlations.
    expected = np.linalg.inv(0.5 * curvature / 0.3**2)
    assert found.covariance / np.outer(sds, sds) == pytest.approx(expected, abs=0.1)


def test_a_fit_ends_where_no_small_step_betters_it(fitted: tuple[Likelihood, ExtendedModel, Fit]) -> None:
    likelihood, start, found = fitted
    assert found.cost == pytest.approx(_penalised(likelihood, start, found.model), rel=1e-9)
    sds = np.sqrt(np.diag(found.covariance))
    for k, sd in enumerate(sds):
        for sign in (-1.0, 1.0):
            theta = found.model.theta.copy()
            theta[k] += sign * sd
            assert _penalised(likelihood, start, found.model.at(theta)) > found.cost
    assert np.abs(found.model.theta - LAGGING.theta) == pytest.approx(0.0, abs=5.0 * float(sds.max()))


def test_two_models_are_apart_by_what_they_read_differently(sessions: list[Session]) -> None:
    higher = replace(MODEL, gain=1.01)
    load = np.concatenate([one.conditions.load[one.fitted] for one in sessions])
    # A held unit reads its load; each recording's own offset takes the mean out.
    assert rms_difference(sessions, MODEL, higher) == pytest.approx(0.01 * float(np.std(load)), rel=0.1)
    assert rms_difference(sessions, MODEL, MODEL) == 0.0
    assert error_of(sessions, TRUTH) < SD < error_of(sessions, MODEL)
