"""Recordings that share samples with earlier ones: one experiment given twice, which tells nothing by itself.

A recording that was cropped from another, or overlaps with it, holds a stretch of its very samples, wherever that
begins and whatever its clock says. Windows of as many samples as tell anything are compared by their hashes (Karp and
Rabin 1987), and what is alike is followed sample by sample, as far as it goes.
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
BASE = 0x9E3779B97F4A7C15  # of the hashes; any odd number does


@dataclass(frozen=True, eq=False)
class Twin:
    """A recording of which earlier ones hold the samples ``at`` (n,), and a sentence about it."""

    at: Mask
    says: str


@dataclass(frozen=True, slots=True)
class _Stretch:
    """Samples ``begin`` to ``stop`` of the recording ``place`` are those of an ``earlier`` one."""

    earlier: int
    place: int
    begin: int
    stop: int


def twins(recordings: Sequence[Recording], thresholds: Thresholds) -> dict[int, Twin]:
    """By place, each recording that shares samples with earlier ones: all of its own with one, or a stretch with some.

    A stretch is shared where load and reading are equal at each of its samples, where some of it comes but once in
    either recording, and where it holds more changes than chance makes alike (`_fewest_changes`).
    """
    stretches: dict[int, list[_Stretch]] = {}
    for one in _shared([_codes(recording) for recording in recordings], thresholds):
        stretches.setdefault(one.place, []).append(one)
    return {place: _twin(recordings, place, each, thresholds) for place, each in stretches.items()}


def _twin(recordings: Sequence[Recording], place: int, stretches: Sequence[_Stretch], thresholds: Thresholds) -> Twin:
    recording = recordings[place]
    at = np.zeros(len(recording), dtype=bool)
    for one in stretches:
        at[one.begin : one.stop] = True
    labels = [recordings[one.earlier].label for one in stretches]
    if np.count_nonzero(~at) >= thresholds.least_samples:
        spans = [recording.time_s[[one.begin, one.stop - 1]].tolist() for one in stretches]
        labels = [
            f"{label} from {moment(begin)} to {moment(end)} s"
            for label, (begin, end) in zip(labels, spans, strict=True)
        ]
    same = f"{recording.label} holds the same samples as {first_names([*dict.fromkeys(labels)])}"
    return Twin(at, f"{same}: it is one experiment, given twice")


def _codes(recording: Recording) -> Codes:
    """(n,) a number for each sample's load and reading in SI, missing ones alike: other values have another."""
    codes = np.zeros(len(recording), dtype=np.uint64)
    for role in ("load", "sensor"):
        for channel in recording.of_role(role):
            values = channel.unit.to_si(channel.with_nan()) + 0.0  # of two noughts one
            codes = _mixed(codes + np.ascontiguousarray(values).view(np.uint64))
        codes = _mixed(codes)  # of so many loads and so many readings
    return codes


