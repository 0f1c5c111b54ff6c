"""A live page's server in this process, and a walk to show: what the tests of this room share."""

from __future__ import annotations

import json
import threading
import time
import urllib.request
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from websockets.sync.client import ClientConnection, connect

from smartshoe.devices import open_shoe
from smartshoe.live.server import LiveServer
from smartshoe.live.session import LiveSession

RATE_HZ = 200.0
REGIONS = ("toe", "meta1", "meta4", "heel")


def walk_table(path: Path, seconds: float = 10.0, sides: tuple[str, ...] = ("left", "right")) -> Path:
    """A plain table of a walk at one stride a second: each unit a hump, heel first, the right foot half a stride on."""
    time_s = np.arange(round(seconds * RATE_HZ)) / RATE_HZ
    columns, names = [time_s], ["time_s"]
    for k, side in enumerate(sides):
        for region, centre in zip(REGIONS, (0.5, 0.42, 0.38, 0.2), strict=True):
            phase = (time_s - 0.5 * k - centre + 0.5) % 1.0 - 0.5
            columns.append(2.0 + 40.0 * np.clip(1.0 - (phase / 0.18) ** 2, 0.0, None))
            names.append(f"{side}_{region}_mbar" if side else f"{region}_mbar")
    np.savetxt(path, np.column_stack(columns), fmt="%.9g", delimiter=",", header=",".join(names), comments="")
    return path


@contextmanager
def serving(
    *urls: str, token: str | None = None, port: int = 0, **options: Any
) -> Iterator[tuple[LiveServer, LiveSession]]:
    """A server of the shoes at ``urls`` that is ready, ended in the end as the command ends it."""
    shoes = {url: open_shoe(url).open() for url in urls}
    session = LiveSession(shoes, **options)
    server = LiveServer(session, port=port, token=token)
    session.start()
    thread = threading.Thread(target=server.run)
    thread.start()
    try:
        yield server, session
    finally:
        server.stop()
        thread.join(30.0)
        session.close()
        for shoe in shoes.values():
            shoe.close()
    assert not thread.is_alive()


def page(server: LiveServer, query: str = "", **options: Any) -> ClientConnection:
    """A page's websocket."""
    return connect(f"ws://127.0.0.1:{server.port}/ws{query}", **options)


def told(socket: ClientConnection, kind: str, is_it: Callable[[Any], bool] = lambda _: True) -> Any:
    """The next JSON message of a kind (of which ``is_it`` holds)."""
    for _ in range(2000):
        message = socket.recv(timeout=30.0)
        if isinstance(message, str):
            found = json.loads(message)
            if found["type"] == kind and is_it(found):
                return found
    raise AssertionError(f"no {kind} came")


def health(server: LiveServer) -> Any:
    """The health as JSON."""
    with urllib.request.urlopen(f"{server.url}health", timeout=30.0) as answer:
        return json.load(answer)


def until(is_so: Callable[[], bool], seconds: float = 60.0) -> None:
    """Wait until something is so, for ``seconds`` at most."""
    end_s = time.monotonic() + seconds
    while not is_so():
        assert time.monotonic() < end_s, "it did not come to be"
        time.sleep(0.01)
