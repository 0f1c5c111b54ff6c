"""Sensitivities of the reading to everything that could be wrong: the columns that all inference works on.

The model is linearised about a fit. Its own parameters, each effect of the catalogue at each point of its shapes, and
each flexible block give columns; an effect that is already in the model gives its whole contribution. Each recording
has nuisances of its own, an offset, what an earlier load left in the relaxing arm and, where they differ by it, a gain;
they are marginalised exactly (flat and Gaussian priors), so that no zero is ever assumed.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np

from smartshoe.arrays import Array, Mask
from smartshoe.diagnosis._excitation import excitation_of
from smartshoe.diagnosis._noise import FLOOR, correlated_sd
from smartshoe.diagnosis._session import Session, fitted_of, have_later_cycles
from smartshoe.errors import UsageError
from smartshoe.integrity.thresholds import Thresholds
from smartshoe.models.effects import Effect, blocks, catalogue, is_told_from_its_family, origin_of
from smartshoe.models.effects.exposure import CHANNELS
from smartshoe.models.extended import ExtendedModel
from smartshoe.signals.lags import lagged

NO_PRESSURES = frozenset({"force", "length", "resistance", "capacitance", "angle"})  # as a voltage or counts may be


@dataclass(frozen=True, eq=False)
class Candidate:
    """An effect, or a flexible block, at one point of its shapes, and where its strengths' columns stand.

    ``is_apart``: the data tells its branch from the others of its family.
    """

    effect: Effect
    shape: Mapping[str, float]
    columns: tuple[int, ...]
    is_apart: bool = True

    @property
    def name(self) -> str:
        """The effect's identifier."""
        return self.effect.name

    @property
    def branch(self) -> str:
        """Of what there is one in a unit: a law, or a flexible block in its place, of each branch of a family."""
        return (self.is_apart and self.effect.branch) or self.effect.kind

    @property
    def slot(self) -> str:
        """Of what a search puts one in a set: of each branch, but of all curves one, since they bend for each other."""
        return self.effect.kind if self.effect.is_memoryless else self.branch

    def start(self, strengths: Array) -> Array:
        """Parameter values (p,) with these changes of the strengths from null, within their bounds."""
        values = self.effect.start(self.shape)
        k = 0
        for j, parameter in enumerate(self.effect.parameters):
            if parameter.null is not None:
                values[j] = min(max(parameter.null + strengths[k], parameter.lower), parameter.upper)
                k += 1
        return values

    def has_sign_of(self, strengths: Array) -> bool:
        """Whether changes (k,) of the strengths lie on the side of null that physics allows."""
        bounded = [p for p in self.effect.parameters if p.null is not None]
        return all(
            (p.lower < p.null or value >= 0.0) and (p.upper > p.null or value <= 0.0)
            for p, value in zip(bounded, strengths, strict=True)
            if p.null is not None
        )


def is_remembered_by_gas(effect: Effect) -> bool:
    """Whether it is what a gas remembers, which shows in its pressure alone."""
    return effect.stage == "gas" and not effect.is_memoryless


def available(sessions: Sequence[Session], thresholds: Thresholds) -> list[Effect]:
    """Physical effects and flexible blocks whose channels were logged throughout.

    Not those that shift load or reading by one value, which no waveform tells from a recording's own offset
    (`smartshoe.diagnosis._zero`); nor those that only later load cycles show, where no recording has any. Of a pressure
    that falls in holds the gas is the cause; of other readings the sensor may be, too.
    """
    has = logged_channels(sessions)
    has_cycles = have_later_cycles(sessions, thresholds)
    flexible = [block for family in blocks().values() for block in family]
    found = [e for e in (*catalogue().values(), *flexible) if e.is_physical and e.shifts is None]
    if any(one.is_no_gas for one in sessions):
        found = [e for e in found if not is_remembered_by_gas(e)]
    if not any(one.recording.sensor.unit.quantity == "pressure" for one in sessions):
        found = [e.of_any_sensor() for e in found]
    return [e for e in found if e.needs <= has and not e.is_refinement and (has_cycles or not e.needs_cycles)]


