"""Recordings that share samples with earlier ones: one experiment given twice, which is no further evidence.

A recording that was cropped from another, or overlaps with it, holds a segment of the same samples, wherever that
begins and whatever its clock shows. Windows of ``least_samples`` samples are compared by their hashes (Karp and Rabin
1987), and a window in common is followed sample by sample as far as both recordings agree.
"""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from smartshoe.arrays import Index, Mask
from smartshoe.display import first_names, moment
from smartshoe.integrity.thresholds import Thresholds
from smartshoe.recording import Recording
from smartshoe.signals.masks import runs_of

Codes = NDArray[np.uint64]

WORD = 2**64
BASE = 0x9E3779B97F4A7C15  # of the hashes' polynomials; any odd number does


@dataclass(frozen=True, eq=False)
class Twin:
    """A recording that shares its samples ``at`` (n,) with earlier ones, and a sentence that says with which."""

    at: Mask
    says: str


@dataclass(frozen=True, slots=True)
class _SharedSegment:
    """Samples ``begin`` to before ``stop`` of the recording ``place`` are also in the ``earlier`` recording."""

    earlier: int
    place: int
    begin: int
    stop: int


def twins(recordings: Sequence[Recording], thresholds: Thresholds) -> dict[int, Twin]:
    """By place, each recording that shares samples with earlier ones: all of its own with one, or segments with some.

    A segment is shared where load and reading are equal at each of its samples. Some window in it must come only once
    in either recording, and it must hold more changes than two recordings have in common by chance (`_fewest_changes`).
    """
    segments: dict[int, list[_SharedSegment]] = {}
    for one in _shared_segments([_codes(recording) for recording in recordings], thresholds):
        segments.setdefault(one.place, []).append(one)
    return {place: _twin(recordings, place, each, thresholds) for place, each in segments.items()}


def _twin(
    recordings: Sequence[Recording], place: int, segments: Sequence[_SharedSegment], thresholds: Thresholds
) -> Twin:
    """The recording at ``place`` with the sentence about its shared ``segments``."""
    recording = recordings[place]
    at = np.zeros(len(recording), dtype=bool)
    for one in segments:
        at[one.begin : one.stop] = True
    labels = [recordings[one.earlier].label for one in segments]
    if np.count_nonzero(~at) >= thresholds.least_samples:
        spans = [recording.time_s[[one.begin, one.stop - 1]].tolist() for one in segments]
        labels = [
            f"{label} from {moment(begin)} to {moment(end)} s"
            for label, (begin, end) in zip(labels, spans, strict=True)
        ]
    shared = f"{recording.label} holds the same samples as {first_names([*dict.fromkeys(labels)])}"
    return Twin(at, f"{shared}: it is one experiment, given twice")


def _codes(recording: Recording) -> Codes:
    """(n,) a number for each sample's load and reading in SI: equal where these are equal, else different.

    Missing values have one code.
    """
    codes = np.zeros(len(recording), dtype=np.uint64)
    for role in ("load", "sensor"):
        for channel in recording.of_role(role):
            values = channel.unit.to_si(channel.with_nan()) + 0.0  # -0.0 becomes 0.0
            codes = _mixed(codes + np.ascontiguousarray(values).view(np.uint64))
        codes = _mixed(codes)  # so that a load does not count as a reading
    return codes


