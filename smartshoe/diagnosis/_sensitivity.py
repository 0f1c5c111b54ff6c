"""Sensitivities of the reading to everything that could be wrong: the columns on which all inference works.

The model is linearised about a fit. Columns are given by its own parameters, by each effect of the catalogue at each
point of its shapes, and by each flexible block; an effect that is in the model gives its whole contribution. Each
recording has its own nuisances: an offset, the memory of earlier loads in the relaxing arm and, where recordings differ
by it, a gain. They are marginalised exactly (flat and Gaussian priors), so that no zero is ever assumed.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np

from smartshoe.arrays import Array, Mask
from smartshoe.diagnosis._excitation import excitation_of
from smartshoe.diagnosis._load_cycles import have_later_cycles
from smartshoe.diagnosis._noise import FLOOR, effective_noise_sd
from smartshoe.diagnosis._session import Session, fitted_of, stretch_of
from smartshoe.errors import UsageError
from smartshoe.integrity.thresholds import Thresholds
from smartshoe.models.effects import Effect, blocks, catalogue, is_told_from_its_family, origin_of
from smartshoe.models.effects.exposure import CHANNELS
from smartshoe.models.extended import ExtendedModel
from smartshoe.signals.lags import lagged

NON_PRESSURES = frozenset({"force", "length", "resistance", "capacitance", "angle"})  # a voltage or counts may be one


@dataclass(frozen=True, eq=False)
class Candidate:
    """An effect, or a flexible block, at one point of its shapes, and the columns of its strengths.

    ``is_distinguishable``: the data distinguishes its branch from the others of its family.
    """

    effect: Effect
    shape: Mapping[str, float]
    columns: tuple[int, ...]
    is_distinguishable: bool = True

    @property
    def name(self) -> str:
        """The effect's identifier."""
        return self.effect.name

    @property
    def branch(self) -> str:
        """The branch of a family: a unit has one law, or the flexible block in its place, of each branch."""
        return (self.is_distinguishable and self.effect.branch) or self.effect.kind

    @property
    def slot(self) -> str:
        """The key of which a set has one at most: the branch, but one key for all curves, which bend for each other."""
        return self.effect.kind if self.effect.is_memoryless else self.branch

    def start(self, strengths: Array) -> Array:
        """Parameter values (p,) with the strengths (k,) added to null, clipped to their bounds."""
        values = self.effect.start(self.shape)
        k = 0
        for j, parameter in enumerate(self.effect.parameters):
            if parameter.null is not None:
                values[j] = min(max(parameter.null + strengths[k], parameter.lower), parameter.upper)
                k += 1
        return values

    def allows_sign_of(self, strengths: Array) -> bool:
        """Whether strengths (k,), counted from null, have the sign that physics allows."""
        bounded = [p for p in self.effect.parameters if p.null is not None]
        return all(
            (p.lower < p.null or value >= 0.0) and (p.upper > p.null or value <= 0.0)
            for p, value in zip(bounded, strengths, strict=True)
            if p.null is not None
        )


def is_remembered_by_gas(effect: Effect) -> bool:
    """Whether it is a memory of the gas, which only a gas pressure shows."""
    return effect.stage == "gas" and not effect.is_memoryless


def available_effects(sessions: Sequence[Session], thresholds: Thresholds) -> list[Effect]:
    """Physical effects and flexible blocks that this data could show: their channels are logged in every recording.

    Left out are effects that shift load or reading by a constant, which no waveform distinguishes from a recording's
    offset (`smartshoe.diagnosis._zero`), but for the tare that rests show: behind it other effects have other shapes.
    Left out too are effects of later load cycles where no recording has any. Relaxation of a
    pressure is attributed to the gas; of other readings the sensor may be its cause, too.
    """
    has = logged_channels(sessions)
    has_cycles = have_later_cycles(sessions, thresholds)
    flexible = [block for family in blocks().values() for block in family]
    found = [e for e in (*catalogue().values(), *flexible) if e.is_physical and e.shifts is None]
    found += [one.tare for one in sessions[:1] if one.tare is not None]
    if any(one.without_gas_memory for one in sessions):
        found = [e for e in found if not is_remembered_by_gas(e)]
    if any(one.without_catch_alls for one in sessions):
        found = [e for e in found if not e.is_catch_all]
    if not any(one.recording.sensor.unit.quantity == "pressure" for one in sessions):
        found = [e.of_any_sensor() for e in found]
    stretch = stretch_of(sessions)
    found = [e.lasting(stretch) for e in found]
    return [e for e in found if e.needs <= has and not e.is_refinement and (has_cycles or not e.needs_cycles)]


