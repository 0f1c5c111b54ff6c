"""Steps of a fit, their priors and slopes, laws and arms that are tried: by small matrices and fits told beforehand."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from told_evidence import STANDARD, session_of

from smartshoe.diagnosis._evidence import Evidence, _factor
from smartshoe.diagnosis._likelihood import (
    Likelihood,
    _are_logarithmic,
    _bounded_step,
    _inverse,
    _Prior,
    _stepped,
    fit,
)
from smartshoe.diagnosis._sensitivity import nuisance_precision
from smartshoe.models.extended import ExtendedModel

Array = NDArray[np.float64]

MODEL = ExtendedModel(1.1, 0.1, 0.3, 800.0, 140.0, "mbar")
OPEN = np.full(2, 1e9)


# -- steps ------------------------------------------------------------------------------------------------------------
def _step(
    normal: Any, right: Any, damping: float = 0.0, theta: Any = (0.0, 0.0), low: Any = -OPEN, high: Any = OPEN,
    logarithmic: Any = (False, False),
) -> Array:  # fmt: skip
    given = [np.array(one, dtype=float) for one in (normal, right)]
    at = [np.array(one, dtype=float) for one in (theta, low, high)]
    return _bounded_step(given[0], given[1], damping, *at, np.array(logarithmic))


NORMAL = [[4.0, 1.0], [1.0, 9.0]]


@pytest.mark.parametrize("damping", [0.0, 0.5, 100.0])
def test_a_step_is_that_of_the_damped_normal_equations(damping: float) -> None:
    normal = np.array(NORMAL)
    expected = np.linalg.solve(normal + damping * np.diag(np.diag(normal)), [3.0, -2.0])
    assert _step(NORMAL, [3.0, -2.0], damping) == pytest.approx(expected)


def test_a_parameter_without_influence_stays() -> None:
    for by, moves in ((0.5, False), (2.0, True)):
        found = _step([[1.0, 0.0], [0.0, by * 1e-12]], [1.0, 1e-12])
        assert found[0] == pytest.approx(1.0)
        assert bool(found[1] != 0.0) is moves
    assert list(_step([[0.0, 0.0], [0.0, 0.0]], [1.0, 1.0])) == [0.0, 0.0]


def test_a_parameter_at_its_bound_goes_no_further_and_the_others_as_without_it() -> None:
    for side in (1.0, -1.0):
        bounds = {"low": [-5.0, 0.0], "high": [5.0, 9.0]} if side > 0.0 else {"low": [-5.0, -9.0], "high": [5.0, 0.0]}
        found = _step(NORMAL, [3.0, -side * 2.0], **bounds)
        assert list(found) == [pytest.approx(0.75), 0.0]
        back = _step(NORMAL, [3.0, side * 20.0], **bounds)
        assert back == pytest.approx(np.linalg.solve(NORMAL, [3.0, side * 20.0]))
    inside = _step(NORMAL, [3.0, -2.0], theta=[0.0, 1e-9], low=[-5.0, 0.0])
    assert inside == pytest.approx(np.linalg.solve(NORMAL, [3.0, -2.0]))


def test_a_logarithm_goes_by_one_at_most() -> None:
    assert _step([[1.0, 0.0], [0.0, 1.0]], [3.0, 3.0], logarithmic=(True, False)) == pytest.approx([1.0, 3.0])
    assert _step([[1.0, 0.0], [0.0, 1.0]], [-3.0, 0.5], logarithmic=(True, True)) == pytest.approx([-1.0, 0.5])


def test_an_inverse_is_of_what_has_influence() -> None:
    whole = np.array([[4.0, 0.0, 1.0], [0.0, 0.0, 0.0], [1.0, 0.0, 9.0]])
    found = _inverse(whole)
    assert found[np.ix_([0, 2], [0, 2])] == pytest.approx(np.linalg.inv(NORMAL))
    assert not found[1].any()
    assert not found[:, 1].any()
    assert not _inverse(np.zeros((2, 2))).any()
    wide = np.diag([1e-18, 1e18])
    assert _inverse(wide) == pytest.approx(np.diag([1e18, 1e-18]))


# -- priors -----------------------------------------------------------------------------------------------------------
def _parameter(null: float | None, lower: float, upper: float, prior_sd: float | None = None, size: float = 4.0) -> Any:
    return SimpleNamespace(null=null, lower=lower, upper=upper, prior_sd=prior_sd, size=size)


def test_shapes_over_a_factor_of_thirty_are_stepped_in_their_logarithm() -> None:
    told = [
        (_parameter(None, 1.0, 30.0), True), (_parameter(None, 1.0, 29.9), False),
        (_parameter(None, 0.0, 30.0), False), (_parameter(1.0, 1.0, 100.0), False),
        (_parameter(None, -1.0, 100.0), False), (_parameter(None, 0.5, 15.0), True),
    ]  # fmt: skip
    model: Any = SimpleNamespace(parameters=[("effect", one) for one, _ in told])
    assert list(_are_logarithmic(model)) == [is_logarithmic for _, is_logarithmic in told]
    theta = np.array([math.e, 2.0, -math.e])
    assert _stepped(theta, np.array([True, False, True])) == pytest.approx([1.0, 2.0, 1.0])
    assert _stepped(np.zeros(1), np.array([True])) == pytest.approx([-690.7755], abs=1e-3)


def test_priors_are_about_where_a_shape_begins_and_where_a_weight_is_null() -> None:
    parameters = [
        ("baseline", _parameter(None, 1.0, 100.0)), ("baseline", _parameter(None, -1.0, 100.0)),
        ("one", _parameter(None, 1.0, 100.0)), ("one", _parameter(None, -1.0, 100.0)),
        ("one", _parameter(0.0, 0.0, 1.0)),
        ("block", _parameter(0.5, 0.0, 1.0, prior_sd=0.2)), ("block", _parameter(None, 1.0, 100.0, prior_sd=0.1)),
    ]  # fmt: skip
    model: Any = SimpleNamespace(parameters=parameters, theta=np.array([2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0]))
    found = _Prior.about(model)
    assert list(found.logarithmic) == [True, False, True, False, False, False, True]
    assert list(found.precision) == pytest.approx([0.0, 0.0, 1.0, 1.0 / 16.0, 0.0, 25.0, 100.0])
    assert list(found.centre) == pytest.approx([math.log(2.0), 3.0, math.log(4.0), 5.0, 6.0, 0.5, 0.0])


# -- likelihoods ------------------------------------------------------------------------------------------------------
def _sessions() -> list[Any]:
    rng = np.random.default_rng(1)
    made = []
    for size in (120, 80):
        load = np.interp(np.arange(size), np.linspace(0, size, 9), rng.uniform(0.0, 1.0, 9))
        kept = rng.random(size) < 0.9
        plain = session_of(load, kept)
        reading = 0.9 * MODEL.simulate(plain.conditions) + 0.02 * rng.standard_normal(size) + 0.1
        made.append(session_of(load, kept, reading=reading))
    return [made[0], session_of(np.ones(30), np.zeros(30, dtype=bool)), made[1]]


def _weight(session: Any, sd: float, pole_per_s: float) -> tuple[Array, Array]:
    """Precision of a session's samples, its offset and past unknown; and what these are per residual, (2, n)."""
    kept = session.fitted
    past = np.array([[1.0, math.exp(-pole_per_s * at)] for at in session.conditions.time_s])[kept]
    inner = past.T @ past / sd**2 + nuisance_precision(session, MODEL)
    found = np.linalg.solve(inner, past.T) / sd**2
    return np.eye(kept.sum()) / sd**2 - past @ found / sd**2, found


