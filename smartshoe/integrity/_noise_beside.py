"""The noise of a reading beside each run of equal readings, also where the signal's own motion hides it."""

from __future__ import annotations

import math

import numpy as np

from smartshoe.arrays import Array, Index, Mask
from smartshoe.integrity._scales import SECOND_DIFFERENCE, turns
from smartshoe.integrity.thresholds import Thresholds
from smartshoe.signals.noise import NORMAL_QUARTILE

HIGHER = (4, 6)  # orders of differences: the higher, the less of a smooth motion is left, and the fewer fit in a window


def noise_beside(y: Array, starts: Index, stops: Index, width: int) -> Array:
    """(runs,) standard deviation of the noise in ``width`` readings before or after each run, the lesser of the two.

    A side on which most readings repeat is left out. At either end of the recording it is 0, since one side does not
    tell whether there was noise on the other.
    """
    second = np.diff(y, 2)
    power = np.concatenate([[0.0], np.cumsum(second**2)])
    changing = np.concatenate([[0], np.cumsum(second != 0.0)])
    least = np.full(starts.size, np.inf)
    for low, high in ((starts - width, starts - 1), (stops, stops + width - 1)):
        first, last = np.clip(low, 0, second.size), np.clip(high, 0, second.size)
        side_sd = np.sqrt((power[last] - power[first]) / np.maximum(last - first, 1)) / SECOND_DIFFERENCE
        side_sd = np.where(changing[last] - changing[first] < width // 4, np.inf, side_sd)
        least = np.where(last - first < width // 2, 0.0, np.minimum(least, side_sd))
    return np.where(np.isfinite(least), least, 0.0)


def alternates(y: Array, starts: Index, stops: Index, thresholds: Thresholds) -> Mask:
    """(runs,) whether second differences beside each run change sign as often as those of noise do.

    Those of a smooth curve mostly keep their sign.
    """
    width = thresholds.local // 2
    counts = [np.concatenate([[0], np.cumsum(one)]) for one in turns(np.diff(y, 2))]
    turned, stayed = np.zeros(starts.size, dtype=np.int64), np.zeros(starts.size, dtype=np.int64)
    for low, high in ((starts - width, starts - 2), (stops, stops + width - 2)):
        first, last = (np.clip(one, 0, counts[0].size - 1) for one in (low, high))
        turned += counts[0][last] - counts[0][first]
        stayed += counts[1][last] - counts[1][first]
    return is_noise(turned, stayed, thresholds) & (turned > thresholds.few)


def is_noise(turned: Index | int, stayed: Index | int, thresholds: Thresholds) -> Mask:
    """Whether second differences changed sign (``turned``) often enough, against keeping it (``stayed``), to be noise.

    Second differences of white noise change sign 2.7 times as often as they keep it; the root of `clear` is asked
    for.
    """
    return np.asarray(turned > np.sqrt(thresholds.clear) * stayed)


def noise_under_motion(
    y: Array, starts: Index, stops: Index, asked: Mask, least: float, thresholds: Thresholds
) -> Array:
    """(asked,) standard deviation of the noise beside those runs that are ``asked`` for (runs,); 0 where none shows.

    It is taken from the lowest of the higher differences that alternate as those of noise do, and must exceed
    ``least``: smaller irregularities may be those of the load. Differences that touch any run are left out, since what
    friction lets go starts with a corner; their median is taken, which a few other corners do not raise.
    """
    begins, ends = (np.bincount(at, minlength=y.size + 1) for at in (starts, stops + 1))
    in_run = np.cumsum(begins - ends)[:-1] > 0
    first, last = starts[asked], stops[asked]
    noise_sd = np.zeros(first.size)
    for order in HIGHER:
        unknown = np.flatnonzero(noise_sd == 0.0)
        noise_sd[unknown] = _by_differences(y, in_run, first[unknown], last[unknown], order, thresholds)
    return np.where(noise_sd > least, noise_sd, 0.0)


def _by_differences(y: Array, in_run: Mask, starts: Index, stops: Index, order: int, thresholds: Thresholds) -> Array:
    """(runs,) `noise_under_motion` by differences of an ``order``, the lesser of the two sides; 0 where none shows.

    At either end of the recording it is 0, as in `noise_beside`.
    """
    if y.size <= order:
        return np.zeros(starts.size)
    width = thresholds.local // 2
    inside = np.concatenate([[0], np.cumsum(in_run)])
    difference = np.diff(y, order)
    difference[inside[order + 1 :] > inside[: -order - 1]] = np.nan
    turned, stayed = np.zeros(starts.size, dtype=np.int64), np.zeros(starts.size, dtype=np.int64)
    least = np.full(starts.size, np.inf)
    reach = np.arange(width - order)
    for index in (starts[:, None] - order - 1 - reach, stops[:, None] + 1 + reach):
        is_within = (index >= 0) & (index < difference.size)
        beside = np.where(is_within, difference[np.clip(index, 0, difference.size - 1)], np.nan)
        product = beside[:, 1:] * beside[:, :-1]
        turned += (product < 0.0).sum(axis=1)
        stayed += (product > 0.0).sum(axis=1)
        size = np.sort(np.abs(beside), axis=1)  # what is left out comes last
        count = np.isfinite(size).sum(axis=1)
        middle = np.take_along_axis(size, np.maximum(count - 1, 0)[:, None] // 2, axis=1)[:, 0]
        side = np.where(count < width // 4, np.inf, middle)
        least = np.where(2 * is_within.sum(axis=1) < reach.size, 0.0, np.minimum(least, side))
    shows = is_noise(turned, stayed, thresholds) & (turned > thresholds.few) & np.isfinite(least)
    return np.where(shows, least, 0.0) / (NORMAL_QUARTILE * math.sqrt(math.comb(2 * order, order)))