def logged_channels(sessions: Sequence[Session]) -> set[str]:
    """The channels that every recording has besides load and reading, in the words of `models.effects.exposure`."""
    channels = (("temperature", "temperature_k"), ("neighbour", "neighbour"))
    logged = {name for name, field in channels if all(getattr(s.conditions, field) is not None for s in sessions)}
    begin_apart = "temperature" in logged and any(s.conditions.begins_warmer_k for s in sessions)
    return logged | ({"temperatures"} if begin_apart else set())


def logged_words(sessions: Sequence[Session]) -> frozenset[str]:
    """`logged_channels`, and columns of such names in every recording that no effect uses."""
    columns = set.intersection(*({*one.recording.channels} for one in sessions))
    return frozenset(logged_channels(sessions) | (CHANNELS & columns))


def nuisances(session: Session, pole_per_s: float, read: Array | float = 0.0) -> Array:
    """(n, 2 + k) columns of a recording's nuisances: one for the offset, exp(-p t) for its initial memory, and k more.

    The k more are, for each own gain, the share of ``read`` (n,) in its part of the time; for each change of the zero,
    a step of its prior size; and after each long gap, a memory again, of a load that nobody knows.
    """
    time_s = session.conditions.time_s
    own = [session.own_gain_sd * read * part for part in session.gain_parts]
    steps = [session.zero_sd * (np.arange(time_s.size) >= at) for at in session.zero_changes]
    after = [np.pad(np.exp(-pole_per_s * (time_s[at:] - time_s[at])), (at, 0)) for at in session.gap_ends]
    more = [*own, *steps, *after]
    columns = np.empty((time_s.size, 2 + len(more)), order="F")
    columns[:, 0] = 1.0
    np.exp(-pole_per_s * (time_s - time_s[0]), out=columns[:, 1])
    for k, one in enumerate(more, start=2):
        columns[:, k] = one
    return columns


def nuisance_precision(session: Session, model: ExtendedModel) -> Array:
    """(2 + k, 2 + k) prior precision of `nuisances`: none for the offset, that of an unknown past for the memory.

    A unit that begins loaded has been loaded for an unknown time, so that the whole state of the arm is open; one that
    begins at rest still carries some of what went before. During a long gap any load may have come.
    """
    sd = past_sd(session, model)
    gap_sd = max(abs(model.relaxing_share) * abs(model.gain) * float(np.max(session.conditions.load)), FLOOR)
    return nuisance_diagonal(session, offset=0.0, past=1.0 / sd**2, change=1.0, gap=1.0 / gap_sd**2)


def past_sd(session: Session, model: ExtendedModel) -> float:
    """Prior standard deviation of the initial memory: that of the first load, or of ``unknown_past`` if larger."""
    held = abs(model.relaxing_share) * abs(model.gain)
    return max(held * max(float(np.abs(session.conditions.load[0])), session.unknown_past), FLOOR)


def nuisance_diagonal(session: Session, *, offset: float, past: float, change: float, gap: float) -> Array:
    """(2 + k, 2 + k) diagonal matrix with a number for each kind of column of `nuisances`."""
    changes = [change] * (len(session.gain_parts) + len(session.zero_changes))
    return np.diag([offset, past, *changes, *[gap] * len(session.gap_ends)])


