"""Over a pseudo-terminal in real time, emulator and reader in two processes: samples lost, and how late they come.

`pytest -m benchmark tests/benchmarks/test_serial_latency_benchmark.py -s` prints the figures. Latency is from the
moment that a sample was due at the device, just before it is written, to the moment that a loop over `blocks` has it.
"""

from __future__ import annotations

import multiprocessing
import time
from multiprocessing.connection import Connection
from pathlib import Path

import numpy as np
import pytest

from smartshoe.devices import Gap, open_shoe

RATE_HZ = 1000.0
DURATION_S = 60.0


def serve(link: str, pipe: Connection) -> None:
    """The emulator's process: says when its clock began, serves until told to stop."""
    import threading

    from simulators.wire.firmware import Firmware
    from simulators.wire.pty_line import PtyLine
    from simulators.wire.serving import Emulator

    with open_shoe("sim:walk", duration_s=10.0) as walking:
        walking_there = walking
        firmware = Firmware(walking_there, rate_hz=RATE_HZ)
    emulator = Emulator(firmware, PtyLine(link))
    emulator.line.appear()
    stop = threading.Event()
    thread = threading.Thread(target=emulator.run, args=(stop,))
    begin_s = time.perf_counter()
    thread.start()
    pipe.send(begin_s)
    pipe.recv()
    stop.set()
    thread.join()
    pipe.send((emulator.served.dropped_bytes, emulator.served.frames))


@pytest.mark.benchmark
@pytest.mark.wire
def test_a_minute_at_1_khz(tmp_path: Path) -> None:
    here, there = multiprocessing.Pipe()
    context = multiprocessing.get_context("spawn")
    process = context.Process(target=serve, args=(str(tmp_path / "shoe0"), there))
    process.start()
    begin_s = here.recv()
    latencies: list[np.ndarray] = []
    samples = 0
    with open_shoe(f"serial://{tmp_path / 'shoe0'}") as shoe:
        cpu_s = time.process_time()
        for block in shoe.blocks():
            now_s = time.perf_counter()
            # perf_counter is one clock for all processes; the device's began with the emulator's.
            latencies.append(now_s - begin_s - block.time_s)
            samples += len(block)
            if samples >= DURATION_S * RATE_HZ:
                break
        cpu_s = time.process_time() - cpu_s
        lost = sum(event.lost for event in shoe.events if isinstance(event, Gap))
        events = len(shoe.events)
    here.send("stop")
    dropped, _ = here.recv()
    process.join()
    latency_ms = 1e3 * np.concatenate(latencies)[round(RATE_HZ) :]
    p50, p99, p999 = np.percentile(latency_ms, [50, 99, 99.9])
    print(
        f"\n{samples} samples at {RATE_HZ:g} Hz: {lost} lost, {events} events, {dropped} bytes dropped;"
        f" latency p50 {p50:.2f}, p99 {p99:.2f}, p99.9 {p999:.2f}, worst {latency_ms.max():.2f} ms;"
        f" reader {100 * cpu_s / DURATION_S:.0f} % of a core"
    )
    assert (lost, dropped) == (0, 0)
