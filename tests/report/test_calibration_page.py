"""The calibration's page: its verdict in words, and what a browser makes of it."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import pytest
from balance import Balance
from browser import Browser
from pages_made import NAME, RATES, calibration_page, two_units

from smartshoe.report.calibration import DiagnosisLink, UnitReport, headline, judge, write_page
from smartshoe.report.calibration._judgement import against_static, looks_like_friction
from smartshoe.report.tables import worse_than_a_line


@pytest.fixture(scope="module")
def units() -> list[UnitReport]:
    return list(two_units())


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return calibration_page(tmp_path_factory.mktemp("report"))


def test_a_unit_without_friction_is_good_and_one_with_it_is_to_be_looked_at(units: list[UnitReport]) -> None:
    assert judge(units[0]).grade == "good"
    assert judge(units[1]).grade in ("look", "bad")
    assert looks_like_friction(units[1].validation.rates)
    assert not looks_like_friction(units[0].validation.rates)


def test_the_headline_counts_the_good_and_names_the_others(units: list[UnitReport]) -> None:
    grade, says = headline([judge(unit) for unit in units])
    assert says.startswith("1 of 2 units good; left_heel: ")
    assert grade == judge(units[1]).grade
    assert headline([judge(units[0])] * 3)[1] == "All 3 units good"


def test_a_filter_that_is_worse_than_a_static_line_says_so_once(units: list[UnitReport], tmp_path: Path) -> None:
    overall = replace(
        units[0].validation.overall, rmse_static_n=6.0, rmse_compensated_n=6.9, improvement_over_static_percent=-15.0
    )
    assert "worse than a static line" in against_static(overall)
    worse = replace(units[0], validation=replace(units[0].validation, overall=overall))
    assert judge(worse).grade == "bad"
    assert judge(worse).does == "use a static gain meanwhile, and diagnose it"
    text = write_page(tmp_path / "report.html", "t", "", {}, [worse]).read_text(encoding="utf-8")
    assert text.count("The filter is worse than a static line") == 1
    text = write_page(tmp_path / "report.html", "t", "", {}, [units[0]]).read_text(encoding="utf-8")
    assert text.count("% less.") == 1  # what a good filter gains stands beside its grade


def test_a_fit_that_did_not_converge_is_bad(units: list[UnitReport]) -> None:
    lost = replace(units[0], identification={**units[0].identification, "converged": False})
    assert judge(lost).grade == "bad"


def test_what_the_extended_model_leaves_stands_beside_what_the_filter_leaves(
    units: list[UnitReport], tmp_path: Path
) -> None:
    diagnosed = replace(units[1], diagnosis=DiagnosisLink("friction", "diagnosis/left_heel/diagnosis.html", 0.546))
    text = write_page(tmp_path / "report.html", "t", "", {}, [diagnosed]).read_text(encoding="utf-8")
    assert text.count("0.546 N") >= 2
    assert judge(diagnosed).does == "use its extended calibration, which leaves 0.546 N, and see its diagnosis"
    overall = units[1].validation.overall
    for left_n in (None, 1.001 * min(overall.rmse_static_n, overall.rmse_compensated_n)):
        no_better = replace(units[1], diagnosis=DiagnosisLink("friction", "diagnosis.html", left_n))
        assert judge(no_better).does == "see its diagnosis"


def test_the_page_is_well_formed_escaped_and_loads_nothing(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    parser = Balance()
    parser.feed(text)
    assert parser.open == []
    assert NAME not in text
    assert "&lt;script&gt;alert" in text
    assert "A &amp; B" in text
    assert not re.search(r'(?:src|href)="https?:', text)
    assert "default-src 'none'" in text
    assert page.stat().st_size < 1_000_000


def test_the_worst_unit_comes_first_and_the_good_one_is_folded(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    names = re.findall(r'<strong class="name">(.*?)</strong>', text)
    assert names[0] == "left_heel"
    assert re.findall(r'<details class="unit" id="unit-\d"( open)?>', text) == [" open", ""]


@pytest.mark.browser
def test_pointing_reads_a_value_dragging_zooms_and_cursors_are_linked(browser: Browser, page: Path) -> None:
    browser.open(page)
    browser.run("document.querySelectorAll('figure.chart')[1].scrollIntoView()")
    browser.settle()
    plot = "document.querySelectorAll('figure.chart')[1].querySelector('.u-over')"
    over = browser.run(f"{plot}.getBoundingClientRect().toJSON()")
    middle = over["top"] + over["height"] / 2
    browser.mouse("mouseMoved", over["left"] + over["width"] / 2, middle)
    browser.settle()
    values = "[...document.querySelectorAll('figure.chart')[{}].querySelectorAll('.u-value')].map(e => e.textContent)"
    assert all(re.fullmatch(r"−?[\d.]+", text) for text in browser.run(values.format(1)))
    assert browser.run(values.format(1))[0] == browser.run(values.format(2))[0]  # the other loop's cursor
    hidden = "document.querySelectorAll('figure.chart')[2].querySelector('button.whole').hidden"
    assert browser.run(hidden)
    browser.mouse("mousePressed", over["left"] + 40, middle, 1)
    browser.mouse("mouseMoved", over["left"] + 140, middle, 1)
    browser.mouse("mouseReleased", over["left"] + 140, middle)
    browser.settle()
    assert not browser.run(hidden)  # the zoom is linked too
    browser.run("document.querySelectorAll('figure.chart')[2].querySelector('button.whole').click()")
    browser.settle()
    assert browser.run(hidden)


@pytest.mark.browser
def test_the_keyboard_reads_and_zooms_and_the_numbers_stand_in_a_table(browser: Browser, page: Path) -> None:
    browser.open(page)
    browser.run("document.querySelector('figure.chart .plot').focus()")
    browser.key("ArrowRight")
    browser.settle()
    assert " 100:" in browser.run("document.querySelector('figure.chart .live').textContent")
    browser.run("document.querySelector('figure.chart details.numbers').open = true")
    rows = "document.querySelector('figure.chart tbody')?.rows.length"
    browser.until(f"{rows} === {len(RATES)}")
    browser.key("+")
    browser.until(f"{rows} < {len(RATES)}")
    browser.key("0")
    browser.until(f"{rows} === {len(RATES)}")


@pytest.mark.browser
def test_on_paper_the_verdict_stands_on_the_first_sheet_in_light(browser: Browser, page: Path) -> None:
    browser.open(page, dark=True)
    pdf = browser.paper()
    assert 1 <= len(re.findall(rb"/Type\s*/Page\b", pdf)) <= 6
    assert browser.faults() == []


@pytest.mark.parametrize(
    ("is_diagnosed", "said"),
    [(False, "If so, diagnose the unit."), (True, "If so, zero the load cell and the sensor before each recording.")],
)
def test_of_a_calibration_that_a_diagnosis_made_no_diagnosis_is_asked_for(is_diagnosed: bool, said: str) -> None:
    told = worse_than_a_line({"rmse_static_n": 1.0, "rmse_compensated_n": 2.0}, is_diagnosed=is_diagnosed)
    assert told is not None
    assert told.endswith(said)
    assert worse_than_a_line({"rmse_static_n": 2.0, "rmse_compensated_n": 1.0}, is_diagnosed=is_diagnosed) is None
