"""The serial shoe at an emulated one: what it says, survives, counts and never does."""

from __future__ import annotations

import threading
import time
from pathlib import Path

import numpy as np
import pytest
from puppet import RATE_HZ, STEP_S, Puppet, ramp_shoe, wait_until, within

from simulators.wire.faults import WireFaults
from simulators.wire.firmware import Firmware
from simulators.wire.pty_line import PtyLine
from simulators.wire.serving import Emulator
from smartshoe.devices import Block, Disconnected, Dropped, Gap, Reconnected, Restarted, open_shoe
from smartshoe.devices._events import Silence
from smartshoe.devices.serial_link._port import SerialPort
from smartshoe.devices.serial_link._settings import SerialSettings
from smartshoe.devices.serial_link.inbox import joined
from smartshoe.devices.serial_link.shoe import SerialShoe
from smartshoe.devices.wire.frames import Command, encode_command
from smartshoe.errors import DeviceError, DeviceTimeoutError

pytestmark = pytest.mark.wire
OPEN_FILES = Path("/dev/fd")


def shoe_at(link: Path, **settings: object) -> SerialShoe:
    return SerialShoe(str(link), SerialSettings(**{"silence_s": 0.1, **settings}))  # type: ignore[arg-type]


def read_until(shoe: SerialShoe, samples: int) -> Block:
    """Blocks of ``samples`` samples or more, as one."""

    def take() -> Block:
        blocks: list[Block] = []
        for block in shoe.blocks():
            blocks.append(block)
            if sum(len(b) for b in blocks) >= samples:
                break
        return joined(blocks)

    return within(STEP_S, take)


def test_frames_come_with_the_devices_own_names_units_and_ranges(tmp_path: Path) -> None:
    with Puppet(tmp_path / "shoe0") as puppet, shoe_at(tmp_path / "shoe0") as shoe:
        puppet.send(100)
        block = read_until(shoe, 100)
        assert block.names == ("toe", "meta1", "meta4", "heel")
        assert [c.range_ for c in shoe.describe()] == [puppet.firmware_range(column) for column in range(4)]
        assert shoe.information is not None
        assert shoe.information.serial_number == "emulated"
        assert shoe.sample_rate_hz == pytest.approx(RATE_HZ)
        at = np.rint(block.time_s * RATE_HZ).astype(int)
        np.testing.assert_array_equal(at, puppet.intact[: len(block)])
        # Half a count of the converter.
        step = np.array([c.resolution for c in shoe.describe()])
        assert (np.abs(block.readings - puppet.firmware.played[at]) <= 0.5001 * step).all()
        assert not block.missing.any()


def test_each_sample_has_the_devices_time_its_arrival_and_the_fitted_host_time(tmp_path: Path) -> None:
    before_s = time.perf_counter()
    with Puppet(tmp_path / "shoe0") as puppet, shoe_at(tmp_path / "shoe0") as shoe:
        puppet.send(50)
        block = read_until(shoe, 50)
        assert shoe.device_clock is not None
    assert block.arrival_s is not None
    assert block.host_time_s is not None
    assert before_s < block.arrival_s[0] <= block.arrival_s[-1] <= time.perf_counter()
    assert (np.diff(block.time_s) > 0).all()
    assert block.host_time_s.shape == block.time_s.shape


def test_the_stream_stops_when_the_shoe_is_closed_and_starts_anew(tmp_path: Path) -> None:
    with Puppet(tmp_path / "shoe0") as puppet:
        shoe = shoe_at(tmp_path / "shoe0", format="frames")
        for _ in range(3):
            with shoe:
                assert puppet.firmware.is_streaming
            wait_until(lambda: not puppet.firmware.is_streaming)


def test_a_stream_that_a_killed_program_left_running_is_taken_up(tmp_path: Path) -> None:
    emulator = Emulator(Firmware(ramp_shoe()), PtyLine(tmp_path / "shoe0"))
    with emulator.serving() as url:
        port = SerialPort(url.removeprefix("serial://"))
        port.write(encode_command(Command("start")))
        wait_until(lambda: emulator.firmware.is_streaming)
        port.close()
        with open_shoe(url) as shoe:
            recording = within(STEP_S, lambda: shoe.record(0.3))
            assert not any(isinstance(event, Gap) for event in shoe.events)
    assert recording.sensors[0].unit.symbol == "mbar"


