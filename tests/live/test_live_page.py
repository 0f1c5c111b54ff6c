"""The page in a headless browser: drawn, whole after a reload, its keys, both sizes; nothing complained of."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from live_browser import PROGRAM, Browser
from serving import serving, until, walk_table

from smartshoe.calibration import Calibration
from smartshoe.live.server import LiveServer
from smartshoe.live.session import LiveSession
from smartshoe.units import MILLIBAR

pytestmark = pytest.mark.skipif(PROGRAM is None, reason="no Chromium on this machine")

INK = """(canvas => { const g = canvas.getContext('2d'), d = g.getImageData(0, 0, canvas.width, canvas.height).data;
  let n = 0; for (let k = 3; k < d.length; k += 4) n += d[k] > 0; return n; })"""


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with Browser() as found:
        yield found


@pytest.fixture(scope="module")
def session(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[LiveServer, LiveSession]]:
    walk = walk_table(tmp_path_factory.mktemp("walk") / "walk.csv", 600.0)
    force = [Calibration(0.3, 5.0, 2.5, MILLIBAR, unit=f"right_{name}") for name in ("toe", "meta1", "meta4", "heel")]
    with serving(f"replay:{walk}", calibrations=force) as found:
        found[0].desk.start()
        yield found
        found[0].desk.close()


def test_the_page_draws_marks_pauses_and_is_whole_after_a_reload(
    browser: Browser, session: tuple[LiveServer, LiveSession], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    server, live = session
    browser.open(server.url)
    browser.until("typeof live !== 'undefined' && live.drawn > 20 && live.state")
    assert browser.run("[...document.querySelectorAll('figcaption b')].map(b => b.textContent.split(':')[0])") == [
        "left",
        "right",
    ]
    assert browser.run("[...document.querySelectorAll('.strip b')].map(b => b.textContent)") == [
        "left foot, mbar",
        "right foot, N",
    ]
    for canvas in range(4):
        assert browser.run(f"{INK}(document.querySelectorAll('canvas')[{canvas}])") > 1000
    browser.key("m")
    browser.until("!document.getElementById('marking').hidden")
    for key in ("r", "1", "Enter"):  # typed into the word, no command
        browser.key(key)
    until(lambda: any(note["kind"] == "mark" and note["says"] == "r1" for note in live.notes))
    assert live.recording is None
    browser.key("1")
    browser.until("live.seconds === 5 && live.drawn > 0")
    browser.key(" ")
    browser.until("live.paused")
    browser.key(" ")
    browser.until("!live.paused")
    browser.key("r")
    browser.until("live.state.recording")
    assert live.recording is not None
    browser.key("r")
    browser.until("!live.state.recording")
    browser.key("z")
    browser.until("document.getElementById('banner').textContent.includes('not zeroed')")
    browser.run("window.isOld = true, setTimeout(() => location.reload(), 50), 0")
    browser.until("!window.isOld && typeof live !== 'undefined' && live.drawn >= 0")
    browser.until("document.getElementById('notes').textContent.includes('r1')")
    browser.until("live.columns[0].place.filter(Number.isFinite).length > 20")
    assert browser.errors == []


def test_it_fits_a_telephone(browser: Browser, session: tuple[LiveServer, LiveSession]) -> None:
    browser.size(400, 800, mobile=True)
    browser.open(session[0].url)
    browser.until("typeof live !== 'undefined' && live.drawn > 0")
    assert browser.run("document.documentElement.scrollWidth") <= 400
    assert browser.run(
        "[...document.querySelectorAll('button')].filter(b => b.offsetParent).every(b => b.offsetHeight >= 40)"
    )
    browser.size(1280, 900)


def test_the_page_says_that_the_server_is_gone_and_goes_on_after_a_restart(browser: Browser, tmp_path: Path) -> None:
    walk = walk_table(tmp_path / "walk.csv", 60.0, ("left",))
    with serving(f"replay:{walk}") as (server, _):
        port = server.port
        browser.open(server.url)
        browser.until("typeof live !== 'undefined' && live.drawn > 5")
    browser.until("document.getElementById('banner').textContent.includes('does not answer')")
    with serving(f"replay:{walk}", port=port):
        browser.until("document.getElementById('banner').textContent.includes('started anew') && live.drawn > 5")
