"""How well a set of effects accounts for the data: a marginal likelihood in which no equation is exact.

With the reading's residual y, in standard deviations of what counts as noise, and everything linear in it,

    y = X0 b + sum over all candidates x_j s_j + sum over e in S ( x_e a_e + Phi_e w_e ) + noise

* b ~ N(0, 1), the baseline's own changes: anything up to full scale, which is flat;
* s_j ~ N(0, material^2): what is immaterial may always be there, of any kind, and needs no name;
* a_e ~ N(0, strength_sd^2): the effects in S (spike and slab: George and McCulloch 1993);
* w_e ~ N(0, (departure a_e)^2 / columns): the error of e's equation, in proportion to the effect's own size, in the
  directions in which equations of its kind depart (Kennedy and O'Hagan 2001).

-2 log p(y | S) = y'y - g' A^-1 g + log det A + sum log(prior variances) + const, A = Z'Z + prior precisions, g = Z'y.
Everything is computed from inner products that are taken once, so that a set costs one small factorisation.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import LinAlgError, cho_factor, cho_solve

from smartshoe.arrays import Array, Index
from smartshoe.diagnosis._sensitivity import (
    Linearised,
    departures,
    directions,
    nuisance_precision,
    nuisances,
)

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


class Evidence:
    """The evidence for sets of candidates of ``given`` under white noise of ``noise_sd``, a share of full scale."""

    def __init__(self, given: Linearised, noise_sd: float) -> None:
        self.given, self.noise_sd, self.thresholds = given, noise_sd, given.thresholds
        self._seen: dict[Members, Posterior] = {}
        self._rows: list[Array] = []
        self._root: list[Array] = []
        self._past: list[Array] = []
        for session, rows in zip(given.sessions, given.rows, strict=True):
            seen = session.fitted
            past = nuisances(session, given.model.relaxation_rate_per_s)[seen] / noise_sd
            inner = past.T @ past + nuisance_precision(session, given.model, self.thresholds)
            inner += 1e-12 * max(float(np.trace(inner)), 1e-12) * np.eye(2)
            self._rows.append(rows[seen] / noise_sd)
            self._past.append(past)
            self._root.append(np.asarray(np.linalg.cholesky(inner), dtype=np.float64))
        self._room = [np.asfortranarray(rows) for rows in self._rows]  # grows as departures are asked for
        self._rows = list(self._room)
        self.gram = self._products(self._rows, self._rows)
        # The visible part of each column: what the baseline's own changes cannot follow.
        own = slice(1, 1 + given.own)
        raw = given.gram
        inverse = np.linalg.pinv(raw[own, own], rcond=1e-10, hermitian=True)
        self._absorbed = inverse @ raw[own]
        visible = raw - raw[:, own] @ self._absorbed
        count = sum(int(s.fitted.sum()) for s in given.sessions)
        self.raw = visible / count
        self._departures: dict[int, int] = {}
        self._directions = directions(self.thresholds)
        self._last = 1 + given.own + sum(len(one.columns) for one in given.candidates)
        self._amounts: dict[Members, list[float]] = {}
        effects = {one.name for one in given.candidates}
        self.odds = 2.0 * math.log(len(effects) / self.thresholds.false_name)

    def _products(self, left: Sequence[Array], right: Sequence[Array]) -> Array:
        total = np.zeros((left[0].shape[1], right[0].shape[1]))
        for a, b, past, root in zip(left, right, self._past, self._root, strict=True):
            ha = np.linalg.solve(root, past.T @ a)
            hb = ha if a is b else np.linalg.solve(root, past.T @ b)
            total += a.T @ b - ha.T @ hb
        return total

    def visible_rms(self, columns: Sequence[int], strengths: Array) -> float:
        """Rms by which strengths of these columns move the reading beyond what the baseline absorbs."""
        part = self.raw[np.ix_(list(columns), list(columns))]
        return float(np.sqrt(max(float(strengths @ part @ strengths), 0.0)))

    def _departure_of(self, member: int) -> int:
        """First column of a member's departures, made when they are first asked for."""
        if member in self._departures:
            return self._departures[member]
        given = self.given
        columns = given.candidates[member].columns
        weights = np.ones(len(columns)) if len(columns) == 1 else self._direction(columns)
        own = slice(1, 1 + given.own)
        signatures = []
        for session, rows in zip(given.sessions, given.rows, strict=True):
            signature = rows[:, list(columns)] @ weights - rows[:, own] @ (self._absorbed[:, list(columns)] @ weights)
            past = nuisances(session, given.model.relaxation_rate_per_s)
            mask = session.fitted
            signature = signature - past @ np.linalg.lstsq(past[mask], signature[mask], rcond=None)[0]
            signatures.append(signature)
        made = departures(given, signatures)
        white = [part[s.fitted] / self.noise_sd for part, s in zip(made, given.sessions, strict=True)]
        first = int(self.gram.shape[0])
        cross = self._products(self._rows, white)
        inner = self._products(white, white)
        self.gram = np.block([[self.gram, cross], [cross.T, inner]])
        for k, part in enumerate(white):
            if self._room[k].shape[1] < first + part.shape[1]:
                grown = np.empty((part.shape[0], 2 * self._room[k].shape[1] + part.shape[1]), order="F")
                grown[:, :first] = self._rows[k]
                self._room[k] = grown
            self._room[k][:, first : first + part.shape[1]] = part
            self._rows[k] = self._room[k][:, : first + part.shape[1]]
        self._departures[member] = first
        return first

    def _direction(self, columns: Sequence[int]) -> Array:
        """Of several strengths the direction that the data asks for, of unit length."""
        index = [*range(1, 1 + self.given.own), *columns]
        part = self.gram[np.ix_(index, index)]
        part = part + np.diag([1.0] * self.given.own + [self.thresholds.strength_sd**-2] * len(columns))
        found = np.linalg.solve(part, self.gram[index, 0])[self.given.own :]
        size = float(np.linalg.norm(found))
        return np.asarray(found / size) if size > 0 else np.ones(len(columns)) / math.sqrt(len(columns))

    def posterior(self, members: Members) -> Posterior:
        """The evidence of the set ``members`` (numbers of candidates); cached."""
        members = tuple(sorted(members))
        if members not in self._seen:
            # How far an equation departs goes with its size, which is first found as if it were exact.
            exact = self.exact(members)
            self._amounts[members] = [float(np.linalg.norm(strengths)) for strengths in exact.strengths]
            self._seen[members] = self._solved(members, True) if members else exact
        return self._seen[members]

    def exact(self, members: Members) -> Posterior:
        """The evidence of a set whose equations are taken for exact."""
        return self._solved(members, False)

    def _solved(self, members: Members, departing: bool) -> Posterior:
        given = self.given
        amounts = self._amounts.get(members) or [self.thresholds.strength_sd] * len(members)
        for _ in range(2 if departing and members else 1):
            index, sds = self._prior(members, amounts, departing)
            mean, cost, _ = self._cost(index, sds)
            amounts = self._amplitudes(mean, members)
        strengths = tuple(mean[[c - 1 for c in given.candidates[m].columns]] for m in members)
        sizes = tuple(self.visible_rms(given.candidates[m].columns, s) for m, s in zip(members, strengths, strict=True))
        departed = []
        for k, _ in enumerate(members):
            at = self._last - 1 + k * self._directions
            of = slice(at, at + self._directions)
            departed.append(float(np.sqrt(np.mean((mean[of] / sds[of]) ** 2))) if departing else 0.0)
        columns = [c for m in members for c in given.candidates[m].columns]
        together = self.visible_rms(columns, np.concatenate(strengths)) if members else 0.0
        return Posterior(members, cost + self.odds_of(members), strengths, sizes, tuple(departed), together)

    def extensions(self, members: Members) -> list[tuple[float, int, Array]]:
        """For each candidate the score of ``members`` with it, its equation taken for exact, and its strengths (k,).

        All follow from one factorisation: giving columns x a wider prior, by d, changes -2 log evidence by
        log det(I + d S) - d q'(I + d S)^-1 q, with S = x'C^-1 x and q = x'C^-1 y of the present covariance C.
        """
        best = self.posterior(members)
        amounts = [float(np.linalg.norm(strengths)) for strengths in best.strengths]
        index, sds = self._prior(best.members, amounts, True)
        mean, _, factor = self._cost(index, sds)
        covariance = cho_solve(factor, np.eye(index.size), check_finite=False) * np.outer(sds, sds)
        narrow, wide = self.thresholds.material**2, self.thresholds.strength_sd**2
        found = []
        for numbers, columns in self._alike:
            at, unit = columns - 1, np.eye(columns.shape[1])
            S = (narrow * unit - covariance[at[:, :, None], at[:, None, :]]) / narrow**2
            q = mean[at] / narrow
            inner = unit + (wide - narrow) * S
            solved = np.linalg.solve(inner, q[:, :, None])[:, :, 0]
            fall = (wide - narrow) * np.sum(q * solved, axis=1) - np.linalg.slogdet(inner)[1]
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

    def _prior(self, members: Members, amounts: Sequence[float], departing: bool) -> tuple[Index, Array]:
        """Columns that take part, and the standard deviations (p,) of their coefficients."""
        prior = np.full(self._last - 1, self.thresholds.material)
        prior[: self.given.own] = 1.0
        for member in members:
            prior[[c - 1 for c in self.given.candidates[member].columns]] = self.thresholds.strength_sd
        index = np.arange(1, self._last, dtype=np.intp)
        if not (departing and members):
            return index, prior
        share = self.thresholds.departure / math.sqrt(self._directions)
        extra: list[int] = []
        spread: list[float] = []
        for member, amount in zip(members, amounts, strict=True):
            first = self._departure_of(member)
            extra += range(first, first + self._directions)
            spread += [max(share * amount, 1e-7)] * self._directions
        return np.concatenate([index, np.array(extra, dtype=np.intp)]), np.concatenate([prior, spread])

    def _amplitudes(self, mean: Array, members: Members) -> list[float]:
        columns = [self.given.candidates[member].columns for member in members]
        return [float(np.linalg.norm(mean[[c - 1 for c in own]])) for own in columns]

    def _cost(self, index: Index, sds: Array) -> tuple[Array, float, tuple[Array, bool]]:
        a = self.gram[np.ix_(index, index)] * np.outer(sds, sds)
        a[np.diag_indices_from(a)] += 1.0
        g = self.gram[index, 0] * sds
        try:
            factor = cho_factor(a, lower=True, check_finite=False)
        except LinAlgError:
            a[np.diag_indices_from(a)] *= 1.0 + 1e-9
            factor = cho_factor(a, lower=True, check_finite=False)
        found = cho_solve(factor, g, check_finite=False)
        cost = float(self.gram[0, 0] - g @ found + 2.0 * np.sum(np.log(np.diag(factor[0]))))
        return sds * found, cost, factor