def test_a_gap_is_an_event_with_its_size_and_place(tmp_path: Path) -> None:
    with Puppet(tmp_path / "shoe0") as puppet, shoe_at(tmp_path / "shoe0") as shoe:
        puppet.send(20)
        puppet.lose(7)
        puppet.send(20)
        read_until(shoe, 42)
        (gap,) = [event for event in shoe.events if isinstance(event, Gap)]
        assert gap.lost == 7
        assert gap.to_s - gap.from_s == pytest.approx(8 / RATE_HZ, abs=1e-6)
        assert shoe.counters is not None
        assert shoe.counters.lost == 7


def test_a_connection_that_goes_and_returns_is_told_and_nothing_intact_is_lost(tmp_path: Path) -> None:
    with Puppet(tmp_path / "shoe0") as puppet, shoe_at(tmp_path / "shoe0") as shoe:
        puppet.send(30)
        puppet.lose(3, keep=9)
        puppet.drop(shoe)
        wait_until(lambda: any(isinstance(event, Disconnected) for event in shoe.events))
        puppet.come_back()
        wait_until(lambda: puppet.is_started)
        puppet.send(30)
        block = read_until(shoe, 60)
        assert np.rint(block.time_s * RATE_HZ).astype(int).tolist() == puppet.intact[: len(block)]
        kinds = [type(event) for event in shoe.events if not isinstance(event, Silence)]
        assert kinds[:2] == [Disconnected, Reconnected]


def test_a_device_that_restarts_goes_on_in_time(tmp_path: Path) -> None:
    with Puppet(tmp_path / "shoe0") as puppet, shoe_at(tmp_path / "shoe0") as shoe:
        puppet.send(400)
        puppet.drop(shoe)
        puppet.restart()
        puppet.come_back()
        wait_until(lambda: puppet.is_started)
        puppet.send(50)
        block = read_until(shoe, 450)
        assert (np.diff(block.time_s) > 0).all()
        (restarted,) = [event for event in shoe.events if isinstance(event, Restarted)]
        assert restarted.resumes_s in block.time_s
        # The host's clock fills the gap: reading and reconnecting took less than a step's bound.
        assert 0.0 < np.diff(block.time_s).max() < STEP_S


def test_another_shoe_at_the_same_port_is_not_taken_for_the_first(tmp_path: Path) -> None:
    with Puppet(tmp_path / "shoe0") as puppet, shoe_at(tmp_path / "shoe0") as shoe:
        puppet.send(10)
        puppet.drop(shoe)
        puppet.firmware.serial_number = "R-0007"
        puppet.come_back()
        with pytest.raises(DeviceError, match="shoe R-0007 answers where shoe emulated was"):
            read_until(shoe, 10_000)


def test_silence_is_an_event_and_only_its_bound_an_error(tmp_path: Path) -> None:
    with Puppet(tmp_path / "shoe0") as puppet:
        puppet.is_mute_after_start = True
        shoe = shoe_at(tmp_path / "shoe0", format="frames", reopen_s=0.3, give_up_s=1.2)
        with shoe:
            blocks = shoe.blocks()
            read = within(STEP_S, lambda: next(blocks))
            assert len(read) >= 1
            assert len(within(STEP_S, lambda: next(blocks))) == 0

            def drain() -> None:
                for block in blocks:
                    assert len(block) == 0

            with pytest.raises(DeviceTimeoutError, match=r"no valid frame for 1\.2 s.*give_up_s") as failed:
                within(STEP_S, drain)
            assert failed.value.exit_status == 4
            with pytest.raises(DeviceTimeoutError):
                next(shoe.blocks())
            kinds = {type(event) for event in shoe.events}
            assert {Silence, Disconnected} <= kinds


