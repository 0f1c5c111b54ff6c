"""The screen: what each effect could explain of a residual, and which effects this data cannot tell apart."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from smartshoe.diagnosis.noise import NoiseModel, autoregression
from smartshoe.diagnosis.session import Session
from smartshoe.models.effects import Effect, catalogue
from smartshoe.models.extended import ExtendedModel

Array = NDArray[np.float64]

TARE = "load_cell_tare"
NOTHING = 1e-8  # of a column's squared norm: it lies within the others' span
RIDGE = 1e-9


@dataclass(frozen=True, eq=False)
class Candidate:
    """An effect at one point of its shapes; ``columns``: where its strengths' sensitivities stand in the dictionary."""

    effect: Effect
    shape: Mapping[str, float]
    columns: slice

    def start(self, strengths: Array) -> Array:
        """Parameter values with the linear estimate of the strengths, within bounds."""
        values = self.effect.start(self.shape)
        k = 0
        for j, parameter in enumerate(self.effect.parameters):
            if parameter.null is not None:
                values[j] = min(max(parameter.null + strengths[k], parameter.lower), parameter.upper)
                k += 1
        return values


@dataclass(frozen=True, eq=False)
class Dictionary:
    """Sensitivities of everything, a session each: residual (n,), the model's own (n, p), the candidates' (n, q)."""

    model: ExtendedModel
    sessions: Sequence[Session]
    candidates: tuple[Candidate, ...]
    residuals: tuple[Array, ...]
    own: tuple[Array, ...]
    others: tuple[Array, ...]


# Found by tests of their own before any model is asked.
NOT_BY_WAVEFORM = frozenset({"noise", "data"})


def available(sessions: Sequence[Session]) -> list[Effect]:
    """Physical effects whose channels were logged."""
    has = {
        name
        for name, attribute in (("temperature", "temperature_k"), ("neighbour", "neighbour"))
        if all(getattr(session.conditions, attribute) is not None for session in sessions)
    }
    return [e for e in catalogue().values() if e.family not in NOT_BY_WAVEFORM and e.needs <= has]


def dictionary(model: ExtendedModel, sessions: Sequence[Session]) -> Dictionary:
    """Every available effect that is not in the model yet, at every point of its shapes."""
    effects = [e for e in available(sessions) if e.name not in model.names]
    candidates: list[Candidate] = []
    place = 0
    for effect in effects:
        strengths = sum(parameter.null is not None for parameter in effect.parameters)
        for shape in effect.shapes:
            candidates.append(Candidate(effect, shape, slice(place, place + strengths)))
            place += strengths
    residuals, own, others = [], [], []
    for session in sessions:
        reading, slopes = model.sensitivities(session.conditions)
        trace = model.trace(session.conditions)
        blocks = [model.column_of(c.effect, c.effect.start(c.shape), session.conditions, trace) for c in candidates]
        residuals.append(session.reading - reading)
        own.append(slopes)
        others.append(np.concatenate(blocks, axis=1) if blocks else np.zeros((reading.size, 0)))
    return Dictionary(model, sessions, tuple(candidates), tuple(residuals), tuple(own), tuple(others))


def unreachable(words: Dictionary) -> list[Array]:
    """The residuals, a session each, less all that the dictionary's sensitivities explain: noise, and the unknown."""
    rows = [np.column_stack([o, d])[s.fitted] for o, d, s in zip(words.own, words.others, words.sessions, strict=True)]
    everything = np.concatenate(rows)
    target = np.concatenate([r[s.fitted] for r, s in zip(words.residuals, words.sessions, strict=True)])
    norm = np.sqrt(np.sum(everything**2, axis=0))
    norm[norm == 0] = 1.0
    scaled = everything / norm
    gram = scaled.T @ scaled + RIDGE * np.eye(norm.size)
    found = np.linalg.solve(gram, scaled.T @ target) / norm
    return [
        r - np.column_stack([o, d]) @ found for r, o, d in zip(words.residuals, words.own, words.others, strict=True)
    ]


def noise_of(words: Dictionary) -> NoiseModel:
    """The noise's autoregression from what the dictionary cannot reach."""
    return autoregression(unreachable(words), [s.fitted for s in words.sessions])


