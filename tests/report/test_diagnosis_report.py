"""The page and the table of a diagnosis: its facts in a person's words, for every verdict, whatever the names are."""

from __future__ import annotations

import math
import re
import tomllib
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from balance import Balance
from browser import Browser
from hypothesis import given
from hypothesis import strategies as st
from looks import look, unfold

from smartshoe.diagnosis import Cause, Diagnosis, Gain, GoodnessOfFit, Trace
from smartshoe.diagnosis._result import NextExperiment, Rival, Statement
from smartshoe.integrity import DataFault
from smartshoe.models.effects import Conditions, Effect, blocks, effect
from smartshoe.models.extended import ExtendedModel
from smartshoe.models.parameter import Parameter
from smartshoe.protocol import Protocol, Segment, dynamic_protocol
from smartshoe.report.diagnosis._charts import faults
from smartshoe.report.diagnosis._page import write_diagnosis_page
from smartshoe.report.diagnosis._protocol_file import protocol_text
from smartshoe.report.diagnosis._sentences import (
    HEADINGS,
    comparison,
    gain_sentence,
    interval,
    is_free_form,
    listed,
    parameter_text,
    shares,
    shares_text,
    sure,
    two_numbers,
    unnamed,
    why_this_one,
)
from smartshoe.report.diagnosis.grids import ranked
from smartshoe.report.diagnosis.terminal import print_diagnosis
from smartshoe.report.diagnosis.views import binned, edges_of, evidence, loops_at_two_rates, worst_cycle

NAME = '<script>alert("1")</script> & $x$'
FULL_LOAD_N, FULL_READING, STEP_S = 800.0, 70.0, 0.02
CASES = ("adequate", "one cause", "two causes", "partly_explained", "unexplained", "refused")
BASELINE = ExtendedModel(1.0, 0.12, 0.2, FULL_LOAD_N, FULL_READING, "mbar")


def _with(name: str, strength: float) -> tuple[Effect, np.ndarray]:
    """An effect with its first strength away from null."""
    one = effect(name)
    values = one.start()
    values[next(k for k, parameter in enumerate(one.parameters) if parameter.null is not None)] = strength
    return one, values


LEAK, PLAY = _with("linear_leak", 0.002), _with("play_hysteresis", 0.012)


def _load(peak_n: float) -> tuple[np.ndarray, np.ndarray]:
    triangles = dynamic_protocol((100.0, 400.0, 800.0), peak_n=peak_n, repeats=2, rest_s=3.0)
    held = (Segment("ramp", peak_n, 2.0), Segment("hold", peak_n, 20.0), Segment("ramp", 0.0, 2.0))
    whole = Protocol("both", (*triangles.segments, *held, Segment("rest", 0.0, 10.0)))
    time_s = np.arange(0.0, whole.duration_s, STEP_S)
    return time_s, whole.load_at(time_s)