def test_a_port_that_is_open_but_silent_is_opened_anew_and_the_stream_goes_on(tmp_path: Path) -> None:
    with Puppet(tmp_path / "shoe0") as puppet, shoe_at(tmp_path / "shoe0", reopen_s=0.3) as shoe:
        puppet.is_mute_after_start = True
        wait_until(lambda: any(isinstance(event, Disconnected) for event in shoe.events))
        puppet.is_mute_after_start = False
        wait_until(lambda: any(isinstance(event, Reconnected) for event in shoe.events))
        (lost, back) = (next(e for e in shoe.events if isinstance(e, kind)) for kind in (Disconnected, Reconnected))
        assert "no valid frame" in lost.reason
        assert back.away_s > 0.3
        assert read_until(shoe, 4).names == ("toe", "meta1", "meta4", "heel")


def test_a_stall_delays_and_loses_nothing(tmp_path: Path) -> None:
    faults = WireFaults(stall_every_s=1.0, stall_s=0.4)
    emulator = Emulator(Firmware(ramp_shoe()), PtyLine(tmp_path / "shoe0"), faults)
    with emulator.serving() as url, open_shoe(f"{url}?silence_s=0.2") as shoe:
        blocks: list[Block] = []

        def take() -> None:
            for block in shoe.blocks():
                blocks.append(block)
                if sum(len(b) for b in blocks) >= 2 * RATE_HZ:
                    return

        within(STEP_S, take)
        assert [type(event) for event in shoe.events if not isinstance(event, Silence)] == []
    arrivals_s = np.concatenate([b.arrival_s for b in blocks if b.arrival_s is not None])
    assert np.diff(arrivals_s).max() > 0.3
    np.testing.assert_allclose(np.diff(joined(blocks).time_s), 1 / RATE_HZ, atol=2e-6)


def test_opening_and_closing_leaves_nothing_behind(tmp_path: Path) -> None:
    with Puppet(tmp_path / "shoe0") as puppet:
        shoe = shoe_at(tmp_path / "shoe0", format="frames")
        with shoe:
            pass
        before = threading.active_count(), len(list(OPEN_FILES.glob("*")))
        for _ in range(20):
            puppet.settle()
            with shoe:
                pass
        assert (threading.active_count(), len(list(OPEN_FILES.glob("*")))) == before


def test_a_port_that_stays_away_ends_the_stream_at_the_bound(tmp_path: Path) -> None:
    with Puppet(tmp_path / "shoe0") as puppet, shoe_at(tmp_path / "shoe0", give_up_s=0.6) as shoe:
        puppet.send(10)
        puppet.drop(shoe)
        with pytest.raises(DeviceTimeoutError, match="is not there"):
            read_until(shoe, 10_000)


def test_closing_from_another_thread_ends_the_blocks_at_once(tmp_path: Path) -> None:
    with Puppet(tmp_path / "shoe0"):
        shoe = shoe_at(tmp_path / "shoe0", silence_s=60.0).open()
        ended = threading.Event()

        def drain() -> None:
            for _ in shoe.blocks():
                pass
            ended.set()

        threading.Thread(target=drain, daemon=True).start()
        time.sleep(0.1)
        shoe.close()
        assert ended.wait(STEP_S)


def test_what_nobody_reads_is_dropped_from_the_old_end_and_told(tmp_path: Path) -> None:
    with Puppet(tmp_path / "shoe0") as puppet, shoe_at(tmp_path / "shoe0", buffer=100) as shoe:

        def dropped() -> int:
            return sum(event.samples for event in shoe.events if isinstance(event, Dropped))

        for _ in range(20):
            puppet.send(50)
        wait_until(lambda: dropped() >= len(puppet.intact) - 200)
        taken: list[int] = []

        def take() -> None:
            for block in shoe.blocks():
                taken.extend(np.rint(block.time_s * RATE_HZ).astype(int).tolist())
                if dropped() + len(taken) >= len(puppet.intact):
                    return

        within(STEP_S, take)
        assert dropped() + len(taken) == len(puppet.intact)
        assert taken == puppet.intact[dropped() :]


