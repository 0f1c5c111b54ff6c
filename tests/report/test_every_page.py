"""Every kind of page in a browser: wide and narrow, light and dark, pointed at, zoomed, printed."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from browser import Browser, dumped
from looks import look, look_of_paper, unfold
from pages_made import PAGES


@pytest.fixture(scope="module", params=PAGES)
def made(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return PAGES[request.param](tmp_path_factory.mktemp(request.param))


@pytest.mark.browser
@pytest.mark.parametrize(("width", "dark"), [(1280, False), (400, True)])
def test_nothing_is_clipped_small_faint_broken_or_fetched(browser: Browser, made: Path, width: int, dark: bool) -> None:
    assert made.stat().st_size < 1_000_000
    browser.open(made, width, dark=dark)
    assert look(browser) == []
    unfold(browser)
    assert browser.run("[...document.querySelectorAll('figure.chart')].every(f => f.querySelector('canvas'))")
    assert look(browser) == []


@pytest.mark.browser
@pytest.mark.parametrize(
    "made",
    [page if page in ("session", "drift") else pytest.param(page, marks=pytest.mark.long) for page in PAGES],
    indirect=True,
)
def test_a_browser_that_only_takes_a_picture_shows_the_charts(browser: Browser, made: Path) -> None:
    """It shows no frame, so that nothing ever comes into sight."""
    assert "<canvas" in dumped(made, 1200, 6000)


@pytest.mark.browser
def test_nothing_is_lost_on_paper(browser: Browser, made: Path) -> None:
    browser.open(made, dark=True)
    assert look_of_paper(browser) == []
    assert browser.paper().startswith(b"%PDF")
    assert browser.faults() == []


@pytest.mark.browser
def test_pointing_reads_a_value_and_dragging_zooms(browser: Browser, made: Path) -> None:
    browser.open(made)
    browser.run("window.first = document.querySelector('figure.chart'), first.scrollIntoView()")
    browser.settle()
    over = browser.run("first.querySelector('.u-over').getBoundingClientRect().toJSON()")
    middle = over["top"] + over["height"] / 2
    browser.mouse("mouseMoved", over["left"] + 0.4 * over["width"], middle)
    browser.settle()
    values = browser.run("[...first.querySelectorAll('.uplot:first-child .u-value')].map(e => e.textContent)")
    assert len(values) >= 2
    assert re.search(r"\d", values[0])
    assert any(re.fullmatch(r"−?[\d.]+", text) for text in values[1:])
    browser.run("first.querySelector('button.whole').click()")
    browser.settle()
    assert browser.run("first.querySelector('button.whole').hidden")
    browser.mouse("mousePressed", over["left"] + 0.3 * over["width"], middle, 1)
    browser.mouse("mouseMoved", over["left"] + 0.7 * over["width"], middle, 1)
    browser.mouse("mouseReleased", over["left"] + 0.7 * over["width"], middle)
    browser.settle()
    assert not browser.run("first.querySelector('button.whole').hidden")
