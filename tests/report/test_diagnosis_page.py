"""The page of a diagnosis: its facts in a person's words, for every verdict, whatever the names are."""

from __future__ import annotations

import itertools
import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from balance import Balance
from browser import Browser
from diagnoses_made import BASELINE, CASES, FULL_READING, LEAK, LEAK_CAUSE, NAME, RUN_NEXT, case, page, plain_text
from looks import look, unfold

from smartshoe.diagnosis import Rival, Thresholds, Trace
from smartshoe.diagnosis._result import OF_A_DOUBTED_CAUSE, OF_A_KIND, Statement
from smartshoe.models.effects import effect
from smartshoe.models.parameter import Parameter
from smartshoe.report.diagnosis._page import write_diagnosis_page
from smartshoe.report.diagnosis._sentences import (
    HEADINGS,
    is_free_form,
    why_no_name,
)
from smartshoe.report.diagnosis.terminal import print_diagnosis


@pytest.mark.parametrize("name", CASES)
def test_every_page_is_whole_and_says_no_number_that_is_none(name: str) -> None:
    html = page(name)
    parser = Balance()
    parser.feed(html)
    assert parser.open == []
    assert len(html.encode()) < 1_000_000
    assert not re.search(r'(?:src|href)="https?:', html)
    assert "<svg" not in html  # figures are numbers, not pictures
    text = plain_text(html)
    assert not re.search(r"\b(nan|inf|None|True|False)\b", text)
    assert HEADINGS[case(name).verdict] in text
    assert case(name).says[1:] in text


@pytest.mark.parametrize("name", CASES)
def test_sections_come_in_the_order_in_which_a_person_asks(name: str) -> None:
    asked = ["verdict", "beside", "why", "gained", "next", "left", "faults", "limits"]
    found = re.findall(r'<section id="(\w+)">', page(name))
    assert found == [section for section in asked if section in found]
    assert {"verdict", "faults", "limits", "next"} <= set(found)
    assert ("beside" in found) is (name != "refused")


@pytest.mark.parametrize("name", CASES)
def test_the_size_comes_before_the_judgement(name: str) -> None:
    text = plain_text(page(name))
    if name != "refused":
        assert text.index("the simulated reading is off by") < text.index(HEADINGS[case(name).verdict])
    assert 'data-chart="0"' not in page("refused")


def _is_folded(html: str, said: str) -> bool:
    before = html[: html.index(said)]
    return before.count("<details") > before.count("</details>")


def test_likelihood_and_thresholds_are_folded_and_the_thresholds_whole() -> None:
    html = page("two causes")
    assert html.count("are differences of −2 log likelihood") == 1
    for said in ("are differences of −2 log likelihood", "load cells: 0.02 % of rating"):
        assert _is_folded(html, said), said
    assert html.count("<summary>Every number that decides") == 1


def test_limits_are_not_folded_and_recordings_that_were_left_out_are(tmp_path: Path) -> None:
    made = replace(
        case("one cause"), limits=("left out: r1.csv: it stands", "one rate only"), left_out=("r1.csv: it stands",)
    )
    html = write_diagnosis_page(tmp_path / "x.html", made, "t", {}).read_text(encoding="utf-8")
    assert "What this data cannot say (1)" in html
    assert not _is_folded(html, "One rate only.")
    assert not _is_folded(html, "A wrong calibration of the sensor itself")
    assert _is_folded(html, "r1.csv: it stands.")
    assert "Recordings that were left out" not in page("one cause")


