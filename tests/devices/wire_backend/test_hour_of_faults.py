"""Two shoes through a bad radio on the virtual clock: nothing corrupted passes, nothing intact is lost.

The hour of the figures is `pytest -m bank tests/devices/wire_backend/test_hour_of_faults.py -s`; every day it is two
minutes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from puppet import RATE_HZ, ramp_shoe

from simulators.wire.faults import FaultyAir, Outages, WireFaults
from simulators.wire.firmware import Firmware
from smartshoe.devices import Block, Gap
from smartshoe.devices.serial_link._assembly import Assembler
from smartshoe.devices.serial_link.inbox import joined
from smartshoe.devices.wire.frames import Command, FrameDecoder, encode_command

FAULTS = WireFaults(
    loss_percent=2.0, loss_burst_frames=10.0, flip_percent=1.0, half_percent=0.2, garbage_percent=0.5,
    duplicate_percent=0.5, clock_skew_ppm=80.0, disconnect_every_s=180.0, away_s=2.0,
)  # fmt: skip
STEP_S = 0.05
LATEST_ARRIVAL_S = 0.02
MICROSECOND = 1e-6


@dataclass
class Tally:
    """Of one shoe: frames that arrived whole, samples given out, and what went wrong."""

    disconnections: int
    intact: int
    accepted: int
    corrupted: int
    lost: int
    out_of_order: int
    time_errors: int
    untold: int


def through_the_radio(duration_s: float, faults: WireFaults, seed: int) -> Tally:
    rng = np.random.default_rng(seed)
    firmware = Firmware(ramp_shoe(), clock_skew_ppm=faults.clock_skew_ppm, boot_us=2**32 - 30_000_000)
    air, outages = FaultyAir(faults, rng), Outages(faults.disconnect_every_s, faults.away_s, rng)
    decoder = FrameDecoder()
    assembler: Assembler | None = None
    blocks: list[Block] = []
    told_lost = disconnections = taken = 0
    intact: list[np.ndarray] = []

    def receive(data: bytes, now_s: float) -> None:
        nonlocal assembler, told_lost
        samples = decoder.feed(data)
        if not len(samples):
            return
        if assembler is None:
            assembler = Assembler(samples, firmware.information)
        block, events = assembler.take(samples, now_s + float(rng.uniform(0.0, LATEST_ARRIVAL_S)))
        blocks.append(block)
        told_lost += sum(event.lost for event in events if isinstance(event, Gap))

    firmware.hear(encode_command(Command("start")))
    was_away = False
    # A last second without faults: what still waits to be sure at the end becomes sure.
    clean_air = FaultyAir(WireFaults(), rng)
    for tick in range(1, round((duration_s + 1.0) / STEP_S) + 1):
        now_s = tick * STEP_S
        frames = firmware.due(now_s)
        places = taken + np.arange(len(frames))
        taken += len(frames)
        is_clean = now_s > duration_s
        away = outages.at(now_s) is not None and not is_clean
        if away and not was_away:
            disconnections += 1
            receive(b"".join(frames)[: int(rng.integers(0, 19))], now_s)  # the cable goes within a frame
        elif not away:
            if was_away:
                decoder.reset()
            aired = (clean_air if is_clean else air).pass_on(frames)
            intact.append(places[aired.intact])
            receive(aired.data, now_s)
        was_away = away
    whole = joined(blocks)
    assert assembler is not None
    true_s = taken_times(taken) * (1.0 + faults.clock_skew_ppm * 1e-6) + (2**32 - 30_000_000) * 1e-6
    places = np.rint((whole.time_s - true_s[0]) * RATE_HZ / (1.0 + faults.clock_skew_ppm * 1e-6)).astype(int)
    expected = firmware.counts(firmware.played[places % len(firmware.played)])
    scale = np.array([(c.high - c.low) / 65534 for c in firmware.information.channels])
    counts = np.rint(whole.readings / scale).astype(int)
    sent = np.concatenate(intact)
    first, last = places[0], places[-1]
    missing = (last - first + 1) - len(places)
    return Tally(
        disconnections=disconnections,
        intact=len(sent),
        accepted=len(places),
        corrupted=int((counts != expected).any(axis=1).sum()),
        lost=int(np.setdiff1d(sent, places).size),
        out_of_order=int((np.diff(places) <= 0).sum()),
        time_errors=int((np.abs(whole.time_s - true_s[places]) > 0.51 * MICROSECOND).sum()),
        untold=int(missing - told_lost),
    )


def taken_times(count: int) -> np.ndarray:
    """True times in s of the samples."""
    return np.arange(count) / RATE_HZ


def require_nothing_wrong(tally: Tally) -> None:
    assert (tally.corrupted, tally.lost, tally.out_of_order, tally.time_errors, tally.untold) == (0, 0, 0, 0, 0)


@pytest.mark.parametrize("seed", [1, pytest.param(2, marks=pytest.mark.bank)])
def test_two_minutes_of_two_shoes_through_a_bad_radio(seed: int) -> None:
    tally = through_the_radio(120.0, FAULTS.model_copy(update={"disconnect_every_s": 20.0}), seed)
    assert tally.disconnections >= 5
    assert tally.intact > 0.8 * 120 * RATE_HZ
    require_nothing_wrong(tally)


@pytest.mark.bank
@pytest.mark.parametrize("seed", [11, 12])
def test_an_hour_of_two_shoes_through_a_bad_radio(seed: int) -> None:
    tally = through_the_radio(3600.0, FAULTS, seed)
    print(tally)
    assert tally.disconnections == 20
    require_nothing_wrong(tally)