def logged_channels(sessions: Sequence[Session]) -> set[str]:
    """What every recording holds besides load and reading, in the words of `smartshoe.models.effects.exposure`."""
    channels = (("temperature", "temperature_k"), ("neighbour", "neighbour"))
    logged = {name for name, field in channels if all(getattr(s.conditions, field) is not None for s in sessions)}
    begin_apart = "temperature" in logged and any(s.conditions.begins_warmer_k for s in sessions)
    return logged | ({"temperatures"} if begin_apart else set())


def logged_words(sessions: Sequence[Session]) -> frozenset[str]:
    """`logged_channels`, and the columns that every recording has under such a word, of which no effect knows."""
    columns = set.intersection(*({*one.recording.channels} for one in sessions))
    return frozenset(logged_channels(sessions) | (CHANNELS & columns))


def nuisances(session: Session, pole_per_s: float, read: Array | float = 0.0) -> Array:
    """(n, 2 + k): one, and exp(-p t), the memory that the unit brings along from before the recording.

    After them, for each gain of its own: by how much that moves what a model has ``read`` (n,); from each moment on at
    which its zero changes, by how much it may; and after each long gap a memory again, of a load that nobody knows.
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
    """(2 + k, 2 + k) prior precision of the nuisances: none of the offset, that of an unknown past of the arm's.

    A unit that begins loaded has been loaded for an unknown time: all that the arm holds is open. One that begins at
    rest still carries some of what went before. One more row for each gain of its own, each change of its zero, and
    each long gap, in which any load may have come.
    """
    sd = past_sd(session, model)
    gap_sd = max(abs(model.relaxing_share) * abs(model.gain) * float(np.max(session.conditions.load)), FLOOR)
    return a_nuisance_each(session, offset=0.0, past=1.0 / sd**2, change=1.0, gap=1.0 / gap_sd**2)


def past_sd(session: Session, model: ExtendedModel) -> float:
    """Standard deviation of what the arm brings along: of the load that it begins with, ``unknown_past`` at least."""
    held = abs(model.relaxing_share) * abs(model.gain)
    return max(held * max(float(np.abs(session.conditions.load[0])), session.unknown_past), FLOOR)


def a_nuisance_each(session: Session, *, offset: float, past: float, change: float, gap: float) -> Array:
    """(2 + k, 2 + k) diagonal: a number for each column of `nuisances`, in their order."""
    changes = [change] * (len(session.gain_parts) + len(session.zero_changes))
    return np.diag([offset, past, *changes, *[gap] * len(session.gap_ends)])


@dataclass(frozen=True, eq=False)
class Linearised:
    """A model's columns over what may be fitted.

    ``rows``, a session each (n, m): target, own parameters, candidates' strengths. The target is the residual with the
    contributions of the model's effects put back. ``own``: number of baseline columns. Columns are scaled so that a
    coefficient is the rms by which it moves the reading, in shares of full scale; ``scales`` (m,) undoes that.
    """

    model: ExtendedModel
    sessions: tuple[Session, ...]
    rows: tuple[Array, ...]
    scales: Array
    own: int
    candidates: tuple[Candidate, ...]
    thresholds: Thresholds

    @cached_property
    def shapes(self) -> Mapping[str, int]:
        """At how many points of its shapes each effect stands."""
        return Counter(one.name for one in self.candidates)

    @property
    def places(self) -> dict[tuple[str, tuple[float, ...]], tuple[int, ...]]:
        """Where the strengths' columns of what is not in the model stand, by effect and shape."""
        return {_place(one): one.columns for one in self.candidates[len(self.model.parts) :]}

    @cached_property
    def nuisances(self) -> tuple[Array, ...]:
        """(n, k) a session: what is its own."""
        pole_per_s, read = self.model.pole_per_s, self.model.simulate
        return tuple(
            nuisances(one, pole_per_s, read(one.conditions) if one.own_gain_sd else 0.0) for one in self.sessions
        )

    @property
    def nuisance_counts(self) -> list[int]:
        """k, a session."""
        return [own.shape[1] for own in self.nuisances]

    @cached_property
    def past(self) -> tuple[Array, ...]:
        """``nuisances`` where they may be fitted."""
        return tuple(where(session.fitted, own) for own, session in zip(self.nuisances, self.sessions, strict=True))

    @cached_property
    def seen(self) -> tuple[Array, ...]:
        """``rows`` where they may be fitted."""
        return tuple(where(session.fitted, rows) for rows, session in zip(self.rows, self.sessions, strict=True))

    @cached_property
    def products(self) -> tuple[Array, ...]:
        """(m + k, m + k) a session: inner products over what is fitted, the k nuisances' last."""
        return tuple(_products(seen, past) for seen, past in zip(self.seen, self.past, strict=True))

    @cached_property
    def gram(self) -> Array:
        """(m, m) inner products of the target and all columns, in order, over all sessions; flat nuisances are out."""
        return np.asarray(sum(_without_last(*one) for one in zip(self.products, self.nuisance_counts, strict=True)))

    @cached_property
    def factors(self) -> tuple[Array, ...]:
        """(n, 6) a session: smooth functions of load, direction, rate and time, on which a size may depend."""
        return tuple(_factors(session, self.thresholds) for session in self.sessions)

    def noise_sd(self) -> float:
        """Standard deviation of what no column reaches, noise or structure, each correlation time counted once."""
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
        return correlated_sd(left, masks)


