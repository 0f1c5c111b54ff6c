"""What the range of the load allows: a gain seen over a narrow range, or only within files, is a trap."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from smartshoe.arrays import Array, Mask
from smartshoe.diagnosis._excitation import excitation_of
from smartshoe.diagnosis._scale import Scale
from smartshoe.diagnosis._session import Session
from smartshoe.display import rounded
from smartshoe.integrity.thresholds import Thresholds
from smartshoe.models.effects.exposure import LATER_CYCLES, SAYS
from smartshoe.models.extended import ExtendedModel

GROUPS = 100  # the largest number of groups of similar loads: a resolution


@dataclass(frozen=True, slots=True)
class Ranges:
    """Sentences on the range, and whether the gain is a trap, so that no name can be trusted."""

    says: tuple[str, ...] = ()
    is_trap: bool = False


def ranges_of(sessions: Sequence[Session], unit: ExtendedModel, scale: Scale, thresholds: Thresholds) -> Ranges:
    """A sentence for each thing that the range of the fitted loads does not support; ``unit`` is the baseline."""
    said: list[str] = []
    fitted = [one for one in sessions if _has_enough(one.fitted)]
    if not fitted:
        return Ranges()
    pairs = [(one.conditions.load[one.fitted], one.reading[one.fitted]) for one in fitted]
    trap = False
    symbol = scale.unit.symbol
    to_physical = scale.reading / scale.load_n
    within = [_gain(load, reading, thresholds.follows) for load, reading in pairs]
    gains = [gain for gain in within if gain is not None]
    is_narrow = all(thresholds.clear * float(np.quantile(load, 0.01)) > float(load.max()) for load, _ in pairs)
    if is_narrow and all(gain is not None for gain in within):
        gain = float(np.median(gains)) or gains[0]  # between two that are opposite there is none
        through_zero = float(np.median([reading.mean() / load.mean() for load, reading in pairs]))
        lowest = min(range(len(pairs)), key=lambda k: float(pairs[k][0].min()))
        low, high = (float(of(pairs[lowest][0])) * scale.load_n for of in (np.min, np.max))
        is_gauge = scale.unit.quantity == "pressure"  # for others zero is a convention
        trap = is_gauge and not 1.0 / thresholds.clear < through_zero / gain < thresholds.clear
        # Where the mean was taken out its ratio to the load is noise.
        over_load = (
            "where the mean reading is next to nothing"
            if abs(through_zero) <= thresholds.standing * abs(gain)
            else f"where reading over load is {_gain_in_words(through_zero * to_physical, symbol)}"
        )
        said.append(
            f"each file's load stays within a narrow range ({low:.4g} to {high:.4g} N in"
            f" {fitted[lowest].recording.name}), in which the reading moves by"
            f" {_gain_in_words(gain * to_physical, symbol)}"
            + (
                f", {over_load}: load and reading may both follow a third thing (a reversal, a regulator), so that this"
                " gain is none to calibrate by, and no cause is named (if nothing presses at the lowest load shown,"
                " that is the load cell's tare: take it off the loads)"
                if trap
                else ": what lies below is extrapolated"
            )
        )
    low, high = min(float(load.min()) for load, _ in pairs), max(float(load.max()) for load, _ in pairs)
    if thresholds.clear * low > high and not any(within):
        trap = True
        said.append(
            f"the load stays at {rounded(low * scale.load_n, 3)} to {rounded(high * scale.load_n, 3)} N throughout, and"
            " the reading does not go with it: nothing shows how the unit answers a load, and no cause is named (load"
            " it over its range)"
        )
    said += _limit_flat_reading(pairs, scale, thresholds)
    judged = [one for one in sessions if not _has_enough(one.fitted) and _has_enough(one.judged)]
    beside = [_gain(one.conditions.load[one.judged], one.reading[one.judged], thresholds.follows) for one in judged]
    named = [one.recording.name for one in (*fitted, *judged)]
    said += _limit_foreign_gain(list(zip(named, (*within, *beside), strict=True)), thresholds)
    said += _limit_unlike_gain([*fitted, *judged], unit, thresholds)
    between = _gain_between_files(pairs, thresholds.same)
    if between is not None and all(gain is not None for gain in within):
        # Somewhere on its way a curve is as steep as its chord.
        over = [abs(gain / between) for gain in gains]
        if min(over) >= 1.0 + thresholds.same or max(over) * (1.0 + thresholds.same) <= 1.0:
            trap = trap or is_narrow
            said.append(
                f"within a file the reading moves by {float(np.median(gains)) * to_physical:.3g} {symbol}/N, between"
                f" the files by {between * to_physical:.3g} {symbol}/N: the gain within a file is not that of the unit,"
                " the zero of reading or load is another in each file, or the files are not of one unit"
            )
    return Ranges(tuple(said), trap)


def _gain_in_words(gain: float, unit: str) -> str:
    """A gain, and the load that moves the reading by one unit."""
    return f"{gain:.3g} {unit}/N ({1.0 / gain:.4g} N/{unit})"


def _has_enough(seen: Mask) -> bool:
    """Whether enough samples of a recording are ``seen`` (n,) for a gain."""
    return int(seen.sum()) > 10


def _limit_flat_reading(pairs: Sequence[tuple[Array, Array]], scale: Scale, thresholds: Thresholds) -> list[str]:
    """The sentence on a reading that stands still over the upper loads, as at a mechanical stop.

    In the recording of the highest load, medians of the reading over the upper share `same` of its loads, or more,
    differ from the last by less than `standing` of its span. How far the loads reach goes by medians too, since the
    very highest may be few samples, which the median of a reading that follows does not show either.
    """
    load, reading = max(pairs, key=lambda one: float(one[0].max()))
    order = np.argsort(load)
    groups = np.array_split(order, max(1, min(order.size // thresholds.few, GROUPS)))
    levels = np.array([float(np.median(reading[group])) for group in groups])
    moves = np.abs(levels - levels[-1]) >= thresholds.standing * float(np.ptp(reading))
    first = int(np.flatnonzero(moves)[-1]) + 1 if moves.any() else 0
    begins, ends = (float(np.median(load[groups[k]])) for k in (first, -1))
    if ends - begins < thresholds.same * float(np.ptp(load)) or first + 1 >= len(groups):
        return []
    return [
        f"above {rounded(begins * scale.load_n, 3)} N the reading stands still, to {100.0 * thresholds.standing:g} % of"
        " its span: no force can be told there, and none that is compensated is to be believed"
    ]


def _limit_foreign_gain(gains: Sequence[tuple[str, float | None]], thresholds: Thresholds) -> list[str]:
    """Sentences on files whose gain is many times that of the first, or of the other sign."""
    known = [(name, gain) for name, gain in gains if gain]
    most = thresholds.clear**2  # the square of a clear difference
    if not known:
        return []
    first, usual = known[0]
    far = [(name, gain / usual) for name, gain in known if not 1.0 / most < gain / usual < most]
    return [
        f"{name} reads {ratio:.3g} times what {first} does under the same load: is it in another unit, of the other"
        " sign, or of another sensor?"
        for name, ratio in far
    ]


def _limit_unlike_gain(sessions: Sequence[Session], unit: ExtendedModel, thresholds: Thresholds) -> list[str]:
    """Sentences on files whose gain differs from that of the first by more than equal gains do.

    Compared over loads that both have, and only where these are as high and as fast, so that neither a curve nor a rate
    explains it. What holds more or less of its load relaxes more or less: the readings over what the baseline ``unit``
    simulates must differ as well. Recordings that only judge are asked too. Far larger ratios are left to
    `_limit_foreign_gain`.
    """
    first, *others = sessions
    name = first.recording.name
    said = []
    for one in others:
        # All recorded loads count here, held out or not.
        if not all(_near(of(first, first.usable), of(one, one.usable), thresholds.same) for of in (_fastest, _highest)):
            continue
        known = [(file, file.fitted if file.fitted.any() else file.judged) for file in (first, one)]
        most = min(_highest(*each) for each in known)
        seen = [(file, mask & (file.conditions.load <= most)) for file, mask in known]
        of_load = _gain_ratio([(file.conditions.load[at], file.reading[at]) for file, at in seen], thresholds)
        if of_load is None:
            continue
        relaxed = ((unit.simulate(file.conditions)[at], file.reading[at]) for file, at in seen)
        if _gain_ratio([*relaxed], thresholds) is None:
            continue
        if 1.0 / thresholds.clear**2 < of_load < thresholds.clear**2:
            said.append(
                f"{one.recording.name} reads {of_load:.3g} times what {name} does under a load that goes as high"
                " and as fast: is it of another unit, or was this one changed, or put back otherwise?"
            )
    return said


def _gain_ratio(pairs: Sequence[tuple[Array, Array]], thresholds: Thresholds) -> float | None:
    """The second file's gain over the first's, by loads and readings; None where they are alike or one is not known."""
    usual, gain = (_gain(load, reading, thresholds.follows) for load, reading in pairs)
    return None if not usual or not gain or _near(gain, usual, thresholds.same) else gain / usual


def _near(one: float, other: float, same: float) -> bool:
    """Whether two numbers of one sign differ by no more than ``same``."""
    return max(abs(one), abs(other)) <= (1.0 + same) * min(abs(one), abs(other))


def _fastest(one: Session, seen: Mask) -> float:
    """The fastest rate (99th percentile) of a session's load where ``seen``, full scales per second."""
    return float(np.quantile(np.abs(one.conditions.rate_per_s[seen]), 0.99))


