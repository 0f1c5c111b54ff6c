"""What a stream leaves behind, sum by sum, and what is told of it, number by number: by plain numpy and by hand."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.special import stdtrit

from smartshoe.errors import NotConvergedError, NotIdentifiableError, UsageError
from smartshoe.identification._sufficient_statistics import (
    BANK,
    GRID,
    LN_POLES,
    NEIGHBOURS,
    POLES,
    Columns,
    Projection,
    Solved,
    Sums,
    bank_weights,
    pooled,
)
from smartshoe.identification.recursive import RecursiveIdentification
from smartshoe.models import X_OVER_NRT
from smartshoe.models.first_order import lag

Array = NDArray[np.float64]
STEP = LN_POLES[1] - LN_POLES[0]


# -- the bank of poles -----------------------------------------------------------------------------------------------
@pytest.mark.parametrize("place", [-2.5, 0.0, 0.4, 11.6, 12.0, 30.3, 30.9, 31.0, 51.7, 62.5, 63.0, 64.2])
def test_weights_are_lagranges_over_the_nearest_poles(place: float) -> None:
    """They pass through the poles, and give polynomials and their slopes as they are."""
    weights, slopes = bank_weights(float(LN_POLES[0] + place * STEP))
    first = min(max(int(np.floor(place)) - NEIGHBOURS // 2 + 1, 0), POLES - NEIGHBOURS)
    used = np.arange(first, first + NEIGHBOURS)
    others = np.setdiff1d(np.arange(POLES), used)
    assert not weights[others].any()
    assert not slopes[others].any()
    nodes = [[(place - other) / (node - other) for other in used if other != node] for node in used]
    assert weights[used] == pytest.approx([float(np.prod(row)) for row in nodes], rel=1e-8, abs=1e-9)
    at = (np.arange(POLES) - place) / 10.0
    for power, slope in ((0, 0.0), (1, 1.0), (2, 0.0)):
        assert weights @ at**power == pytest.approx(0.0**power, abs=1e-6)
        assert slopes @ at**power * (10.0 * STEP) == pytest.approx(slope, abs=1e-4)


# -- sums --------------------------------------------------------------------------------------------------------------
COLUMNS = Columns.of(True, True)


def _pushed(cuts: list[int], inverse: bool, free: Columns = COLUMNS) -> tuple[Sums, Array, Array, NDArray[np.int64]]:
    rng = np.random.default_rng(5)
    u, y = 100.0 + np.cumsum(rng.standard_normal(60)), 5.0 + rng.standard_normal(60)
    y[[0, 11, 12, 40]] = np.nan
    at = np.concatenate([[0], np.cumsum(rng.integers(1, 3, 59))])
    sums = Sums(np.zeros((0, free.columns)), np.zeros(POLES))
    for first, last in pairwise([0, *sorted(cuts), 60]):
        sums.absorb(u[first:last], y[first:last], at[first:last], 0.5, free, inverse)
    return sums, u, y, at


@settings(max_examples=15, deadline=None)
@example([1, 2], False, True)
@example([1], True, False)
@given(st.lists(st.integers(0, 60), min_size=1, max_size=6), st.booleans(), st.booleans())
def test_however_it_is_cut_the_sums_are_those_of_the_whole(cuts: list[int], inverse: bool, steady: bool) -> None:
    sums, u, y, at = _pushed(cuts, inverse, Columns.of(not steady, True))
    seen = np.isfinite(y)
    time_s = 0.5 * at
    bridged = np.interp(np.arange(at[-1] + 1), at, u)
    before = np.concatenate([np.full(at[0], u[0]), bridged[at[0] :]])
    lags = np.stack([lag(before, pole, 0.5)[at] for pole in BANK], axis=1)
    starts = np.exp(-np.outer(time_s, BANK))
    table = np.column_stack([*([] if steady else [starts]), lags, u, np.ones(60), y])[seen]
    scale = np.maximum(np.sqrt(np.einsum("ij,ij->j", table, table)), 1e-12)  # a start that has faded is nothing
    gram = (table / scale).T @ (table / scale)
    assert (sums.root / scale).T @ (sums.root / scale) == pytest.approx(gram, abs=1e-9)
    load, reading = (y, u) if inverse else (u, y)
    load, reading = load[seen], reading[seen]
    assert sums.count == 56
    assert (sums.mean, sums.squares) == (
        pytest.approx(y[seen].mean()),
        pytest.approx(float(np.sum((y[seen] - y[seen].mean()) ** 2))),
    )
    assert (sums.lowest_load, sums.highest_load) == (load.min(), load.max())
    climbs = [later - one for k, one in enumerate(load) for later in load[k:]]
    assert (sums.rise, sums.fall) == (pytest.approx(max(climbs)), pytest.approx(-min(climbs)))
    assert sums.reading_ends == (reading.min(), reading.max())


def test_a_stretch_without_outputs_moves_the_lags_and_nothing_else() -> None:
    sums, _, _, at = _pushed([30], False)
    before = (sums.count, sums.mean, sums.root.copy(), sums.lags.copy())
    sums.absorb(np.array([50.0]), np.array([np.nan]), at[-1:] + 4, 0.5, COLUMNS, False)
    sums.absorb(np.zeros(0), np.zeros(0), np.zeros(0, dtype=np.int64), 0.5, COLUMNS, False)
    assert (sums.count, sums.mean) == before[:2]
    assert np.array_equal(sums.root, before[2])
    assert not np.array_equal(sums.lags, before[3])
    assert (sums.last_u, sums.last_at) == (50.0, int(at[-1]) + 4)


def test_two_sets_together_have_the_mean_and_the_squares_of_all() -> None:
    one, other = np.array([1.0, 4.0, 9.0]), np.array([-3.0, 2.0, 2.0, 8.0, 30.0])
    told = [(part.size, float(part.mean()), float(np.sum((part - part.mean()) ** 2))) for part in (one, other)]
    both = np.concatenate([one, other])
    wanted = (8, pytest.approx(both.mean()), pytest.approx(float(np.sum((both - both.mean()) ** 2))))
    assert pooled(told[0], told[1]) == wanted
    assert pooled((0, 0.0, 0.0), told[1]) == (5, pytest.approx(other.mean()), pytest.approx(told[1][2]))
    assert pooled((0, 0.0, 0.0), (0, 0.0, 0.0)) == (0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("start", "constant", "wanted"),
    [
        (True, True, (slice(0, 64), slice(64, 128), 128, 129, 131)),
        (True, False, (slice(0, 64), slice(64, 128), 128, None, 130)),
        (False, True, (None, slice(0, 64), 64, 65, 67)),
        (False, False, (None, slice(0, 64), 64, None, 66)),
    ],
)
def test_columns_are_starts_lags_input_constant_and_output(start: bool, constant: bool, wanted: tuple) -> None:  # type: ignore[type-arg]
    own = Columns.of(start, constant)
    assert (own.starts, own.lags, own.u, own.constant, own.columns) == wanted


@pytest.mark.parametrize(("start", "constant"), [(True, True), (True, False), (False, True), (False, False)])
def test_at_a_pole_the_rest_is_fitted_by_least_squares_and_slopes_are_differences(start: bool, constant: bool) -> None:
    free = Columns.of(start, constant)
    sums, u, y, at = _pushed([20], False, free)
    other = Sums(np.zeros((0, free.columns)), np.zeros(POLES))
    other.absorb(u[:30], 2.0 * y[:30] - 3.0, np.arange(30), 0.5, free, False)
    projection = Projection([sums.root, other.root], free)
    ln_alpha = -0.3
    alpha = float(np.exp(ln_alpha))
    rows = []
    for index, (values, outputs, places) in enumerate(((u, y, at), (u[:30], 2.0 * y[:30] - 3.0, np.arange(30)))):
        bridged = np.interp(np.arange(places[-1] + 1), places, values)
        w = lag(bridged, alpha, 0.5)[places]
        own = np.zeros((values.size, 3 + 2 * constant + 2 * start))
        own[:, 0], own[:, 1], own[:, -1] = values - w, w, outputs
        if constant:
            own[:, 2 + index] = 1.0
        if start:
            own[:, 2 + 2 * constant + index] = np.exp(-alpha * 0.5 * places)
        rows.append(own[np.isfinite(outputs)])
    table = np.concatenate(rows)
    fitted, (left,), *_ = np.linalg.lstsq(table[:, :-1], table[:, -1], rcond=None)
    theta, error, jacobian = projection.solve(ln_alpha)
    assert theta == pytest.approx(np.concatenate([[ln_alpha], fitted]), rel=1e-5, abs=1e-6)
    assert float(error @ error) == pytest.approx(left, rel=1e-6)
    assert jacobian.T @ error == pytest.approx(np.r_[projection.slope(ln_alpha), np.zeros(fitted.size)], abs=1e-5)
    costs = [float(np.sum(projection.solve(ln_alpha + by)[1] ** 2)) for by in (1e-4, -1e-4)]
    assert projection.slope(ln_alpha) == pytest.approx((costs[0] - costs[1]) / 4e-4, rel=1e-3, abs=1e-5)
    assert projection.size == 3 + 2 * constant + 2 * start


class _Course(Projection):
    """A cost of ln alpha alone, by a formula."""

    def __init__(self, cost: Any, slope: Any) -> None:
        self.cost, self.half_slope, self.size = cost, slope, 1

    def solve(self, ln_alpha: float) -> tuple[Array, Array, Array]:
        return np.array([ln_alpha]), np.array([np.sqrt(self.cost(ln_alpha))]), np.eye(1)

    def slope(self, ln_alpha: float) -> float:
        return float(0.5 * self.half_slope(ln_alpha))


@pytest.mark.parametrize("least", [-4.0, -0.05, 0.1, 5.0, float(GRID[7]), float(GRID[-2])])
@pytest.mark.parametrize("size", [1e-3, 1.0, 1e4])
def test_the_least_cost_is_found_wherever_it_lies(least: float, size: float) -> None:
    found = _Course(lambda x: size * (1.0 + (x - least) ** 2), lambda x: size * 2.0 * (x - least)).minimise("here")
    assert found.theta == pytest.approx([least], abs=1e-9)
    assert found.cost == pytest.approx(size)
    assert found.iterations >= GRID.size


@pytest.mark.parametrize(("sign", "end"), [(1.0, GRID[0]), (-1.0, GRID[-1])])
def test_a_cost_that_falls_towards_an_end_of_the_bank_is_least_there(sign: float, end: float) -> None:
    found = _Course(lambda x: 20.0 + sign * x, lambda _: sign).minimise("here")
    assert found.theta.tolist() == [end]


@pytest.mark.parametrize("size", [1e-3, 10.0])
def test_a_hump_beside_the_least_is_stepped_over(size: float) -> None:
    """At both neighbours in the grid the cost rises; the least lies between them, behind a hump."""
    far, near = float(GRID[9]), float(GRID[10])
    turn = 2.0 * np.pi / (near - far)

    def cost(x: float) -> float:
        wave = np.sin(turn * (x - far) + 0.2) - 0.01 * (x - far)
        return size * (3.0 + wave + 40.0 * max(far - x, x - near, 0.0))

    def slope(x: float) -> float:
        outside = -40.0 if x < far else 40.0 if x > near else 0.0
        return float(size * (turn * np.cos(turn * (x - far) + 0.2) - 0.01 + outside))

    found = _Course(cost, slope).minimise("here")
    assert found.theta == pytest.approx([far + (1.5 * np.pi - 0.2) / turn], abs=1e-3)


def test_a_slope_that_never_turns_is_no_least() -> None:
    with pytest.raises(NotConvergedError, match="no least value"):
        _Course(lambda x: 1.0 + (x - 1.0) ** 2, lambda _: 1.0).minimise("here")


# -- what is told, by hand -------------------------------------------------------------------------------------------
THETA = np.array([np.log(0.25), 1.6, 1.5, 12.0, -3.0, 0.7, -0.4])
SD = np.array([0.02, 0.003, 0.005, 0.3, 0.4, 0.05, 0.06])
COST = 30.0


def _covariance(sd: Array) -> Array:
    sign = np.where(np.arange(sd.size) % 2, -1.0, 1.0)
    return np.asarray(np.outer(sd, sd) * (0.6 * np.outer(sign, sign) + 0.4 * np.eye(sd.size)))


def _told(monkeypatch: pytest.MonkeyPatch, theta: Array, covariance: Array, cost: float, **choices: Any) -> Any:
    """The estimate of two experiments of 30 and 40 samples, had the least cost been at ``theta``."""
    session = RecursiveIdentification(sample_rate_hz=100.0, unit="toe", scale=2.0, **choices)
    rng = np.random.default_rng(1)
    for name, count in (("a", 30), ("b", 40)):
        session.start_experiment(name)
        load = 100.0 * rng.random(count)
        load[3] = np.nan
        session.push(load, rng.random(count))
    degrees = 68 - theta.size
    factor = np.linalg.cholesky(np.linalg.inv(covariance) * cost / degrees).T

    class Fixed(Projection):
        def minimise(self, where: str) -> Solved:
            assert where == "toe"
            return Solved(theta, factor, cost, 17)

    monkeypatch.setattr("smartshoe.identification.recursive.Projection", Fixed)
    return session.estimate()


def _spread(slopes: dict[int, float], covariance: Array) -> float:
    along = np.zeros(len(covariance))
    along[list(slopes)] = list(slopes.values())
    return float(np.sqrt(along @ covariance @ along))


def test_what_a_stream_tells_follows_from_its_theta(monkeypatch: pytest.MonkeyPatch) -> None:
    covariance, quantile, half = _covariance(SD), float(stdtrit(61, 0.975)), 0.5 / X_OVER_NRT
    found = _told(monkeypatch, THETA, covariance, COST)
    k2 = 0.1 * half
    wanted = {
        "a1": (0.25, {0: 0.25}),
        "b0": (1.6, {1: 1.0}),
        "b1": (0.375, {0: 0.375, 2: 0.25}),
        "k1": (-0.25 / X_OVER_NRT, {2: half}),
        "k2": (k2, {1: half, 2: -half}),
        "c": (4.0 * k2, {0: -4.0 * k2, 1: 4.0 * half, 2: -4.0 * half}),
    }
    for name, (value, slopes) in wanted.items():
        one, own = found.parameters[name], _spread(slopes, covariance)
        assert (one.value, one.sd) == (pytest.approx(value), pytest.approx(own, rel=1e-6)), name
        assert one.ci95 == pytest.approx((value - quantile * own, value + quantile * own)), name
    assert [one.unit for one in found.parameters.values()] == ["1/s", "N/mbar", "N/(mbar s)", "1", "1", "s"]
    for name, place, constant, state in (("a", 3, 12.0, 0.7), ("b", 4, -3.0, -0.4)):
        zero, start = found.offsets[name], found.initial_states[name]
        assert zero.value == pytest.approx(-constant / 1.5)
        assert zero.sd == pytest.approx(_spread({place: -1.0 / 1.5, 2: constant / 1.5**2}, covariance))
        assert (start.value, start.sd, start.unit) == (state, pytest.approx(SD[place + 2]), "N")
        assert start.ci95[1] - state == pytest.approx(quantile * start.sd)
        assert zero.ci95[1] - zero.value == pytest.approx(quantile * zero.sd)
    assert (found.n_samples, found.n_missing, found.iterations, found.delay_s) == (68, 2, 17, 0.0)
    assert found.rmse == pytest.approx(np.sqrt(COST / 68.0))
    assert (found.rmse_unit, found.unit, found.direction) == ("N", "toe", "inverse")
    rng = np.random.default_rng(1)
    loads = [100.0 * rng.random(30), rng.random(30), 100.0 * rng.random(40)]
    every = np.concatenate([np.delete(loads[0], 3), np.delete(loads[2], 3)])
    spread = float(np.sum((every - every.mean()) ** 2))
    assert found.fit_percent == pytest.approx(100.0 * (1.0 - np.sqrt(COST / spread)))
    assert found.compensator(50.0).offset == pytest.approx(-4.5 / 1.5)


def test_forward_the_constant_is_the_readings_and_what_is_given_is_told_as_it_is(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    theta = np.array([np.log(0.25), 0.6, 0.5, 12.0, -3.0, 0.7, -0.4])
    covariance = _covariance(0.1 * SD)
    found = _told(monkeypatch, theta, covariance, 0.5, direction="forward")
    assert (found.offsets["b"].value, found.offsets["b"].sd) == (-3.0, pytest.approx(0.04))
    assert (found.rmse_unit, found.initial_states["a"].unit) == ("mbar", "mbar")
    known = _told(monkeypatch, theta[:3], covariance[:3, :3], 0.5, offset=4.0, initial_state="steady")
    assert (known.offsets["a"].value, known.offsets["a"].sd) == (4.0, 0.0)
    state = known.initial_states["b"]
    assert (state.value, state.sd, state.ci95) == (0.0, 0.0, (0.0, 0.0))


def _refused(monkeypatch: pytest.MonkeyPatch, says: str, **changes: Any) -> None:
    theta, sd = changes.pop("theta", THETA), changes.pop("sd", SD)
    covariance = np.diag(sd**2)
    if not says:
        assert _told(monkeypatch, theta, covariance, changes.get("cost", COST)).unit == "toe"
        return
    with pytest.raises(NotIdentifiableError, match=says):
        _told(monkeypatch, theta, covariance, changes.get("cost", COST))


def _with(array: Array, place: int, value: float) -> Array:
    changed = array.copy()
    changed[place] = value
    return changed


def test_what_a_stream_leaves_open_is_refused_beyond_its_bound(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(1)
    loads = [100.0 * rng.random(30), rng.random(30), 100.0 * rng.random(40)]
    every = np.concatenate([np.delete(loads[0], 3), np.delete(loads[2], 3)])
    half = 0.5 * float(np.sum((every - every.mean()) ** 2))
    # A fifth of the static gain of 1.5 is 0.3; the pole's own size is an sd of 1 of its logarithm.
    _refused(monkeypatch, "does not follow", cost=1.01 * half, sd=_with(SD, 2, 0.301))
    _refused(monkeypatch, "", cost=1.01 * half, sd=_with(SD, 2, 0.299))
    _refused(monkeypatch, "", cost=0.99 * half, sd=_with(SD, 2, 0.301))
    _refused(monkeypatch, "relaxation", sd=_with(SD, 0, 1.001))
    _refused(monkeypatch, "", sd=_with(SD, 0, 0.999))
    _refused(monkeypatch, "", sd=_with(SD, 1, 1.9))
    # Gains of a hundredth, of which a fifth is far less than of one.
    small = _with(_with(THETA, 1, 0.016), 2, 0.015)
    _refused(monkeypatch, "does not follow", theta=small, cost=1.01 * half, sd=_with(0.01 * SD, 2, 0.00301))
    _refused(monkeypatch, "", theta=small, cost=1.01 * half, sd=_with(0.01 * SD, 2, 0.00299))
    for end, inwards in ((LN_POLES[-1], 1.0), (LN_POLES[0], -1.0)):
        _refused(monkeypatch, "relaxation", theta=_with(THETA, 0, end + inwards * 0.9e-6))
        _refused(monkeypatch, "", theta=_with(THETA, 0, end + inwards * 1.1e-6))


def _sums(**changes: Any) -> Sums:
    values = {
        "count": 20, "lowest_load": 0.0, "highest_load": 100.0, "rise": 80.0, "fall": 80.0, "reading_ends": (2.0, 9.0)
    } | changes  # fmt: skip
    return Sums(np.zeros((0, 1)), np.zeros(POLES), **values)


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({}, ""),
        ({"count": 19}, "19 samples"),
        ({"rise": 9.9}, "has not risen"),
        ({"fall": 9.9}, "has not fallen again"),
        ({"rise": 10.0}, ""),
        ({"fall": 10.0, "rise": 10.0}, ""),
        ({"rise": 5.0, "fall": 5.0}, "has not risen"),
        ({"lowest_load": 1e6, "highest_load": 1e6 + 0.9e-6}, "load is constant"),
        ({"lowest_load": 1e6, "highest_load": 1e6 + 1.5e-6}, ""),
        ({"reading_ends": (-1e6 - 0.9e-6, -1e6)}, "reading is constant"),
        ({"reading_ends": (-1e6 - 1.5e-6, -1e6)}, ""),
        ({"reading_ends": (0.0, 0.0)}, "reading is constant"),
        # A load of 900 to 1000 that travelled 50 of its 100 both ways.
        ({"lowest_load": 900.0, "highest_load": 1000.0, "rise": 50.0, "fall": 50.0}, ""),
    ],
)
def test_what_sums_lack_is_named_at_its_bound(changes: dict[str, Any], says: str) -> None:
    session = RecursiveIdentification(sample_rate_hz=100.0)
    if says:
        with pytest.raises(NotIdentifiableError, match=says):
            session._require_identifiable([_sums(**changes)])
    else:
        session._require_identifiable([_sums(**changes)])


def test_names_shapes_and_memory_of_a_stream() -> None:
    session = RecursiveIdentification(sample_rate_hz=100.0)
    held = session.state_bytes
    assert held == 3 * 1024 * 8 + POLES * 8
    session.start_experiment("experiment 1")  # nothing has been seen under that name
    session.push([1.0, 2.0], [1.0, 2.0])
    with pytest.raises(UsageError, match="already"):
        session.start_experiment("experiment 1")
    session.start_experiment("second")
    assert session.state_bytes == held + 2 * COLUMNS.columns * 8 + POLES * 8
    with pytest.raises(UsageError, match="already"):
        session.start_experiment("experiment 1")
    for load, reading in ((np.ones((2, 2)), np.ones((2, 2))), (np.ones(2), np.ones(3)), (1.0, np.ones(2))):
        with pytest.raises(UsageError, match="shape"):
            session.push(load, reading)
