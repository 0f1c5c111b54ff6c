"""The evidence of sets among a few columns, against Gaussian densities whose every matrix is written out."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from told_evidence import STANDARD, session_of, taken_for_exact

from smartshoe.diagnosis._evidence import Evidence, _factor
from smartshoe.diagnosis._sensitivity import Linearised, departures, nuisance_precision
from smartshoe.models.extended import ExtendedModel

Array = NDArray[np.float64]

MODEL = ExtendedModel(1.1, 0.1, 0.3, 800.0, 140.0, "mbar")
SD = 0.02
MATERIAL, STRENGTH, DEPARTURE = STANDARD.imperfection, STANDARD.strength_sd, STANDARD.departure
COLUMNS = ((3,), (4, 5), (6,), (7,))  # beside the target, of two own columns
NAMES = ("one", "two", "three", "one")
FAMILIES = {"one": "kind", "two": "kind", "three": "another"}
OTHERS = ([4, 5], [3, 7], [], [4, 5])  # columns of the families' other equations


def _given(slots: Mapping[str, str] = FAMILIES) -> Linearised:
    rng = np.random.default_rng(2)
    sessions, rows = [], []
    for size in (70, 50):
        load = np.interp(np.arange(size), np.linspace(0, size, 9), rng.uniform(0.0, 1.0, 9))
        sessions.append(session_of(load, rng.random(size) < 0.85))
        columns = np.cumsum(rng.standard_normal((size, 7)), axis=0)
        columns /= np.sqrt(np.mean(columns**2, axis=0))
        target = columns @ np.array([0.4, -0.3, 0.05, 0.02, -0.03, 0.0, 0.01]) + SD * rng.standard_normal(size) + 0.2
        rows.append(np.column_stack([target, columns]))
    candidates: Any = tuple(
        SimpleNamespace(name=n, columns=c, slot=slots[n], effect=SimpleNamespace(family=FAMILIES[n], why_unnamed=""))
        for n, c in zip(NAMES, COLUMNS, strict=True)
    )
    return Linearised(MODEL, tuple(sessions), tuple(rows), np.ones(8), 2, candidates, STANDARD)


class _Twin:
    """Precision of each session's samples with its offset and past unknown; all columns beside each other."""

    def __init__(self, given: Linearised) -> None:
        self.given = given
        blocks, pasts = [], []
        for session in given.sessions:
            kept = session.fitted
            past = np.array([[1.0, math.exp(-MODEL.pole_per_s * at)] for at in session.conditions.time_s])
            seen = past[kept]
            inner = seen.T @ seen / SD**2 + nuisance_precision(session, MODEL)
            blocks.append(np.eye(kept.sum()) / SD**2 - seen @ np.linalg.solve(inner, seen.T) / SD**4)
            pasts.append(past)
        size = sum(one.shape[0] for one in blocks)
        self.weight, first = np.zeros((size, size)), 0
        for one in blocks:
            last = first + one.shape[0]
            self.weight[first:last, first:last] = one
            first = last
        self.pasts = pasts
        self.rows = self.seen(list(given.rows))
        self.y, self.z = self.rows[:, 0], self.rows[:, 1:]

    def seen(self, signals: list[Array]) -> Array:
        return np.concatenate([one[s.fitted] for one, s in zip(signals, self.given.sessions, strict=True)])

    def signature(self, column: Array) -> list[Array]:
        """A column (rows' numbers weighed) less what own columns and each recording's nuisances follow of it."""
        given = self.given
        wide = np.zeros((self.y.size, 4))
        first = 0
        for k, (session, past) in enumerate(zip(given.sessions, self.pasts, strict=True)):
            count = int(session.fitted.sum())
            wide[first : first + count, 2 * k : 2 * k + 2] = past[session.fitted]
            first += count
        found = np.linalg.lstsq(np.column_stack([self.rows[:, 1:3], wide]), self.rows @ column, rcond=None)[0]
        return [
            rows @ column - rows[:, 1:3] @ found[:2] - past @ found[2 + 2 * k : 4 + 2 * k]
            for k, (rows, past) in enumerate(zip(given.rows, self.pasts, strict=True))
        ]

    def departing(self, column: Array) -> list[Array]:
        """What equations depart in: what can be seen of the effect."""
        return self.signature(column)

    def direction(self, columns: tuple[int, ...]) -> Array:
        weights = np.zeros(8)
        if len(columns) == 1:
            weights[list(columns)] = 1.0
            return weights
        index = [1, 2, *columns]
        part = self.rows[:, index].T @ self.weight @ self.rows[:, index]
        part += np.diag([1.0, 1.0] + [STRENGTH**-2] * len(columns))
        asked = np.linalg.solve(part, self.rows[:, index].T @ self.weight @ self.y)[2:]
        weights[list(columns)] = asked / np.linalg.norm(asked)
        return weights

    def solved(
        self,
        members: tuple[int, ...],
        amounts: dict[int, float] | None,
        exact: tuple[int, ...] = (),
        of_any_law: bool = False,
    ) -> tuple[float, dict[int, Array], dict[int, float]]:
        """-2 log density but for a constant; members' strengths beyond what is immaterial; departures' rms."""
        variances = np.concatenate([[1.0, 1.0], np.full(5, MATERIAL**2)])
        columns, spans = [self.z], {}
        for member in (*members, *exact):
            columns.append(self.rows[:, list(COLUMNS[member])])
            spans[member] = slice(variances.size, variances.size + len(COLUMNS[member]))
            variances = np.append(variances, np.full(len(COLUMNS[member]), STRENGTH**2))
        departure_sds = {}
        for member in members if amounts is not None else ():
            made = self.seen(departures(self.given, self.departing(self.direction(COLUMNS[member]))))
            departure_sds[member] = slice(variances.size, variances.size + made.shape[1])
            assert amounts is not None
            sd = max(DEPARTURE * amounts[member] / math.sqrt(made.shape[1]), 1e-7)
            columns.append(made)
            variances = np.append(variances, np.full(made.shape[1], sd**2))
            if of_any_law and OTHERS[member]:
                count = len(OTHERS[member])
                columns.append(self.rows[:, OTHERS[member]])
                variances = np.append(variances, np.full(count, (DEPARTURE * amounts[member]) ** 2 / count))
        whole = np.column_stack(columns) * np.sqrt(variances)
        inner = np.eye(whole.shape[1]) + whole.T @ self.weight @ whole
        asked = whole.T @ self.weight @ self.y
        pull = np.linalg.solve(inner, asked)
        score = float(self.y @ self.weight @ self.y - asked @ pull + np.linalg.slogdet(inner)[1])
        strengths = {m: pull[at] * STRENGTH for m, at in spans.items()}
        return score, strengths, {m: float(np.sqrt(np.mean(pull[at] ** 2))) for m, at in departure_sds.items()}

    def posterior(
        self, members: tuple[int, ...], of_any_law: bool = False
    ) -> tuple[float, dict[int, Array], dict[int, float]]:
        found = self.solved(members, None)
        for _ in range(2):
            amounts = {m: float(np.linalg.norm(s)) for m, s in found[1].items()}
            found = self.solved(members, amounts, of_any_law=of_any_law)
        return found

    def visible(self, members: tuple[int, ...], strengths: dict[int, Array]) -> float:
        weights = np.zeros(8)
        for member in members:
            weights[list(COLUMNS[member])] += strengths[member]
        return float(np.sqrt(np.mean(self.seen(self.signature(weights)) ** 2)))