@dataclass(frozen=True, eq=False)
class Screened:
    """A candidate's linear estimate: ``strengths`` (k,), what it takes off the cost, whitened and raw (shares)."""

    candidate: Candidate
    strengths: Array
    fall: float
    raw_share: float


@dataclass(frozen=True, eq=False)
class Screening:
    """The best shape of each effect, by fall of the whitened cost; ``likeness`` (effects, effects) in that order.

    ``total`` is the squared error that is there to be explained: where parts are gone, what they themselves explain.
    Likeness is the largest canonical correlation of two effects' sensitivities after the model's own parameters are
    projected out: near one, this data cannot tell them apart (to first order).
    """

    ranked: tuple[Screened, ...]
    likeness: Array
    total: float

    @property
    def names(self) -> tuple[str, ...]:
        """Effects, best first."""
        return tuple(one.candidate.effect.name for one in self.ranked)


@dataclass(frozen=True, eq=False)
class Board:
    """All inner products that a screen needs, taken once: of residual, own columns, candidates', and parts' shares.

    ``white`` and ``raw`` (m, m) are Gram matrices in this order; ``parts`` says where a part's share stands.
    """

    words: Dictionary
    white: Array
    raw: Array
    parts: Mapping[str, int]

    def screen(self, gone: Sequence[str] = ()) -> Screening:
        """Project the residual on each effect's sensitivities, the model's own projected out.

        Without the parts ``gone``: what they contribute is added to the residual, and their own columns do not count.
        """
        white, raw = self._projected(self.white, gone), self._projected(self.raw, gone)
        best: dict[str, Screened] = {}
        for candidate in self.words.candidates:
            strengths, fall = _explained(candidate, white[0], white[1])
            _, raw_fall = _explained(candidate, raw[0], raw[1])
            one = Screened(candidate, strengths, fall, raw_fall / max(raw[2], 1e-300))
            name = candidate.effect.name
            if name not in best or max(one.fall, 0.0) > best[name].fall:
                best[name] = one
        ranked = tuple(sorted(best.values(), key=lambda one: -one.fall))
        return Screening(ranked, _likeness(ranked, white[0]), white[2])

    def _projected(self, gram: Array, gone: Sequence[str]) -> tuple[Array, Array, float]:
        """Gram matrix (q, q) of the candidates, their products with the target, and what is there to be explained."""
        owners = [owner for owner, _ in self.words.model.parameters]
        own = np.array([1 + k for k, owner in enumerate(owners) if owner not in gone])
        first = 1 + len(owners)
        count = self.words.others[0].shape[1]
        lost_own = np.array([1 + k for k, owner in enumerate(owners) if owner in gone], dtype=int)
        others = np.concatenate([np.arange(first, first + count), lost_own])
        place = np.array([0, *(self.parts[name] for name in gone)])
        target = gram[:, place].sum(axis=1)
        square = float(gram[np.ix_(place, place)].sum())
        scale = np.sqrt(np.diag(gram)[own])
        scale[scale == 0] = 1.0
        inverse = np.linalg.pinv(gram[np.ix_(own, own)] / np.outer(scale, scale), rcond=1e-11, hermitian=True)
        to_own = gram[np.ix_(others, own)] / scale
        left = to_own @ inverse
        norm = np.diag(gram)[others]
        part = gram[np.ix_(others, others)] - left @ to_own.T
        product = target[others] - left @ (target[own] / scale)
        square -= float((target[own] / scale) @ inverse @ (target[own] / scale))
        lost = np.diag(part) <= NOTHING * norm
        part[lost], part[:, lost] = 0.0, 0.0
        product = np.where(lost, 0.0, product)
        if gone:
            square = _fall_of(part[count:, count:], product[count:])
        return part[:count, :count], product[:count], max(square, 0.0)


@dataclass(frozen=True, eq=False)
class Rests:
    """What the loads in rests say of a tare: ``residual`` (m,) of the model, ``weight`` 1/sd of a load in a rest.

    ``shares`` (m,): what each part takes off that residual.
    """

    residual: Array
    weight: float
    shares: Mapping[str, Array]


