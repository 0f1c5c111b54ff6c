"""Flags for exchanged columns or shoes and for clocks that differ, as far as the loads themselves show it.

If both shoes are labelled with the wrong side, their vertical loads look like those of correctly labelled shoes; only
labels can reveal that. The loads can reveal an insole in the other shoe (its inner metatarsal becomes the outer one),
single columns that changed sides, and a difference of the two clocks.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from smartshoe.arrays import Array
from smartshoe.gait._flag import Flag
from smartshoe.gait._series import FootSeries
from smartshoe.gait._strides import Stride
from smartshoe.gait._trial import FEET, Foot
from smartshoe.gait.indices import sequence_errors
from smartshoe.recording import REGIONS

SELDOM = 0.2
MOSTLY_WRONG = 0.5
LEAST_LOOKED_S, LOOKED_S = 5.0, 60.0
ALIKE = 0.2  # of the heavier foot's peak: a shoe that bears less was not worn
QUIETER = 0.2  # of the time, for both feet together
FEWEST = 5
APART_S = 0.03  # limit of the difference that a gait's own asymmetry makes between its two double supports
SURE_S = 0.01
DRIFT_S, DRIFT_SDS = 0.02, 6.0


def label_flags(feet: Mapping[str, Foot], series: Mapping[str, FootSeries], strides: Sequence[Stride]) -> list[Flag]:
    """Flags for metatarsal units, columns or shoes that seem exchanged."""
    flags: list[Flag] = []
    for name, foot in feet.items():
        named = {side for side in FEET if re.search(rf"(?<![a-z]){side}(?![a-z])", Path(foot.source).stem.casefold())}
        if named and name not in named:
            flags.append(
                Flag(
                    "left_right_swapped",
                    f"{foot.source} is named {named.pop()} and holds columns of the {name} shoe: one of them is wrong,"
                    " and the loads cannot say which",
                    foot=name,
                )
            )
    # If a unit is missing, part of the foot's load is not seen, and the order of loading proves nothing.
    whole = all(len(one.regions) == len(REGIONS) for one in series.values())
    in_order = all(_is_in_order(one, strides) for one in series.values())
    region = _exchanged_sides(feet, series) if whole and not in_order else None
    if region is not None:
        flags.append(
            Flag(
                "left_right_swapped",
                f"left_{region} and right_{region} seem exchanged: each is loaded while its foot should swing",
                unit=region,
            )
        )
    else:
        flags += [flag for one in series.values() if (flag := _out_of_order(one, strides)) is not None]
    inside_out = [name for name, one in series.items() if _is_inside_out(one)]
    if len(inside_out) == 2:
        flags.append(
            Flag(
                "left_right_swapped",
                "both feet load meta1 before meta4 and more, from the inner edge outwards, as feet hardly do: left and"
                " right insoles, or meta1 and meta4, seem exchanged",
            )
        )
    elif inside_out:
        flags.append(
            Flag(
                "metatarsals_swapped",
                f"the {inside_out[0]} foot loads meta1 before meta4 and more, as feet hardly do: they seem exchanged",
                foot=inside_out[0],
                unit="meta1, meta4",
            )
        )
    return flags


def _is_in_order(series: FootSeries, strides: Sequence[Stride]) -> bool:
    wrong, count = sequence_errors(series.contacts, [stride for stride in strides if stride.foot == series.name])
    return count >= FEWEST and wrong < MOSTLY_WRONG * count


def _exchanged_sides(feet: Mapping[str, Foot], series: Mapping[str, FootSeries]) -> str | None:
    """The region whose left and right columns, exchanged back, would let both feet swing; None if there is none.

    A foot with one column of the other foot is loaded while it should swing.
    """
    if len(feet) < 2 or feet["left"].regions != feet["right"].regions:
        return None
    peaks = [float(one.usual_peak.sum()) for one in series.values()]
    if min(peaks) < ALIKE * max(peaks) or feet["left"].time_s[-1] - feet["left"].time_s[0] < LEAST_LOOKED_S:
        return None
    first = feet["left"].load
    second = feet["right"].load
    count = min(len(first), len(second), round(LOOKED_S * feet["left"].rate_hz))
    first, second = first[:count], second[:count]
    now = _quiet_share(first.sum(axis=1)) + _quiet_share(second.sum(axis=1))
    gains: list[tuple[float, str]] = []
    for column, region in enumerate(feet["left"].regions):
        moved = second[:, column] - first[:, column]
        gains.append((_quiet_share(first.sum(axis=1) + moved) + _quiet_share(second.sum(axis=1) - moved) - now, region))
    gain, region = max(gains)
    return region if gain > QUIETER else None


def _quiet_share(whole: Array) -> float:
    """The share of time during which a foot's load (n,) is near its floor."""
    low, high = np.quantile(whole, [0.01, 0.95])
    return float(np.mean(whole < low + 0.1 * (high - low))) if high > low else 0.0