class _TwinOfWholeEffects(_Twin):
    """All that an effect adds is what its equation departs in."""

    def departing(self, column: Array) -> list[Array]:
        return [rows @ column for rows in self.given.rows]


@pytest.fixture(scope="module")
def given() -> Linearised:
    return _given()


@pytest.fixture(scope="module")
def twin(given: Linearised) -> _Twin:
    return _Twin(given)


ODDS = 2.0 * math.log(3 / STANDARD.false_name)  # of three effects
SHAPES = (2.0 * math.log(2.0), 0.0, 0.0, 2.0 * math.log(2.0))  # "one" stands at two


@pytest.mark.parametrize("members", [(), (0,), (1,), (2, 3), (0, 1), (0, 1, 2, 3)])
def test_a_sets_evidence_is_that_of_its_density_to_the_digit(
    given: Linearised, twin: _Twin, members: tuple[int, ...]
) -> None:
    evidence = Evidence(given, SD)
    odds = sum(ODDS + SHAPES[m] for m in members)
    exact, plain = taken_for_exact(evidence, members), twin.solved(members, None)
    assert exact.score - odds == pytest.approx(plain[0], rel=1e-7)
    for member, strengths in zip(members, exact.strengths, strict=True):
        assert strengths == pytest.approx(plain[1][member], rel=1e-5)
    found, slow = evidence.posterior(members), twin.posterior(members)
    wider, slow_wider = evidence.posterior(members, of_any_law=True), twin.posterior(members, of_any_law=True)
    assert wider.score - odds == pytest.approx(slow_wider[0], rel=1e-6)
    assert wider.departure_sds == pytest.approx([slow_wider[2][m] for m in members], rel=1e-4)
    assert found.score - odds == pytest.approx(slow[0], rel=1e-6)
    assert found.members == members
    for k, member in enumerate(members):
        assert found.strengths[k] == pytest.approx(slow[1][member], rel=1e-4)
        assert found.departure_sds[k] == pytest.approx(slow[2][member], rel=1e-4)
        assert found.sizes[k] == pytest.approx(twin.visible((member,), slow[1]), rel=1e-4)
    if members:
        assert found.together == pytest.approx(twin.visible(members, slow[1]), rel=1e-4)
        assert exact.departure_sds == (0.0,) * len(members)