def _mixed(codes: Codes) -> Codes:
    """Every bit of the result hangs on every bit of each code (splitmix64: Steele, Lea and Flood 2014)."""
    codes = codes + np.uint64(BASE)
    codes = (codes ^ (codes >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    codes = (codes ^ (codes >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return codes ^ (codes >> np.uint64(31))


def _shared(codes: Sequence[Codes], thresholds: Thresholds) -> Iterator[_Stretch]:
    """The stretches that recordings share with the first that holds them."""
    wholes: dict[bytes, int] = {}
    for place, one in enumerate(codes):
        if (earlier := wholes.setdefault(one.tobytes(), place)) != place:
            yield _Stretch(earlier, place, 0, one.size)
    codes = [one if place in wholes.values() else one[:0] for place, one in enumerate(codes)]
    for earlier, place, shift, seeds in _alike(codes, thresholds.least_samples):
        one, other = codes[earlier], codes[place]
        begin, stop = max(shift, 0), min(one.size + shift, other.size)  # where they overlap, of the later one
        mine = other[begin:stop]
        for first, last in zip(*runs_of(one[begin - shift : stop - shift] == mine), strict=True):
            if not np.any((seeds >= begin + first) & (seeds < begin + last)):
                continue
            changes = np.count_nonzero(np.diff(mine[first:last]))
            if changes > _fewest_changes(one, other, sum(each.size for each in codes), thresholds):
                yield _Stretch(earlier, place, begin + int(first), begin + int(last))


def _fewest_changes(one: Codes, other: Codes, total: int, thresholds: Thresholds) -> float:
    """How many changes from sample to sample two recordings among ``total`` samples may have alike by chance.

    Of n² pairs of places the longest stretch that is alike has log(n²) over what a change tells (Arratia and Waterman
    1985): by what each recording repeats of itself, as on a coarse grid, that is known. No change tells more than one
    bit for certain, whether there is one.
    """
    bits = min(1.0, *(2.0 * math.log2(each.size) / max(_repeated_changes(each), 1) for each in (one, other)))
    return (2.0 * math.log2(total) - math.log2(thresholds.false_alarm)) / bits


def _repeated_changes(codes: Codes) -> int:
    """How many changes, with the times between them, the longest stretch has that a recording repeats."""
    begins = np.flatnonzero(np.diff(codes)) + 1
    tokens = _mixed(codes[begins[:-1]] + np.diff(begins).astype(np.uint64))

    def repeats(width: int) -> bool:
        hashes = _hashes([tokens], width)
        return np.unique(hashes).size < hashes.size

    most = 1
    while repeats(most):
        most *= 2
    return bisect_left(range(1, most), True, key=lambda width: not repeats(width))  # a part of what repeats does too


def _alike(codes: Sequence[Codes], width: int) -> Iterator[tuple[int, int, int, Index]]:
    """Places of two recordings, how much later the second holds windows of the first, and where those begin.

    Windows of ``width`` samples that come but once in either, each with the first recording that holds it.
    """
    counts = np.array([max(one.size - width + 1, 0) for one in codes], dtype=np.intp)
    if np.count_nonzero(counts) < 2:
        return
    places = np.repeat(np.arange(counts.size), counts)
    begins = np.arange(places.size) - np.repeat(np.cumsum(counts) - counts, counts)
    hashes = _hashes(codes, width)
    order = np.argsort(hashes, kind="stable")
    hashes, places, begins = hashes[order], places[order], begins[order]
    again = (hashes[1:] == hashes[:-1]) & (places[1:] == places[:-1])
    once = ~(np.append(again, False) | np.append(False, again))
    hashes, places, begins = hashes[once], places[once], begins[once]
    is_first = np.append(True, hashes[1:] != hashes[:-1])[: hashes.size]
    first = np.maximum.accumulate(np.where(is_first, np.arange(hashes.size), 0))
    later, first = np.flatnonzero(~is_first), first[~is_first]
    pairs = np.stack([places[first], places[later], begins[later] - begins[first]])
    order = np.lexsort(pairs[::-1])
    pairs, begins = pairs[:, order], begins[later][order]
    cuts = np.flatnonzero(np.any(np.diff(pairs, axis=1) != 0, axis=0)) + 1
    for at, seeds in zip(np.split(pairs, cuts, axis=1), np.split(begins, cuts), strict=True):
        if seeds.size:
            earlier, place, shift = (int(one) for one in at[:, 0])
            yield earlier, place, shift, seeds


def _hashes(codes: Sequence[Codes], width: int) -> Codes:
    """Of each window of ``width`` samples within a recording, one recording after the other: polynomials in BASE."""
    whole = np.concatenate(codes)
    up, down = (np.full(whole.size, base % WORD, dtype=np.uint64) for base in (BASE, pow(BASE, -1, WORD)))
    sums = np.append(np.uint64(0), np.cumsum(whole * np.cumprod(up)))
    hashes = (sums[width:] - sums[:-width]) * np.cumprod(down)[: max(whole.size - width + 1, 0)]
    ends = np.cumsum([one.size for one in codes])
    inside = np.ones(hashes.size, dtype=bool)
    for one, end in zip(codes, ends, strict=True):
        inside[max(end - min(width - 1, one.size), 0) : end] = False
    return np.asarray(hashes[inside])