@cache
def _traces(parts: tuple[str, ...], found: tuple[str, ...], step_in_gain: float = 0.0) -> tuple[Trace, ...]:
    """Two recordings of a unit with ``parts``, of which the extended model knows those ``found``."""
    rng = np.random.default_rng(3)
    traces = []
    for index, peak_n in enumerate((800.0, 720.0)):
        time_s, load_n = _load(peak_n)
        conditions = Conditions(time_s, load_n / FULL_LOAD_N, STEP_S)
        truth, extended = BASELINE, BASELINE
        for name, (one, values) in (("leak", LEAK), ("play", PLAY)):
            truth = truth.with_part(one, values) if name in parts else truth
            extended = extended.with_part(one, values) if name in found else extended
        reading = truth.reading(conditions) * (1.0 + step_in_gain * (time_s > 30.0)) + rng.normal(0, 0.1, time_s.size)
        traces.append(
            Trace(
                f"triangles_{index + 1}",
                time_s,
                load_n,
                reading,
                BASELINE.reading(conditions),
                extended.reading(conditions),
                np.ones(time_s.size, dtype=bool),
                np.full(time_s.size, index == 1),
                np.minimum(time_s // 8, 11).astype(np.intp),
                index,
            )
        )
    return tuple(traces)


def _goodness(trace: Trace, simulated: np.ndarray, structure: float) -> GoodnessOfFit:
    rmse = float(np.sqrt(np.mean((trace.reading - simulated) ** 2)))
    return GoodnessOfFit(rmse, "mbar", 100 * (1 - rmse / float(np.std(trace.reading))), 12.3 * rmse, structure)


LEAK_CAUSE = Cause(
    LEAK[0],
    0.9931,
    1.0,
    (),
    {"leak_rate": Parameter.from_sd(0.002, 0.00003, "1/s")},
    (Statement("fall", 1234.0, 30.0, "without it the fit is worse by 1234 where 30 would do"),),
    Gain(0.8, 0.31, "mbar", 61.3, (55.0, 66.0)),
    0.011,
    (Rival("zero_drift", 88.0),),
)
PLAY_CAUSE = Cause(
    PLAY[0],
    0.95,
    0.62,
    ("bouc_wen_hysteresis",),
    {"half_height": Parameter.from_sd(9.6, 0.4, "N"), "width": Parameter.from_sd(80.0, math.nan, "N")},
    (Statement("fall", 321.0, 30.0, "without it the fit is worse by 321 where 30 would do"),),
    Gain(0.33, 0.31, "mbar", 6.1, (2.0, 9.0)),
    0.004,
    (Rival("bouc_wen_hysteresis", 1.7, "fit"), Rival("dead_band", 45.0)),
)
RUN_NEXT = (
    "run the protocol minor loops: it should tell play hysteresis and bouc wen hysteresis apart, which this data does"
    " not"
)
LOOPS = Protocol("minor_loops", (Segment("ramp", 400.0, 4.0), Segment("ramp", 200.0, 2.0), Segment("ramp", 0.0, 2.0)))
FAULTS = (
    DataFault("held_samples", 0, "triangles_1", 5.0, 5.6, 0.02, "a value repeats while the load moves", "material"),
    DataFault("spikes", 1, "triangles_2", 40.0, 40.02, 1e-5, "one sample stands alone", "minor"),
)
SCREENING = (("linear_leak", 5000.0), ("zero_drift", 4900.0), ("play_hysteresis", 310.0), ("delay", 0.0))
LIKENESS = np.array([[1, 0.99, 0.2, 0.1], [0.99, 1, 0.2, 0.1], [0.2, 0.2, 1, 0.5], [0.1, 0.1, 0.5, math.nan]])


def case(name: str) -> Diagnosis:
    """A diagnosis made by hand, one for each verdict and for one and two causes."""
    if name == "refused":
        reason = "triangles_1: there is no reference load: name it with --force"
        return Diagnosis(
            "refused", f"no diagnosis: {reason}", "mbar", 0.0, 0.0, data_faults=FAULTS[:1], limits=(reason,)
        )
    both = ("leak", "play")
    traces = {
        "adequate": lambda: _traces((), ()),
        "one cause": lambda: _traces(("leak",), ("leak",)),
        "two causes": lambda: _traces(both, both),
        "partly_explained": lambda: _traces(both, ("leak",)),
        "unexplained": lambda: _traces((), (), 0.02),
    }[name]()
    judged = traces[-1]
    causes = {"one cause": (LEAK_CAUSE,), "two causes": (LEAK_CAUSE, PLAY_CAUSE), "partly_explained": (LEAK_CAUSE,)}
    left = "70 % of the power that is left lies at 50-75 % of full load while unloading"
    made = Diagnosis(
        "explained" if "cause" in name else name,  # type: ignore[arg-type]
        f"the verdict on {name}",
        "mbar",
        FULL_LOAD_N,
        FULL_READING,
        causes=causes.get(name, ()),
        minor=("sensor_lag",) if name == "two causes" else (),
        data_faults=FAULTS if name in ("two causes", "partly_explained") else (),
        baseline=_goodness(judged, judged.baseline, 0.0 if name == "adequate" else 0.7),
        extended=_goodness(judged, judged.extended, 0.2 if name == "partly_explained" else 0.0),
        gain=Gain(0.9, 0.2, "mbar", 77.7, (70.0, 80.0)),
        explainable_percent=3.0 if name == "adequate" else 92.0,
        explained_percent={"adequate": 0.4, "unexplained": 0.0, "partly_explained": 61.0}.get(name, 90.5),
        rivals=(Rival("zero_drift", 88.0),),
        limits=("one loading rate only: nothing can be said of rate dependence",) if name == "one cause" else (),
        leftover=left if name in ("partly_explained", "unexplained") else None,
        screening=SCREENING,
        likeness=LIKENESS,
        traces=traces,
    )
    if name != "two causes":
        return made
    pair = ("play_hysteresis", "bouc_wen_hysteresis")
    return replace(made, next_experiment=NextExperiment(pair, "minor_loops", None, RUN_NEXT, 35.2, LOOPS))


@cache
def page(name: str) -> str:
    """The page's text, written once a case."""
    import tempfile

    with tempfile.TemporaryDirectory() as folder:
        path = write_diagnosis_page(Path(folder) / "diagnosis.html", case(name), "Diagnosis", {"fitted": "a"}, "x.toml")
        return path.read_text(encoding="utf-8")


def plain_text(html: str) -> str:
    """What a person reads: no tags, no style, spaces as one."""
    import html as escapes

    kept = re.sub(r"<style.*?</style>|<script.*?</script>|<!--.*?-->", "", html, flags=re.DOTALL)
    return " ".join(escapes.unescape(re.sub(r"<[^>]+>", " ", kept)).split())


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


def test_likelihood_thresholds_and_limits_are_folded_and_the_thresholds_whole() -> None:
    html = page("two causes")
    for said in (
        "is told in −2 log likelihood",
        "load cells: 0.02 % of rating",
        "A wrong calibration of the sensor itself",
    ):
        before = html[: html.index(said)]
        assert before.count("<details") > before.count("</details>"), said
    assert html.count("<summary>Every number that decides") == 1


def test_figures_for_papers_are_written_when_asked_for(tmp_path: Path) -> None:
    from smartshoe.report.paper.diagnosis import write_figures

    written = {path.name for path in write_figures(tmp_path, case("two causes"), "svg")}
    assert {"diagnosis_worst_cycle.svg", "diagnosis_screening.svg", "diagnosis_error_by_state.svg"} <= written
    assert all((tmp_path / name).read_text(encoding="utf-8").endswith("</svg>\n") for name in written)
    assert write_figures(tmp_path, case("refused"), "svg") == []


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
    assert "2. Play hysteresis: 95 % sure that it is this or bouc wen hysteresis, 62 % for this one" in text
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
        "No other effect of the catalogue does as well; the nearest, zero drift, is less likely by 88 (−2 log, by"
        " evidence). Family:" in text
    )
    assert "In the extended model without being causes, too small or too unsure for a name: sensor lag." in text
    for heading in ("cannot be ruled out", "came near, and is ruled out"):
        assert f"{heading} less likely by, −2 log what it would be what tells the two apart" in text
    assert "bouc wen hysteresis 1.7 (fit) " in text
    assert "dead band 45 (evidence) " in text
    assert "zero drift 88 (evidence) " in text
    assert "of full scale: error of the extended model" in text
    assert "free form" not in text