@pytest.mark.parametrize("gain", [1.0, 1e250])
def test_a_model_that_runs_off_costs_without_end_and_warns_of_nothing(gain: float) -> None:
    """A leak beside an arm that pushes: what goes out pushes more out."""
    size = 3000
    likelihood = Likelihood([session_of(np.ones(size), np.ones(size, dtype=bool))], 0.03, MODEL, STANDARD)
    runs_off = ExtendedModel(gain, -0.9, 0.01, 800.0, 140.0, "mbar").with_part("linear_leak", np.array([500.0]))
    assert likelihood.cost(runs_off) == math.inf
    assert math.isfinite(likelihood.cost(MODEL.with_part("linear_leak", np.array([500.0]))))


def test_costs_slopes_and_those_brought_up_to_date_are_of_written_out_matrices() -> None:
    sessions, sd = _sessions(), 0.03
    fitted = [one for one in sessions if one.fitted.any()]
    likelihood = Likelihood(sessions, sd, MODEL, STANDARD)
    assert likelihood.sessions == tuple(fitted)

    def left(model: ExtendedModel) -> list[Array]:
        return [one.reading - model.simulate(one.conditions) for one in fitted]

    def products(rows: list[Array], model: ExtendedModel) -> tuple[float, Array, Array]:
        total = np.zeros((4, 4))
        rate, share = model.relaxation_rate_per_s, model.relaxing_share
        pole_per_s = rate / (1.0 + share)
        for row, one in zip(rows, fitted, strict=True):
            weight, found = _weight(one, sd, pole_per_s)
            brought = (found @ row[one.fitted, 0])[1]
            by_pole = np.array([-brought * at * math.exp(-pole_per_s * at) for at in one.conditions.time_s])
            whole = row.copy()
            whole[:, 2] -= by_pole * rate / (1.0 + share) ** 2
            whole[:, 3] += by_pole / (1.0 + share)
            total += whole[one.fitted].T @ weight @ whole[one.fitted]
        return float(total[0, 0]), total[1:, 0], total[1:, 1:]

    def alike(found: Any, expected: Any) -> None:
        assert found[0] == pytest.approx(expected[0], rel=1e-6)
        for one, other in zip(found[1:], expected[1:], strict=True):
            assert one == pytest.approx(other, rel=1e-5, abs=1e-6 * float(np.max(np.abs(other))))

    rows = [np.column_stack([off, MODEL.sensitivities(one.conditions)[1]]) for off, one in
            zip(left(MODEL), fitted, strict=True)]  # fmt: skip
    expected = products(rows, MODEL)
    alike(likelihood.normal(MODEL), expected)
    assert likelihood.cost(MODEL) == pytest.approx(expected[0], rel=1e-6)
    theta = MODEL.theta + np.array([-0.05, 0.02, 0.04])
    moved = MODEL.at(theta)
    likelihood.cost(moved)
    by = theta - MODEL.theta
    weighed = np.diag(expected[2]) * by
    renewed = []
    for row, off in zip(rows, left(moved), strict=True):
        slopes = row[:, 1:] + np.outer(row[:, 0] - off - row[:, 1:] @ by, weighed) / float(weighed @ by)
        assert slopes @ by == pytest.approx(row[:, 0] - off)  # what the step did
        renewed.append(np.column_stack([off, slopes]))
    alike(likelihood.broyden_normal(moved, by), products(renewed, moved))
    # Slopes of a model that was judged begin with its own readings.
    likelihood.cost(moved)
    alike(likelihood.normal(moved), products([
        np.column_stack([off, moved.sensitivities(one.conditions)[1]]) for off, one in
        zip(left(moved), fitted, strict=True)
    ], moved))  # fmt: skip


