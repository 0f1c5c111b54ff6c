"""Two shoes over a bad radio on the virtual clock: nothing harmed is taken, nothing whole is lost, all is in order."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from simulators.wire.faults import FaultyAir, Outages, WireFaults
from smartshoe.devices.wire.frames import FrameDecoder, encode_samples
from smartshoe.devices.wire.samples import Samples, join_samples

RATE_HZ = 200
FRAME = 19
FAULTS = WireFaults(
    loss_percent=2.0,
    loss_burst_frames=8.0,
    duplicate_percent=0.5,
    flip_percent=1.0,
    half_percent=0.2,
    garbage_percent=0.5,
    garbage_bytes=200,
    disconnect_every_s=180.0,
    away_s=2.0,
)


@dataclass
class Shoe:
    """What a shoe sent and what was made of it."""

    seed: int
    duration_s: float
    slot_s: float = 0.1  # that the air passes on at once
    largest_read: int = 1500  # bytes that the reader takes at most

    def run(self, faults: WireFaults) -> dict[str, int]:
        rng = np.random.default_rng(self.seed)
        n = round(self.duration_s * RATE_HZ)
        first = int(rng.integers(0, 65536))
        count = first + np.arange(n)
        clock_us = int(rng.integers(0, 2**32)) + np.arange(n) * 5000 + rng.integers(-300, 300, n)
        readings = rng.integers(0, 4096, (n, 4))
        sent = encode_samples(count, clock_us, readings)
        frames = [sent[at : at + FRAME] for at in range(0, len(sent), FRAME)]
        air, outages = FaultyAir(faults, rng), Outages(faults.disconnect_every_s, faults.away_s, rng)
        decoder, parts, whole = FrameDecoder(), [], np.zeros(n, dtype=bool)
        slot, was_away, disconnects = round(self.slot_s * RATE_HZ), False, 0
        waiting = b""
        for start in range(0, n, slot):
            aired = air.pass_on(frames[start : start + slot])
            if outages.at(start / RATE_HZ) is not None:
                disconnects += not was_away
                was_away = True
                continue
            if was_away:
                # What was read before goes through whole, the frame that had begun is forgotten.
                parts.append(decoder.feed(waiting))
                decoder.reset()
                was_away, waiting = False, b""
            whole[start : start + slot] = aired.intact
            waiting += aired.data
            while len(waiting) > self.largest_read:
                size = int(rng.integers(1, self.largest_read))
                parts.append(decoder.feed(waiting[:size]))
                waiting = waiting[size:]
        parts.append(decoder.feed(waiting))
        return self._judge(join_samples(parts), count, clock_us, readings, whole) | {
            "disconnects": disconnects,
            "harmed": decoder.counters.bad,
            "duplicated": decoder.counters.duplicated,
        }

    def _judge(self, got: Samples, count, clock_us, readings, whole) -> dict[str, int]:  # type: ignore[no-untyped-def]
        # Both are unwrapped from the first frame that came, so that they agree with what was sent up to whole turns.
        place = got.sequence - got.sequence[0] + int(np.flatnonzero(whole)[0])
        is_ours = (place >= 0) & (place < count.size)
        sure = np.clip(place, 0, count.size - 1)
        same_readings = (got.readings == readings[sure]).all(axis=1)
        same_time = (
            np.abs((got.device_time_s - got.device_time_s[0]) - (clock_us[sure] - clock_us[sure[0]]) * 1e-6) < 1e-9
        )
        came = np.zeros(count.size, dtype=bool)
        came[sure] = True
        return {
            "harmed frames taken": int((~(is_ours & same_readings)).sum()),
            "whole frames lost": int((whole & ~came).sum()),
            "errors of order or time": int((np.diff(place) <= 0).sum() + (~same_time).sum() + (got.boot != 0).sum()),
            "frames": int(came.sum()),
        }


def _check(shoe: Shoe, faults: WireFaults = FAULTS) -> dict[str, int]:
    outcome = shoe.run(faults)
    assert outcome["harmed"] > 0
    assert outcome["duplicated"] > 0
    for wrong in ("harmed frames taken", "whole frames lost", "errors of order or time"):
        assert outcome[wrong] == 0, outcome
    return outcome


@pytest.mark.parametrize("seed", [1, 2])
def test_minutes_of_many_faults(seed: int) -> None:
    harsh = {"disconnect_every_s": 20.0, "flip_percent": 5.0, "half_percent": 5.0, "garbage_percent": 5.0}
    assert _check(Shoe(seed, 120.0), FAULTS.model_copy(update=harsh))["disconnects"] == 6


@pytest.mark.parametrize("seed", [11, pytest.param(12, marks=pytest.mark.long)])
def test_an_hour_of_each_shoe(seed: int) -> None:
    # In larger pieces than the minutes above, whose claim the small ones are: a fifth of the calls.
    outcome = _check(Shoe(seed, 3600.0, slot_s=0.5, largest_read=7500))
    assert outcome["disconnects"] == 20


@pytest.mark.bank
@pytest.mark.parametrize("seed", range(100, 140))
def test_a_day_and_a_half(seed: int) -> None:
    """Forty hours: ``pytest -m bank tests/devices/wire -s`` (three minutes)."""
    outcome = _check(Shoe(seed, 3600.0))
    print(outcome)