@dataclass(frozen=True, eq=False)
class Linearised:
    """A model's columns over the fitted samples.

    ``rows``, (n, m) for each session: target, baseline parameters, strengths of candidates. The target is the residual
    with the contributions of the model's effects added back. ``baseline_count`` is the number of baseline columns.
    Columns are scaled so that a coefficient is the rms by which it moves the reading, a share of full scale; ``scales``
    (m,) undo that.
    """

    model: ExtendedModel
    sessions: tuple[Session, ...]
    rows: tuple[Array, ...]
    scales: Array
    baseline_count: int
    candidates: tuple[Candidate, ...]
    thresholds: Thresholds

    @cached_property
    def shapes(self) -> Mapping[str, int]:
        """The number of shapes at which each effect is a candidate."""
        return Counter(one.name for one in self.candidates)

    @property
    def places(self) -> dict[tuple[str, tuple[float, ...]], tuple[int, ...]]:
        """The columns of effects that are not in the model, by effect and shape."""
        return {_place(one): one.columns for one in self.candidates[len(self.model.parts) :]}

    @cached_property
    def nuisances(self) -> tuple[Array, ...]:
        """The columns (n, k) of each session's nuisances."""
        pole_per_s, read = self.model.pole_per_s, self.model.simulate
        return tuple(
            nuisances(one, pole_per_s, read(one.conditions) if one.own_gain_sd else 0.0) for one in self.sessions
        )

    @property
    def nuisance_counts(self) -> list[int]:
        """The number k of nuisances of each session."""
        return [one.shape[1] for one in self.nuisances]

    @cached_property
    def fitted_nuisances(self) -> tuple[Array, ...]:
        """``nuisances`` over the fitted samples."""
        return tuple(
            rows_where(session.fitted, own) for own, session in zip(self.nuisances, self.sessions, strict=True)
        )

    @cached_property
    def fitted_rows(self) -> tuple[Array, ...]:
        """``rows`` over the fitted samples."""
        return tuple(rows_where(session.fitted, rows) for rows, session in zip(self.rows, self.sessions, strict=True))

    @cached_property
    def products(self) -> tuple[Array, ...]:
        """(m + k, m + k) inner products of each session over the fitted samples; the k nuisances stand last."""
        return tuple(_products(rows, own) for rows, own in zip(self.fitted_rows, self.fitted_nuisances, strict=True))

    @cached_property
    def gram(self) -> Array:
        """(m, m) inner products of target and columns over all sessions, with flat nuisances projected out."""
        return np.asarray(sum(_without_last(*one) for one in zip(self.products, self.nuisance_counts, strict=True)))

    @cached_property
    def factors(self) -> tuple[Array, ...]:
        """(n, 6) for each session: smooth functions of load, direction, rate and time on which a size may depend."""
        return tuple(_factors(session, self.thresholds) for session in self.sessions)

    def without(self, names: Collection[str], sessions: Sequence[Session]) -> Linearised:
        """The same of ``sessions`` in which the candidates ``names`` are not sought."""
        left = [one for one in self.candidates if one.name not in names]
        kept = [*range(1 + self.baseline_count), *(k for one in left for k in one.columns)]
        place = {old: new for new, old in enumerate(kept)}
        candidates = tuple(replace(one, columns=tuple(place[k] for k in one.columns)) for one in left)
        rows = tuple(np.asfortranarray(columns[:, kept]) for columns in self.rows)
        return replace(self, sessions=tuple(sessions), rows=rows, scales=self.scales[kept], candidates=candidates)

    def noise_sd(self) -> float:
        """Standard deviation of what no column explains, noise or structure, counted once per correlation time."""
        whole = self.gram
        part = whole[1:, 1:] + np.diag(np.full(whole.shape[0] - 1, 1e-9 * np.trace(whole[1:, 1:]) / whole.shape[0]))
        found = np.linalg.solve(part, whole[1:, 0])
        left = []
        for session, rows, columns in zip(self.sessions, self.rows, self.nuisances, strict=True):
            residual = rows[:, 0] - rows[:, 1:] @ found
            mask = session.fitted
            fit = np.linalg.lstsq(columns[mask], residual[mask], rcond=None)[0]
            left.append(residual - columns @ fit)
        masks = [session.fitted for session in self.sessions]
        return effective_noise_sd(left, masks)