@pytest.mark.parametrize(
    ("name", "nothing", "no_more"),
    [
        (
            "adequate",
            "Nothing: the calibration of the baseline can be used as it is.",
            "No further experiment is needed:",
        ),
        ("one cause", "Nothing more is needed to tell the causes apart:", "No further experiment is needed to tell"),
        ("unexplained", "No experiment stands out.", "No experiment stands out."),
        ("two causes", RUN_NEXT[1:], RUN_NEXT[1:]),
    ],
)
def test_what_to_do_next_says_where_the_calibration_s_force_may_be_off(
    name: str, nothing: str, no_more: str, tmp_path: Path
) -> None:
    """A calibration is not said to need nothing more where a limit says by how many newtons it is off."""
    off = "a calibration has one zero for all recordings: so the force of u02h is off by 8.4 N (rms)"
    of_data = "one loading rate only: nothing can be said of rate dependence"

    def told(*limits: str) -> str:
        made = replace(case(name), limits=limits, limits_of_the_force=limits[1:])
        text = plain_text(write_diagnosis_page(tmp_path / "x.html", made, "t", {}).read_text(encoding="utf-8"))
        return text[text.index("What to do next") : text.index("Where the error sits")]

    assert nothing in told(of_data)
    assert "force may be off" not in told(of_data)
    said = told(of_data, off)
    assert no_more in said
    assert nothing == no_more or nothing not in said
    assert f"Before you use the calibration, know where its force may be off: {off[0].upper()}{off[1:]}." in said
    assert of_data[1:] not in said