def _mixed(codes: Codes) -> Codes:
    """(n,) codes of which every bit depends on every bit of the given one (splitmix64: Steele, Lea and Flood 2014)."""
    codes = codes + np.uint64(BASE)
    codes = (codes ^ (codes >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    codes = (codes ^ (codes >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return codes ^ (codes >> np.uint64(31))


def _shared_segments(codes: Sequence[Codes], thresholds: Thresholds) -> Iterator[_SharedSegment]:
    """The segments that recordings share with the first recording that holds them.

    Recordings that are wholly equal are found first, and only one of them is compared further.
    """
    wholes: dict[bytes, int] = {}
    for place, one in enumerate(codes):
        if (earlier := wholes.setdefault(one.tobytes(), place)) != place:
            yield _SharedSegment(earlier, place, 0, one.size)
    codes = [one if place in wholes.values() else one[:0] for place, one in enumerate(codes)]
    for earlier, place, shift, seeds in _windows_in_common(codes, thresholds.least_samples):
        one, other = codes[earlier], codes[place]
        begin, stop = (
            max(shift, 0),
            min(one.size + shift, other.size),
        )  # where both overlap, in samples of the later one
        overlap = other[begin:stop]
        for first, last in zip(*runs_of(one[begin - shift : stop - shift] == overlap), strict=True):
            if not np.any((seeds >= begin + first) & (seeds < begin + last)):
                continue
            changes = np.count_nonzero(np.diff(overlap[first:last]))
            if changes > _fewest_changes(one, other, sum(each.size for each in codes), thresholds):
                yield _SharedSegment(earlier, place, begin + int(first), begin + int(last))


def _fewest_changes(one: Codes, other: Codes, total: int, thresholds: Thresholds) -> float:
    """How many changes from sample to sample two recordings may have in common by chance, among ``total`` samples.

    Of n² pairs of places the longest run of equal symbols has about log(n²) over the information of one symbol (Arratia
    and Waterman 1985). How little one change tells is known from the longest segment that a recording repeats of
    itself, as it does on a coarse grid. A change tells at most one bit for certain: whether there is one.
    """
    bits_per_change = min(1.0, *(2.0 * math.log2(each.size) / max(_repeated_changes(each), 1) for each in (one, other)))
    return (2.0 * math.log2(total) - math.log2(thresholds.false_alarm)) / bits_per_change


def _repeated_changes(codes: Codes) -> int:
    """How many changes, at the same distances, the longest segment has that a recording repeats of itself."""
    begins = np.flatnonzero(np.diff(codes)) + 1
    tokens = _mixed(codes[begins[:-1]] + np.diff(begins).astype(np.uint64))

    def repeats(width: int) -> bool:
        hashes = _hashes([tokens], width)
        return np.unique(hashes).size < hashes.size

    beyond = 1
    while repeats(beyond):
        beyond *= 2
    return bisect_left(range(1, beyond), True, key=lambda width: not repeats(width))  # a shorter part repeats as well


def _windows_in_common(codes: Sequence[Codes], width: int) -> Iterator[tuple[int, int, int, Index]]:
    """Pairs of recordings that have windows of ``width`` samples in common, as (earlier, place, shift, begins).

    ``shift``: how many samples later the second recording holds these windows. ``begins`` (k,): where they begin in it.
    Windows count that come only once in either recording, each with the first recording that holds it.
    """
    counts = np.array([max(one.size - width + 1, 0) for one in codes], dtype=np.intp)
    if np.count_nonzero(counts) < 2:
        return
    places = np.repeat(np.arange(counts.size), counts)
    begins = np.arange(places.size) - np.repeat(np.cumsum(counts) - counts, counts)
    hashes = _hashes(codes, width)
    order = np.argsort(hashes, kind="stable")
    hashes, places, begins = hashes[order], places[order], begins[order]
    is_repeat = (hashes[1:] == hashes[:-1]) & (places[1:] == places[:-1])
    is_single = ~(np.append(is_repeat, False) | np.append(False, is_repeat))
    hashes, places, begins = hashes[is_single], places[is_single], begins[is_single]
    is_first = np.append(True, hashes[1:] != hashes[:-1])[: hashes.size]
    first = np.maximum.accumulate(np.where(is_first, np.arange(hashes.size), 0))
    later, first = np.flatnonzero(~is_first), first[~is_first]
    pairs = np.stack([places[first], places[later], begins[later] - begins[first]])
    order = np.lexsort(pairs[::-1])
    pairs, begins = pairs[:, order], begins[later][order]
    splits = np.flatnonzero(np.any(np.diff(pairs, axis=1) != 0, axis=0)) + 1
    for pair, seeds in zip(np.split(pairs, splits, axis=1), np.split(begins, splits), strict=True):
        if seeds.size:
            earlier, place, shift = (int(one) for one in pair[:, 0])
            yield earlier, place, shift, seeds


def _hashes(codes: Sequence[Codes], width: int) -> Codes:
    """Hashes of all windows of ``width`` samples within a recording, one recording after another: polynomials in BASE.

    One cumulative sum serves all windows: each takes a difference of two sums, times the inverse power at its start.
    """
    whole = np.concatenate(codes)
    bases, inverse_bases = (np.full(whole.size, base % WORD, dtype=np.uint64) for base in (BASE, pow(BASE, -1, WORD)))
    sums = np.append(np.uint64(0), np.cumsum(whole * np.cumprod(bases)))
    hashes = (sums[width:] - sums[:-width]) * np.cumprod(inverse_bases)[: max(whole.size - width + 1, 0)]
    ends = np.cumsum([one.size for one in codes])
    inside = np.ones(hashes.size, dtype=bool)
    for one, end in zip(codes, ends, strict=True):
        inside[max(end - min(width - 1, one.size), 0) : end] = False
    return np.asarray(hashes[inside])