def test_a_port_in_use_says_so(tmp_path: Path) -> None:
    with Puppet(tmp_path / "shoe0"), shoe_at(tmp_path / "shoe0"):
        with pytest.raises(DeviceError, match="held by another program") as failed:
            shoe_at(tmp_path / "shoe0").open()
        assert failed.value.exit_status == 4


def test_an_absent_port_says_so(tmp_path: Path) -> None:
    with pytest.raises(DeviceError, match="is not there"):
        shoe_at(tmp_path / "shoe0").open()


@pytest.mark.parametrize(
    ("sent", "options", "says"),
    [
        (b"", {}, "no byte came"),
        (b"12.1,3.2\r\n" * 40, {"format": "lines"}, "text lines of 2 numbers, not 5"),
        (b"hello, world\n" * 40, {}, "text lines without numbers"),
        (b"\0\xff" * 200, {}, "baud"),
        (b"10,1,2,3,4\n20,1,2,3,4\n" * 20, {"format": "frames"}, "text lines of 5 numbers"),
    ],
)
def test_what_is_no_shoe_is_said_to_be_what_it_looks_like(
    tmp_path: Path, sent: bytes, options: dict[str, object], says: str
) -> None:
    with PtyLine(tmp_path / "shoe0") as line:
        stop = threading.Event()

        def babble() -> None:
            while not stop.wait(0.02):
                if line.peer_is_there:
                    line.write(sent)

        thread = threading.Thread(target=babble, daemon=True)
        thread.start()
        try:
            with pytest.raises(DeviceTimeoutError, match=says) as failed:
                within(STEP_S, shoe_at(tmp_path / "shoe0", wait_s=0.8, **options).open)
            assert failed.value.exit_status == 4
            assert "\n" not in str(failed.value)
        finally:
            stop.set()
            thread.join()


def test_counts_cannot_become_millibars_by_wishing(tmp_path: Path) -> None:
    lines = [f"{10 * k},{k},{k},{k},{k}\n".encode() for k in range(150)]
    with PtyLine(tmp_path / "shoe0") as line:
        thread = threading.Thread(
            target=lambda: [(time.sleep(0.005), line.peer_is_there and line.write(text)) for text in lines], daemon=True
        )
        thread.start()
        with shoe_at(tmp_path / "shoe0") as shoe:
            assert shoe.describe()[0].unit.symbol == "counts"
        with shoe_at(tmp_path / "shoe0", unit="mbar") as shoe:  # text lines are in what the address says
            assert shoe.describe()[0].unit.symbol == "mbar"
        thread.join()


@pytest.mark.parametrize("format_", ["frames", "lines"])
def test_two_shoes_at_once_at_200_hz_lose_nothing(tmp_path: Path, format_: str) -> None:
    def emulated(side: str) -> Emulator:
        return Emulator(Firmware(ramp_shoe(), format_), PtyLine(tmp_path / side))  # type: ignore[arg-type]

    left, right = emulated("left"), emulated("right")
    with (
        left.serving() as left_url,
        right.serving() as right_url,
        open_shoe(f"{left_url}?side=left") as one,
        open_shoe(f"{right_url}?side=right") as other,
    ):
        blocks = [within(STEP_S, lambda s=s: s.record(0.5)) for s in (one, other)]
        assert not any(isinstance(event, Gap) for shoe in (one, other) for event in shoe.events)
    assert [recording.sensors[0].name for recording in blocks] == ["left_toe", "right_toe"]
    for recording in blocks:
        np.testing.assert_allclose(np.diff(recording.time_s), 1 / RATE_HZ, atol=2e-6)


def test_a_rate_that_is_asked_for_is_kept(tmp_path: Path) -> None:
    emulator = Emulator(Firmware(ramp_shoe()), PtyLine(tmp_path / "shoe0"))
    with emulator.serving() as url, open_shoe(f"{url}?rate=50") as shoe:
        assert shoe.sample_rate_hz == pytest.approx(50.0)
        np.testing.assert_allclose(np.diff(shoe.record(0.5).time_s), 0.02, atol=2e-6)