def test_a_likelier_effect_is_not_told_as_ruled_out_and_an_equation_that_is_not_in_the_model_is_said_to_be(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    lag = effect("sensor_lag")
    own = {one.name: Parameter.from_sd(0.3, 0.01, one.unit) for one in lag.parameters}
    near = (Rival("clock_drift", -155.0), Rival("dead_band", 45.0))
    cause = replace(LEAK_CAUSE, effect=lag, parameters=own, part="flexible_lag", rivals=near)
    made = replace(case("one cause"), causes=(cause,))
    html = write_diagnosis_page(tmp_path / "x.html", made, "t", {}).read_text(encoding="utf-8")
    text = plain_text(html)
    likelier, out = text.index("alone in its place as likely or likelier"), text.index("came near, and is less likely")
    assert likelier < text.index("clock drift is likelier by 155") < out < text.index("dead band is less likely by 45")
    beside = "hese parameters are of the equation of sensor lag, which is not in the extended model"
    assert not _is_folded(html, beside)
    assert "ruled out less" not in plain_text(page("one cause"))
    assert "alone in its place" not in plain_text(page("one cause"))
    assert beside not in plain_text(page("one cause"))
    print_diagnosis(made)
    said = capsys.readouterr().out
    assert f"  t{beside}" in said
    assert "clock drift alone in its place is likelier by 155" in said


def test_figures_for_papers_are_written_when_asked_for(tmp_path: Path) -> None:
    from smartshoe.report.paper.diagnosis import write_figures

    written = {path.name for path in write_figures(tmp_path, case("two causes"), ["svg"])}
    assert {"diagnosis_worst_cycle.svg", "diagnosis_screening.svg", "diagnosis_error_by_state.svg"} <= written
    assert all((tmp_path / name).read_text(encoding="utf-8").endswith("</svg>\n") for name in written)
    assert write_figures(tmp_path, case("refused"), ["svg"]) == []


@pytest.fixture(scope="module")
def page_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("diagnosis") / "diagnosis.html"
    path.write_text(page("two causes"), encoding="utf-8")
    return path


@pytest.mark.browser
@pytest.mark.parametrize(("width", "dark"), [(1280, False), (400, True)])
def test_nothing_of_the_page_is_clipped_small_faint_or_fetched(
    browser: Browser, page_file: Path, width: int, dark: bool
) -> None:
    browser.open(page_file, width, dark=dark)
    assert look(browser) == []
    unfold(browser)
    assert browser.run("[...document.querySelectorAll('figure.chart')].every(f => f.querySelector('canvas'))")
    assert look(browser) == []
    assert browser.paper().startswith(b"%PDF")


@pytest.mark.browser
def test_on_a_phone_all_that_is_told_of_a_rival_is_in_sight_and_a_table_that_scrolls_shows_its_edge(
    browser: Browser, page_file: Path
) -> None:
    browser.open(page_file, 390)
    unfold(browser)
    cells = browser.run(
        "[...document.querySelectorAll('.fold td')].map(e => [e.dataset.of, e.getBoundingClientRect().right])"
    )
    assert {of for of, _ in cells} == {"in the place of this one", "what it would be", "what tells the two apart"}
    assert max(right for _, right in cells) <= 390
    assert browser.run("[...document.querySelectorAll('.fold')].every(e => e.offsetWidth <= e.parentNode.clientWidth)")
    edges = "[...document.querySelectorAll('.scroll')].map(e => getComputedStyle(e).backgroundAttachment)"
    assert set(browser.run(edges)) == {"local, local, scroll, scroll"}


@pytest.mark.parametrize("name", CASES)
def test_no_heading_stands_twice_running(name: str) -> None:
    headings = [plain_text(one) for one in re.findall(r"<h[1-3][ >].*?</h[1-3]>", page(name), re.DOTALL)]
    assert len(headings) > 3
    assert not [one for one, following in itertools.pairwise(headings) if one == following]


@pytest.mark.browser
def test_pointing_at_the_error_reads_it_and_dragging_zooms(browser: Browser, page_file: Path) -> None:
    browser.open(page_file)
    over = browser.run("document.querySelectorAll('.u-over')[1].getBoundingClientRect().toJSON()")
    middle = over["top"] + over["height"] / 2
    browser.mouse("mouseMoved", over["left"] + over["width"] / 2, middle)
    browser.settle()
    values = browser.run("[...document.querySelectorAll('figure.chart .u-value')].slice(0, 4).map(e => e.textContent)")
    assert all(re.fullmatch(r"−?[\d.]+", text) for text in values)
    browser.mouse("mousePressed", over["left"] + 40, middle, 1)
    browser.mouse("mouseMoved", over["left"] + 140, middle, 1)
    browser.mouse("mouseReleased", over["left"] + 140, middle)
    browser.settle()
    assert not browser.run("document.querySelector('figure.chart button.whole').hidden")


def test_a_cause_is_told_with_interval_gain_evidence_and_what_else_it_could_be() -> None:
    text = plain_text(page("two causes"))
    assert "1. Linear leak: over 99 % sure" in text
    assert (
        "2. Play hysteresis: 95 % sure that it is this or bouc wen hysteresis; if so, 62 % that it is this one" in text
    )
    assert LEAK[0].says[1:] in text
    assert "0.002000 [0.001941, 0.002059] 1/s" in text
    assert "9.60 [8.82, 10.38] N" in text
    assert "0.800 mbar without it and 0.310 mbar with it: it falls by 61 % [55, 66]" in text
    assert "Without it the fit is worse by 321 where 30 would do." in text
    assert (
        "Bouc wen hysteresis cannot be ruled out, since no equation is exact: take the name as one of 2. Family:"
        in text
    )
    assert effect("bouc_wen_hysteresis").says in text
    assert (
        "No other effect of the catalogue does as well; the nearest, zero drift, is less likely by 88. Family:" in text
    )
    assert "In the extended model without being causes, too small, too unsure or without a law: sensor lag." in text
    for heading in ("cannot be ruled out", "came near, and is less likely"):
        assert f"{heading} in the place of this one what it would be what tells the two apart" in text
    assert "bouc wen hysteresis fits worse by 1.7 " in text
    assert "dead band is less likely by 45 " in text
    assert "zero drift is less likely by 88 " in text
    assert "of full scale: error of the extended model" in text
    assert "free form" not in text


def test_what_was_added_is_told_with_what_has_no_name(tmp_path: Path) -> None:
    one = case("one cause")
    for minor, added, lowers in (
        ((), "Added: linear leak.", "It lowers the error"),
        (("flexible_lag",), "Added: linear leak; without a name: lag of free form.", "Together they lower the error"),
    ):
        made = replace(one, minor=minor)
        text = plain_text(write_diagnosis_page(tmp_path / "x.html", made, "t", {}).read_text(encoding="utf-8"))
        assert f"{added} {lowers} on data that was not fitted by 77.7 %" in text
    assert "Added: linear leak, play hysteresis; without a name: sensor lag." in plain_text(page("two causes"))


def test_a_free_form_is_told_as_such_with_its_own_parameters(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The numbers of a block are no equation's; those of a law in the place of a block are."""
    block = effect("flexible_lag")
    numbers = {one.name: Parameter.from_sd(0.3, 0.01, one.unit) for one in block.parameters}
    lag = effect("sensor_lag")
    free = replace(LEAK_CAUSE, effect=lag, parameters=numbers, part=block.name)
    own = {one.name: Parameter.from_sd(0.3, 0.01, one.unit) for one in lag.parameters}
    assert is_free_form(free)
    for part, values in ((block.name, own), (lag.name, own), (None, own), (block.name, {})):
        assert not is_free_form(replace(free, part=part, parameters=values))
    made = replace(case("one cause"), causes=(free,))
    text = plain_text(write_diagnosis_page(tmp_path / "x.html", made, "t", {}).read_text(encoding="utf-8"))
    assert "parameter of a free form, since no equation fits well enough value [95 % interval] what it is" in text
    for one in block.parameters:
        assert one.says in text
    monkeypatch.setenv("COLUMNS", "240")
    print_diagnosis(made)
    said = capsys.readouterr().out
    assert re.search(r"sensor lag\W+free form\W+no equation fits well enough", said)
    assert "direction" not in said


@pytest.mark.parametrize("statistic", [OF_A_KIND, OF_A_DOUBTED_CAUSE])
def test_why_a_cause_is_not_sure_is_said_where_it_is_named(
    statistic: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Once, and not among what is folded."""
    why = "its law is not sure"
    doubted = replace(LEAK_CAUSE, evidence=(*LEAK_CAUSE.evidence, Statement(statistic, 0.9, 0.75, why)))
    assert (LEAK_CAUSE.doubt, doubted.doubt) == ("", why)
    made = replace(case("one cause"), causes=(doubted,))
    text = plain_text(write_diagnosis_page(tmp_path / "x.html", made, "t", {}).read_text(encoding="utf-8"))
    assert text.count("Its law is not sure.") == 1
    assert text.index("Its law is not sure") < text.index("What speaks for it")
    monkeypatch.setenv("COLUMNS", "240")
    print_diagnosis(made)
    assert f"; {why}" in capsys.readouterr().out


def test_a_reading_that_falls_with_the_load_is_said_to_before_its_causes(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    made = case("one cause")
    for full_scale, count in ((70.0, 0), (-70.0, 1)):
        model = replace(BASELINE, full_scale_reading=full_scale)
        page_of = write_diagnosis_page(tmp_path / "x.html", replace(made, model=model), "t", {})
        print_diagnosis(replace(made, model=model))
        for text in (plain_text(page_of.read_text(encoding="utf-8")), capsys.readouterr().out):
            assert text.count("The reading falls as the load rises") == count


def test_a_page_without_a_test_of_the_noise_draws_no_share_of_it(tmp_path: Path) -> None:
    made = case("one cause")
    assert made.extended is not None
    untold = replace(made, extended=replace(made.extended, structure_rms=math.nan))
    for one, count in ((made, 1), (untold, 0)):
        html = write_diagnosis_page(tmp_path / "x.html", one, "t", {}).read_text(encoding="utf-8")
        assert html.count('<div class="parts"') == count
        assert ("of what could be explained is explained" in html) == bool(count)
    assert "how much of the rest is noise cannot be told" in html


def test_the_comparison_and_the_shares_are_those_of_the_diagnosis() -> None:
    made = case("two causes")
    text = plain_text(page("two causes"))
    assert made.baseline is not None
    assert made.extended is not None
    assert f"{made.baseline.rmse:.2f} mbar ({100 * made.baseline.rmse / FULL_READING:.1f} %)" in text
    assert f"{made.baseline.fit_percent:.2f} % {made.extended.fit_percent:.2f} %" in text
    assert "error of the compensated force, rms" in text
    assert "fit, 100 % for no error" in text
    assert "structure beyond noise, over all recordings, fitted or not, rms (of full scale)" in text
    assert "explained: 90.5 %" in text
    assert "left: 1.5 %" in text
    assert "noise: 8.0 %" in text
    assert "8 % of the error's variance is noise; of the rest 98 % is explained." in text


def test_faults_left_over_and_the_next_experiment_are_told() -> None:
    text = plain_text(page("two causes"))
    assert "Held samples, triangles_1, 5.0–5.6 s (2.0 % of the samples): a value repeats while the load moves." in text
    assert "Spikes, triangles_2, 40.00 s (under 0.01 % of the samples): one sample stands alone. (Minor.)" in text
    assert f"What to do next {RUN_NEXT[0].upper()}{RUN_NEXT[1:]}. The protocol is in x.toml : paste it into" in text
    left = "70 % of the power that is left lies at 50-75 % of full load while unloading"
    assert f"What is left: {left}." in plain_text(page("partly_explained"))
    of_baseline = f"What the baseline leaves: {left}; the extended model leaves nothing beyond noise."
    assert of_baseline in plain_text(page("unexplained"))
    assert "no reference load: name it with --force" in plain_text(page("refused"))


def test_nothing_is_named_where_nothing_was_found() -> None:
    for name in ("adequate", "unexplained"):
        text = plain_text(page(name))
        assert " sure" not in text[: text.index("Every number that decides")]  # of which some say when a name is sure
        assert "Nothing was added." in text
        assert "No cause is named" in text
        assert "Nearest candidates, by what each alone takes off −2 log likelihood: zero drift (88.0)." in text
    why = "No cause may be named; the limits at the end of this page say why where the data is the reason."
    assert why in plain_text(page("unexplained"))
    matters = "no more than small imperfections of a good unit, or faults of the data, add up to"
    assert matters in plain_text(page("adequate"))


def test_a_page_says_that_no_name_is_needed_since_much_may_be_borne() -> None:
    made = replace(case("adequate"), thresholds=Thresholds(material=0.02))
    assert why_no_name(made) == (
        "What the simulation leaves is no more than was asked to be borne, 2 % of full scale,"
        " so that no effect needs a name."
    )


def test_names_and_sentences_from_files_are_escaped(tmp_path: Path) -> None:
    made = case("two causes")
    traces = tuple(replace(trace, name=NAME) for trace in made.traces)
    faults = tuple(replace(fault, label=NAME, says=NAME) for fault in made.data_faults)
    hostile = replace(made, says=NAME, unit="m$b", limits=(NAME,), traces=traces, data_faults=faults, leftover=NAME)
    html = write_diagnosis_page(tmp_path / "x.html", hostile, NAME, {NAME: NAME}).read_text(encoding="utf-8")
    assert NAME not in html
    parser = Balance()
    parser.feed(html)
    assert parser.open == []
    assert NAME in plain_text(html)


def test_a_page_of_unusual_data_is_written_all_the_same(tmp_path: Path) -> None:
    """One recording, nothing held out, a load that never turns, a simulation that runs away, samples missing."""
    time_s = np.linspace(0.0, 9.0, 300)
    steady = np.full(300, 500.0)
    runaway = np.where(time_s > 8, np.inf, 1.0)
    usable = time_s > 1
    trace = Trace(
        "t", time_s, steady, np.ones(300), np.zeros(300), runaway, usable, ~usable & usable, np.zeros(300, int), 0
    )
    made = replace(case("one cause"), traces=(trace,), likeness=None, screening=(), gain=None)
    html = write_diagnosis_page(tmp_path / "x.html", made, "t", {}).read_text(encoding="utf-8")
    assert "The error over time" in html
    assert not re.search(r"\b(nan|inf)\b", plain_text(html))
    nothing = replace(trace, usable=np.zeros(300, dtype=bool))
    html = write_diagnosis_page(tmp_path / "y.html", replace(made, traces=(nothing,)), "t", {}).read_text()
    assert "figure class=" not in html
