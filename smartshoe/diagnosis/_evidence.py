"""How well a set of effects accounts for the data: a marginal likelihood in which no equation is exact.

With the reading's residual y, in standard deviations of what counts as noise, and everything linear in it,

    y = X0 b + sum over all candidates x_j s_j + sum over e in S ( x_e a_e + Phi_e w_e ) + noise

* b ~ N(0, 1), the baseline's own changes: anything up to full scale, which is flat;
* s_j ~ N(0, imperfection^2): what is immaterial may always be there, of any kind, and needs no name;
* a_e ~ N(0, strength_sd^2): the effects in S (spike and slab: George and McCulloch 1993);
* w_e ~ N(0, (departure a_e)^2 / columns): the error of e's equation, in proportion to the effect's own size, in the
  directions in which equations of its kind depart (Kennedy and O'Hagan 2001).

With C0 the covariance of y for no effect, and U the columns x_e and Phi_e of S, of which S adds the prior variances D,

    -2 log p(y | S) = y' C0^-1 y + log det C0 - q' D (I + R D)^-1 q + log det(I + R D),

R = U' C0^-1 U and q = U' C0^-1 y. Both are taken once for all columns, so that a set costs a factorisation of its own
few.

Once a set is chosen, each of its effects is weighed against nothing in its place, also under a wider model error, since
a small companion may be no more than another effect's error of shape: Phi_e with the columns of all other equations of
the family (``of_any_law``), or made of the whole effect instead of what the baseline cannot follow of it (``of_all``),
as of a gain that settles more at high loads, which leaves a curve. The search uses neither: there the other equations
compete themselves, and a wide model error would hide effects of other families.
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
    where,
)
from smartshoe.diagnosis._step_columns import StepColumns

Members = tuple[int, ...]


@dataclass(frozen=True, eq=False)
class Posterior:
    """``score`` is -2 log of the evidence times the prior odds of the set; ``strengths`` a member's (k,) each.

    ``sizes``: rms by which each member moves the reading beyond what the baseline absorbs; ``departed``: rms of its
    fitted departure, in standard deviations of its prior. ``together``: rms by which all members move the reading.
    """

    members: Members
    score: float
    strengths: tuple[Array, ...]
    sizes: tuple[float, ...]
    departed: tuple[float, ...]
    together: float = 0.0

    def without(self, member: int) -> Members:
        """The set but for one of its members."""
        return tuple(m for m in self.members if m != member)


@dataclass(frozen=True, eq=False)
class _Columns:
    """Columns ``seen`` (n, k) a session, over what is fitted; ``past`` (k, l), their products with its l nuisances."""

    seen: Sequence[Array]
    past: Sequence[Array]


@dataclass(frozen=True, eq=False)
class _Departures:
    """A member's departures, and their ``places`` among all columns.

    ``half`` (p, k): what is taken out of their inner products by all that is there without any effect is its square.
    """

    columns: _Columns
    places: slice
    half: Array


class Evidence:
    """The evidence for sets of candidates of ``given`` under white noise of ``noise_sd``, a share of full scale.

    ``of_all``: equations depart in the whole effect, not in what the baseline cannot follow of it.
    """

    def __init__(self, given: Linearised, noise_sd: float, *, of_all: bool = False) -> None:
        self.given, self.noise_sd, self.thresholds = given, noise_sd, given.thresholds
        self._of_all = of_all
        self._seen: dict[tuple[Members, bool], Posterior] = {}
        self._extensions: dict[Members, list[tuple[float, int, Array]]] = {}
        parts = list(zip(given.products, given.nuisance_counts, strict=True))
        self._inverse = [
            np.linalg.inv(ridged(products[-n:, -n:] + noise_sd**2 * nuisance_precision(one, given.model)))
            for (products, n), one in zip(parts, given.sessions, strict=True)
        ]
        own_past = [products[:-n, -n:] for products, n in parts]
        self._all = _Columns(given.seen, own_past)
        self.gram = self._free(np.sum([products[:-n, :-n] for products, n in parts], axis=0), own_past, own_past)
        # The visible part of each column: what the baseline's own changes cannot follow.
        own = slice(1, 1 + given.own)
        raw = given.gram
        inverse = np.linalg.pinv(raw[own, own], rcond=1e-10, hermitian=True)
        self._absorbed = inverse @ raw[own]
        visible = raw - raw[:, own] @ self._absorbed
        count = sum(int(s.fitted.sum()) for s in given.sessions)
        self.raw = visible / count
        # What is there without any effect: the baseline's own changes, and what is immaterial.
        self._sds = np.full(self.gram.shape[0] - 1, self.thresholds.imperfection)
        self._sds[: given.own] = 1.0
        for one in given.candidates:
            if one.effect.why_unnamed:  # what no law does is no small imperfection of a good unit
                self._sds[np.array(one.columns) - 1] = 0.0
        inner = self.gram[1:, 1:] * np.outer(self._sds, self._sds)
        inner.flat[:: inner.shape[0] + 1] += 1.0
        self._factor = _factor(inner)
        self._half = self._taken_out(self.gram)
        self._directions = directions(self.thresholds)
        self._first = self.gram.shape[0]  # of all departures, a candidate's after the other's
        # Of the departures little is ever asked for, and only that takes room.
        self._reduced = np.zeros((self._first + self._directions * len(given.candidates),) * 2)
        self._reduced[: self._first, : self._first] = self.gram - self._half.T @ self._half
        self._nothing = float(self._reduced[0, 0]) + 2.0 * float(np.sum(np.log(np.diag(self._factor))))
        self._departures: dict[int, _Departures] = {}
        self._known: set[tuple[int, int]] = set()
        effects = {one.name for one in given.candidates}
        self.odds = 2.0 * math.log(len(effects) / self.thresholds.false_name)

    def _taken_out(self, cross: Array) -> Array:
        """(p, k) of inner products (1 + p, k) with target and p columns: its square is what these account for."""
        inside = self._sds[:, None] * cross[1:]
        return np.asarray(solve_triangular(self._factor, inside, lower=True, check_finite=False))

    def _free(self, products: Array, left: Sequence[Array], right: Sequence[Array]) -> Array:
        """(l, r) inner products, in units of the noise's variance, with what nuisances follow taken out.

        ``left`` (l, k) and ``right`` (r, k) a session are the columns' inner products with its nuisances.
        """
        parts = zip(left, right, self._inverse, strict=True)
        return np.asarray((products - sum(a @ inverse @ b.T for a, b, inverse in parts)) / self.noise_sd**2)

    def _between(self, left: _Columns, right: _Columns) -> Array:
        """The same of two sets of columns."""
        products = np.asarray(sum(a.T @ b for a, b in zip(left.seen, right.seen, strict=True)))
        return self._free(products, left.past, right.past)

    def visible_rms(self, columns: Sequence[int], strengths: Array) -> float:
        """Rms by which strengths of these columns move the reading beyond what the baseline absorbs."""
        index = np.asarray(columns, dtype=np.intp)
        return math.sqrt(max(float(strengths @ self.raw[index[:, None], index] @ strengths), 0.0))

    def likeness(self, alone: Sequence[int]) -> Array:
        """How alike (k, k) ``alone`` k candidates look in this data: 1 in every sample, 0 not at all.

        Absolute cosine of what each by itself would add that the baseline and the nuisances cannot follow.
        """
        made = np.zeros((self.raw.shape[0], len(alone)))
        for k, member in enumerate(alone):
            made[list(self.given.candidates[member].columns), k] = self.posterior((member,)).strengths[0]
        return np.asarray(np.minimum(np.abs(cosines(made.T @ self.raw @ made)), 1.0))

    def _departures_of(self, members: Members) -> list[range]:
        """Where the columns of members' departures stand, made when they are first asked for."""
        self.make_ready(members)
        for pair in combinations(members, 2):
            if pair not in self._known:
                self._known.add(pair)
                one, other = (self._departures[member] for member in pair)
                found = self._between(one.columns, other.columns) - one.half.T @ other.half
                self._reduced[one.places, other.places] = found
                self._reduced[other.places, one.places] = found.T
        there = [self._departures[member].places for member in members]
        return [range(places.start, places.stop) for places in there]

    def make_ready(self, members: Collection[int]) -> None:
        """Make the departures of these candidates: all at once they cost half of one after another."""
        missing = [member for member in dict.fromkeys(members) if member not in self._departures]
        if not missing:
            return
        each = [self._departing(member) for member in missing]
        together = _Columns(
            [np.hstack(seen) for seen in zip(*(one.seen for one in each), strict=True)],
            [np.vstack(past) for past in zip(*(one.past for one in each), strict=True)],
        )
        cross = self._between(self._all, together)
        count = self._directions
        for k, (member, own) in enumerate(zip(missing, each, strict=True)):
            beside, first = cross[:, k * count : (k + 1) * count], self._first + member * count
            half, places = self._taken_out(beside), slice(first, first + count)
            self._reduced[: self._first, places] = beside - self._half.T @ half
            self._reduced[places, : self._first] = self._reduced[: self._first, places].T
            self._reduced[places, places] = self._between(own, own) - half.T @ half
            self._departures[member] = _Departures(own, places, half)

    def _departing(self, member: int) -> _Columns:
        given = self.given
        columns = list(given.candidates[member].columns)
        weights = np.ones(len(columns)) if len(columns) == 1 else self._direction(columns)
        whole = [rows[:, columns] @ weights for rows in given.rows]
        signatures = whole if self._of_all else self._visible(whole, columns, weights)
        return self._columns(departures(given, signatures))

    def _columns(self, whole: Sequence[Array]) -> _Columns:
        """``whole`` (n, k) a session, where it may be fitted."""
        seen = [where(one.fitted, part) for one, part in zip(self.given.sessions, whole, strict=True)]
        return _Columns(seen, [part.T @ own for part, own in zip(seen, self.given.past, strict=True)])

    def _visible(self, whole: Sequence[Array], columns: Sequence[int], weights: Array) -> list[Array]:
        """Of ``whole`` contributions (n,) a session what the baseline and the nuisances cannot follow."""
        given, absorbed = self.given, self._absorbed[:, columns] @ weights
        found = []
        for every, rows, own, products in zip(whole, given.rows, given.nuisances, given.products, strict=True):
            past = products[-own.shape[1] :]
            known = past[:, columns] @ weights - past[:, 1 : 1 + given.own] @ absorbed
            followed = own @ np.linalg.solve(ridged(past[:, -own.shape[1] :]), known)
            found.append(every - rows[:, 1 : 1 + given.own] @ absorbed - followed)
        return found

    def _direction(self, columns: Sequence[int]) -> Array:
        """Of several strengths the direction that the data asks for, of unit length."""
        index = [*range(1, 1 + self.given.own), *columns]
        part = self.gram[np.ix_(index, index)]
        part = part + np.diag([1.0] * self.given.own + [self.thresholds.strength_sd**-2] * len(columns))
        found = np.linalg.solve(part, self.gram[index, 0])[self.given.own :]
        size = float(np.linalg.norm(found))
        return np.asarray(found / size) if size > 0 else np.ones(len(columns)) / math.sqrt(len(columns))

    def posterior(self, members: Members, *, of_any_law: bool = False) -> Posterior:
        """The evidence of the set ``members`` (numbers of candidates); cached.

        ``of_any_law``: their equations may depart towards all others of their families.
        """
        members = tuple(sorted(members))
        asked = members, of_any_law
        if asked not in self._seen:
            pull, fall = self._solved(members, None)
            # How far an equation departs goes with its size, which is first found as if it were exact.
            for _ in range(2 if members else 0):
                pull, fall = self._solved(members, self._strengths(members, pull), of_any_law=of_any_law)
            self._seen[asked] = self._described(members, pull, fall)
        return self._seen[asked]

    def score_beside(self, members: Members) -> float:
        """The score of a set with what the freedom of the nuisances costs, but for the offsets', whose prior is flat.

        -2 log of the evidence under any choice of the other nuisances: these can be weighed against one another.
        """
        free = (np.linalg.slogdet(one)[1] + len(one) * 2.0 * math.log(self.noise_sd) for one in self._inverse)
        return self.posterior(members).score - float(sum(free))

    def falls_beside(self, members: Members, steps: Sequence[StepColumns]) -> Array:
        """By how much a set's score falls with each of the sessions' ``steps``, in order, of unit prior."""
        past = [one.products(own) for one, own in zip(steps, self.given.past, strict=True)]
        cross = self._with_steps(self._all, steps, past)
        half = self._taken_out(cross)
        free = cross - self._half.T @ half
        best = self.posterior(members)
        index, sds = self._widened(best.members, best.strengths)
        departures = [self._departures[member] for member in best.members]
        strengths = index[: index.size - self._directions * len(departures)]
        also = [self._with_steps(one.columns, steps, past) - one.half.T @ half for one in departures]
        beside = sds[:, None] * np.vstack([free[strengths], *also])
        factor, pull, _ = self._moved(index, sds)
        taken = solve_triangular(factor, beside, lower=True, check_finite=False) if index.size else beside
        each = zip(steps, past, self._inverse, strict=True)
        power = [one.power - np.einsum("lk,lm,mk->k", own, inverse, own) for one, own, inverse in each]
        alone = np.concatenate(power) / self.noise_sd**2
        left = np.maximum(alone - np.sum(half**2, axis=0) - np.sum(taken**2, axis=0), 0.0)
        asked = free[0] - beside.T @ pull
        return np.asarray(asked**2 / (1.0 + left) - np.log1p(left))

    def _with_steps(self, columns: _Columns, steps: Sequence[StepColumns], past: Sequence[Array]) -> Array:
        """`_free` of columns and all ``steps``, whose products with their sessions' nuisances are ``past``."""
        each = zip(columns.seen, columns.past, steps, past, self._inverse, strict=True)
        parts = [one.products(seen) - own @ inverse @ beside for seen, own, one, beside, inverse in each]
        return np.hstack(parts) / self.noise_sd**2

    @cached_property
    def of_whole_effects(self) -> Evidence:
        """The same where equations depart in all that their effects add."""
        return Evidence(self.given, self.noise_sd, of_all=True)

    def _solved(
        self, members: Members, strengths: Sequence[Array] | None, *, of_any_law: bool = False
    ) -> tuple[Array, float]:
        """`_moved` by a set: the solution (k,), and by how much -2 log evidence falls."""
        _, pull, fall = self._moved(*self._widened(members, strengths, of_any_law=of_any_law))
        return pull, fall

    def _strengths(self, members: Members, pull: Array) -> tuple[Array, ...]:
        """Each member's (k,), of a solution that begins with them."""
        ends = np.cumsum([len(self.given.candidates[m].columns) for m in members], dtype=np.intp)
        return tuple(np.split(self.thresholds.strength_sd * pull[: ends[-1]], ends[:-1])) if members else ()

    def _described(self, members: Members, pull: Array, fall: float) -> Posterior:
        columns = [self.given.candidates[m].columns for m in members]
        each = self._strengths(members, pull)
        sizes = tuple(self.visible_rms(c, s) for c, s in zip(columns, each, strict=True))
        own, beyond = np.split(pull, [sum(map(len, columns))])
        beyond = beyond[: len(members) * self._directions]  # after them come those towards other laws
        departed = [float(np.sqrt(np.mean(one**2))) for one in beyond.reshape(-1, self._directions)]
        together = self.visible_rms([c for few in columns for c in few], self.thresholds.strength_sd * own)
        score = self._nothing - fall + self.odds_of(members)
        return Posterior(members, score, each, sizes, tuple(departed or [0.0] * len(members)), together)

    def _widened(
        self, members: Members, strengths: Sequence[Array] | None, *, of_any_law: bool = False
    ) -> tuple[Index, Array]:
        """A set's columns, and the standard deviations (k,) of their coefficients.

        Its strengths' first, then each member's departures in proportion to ``strengths``, where they are known; last,
        ``of_any_law``, those towards the others of its family.
        """
        index = [c for m in members for c in self.given.candidates[m].columns]
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
        """The columns of all other equations and blocks of a member's family, but those that may be beside it."""
        own = self.given.candidates[member]
        family = (one for one in self.given.candidates if one.effect.family == own.effect.family)
        return [column for one in family if one.slot == own.slot and one.name != own.name for column in one.columns]

    def _moved(self, index: Index, sds: Array) -> tuple[Array, Array, float]:
        """Factor of I + D R, its solution (k,) of D q, and by how much -2 log evidence falls; D by halves each side."""
        inner = self._reduced[index[:, None], index] * (sds[:, None] * sds)
        inner.flat[:: index.size + 1] += 1.0
        factor = _factor(inner)
        asked = sds * self._reduced[index, 0]
        pull = np.asarray(dpotrs(factor, asked, lower=1)[0]) if index.size else asked
        return factor, pull, float(asked @ pull) - 2.0 * float(np.sum(np.log(np.diag(factor))))

    def extensions(self, members: Members) -> list[tuple[float, int, Array]]:
        """For each candidate the score of ``members`` with it, its equation taken for exact, and its strengths (k,).

        All follow from one factorisation, that of what ``members`` widen; cached.
        """
        best = self.posterior(members)
        if best.members not in self._extensions:
            self._extensions[best.members] = self._extended(best)
        return self._extensions[best.members]

    def _extended(self, best: Posterior) -> list[tuple[float, int, Array]]:
        index, sds = self._widened(best.members, best.strengths)
        factor, pull, _ = self._moved(index, sds)
        beside = sds[:, None] * self._reduced[index, : self._sds.size + 1]
        half = solve_triangular(factor, beside, lower=True, check_finite=False) if index.size else beside
        asked = self._reduced[: self._sds.size + 1, 0] - beside.T @ pull
        wide = self.thresholds.strength_sd**2
        found = []
        for numbers, columns in self._alike:
            taken = half[:, columns]
            S = self._reduced[columns[:, :, None], columns[:, None, :]] - np.einsum("mgk,mgl->gkl", taken, taken)
            q = asked[columns]
            inner = np.eye(columns.shape[1]) + wide * S
            solved = np.linalg.solve(inner, q[:, :, None])[:, :, 0]
            fall = wide * np.sum(q * solved, axis=1) - np.linalg.slogdet(inner)[1]
            found += [
                (best.score - float(fell) + self.odds_of((k,)), k, wide * strengths)
                for k, fell, strengths in zip(numbers, fall, solved, strict=True)
                if k not in best.members
            ]
        return found

    @cached_property
    def _alike(self) -> list[tuple[list[int], Index]]:
        """Candidates with equally many columns (g,), and these columns (g, k)."""
        groups: dict[int, list[int]] = {}
        for k, one in enumerate(self.given.candidates):
            groups.setdefault(len(one.columns), []).append(k)
        return [(ks, np.array([self.given.candidates[k].columns for k in ks], dtype=np.intp)) for ks in groups.values()]

    def odds_of(self, members: Members) -> float:
        """-2 log prior odds against the members of a set: of one effect among all, at one of its shapes."""
        shapes = self.given.shapes
        return sum(self.odds + 2.0 * math.log(shapes[self.given.candidates[m].name]) for m in members)


def _factor(matrix: Array) -> Array:
    """The lower Cholesky factor; where rounding made it indefinite, with as little more on the diagonal as it needs.

    By LAPACK itself: it is asked for thousands of times, of a few dozen rows. Rounding is a share of the largest
    element, where hardly any noise is left of that much signal.
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