def marginal(rows: Array, session: Session, pole_per_s: float) -> Array:
    """(m, m) inner products of ``rows`` (n, m) over the fitted samples, with the session's nuisances projected out."""
    past = nuisances(session, pole_per_s)[session.fitted]
    return _without_last(_products(rows[session.fitted], past), past.shape[1])


def rows_where(mask: Mask, columns: Array) -> Array:
    """The rows of (n, m) columns where ``mask``, each column contiguous; ``columns`` itself if that is all."""
    if mask.all():
        return columns
    kept = np.flatnonzero(mask)
    ends = np.flatnonzero(np.diff(kept) > 1) + 1
    if 100 * ends.size >= kept.size:
        return np.take(columns.T, kept, axis=1).T
    out = np.empty((kept.size, columns.shape[1]), order="F")
    for first, last in pairwise((0, *ends, kept.size)):  # long pieces are copied ten times as fast
        out[first:last] = columns[kept[first] : kept[first] + last - first]
    return out


def _power(columns: Array) -> Array:
    """(m,) sums of squares of columns (n, m)."""
    return np.asarray(np.einsum("nk,nk->k", columns, columns))


def _products(seen: Array, past: Array) -> Array:
    """(m + k, m + k) inner products of rows (n, m) and nuisances (n, k), the latter last."""
    cross = seen.T @ past
    return np.block([[seen.T @ seen, cross], [cross.T, past.T @ past]])


def _without_last(products: Array, count: int) -> Array:
    """(m, m) of products (m + count, m + count), with the last ``count`` columns projected out."""
    last, cross = products[-count:, -count:], products[-count:, :-count]
    return np.asarray(products[:-count, :-count] - cross.T @ np.linalg.solve(ridged(last), cross))


def ridged(inner: Array, share: float = 1e-12) -> Array:
    """(k, k) inner products with a ridge of a ``share`` of their trace, so that collinear columns can be solved for."""
    held = inner.copy()
    held.flat[:: inner.shape[0] + 1] += share * max(float(np.trace(inner)), 1e-12)
    return held


def cosines(inner: Array) -> Array:
    """(k, k) cosines of columns from their inner products (k, k); 0 for a column of zeros."""
    norm = np.sqrt(np.maximum(np.diag(inner), 1e-300))
    return np.asarray(inner / np.outer(norm, norm))


def linearised(
    model: ExtendedModel, sessions: Sequence[Session], thresholds: Thresholds, nearby: Linearised | None = None
) -> Linearised:
    """The columns about ``model``; columns of ``nearby``, a similar model, serve effects that are in neither."""
    fitted = fitted_of(sessions)
    inside = {part.name: part for part in model.parts}
    outside = [e for e in available_effects(fitted, thresholds) if e.name not in inside]
    channels = logged_channels(fitted)
    present = excitation_of(fitted, thresholds).tells_apart
    apart = {one.name: is_told_from_its_family(one, present) for one in (*outside, *(p.effect for p in model.parts))}
    candidates: list[Candidate] = []
    place = 4
    for part in model.parts:
        candidates.append(Candidate(part.effect, _shape_of(part.effect, part.values), (place,), apart[part.name]))
        place += 1
    for effect in outside:
        strengths = sum(parameter.null is not None for parameter in effect.parameters)
        for shape in effect.shapes_with(channels):
            own = tuple(range(place, place + strengths))
            candidates.append(Candidate(effect, shape, own, apart[effect.name]))
            place += strengths
    known = {} if nearby is None else nearby.places
    kept = [one for one in candidates[len(model.parts) :] if _place(one) in known]
    beyond = [
        (one, model.extended_by(one.effect, one.effect.start(one.shape)))
        for one in candidates[len(model.parts) :]
        if _place(one) not in known
    ]
    reduced = [model.without(part.name) for part in model.parts]
    rows = []
    for k, session in enumerate(fitted):
        trace = model.trace(session.conditions)
        reading, slopes = model.sensitivities(session.conditions, trace)
        columns = np.empty((reading.size, place), order="F")
        columns[:, 0] = session.reading - reading
        columns[:, 1:4] = slopes[:, :3]
        for column, without in enumerate(reduced, start=4):
            columns[:, column] = reading - without.simulate(session.conditions)
            columns[:, 0] += columns[:, column]
        for added, by in beyond:
            first = added.columns[0]
            model.column_of(by, session.conditions, trace, columns[:, first : first + len(by)])
        for one in kept:
            assert nearby is not None
            of = list(known[_place(one)])
            columns[:, list(one.columns)] = nearby.rows[k][:, of] * nearby.scales[of]
        rows.append(columns)
    power = np.sum([_power(rows_where(one.fitted, part)) for part, one in zip(rows, fitted, strict=True)], axis=0)
    _refuse_non_finite(power, candidates)
    count = sum(int(s.fitted.sum()) for s in fitted)
    scales = np.sqrt(power / count)
    scales[0] = 1.0
    scales[scales < FLOOR] = 1.0  # a column below any noise is rounding, and is not scaled up
    for columns in rows:
        columns /= scales
    return Linearised(model, fitted, tuple(rows), scales, 3, tuple(candidates), thresholds)


