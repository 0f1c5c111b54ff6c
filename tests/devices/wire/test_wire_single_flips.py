"""Every change that one flipped bit can make to a sample frame, followed to its end."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from functools import cache

import numpy as np
import pytest

from smartshoe.devices.wire._checksums import checksum
from smartshoe.devices.wire._framing import framed
from smartshoe.devices.wire._scanning import SAMPLE, FrameScanner
from smartshoe.devices.wire._single_flips import FORMS, FOUR_READINGS, may_be_flipped
from smartshoe.devices.wire.counters import Counters

ENCODED = 18  # code, then 17 bytes
Change = tuple[tuple[int, int], ...]


def _syndrome(place: int, value: int) -> int:
    """What ``value`` XORed into the encoded byte at ``place`` does to checksum and checksum sent, together."""
    if place > 15:
        return value << (8 * (place - 16))
    data = bytearray(15)
    data[place - 1] = value
    return checksum(bytes(data)) ^ checksum(bytes(15))


@cache
def _ways(near: int, far: int) -> np.ndarray:
    """How many ways two chains have from ``near`` and ``far`` to where they meet, by syndrome (65536,)."""
    counts = np.zeros(65536, dtype=np.int64)
    if near == far:
        counts[0] = 1
        return counts
    syndromes = np.arange(65536)
    for step in range(1, ENCODED - near + 1):
        counts += _ways(*sorted((near + step, far)))[syndromes ^ _syndrome(near, step)]
    return counts


def _unseen(one: int, other: int, syndrome: int = 0, so_far: Change = ()) -> Iterator[Change]:
    """Changes, as (place, step) of the chain left behind, that end with the checksum right."""
    if one == other:
        if syndrome == 0:
            yield so_far
        return
    near, far = sorted((one, other))
    if not _ways(near, far)[syndrome]:
        return
    for step in range(1, ENCODED - near + 1):
        yield from _unseen(near + step, far, syndrome ^ _syndrome(near, step), (*so_far, (near, step)))


def _flips() -> Iterator[tuple[int, int]]:
    """Where the old chain and the new one go next after one bit of one of COBS's bytes is flipped."""
    for place in range(ENCODED):
        for code in range(1, ENCODED - place + 1):
            for bit in range(8):
                if 1 <= code ^ (1 << bit) <= ENCODED - place:
                    yield place + code, place + (code ^ (1 << bit))


def _form(old: int, new: int, change: Change) -> Change:
    """What the received payload holds where it differs from the one sent."""
    steps, received = dict(change), []
    while old != new:
        if old < new:
            received.append((old - 1, steps[old]))
            old += steps[old]
        else:
            received.append((new - 1, 0))
            new += steps[new]
    return tuple(sorted(received))


@pytest.mark.parametrize("form", FORMS)
def test_a_form_is_two_chains_to_the_end_whose_change_no_checksum_sees(form: Change) -> None:
    """The bytes of one chain were zeros and those of the other its steps, before the bit was flipped."""
    places = [place for place, _ in form]
    assert places == sorted(set(places))
    left, taken = ([place for place, value in form if (value == 0) is zero] for zero in (False, True))
    change = 0
    for chain in (left, taken):
        for place, after in zip(chain, [*chain[1:], FOUR_READINGS], strict=True):
            assert dict(form)[place] in (0, after - place)
            change ^= _syndrome(place + 1, after - place)
    assert change == 0
    payloads = np.zeros((FOUR_READINGS, 2), dtype=np.uint8)
    for place, value in form:
        payloads[place, 1] = value
    assert may_be_flipped(payloads).tolist() == [1]


def test_the_forms_refused_are_all_that_neither_checksum_nor_place_can_tell() -> None:
    flips = list(_flips())
    assert sum(int(_ways(*sorted(flip)).sum()) for flip in flips) == 102_995_464
    told_by: Counter[str] = Counter()
    forms = set()
    for old, new in flips:
        for change in _unseen(old, new):
            places = {place - 1 for place, _ in change}  # in the payload
            if 0 in places:
                told_by["type"] += 1
            elif places & {1, 2}:
                told_by["count"] += 1
            elif places & {5, 6}:
                told_by["clock"] += 1
            else:
                told_by["nothing"] += 1
                forms.add(_form(old, new, change))
    assert told_by == {"type": 694, "count": 676, "clock": 114, "nothing": 14}
    assert forms == set(FORMS)


@pytest.mark.parametrize("form", FORMS)
def test_a_frame_of_each_form_is_refused_and_its_neighbours_are_not(form: Change) -> None:
    rng = np.random.default_rng(1)
    payloads = rng.integers(0, 256, (17, 9), dtype=np.uint8)
    for place, value in form:
        payloads[place, 4:7] = value
    payloads[form[0][0], 6] ^= 1
    assert sorted(set(may_be_flipped(payloads).tolist())) == [4, 5]


def _frame_of(form: Change) -> np.ndarray:
    """A sample frame's payload (17,) of the ``form``, with the checksum that belongs to it."""
    rng = np.random.default_rng(2)
    body = np.zeros(FOUR_READINGS - 2, dtype=np.uint8)
    for _ in range(300_000):
        body[1:] = rng.integers(0, 256, body.size - 1)
        body[0] = SAMPLE
        for place, value in form:
            if place < body.size:
                body[place] = value
        payload = np.concatenate([body, np.frombuffer(checksum(body.tobytes()).to_bytes(2, "little"), np.uint8)])
        if all(payload[place] == value for place, value in form):
            return payload
    raise AssertionError("no frame of this form was found")


@pytest.mark.parametrize("form", FORMS)
def test_a_whole_frame_of_a_form_is_not_read_from_a_stream(form: Change) -> None:
    payload = _frame_of(form)
    other = payload[:-2].copy()
    other[form[1][0]] ^= 1
    for body, taken in ((payload[:-2], 0), (other, 1)):
        scanner = FrameScanner(FOUR_READINGS, Counters())
        assert scanner.feed(framed(body.tobytes())).payloads.shape[1] == taken