def _highest(one: Session, seen: Mask) -> float:
    """The highest load of a session where ``seen``, in full scales."""
    return float(one.conditions.load[seen].max())


def loads_beyond_fit(sessions: Sequence[Session], scale: Scale, thresholds: Thresholds) -> str | None:
    """How held-out loads exceed the fitted ones: faster, higher or longer, or of a kind that these lack; else None.

    They exceed them if they differ by more than ``same``.
    """
    fitted = [(one, one.fitted) for one in sessions if one.fitted.any()]
    judged = [(one, one.judged) for one in sessions if one.judged.any()]
    ways: list[tuple[str, str, float, Callable[[Session, Mask], float]]] = [
        ("change by up to", "N/s", scale.load_n, _fastest),
        ("reach", "N", scale.load_n, _highest),
        ("go on for", "s", 1.0, lambda one, seen: float(np.ptp(one.conditions.time_s[seen]))),
    ]
    said = []
    for does, unit, factor, of in ways:
        known, asked = (max((of(*one) for one in some), default=0.0) for some in (fitted, judged))
        if asked > (1.0 + thresholds.same) * known:
            said.append(f"{does} {rounded(asked * factor, 3)} {unit} ({rounded(known * factor, 3)} in what was fitted)")
    there, asked_for = (
        excitation_of(some, thresholds).present - LATER_CYCLES - {"rates"}
        for some in (sessions, [replace(one, held_out=~one.held_out) for one in sessions])
    )
    parts = ["the held-out loads " + " and ".join(said)] if said else []
    if lacking := sorted(SAYS[word] for word in asked_for - there):
        parts.append(f"what was fitted lacks {', '.join(lacking)}")
    return "; ".join(parts) or None


def _gain(load: Array, reading: Array, follows: float) -> float | None:
    """Slope of the reading on the load of a file; None where it explains less of the variance than ``follows``."""
    if not load.size:
        return None
    a, b = load - load.mean(), reading - reading.mean()
    size = float(np.sqrt((a @ a) * (b @ b)))
    return float(a @ b / (a @ a)) if size > 0 and float(a @ b) ** 2 > follows * size**2 else None


def _gain_between_files(pairs: Sequence[tuple[Array, Array]], apart: float) -> float | None:
    """Slope of the files' mean readings on their mean loads; None where these lie within ``apart`` full scales."""
    if len(pairs) < 2:
        return None
    loads = np.array([load.mean() for load, _ in pairs])
    readings = np.array([reading.mean() for _, reading in pairs])
    if np.ptp(loads) < apart:
        return None
    a = loads - loads.mean()
    return float(a @ readings / (a @ a)) or None
