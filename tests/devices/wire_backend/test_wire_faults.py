"""The radio's faults, on bytes alone."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from simulators.wire.faults import FaultyAir, Outages, WireFaults

FRAMES = [bytes([i % 250 + 1] * 18) + b"\0" for i in range(20_000)]


def test_without_faults_every_byte_arrives() -> None:
    aired = FaultyAir(WireFaults(), np.random.default_rng(1)).pass_on(FRAMES)
    assert aired.data == b"".join(FRAMES)
    assert aired.intact.all()


@given(cut=st.integers(0, 200), seed=st.integers(0, 2**32 - 1))
def test_what_is_called_intact_is_in_the_bytes_in_order(cut: int, seed: int) -> None:
    faults = WireFaults(loss_percent=10, flip_percent=10, half_percent=5, garbage_percent=5, duplicate_percent=5)
    frames = FRAMES[:200]
    air = FaultyAir(faults, np.random.default_rng(seed))
    parts = [air.pass_on(frames[:cut]), air.pass_on(frames[cut:])]
    data, intact = b"".join(p.data for p in parts), np.concatenate([p.intact for p in parts])
    at = 0
    for frame in (frame for frame, whole in zip(frames, intact, strict=True) if whole):
        found = data.find(frame, at)
        assert found >= 0
        at = found + len(frame)


def test_loss_has_the_share_and_the_bursts_that_were_asked_for() -> None:
    faults = WireFaults(loss_percent=2.0, loss_burst_frames=10.0)
    lost = ~FaultyAir(faults, np.random.default_rng(3)).pass_on(FRAMES * 10).intact
    bursts = np.count_nonzero(np.diff(np.concatenate([[0], lost.astype(int)])) == 1)
    # 400 bursts of geometric length: the share's standard deviation is 0.02 sqrt(2 / 400) = 0.0014.
    assert lost.mean() == pytest.approx(0.02, abs=4 * 0.0014)
    assert lost.sum() / bursts == pytest.approx(10.0, abs=4 * 10 / np.sqrt(400))


def test_flips_change_bits_and_not_the_length() -> None:
    aired = FaultyAir(WireFaults(flip_percent=100.0), np.random.default_rng(4)).pass_on(FRAMES[:500])
    sent = b"".join(FRAMES[:500])
    assert len(aired.data) == len(sent)
    assert not aired.intact.any()
    changed = np.unpackbits(np.frombuffer(aired.data, np.uint8) ^ np.frombuffer(sent, np.uint8)).reshape(500, -1)
    assert (changed.sum(axis=1) >= 1).all()


def test_an_outage_lies_in_every_slot_and_lasts_as_long_as_it_should() -> None:
    outages = Outages(180.0, 2.0, np.random.default_rng(5))
    time_s = np.arange(0.0, 3600.0, 0.05)
    away = np.array([outages.at(float(t)) is not None for t in time_s])
    assert np.count_nonzero(np.diff(away.astype(int)) == 1) == 20
    assert away.sum() * 0.05 == pytest.approx(40.0, abs=20 * 0.05)
    assert Outages(0.0, 2.0, np.random.default_rng(5)).at(1.0) is None
