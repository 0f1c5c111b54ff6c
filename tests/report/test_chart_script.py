"""What the script of the charts draws and tabulates: ticks, dashes, gaps, digits, headings."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from browser import Browser

from smartshoe.report.charts import Chart, Line, Panel
from smartshoe.report.document import write_document

Drawn = Callable[[Chart], list[list[str]]]

pytestmark = pytest.mark.browser

# What is written on a canvas, and how far to the right.
WRITTEN = """
window.written = [];
const write = CanvasRenderingContext2D.prototype.fillText;
CanvasRenderingContext2D.prototype.fillText = function (text, x, y, ...more) {
  window.written.push([text, x]);
  return write.call(this, text, x, y, ...more);
};
"""
# How many pixels are half transparent in the columns a seventh, half and six sevenths of the way along.
SHADED = """
[0.151, 0.501, 0.851].map((share) => {
  const canvas = document.querySelector('canvas'), over = document.querySelector('.u-over');
  const x = Math.round(over.offsetLeft + share * over.offsetWidth);
  const { data } = canvas.getContext('2d').getImageData(x, 0, 1, canvas.height);
  return data.filter((value, k) => k % 4 === 3 && value > 20 && value < 200).length;
})
"""
TABLE = """
[...document.querySelectorAll('details.numbers tr')].map(row => [...row.cells].map(cell => cell.textContent))
"""


@pytest.fixture
def tabulated(browser: Browser, tmp_path: Path) -> Drawn:
    """A chart on a page of its own, its numbers unfolded: the rows of their table."""

    def draw(chart: Chart) -> list[list[str]]:
        drift = {"serial_number": "1", "says": "x", "trends": {}}
        shown = {"title": "t", "drift": drift, "grade": "good", "headline": "x", "charts_of": [chart], "happened": []}
        added = browser.call("Page.addScriptToEvaluateOnNewDocument", source=WRITTEN)
        browser.open(write_document(tmp_path / "page.html", "drift.html", shown))
        browser.call("Page.removeScriptToEvaluateOnNewDocument", **added)
        browser.run("document.querySelector('details.numbers').open = true")
        browser.settle()
        return [list(row) for row in browser.run(TABLE)]

    return draw


def _chart(x: np.ndarray, panels: list[Panel], **options: Any) -> Chart:
    return Chart("t", "s", "time (s)", x, panels, **options)


def _column(rows: list[list[str]], place: int = 0) -> list[str]:
    return [row[place] for row in rows[1:]]


def test_close_times_have_the_digits_that_part_them(tabulated: Drawn) -> None:
    x = 2251.0 + 0.01 * np.arange(30)
    times = _column(tabulated(_chart(x, [Panel("load (N)", [Line("load", x, "load")])])))
    assert times[:3] == ["2251.00", "2251.01", "2251.02"]
    assert len(set(times)) == 30


def test_whole_numbers_have_no_digits_behind_the_point_and_minus_is_minus(tabulated: Drawn) -> None:
    x = np.array([3.0, 6.0, 73.0])
    rows = tabulated(_chart(x, [Panel("load (N)", [Line("load", np.array([-9.965e-5, -2e-5, 0.0]), "load")])]))
    assert _column(rows) == ["3", "6", "73"]
    assert _column(rows, 1)[0].startswith("−9.96")
    assert "-" not in "".join(_column(rows, 1))


def test_of_many_points_the_table_says_how_many_of_them_it_lists(tabulated: Drawn, browser: Browser) -> None:
    for count, listed in ((66, "33 of the 66"), (12, "All 12")):
        x = np.arange(float(count))
        rows = tabulated(_chart(x, [Panel("y (V)", [Line("y", x, "load")])]))
        said = browser.run("document.querySelector('details.numbers .note').textContent")
        assert said == f"{listed} points that are shown."
        assert len(rows) - 1 == int(listed.removeprefix("All ").split()[0])


def test_headings_have_the_unit_once(tabulated: Drawn) -> None:
    x = np.arange(4.0)
    two = [Panel("load (N)", [Line("load", x, "load")]), Panel("before (V)", [Line("before", x, "raw")])]
    assert tabulated(_chart(x, two))[0] == ["time (s)", "load (N)", "before (V)"]
    one = [Panel("measured − simulated (V)", [Line("before", x, "raw"), Line("after", x, "corrected")])]
    assert tabulated(_chart(x, one))[0] == ["time (s)", "before (V)", "after (V)"]


def test_a_dashed_line_is_dashed_in_the_legend(tabulated: Drawn, browser: Browser) -> None:
    x = np.arange(4.0)
    tabulated(_chart(x, [Panel("y (V)", [Line("up", x, "raw"), Line("down", x, "raw", "dashed")])]))
    styles = browser.run("[...document.querySelectorAll('.u-marker')].map(e => getComputedStyle(e).borderTopStyle)")
    assert styles[-2:] == ["solid", "dashed"]


@pytest.mark.parametrize(("low", "high"), [(0.011, 0.019), (0.004, 0.13), (0.002, 5.0), (1e-3, 50.0), (0.5, 4e4)])
def test_ticks_of_a_logarithm_are_several_and_apart(
    tabulated: Drawn, browser: Browser, low: float, high: float
) -> None:
    x = np.geomspace(low, high, 60)
    tabulated(_chart(x, [Panel("y (V)", [Line("a", -1.0 - np.arange(60.0), "raw")])], log_x=True))  # y has a sign
    places = {text: at for text, at in browser.run("written") if text.replace(".", "").strip("0").isdigit()}
    assert len(places) >= 3
    assert np.diff(sorted(places.values())).min() > 40.0


@pytest.mark.parametrize("most", [0.02, 0.045, 0.099])
def test_a_low_panel_about_zero_has_more_than_the_zero_on_its_axis(
    tabulated: Drawn, browser: Browser, most: float
) -> None:
    x = 1000.0 + np.arange(60.0)
    line = Line("a", 0.9 * most * np.sin(x), "raw")
    tabulated(
        _chart(x, [Panel("y (V)", [line], (-most, most), height=130), Panel("z (V)", [line], (-most, most), 130)])
    )
    written = {text for text, _ in browser.run("written")}
    assert {text for text in written if text.startswith("−0.0")}


def test_a_band_is_not_drawn_where_there_is_nothing(tabulated: Drawn, browser: Browser) -> None:
    x = np.arange(60.0)
    values = np.where((x > 20) & (x < 40), np.nan, 0.0)
    line = Line("a", values, "raw", low=values - 1.0, high=values + 1.0)
    tabulated(_chart(x, [Panel("y (V)", [line], height=300)]))
    filled = browser.run(SHADED)
    assert filled[0] > 50
    assert filled[2] > 50
    assert filled[1] < 10