def _out_of_order(series: FootSeries, strides: Sequence[Stride]) -> Flag | None:
    """A flag if most stances of a foot break the order heel, flat, heel off; None otherwise."""
    own = [stride for stride in strides if stride.foot == series.name]
    wrong, count = sequence_errors(series.contacts, own)
    if count < FEWEST or wrong < MOSTLY_WRONG * count:
        return None
    heel, toe = series.contacts.of_region("heel"), series.contacts.of_region("toe")
    if heel is None or len(series.regions) < len(REGIONS):
        return None
    cause = "the person walks on the forefoot, or columns are exchanged"
    if toe is not None:
        onset = series.contacts.onset_s
        with np.errstate(invalid="ignore"):
            last = float(np.mean(onset[:, heel] >= np.nanmax(np.where(np.isnan(onset), -np.inf, onset), axis=1)))
            first = float(np.mean(onset[:, toe] <= np.nanmin(np.where(np.isnan(onset), np.inf, onset), axis=1)))
        if last > MOSTLY_WRONG:
            cause = (
                "heel and toe seem exchanged"
                if first > MOSTLY_WRONG
                else "the heel comes last, as in no gait: its column seems to be the other foot's"
            )
    return Flag(
        "sequence_broken",
        f"{100 * wrong / count:.0f} % of the {series.name} foot's strides do not go heel strike, foot flat, heel off,"
        f" toe off: {cause}",
        foot=series.name,
    )


def _is_inside_out(series: FootSeries) -> bool:
    """Whether the first metatarsal unit is mostly loaded before the fourth, and more."""
    contacts = series.contacts
    meta4, meta1 = contacts.of_region("meta4"), contacts.of_region("meta1")
    if meta4 is None or meta1 is None or not series.usual_peak[meta1] > series.usual_peak[meta4]:
        return False
    onset4, onset1 = contacts.onset_s[:, meta4], contacts.onset_s[:, meta1]
    both = np.isfinite(onset4) & np.isfinite(onset1)
    return int(both.sum()) >= FEWEST and float(np.mean(onset4[both] < onset1[both])) < SELDOM


def clock_flags(feet: Mapping[str, Foot], series: Mapping[str, FootSeries], strides: Sequence[Stride]) -> list[Flag]:
    """Flags if the right shoe's clock differs from the left one's, by the two double supports (or flights) of a stride.

    A clock that is late by d makes one of them longer by d and the other shorter by d. A limp does so too; only where
    walking would have a flight, or running a double support, must it be the clocks.
    """
    if len(feet) < 2 or not strides or feet["left"].regions != feet["right"].regions:
        return []
    left, right = series["left"].contacts, series["right"].contacts
    first_s, at_s = _overlaps(left.strike_s, right.strike_s, right.toe_off_s)
    second_s, other_s = _overlaps(right.strike_s, left.strike_s, left.toe_off_s)
    if first_s.size < FEWEST or second_s.size < FEWEST:
        return []
    mean_s = 0.5 * (float(np.median(first_s)) + float(np.median(second_s)))
    late_s = 0.5 * (float(np.median(first_s)) - float(np.median(second_s)))
    runs = sum(stride.runs for stride in strides) > len(strides) / 2
    sure = abs(late_s) > abs(mean_s) + SURE_S and (mean_s < 0.0) == runs
    apart = feet["left"].source != feet["right"].source
    flags: list[Flag] = []
    if sure or (apart and abs(late_s) > APART_S):
        how = "later" if late_s > 0 else "earlier"
        contradiction = "a double support in running" if runs else "a flight in walking"
        why = (
            f"there would be {contradiction}"
            if sure
            else "or the gait is this asymmetric; a stamp of both feet at once would tell"
        )
        flags.append(
            Flag(
                "clocks_apart",
                f"the right shoe's clock seems about {1e3 * abs(late_s):.0f} ms {how} than the left one's: {why};"
                " double support, step times and the total's course suffer, its mean does not",
            )
        )
    if apart:
        flags += _drift(first_s, at_s, second_s, other_s)
    return flags


def _overlaps(strike_s: Array, other_strike_s: Array, other_off_s: Array) -> tuple[Array, Array]:
    """For each heel strike, how long in s the other foot stays down (negative if it is up already), and its time."""
    strike = strike_s[np.isfinite(strike_s)]
    known = np.isfinite(other_off_s) & np.isfinite(other_strike_s)
    off, begin = other_off_s[known], other_strike_s[known]
    if not strike.size or not off.size:
        return np.zeros(0), np.zeros(0)
    at = np.searchsorted(begin, strike) - 1
    there = at >= 0
    over = off[np.maximum(at, 0)] - strike
    there &= np.abs(over) < 0.6
    return over[there], strike[there]


def _drift(first_s: Array, at_s: Array, second_s: Array, other_s: Array) -> list[Flag]:
    """A flag if the clocks' rates differ: the difference of the two overlaps then grows over the record."""
    difference = 0.5 * (first_s - np.interp(at_s, other_s, second_s))
    if difference.size < 4 * FEWEST:
        return []
    time_s = at_s - at_s.mean()
    slope = float(time_s @ difference / (time_s @ time_s))
    left = difference - difference.mean() - slope * time_s
    sd = float(np.sqrt(np.mean(left**2) / (time_s @ time_s)))
    span_s = float(at_s[-1] - at_s[0])
    if abs(slope) * span_s < DRIFT_S or abs(slope) < DRIFT_SDS * sd:
        return []
    return [
        Flag(
            "clock_rates_differ",
            f"the right shoe's clock runs {1e6 * abs(slope):.0f} ppm {'slower' if slope < 0 else 'faster'} than the"
            f" left one's, {1e3 * abs(slope) * span_s:.0f} ms over the record: give both shoes one clock before double"
            " support is believed",
        )
    ]
