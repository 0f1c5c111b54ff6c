"""`Guard`: decides which requests the live server accepts, by host name, origin and token."""

from __future__ import annotations

import hmac
from collections.abc import Awaitable, Callable, MutableMapping
from typing import Any
from urllib.parse import parse_qs

Scope = MutableMapping[str, Any]
Message = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[Message]]
Send = Callable[[Message], Awaitable[None]]
App = Callable[[Scope, Receive, Send], Awaitable[None]]

LOOPBACK = ("127.0.0.1", "localhost", "[::1]")


class Guard:
    """ASGI middleware that refuses requests from another page, under another host name or without the token.

    ``port`` is the server's own. Without a ``token``, only the loopback's names are accepted as Host, so that no
    foreign page can point a name of its own at this server. An Origin must equal the address that the request was sent
    to; programs send none.
    """

    def __init__(self, app: App, port: int, token: str | None) -> None:
        self._app, self._token = app, token
        self._hosts = {f"{name}:{port}" for name in LOOPBACK} | (set(LOOPBACK) if port == 80 else set())

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass the request on, or answer it with a refusal (ASGI)."""
        if scope["type"] in ("http", "websocket"):
            refusal = self._refusal(scope)
            if refusal is not None:
                await _refuse(scope, receive, send, *refusal)
                return
        await self._app(scope, receive, send)

    def _refusal(self, scope: Scope) -> tuple[int, str] | None:
        """The status and reason for which a request is refused; None if it is accepted."""
        headers: dict[bytes, list[bytes]] = {}
        for name, value in scope["headers"]:
            headers.setdefault(name.lower(), []).append(value)
        hosts, origins = headers.get(b"host", []), headers.get(b"origin", [])
        if len(hosts) != 1 or len(origins) > 1:
            return 400, "a request has one Host and one Origin at most"
        host = hosts[0].decode("latin-1").lower()
        if self._token is None and host not in self._hosts:
            return 403, "this page is served under its own address only"
        if origins and origins[0].decode("latin-1").lower() != f"http://{host}":
            return 403, "another page may not ask this one"
        if self._token is not None and not self._has_token(scope, headers.get(b"authorization", [])):
            return 401, "the token is missing or wrong: open the page with ?token=..."
        return None

    def _has_token(self, scope: Scope, authorization: list[bytes]) -> bool:
        """Whether the query or the Authorization header contains the token."""
        assert self._token is not None
        given = [
            v.encode() for v in parse_qs(scope["query_string"].decode("latin-1"), errors="replace").get("token", [])
        ]
        given += [value[7:] for value in authorization if value[:7].lower() == b"bearer "]
        return any(hmac.compare_digest(value, self._token.encode()) for value in given)


async def _refuse(scope: Scope, receive: Receive, send: Send, status: int, says: str) -> None:
    """Answer a request with a refusal: close a websocket, or send a plain text."""
    if scope["type"] == "websocket":
        await receive()  # websocket.connect
        await send({"type": "websocket.close", "code": 1008, "reason": says})
        return
    body = f"{says}\n".encode()
    headers = [(b"content-type", b"text/plain; charset=utf-8"), (b"content-length", str(len(body)).encode())]
    await send({"type": "http.response.start", "status": status, "headers": headers})
    await send({"type": "http.response.body", "body": body})