def test_the_slopes_are_those_of_the_cost_with_what_each_recording_brought_along() -> None:
    fitted = [one for one in _sessions() if one.fitted.any()]
    sessions = [replace(one, reading=one.reading + 0.2 * np.exp(-0.25 * one.conditions.time_s)) for one in fitted]
    likelihood = Likelihood(sessions, 0.03, MODEL, STANDARD)
    _, pull, _ = likelihood.normal(MODEL)
    for k, value in enumerate(MODEL.theta):
        step = np.zeros(3)
        step[k] = 1e-4 * value
        higher, lower = (likelihood.cost(MODEL.at(MODEL.theta + way * step)) for way in (1.0, -1.0))
        assert pull[k] == pytest.approx(-0.25 * (higher - lower) / step[k], rel=5e-3)


def test_a_fit_that_only_tells_how_much_better_another_is_ends_when_that_is_known_to_a_hundredth() -> None:
    sessions = _sessions()
    likelihood = Likelihood(sessions, 0.03, MODEL, STANDARD)
    far = MODEL.at(MODEL.theta * np.array([2.0, 0.1, 10.0]))
    taken: list[float] = []
    cost = likelihood.cost
    likelihood.cost = lambda model: taken.append(cost(model)) or taken[-1]  # type: ignore[method-assign, func-returns-value]
    best = fit(likelihood, far)
    exactly = len(taken)
    taken.clear()
    much_better = best.cost - 1e4 * (cost(far) - best.cost)
    assert fit(likelihood, far, best_cost=much_better).cost > best.cost
    assert len(taken) == 1 < exactly  # nothing that it could gain would matter
    taken.clear()
    near = fit(likelihood, far, best_cost=best.cost)
    assert len(taken) <= exactly
    assert near.cost - best.cost < 0.02 * (cost(far) - best.cost) + 0.1