def test_in_real_time_at_1_khz_nothing_is_lost(tmp_path: Path) -> None:
    emulator = Emulator(Firmware(ramp_shoe(), rate_hz=1000.0), PtyLine(tmp_path / "shoe0"))
    with emulator.serving() as url, open_shoe(url) as shoe:
        recording = within(3 * STEP_S, lambda: shoe.record(2.0))
        assert shoe.events == ()
    assert emulator.served.dropped_bytes == 0
    np.testing.assert_allclose(np.diff(recording.time_s), 1e-3, atol=2e-6)


def test_as_fast_as_it_is_read_nothing_is_lost_and_time_is_the_samples(tmp_path: Path) -> None:
    emulator = Emulator(Firmware(ramp_shoe()), PtyLine(tmp_path / "shoe0"), pace="drain")
    with emulator.serving() as url, open_shoe(url) as shoe:
        recording = within(3 * STEP_S, lambda: shoe.record(200.0))
        assert not any(isinstance(event, Gap) for event in shoe.events)
    assert len(recording) == pytest.approx(200 * RATE_HZ, abs=1)
    np.testing.assert_allclose(np.diff(recording.time_s), 1 / RATE_HZ, atol=2e-6)


@pytest.mark.parametrize("restarts", [False, True])
def test_as_fast_as_it_is_read_the_port_still_goes_and_returns(tmp_path: Path, restarts: bool) -> None:
    faults = WireFaults(disconnect_every_s=20.0, away_s=1.0, stall_every_s=5.0, batch_ms=20.0, restarts=restarts)
    emulator = Emulator(Firmware(ramp_shoe()), PtyLine(tmp_path / "shoe0"), faults, pace="drain")
    with emulator.serving() as url, open_shoe(url) as shoe:
        within(3 * STEP_S, lambda: shoe.record(50.0))
        kinds = [type(event) for event in shoe.events]
    assert emulator.served.disconnections >= 2
    assert kinds.count(Reconnected) >= 2
    assert (kinds.count(Restarted) >= 2) == restarts


def test_a_reader_that_does_not_read_never_stops_the_emulator(tmp_path: Path) -> None:
    """As a radio, it drops what nobody takes, and counts it."""
    emulator = Emulator(Firmware(ramp_shoe(), rate_hz=2000.0), PtyLine(tmp_path / "shoe0"))
    with emulator.serving() as url:
        port = SerialPort(url.removeprefix("serial://"))
        port.write(encode_command(Command("start")))
        wait_until(lambda: emulator.served.dropped_bytes > 0)
        before_s = emulator.served.device_s
        wait_until(lambda: emulator.served.device_s > before_s + 0.1)
        port.close()


def test_a_walk_over_bad_bluetooth_is_told_as_it_was(tmp_path: Path) -> None:
    faults = WireFaults(
        loss_percent=3.0, flip_percent=2.0, garbage_percent=2.0, half_percent=1.0, duplicate_percent=1.0,
        disconnect_every_s=3.0, away_s=0.3, batch_ms=20.0, clock_skew_ppm=50.0,
    )  # fmt: skip
    firmware = Firmware(ramp_shoe(), clock_skew_ppm=faults.clock_skew_ppm)
    emulator = Emulator(firmware, PtyLine(tmp_path / "shoe0"), faults, np.random.default_rng(5))
    with emulator.serving() as url, open_shoe(url) as shoe:
        recording = within(3 * STEP_S, lambda: shoe.record(3.2))
        assert any(isinstance(event, Reconnected) for event in shoe.events)
        lost = sum(event.lost for event in shoe.events if isinstance(event, Gap))
    at = np.rint(recording.time_s * RATE_HZ / (1 + 50e-6)).astype(int)
    assert (np.diff(at) > 0).all()
    expected = firmware.played[at % len(firmware.played)]
    read = np.column_stack([channel.values for channel in recording.sensors])
    assert np.abs(read - expected).max() < 0.01  # a count is 0.0153 mbar: half of one
    assert at[-1] - at[0] + 1 - len(at) <= lost
