"""A headless Chromium by its own protocol: opens a page, runs a line of script in it, takes its picture."""

from __future__ import annotations

import base64
import json
import os
import shutil
import signal
import subprocess
import tempfile
import time
from contextlib import ExitStack
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from websockets.sync.client import ClientConnection, connect

PROGRAM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")


class PageGoneError(Exception):
    """The page that a call was about has been left."""


class Browser:
    """One tab of ``width`` by ``height``; ``errors`` are what its scripts and its console complained of."""

    def __init__(self, width: int = 1280, height: int = 900, mobile: bool = False) -> None:
        assert PROGRAM is not None
        self._folder = Path(tempfile.mkdtemp())
        self._process = subprocess.Popen(
            [PROGRAM, "--headless=new", "--no-sandbox", "--disable-gpu", "--remote-debugging-port=0", "--mute-audio",
             "--disable-dev-shm-usage", f"--user-data-dir={self._folder}", "about:blank"],
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True,
        )  # fmt: skip
        self._number = 0
        self.errors: list[str] = []
        self._sockets = ExitStack()
        try:
            self._socket = self._connected()
        except BaseException:
            self._kill()
            raise
        for name in ("Page", "Runtime", "Log"):
            self.call(f"{name}.enable")
        self.size(width, height, mobile)

    def _connected(self) -> ClientConnection:
        port = self._folder / "DevToolsActivePort"
        for _ in range(3600):  # a busy machine takes its time; a browser that is dead is seen by the test's end
            if port.exists() and len(lines := port.read_text().splitlines()) == 2:
                break
            time.sleep(0.05)
        browser = self._sockets.enter_context(connect(f"ws://127.0.0.1:{lines[0]}{lines[1]}", max_size=None))
        self._browser = browser
        browser.send(json.dumps({"id": 1, "method": "Target.getTargets"}))
        while (answer := json.loads(browser.recv(timeout=30))).get("id") != 1:
            pass
        target = next(t["targetId"] for t in answer["result"]["targetInfos"] if t["type"] == "page")
        return self._sockets.enter_context(connect(f"ws://127.0.0.1:{lines[0]}/devtools/page/{target}", max_size=None))

    def call(self, method: str, **parameters: Any) -> Any:
        """A call of the protocol and its result."""
        self._number += 1
        self._socket.send(json.dumps({"id": self._number, "method": method, "params": parameters}))
        while True:
            answer = json.loads(self._socket.recv(timeout=60))
            if answer.get("method") == "Runtime.exceptionThrown":
                self.errors.append(json.dumps(answer["params"]["exceptionDetails"])[:600])
            elif answer.get("method") == "Log.entryAdded" and answer["params"]["entry"]["level"] == "error":
                self.errors.append(answer["params"]["entry"]["text"])
            if answer.get("id") == self._number:
                if "navigated" in str(answer.get("error", "")) or "context" in str(answer.get("error", "")):
                    raise PageGoneError(answer["error"]["message"])
                assert "error" not in answer, answer
                return answer["result"]

    def size(self, width: int, height: int, mobile: bool = False) -> None:
        """Make the window another size."""
        self.call("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=mobile)

    def open(self, url: str) -> None:
        """Go to ``url``; what the page before complained of (its server may be gone) is forgotten."""
        self.call("Page.navigate", url="about:blank")
        self.until("location.href === 'about:blank'")
        self.errors.clear()
        self.call("Page.navigate", url=url)

    def run(self, script: str) -> Any:
        """The value of an expression in the page (awaited where it is a promise)."""
        found = self.call("Runtime.evaluate", expression=script, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in found, found
        return found["result"].get("value")

    def until(self, script: str, seconds: float = 30.0) -> None:
        """Wait until an expression in the page is true."""
        end_s = time.monotonic() + seconds
        while not self._holds(script):
            assert time.monotonic() < end_s, f"{script} did not come to be"
            time.sleep(0.05)

    def _holds(self, script: str) -> bool:
        try:
            return bool(self.run(f"Boolean({script})"))
        except PageGoneError:  # it is being loaded anew
            return False

    def key(self, key: str) -> None:
        """Press and release a key."""
        for kind in ("keyDown", "keyUp"):
            text = (
                {"text": "\r" if key == "Enter" else key}
                if kind == "keyDown" and (len(key) == 1 or key == "Enter")
                else {}
            )
            self.call("Input.dispatchKeyEvent", type=kind, key=key, **text)

    def picture(self, path: Path | str) -> None:
        """The page as a PNG file."""
        found = self.call("Page.captureScreenshot", format="png", captureBeyondViewport=True)
        Path(path).write_bytes(base64.b64decode(found["data"]))

    def close(self) -> None:
        """End the browser."""
        self._browser.send(json.dumps({"id": 2, "method": "Browser.close"}))
        try:
            self._process.wait(10.0)
        except subprocess.TimeoutExpired:
            self._kill()
        self._sockets.close()
        shutil.rmtree(self._folder, ignore_errors=True)

    def _kill(self) -> None:
        os.killpg(self._process.pid, signal.SIGKILL)
        self._process.wait()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self.close()
