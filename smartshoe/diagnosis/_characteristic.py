"""The static characteristic, reading over load, without a model: what can be said where no model of a unit holds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from smartshoe.arrays import Array, Mask
from smartshoe.integrity.thresholds import Thresholds
from smartshoe.recording import Recording
from smartshoe.signals.lags import lagged, left_by


@dataclass(frozen=True, eq=False)
class Branches:
    """Medians of the reading over bins of the load (n,), while it rises (``ups``) and while it falls (``downs``).

    ``by_curve`` and ``by_branch`` are the shares of the reading's variance that their mean, and the two branches,
    explain.
    """

    recording: Recording
    place: Array
    ups: Array
    downs: Array
    by_curve: float
    by_branch: float

    @property
    def mean(self) -> Array:
        """(n,) the static characteristic: the mean of both branches."""
        return 0.5 * (self.ups + self.downs)

    @property
    def separation(self) -> float:
        """By how much the reading is higher while the load rises, the median over the load."""
        return float(np.median(self.ups - self.downs))


@dataclass(frozen=True, eq=False)
class _Strokes:
    """``load`` and ``reading`` (n,) where both are present, and the ``rate`` (n,) of the load in arbitrary units."""

    load: Array
    reading: Array
    rate: Array
    still: float

    def explained_by(self, place: Array, ups: Array, downs: Array) -> float:
        """Share of the variance of moving samples that two branches over ``place``, (bins,) each, explain."""
        moves = np.abs(self.rate) > self.still
        along = [np.interp(self.load[moves], place, branch) for branch in (ups, downs)]
        return _explained(self.reading[moves], np.where(self.rate[moves] > 0.0, *along))


def _strokes_of(recording: Recording, thresholds: Thresholds) -> _Strokes | None:
    """The samples of a recording with one load and one sensor; None where there are too few, or nothing moves."""
    if not recording.of_role("load") or len(recording.sensors) != 1:
        return None
    load, sensor = recording.load, recording.sensor
    present = load.present & sensor.present
    x, y = load.values[present], sensor.values[present]
    if x.size < thresholds.least_samples or np.ptp(x) == 0.0 or np.ptp(y) == 0.0:
        return None
    width = max(1, round(0.5 * thresholds.echo_s / recording.sample_time_s))
    if x.size < width:
        return None
    rate = np.gradient(np.convolve(x, np.ones(width), "same"))  # its scale does not matter
    still = thresholds.standing * float(np.quantile(np.abs(rate), 1.0 - thresholds.faulty_share))
    return _Strokes(x, y, rate, still)


def branches_of(recording: Recording, thresholds: Thresholds) -> Branches | None:
    """The two branches; None where the load seldom passes a place in both directions."""
    strokes = _strokes_of(recording, thresholds)
    if strokes is None:
        return None
    x, y, rate = strokes.load, strokes.reading, strokes.rate
    low, high = (float(value) for value in np.percentile(x, [1, 99]))
    # Rice's rule, for each direction's half.
    bins = 2 * round((0.5 * x.size) ** (1.0 / 3.0))
    edges = np.linspace(low, high, bins + 1)
    rises, falls = (_by_bin(x[moves], y[moves], edges) for moves in (rate > strokes.still, rate < -strokes.still))
    at, ups, downs = [], [], []
    for left, right, up, down in zip(edges[:-1], edges[1:], rises, falls, strict=True):
        if min(up.size, down.size) > 2:
            at.append(0.5 * (left + right))
            ups.append(float(np.median(up)))
            downs.append(float(np.median(down)))
    if len(at) < bins // 2:
        return None
    place, rising, falling = np.array(at), np.array(ups), np.array(downs)
    by_curve = _explained(y, np.interp(x, place, 0.5 * (rising + falling)))
    return Branches(recording, place, rising, falling, by_curve, strokes.explained_by(place, rising, falling))


def _by_bin(x: Array, y: Array, edges: Array) -> list[Array]:
    """The values ``y`` whose ``x`` lie in each bin between ``edges`` (m + 1,), in order."""
    number = np.digitize(x, edges)
    order = np.argsort(number, kind="stable")
    return np.split(y[order], np.searchsorted(number[order], np.arange(1, edges.size + 1)))[1:-1]


def friction_of(recording: Recording, thresholds: Thresholds) -> str | None:
    """A sentence where the reading follows the direction of the load and not the load; else None."""
    found = branches_of(recording, thresholds)
    if found is None or found.by_curve >= thresholds.follows or found.by_branch < thresholds.follows:
        return None
    return _friction(found, thresholds)


def _is_reproducible(recording: Recording, thresholds: Thresholds) -> bool:
    """Whether the branches of each half explain the other half, which chance branches would not."""
    middle = len(recording) // 2
    halves = [recording.taken(part) for part in (slice(0, middle), slice(middle, None))]
    for half, other in (halves, reversed(halves)):
        found, strokes = branches_of(half, thresholds), _strokes_of(other, thresholds)
        if found is None or strokes is None:
            return False
        if strokes.explained_by(found.place, found.ups, found.downs) < thresholds.follows:
            return False
    return True


def _fades(found: Branches, thresholds: Thresholds) -> bool:
    """Whether the reading fades while the load is still, as charge does; friction stays, or is gone at once.

    Then a linear model of the load and its lag leaves clearly less there than the branches.
    """
    strokes = _strokes_of(found.recording, thresholds)
    if strokes is None:
        return False
    still = np.abs(strokes.rate) <= strokes.still
    if np.count_nonzero(still) < thresholds.least_samples:
        return False
    moved = np.maximum.accumulate(np.where(still, 0, np.arange(still.size)))
    ups, downs, mean = (np.interp(strokes.load, found.place, one) for one in (found.ups, found.downs, found.mean))
    by_branches = [strokes.reading - one for one in (np.where(strokes.rate[moved] > 0.0, ups, downs), mean)]
    step_s, plain = found.recording.sample_time_s, [np.ones(still.size), strokes.load]
    by_fading = [
        left_by(np.column_stack([*plain, lagged(strokes.load, step_s, memory_s)]), strokes.reading)
        for memory_s in thresholds.memory_s
    ]
    of_branches, of_fading = (min(float(np.var(one[still])) for one in some) for some in (by_branches, by_fading))
    return thresholds.clear * of_fading < of_branches


def _friction(found: Branches, thresholds: Thresholds) -> str | None:
    """The sentence on friction, where the branches are reproducible and do not fade; else None."""
    if not _is_reproducible(found.recording, thresholds) or _fades(found, thresholds):
        return None
    sensor = found.recording.sensor
    half = 0.5 * found.separation
    return (
        f"the {sensor.name} of {found.recording.name} does not follow this load but its direction: while the load rises"
        f" it lies {abs(half):.3g} {sensor.unit.symbol} {'above' if half > 0 else 'below'} its mean, while it falls as"
        " much to the other side, which is friction; Coulomb's and viscous friction are told apart by strokes at"
        " several rates only"
    )


def characteristic_of(recording: Recording, thresholds: Thresholds) -> str | None:
    """A sentence on the curve and loop of the reading over its load; None where they hardly go together."""
    found = branches_of(recording, thresholds)
    if found is None or max(found.by_curve, found.by_branch) < thresholds.follows:
        return None
    if found.by_curve < thresholds.follows:
        return _friction(found, thresholds)
    sensor, place = recording.sensor, found.place
    half_span = 0.5 * float(place[-1] - place[0])
    u = (place - 0.5 * (place[0] + place[-1])) / half_span
    unit, of_load = sensor.unit.symbol, recording.load.unit.symbol
    course = f"over this load the {sensor.name}"
    inner, lower, upper = np.abs(u) < 0.25, u < -0.5, u > 0.5
    if min(inner.sum(), lower.sum(), upper.sum()) < 3:  # a line needs three medians
        whole = _slope(place, found.mean, np.full(place.size, True))
        way = "falls" if whole < 0.0 else "rises"
        shape = (
            f"{course} {way} by {abs(whole):.3g} {unit}/{of_load} on the whole: too little was recorded to tell its"
            " shape"
        )
    else:
        middle = _slope(place, found.mean, inner)
        ends = 0.5 * (_slope(place, found.mean, upper) + _slope(place, found.mean, lower))
        is_odd = all(has_two_signs(one, thresholds) for one in (place, found.mean))
        sign = -1.0 if middle < 0.0 and ends < 0.0 else 1.0
        shape = (
            f"{course} {'falls' if sign < 0 else 'rises'} by {sign * middle:.3g} {unit}/{of_load} about the middle and"
            f" by {sign * ends:.3g} {unit}/{of_load} at the ends:"
            f" {_shape(middle, ends, is_odd, thresholds)}"
        )
    apart = 0.5 * float(np.median(np.abs(found.ups - found.downs)[np.abs(u) < 0.5]))
    return f"{shape}; loading and unloading lie {apart:.3g} {unit} to either side of it"


def has_two_signs(values: Array, thresholds: Thresholds) -> bool:
    """Whether values lie on both sides of zero, about equally far."""
    low, high = float(values.min()), float(values.max())
    return low < 0.0 < high and min(-low, high) > thresholds.same * max(-low, high)


def _shape(middle: float, ends: float, is_odd: bool, thresholds: Thresholds) -> str:
    """The shape of a curve in words, from its slope in the middle and at the ends.

    Friction is named only where load and reading change sign together (``is_odd``), since any contact flattens.
    """
    if middle * ends < 0.0:
        return "it turns back, and no straight line describes it"
    if thresholds.clear * abs(ends) < abs(middle):
        if is_odd:
            return "it flattens, as friction does that saturates, and no straight line or linear damping describes it"
        return "it flattens, and no straight line describes it"
    if abs(ends) > thresholds.clear * abs(middle):
        return "it steepens towards the ends, and no straight line describes it"
    return "it is nearly straight"


def conductance_of(recordings: Sequence[Recording], thresholds: Thresholds) -> str | None:
    """A sentence where the readings are resistances whose conductance is far more linear in the load; else None.

    Contacts that grow with the load conduct in proportion to it (Holm 1967).
    """
    if any(one.sensor.unit.quantity != "resistance" for one in recordings):
        return None
    by_line = []
    for load, sensor in ((one.load, one.sensor) for one in recordings):
        present = load.present & sensor.present
        x, y = load.values[present], sensor.values[present]
        if min(np.ptp(x), np.ptp(y)) == 0.0 or y.min() <= 0.0:
            return None
        by_line.append([_by_line(x, y), _by_line(x, 1.0 / y)])
    resistance, conductance = np.mean(by_line, axis=0)
    if thresholds.clear**2 * (1.0 - conductance) > 1.0 - resistance:
        return None
    return (
        f"a line of the load explains {100 * resistance:.0f} % of the resistance's variance and"
        f" {100 * conductance:.0f} % of the conductance's: diagnose that (a column of 1/{recordings[0].sensor.name}),"
        " whose curve is milder and hides less"
    )


def _by_line(x: Array, y: Array) -> float:
    """Share of the variance of ``y`` that a line of ``x`` explains."""
    return float(np.corrcoef(x, y)[0, 1]) ** 2


def _explained(values: Array, by: Array) -> float:
    """Share of the variance of ``values`` that a prediction ``by`` explains."""
    whole = float(np.var(values))
    return 1.0 - float(np.var(values - by)) / whole if whole > 0 else 0.0


def _slope(place: Array, level: Array, among: Mask) -> float:
    """Slope of ``level`` over ``place``, by least squares ``among`` the bins."""
    return float(np.polyfit(place[among], level[among], 1)[0])