def test_a_fit_of_no_steps_is_where_it_begins_within_its_bounds() -> None:
    likelihood = Likelihood(_sessions(), 0.03, MODEL, STANDARD)
    start = MODEL.with_part("linear_leak", np.array([-0.5]))
    found = fit(likelihood, start, 0)
    assert found.model.theta == pytest.approx([*MODEL.theta, 0.0])
    assert found.cost == pytest.approx(likelihood.cost(found.model))
    one = fit(likelihood, MODEL, 1)
    assert one.cost < likelihood.cost(MODEL)
    last = fit(likelihood, MODEL)
    assert last.cost < likelihood.cost(MODEL.at(MODEL.theta * np.array([0.9, 1.0, 1.0])))
    # At its end no step is better by one of -2 log likelihood; the covariance is that of the slopes there.
    cost, pull, normal = likelihood.normal(last.model)
    assert last.cost == pytest.approx(cost)
    scale = np.where([True, False, True], last.model.theta, 1.0)
    inner = np.linalg.inv(normal * np.outer(scale, scale))
    assert float(pull * scale @ inner @ (pull * scale)) < 1.0
    assert last.covariance == pytest.approx(inner * np.outer(scale, scale), rel=1e-4)


# -- evidence ---------------------------------------------------------------------------------------------------------
def test_a_factor_of_what_rounding_has_made_indefinite_is_nearly_its_own() -> None:
    definite = np.array([[4.0, 2.0], [2.0, 5.0]])
    found = _factor(definite.copy())
    assert found == pytest.approx(np.array([[2.0, 0.0], [1.0, 2.0]]))
    rounded = np.array([[1.0, 1.0], [1.0, 1.0 - 1e-12]])
    root = _factor(rounded.copy())
    assert root @ root.T == pytest.approx(rounded, abs=3e-9)
    assert root[0, 1] == 0.0


def test_the_direction_of_several_strengths_is_of_unit_length() -> None:
    gram = np.diag([1.0, 10.0, 1e4, 4e4])
    known: Any = SimpleNamespace(gram=gram, linearisation=SimpleNamespace(baseline_count=1), thresholds=STANDARD)
    assert Evidence._direction(known, [2, 3]) == pytest.approx([math.sqrt(0.5)] * 2)  # nothing is asked for
    gram[0, 1:] = gram[1:, 0] = [3.0, 50.0, 60.0]
    wide = 1.0 / STANDARD.strength_sd**2
    asked = np.array([50.0 / (1e4 + wide), 60.0 / (4e4 + wide)])
    assert Evidence._direction(known, [2, 3]) == pytest.approx(asked / np.linalg.norm(asked))


