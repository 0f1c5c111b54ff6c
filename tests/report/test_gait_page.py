"""The trial's page: its verdict, what it shows, and what a browser makes of it."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from browser import Browser
from pages_made import gait_page, walked

from simulators.people import Person, Walk, trial
from smartshoe.gait import Coverage, GaitResult, analyse
from smartshoe.recording import Recording
from smartshoe.report.gait._page import verdict, write_gait_page
from smartshoe.report.gait.charts import left_and_right
from smartshoe.report.gait.charts import trial as trial_chart
from smartshoe.report.gait.terminal import by_foot, coverage_note, depends_on_coverage


@pytest.fixture(scope="module")
def walk() -> GaitResult:
    return walked()


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return gait_page(tmp_path_factory.mktemp("gait"))


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
    covered = analyse([made.recording], coverage=Coverage.midfoot(0.8))
    assert not depends_on_coverage(covered)
    assert all("*" not in name for name, _ in by_foot(covered))


def test_the_peak_is_told_with_its_interval(walk: GaitResult) -> None:
    cells = dict(by_foot(walk))["mean peak* ± 95 % (N)"]
    assert all("±" in cell for cell in cells)


def test_a_share_alone_gives_the_mean_peak_no_interval_that_misses_it(tmp_path: Path) -> None:
    """The units bear all of push-off, so that a share of the impulse makes peaks a quarter too high."""
    made = trial(Person(), Walk(1.3), 12.0, np.random.default_rng(1), sensors=False, noise_n=1.0, name="walk")
    true_n = float(np.mean([stance.max() for stance in _stances(made.total_n["left"])]))
    alone = analyse([made.recording], coverage=Coverage(0.8))
    assert alone.summary["peak_n"]["left"]["mean"] > 1.2 * true_n
    assert not any("±" in name for name, _ in by_foot(alone))
    assert any(name.startswith("peak force*") for name, _ in by_foot(alone))
    assert "up to 25 % too high" in coverage_note(alone)
    assert "--coverage-course midfoot" in coverage_note(alone)
    page = write_gait_page(tmp_path / "gait.html", alone, "walk", {}).read_text(encoding="utf-8")
    assert "up to 25 % too high" in page
    by_course = analyse([made.recording], coverage=Coverage.midfoot(0.8))
    assert coverage_note(by_course) == ""
    assert verdict(alone)[1].endswith("only the peaks ask for care, by the note at the table")
    assert verdict(by_course)[1].endswith("nothing to be careful with was found")
    assert all("±" in cell for cell in dict(by_foot(by_course))["mean peak ± 95 % (N)"])


def _stances(force_n: np.ndarray) -> list[np.ndarray]:
    """The stretches of a foot's force in which it is down, without those cut off by the record's ends."""
    down = np.flatnonzero(np.diff((force_n > 20.0).astype(int)))
    return [part for part in np.split(force_n, down + 1)[1:-1] if part.max() > 20.0]


def test_each_insole_has_its_path(page: Path) -> None:
    assert page.read_text(encoding="utf-8").count('<polyline class="path"') == 2


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


def test_sentences_of_figures_have_units_and_say_where_a_weight_is_from(walk: GaitResult) -> None:
    beside = left_and_right(walk)
    assert beside is not None
    assert re.search(r"right less left is -?[\d.]+ N, [\d.]+ % of the peak", beside.says)
    assert re.match(r"Body weight \d+\.?\d* N, from strides\. ", trial_chart(walk).says)
    made = trial(Person(), Walk(1.3), 12.0, np.random.default_rng(1), sensors=False, noise_n=1.0, name="walk").recording
    readings = {
        f"{name}_mbar": 0.2 * made[name].values for name in made.channels if name.startswith(("left_", "right_"))
    }
    beside = left_and_right(analyse(Recording.from_arrays(time_s=made.time_s, **readings)))
    assert beside is not None
    assert "mbar, " in beside.says