def marginal(rows: Array, session: Session, pole_per_s: float) -> Array:
    """(m, m) inner products of ``rows`` (n, m) over the fitted samples with the session's nuisances taken out."""
    past = nuisances(session, pole_per_s)[session.fitted]
    return _without_last(_products(rows[session.fitted], past), past.shape[1])


def where(mask: Mask, columns: Array) -> Array:
    """Rows of (n, m) columns, each column in one piece; themselves where none is left out."""
    if mask.all():
        return columns
    kept = np.flatnonzero(mask)
    ends = np.flatnonzero(np.diff(kept) > 1) + 1
    if 100 * ends.size >= kept.size:
        return np.take(columns.T, kept, axis=1).T
    out = np.empty((kept.size, columns.shape[1]), order="F")
    for first, last in pairwise((0, *ends, kept.size)):  # whole load cycles: long pieces take a tenth of the time
        out[first:last] = columns[kept[first] : kept[first] + last - first]
    return out


def _power(columns: Array) -> Array:
    """(m,) sums of squares of columns (n, m)."""
    return np.asarray(np.einsum("nk,nk->k", columns, columns))


def _products(seen: Array, past: Array) -> Array:
    cross = seen.T @ past
    return np.block([[seen.T @ seen, cross], [cross.T, past.T @ past]])


def _without_last(products: Array, count: int) -> Array:
    """(m, m) inner products (m + count, m + count) with what the last ``count`` columns follow taken out."""
    last, cross = products[-count:, -count:], products[-count:, :-count]
    return np.asarray(products[:-count, :-count] - cross.T @ np.linalg.solve(ridged(last), cross))


def ridged(inner: Array) -> Array:
    """(k, k) inner products with a trillionth more on the diagonal: columns that are alike can be solved for."""
    held = inner.copy()
    held.flat[:: inner.shape[0] + 1] += 1e-12 * max(float(np.trace(inner)), 1e-12)
    return held


def cosines(inner: Array) -> Array:
    """(k, k) cosines of the columns whose inner products (k, k) are given; 0 with a column of nothing."""
    norm = np.sqrt(np.maximum(np.diag(inner), 1e-300))
    return np.asarray(inner / np.outer(norm, norm))