def test_departures_are_as_wide_as_their_members_strengths_and_never_nothing() -> None:
    candidates = [SimpleNamespace(columns=(4,)), SimpleNamespace(columns=(5, 6)), SimpleNamespace(columns=(7,))]
    known: Any = SimpleNamespace(
        linearisation=SimpleNamespace(candidates=candidates), thresholds=STANDARD, _directions=9,
        _departures_of=lambda members: [range(20 + 9 * one, 29 + 9 * one) for one in members],
    )  # fmt: skip
    index, sds = Evidence._columns_and_sds(known, (0, 1), None)
    assert (list(index), list(sds)) == ([4, 5, 6], [0.03] * 3)
    index, sds = Evidence._columns_and_sds(known, (1, 2), [np.array([0.03, -0.04]), np.zeros(1)])
    assert list(index) == [5, 6, 7, *range(29, 47)]
    assert list(sds) == pytest.approx([0.03] * 3 + [0.25 / 3.0 * 0.05] * 9 + [1e-7] * 9)
    visible: Any = SimpleNamespace(raw=np.diag([0.0, 4.0, -9.0]))
    assert Evidence.visible_rms(visible, (1,), np.array([3.0])) == pytest.approx(6.0)
    assert Evidence.visible_rms(visible, (2,), np.array([3.0])) == 0.0


# -- the way of a fit -------------------------------------------------------------------------------------------------
class _Slope:
    """A model of one number, and a likelihood (1 - x)^2 ``scale`` whose slopes tell of ``told`` times the curvature."""

    def __init__(self, x: float, parameter: Any = None, owner: str = "baseline") -> None:
        self.theta = np.array([x])
        self.parameters = [(owner, parameter or _parameter(None, -1e9, 1e9))]

    def at(self, theta: Array) -> _Slope:
        return _Slope(float(theta[0]), *reversed(self.parameters[0]))


class _Told:
    def __init__(self, told: float = 1.0, scale: float = 1e6) -> None:
        self.told, self.scale = told, scale
        self.asked: list[tuple[str, float]] = []

    def cost(self, model: _Slope) -> float:
        return self.scale * float((1.0 - model.theta[0]) ** 2)

    def normal(self, model: _Slope, rows: object = None) -> tuple[float, Array, Array]:
        self.asked.append(("anew", float(model.theta[0])))
        return self._products(model)

    def broyden_normal(self, model: _Slope, step: Array) -> tuple[float, Array, Array]:
        self.asked.append(("renewed", float(step[0])))
        return self._products(model)

    def _products(self, model: _Slope) -> tuple[float, Array, Array]:
        right = self.scale * (1.0 - model.theta)
        return self.cost(model), right, self.told * self.scale * np.eye(1)


def _went(told: _Told, steps: int, start: _Slope | None = None) -> float:
    found: Any = fit(told, start or _Slope(0.0), steps)  # type: ignore[arg-type]
    return float(found.model.theta[0])


