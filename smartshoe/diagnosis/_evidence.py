"""The evidence for a set of effects: a marginal likelihood in which no equation is taken as exact.

With the residual y of the reading, in standard deviations of the noise, and everything linear in it,

    y = X0 b + sum over all candidates x_j s_j + sum over e in S ( x_e a_e + Phi_e w_e ) + noise

* b ~ N(0, 1): changes of the baseline, anything up to full scale, so that this prior is practically flat;
* s_j ~ N(0, imperfection^2): a small imperfection of any kind may always be there, and needs no name;
* a_e ~ N(0, strength_sd^2): the strengths of the effects in S (spike and slab: George and McCulloch 1993);
* w_e ~ N(0, (departure a_e)^2 / columns): the error of e's equation, in proportion to the effect's size, in the
  directions in which equations of its kind depart (Kennedy and O'Hagan 2001).

Let C0 be the covariance of y without any effect, U the columns x_e and Phi_e of S, and D their prior variances. Then

    -2 log p(y | S) = y' C0^-1 y + log det C0 - q' D (I + R D)^-1 q + log det(I + R D),

with R = U' C0^-1 U and q = U' C0^-1 y. R and q are computed once for all columns, so that a set only costs a
factorisation of its own few columns.

Once a set is chosen, each effect is compared with nothing in its place also under two wider model errors, since a small
effect may be only the error of shape of another one. Either Phi_e is extended by the columns of all other equations of
the family (``of_any_law``), or it is built from the whole effect instead of the part that the baseline cannot follow
(``of_whole_effect``); an example of the latter is a gain that settles more at high loads, which leaves a curve. The
search uses neither: there the other equations compete themselves, and a wide model error would hide effects of other
families.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations, cycle

import numpy as np
from scipy.linalg import solve_triangular
from scipy.linalg.lapack import dpotrf, dpotrs

from smartshoe.arrays import Array, Index
from smartshoe.diagnosis._sensitivity import (
    Linearised,
    cosines,
    departures,
    directions,
    nuisance_precision,
    ridged,
    rows_where,
)
from smartshoe.diagnosis._step_columns import StepColumns

Members = tuple[int, ...]


@dataclass(frozen=True, eq=False)
class Posterior:
    """A set of effects with its score and its estimates.

    ``score`` is -2 log of evidence times prior odds, so that lower is better. ``strengths`` are (k,) for each member,
    ``sizes`` the rms by which each moves the reading beyond what the baseline absorbs, ``together`` that of all
    members. ``departure_sds`` is each member's fitted departure, rms in standard deviations of its prior.
    """

    members: Members
    score: float
    strengths: tuple[Array, ...]
    sizes: tuple[float, ...]
    departure_sds: tuple[float, ...]
    together: float = 0.0

    def without(self, member: int) -> Members:
        """The set without one of its members."""
        return tuple(m for m in self.members if m != member)


@dataclass(frozen=True, eq=False)
class _Columns:
    """Columns ``values`` (n, k) of each session over the fitted samples, and their products ``on_nuisances`` (k, l)."""

    values: Sequence[Array]
    on_nuisances: Sequence[Array]


@dataclass(frozen=True, eq=False)
class _Departures:
    """A member's departure ``columns`` and their ``places`` among all columns.

    ``half`` (p, k): its square is what the baseline and the imperfections take out of their inner products.
    """

    columns: _Columns
    places: slice
    half: Array


class Evidence:
    """The evidence for sets of candidates under white noise of ``noise_sd``, a share of full scale.

    ``of_whole_effect``: equations depart in the whole effect, not only in what the baseline cannot follow of it.
    """

    def __init__(self, linearisation: Linearised, noise_sd: float, *, of_whole_effect: bool = False) -> None:
        self.linearisation, self.noise_sd, self.thresholds = linearisation, noise_sd, linearisation.thresholds
        self._of_whole_effect = of_whole_effect
        self._posteriors: dict[tuple[Members, bool], Posterior] = {}
        self._extensions: dict[Members, list[tuple[float, int, Array]]] = {}
        parts = list(zip(linearisation.products, linearisation.nuisance_counts, strict=True))
        self._inverse = [
            np.linalg.inv(ridged(products[-n:, -n:] + noise_sd**2 * nuisance_precision(one, linearisation.model)))
            for (products, n), one in zip(parts, linearisation.sessions, strict=True)
        ]
        on_nuisances = [products[:-n, -n:] for products, n in parts]
        self._all_columns = _Columns(linearisation.fitted_rows, on_nuisances)
        self.gram = self._without_nuisances(
            np.sum([products[:-n, :-n] for products, n in parts], axis=0), on_nuisances, on_nuisances
        )
        # The visible part of each column, which changes of the baseline cannot follow.
        own = slice(1, 1 + linearisation.baseline_count)
        raw = linearisation.gram
        inverse = np.linalg.pinv(raw[own, own], rcond=1e-10, hermitian=True)
        self._absorbed = inverse @ raw[own]
        visible = raw - raw[:, own] @ self._absorbed
        count = sum(int(s.fitted.sum()) for s in linearisation.sessions)
        self.raw = visible / count
        # Prior standard deviations without any effect: changes of the baseline, and small imperfections.
        self._sds = np.full(self.gram.shape[0] - 1, self.thresholds.imperfection)
        self._sds[: linearisation.baseline_count] = 1.0
        for one in linearisation.candidates:
            if one.effect.why_unnamed:  # a behaviour that no law has is not an imperfection of a good unit
                self._sds[np.array(one.columns) - 1] = 0.0
        inner = self.gram[1:, 1:] * np.outer(self._sds, self._sds)
        inner.flat[:: inner.shape[0] + 1] += 1.0
        self._factor = _factor(inner)
        self._half = self._half_solved(self.gram)
        self._directions = directions(self.thresholds)
        self._column_count = self.gram.shape[0]  # where departures begin, candidate after candidate
        # Most of the departures are never asked for, and only those asked for are computed.
        self._reduced = np.zeros((self._column_count + self._directions * len(linearisation.candidates),) * 2)
        self._reduced[: self._column_count, : self._column_count] = self.gram - self._half.T @ self._half
        self._null_score = float(self._reduced[0, 0]) + 2.0 * float(np.sum(np.log(np.diag(self._factor))))
        self._departures: dict[int, _Departures] = {}
        self._known_pairs: set[tuple[int, int]] = set()
        effects = {one.name for one in linearisation.candidates}
        self.odds = 2.0 * math.log(len(effects) / self.thresholds.false_name)

    def _half_solved(self, cross: Array) -> Array:
        """(p, k) of products (1 + p, k) with target and p columns: its square is what these p columns explain."""
        inside = self._sds[:, None] * cross[1:]
        return np.asarray(solve_triangular(self._factor, inside, lower=True, check_finite=False))

    def _without_nuisances(self, products: Array, left: Sequence[Array], right: Sequence[Array]) -> Array:
        """(l, r) inner products with the nuisances projected out, in units of the noise variance.

        ``left`` (l, k) and ``right`` (r, k) are, for each session, the columns' products with its nuisances.
        """
        parts = zip(left, right, self._inverse, strict=True)
        return np.asarray((products - sum(a @ inverse @ b.T for a, b, inverse in parts)) / self.noise_sd**2)

    def _cross_products(self, left: _Columns, right: _Columns) -> Array:
        """(l, r) inner products of two sets of columns, with the nuisances projected out."""
        products = np.asarray(sum(a.T @ b for a, b in zip(left.values, right.values, strict=True)))
        return self._without_nuisances(products, left.on_nuisances, right.on_nuisances)

    def visible_rms(self, columns: Sequence[int], strengths: Array) -> float:
        """Rms by which these strengths of the columns move the reading beyond what the baseline absorbs."""
        index = np.asarray(columns, dtype=np.intp)
        return math.sqrt(max(float(strengths @ self.raw[index[:, None], index] @ strengths), 0.0))

    def likeness(self, members: Sequence[int]) -> Array:
        """(k, k) similarity of the candidates, each fitted alone: 1 where they look the same in every sample.

        It is the absolute cosine of what each adds beyond the baseline and the nuisances.
        """
        made = np.zeros((self.raw.shape[0], len(members)))
        for k, member in enumerate(members):
            made[list(self.linearisation.candidates[member].columns), k] = self.posterior((member,)).strengths[0]
        return np.asarray(np.minimum(np.abs(cosines(made.T @ self.raw @ made)), 1.0))

    def _departures_of(self, members: Members) -> list[range]:
        """The places of the members' departure columns, computed when they are first needed."""
        self.prepare_departures(members)
        for pair in combinations(members, 2):
            if pair not in self._known_pairs:
                self._known_pairs.add(pair)
                one, other = (self._departures[member] for member in pair)
                found = self._cross_products(one.columns, other.columns) - one.half.T @ other.half
                self._reduced[one.places, other.places] = found
                self._reduced[other.places, one.places] = found.T
        there = [self._departures[member].places for member in members]
        return [range(places.start, places.stop) for places in there]

    def prepare_departures(self, members: Collection[int]) -> None:
        """Compute the departures of these candidates; all at once they cost half as much as one after another."""
        missing = [member for member in dict.fromkeys(members) if member not in self._departures]
        if not missing:
            return
        each = [self._departure_columns(member) for member in missing]
        together = _Columns(
            [np.hstack(values) for values in zip(*(one.values for one in each), strict=True)],
            [np.vstack(on_nuisances) for on_nuisances in zip(*(one.on_nuisances for one in each), strict=True)],
        )
        cross = self._cross_products(self._all_columns, together)
        count = self._directions
        for k, (member, own) in enumerate(zip(missing, each, strict=True)):
            cross_terms, first = cross[:, k * count : (k + 1) * count], self._column_count + member * count
            half, places = self._half_solved(cross_terms), slice(first, first + count)
            self._reduced[: self._column_count, places] = cross_terms - self._half.T @ half
            self._reduced[places, : self._column_count] = self._reduced[: self._column_count, places].T
            self._reduced[places, places] = self._cross_products(own, own) - half.T @ half
            self._departures[member] = _Departures(own, places, half)

    def _departure_columns(self, member: int) -> _Columns:
        """The directions in which one candidate's equation may depart."""
        linearisation = self.linearisation
        columns = list(linearisation.candidates[member].columns)
        weights = np.ones(len(columns)) if len(columns) == 1 else self._direction(columns)
        whole = [rows[:, columns] @ weights for rows in linearisation.rows]
        signatures = whole if self._of_whole_effect else self._visible(whole, columns, weights)
        return self._columns(departures(linearisation, signatures))

    def _columns(self, whole: Sequence[Array]) -> _Columns:
        """Columns of ``whole`` (n, k) for each session, over the fitted samples."""
        values = [rows_where(one.fitted, part) for one, part in zip(self.linearisation.sessions, whole, strict=True)]
        return _Columns(
            values, [part.T @ own for part, own in zip(values, self.linearisation.fitted_nuisances, strict=True)]
        )

    def _visible(self, whole: Sequence[Array], columns: Sequence[int], weights: Array) -> list[Array]:
        """The part (n,) of contributions ``whole``, for each session, that baseline and nuisances cannot follow."""
        linearisation, absorbed = self.linearisation, self._absorbed[:, columns] @ weights
        found = []
        for every, rows, own, products in zip(
            whole, linearisation.rows, linearisation.nuisances, linearisation.products, strict=True
        ):
            on_nuisances = products[-own.shape[1] :]
            known = (
                on_nuisances[:, columns] @ weights - on_nuisances[:, 1 : 1 + linearisation.baseline_count] @ absorbed
            )
            followed = own @ np.linalg.solve(ridged(on_nuisances[:, -own.shape[1] :]), known)
            found.append(every - rows[:, 1 : 1 + linearisation.baseline_count] @ absorbed - followed)
        return found

    def _direction(self, columns: Sequence[int]) -> Array:
        """Of an effect with several strengths, the direction (k,) that the data asks for, of unit length."""
        index = [*range(1, 1 + self.linearisation.baseline_count), *columns]
        part = self.gram[np.ix_(index, index)]
        part = part + np.diag(
            [1.0] * self.linearisation.baseline_count + [self.thresholds.strength_sd**-2] * len(columns)
        )
        found = np.linalg.solve(part, self.gram[index, 0])[self.linearisation.baseline_count :]
        size = float(np.linalg.norm(found))
        return np.asarray(found / size) if size > 0 else np.ones(len(columns)) / math.sqrt(len(columns))

    def posterior(self, members: Members, *, of_any_law: bool = False) -> Posterior:
        """The posterior of a set, given by the candidates' numbers; cached.

        ``of_any_law``: the equations may also depart towards all others of their families.
        """
        members = tuple(sorted(members))
        key = members, of_any_law
        if key not in self._posteriors:
            solution, bayes = self._set_solution(members, None)
            # The departure's prior is in proportion to the strength, which is first found as if the equation were
            # exact.
            for _ in range(2 if members else 0):
                solution, bayes = self._set_solution(members, self._strengths(members, solution), of_any_law=of_any_law)
            self._posteriors[key] = self._posterior_of(members, solution, bayes)
        return self._posteriors[key]

    def comparable_score(self, members: Members) -> float:
        """The score of a set including the cost of the nuisances, so that different nuisances can be compared.

        The offsets, whose prior is flat, are left out of that cost.
        """
        free = (np.linalg.slogdet(one)[1] + len(one) * 2.0 * math.log(self.noise_sd) for one in self._inverse)
        return self.posterior(members).score - float(sum(free))

    def bayes_factors_of_steps(self, members: Members, steps: Sequence[StepColumns]) -> Array:
        """(steps,) twice the log Bayes factor of each of the ``steps``, of unit prior, as a nuisance beside a set."""
        on_nuisances = [one.products(own) for one, own in zip(steps, self.linearisation.fitted_nuisances, strict=True)]
        cross = self._with_steps(self._all_columns, steps, on_nuisances)
        half = self._half_solved(cross)
        free = cross - self._half.T @ half
        best = self.posterior(members)
        index, sds = self._columns_and_sds(best.members, best.strengths)
        departures = [self._departures[member] for member in best.members]
        strengths = index[: index.size - self._directions * len(departures)]
        also = [self._with_steps(one.columns, steps, on_nuisances) - one.half.T @ half for one in departures]
        cross_terms = sds[:, None] * np.vstack([free[strengths], *also])
        factor, solution, _ = self._solve(index, sds)
        taken = solve_triangular(factor, cross_terms, lower=True, check_finite=False) if index.size else cross_terms
        each = zip(steps, on_nuisances, self._inverse, strict=True)
        power = [one.power - np.einsum("lk,lm,mk->k", own, inverse, own) for one, own, inverse in each]
        alone = np.concatenate(power) / self.noise_sd**2
        left = np.maximum(alone - np.sum(half**2, axis=0) - np.sum(taken**2, axis=0), 0.0)
        projected_target = free[0] - cross_terms.T @ solution
        return np.asarray(projected_target**2 / (1.0 + left) - np.log1p(left))

    def _with_steps(self, columns: _Columns, steps: Sequence[StepColumns], on_nuisances: Sequence[Array]) -> Array:
        """Products of columns with all ``steps``, nuisances projected out; ``on_nuisances`` are those of the steps."""
        each = zip(columns.values, columns.on_nuisances, steps, on_nuisances, self._inverse, strict=True)
        parts = [one.products(values) - own @ inverse @ cross_terms for values, own, one, cross_terms, inverse in each]
        return np.hstack(parts) / self.noise_sd**2

    @cached_property
    def of_whole_effects(self) -> Evidence:
        """The same evidence where equations may depart in the whole effect."""
        return Evidence(self.linearisation, self.noise_sd, of_whole_effect=True)

    def _set_solution(
        self, members: Members, strengths: Sequence[Array] | None, *, of_any_law: bool = False
    ) -> tuple[Array, float]:
        """The solution (k,) of a set by `_solve`, and twice its log Bayes factor against the empty one."""
        _, solution, bayes = self._solve(*self._columns_and_sds(members, strengths, of_any_law=of_any_law))
        return solution, bayes

    def _strengths(self, members: Members, solution: Array) -> tuple[Array, ...]:
        """Each member's strengths (k,), which stand first in ``solution``."""
        ends = np.cumsum([len(self.linearisation.candidates[m].columns) for m in members], dtype=np.intp)
        return tuple(np.split(self.thresholds.strength_sd * solution[: ends[-1]], ends[:-1])) if members else ()

    def _posterior_of(self, members: Members, solution: Array, bayes: float) -> Posterior:
        """The posterior of a set from its solution and ``bayes``, twice its log Bayes factor against the empty one."""
        columns = [self.linearisation.candidates[m].columns for m in members]
        each = self._strengths(members, solution)
        sizes = tuple(self.visible_rms(c, s) for c, s in zip(columns, each, strict=True))
        own, beyond = np.split(solution, [sum(map(len, columns))])
        beyond = beyond[: len(members) * self._directions]  # the departures towards other laws come last
        departure_sds = [float(np.sqrt(np.mean(one**2))) for one in beyond.reshape(-1, self._directions)]
        together = self.visible_rms([c for few in columns for c in few], self.thresholds.strength_sd * own)
        score = self._null_score - bayes + self.odds_of(members)
        return Posterior(members, score, each, sizes, tuple(departure_sds or [0.0] * len(members)), together)

    def _columns_and_sds(
        self, members: Members, strengths: Sequence[Array] | None, *, of_any_law: bool = False
    ) -> tuple[Index, Array]:
        """The columns of a set, and the prior standard deviations (k,) of their coefficients.

        First the strengths, then each member's departures in proportion to ``strengths`` if these are known. With
        ``of_any_law`` the departures towards the other laws of each family follow.
        """
        index = [c for m in members for c in self.linearisation.candidates[m].columns]
        sds = [self.thresholds.strength_sd] * len(index)
        if strengths is not None:
            ways: list[Sequence[int]] = [*self._departures_of(members)]
            ways += [self._others_of(member) for member in members] if of_any_law else []
            for way, own in zip(ways, cycle(strengths), strict=False):
                share = self.thresholds.departure / math.sqrt(len(way) or 1)
                index += way
                sds += [max(share * float(np.linalg.norm(own)), 1e-7)] * len(way)
        return np.array(index, dtype=np.intp), np.array(sds)

    def _others_of(self, member: int) -> list[int]:
        """The columns of all other laws and blocks of a member's family, except those that may stand beside it."""
        own = self.linearisation.candidates[member]
        family = (one for one in self.linearisation.candidates if one.effect.family == own.effect.family)
        return [column for one in family if one.slot == own.slot and one.name != own.name for column in one.columns]

    def _solve(self, index: Index, sds: Array) -> tuple[Array, Array, float]:
        """Cholesky factor of I + sqrt(D) R sqrt(D), its solution, and twice the log Bayes factor."""
        inner = self._reduced[index[:, None], index] * (sds[:, None] * sds)
        inner.flat[:: index.size + 1] += 1.0
        factor = _factor(inner)
        projected_target = sds * self._reduced[index, 0]
        solution = np.asarray(dpotrs(factor, projected_target, lower=1)[0]) if index.size else projected_target
        return factor, solution, float(projected_target @ solution) - 2.0 * float(np.sum(np.log(np.diag(factor))))

    def extensions(self, members: Members) -> list[tuple[float, int, Array]]:
        """For each candidate: the score of ``members`` with it, its number, and its strengths (k,).

        Its equation is taken as exact. All follow from one factorisation for ``members``; cached.
        """
        best = self.posterior(members)
        if best.members not in self._extensions:
            self._extensions[best.members] = self._extended(best)
        return self._extensions[best.members]

    def _extended(self, best: Posterior) -> list[tuple[float, int, Array]]:
        """`extensions` of one set, in groups of candidates with equally many columns."""
        index, sds = self._columns_and_sds(best.members, best.strengths)
        factor, solution, _ = self._solve(index, sds)
        cross_terms = sds[:, None] * self._reduced[index, : self._sds.size + 1]
        half = solve_triangular(factor, cross_terms, lower=True, check_finite=False) if index.size else cross_terms
        projected_target = self._reduced[: self._sds.size + 1, 0] - cross_terms.T @ solution
        wide = self.thresholds.strength_sd**2
        found = []
        for numbers, columns in self._by_column_count:
            taken = half[:, columns]
            S = self._reduced[columns[:, :, None], columns[:, None, :]] - np.einsum("mgk,mgl->gkl", taken, taken)
            q = projected_target[columns]
            inner = np.eye(columns.shape[1]) + wide * S
            solved = np.linalg.solve(inner, q[:, :, None])[:, :, 0]
            bayes = wide * np.sum(q * solved, axis=1) - np.linalg.slogdet(inner)[1]
            found += [
                (best.score - float(gained) + self.odds_of((k,)), k, wide * strengths)
                for k, gained, strengths in zip(numbers, bayes, solved, strict=True)
                if k not in best.members
            ]
        return found

    @cached_property
    def _by_column_count(self) -> list[tuple[list[int], Index]]:
        """Candidates with equally many columns (g,), and these columns (g, k)."""
        groups: dict[int, list[int]] = {}
        for k, one in enumerate(self.linearisation.candidates):
            groups.setdefault(len(one.columns), []).append(k)
        return [
            (ks, np.array([self.linearisation.candidates[k].columns for k in ks], dtype=np.intp))
            for ks in groups.values()
        ]

    def odds_of(self, members: Members) -> float:
        """-2 log prior odds against a set: for each member one effect among all, at one of its shapes."""
        shapes = self.linearisation.shapes
        return sum(self.odds + 2.0 * math.log(shapes[self.linearisation.candidates[m].name]) for m in members)


def _factor(matrix: Array) -> Array:
    """The lower Cholesky factor; where rounding made the matrix indefinite, with the least ridge that helps.

    LAPACK is called directly, since this runs thousands of times on a few dozen rows. Rounding is relative to the
    largest element, which is large where hardly any noise is left beside the signal.
    """
    if not matrix.size:
        return matrix
    factor, failed = dpotrf(matrix, lower=1)
    more = max(1e-15 * float(np.max(np.diag(matrix))), 1e-300)
    while failed and math.isfinite(more):
        more *= 10.0
        matrix.flat[:: matrix.shape[0] + 1] += more
        factor, failed = dpotrf(matrix, lower=1)
    return np.asarray(factor)