@pytest.mark.parametrize("members", [(), (0,), (1,), (0, 2), (0, 1, 2)])
def test_of_whole_effects_the_evidence_is_that_of_its_density_too(given: Linearised, members: tuple[int, ...]) -> None:
    found = Evidence(given, SD).of_whole_effects.posterior(members)
    score, strengths, departure_sds = _TwinOfWholeEffects(given).posterior(members)
    assert found.score - sum(ODDS + SHAPES[m] for m in members) == pytest.approx(score, rel=1e-6)
    for k, member in enumerate(members):
        assert found.strengths[k] == pytest.approx(strengths[member], rel=1e-4)
        assert found.departure_sds[k] == pytest.approx(departure_sds[member], rel=1e-4)


def test_a_curve_that_a_gain_leaves_where_it_grows_more_at_high_loads_is_no_evidence(given: Linearised) -> None:
    """The gain is the baseline's, and with it went what a curve departs from."""
    rng = np.random.default_rng(6)
    rows = [one.copy() for one in given.rows]
    for one, session in zip(rows, given.sessions, strict=True):
        load, time_s = session.conditions.load, session.conditions.time_s
        grown = load * (1.0 + 0.3 * time_s / time_s[-1])
        one[:, 1], one[:, 3], one[:, 6] = load, grown, load**2
        one[:, 0] = 0.06 * grown * (1.0 + 0.1 * (2.0 * load - 1.0)) + 0.0002 * rng.standard_normal(load.size)
    evidence = Evidence(replace(given, rows=tuple(rows)), 0.0002)

    def margin(of: Evidence) -> float:
        alone, beside = (of.posterior(members).score for members in ((0,), (0, 2)))
        return alone - beside

    assert margin(evidence) > 50.0
    assert margin(evidence.of_whole_effects) < 0.0


def test_a_companion_that_another_law_of_its_neighbours_kind_would_be_is_no_evidence(given: Linearised) -> None:
    """An effect that goes a fifth of its size towards the other law of its kind, which an effect of no such kind is."""
    rng = np.random.default_rng(5)
    rows = [one.copy() for one in given.rows]
    for one in rows:
        one[:, 6] = one[:, 4] + 0.02 * rng.standard_normal(one.shape[0])
        one[:, 0] = 0.06 * one[:, 3] + 0.012 * one[:, 4] + 0.002 * rng.standard_normal(one.shape[0])
    evidence = Evidence(replace(given, rows=tuple(rows)), 0.002)

    def margin(of_any_law: bool) -> float:
        alone, beside = (evidence.posterior(m, of_any_law=of_any_law).score for m in ((0,), (0, 2)))
        return alone - beside

    assert margin(of_any_law=False) > 50.0
    assert margin(of_any_law=True) < 0.0
    # One in a direction of its own is needed all the same.
    for one, plain in zip(rows, given.rows, strict=True):
        one[:, 6] = plain[:, 6]
        one[:, 0] += 0.012 * (one[:, 6] - one[:, 4])
    evidence = Evidence(replace(given, rows=tuple(rows)), 0.002)
    assert margin(of_any_law=True) > 50.0