def test_a_cause_is_said_to_be_less_likely_otherwise_by_what_its_rivals_are_weighed_by() -> None:
    text = "no other effect of the catalogue does as well; the nearest, zero drift, is less likely by 88 (−2 log, by"
    assert why_this_one(LEAK_CAUSE) == f"{text} evidence)"
    assert why_this_one(replace(LEAK_CAUSE, rivals=(Rival("zero_drift", 88.0, "fit"),))) == f"{text} its fit)"
    assert why_this_one(replace(LEAK_CAUSE, rivals=())) == "no other effect of the catalogue comes near"
    several = replace(PLAY_CAUSE, equivalents=("bouc_wen_hysteresis", "dead_band"))
    assert why_this_one(several) == (
        "bouc wen hysteresis and dead band cannot be ruled out, since no equation is exact: take the name as one of 3"
    )


def test_effects_without_a_name_are_told_and_free_forms_as_such() -> None:
    made = case("one cause")
    assert unnamed(made) == ""
    assert unnamed(replace(made, minor=("sensor_lag",))) == "sensor lag"
    assert unnamed(replace(made, minor=("sensor_lag", "flexible_curve", "delay"))) == (
        "curve of free form, delay and sensor lag"
    )


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


def test_a_force_that_the_extended_model_gives_back_worse_is_the_baselines() -> None:
    made = case("one cause")
    (row,) = [one for one in comparison(made) if one.name.startswith("error of the compensated force")]
    assert row.after.endswith(" N")
    assert row.change.endswith(" %")
    (row,) = [
        one
        for one in comparison(replace(made, force_model=BASELINE))
        if one.name.startswith("error of the compensated")
    ]
    assert row.before.endswith(" N")
    assert (row.after, row.change) == ("by the baseline, see the limits", "")


