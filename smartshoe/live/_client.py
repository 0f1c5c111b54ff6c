"""`Client`: the server's side of one open page; what was sent to it, what is to be sent, and its requests."""

from __future__ import annotations

import asyncio
import json
from collections import deque
from typing import Any

from smartshoe.errors import SmartShoeError
from smartshoe.live._desk import Desk
from smartshoe.live._frames import PageView, head_bytes, shoe_bytes, view_of

MOST_ANSWERS = 16
ALL = -(1 << 62)


class Client:
    """One page of ``desk``. A slow page misses no sample: a frame holds all columns since the last frame it took."""

    def __init__(self, desk: Desk) -> None:
        self._desk, self._session = desk, desk.session
        self.view = PageView()
        self.wake = asyncio.Event()
        self.answers: deque[dict[str, Any]] = deque(maxlen=MOST_ANSWERS)
        self.is_paused = False
        self._number = 0
        self._tasked = -1
        self._places = [ALL] * len(self._session.shoes)
        self._zeros = [live.zero for live in self._session.shoes]
        self._noted, self._stepped, self._state = self._session.noted, self._session.stepped, ""

    def hello(self) -> dict[str, Any]:
        """The first message to the page, as an object for JSON."""
        self._noted, self._stepped = self._session.noted, self._session.stepped
        return self._desk.hello(self.view)

    def news(self) -> list[str]:
        """All messages other than frames that were not sent yet, as JSON texts."""
        messages: list[str] = []
        while self.answers:
            messages.append(json.dumps(self.answers.popleft(), allow_nan=False))
        notes, steps = self._session.news(self._noted, self._stepped)
        if notes or steps:
            self._noted, self._stepped = self._session.noted, self._session.stepped
            messages.append(json.dumps({"type": "news", "notes": notes, "steps": steps}, allow_nan=False))
        task = self._session.task
        if task is not None and task.version != self._tasked:
            self._tasked = task.version
            messages.append(json.dumps(task.to_dict(), allow_nan=False))
        state = self._desk.state()
        if state is not self._state:
            self._state = state
            messages.append(state)
        return messages

    def frame(self) -> bytes | None:
        """The next binary frame; None while the page is paused."""
        if self.is_paused:
            return None
        session = self._session
        parts = [head_bytes(len(session.shoes), self._number, session.now_s(), self.view.width_s)]
        self._number += 1
        for k, reduction in enumerate(self._desk.reductions(self.view)):
            live = session.shoes[k]
            columns = reduction.columns()
            if self._zeros[k] is not live.zero:
                self._zeros[k], self._places[k] = live.zero, ALL
            new = columns.since(self._places[k])
            if len(columns):
                self._places[k] = int(columns.place[-1])  # the last column may still grow: it is sent again
            parts.append(shoe_bytes(new, *live.now()))
        return b"".join(parts)

    def take(self, text: str | None) -> dict[str, Any] | None:
        """Carry out a message from the page; returns the reply to it, or None."""
        try:
            asked = json.loads(text or "")
        except (ValueError, RecursionError):
            asked = None
        if not isinstance(asked, dict):
            return {"type": "refused", "says": "a message is one JSON object"}
        try:
            return self._do(asked)
        except SmartShoeError as error:
            return {"type": "refused", "says": str(error)}

    def _do(self, asked: dict[str, Any]) -> dict[str, Any] | None:
        """Carry out a request, checked to be an object; returns the reply to it, or None."""
        match asked.get("do"):
            case "view":
                self.view = view_of(asked.get("seconds"), asked.get("columns"))
                self._places = [ALL] * len(self._places)
                return {"type": "view", "seconds": self.view.seconds, "columns": self.view.columns}
            case "pause":
                self.is_paused = asked.get("on") is True
            case "mark":
                word, age_s = asked.get("word"), asked.get("age_s")
                age_s = float(age_s) if isinstance(age_s, (int, float)) and age_s == age_s else 0.0
                self._session.mark(word if isinstance(word, str) else "", age_s)
            case "answer":
                task = self._session.task
                if task is None or not task.take(asked.get("question"), asked.get("answer")):
                    return {"type": "refused", "says": "nobody waits for that answer any more"}
            case "zero":
                self._session.set_zero()
            case "record":
                if asked.get("on") is False:
                    self._session.stop_recording()
                else:
                    self._session.start_recording()
            case _:
                return {"type": "refused", "says": "do is view, pause, mark, zero, record or answer"}
        return None