# -- factors --------------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("rows", [1, 3, 12])
def test_a_factor_is_choleskys(rows: int) -> None:
    made = np.random.default_rng(rows).standard_normal((rows, rows + 3))
    matrix = made @ made.T
    found = _factor(matrix.copy())
    assert found == pytest.approx(np.linalg.cholesky(matrix), rel=1e-9)
    assert _factor(np.zeros((0, 0))).shape == (0, 0)


@pytest.mark.parametrize("scale", [1.0, 1e12, 1e-12])
@pytest.mark.parametrize("below", [0.0, 1e-17, 1e-15, 1e-12, 1e-9])
def test_where_rounding_made_it_indefinite_there_is_a_factor_of_as_much_as_is_needed_more(
    scale: float, below: float
) -> None:
    """A matrix of rank two that falls short by a share of its largest element: by no more than ten times that."""
    made = np.random.default_rng(5).standard_normal((2, 9))
    exact = scale * made.T @ made
    largest = float(np.max(np.diag(exact)))
    matrix = exact - below * largest * np.eye(9)
    found = _factor(matrix.copy())
    assert np.isfinite(found).all()
    assert np.array_equal(found, np.tril(found))
    assert (np.diag(found) > 0.0).all()
    more = found @ found.T - matrix
    assert np.abs(more - np.diag(np.diag(more))).max() < 1e-13 * largest  # nothing beside the diagonal
    assert 0.0 <= np.diag(more).max() <= max(12.0 * below, 2e-13) * largest
    # What is determined is what it was: along its two directions it solves as before.
    asked = made[0]
    solved = np.linalg.solve(found.T, np.linalg.solve(found, exact @ asked))
    assert made @ solved == pytest.approx(made @ asked, rel=1e-4)


def test_a_matrix_of_no_numbers_ends_and_a_diagonal_of_small_and_large_keeps_the_small() -> None:
    assert _factor(np.full((3, 3), np.nan)).shape == (3, 3)
    wide = np.diag([1e12, 1.0, 1e-6])
    assert np.diag(_factor(wide.copy())) == pytest.approx([1e6, 1.0, 1e-3])


def test_members_are_a_set_in_any_order_and_known_once(given: Linearised) -> None:
    evidence = Evidence(given, SD)
    assert evidence.posterior((2, 0)) is evidence.posterior((0, 2))
    fresh = Evidence(given, SD).posterior((0, 2))
    # Whatever was asked before, and in whichever order its departures were made.
    turned = Evidence(given, SD)
    for members in ((3,), (2,), (1,), (0, 1, 2, 3)):
        turned.posterior(members)
    assert turned.posterior((0, 2)).score == pytest.approx(fresh.score, rel=1e-9)


@pytest.mark.parametrize("members", [(), (0,), (1, 2)])
def test_extensions_are_exact_beside_a_set_whose_equations_depart(
    given: Linearised, twin: _Twin, members: tuple[int, ...]
) -> None:
    evidence = Evidence(given, SD)
    base = twin.solved(members, None)
    amounts = {}
    for _ in range(2):
        amounts = {m: float(np.linalg.norm(s)) for m, s in base[1].items()}
        base = twin.solved(members, amounts)
    amounts = {m: float(np.linalg.norm(s)) for m, s in base[1].items()}
    told = {k: (score, strengths) for score, k, strengths in evidence.extensions(members)}
    assert set(told) == set(range(4)) - set(members)
    before = twin.solved(members, amounts)[0]
    for k, (score, strengths) in told.items():
        after, expected, _ = twin.solved(members, amounts, (k,))
        # The set's own score is that of its last round but one.
        rise = score - evidence.posterior(members).score - ODDS - SHAPES[k]
        assert rise == pytest.approx(after - before, rel=1e-5, abs=1e-5)
        assert strengths == pytest.approx(expected[k], rel=1e-4)


def test_what_is_visible_is_what_own_columns_and_nuisances_leave(given: Linearised, twin: _Twin) -> None:
    evidence = Evidence(given, SD)
    strengths = {1: np.array([0.3, -0.2])}
    assert evidence.visible_rms((4, 5), strengths[1]) == pytest.approx(twin.visible((1,), strengths), rel=1e-6)
    assert evidence.odds == pytest.approx(ODDS)


def test_an_equation_departs_towards_its_familys_others_but_those_that_may_be_beside_it() -> None:
    columns = [Evidence(_given(slots), SD)._others_of(0) for slots in (FAMILIES, {**FAMILIES, "two": "of its own"})]
    assert columns == [OTHERS[0], []]