@pytest.mark.parametrize(
    ("explained", "explainable", "said"),
    [
        (0.2, 0.4, "Nearly all of the error's variance is noise, which no model explains."),
        (0.4, 3.0, "97 % of the error's variance is noise; of the rest 13 % is explained."),
        (0.0, 92.0, "8 % of the error's variance is noise; of the rest none is explained."),
        (0.4, 92.0, "8 % of the error's variance is noise; of the rest none is explained."),
        (0.5, 92.0, "8 % of the error's variance is noise; of the rest 1 % is explained."),
        (99.0, 99.5, "Under 1 % of the error's variance is noise; of the rest over 99 % is explained."),
        (92.0, 92.0, "8 % of the error's variance is noise; of the rest 100 % is explained."),
    ],
)
def test_shares_are_said_of_what_is_no_noise(explained: float, explainable: float, said: str) -> None:
    made = replace(case("refused"), explained_percent=explained, explainable_percent=explainable)
    assert shares_text(made) == said


def test_faults_left_over_and_the_next_experiment_are_told() -> None:
    text = plain_text(page("two causes"))
    assert "Held samples, triangles_1, 5.0–5.6 s (2.0 % of the samples): a value repeats while the load moves." in text
    assert "Spikes, triangles_2, 40.00 s (under 0.01 % of the samples): one sample stands alone. (Minor.)" in text
    assert f"What to do next {RUN_NEXT[0].upper()}{RUN_NEXT[1:]}. The protocol is in x.toml : paste it into" in text
    left = "70 % of the power that is left lies at 50-75 % of full load while unloading."
    assert left in plain_text(page("partly_explained"))
    assert "no reference load: name it with --force" in plain_text(page("refused"))


def test_nothing_is_named_where_nothing_was_found() -> None:
    for name in ("adequate", "unexplained"):
        text = plain_text(page(name))
        assert " sure" not in text[: text.index("Every number that decides")]  # of which some say when a name is sure
        assert "Nothing that matters was added." in text
        assert "No cause is named" in text
        assert "Nearest candidates, by what each alone takes off −2 log likelihood: zero drift (88.0)." in text
    why = "No cause may be named; the limits at the end of this page say why where the data is the reason."
    assert why in plain_text(page("unexplained"))
    matters = "No effect moves the reading by enough to matter, so none is named."
    assert matters in plain_text(page("adequate"))


def test_a_block_that_stands_for_a_cause_was_chosen() -> None:
    (block, *_) = blocks()["static_curve"]
    made = replace(case("one cause"), screening=((block.name, 9.0), ("delay", 5.0)))
    assert [bar.kind for bar in ranked(made)] == ["other", "other"]
    stood_for = tuple(replace(cause, part=block.name) for cause in made.causes)
    made = replace(made, causes=stood_for)
    assert [(bar.name, bar.kind) for bar in ranked(made)] == [(block.name, "cause"), ("delay", "other")]


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
    assert "The error over time" in html or "The error before and after" in html
    assert not re.search(r"\b(nan|inf)\b", plain_text(html))
    nothing = replace(trace, usable=np.zeros(300, dtype=bool))
    html = write_diagnosis_page(tmp_path / "y.html", replace(made, traces=(nothing,)), "t", {}).read_text()
    assert "figure class=" not in html


def test_faults_are_drawn_over_the_recording_that_has_them() -> None:
    """The first that was given was left out: it has no trace."""
    (trace, _) = case("one cause").traces
    made = replace(case("one cause"), traces=(replace(trace, recording=1),), data_faults=FAULTS)
    assert [chart.title for chart in faults(made)] == ["triangles_2"]


