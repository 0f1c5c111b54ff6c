"""`LiveServer`: serves the live page, its health, and a websocket through which each open page gets its frames."""

from __future__ import annotations

import asyncio
import contextlib
import json
import signal
import socket
from collections.abc import Callable, Iterator

import uvicorn
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import JSONResponse, Response
from starlette.routing import Route, WebSocketRoute
from starlette.websockets import WebSocket, WebSocketDisconnect

from smartshoe.errors import UsageError
from smartshoe.live._client import Client
from smartshoe.live._desk import Desk
from smartshoe.live._document import document
from smartshoe.live._guard import Guard
from smartshoe.live.session import LiveSession

LONGEST_MESSAGE = 4096
MOST_CLIENTS = 64
FRAME_S, IDLE_FRAME_S = 1.0 / 60.0, 1.0 / 30.0
END_WITHIN_S = 2


class LiveServer:
    """Serves ``session`` at ``host`` and ``port`` (0 for a free one); requests need ``token`` unless it is None."""

    def __init__(self, session: LiveSession, host: str = "127.0.0.1", port: int = 0, token: str | None = None) -> None:
        self.session = session
        self.desk = Desk(session)
        self._socket = _listening(host, port)
        self.host, self.port = host, int(self._socket.getsockname()[1])
        self._data = asyncio.Event()
        self._loop: asyncio.AbstractEventLoop | None = None
        self._is_woken = False
        page, policy = document()
        headers = {
            "content-security-policy": policy,
            "x-content-type-options": "nosniff",
            "referrer-policy": "no-referrer",
            "cache-control": "no-store",
        }

        async def show(_: Request) -> Response:
            return Response(page, media_type="text/html", headers=headers)

        async def health(_: Request) -> Response:
            return JSONResponse(session.health(len(self.desk.clients)), headers={"cache-control": "no-store"})

        routes = [Route("/", show), Route("/health", health), WebSocketRoute("/ws", self._page)]
        app = Guard(Starlette(routes=routes), self.port, token)
        self._server = _Server(
            uvicorn.Config(
                app,
                http="h11",
                ws="websockets-sansio",
                loop="asyncio",
                lifespan="off",
                log_level="critical",
                access_log=False,
                server_header=False,
                ws_max_size=LONGEST_MESSAGE,
                ws_per_message_deflate=False,
                timeout_graceful_shutdown=END_WITHIN_S,
            )
        )

    @property
    def url(self) -> str:
        """The address of the page."""
        host = f"[{self.host}]" if ":" in self.host else self.host
        return f"http://{host}:{self.port}/"

    def run(self, ready: Callable[[], None] = lambda: None) -> None:
        """Serve until `stop`, or SIGINT or SIGTERM in the main thread; ``ready`` is called once at the start."""
        asyncio.run(self._serve(ready))

    def stop(self) -> None:
        """Make `run` end; may be called from any thread."""
        self._server.should_exit = True

    def close(self) -> None:
        """Release the port if `run` was never called."""
        self._socket.close()

    async def _serve(self, ready: Callable[[], None]) -> None:
        """Run the server and wake its pages until it is stopped."""
        self._loop = asyncio.get_running_loop()
        for number in (signal.SIGINT, signal.SIGTERM):
            # In other threads and on Windows there is no such handler; there Ctrl-C raises KeyboardInterrupt.
            with contextlib.suppress(RuntimeError, ValueError, NotImplementedError):
                self._loop.add_signal_handler(number, self.stop)
        self.session.changed = self._changed
        ready()
        ticking = asyncio.create_task(self._tick())
        try:
            await self._server.serve(sockets=[self._socket])
        finally:
            self.session.changed = lambda: None
            ticking.cancel()
            self._socket.close()

    def _changed(self) -> None:
        """Wake the pages' loop, from any thread; once until it has run."""
        if not self._is_woken and self._loop is not None:
            self._is_woken = True
            with contextlib.suppress(RuntimeError):  # the loop has ended
                self._loop.call_soon_threadsafe(self._data.set)

    async def _tick(self) -> None:
        """Wake the pages for new samples, at most 60 and at least 30 times a second."""
        while True:
            with contextlib.suppress(TimeoutError):
                await asyncio.wait_for(self._data.wait(), IDLE_FRAME_S)
            self._data.clear()
            self._is_woken = False
            for client in self.desk.clients:
                client.wake.set()
            await asyncio.sleep(FRAME_S)

    async def _page(self, websocket: WebSocket) -> None:
        """Serve one page's websocket until either side ends it."""
        if len(self.desk.clients) >= MOST_CLIENTS:
            await websocket.close(1013)
            return
        await websocket.accept()
        client = Client(self.desk)
        self.desk.clients.add(client)
        try:
            async with asyncio.TaskGroup() as tasks:
                tasks.create_task(_send(client, websocket))
                tasks.create_task(_receive(client, websocket))
        except* (_OverError, WebSocketDisconnect, OSError):
            pass
        finally:
            self.desk.clients.discard(client)


class _OverError(Exception):
    """Raised when a page has gone, to end the other task of its connection."""


async def _send(client: Client, websocket: WebSocket) -> None:
    """Send the page its messages and frames whenever it is woken."""
    await websocket.send_text(json.dumps(client.hello(), allow_nan=False))
    while True:
        await client.wake.wait()
        client.wake.clear()
        # Each send waits until a slow page has taken it; what the page misses meanwhile is in its next frame.
        for text in client.news():
            await websocket.send_text(text)
        frame = client.frame()
        if frame is not None:
            await websocket.send_bytes(frame)


async def _receive(client: Client, websocket: WebSocket) -> None:
    """Take the page's messages until it disconnects."""
    while True:
        message = await websocket.receive()
        if message["type"] == "websocket.disconnect":
            raise _OverError
        answer = client.take(message.get("text"))
        if answer is not None:
            client.answers.append(answer)
            client.wake.set()


class _Server(uvicorn.Server):
    """A uvicorn server without its own signal handlers, which would raise the signal again after a clean end."""

    @contextlib.contextmanager
    def capture_signals(self) -> Iterator[None]:
        yield


def _listening(host: str, port: int) -> socket.socket:
    """A socket that listens at the address; raises `UsageError` if it cannot."""
    made = socket.socket(socket.AF_INET6 if ":" in host else socket.AF_INET, socket.SOCK_STREAM)
    try:
        made.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        made.bind((host, port))
        made.listen(128)
    except OSError as error:
        made.close()
        raise UsageError(
            f"{host}:{port} cannot be listened on ({error.strerror}): choose another --port, or none for a free one"
        ) from error
    made.setblocking(False)
    return made