def board(
    words: Dictionary,
    noise: NoiseModel,
    parts: Mapping[str, Sequence[Array]] | None = None,
    rests: Rests | None = None,
) -> Board:
    """The inner products; ``parts`` are what each part adds to the reading, a session each (n,)."""
    shares = dict(parts or {})
    whitened, raw = [], []
    for k, session in enumerate(words.sessions):
        columns = [words.residuals[k], words.own[k], words.others[k], *(share[k] for share in shares.values())]
        rows = np.column_stack(columns)
        whitened.append(noise.whitened(rows)[noise.counted(session.fitted)])
        raw.append(rows[session.fitted])
    first = 1 + words.own[0].shape[1] + words.others[0].shape[1]
    places = {name: first + k for k, name in enumerate(shares)}
    if rests is not None:
        whitened.append(_rest_rows(words, rests, list(shares)))
    white_rows, raw_rows = np.concatenate(whitened), np.concatenate(raw)
    return Board(words, white_rows.T @ white_rows, raw_rows.T @ raw_rows, places)


def _rest_rows(words: Dictionary, rests: Rests, parts: Sequence[str]) -> Array:
    """(m, columns): without these rows a tare would be the like of an offset."""
    first = 1 + words.own[0].shape[1]
    rows = np.zeros((rests.residual.size, first + words.others[0].shape[1] + len(parts)))
    rows[:, 0] = rests.residual
    for k, (owner, _) in enumerate(words.model.parameters):
        if owner == TARE:
            rows[:, 1 + k] = -rests.weight
    for candidate in words.candidates:
        if candidate.effect.name == TARE:
            rows[:, first + candidate.columns.start] = -rests.weight
    for k, name in enumerate(parts):
        rows[:, rows.shape[1] - len(parts) + k] = rests.shares.get(name, 0.0)
    return rows


def screen(words: Dictionary, noise: NoiseModel, rests: Rests | None = None) -> Screening:
    """The screen of a model as it is."""
    return board(words, noise, None, rests).screen()


def _explained(candidate: Candidate, gram: Array, products: Array) -> tuple[Array, float]:
    """Strengths (k,) within their signs, and the fall of the squared error."""
    part, product = gram[candidate.columns, candidate.columns], products[candidate.columns]
    signs = [(p.lower >= p.null, p.upper <= p.null) for p in candidate.effect.parameters if p.null is not None]
    free = np.diag(part) > 0
    found = np.zeros(product.size)
    for _ in range(product.size + 1):
        found[:] = 0.0
        index = np.flatnonzero(free)
        if not index.size:
            break
        scale = np.sqrt(np.diag(part)[index])
        inner = part[np.ix_(index, index)] / np.outer(scale, scale)
        found[index] = np.linalg.lstsq(inner, product[index] / scale, rcond=1e-9)[0] / scale
        wrong = np.array([(up and v < 0) or (down and v > 0) for (up, down), v in zip(signs, found, strict=True)])
        if not wrong.any():
            break
        free &= ~wrong
    return found, float(2 * found @ product - found @ part @ found)


def _fall_of(part: Array, product: Array) -> float:
    """What columns with these inner products take off a squared error."""
    scale = np.sqrt(np.diag(part))
    seen = np.flatnonzero(scale > 0)
    if not seen.size:
        return 0.0
    inner = part[np.ix_(seen, seen)] / np.outer(scale[seen], scale[seen])
    return float(product[seen] / scale[seen] @ np.linalg.lstsq(inner, product[seen] / scale[seen], rcond=1e-9)[0])


def _likeness(ranked: Sequence[Screened], gram: Array) -> Array:
    out = np.eye(len(ranked))
    roots = []
    for one in ranked:
        part = gram[one.candidate.columns, one.candidate.columns]
        values, vectors = np.linalg.eigh(part)
        good = values > 1e-9 * max(float(values.max(initial=0.0)), 1e-300)
        roots.append(vectors[:, good] / np.sqrt(values[good]) if good.any() and values.max() > 0 else None)
    for i, a in enumerate(ranked):
        for j in range(i):
            left, right = roots[i], roots[j]
            if left is None or right is None:
                continue
            cross = left.T @ gram[a.candidate.columns, ranked[j].candidate.columns] @ right
            out[i, j] = out[j, i] = min(float(np.linalg.norm(cross, 2)), 1.0)
    return out