def test_a_step_that_overshoots_is_damped_tenfold_until_it_gains() -> None:
    """From 1e-4 on six times; what has gained is damped a tenth as much in the next step."""
    assert _went(_Told(1.0), 1) == pytest.approx(1.0 / 1.0001, rel=1e-9)
    assert _went(_Told(0.4), 1) == pytest.approx(1.0 / (0.4 * 2.0), rel=1e-9)  # at 1e-4 to 0.1 it overshoots
    assert _went(_Told(0.1), 1) == pytest.approx(1.0 / (0.1 * 11.0), rel=1e-9)
    assert _went(_Told(0.04), 1) == 0.0
    left = 1.0 - 1.0 / 1.1
    assert _went(_Told(0.1), 2) == pytest.approx(1.0 - left * left, rel=1e-9)
    # Of a curvature that is far too large each step goes a part of the way, damped less and less.
    rest = 1.0
    for damping in (1e-4, 1e-5, 1e-6, 1e-7, 1e-7):
        rest *= 1.0 - 1.0 / (2.0 * (1.0 + damping))
    assert _went(_Told(2.0, 1e9), 5) == pytest.approx(1.0 - rest, rel=1e-12)


def test_slopes_are_computed_anew_every_other_step_and_at_the_end() -> None:
    slowly = _Told(2.0)
    _went(slowly, 5)
    assert [way for way, _ in slowly.asked] == ["anew", "renewed", "anew", "renewed", "anew"]
    assert slowly.asked[1][1] == pytest.approx(0.5, rel=1e-3)  # what the step before did
    assert slowly.asked[3][1] == pytest.approx(0.125, rel=1e-3)
    # A fall of less than a tenth ends it, where the slopes are its own.
    for scale, asked in ((0.09, 1), (0.14, 2)):
        little = _Told(2.0, scale)  # three quarters of it at the first step
        _went(little, 9)
        assert little.asked[0] == ("anew", 0.0)
        if asked == 1:
            assert [way for way, _ in little.asked] == ["anew"]
        else:
            assert [way for way, _ in little.asked] == ["anew", "renewed", "anew"]
    ever = _Told(2.0, 1e20)
    fit(ever, _Slope(0.0))  # type: ignore[arg-type]
    assert len(ever.asked) == 25
    stuck = _Told(0.01)
    assert (_went(stuck, 9), len(stuck.asked)) == (0.0, 1)


def test_a_shape_is_drawn_to_where_it_begins() -> None:
    """One over its size squared against the data; in its logarithm one."""
    parameter = _parameter(None, -1e9, 1e9, size=0.5)
    found: Any = fit(_Told(1.0, 4.0), _Slope(0.0, parameter, "one"), 25)  # type: ignore[arg-type]
    assert float(found.model.theta[0]) == pytest.approx(0.5, abs=0.02)
    assert found.cost == pytest.approx(4.0 * 0.25 + 4.0 * 0.25, abs=0.02)
    weight = _parameter(0.25, -1e9, 1e9, prior_sd=0.5)
    held: Any = fit(_Told(1.0, 4.0), _Slope(0.9, weight, "block"), 25)  # type: ignore[arg-type]
    assert float(held.model.theta[0]) == pytest.approx(0.625, abs=0.02)
    steep = _parameter(None, 0.01, 10.0)
    risen: Any = fit(_Told(1.0, 1e8), _Slope(0.02, steep, "one"), 1)  # type: ignore[arg-type]
    assert float(risen.model.theta[0]) == pytest.approx(0.02 * math.e)  # a factor e at the most
    ended: Any = fit(_Told(1.0, 1e4), _Slope(0.5, steep, "one"), 25)  # type: ignore[arg-type]
    assert float(ended.model.theta[0]) == pytest.approx(1.0, abs=1e-3)
    assert ended.cost == pytest.approx(math.log(2.0) ** 2, abs=1e-2)
    plain: Any = fit(_Told(1.0, 4.0), _Slope(0.0), 25)  # type: ignore[arg-type]
    assert float(plain.model.theta[0]) == pytest.approx(1.0, abs=1e-3)


def test_a_fit_begins_within_its_bounds() -> None:
    inside = _parameter(None, 0.2, 0.8)
    for start, end in ((-3.0, 0.2), (5.0, 0.8), (0.5, 0.5)):
        assert _went(_Told(), 0, _Slope(start, inside)) == end
    assert _went(_Told(), 5, _Slope(0.5, inside)) == 0.8