@pytest.mark.parametrize("name", CASES)
def test_the_terminal_says_the_size_first_then_the_verdict_and_everything_after(
    name: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "240")  # wide enough that no number is folded
    made = case(name)
    print_diagnosis(made, "left_toe")
    lines = capsys.readouterr().out.splitlines()
    verdict = f"{HEADINGS[made.verdict]}."
    if made.verdict == "refused":
        assert lines[0] == f"left_toe: {verdict}"
    else:
        assert lines[0].startswith("left_toe: On data that was not fitted, the simulated reading is off by ")
        assert lines[1] == verdict
    said = "\n".join(lines)
    assert not re.search(r"\b(nan|inf|None)\b", said)
    for cause in made.causes:
        assert cause.name.replace("_", " ") in said
        assert f"{cause.held_out.gain_percent:.0f}" in said
    for text in (*made.limits, made.leftover, *(fault.says for fault in made.data_faults)):
        assert text is None or text in said
    if made.causes:
        assert "[0.001941, 0.002059] 1/s" in said
    if made.next_experiment:
        assert RUN_NEXT in said
    if made.minor:
        assert "in the extended model without being causes, too small or too unsure for a name: sensor lag" in said


def test_a_protocol_becomes_a_table_that_toml_reads_back() -> None:
    steps = Protocol('odd "name" 1', LOOPS.segments)
    table = tomllib.loads(protocol_text(steps, ["why\nit is run " * 30]))["protocol"]["odd_name_1"]
    assert table["kind"] == "segments"
    time_s, load_n = LOOPS.corners()
    np.testing.assert_allclose(np.array(table["corners"]), np.column_stack([time_s, load_n]))


def test_the_worst_cycle_is_the_one_with_the_largest_error_among_those_held_out() -> None:
    traces = _traces((), (), 0.02)
    found = worst_cycle(traces)
    assert found is not None
    assert found.trace is traces[1]
    error = (found.trace.reading - found.trace.baseline) ** 2
    means = [float(error[found.trace.cycle == k].mean()) for k in range(int(found.trace.cycle.max()) + 1)]
    assert float(error[found.span].mean()) == pytest.approx(max(means))


def test_loops_are_taken_at_the_slowest_and_the_fastest_rate() -> None:
    rates = [rate for rate, _ in loops_at_two_rates(_traces((), ()))]
    assert rates == [pytest.approx(100, rel=0.05), pytest.approx(800, rel=0.1)]


def test_bins_keep_the_mean_and_the_spread() -> None:
    x = np.linspace(0.0, 1.0, 10_001)
    noise = np.random.default_rng(0).normal(0.0, 0.1, x.size)
    found = binned(x, 2.0 * x + noise, edges_of(x, 20))
    np.testing.assert_allclose(found.mean, 2.0 * found.x, atol=5 * 0.1 / math.sqrt(500))
    np.testing.assert_allclose(found.sd, math.hypot(0.1, 2 * 0.05 / math.sqrt(12)), rtol=0.2)


def test_residuals_run_on_from_recording_to_recording() -> None:
    traces = _traces((), ())
    found = evidence(traces, FULL_LOAD_N)
    assert found is not None
    assert np.all(np.diff(found.time_s) >= 0)
    assert found.cycle.max() == sum(int(trace.cycle[-1]) + 1 for trace in traces) - 1
    assert found.judged.sum() == traces[1].time_s.size
    assert set(np.unique(found.direction)) == {-1, 0, 1}


percent = st.floats(-50.0, 150.0)


@given(percent, percent)
def test_shares_are_a_whole_whatever_was_estimated(explained: float, explainable: float) -> None:
    part = shares(replace(case("refused"), explained_percent=explained, explainable_percent=explainable))
    assert min(part.explained, part.left, part.noise) >= 0.0
    assert part.explained + part.left + part.noise == pytest.approx(100.0)


@given(st.floats(-1e4, 1e4), st.floats(1e-6, 1e4))
def test_an_interval_keeps_value_and_bounds_to_a_tenth_of_its_half_width(value: float, half: float) -> None:
    said = interval(value, value - half, value + half).replace("−", "-")
    shown = [float(number) for number in re.findall(r"-?\d[\d.e+-]*", said)]
    # Two digits of the half width: half a unit of the second one is a twentieth at most.
    for number, true in zip(shown, (value, value - half, value + half), strict=True):
        assert number == pytest.approx(true, abs=0.06 * half, rel=1e-3)


