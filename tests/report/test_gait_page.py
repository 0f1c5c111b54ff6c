"""The trial's page: its verdict, what it shows, and what a browser makes of it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from browser import Browser
from looks import look, unfold

from simulators.people import Person, Walk, trial
from smartshoe.gait import Coverage, GaitResult, analyse
from smartshoe.report.gait.page import verdict, write_gait_page
from smartshoe.report.gait.terminal import by_foot, depends_on_coverage


@pytest.fixture(scope="module")
def walk() -> GaitResult:
    made = trial(Person(), Walk(1.3), 12.0, np.random.default_rng(1), sensors=False, noise_n=1.0, name="walk")
    return analyse([made.recording])


@pytest.fixture(scope="module")
def page(walk: GaitResult, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_gait_page(tmp_path_factory.mktemp("gait") / "gait.html", walk, "Gait: walk", {"files": "walk.csv"})


def test_the_verdict_says_what_was_done_and_what_to_be_careful_with(walk: GaitResult) -> None:
    grade, says = verdict(walk)
    assert says.startswith("Walking, ")
    assert grade == ("look" if walk.flags else "good")
    for flag in walk.flags:
        assert flag.kind.replace("_", " ") in says


def test_peaks_are_marked_where_nobody_gave_a_coverage(walk: GaitResult) -> None:
    assert depends_on_coverage(walk)
    assert any(name.startswith("peak force*") for name, _ in by_foot(walk))
    made = trial(Person(), Walk(1.3), 12.0, np.random.default_rng(1), sensors=False, noise_n=1.0, name="walk")
    covered = analyse([made.recording], coverage=Coverage(0.8))
    assert not depends_on_coverage(covered)
    assert all("*" not in name for name, _ in by_foot(covered))


def test_the_peak_is_told_with_its_interval(walk: GaitResult) -> None:
    cells = dict(by_foot(walk))["mean peak* ± 95 % (N)"]
    assert all("±" in cell for cell in cells)


@pytest.mark.browser
@pytest.mark.parametrize(("width", "dark"), [(1280, False), (400, True)])
def test_nothing_is_clipped_small_faint_or_fetched(browser: Browser, page: Path, width: int, dark: bool) -> None:
    browser.open(page, width, dark=dark)
    unfold(browser)
    assert browser.run("document.querySelectorAll('svg.soles polyline').length") == 2
    assert look(browser) == []


@pytest.mark.browser
def test_the_trial_opens_on_some_strides_and_zooms_out(browser: Browser, page: Path) -> None:
    browser.open(page)
    titled = "f => f.querySelector('h3').textContent === 'The trial'"
    whole = f"[...document.querySelectorAll('figure.chart')].find({titled})"
    browser.run(f"{whole}.scrollIntoView()")
    browser.settle()
    hidden = f"{whole}.querySelector('button.whole').hidden"
    browser.until(f"!{hidden}")
    browser.run(f"{whole}.querySelector('button.whole').click()")
    browser.until(hidden)