def linearised(
    model: ExtendedModel, sessions: Sequence[Session], thresholds: Thresholds, beside: Linearised | None = None
) -> Linearised:
    """The columns about ``model``; ``beside``: those about a model nearby, which serve for what is in neither."""
    fitted = fitted_of(sessions)
    inside = {part.name: part for part in model.parts}
    outside = [e for e in available(fitted, thresholds) if e.name not in inside]
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
    known = {} if beside is None else beside.places
    kept = [one for one in candidates[len(model.parts) :] if _place(one) in known]
    beyond = [
        (one, model.extended_by(one.effect, one.effect.start(one.shape)))
        for one in candidates[len(model.parts) :]
        if _place(one) not in known
    ]
    less = [model.without(part.name) for part in model.parts]
    rows = []
    for k, session in enumerate(fitted):
        trace = model.trace(session.conditions)
        reading, slopes = model.sensitivities(session.conditions, trace)
        columns = np.empty((reading.size, place), order="F")
        columns[:, 0] = session.reading - reading
        columns[:, 1:4] = slopes[:, :3]
        for column, without in enumerate(less, start=4):
            columns[:, column] = reading - without.simulate(session.conditions)
            columns[:, 0] += columns[:, column]
        for added, by in beyond:
            first = added.columns[0]
            model.column_of(by, session.conditions, trace, columns[:, first : first + len(by)])
        for one in kept:
            assert beside is not None
            of = list(known[_place(one)])
            columns[:, list(one.columns)] = beside.rows[k][:, of] * beside.scales[of]
        rows.append(columns)
    power = np.sum([_power(where(one.fitted, part)) for part, one in zip(rows, fitted, strict=True)], axis=0)
    _refuse_endless(power, candidates)
    count = sum(int(s.fitted.sum()) for s in fitted)
    scales = np.sqrt(power / count)
    scales[0] = 1.0
    scales[scales < FLOOR] = 1.0  # what is less than any noise is rounding, and is not made as large as the others
    for columns in rows:
        columns /= scales
    return Linearised(model, fitted, tuple(rows), scales, 3, tuple(candidates), thresholds)


def _place(one: Candidate) -> tuple[str, tuple[float, ...]]:
    return one.name, tuple(one.shape.values())


def _refuse_endless(power: Array, candidates: Sequence[Candidate]) -> None:
    """Raises `UsageError` for a candidate whose columns, of ``power`` (m,), hold no number: no search would end."""
    for one in candidates:
        if not np.isfinite(power[list(one.columns)]).all():
            at = ", ".join(f"{name} = {value:g}" for name, value in one.shape.items())
            raise UsageError(
                f"{origin_of(one.name)} gives readings that are no finite numbers{' at ' + at if at else ''}: mend its"
                " apply, or uninstall the package that offers it"
            )


def _shape_of(effect: Effect, values: Array) -> dict[str, float]:
    return {p.name: float(v) for p, v in zip(effect.parameters, values, strict=True) if p.null is None}


def directions(thresholds: Thresholds) -> int:
    """How many `departures` an equation has: six factors of its size, and a lag for each time constant."""
    return 6 + len(thresholds.memory_s)


def departures(given: Linearised, column: Sequence[Array]) -> list[Array]:
    """(n, `directions`) a session: those in which a law departs from an equation of its kind, each of the column's rms.

    ``column`` (n,) is the equation's own signature. A law of the same kind has its size depend otherwise on the load,
    the direction, the rate and the time, or follows with other time constants: the signature times smooth functions of
    these, and its lags. So a departure is in proportion to the effect (Kennedy and O'Hagan 2001).
    """
    out, power, size = [], np.zeros(directions(given.thresholds)), 0.0
    for session, factors, own in zip(given.sessions, given.factors, column, strict=True):
        part = np.empty((own.size, power.size), order="F")
        np.multiply(own[:, None], factors, out=part[:, : -len(given.thresholds.memory_s)])
        for k, tau_s in enumerate(given.thresholds.memory_s, start=factors.shape[1]):
            np.subtract(lagged(own, session.conditions.step_s, tau_s), own, out=part[:, k])
        power += _power(where(session.fitted, part))
        size += float(np.sum(own[session.fitted] ** 2))
        out.append(part)
    ratio = np.minimum(np.sqrt(size / np.maximum(power, 1e-300)), 1e6)
    for part in out:
        part *= ratio
    return out


def _factors(session: Session, thresholds: Thresholds) -> Array:
    load, rate = session.conditions.load, session.conditions.rate_per_s
    time_s, step_s = session.conditions.time_s, session.conditions.step_s
    still = thresholds.still_per_s
    linear = 2.0 * load - 1.0
    direction = rate / np.sqrt(rate**2 + still**2)
    speed = np.log10(1.0 + np.abs(rate) / still) - 1.0
    elapsed = 2.0 * time_s / max(float(time_s[-1]), step_s) - 1.0
    found = [linear, 1.5 * linear**2 - 0.5, direction, speed, elapsed, 1.5 * elapsed**2 - 0.5]
    return np.asfortranarray(np.column_stack(found))
