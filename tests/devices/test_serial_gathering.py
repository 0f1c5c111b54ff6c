"""What comes together is decoded together, and each sample keeps the time at which its own last byte was read."""

from __future__ import annotations

from collections import deque

import numpy as np
import pytest

from smartshoe.devices._base import Block
from smartshoe.devices.serial_link._arrivals import KEPT, Arrivals
from smartshoe.devices.serial_link._reader import GATHER_S
from smartshoe.devices.serial_link._settings import SerialSettings
from smartshoe.devices.serial_link.shoe import SerialShoe
from smartshoe.devices.wire.frames import ChannelInformation, Information, encode_information, encode_samples
from smartshoe.errors import DeviceError, DeviceTimeoutError

NAMES = ("toe", "meta1", "meta4", "heel")
INFORMATION = Information("f", "s", 200.0, tuple(ChannelInformation(n, "mbar", 0.0, 200.0) for n in NAMES), 4095)


class ScriptedPort:
    """Pieces that come at times of their own, on a clock that only reading moves on; then the port is gone."""

    def __init__(self, pieces: list[tuple[float, bytes]]) -> None:
        self.now_s = 0.0
        self._pieces = deque(pieces)

    def read(self, wait_s: float = 0.05) -> bytes:
        """See `Port.read`."""
        if not self._pieces:
            raise DeviceError("the script is over")
        at_s = self._pieces[0][0]
        if at_s > self.now_s + wait_s:
            self.now_s += wait_s
            return b""
        self.now_s = max(self.now_s, at_s)
        return self._pieces.popleft()[1]

    def write(self, data: bytes) -> None:
        """See `Port.write`."""

    def close(self) -> None:
        """See `Port.close`."""


def _blocks(pieces: list[tuple[float, bytes]]) -> list[Block]:
    port = ScriptedPort(pieces)
    opened = iter([port])

    def open_once(*_: object) -> ScriptedPort:
        try:
            return next(opened)
        except StopIteration:
            port.now_s += 1e3  # nobody waits for a port that never comes back
            raise DeviceError("gone") from None

    blocks: list[Block] = []
    shoe = SerialShoe("nowhere", SerialSettings(format="frames"), open_port=open_once, clock=lambda: port.now_s)
    with shoe, pytest.raises(DeviceTimeoutError, match="no valid frame"):
        blocks.extend(shoe.blocks())
    return blocks


def test_samples_that_are_decoded_together_came_at_their_own_times() -> None:
    frames = [encode_samples([k], [5000 * k], [[k, 0, 1, 2]]) for k in range(40)]
    # Every third comes in two halves: the later one counts.
    pieces = [(0.001, encode_information(INFORMATION))]
    for k, frame in enumerate(frames):
        at_s = 0.01 + 0.005 * k
        pieces += [(at_s, frame)] if k % 3 else [(at_s - 0.002, frame[:7]), (at_s, frame[7:])]
    blocks = _blocks(pieces)
    arrival_s = np.concatenate([block.arrival_s for block in blocks if block.arrival_s is not None])
    time_s = np.concatenate([block.time_s for block in blocks])
    np.testing.assert_allclose(time_s, 0.005 * np.arange(40), rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(arrival_s, 0.01 + 0.005 * np.arange(40), rtol=0.0, atol=1e-12)


def test_nothing_that_came_before_the_port_was_lost_is_lost() -> None:
    frames = [encode_samples([k], [5000 * k], [[k, 0, 1, 2]]) for k in range(10)]
    last_together = [(0.01 + 0.1 * GATHER_S * k, frame) for k, frame in enumerate(frames)]
    blocks = _blocks([(0.001, encode_information(INFORMATION)), *last_together])
    assert sum(len(block) for block in blocks) == 10


def test_times_of_bytes_are_kept_for_as_long_as_a_sample_may_wait() -> None:
    arrivals = Arrivals()
    for k in range(5 * KEPT):
        arrivals.note(3, float(k))
    last = 3 * 5 * KEPT
    assert arrivals.of(np.array([last - 3 * KEPT + 1, last - 3, last - 2, last])).tolist() == [
        4.0 * KEPT,
        5.0 * KEPT - 2,
        5.0 * KEPT - 1,
        5.0 * KEPT - 1,
    ]
