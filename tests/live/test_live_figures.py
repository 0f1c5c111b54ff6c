"""``pytest -m benchmark tests/live/test_live_figures.py -s`` prints docs/live.md's figures."""

from __future__ import annotations

import contextlib
import socket
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest
from live_browser import PROGRAM, Browser
from serving import health, page, serving, until, walk_table
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection

from smartshoe.live._client import Client
from smartshoe.live.server import LiveServer
from smartshoe.live.session import LiveSession

SECONDS = 30.0


def memory_kb() -> int:
    """Memory of this process that is its own."""
    fields = dict(line.split(":", 1) for line in Path("/proc/self/status").read_text().splitlines() if ":" in line)
    return int(fields["RssAnon"].split()[0])


def emulated(folder: Path, side: str) -> tuple[subprocess.Popen[str], str]:
    """Eight channels at 200 Hz at a pseudo-terminal, served by a process of their own."""
    table = walk_table(folder / f"{side}.csv", 60.0, (side,))
    lines = table.read_text().splitlines()
    more = [",".join([lines[0], *(f"{side}_extra{k}_mbar" for k in range(4))])]
    table.write_text("\n".join(more + [f"{line},{line.split(',', 1)[1]}" for line in lines[1:]]))
    words = [
        sys.executable,
        "-m",
        "simulators.wire.emulator",
        f"replay:{table}",
        "--link",
        str(folder / f"shoe_{side}"),
    ]
    process = subprocess.Popen(words, stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    process.stdout.readline()
    return process, process.stdout.readline().split("--shoe ")[1].strip()


@pytest.mark.benchmark
@pytest.mark.wire
def test_from_port_to_pixel(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert PROGRAM is not None
    emulators = [emulated(tmp_path, side) for side in ("left", "right")]
    arrived: dict[int, float] = {}  # frame: when the oldest sample that is new in it came
    plain = Client.frame

    def frame(client: Client) -> bytes | None:
        oldest = [seen.pop("first", None) for seen in new]
        made = plain(client)
        found = [at for at in oldest if at is not None]
        if made is not None and found:
            arrived[client._number - 1] = min(found) - time.perf_counter() + time.time()
        return made

    monkeypatch.setattr(Client, "frame", frame)
    new: list[dict[str, float]] = [{}, {}]
    try:
        with serving(*(url for _, url in emulators)) as (server, session):
            for seen, live in zip(new, session.shoes, strict=True):
                take = live.take

                def noted(block, session_s, force_n, take=take, seen=seen):  # type: ignore[no-untyped-def]
                    steps = take(block, session_s, force_n)
                    seen.setdefault("first", float(block.arrival_s[0]))
                    return steps

                live.take = noted  # type: ignore[method-assign]
            server.desk.start()
            _watched(server, session, arrived)
            server.desk.close()
    finally:
        for process, _ in emulators:
            process.send_signal(2)
            process.communicate(timeout=20)


def _watched(server: LiveServer, session: LiveSession, arrived: dict[int, float]) -> None:
    until(lambda: all(live.samples > 500 for live in session.shoes))
    with Browser() as browser:
        browser.open(server.url)
        browser.until("typeof live !== 'undefined' && live.drawn > 20")
        # Seen in the animation frame after the one that draws: what was drawn is on the screen by then. Beside it, when
        # each picture was at the page, when drawing it began, and how long that took.
        browser.run(
            "window.seen = [], window.parts = [], (() => { const got = {}, add = picture, plain = draw;"
            " picture = (frame) => { got[frame.number] = performance.now(); add(frame); };"
            " draw = () => { const frame = live.last, begun = performance.now(); plain(); if (!frame) return;"
            " requestAnimationFrame(() => seen.push([frame.number, Date.now()]));"
            " parts.push([frame.number, performance.timeOrigin + got[frame.number], begun - got[frame.number],"
            " performance.now() - begun]); }; })(), 0"
        )
        time.sleep(2.0)
        before, cpu_s, wall_s = memory_kb(), time.process_time(), time.perf_counter()
        heap = browser.run("performance.memory.usedJSHeapSize")
        time.sleep(SECONDS)
        cpu_s, wall_s = time.process_time() - cpu_s, time.perf_counter() - wall_s
        seen, parts = browser.run("seen"), browser.run("parts")
        heap_after = browser.run("performance.memory.usedJSHeapSize")
        assert browser.errors == []
    late_ms = np.array([at - 1e3 * arrived[number] for number, at in seen if number in arrived])
    print(
        f"\nport to pixel: median {np.median(late_ms):.0f} ms, 95 % {np.quantile(late_ms, 0.95):.0f} ms,"
        f" {late_ms.size} frames"
    )
    at_page = np.array([at - 1e3 * arrived[number] for number, at, _, _ in parts if number in arrived])
    for what, part in (
        ("port to page", at_page),
        ("page to the drawing's begin", np.array([wait for _, _, wait, _ in parts])),
        ("drawing", np.array([took for _, _, _, took in parts])),
    ):
        print(f"  of it {what}: median {np.median(part):.1f} ms, 95 % {np.quantile(part, 0.95):.1f} ms")
    print(f"frames drawn a second: {len(seen) / wall_s:.1f}; server's processor time {100 * cpu_s / wall_s:.1f} %")
    print(f"memory: server {memory_kb() - before} kB in {wall_s:.0f} s, page's heap {(heap_after - heap) / 1e3:.0f} kB")
    print(f"lost {health(server)['lost']}, clocks {[live.clock_dict() for live in session.shoes]}")
    slow = []
    for _ in range(10):
        raw = socket.create_connection(("127.0.0.1", server.port))
        raw.sendall(
            f"GET /ws HTTP/1.1\r\nHost: 127.0.0.1:{server.port}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
            "Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\nSec-WebSocket-Version: 13\r\n\r\n".encode()
        )
        slow.append(raw)
    delays: list[list[float]] = [[], []]
    end_s = time.perf_counter() + 10.0
    while time.perf_counter() < end_s:
        for raw in slow:
            raw.recv(1)
        for live, own in zip(session.shoes, delays, strict=True):
            own.append(time.perf_counter() - live.last_arrival_s)
        time.sleep(1.0)
    print(f"ten pages that read a byte a second: lost {health(server)['lost']}, clients {health(server)['clients']}")
    for raw in slow:
        raw.close()


@pytest.mark.benchmark
def test_half_an_hour_more_in_no_more_memory(tmp_path: Path) -> None:
    walk = walk_table(tmp_path / "walk.csv", 2460.0)
    with serving(f"replay:{walk}", speed=100.0) as (server, session), page(server) as client:
        thread = threading.Thread(target=_read_on, args=(client,), daemon=True)
        thread.start()
        found = []
        for minutes in (10, 20, 30, 40):
            until(lambda now_s=60.0 * minutes: session.now_s() > now_s, 600.0)
            found.append(memory_kb())
        grown = ", ".join(f"{after - found[0]:+} kB" for after in found[1:])
        print(f"\nserver's memory after minute 10, at 20, 30, 40: {grown}; samples {session.shoes[0].samples}")
    thread.join(60.0)


def _read_on(client: ClientConnection) -> None:
    with contextlib.suppress(ConnectionClosed):
        while True:
            client.recv(timeout=60)