@given(
    st.lists(st.floats(-1e3, 1e3), min_size=5, max_size=60).filter(lambda x: max(x) - min(x) > 1e-6),
    st.floats(-10.0, 10.0),
)
def test_bins_of_a_constant_are_that_constant(x: list[float], level: float) -> None:
    found = binned(np.array(x), np.full(len(x), level), edges_of(np.array(x), 4))
    filled = np.isfinite(found.mean)
    np.testing.assert_allclose(found.mean[filled], level, atol=1e-12)
    np.testing.assert_allclose(found.sd[filled], 0.0, atol=1e-6)


def test_a_gain_that_is_none_is_not_called_one() -> None:
    assert "it does not fall: −0.84 % [−2.2, 0.41]" in gain_sentence(Gain(0.42, 0.4235, "mbar", -0.84, (-2.2, 0.41)))
    assert parameter_text(Parameter(0.0, 0.0, (0.0, 0.0), "1/K")) == "held at 0 1/K"


def test_a_parameter_at_the_end_of_its_range_is_told_as_such() -> None:
    assert parameter_text(Parameter(50.0, 20.0, (0.5, 50.0), "s")) == "50 [0.5, 50] s, at its limit"
    assert parameter_text(Parameter(0.5, 20.0, (0.5, 50.0), "1")) == "0.5 [0.5, 50], at its limit"
    assert parameter_text(Parameter(20.0, 8.0, (4.3, 35.7), "s")) == "20 [4, 36] s"


@pytest.mark.parametrize(("value", "sd"), [(20.0, 20.0), (50.0, 40.0), (0.5, math.inf)])
def test_a_parameter_that_may_be_anything_within_its_range_is_told_as_no_result(value: float, sd: float) -> None:
    assert parameter_text(Parameter(value, sd, (0.5, 50.0), "s")) == "not determined"


def test_structure_that_no_test_could_have_shown_is_not_called_none() -> None:
    found = case("unexplained")
    assert found.baseline is not None
    assert found.extended is not None
    untested = replace(
        found,
        baseline=replace(found.baseline, structure_rms=math.nan),
        extended=replace(found.extended, structure_rms=math.nan),
    )
    row = comparison(untested)[-1]
    assert (row.before, row.after, row.change) == ("cannot be told", "cannot be told", "–")


def test_limits_come_before_recordings_that_were_left_out_and_none_is_cut_off(
    capsys: pytest.CaptureFixture[str],
) -> None:
    left_out = tuple(f"r{k}.csv: the load stands still" for k in range(90))
    limits = tuple(f"limit number {k} of the data" for k in range(20))
    said_first = (f"left out: {why}" for why in left_out)
    print_diagnosis(replace(case("unexplained"), limits=(*said_first, *limits), left_out=left_out))
    said = capsys.readouterr().out
    assert all(limit in said for limit in limits)
    assert said.index(limits[-1]) < said.index("\n- r0.csv: the load stands still") < said.index("and 78 more")


def test_the_terminal_tells_of_a_name_how_far_it_is_this_one(capsys: pytest.CaptureFixture[str]) -> None:
    print_diagnosis(replace(case("one cause"), causes=(PLAY_CAUSE,)))
    said = " ".join(capsys.readouterr().out.split())
    assert "95 %" in said
    assert "62 %" in said


def test_words_for_numbers() -> None:
    assert interval(50.0, 0.5, 50.0) == "50 [0.5, 50]"
    assert interval(2.0, math.nan, 3.0) == "2.000"
    assert interval(-0.5, -0.6, -0.4) == "−0.50 [−0.60, −0.40]"
    assert sure(0.9999) == "over 99 %"
    assert sure(0.62) == "62 %"
    assert two_numbers(0.17853, 0.17906) == ("0.1785", "0.1791")
    assert listed(["a_b", "c", "d"]) == "a b, c or d"
    part = shares(replace(case("refused"), explained_percent=120.0, explainable_percent=50.0))
    assert (part.explained, part.left, part.noise) == (100.0, 0.0, 0.0)