def _place(one: Candidate) -> tuple[str, tuple[float, ...]]:
    """The key of a candidate: its effect and shape."""
    return one.name, tuple(one.shape.values())


def _refuse_non_finite(power: Array, candidates: Sequence[Candidate]) -> None:
    """Raises `UsageError` for a candidate whose columns, of ``power`` (m,), are not finite: no search would end."""
    for one in candidates:
        if not np.isfinite(power[list(one.columns)]).all():
            at = ", ".join(f"{name} = {value:g}" for name, value in one.shape.items())
            raise UsageError(
                f"{origin_of(one.name)} gives readings that are no finite numbers{' at ' + at if at else ''}: mend its"
                " apply, or uninstall the package that offers it"
            )


def _shape_of(effect: Effect, values: Array) -> dict[str, float]:
    """The shape parameters among an effect's ``values``."""
    return {p.name: float(v) for p, v in zip(effect.parameters, values, strict=True) if p.null is None}


def directions(thresholds: Thresholds) -> int:
    """The number of `departures` of an equation: six factors of its size, and a lag for each time constant."""
    return 6 + len(thresholds.memory_s)


def departures(given: Linearised, column: Sequence[Array]) -> list[Array]:
    """(n, `directions`) for each session: directions in which laws depart from an equation, each of the column's rms.

    ``column`` (n,) is the signature of the equation. Other laws of its kind depend otherwise on load, direction, rate
    and time, or follow with other time constants: so the directions are the signature times smooth functions of these,
    and its lags. A departure is in proportion to the effect (Kennedy and O'Hagan 2001).
    """
    out, power, size = [], np.zeros(directions(given.thresholds)), 0.0
    for session, factors, own in zip(given.sessions, given.factors, column, strict=True):
        part = np.empty((own.size, power.size), order="F")
        np.multiply(own[:, None], factors, out=part[:, : -len(given.thresholds.memory_s)])
        for k, tau_s in enumerate(given.thresholds.memory_s, start=factors.shape[1]):
            np.subtract(lagged(own, session.conditions.step_s, tau_s), own, out=part[:, k])
        power += _power(rows_where(session.fitted, part))
        size += float(np.sum(own[session.fitted] ** 2))
        out.append(part)
    ratio = np.minimum(np.sqrt(size / np.maximum(power, 1e-300)), 1e6)
    for part in out:
        part *= ratio
    return out


def _factors(session: Session, thresholds: Thresholds) -> Array:
    """(n, 6) Legendre polynomials of load and time, direction, and logarithm of the rate."""
    load, rate = session.conditions.load, session.conditions.rate_per_s
    time_s, step_s = session.conditions.time_s, session.conditions.step_s
    still = thresholds.still_per_s
    linear = 2.0 * load - 1.0
    direction = rate / np.sqrt(rate**2 + still**2)
    speed = np.log10(1.0 + np.abs(rate) / still) - 1.0
    elapsed = 2.0 * time_s / max(float(time_s[-1]), step_s) - 1.0
    found = [linear, 1.5 * linear**2 - 0.5, direction, speed, elapsed, 1.5 * elapsed**2 - 0.5]
    return np.asfortranarray(np.column_stack(found))
